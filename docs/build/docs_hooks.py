"""Hooks of mkdocs for this site: generated pages, links into the repository, what a page
counts in the search, equations as MathML (which browsers display without scripts), and the check of
the built links.
"""

import html
import os
import re
from pathlib import Path
from typing import Any

from docs_links import broken_links
from docs_pages import BORROWED, COUNTERPARTS, ROOT, generated, weight
from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

_LINK = re.compile(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]\((?![a-z]+:|#)([^)\s#]+)(#[^)\s]*)?\)")
_EQUATION = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)


def on_files(files: Files, config: Any) -> Files:
    """Add the generated pages."""
    for path, text in generated():
        files.append(File.generated(config, path, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Point links to files of the repository at the page that shows the file, or replace them by
    the name; say what the page counts in the search.
    """
    path = page.file.src_uri
    page.meta["search"] = {"boost": weight(path)}
    return with_links(markdown, path, BORROWED.get(path, f"docs/{path}"))


def with_links(markdown: str, page: str, file: str) -> str:
    """Rewrite the links of a Markdown text, which are relative to `file` in the repository, for
    `page` on the site.
    """

    def lead(found: re.Match[str]) -> str:
        text, link, anchor = found[1], found[2], found[3] or ""
        target = os.path.normpath(os.path.join(os.path.dirname(file), link))
        shown = COUNTERPARTS.get(target)
        if shown is None and target.startswith("docs/"):
            shown = target.removeprefix("docs/")
        if shown is not None:
            return f"[{text}]({os.path.relpath(shown, os.path.dirname(page) or '.')}{anchor})"
        if not (ROOT / target).exists():
            return found[0]  # mkdocs reports that it does not exist
        return text if target.endswith(text) else f"{text} (`{target}`)"

    return _LINK.sub(lead, markdown)


def on_page_content(content: str, page: Any, **_: Any) -> str:
    """Turn the equations into MathML."""

    def equation(found: re.Match[str]) -> str:
        display = "block" if found[2] == "[" else "inline"
        try:
            return convert(html.unescape(found[3]).strip(), display=display)
        except Exception as error:
            raise PluginError(
                f"{page.file.src_uri}: {found[3]}: not a valid equation ({error})"
            ) from error

    return _EQUATION.sub(equation, content)


def on_post_build(config: Any) -> None:
    """Check the links of the pages as built."""
    problems = broken_links(Path(config["site_dir"]))
    if problems:
        raise PluginError("\n".join(["links of the built site:", *problems]))
