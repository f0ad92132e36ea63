"""docs/how-to/import-option.md: what it shows is all that a new option of an import takes."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/how-to/import-option.md"
BLOCKS = re.findall(r"```diff\n--- (\S+)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
NOTE = "left shoe lost"
TRIAL = ["--trial", "no.c3d", "--sex", "F", "--out", "out"]


def changed(text: str, block: str) -> str:
    """The text with a block of a diff applied."""
    lines = block.splitlines()
    before, after = (
        "".join(f"{line[1:]}\n" for line in lines if line[:1] in kept) for kept in (" -", " +")
    )
    assert text.count(before) == 1, before
    return text.replace(before, after)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a copy of the package in which the page was followed."""
    folder = tmp_path_factory.mktemp("changed")
    unread = shutil.ignore_patterns("__pycache__", "baselines", "vendor")
    shutil.copytree(ROOT / "gaitval", folder / "gaitval", ignore=unread)
    for name, block in BLOCKS:
        path = folder / name
        path.write_text(changed(path.read_text(encoding="utf-8"), block), encoding="utf-8")
    return folder


def ran(place: Path, *words: str) -> str:
    """What Python prints in the folder, on both channels."""
    done = subprocess.run(
        [sys.executable, *words],
        cwd=place,
        env=os.environ | {"PYTHONPATH": str(place), "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout + done.stderr


def test_it_touches_two_files() -> None:
    assert len({name for name, _ in BLOCKS}) == len(BLOCKS) == 2


@pytest.mark.slow  # Python has it, by the same declaration
def test_the_command_has_it(place: Path) -> None:
    shown = ran(place, "-m", "gaitval", "import", "--help")
    assert re.search(r"--note .* A remark of the laboratory, kept with the decisions\.", shown)
    assert f"note: {NOTE}" in ran(place, "-m", "gaitval", "import", *TRIAL, "--note", NOTE)
    refused = ran(place, "-m", "gaitval", "import", *TRIAL, "--note", 201 * "x")
    assert "--note = 'xxx" in refused
    assert "at most 200 characters" in refused


@pytest.mark.slow  # Python has it, by the same declaration
def test_a_session_file_has_it(place: Path) -> None:
    text = f'[[people]]\nname = "P01"\nsex = "F"\ntrials = ["no.c3d"]\nnote = "{NOTE}"\n'
    (place / "session.toml").write_text(text)
    told = ran(place, "-m", "gaitval", "imports", "session.toml", "--out", "many")
    assert f"P01: note: {NOTE}" in told


def test_python_has_it(place: Path) -> None:
    code = f"""
import gaitval as gv, inspect
print(inspect.signature(gv.import_session).parameters["note"])
gv.import_session(None, "no.c3d", sex="F", out="out", note="{NOTE}", tell=print)
"""
    told = ran(place, "-c", code)
    assert "note: " in told
    assert f"note {NOTE}" in told
