"""Imports of many people: one refusal does not stop the others."""

import csv
from pathlib import Path

from gaitval.configuration import load_configuration
from gaitval.errors import RecordError
from gaitval.session.batch import read_batch
from gaitval_formats import batch_imports
from gaitval_formats.batch_imports import TABLE, import_batch

PERSON = """
[[people]]
name = "P01"
sex = "F"
static = "P01/stand.c3d"
trials = ["P01/walk1.c3d", "P01/walk2.c3d"]
mass = 63.2
knee_width = [0.101, 0.102]
kinematics_only = true
"""


def session(folder: Path, text: str, name: str = "session.toml") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_one_that_is_refused_does_not_stop_the_others(tmp_path, monkeypatch):
    """Every person's outcome is in the table, also if the program ends after the first."""
    tried, tables = [], []
    text = PERSON + PERSON.replace("P01", "P02") + PERSON.replace("P01", "P03")
    people = read_batch(session(tmp_path, text))

    def refuse(options, out, **_):
        assert options.knee_width == (0.101, 0.102)
        assert options.mass == 63.2
        assert options.citation == "Own recording, not published"
        assert options.person == out.name
        tried.append(out.name)
        if (tmp_path / "out" / TABLE).exists():
            tables.append((tmp_path / "out" / TABLE).read_text())
        raise RecordError(f"{options.static}: no such file.\nCheck it.")

    monkeypatch.setattr(batch_imports, "import_files", refuse)
    said = []
    outcomes = import_batch(
        people, tmp_path / "out", load_configuration(), tell=lambda *words: said.append(words)
    )
    assert tried == ["P01", "P02", "P03"]
    assert not any(outcome.made for outcome in outcomes)
    assert [words[0] for words in said] == tried
    with (tmp_path / "out" / TABLE).open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == tried
    assert rows[0]["reason"].endswith("stand.c3d: no such file.")
    assert rows[0]["trials"] == "0 of 2"
    assert len(tables) == 2


def test_people_of_a_session_file_are_those_of_their_names_unless_it_says_otherwise(
    tmp_path, monkeypatch
):
    text = PERSON + PERSON.replace("P01", "P02") + 'person = "P01"\nlaboratory = "Lyon"\n'
    seen = []
    monkeypatch.setattr(
        batch_imports, "import_files", lambda options, *_, **__: seen.append(options)
    )
    monkeypatch.setattr(
        batch_imports, "_made", lambda person, *_: batch_imports.Outcome(person.name, *6 * [""])
    )
    import_batch(read_batch(session(tmp_path, text)), tmp_path / "out", load_configuration())
    assert [(each.person, each.laboratory) for each in seen] == [("P01", None), ("P01", "Lyon")]
