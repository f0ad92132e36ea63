"""Figures in running text come from the claims."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs" / "build"))

import fed_figures  # noqa: E402


def test_a_figure_is_written_in_its_format_and_the_rest_stays() -> None:
    page = (
        "of <!-- claim: a, b: c :: .2f -->9<!-- end --> and <!-- claim: d :: .0% --><!-- end -->."
    )
    found = fed_figures.fed(page, {"a, b: c": 1.234, "d": 0.943}, "page.md")
    assert found == (
        "of <!-- claim: a, b: c :: .2f -->1.23<!-- end --> and "
        "<!-- claim: d :: .0% -->94 %<!-- end -->."
    )
    assert fed_figures.fed(found, {"a, b: c": 1.234, "d": 0.943}, "page.md") == found


def test_a_claim_that_there_is_not_is_named_with_its_page() -> None:
    with pytest.raises(ValueError, match=r"page\.md.*'gone'"):
        fed_figures.fed("<!-- claim: gone :: .1f -->1.0<!-- end -->", {}, "page.md")


def test_the_papers_table_says_what_differs() -> None:
    rows = dict(
        line.strip("| ").split(" | ", 1) for line in fed_figures.people_table().splitlines()[2:]
    )
    assert len(rows) == 10
    assert rows["S05"].endswith("| mass, height")
    assert "153 kg, 64 cm" in rows["S05"]
    assert rows["S02"].endswith("| sex")
