"""The contents of a page: a list of its headings, each with a link."""

import re
from typing import Final

PLACE: Final = "<!-- contents -->"
"""In a template: where the list goes."""
FEWEST: Final = 4
"""Headings below which a page needs no list."""

_HEADING: Final = re.compile(r"<h2(?P<attributes>[^>]*)>(?P<text>.*?)</h2>", re.DOTALL)
_IDENTIFIER: Final = re.compile(r'\bid="([^"]*)"')
_IN_PAGE: Final = re.compile(r' id="([^"]*)"')
"""That of an element: a page is megabytes long, in which a space is found at once."""


def with_contents(page: str) -> str:
    """`page` (HTML) with identifiers on its second-level headings, and a list of them at the
    comment `PLACE`; no list with fewer than `FEWEST` headings.

    The list is closed at first, so that it is one stop of the tabulator key and does not push the
    result down. A heading keeps the identifier that it has.
    """
    taken = set(_IN_PAGE.findall(page))
    entries: list[str] = []

    def named(found: re.Match[str]) -> str:
        attributes, text = found["attributes"], found["text"]
        plain = re.sub(r"<[^>]*>", "", text).strip()
        own = _IDENTIFIER.search(attributes)
        # links to a heading from elsewhere must stay valid
        identifier = own[1] if own else _free(_slug(plain), taken)
        taken.add(identifier)
        entries.append(f'<li><a href="#{identifier}">{plain}</a></li>')
        added = "" if own else f' id="{identifier}"'
        return f"<h2{attributes}{added}>{text}</h2>"

    changed = _HEADING.sub(named, page)
    if len(entries) < FEWEST:
        return page.replace(PLACE, "")
    listed = "\n".join(entries)
    return changed.replace(
        PLACE,
        '<nav class="contents" aria-label="Contents">'
        f"<details><summary>Contents</summary>\n<ol>\n{listed}\n</ol></details></nav>",
        1,
    )


def _slug(text: str) -> str:
    """A heading as an identifier: small letters and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "part"


def _free(wanted: str, taken: set[str]) -> str:
    number, name = 1, wanted
    while name in taken:
        number += 1
        name = f"{wanted}-{number}"
    return name
