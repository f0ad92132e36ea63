"""Session files with many people: what is read, and that one refusal does not stop the others."""

import csv
from pathlib import Path

import pytest
from typer.testing import CliRunner

from gaitval import cli
from gaitval.configuration import load_configuration
from gaitval.errors import ConfigurationError, RecordError
from gaitval.session.importing import batch_imports
from gaitval.session.importing.batch_imports import TABLE, import_batch, read_batch

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
    people = read_batch([session(tmp_path, text)])

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
    messages = []
    outcomes = import_batch(
        people, tmp_path / "out", load_configuration(), notify=lambda *words: messages.append(words)
    )
    assert tried == ["P01", "P02", "P03"]
    assert not any(outcome.made for outcome in outcomes)
    assert [words[0] for words in messages] == tried
    with (tmp_path / "out" / TABLE).open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == tried
    assert rows[0]["reason"].endswith("stand.c3d: no such file. Check it.")
    assert rows[0]["trials"] == "0 of 2"
    assert len(tables) == 2


def test_the_reason_is_all_that_the_error_says(tmp_path, monkeypatch):
    """Also what to do, which is often in its last line; but not where the page is."""

    def refuse(*_, **__):
        raise RecordError(
            "a.c3d and b.c3d do not show the same person. The largest are\n  LASI to RASI: 3 mm\n"
            "  LKNE to LANK: 2 mm\nUse the standing trial of this session.\n"
            "What was found before this: out/recording/refused.html"
        ).with_way_on("--kinematics-only")

    monkeypatch.setattr(batch_imports, "import_files", refuse)
    (outcome,) = import_batch(
        read_batch([session(tmp_path, PERSON)]), tmp_path / "out", load_configuration()
    )
    assert outcome.reason == (
        "a.c3d and b.c3d do not show the same person. The largest are LASI to RASI: 3 mm LKNE to "
        "LANK: 2 mm Use the standing trial of this session. "
        "To continue without it: --kinematics-only."
    )


def test_people_of_a_session_file_are_those_of_their_names_unless_it_says_otherwise(
    tmp_path, monkeypatch
):
    text = PERSON + PERSON.replace("P01", "P02") + 'person = "P01"\nlaboratory = "Lyon"\n'
    seen = []
    monkeypatch.setattr(
        batch_imports, "import_files", lambda options, *_, **__: seen.append(options)
    )
    monkeypatch.setattr(
        batch_imports,
        "_made",
        lambda person, *_: batch_imports.ImportOutcome(person.name, *6 * [""]),
    )
    import_batch(read_batch([session(tmp_path, text)]), tmp_path / "out", load_configuration())
    assert [(each.person, each.laboratory) for each in seen] == [("P01", None), ("P01", "Lyon")]


def test_a_session_file_is_read_relative_to_itself(tmp_path):
    (person,) = read_batch([session(tmp_path, "\ufeff" + PERSON)])
    assert person.static == tmp_path / "P01" / "stand.c3d"
    assert person.trials[1] == tmp_path / "P01" / "walk2.c3d"
    assert (person.mass, person.height, person.knee_width) == (63.2, None, (0.101, 0.102))
    assert person.kinematics_only
    assert person.halves is None


def test_a_folder_is_every_session_file_in_it(tmp_path):
    session(tmp_path / "a", PERSON)
    session(tmp_path / "b" / "c", PERSON.replace("P01", "P02"))
    assert [person.name for person in read_batch([tmp_path])] == ["P01", "P02"]


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", r"\[\[people\]\].*this one has nothing"),
        ("people = 3", "for each person, and nothing else"),
        (PERSON + "\n[other]\nx = 1", "this one has people, other"),
        ("[[people", "not valid TOML"),
        ("x = " + "[" * 3000, "too deep"),
        (PERSON.replace("63.2", "9" * 6000), "more than 300 digits"),
        ("a" + ".a" * 200 + " = 1", "more than 150 points"),
        (PERSON.replace("sex", "sexe"), r"person 1: sex: missing.* sexe: .* did you mean sex\?"),
        (PERSON.replace("63.2", '"heavy"'), "person 1: mass"),
        (PERSON.replace('name = "P01"', 'name = "../P01"'), "person 1: name"),
        (PERSON.replace('["P01/walk1.c3d", "P01/walk2.c3d"]', "[]"), "person 1: trials"),
        (PERSON * 2, "P01: more than one person of this name"),
    ],
)
def test_what_cannot_be_a_session_is_refused(tmp_path, text, match):
    with pytest.raises(ConfigurationError, match=match):
        read_batch([session(tmp_path, text)])


def test_the_command_takes_several_sessions(tmp_path, monkeypatch):
    """One that is refused does not stop the others, and decides the exit code."""

    def of_one(options, out, **_):
        if out.name == "P02":
            raise RecordError("no such file. Check it.")
        return options

    monkeypatch.setattr(batch_imports, "import_files", of_one)
    monkeypatch.setattr(
        batch_imports,
        "_made",
        lambda person, *_: batch_imports.ImportOutcome(person.name, True, *5 * [""]),
    )
    first = session(tmp_path / "a", PERSON)
    session(tmp_path / "b", PERSON.replace("P01", "P02") + PERSON.replace("P01", "P03"))

    def exit_code(*arguments):
        given = [*map(str, arguments), "--out", str(tmp_path / "out")]
        return CliRunner().invoke(cli.app, ["import", *given]).exit_code

    assert exit_code(first, tmp_path / "b") == 2
    with (tmp_path / "out" / TABLE).open(newline="") as file:
        made = {row["name"]: row["made"] for row in csv.DictReader(file)}
    assert made == {"P01": "True", "P02": "False", "P03": "True"}
    assert exit_code(first) == 0
    assert exit_code(first, first) == 2


def test_options_of_one_recording_are_refused_beside_sessions(tmp_path):
    result = CliRunner().invoke(
        cli.app, ["import", str(session(tmp_path, PERSON)), "--mass", "70", "--out", str(tmp_path)]
    )
    assert isinstance(result.exception, SystemExit)
    assert result.exit_code == 2
    assert "--mass: of one recording" in result.stderr
