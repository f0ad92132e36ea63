"""docs/how-to/extend.md: what it shows is all that a new option of an import takes."""

import re
from pathlib import Path

import pytest
from followed_page import blocks_of, followed, ran

PAGE = "extend.md#add-an-option-to-the-import"
NOTE = "left shoe lost"
TRIAL = ["--trial", "no.c3d", "--sex", "F", "--out", "out"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a copy of the package in which the page was followed."""
    return followed(PAGE, tmp_path_factory.mktemp("changed"))


def test_it_touches_two_files() -> None:
    assert len({block.file for block in blocks_of(PAGE)}) == len(blocks_of(PAGE)) == 2


@pytest.mark.slow  # Python has it, by the same declaration
def test_the_command_has_it(place: Path) -> None:
    shown = ran(place, "-P", "-m", "gaitval", "import", "--help")
    assert re.search(r"--note .* A remark of the laboratory, kept with the decisions\.", shown)
    assert f"note: {NOTE}" in ran(place, "-P", "-m", "gaitval", "import", *TRIAL, "--note", NOTE)
    refused = ran(place, "-P", "-m", "gaitval", "import", *TRIAL, "--note", 201 * "x")
    assert "--note = 'xxx" in refused
    assert "at most 200 characters" in refused


@pytest.mark.slow  # Python has it, by the same declaration
def test_a_session_file_has_it(place: Path) -> None:
    text = f'[[people]]\nname = "P01"\nsex = "F"\ntrials = ["no.c3d"]\nnote = "{NOTE}"\n'
    (place / "session.toml").write_text(text)
    message = ran(place, "-P", "-m", "gaitval", "import", "session.toml", "--out", "many")
    assert f"P01: note: {NOTE}" in message


def test_python_has_it(place: Path) -> None:
    code = f"""
import gaitval as gv, inspect
print(inspect.signature(gv.import_session).parameters["note"])
gv.import_session(None, "no.c3d", sex="F", out="out", note="{NOTE}", notify=print)
"""
    message = ran(place, "-c", code)
    assert "note: " in message
    assert f"note {NOTE}" in message
