"""Session files with many people: what is read."""

from pathlib import Path

import pytest

from gaitval.errors import ConfigurationError
from gaitval.session.batch import read_batch

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


def test_a_session_file_is_read_relative_to_itself(tmp_path):
    (person,) = read_batch(session(tmp_path, "\ufeff" + PERSON))
    assert person.static == tmp_path / "P01" / "stand.c3d"
    assert person.trials[1] == tmp_path / "P01" / "walk2.c3d"
    assert (person.mass, person.height, person.knee_width) == (63.2, None, (0.101, 0.102))
    assert person.kinematics_only
    assert person.halves is None


def test_a_folder_is_every_session_file_in_it(tmp_path):
    session(tmp_path / "a", PERSON)
    session(tmp_path / "b" / "c", PERSON.replace("P01", "P02"))
    assert [person.name for person in read_batch(tmp_path)] == ["P01", "P02"]


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
        read_batch(session(tmp_path, text))


def test_missing_files_and_empty_folders_are_refused(tmp_path):
    with pytest.raises(ConfigurationError, match="no such file"):
        read_batch(tmp_path / "no.toml")
    with pytest.raises(ConfigurationError, match=r"no session\.toml in this folder"):
        read_batch(tmp_path)


def test_a_key_of_an_earlier_session_file_is_read_and_said(tmp_path):
    said = []
    text = PERSON + "feet_flat = false\n"
    (person,) = read_batch(session(tmp_path, text), lambda *words: said.append(words))
    assert person.feet_not_flat
    ((step, sentence),) = said
    assert step == "session"
    assert "person 1: feet_flat is read as feet_not_flat = true; write that" in sentence
    (person,) = read_batch(session(tmp_path, PERSON + "feet_flat = true\n"))
    assert not person.feet_not_flat
