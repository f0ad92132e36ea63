"""The contents list of a page, and the way past it."""

import re

from html_page import Page

from gaitval.reporting.contents import FEWEST, with_contents

PLACE = "<!-- contents: Contents -->"
HEADINGS = ("Joint angles", "Späte Größe", '<em lang="en">Joint angles</em>', "%")


def page_of(*headings: str, first: str = "") -> str:
    found = "".join(f"<h2>{each}</h2>" for each in headings)
    return f"<body>{PLACE}<main>{first}{found}</main></body>"


def test_every_heading_is_listed_and_found() -> None:
    page = with_contents(page_of(*HEADINGS, first='<h2 lang="en" id="own">Own</h2>'))
    links = re.findall(r'<li><a href="#([^"]*)">([^<]*)</a></li>', page)
    assert links == [
        ("own", "Own"),
        ("joint-angles", "Joint angles"),
        ("spate-groe", "Späte Größe"),
        ("joint-angles-2", "Joint angles"),
        ("part", "%"),
    ]
    read = Page(page)
    assert read.identifiers == [name for name, _ in links]
    assert '<h2 lang="en" id="own">Own</h2>' in page
    assert page.index("<nav") < page.index("<main>")
    assert PLACE not in page


def test_a_short_page_has_no_list() -> None:
    page = with_contents(page_of(*HEADINGS[: FEWEST - 1]))
    assert page == page_of(*HEADINGS[: FEWEST - 1]).replace(PLACE, "")
