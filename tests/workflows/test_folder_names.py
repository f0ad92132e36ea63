"""Folders whose names are no text, as another system made them, or that a terminal cannot show."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gaitval.model.urdf import read_urdf, write_urdf
from gaitval.reporting.printer import print_page
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject

pytestmark = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="other systems allow no such names"
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Named in Latin-1, as in old ZIP archives."""
    made = tmp_path / os.fsdecode(b"\xdcbung")
    made.mkdir()
    return made


def test_a_model_is_written_there(folder: Path) -> None:
    model = scale_subject(load_subject("S05")).model
    write_urdf(model, folder / "model.urdf")
    assert read_urdf(folder / "model.urdf").mass == pytest.approx(model.mass)
    assert [each.name for each in folder.iterdir()] == ["model.urdf"]


def test_a_page_is_printed_there(folder: Path) -> None:
    print_page(folder / "page.pdf", "<p>a</p>", "a4")
    assert (folder / "page.pdf").read_bytes().startswith(b"%PDF")
    assert [each.name for each in folder.iterdir()] == ["page.pdf"]


def test_a_terminal_that_cannot_show_a_name_is_no_fault(tmp_path: Path) -> None:
    ascii_only = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run(
        [sys.executable, "-P", "-m", "gaitval", "report", str(tmp_path / "Übung")],
        env=os.environ | ascii_only, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "internal error" not in done.stderr
