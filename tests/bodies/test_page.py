"""The page of a body: sentences first, then the picture, then the tables."""

from pathlib import Path

from body_result import MODEL, made_up

from gaitval_bodies.page import tables, write_body_page
from gaitval_bodies.words import sentences


def test_sentences_come_before_the_picture_and_the_tables(tmp_path: Path) -> None:
    found = made_up(0.5, 0.004)
    page = write_body_page(tmp_path / "body.html", "S05", found, MODEL).read_text("utf-8")
    said = sentences(found, MODEL).replace("'", "&#39;")
    titles = [title.replace("'", "&#39;") for title, _ in tables(found, MODEL)]
    places = [page.index(each) for each in (said, "<svg", *(f"<h2>{each}" for each in titles))]
    assert places == sorted(places)


def test_every_parameter_and_error_has_its_row() -> None:
    (_, body), (_, errors), (_, trials) = tables(made_up(0.5, 0.004), MODEL)
    assert len(body) == 1 + 14 + 4
    assert "forefoot forward" in {row[0] for row in errors}
    assert len(trials) == 4
