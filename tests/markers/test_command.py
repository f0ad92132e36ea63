"""`gaitval markers`: writes a set that an import reads, and says how to go on."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitval.cli.markers import markers
from gaitval.errors import GaitvalError
from gaitval.mocap import reading
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_sets import load_marker_set

NAMES = ("RASI", "LASI", "RKNE", "LKNE", "RTOE", "LTOE", "M01")


@pytest.fixture(autouse=True)
def _recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = Recording("stand.c3d", "project", NAMES, np.zeros((5, len(NAMES), 3)), 100.0)
    monkeypatch.setattr(reading, "read_recording", lambda path, plates=True: recording)


def test_a_set_and_the_command_that_goes_on(tmp_path: Path) -> None:
    out = tmp_path / "mine.toml"
    done = CliRunner().invoke(markers.app, ["stand.c3d", "--out", str(out)])
    assert done.exit_code == 0, done.output
    words = " ".join(done.output.split())
    assert "4 of 7 markers" in words
    assert f"gaitval import --static STAND --trial WALK --marker-set {out} --mass KG" in words
    assert set(load_marker_set(out).markers) == set(NAMES[:4])
    # Never over a file that may have been corrected by hand.
    again = CliRunner().invoke(markers.app, ["stand.c3d", "--out", str(out)])
    assert isinstance(again.exception, GaitvalError)
    assert "may have been corrected by hand" in str(again.exception)


@pytest.mark.parametrize("name", ["set.txt", "afile/x.toml", f"{'x' * 300}.toml"])
def test_where_nothing_can_be_written_is_told(name: str, tmp_path: Path) -> None:
    (tmp_path / "afile").write_text("")
    done = CliRunner().invoke(markers.app, ["stand.c3d", "--out", str(tmp_path / name)])
    assert isinstance(done.exception, GaitvalError)
    assert done.exception.exit_code == 2
