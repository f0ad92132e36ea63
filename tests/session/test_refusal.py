"""The page of an import that was refused says how far it came."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from html_page import only_html
from verdict_words import rows_of

from gaitval.errors import RecordError
from gaitval.gait.quality_flags import QualityFlag
from gaitval.importing import refusal
from gaitval.session import session as session_module
from gaitval.session.request import Request
from gaitval.session.session import ImportProgress, _usable_walks

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


def test_a_fault_of_every_trial_is_refused_with_all_plates_and_trials(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The last trial alone would name one of the two plates."""

    def trial(*given: Any) -> SimpleNamespace:
        name, recording = given[4:6]
        plate = {"one": "1", "two": "2", "three": "2"}[name]
        turned = QualityFlag(
            "push", f"plate {plate}", float(len(name)), 0.0, "1", f"pushed by {len(name)} %: "
            f"--plate {plate}=x", certain=name == "two", plate=plate,
        )  # fmt: skip
        return SimpleNamespace(name=name, warnings=(turned,), recording=recording)

    monkeypatch.setattr(session_module, "work_out_trial", trial)
    names = ("one", "two", "three")
    walks = tuple(SimpleNamespace(source=f"{name}.c3d", plates=(1, 2)) for name in names)
    session: Any = SimpleNamespace(walking=walks)
    nothing: Any = SimpleNamespace()
    request: Any = SimpleNamespace(called=lambda number: names[number])
    known = ImportProgress(session=session, body=nothing)
    with pytest.raises(RecordError) as caught:
        _usable_walks(request, nothing, known, lambda *_: None)
    message = str(caught.value)
    assert all(name in message.splitlines()[0] for name in names)
    assert "--plate 1=x" in message
    assert "--plate 2=x" in message
    assert "plate 2 in two" in message  # beside "three", which is farther beyond
    assert caught.value.goes_on == ("--kinematics-only",)
