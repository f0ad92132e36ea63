"""The contents list of a page, and the way past it."""

import re

from html_page import Page

from gaitval.reporting.contents import FEWEST, PLACE, with_contents
from gaitval.reporting.page import _resource
from gaitval.reporting.printer import lay_out

HEADINGS = ("Joint angles", "Moments, Nm/kg", '<em class="x">Joint angles</em>', "%")


def page_of(*headings: str, first: str = "") -> str:
    found = "".join(f"<h2>{each}</h2>" for each in headings)
    return f"<body>{PLACE}<main>{first}{found}</main></body>"


def test_every_heading_is_listed_and_found() -> None:
    page = with_contents(page_of(*HEADINGS, first='<h2 class="x" id="own">Own</h2>'))
    links = re.findall(r'<li><a href="#([^"]*)">([^<]*)</a></li>', page)
    assert links == [
        ("own", "Own"),
        ("joint-angles", "Joint angles"),
        ("moments-nm-kg", "Moments, Nm/kg"),
        ("joint-angles-2", "Joint angles"),
        ("part", "%"),
    ]
    read = Page(page)
    assert read.identifiers == [name for name, _ in links]
    assert '<h2 class="x" id="own">Own</h2>' in page
    assert page.index("<nav") < page.index("<main>")
    assert PLACE not in page


def test_a_short_page_has_no_list() -> None:
    page = with_contents(page_of(*HEADINGS[: FEWEST - 1]))
    assert page == page_of(*HEADINGS[: FEWEST - 1]).replace(PLACE, "")


def test_the_pages_listed_are_those_of_the_headings(tmp_path) -> None:
    """WeasyPrint first lays the list out with a 0 for every page. Where "12" took a line more, the
    headings after it moved on, and all of a report were listed a page early.
    """
    for length in (39, 40, 41, 42):  # one of them filled the line but for a digit
        headings = "".join(
            f'<h2>{each}</h2><figure style="height: 126.2mm; break-inside: avoid">.</figure>'
            for each in ("aaaaaaaaaa " + length * "b", "Second", "Third", "Fourth")
        )
        pages = 10 * '<p style="break-after: page">.</p>' + '<p style="height: 100mm">.</p>'
        head = f"<head><style>{_resource('report.css')}</style></head>"
        page = with_contents(f"<html>{head}<body>{pages}{PLACE}{headings}</body>")
        own = tmp_path / str(length)
        own.mkdir()
        printed = lay_out(page, "a4", own)
        listed = {
            box.element.get("href")[1:]: int(box.text.strip(". "))
            for page in printed.pages
            for box in page._page_box.descendants()
            if box.element_tag == "a::after" and getattr(box, "text", "").strip(". ")
        }
        found = {
            name: number
            for number, page in enumerate(printed.pages, 1)
            for name in page.anchors
            if name in listed
        }
        assert len(listed) == 4
        assert listed == found
