"""What sentences of verdicts say, and the rows of a page."""

import html
import re
from typing import NamedTuple

SENSES = (
    r"(?P<failed>\b[Ff]ail(?:ed|s)?\b|FAILED)|"
    r"(?P<kept>\bkept\b|(?<!not )\bmet\b|(?<!-)\bpass(?:es|ed)?\b)"
)


def says(text: str) -> str:
    """Whether a sentence says, first of all, that limits were "kept" or "failed"."""
    found = re.search(SENSES, text)
    return "" if found is None else str(found.lastgroup)


class Row(NamedTuple):
    """A row of a table: whether it is marked as failed, its cells, and the class of each word."""

    failed: bool
    cells: list[str]
    marked: list[tuple[str, str]]


def rows_of(page: str) -> list[Row]:
    """The rows of all tables of a page."""
    return [
        Row(
            "failed" in (re.search(r'class="([^"]*)"', given) or [""])[0],
            [plain(each) for each in re.findall(r"<td.*?>(.*?)</td>", inner, re.S)],
            [
                (kind, plain(message))
                for kind, message in re.findall(
                    r'<(?:span|strong) class="(pass|fail)">(.*?)</(?:span|strong)>', inner, re.S
                )
            ],
        )
        for given, inner in re.findall(r"<tr(.*?)>(.*?)</tr>", page, re.S)
    ]


def headline(page: str, which: int = 0) -> tuple[bool, str]:
    """The sentence of a verdict, and whether it is marked as failed."""
    kind, inner = re.findall(r'<p class="(headline[^"]*)">(.*?)</p>', page, re.S)[which]
    return "fail" in kind or 'class="fail"' in inner, plain(inner)


def plain(text: str) -> str:
    """Without tags, entities and line breaks."""
    return " ".join(html.unescape(re.sub(r"<[^>]*>", "", text)).split())
