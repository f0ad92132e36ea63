"""The page of a body: sentences first, then the picture, then the tables."""

from pathlib import Path

import pytest
from body_result import MODEL, made_up
from seen_figures import figure_of

from gaitval.identification.body_words import sentences
from gaitval.reporting.body_bars import draw
from gaitval.reporting.body_page import tables, write_body_page


def test_sentences_come_before_the_picture_and_the_tables(tmp_path: Path) -> None:
    found = made_up(0.5, 0.004)
    page = write_body_page(tmp_path / "body.html", "S05", found, MODEL).read_text("utf-8")
    message = sentences(found, MODEL).replace("'", "&#39;")
    titles = [title.replace("'", "&#39;") for title, _ in tables(found, MODEL)]
    places = [page.index(each) for each in (message, "<svg", *(f"<h2>{each}" for each in titles))]
    assert places == sorted(places)


def test_every_parameter_and_error_has_its_row() -> None:
    (_, body), (_, errors) = tables(made_up(0.5, 0.004), MODEL)
    assert len(body) == 1 + 14 + 4
    assert "forefoot forward" in {row[0] for row in errors}


def test_a_row_has_its_unit_and_the_decimals_of_it() -> None:
    (_, body), (_, errors) = tables(made_up(0.5, 0.004), MODEL)
    rows = {row[0]: row[1:] for row in body}
    # of a joint 0.1 mm, of a factor on a length (0.4 m) half of that
    assert rows["damping"][:2] == ["Nms/rad", "0.10"]
    assert rows["thigh_length"][:2] == ["1", "1.000"]
    assert rows["hip_x"][0] == rows["hip to knee: change"][0] == "mm"
    numbers = [cell for row in (*body[1:], *errors[1:]) for cell in row[2:5]]
    assert not any(cell.startswith("-") or "e-" in cell for cell in numbers)
    assert {row[1] for row in errors[1:]} == {"mm", "% of the excursion", "% of the speed"}


def test_each_parameter_has_its_mean_and_one_sd_beside_its_own_name() -> None:
    given = [("a", -0.5, 0.3), ("b", 1.5, 0.7), ("c", 0.2, 1.0)]
    (axes,) = figure_of(lambda: draw(given)).axes
    names = [each.get_text() for each in axes.get_yticklabels()]
    heights = dict(zip(names, axes.get_yticks(), strict=True))
    assert heights["a"] > heights["b"] > heights["c"]  # the first at the top
    assert axes.get_ylim()[0] < axes.get_ylim()[1]
    assert axes.get_xlim()[0] < axes.get_xlim()[1]
    (points,) = [each for each in axes.lines if each.get_marker() == "o"]
    found = {y: x for x, y in points.get_xydata()}
    whiskers = [each.get_xydata() for each in axes.lines if each.get_marker() == "|"]
    ends = {segment[0, 1]: sorted(segment[:, 0]) for segment in whiskers}
    for name, mean, sd in given:
        assert found[heights[name]] == mean
        assert ends[heights[name]] == pytest.approx([mean - sd, mean + sd])
    boxes = [each.get_xy()[:, 0] for each in axes.patches]
    assert {(each.min(), each.max()) for each in boxes} == {(-1.0, 1.0)}  # ± 1 SD before
    assert len(boxes) == len(given)
