"""Check the links of the built site: each leads to an existing file and anchor, and no page loads
anything from the network.
"""

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADS = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src")}
"""Attributes whose target a browser loads automatically."""
HINTS = {"canonical", "next", "prev", "edit"}
"""Relations of a <link> that load nothing."""


class _Page(HTMLParser):
    """Anchors and links of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[tuple[str, bool]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors |= {given[name] for name in ("id", "name") if name in given}
        for name in ("href", "src"):
            if name in given and given.get("rel") not in HINTS:
                self.links.append((given[name], (tag, name) in LOADS))


def broken_links(site: Path) -> list[str]:
    """Problems with the links of all pages of a built site; empty if all is well."""
    pages = {path.resolve(): _Page() for path in site.rglob("*.html")}
    for path, page in pages.items():
        page.feed(path.read_text(encoding="utf-8"))
    problems = []
    for path, page in pages.items():
        for link, loads in page.links:
            place = f"{path.relative_to(site.resolve())}: {link}"
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                if loads and parts.scheme != "data":
                    problems.append(f"{place} is loaded from the network")
                continue
            if path.name == "404.html":
                continue  # the error page has links from the root of a server
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.exists():
                problems.append(f"{place} leads to no file")
            elif (
                parts.fragment
                and target in pages
                and unquote(parts.fragment) not in pages[target].anchors
            ):
                problems.append(f"{place} leads to no such anchor")
    return problems
