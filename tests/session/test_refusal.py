"""The page of an import that was refused says how far it came."""

from dataclasses import replace
from pathlib import Path

import pytest
from html_page import only_html
from verdict_words import rows_of

from gaitval.errors import RecordError
from gaitval.importing import refusal
from gaitval.session.request import Request
from gaitval.session.session import ImportProgress

ASKED = Request(
    identifier="S", sex="F", mass=60.0, height=1.6,
    static=Path("static.c3d"), trials=(Path("walk.c3d"),),
)  # fmt: skip


@pytest.mark.parametrize("reached", [0, 1, 2])
def test_what_was_done_is_told_from_where_it_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    reached: int,
) -> None:  # fmt: skip
    only_html(monkeypatch)
    monkeypatch.setattr(refusal, "_finished", lambda *_: [])
    parts = {"session": object(), "body": object()}
    progress = replace(ImportProgress(), **dict(list(parts.items())[:reached]))
    page = refusal.write_refusal(tmp_path, ASKED, progress, RecordError("no"))
    rows = [each for each in rows_of(page.read_text(encoding="utf-8")) if len(each.cells) == 2][:4]
    states = ["done"] * reached + ["ended here"] + ["not reached"] * (3 - reached)
    assert [each.cells[1] for each in rows] == states
    marks = {"done": ["pass"], "ended here": ["fail"], "not reached": []}
    assert [[mark for mark, _ in each.marked] for each in rows] == [marks[s] for s in states]
