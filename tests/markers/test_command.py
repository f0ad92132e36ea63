"""`gaitval markers`: writes a set and its picture, says what it left, and how to go on."""

import re
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitval.cli.markers import markers
from gaitval.errors import GaitvalError
from gaitval.mocap import reading
from gaitval.mocap.recording import Recording
from gaitval.scaling.landmarks import landmarks_of
from gaitval.scaling.marker_sets import load_marker_set


@pytest.fixture(autouse=True)
def _drawn(stander: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "read_recording", lambda path, plates=True: stander)


def test_a_set_a_picture_and_the_command_that_goes_on(tmp_path: Path) -> None:
    out = tmp_path / "mine.toml"
    done = CliRunner().invoke(
        markers.app, ["walk.c3d", "--standing", "stand.c3d", "--out", str(out)]
    )
    assert done.exit_code == 0, done.output
    words = " ".join(done.output.split())
    assert f"gaitval import --static stand.c3d --trial walk.c3d --marker-set {out}" in words
    assert "RKNE" in out.read_text(encoding="utf-8")
    assert "Not to be imported yet" not in words
    picture = out.with_suffix(".svg").read_text(encoding="utf-8")
    assert picture.count("<svg") == 1
    assert all(f"<!-- {axis}, m -->" in picture for axis in ("to the right", "forward", "height"))
    # Never over a file that may have been corrected by hand.
    again = CliRunner().invoke(markers.app, ["walk.c3d", "--out", str(out)])
    assert isinstance(again.exception, GaitvalError)
    assert "may have been corrected by hand" in str(again.exception)


def test_what_an_import_would_miss_is_said_with_the_line_that_goes_on(
    stander: Recording, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Labels that mean nothing leave the forefeet to the user, and the import would refuse that."""
    named = replace(stander, names=tuple(f"M{n:02d}" for n in range(len(stander.names))))
    monkeypatch.setattr(reading, "read_recording", lambda path, plates=True: named)
    out = tmp_path / "mine.toml"
    done = CliRunner().invoke(markers.app, ["walk.c3d", "--out", str(out)])
    assert done.exit_code == 0, done.output
    message = " ".join(done.output.split()).partition("Not to be imported yet: ")[2]
    assert re.match(
        r"markers missing from the standing pose: .*R\.MT1.*L\.MT1.* Take the #", message
    )
    marked = load_marker_set(out)
    with pytest.raises(GaitvalError, match=r"missing from the standing pose.*R\.MT1"):
        landmarks_of(
            {mark.landmark: np.zeros(3) for mark in marked.markers.values() if mark.landmark},
            None,
            None,
        )


def test_another_ending_is_refused(tmp_path: Path) -> None:
    done = CliRunner().invoke(markers.app, ["walk.c3d", "--out", str(tmp_path / "set.txt")])
    assert isinstance(done.exception, GaitvalError)
    assert done.exception.exit_code == 2
    assert not list(tmp_path.iterdir())


def test_a_marker_that_is_never_seen_is_left_out_without_a_word_of_numpy(
    stander: Recording, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    lost = np.full_like(stander.markers[:, :1], np.nan)
    there = replace(
        stander, names=(*stander.names, "Lost"), markers=np.hstack([stander.markers, lost])
    )
    monkeypatch.setattr(reading, "read_recording", lambda path, plates=True: there)
    out = tmp_path / "mine.toml"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        done = CliRunner().invoke(markers.app, ["walk.c3d", "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "Lost" not in out.read_text(encoding="utf-8")


def test_more_points_than_anybody_wears_are_refused(
    stander: Recording, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    many = replace(
        stander,
        names=tuple(f"{name} of muscle {i}" for name in stander.names for i in range(8)),
        markers=np.repeat(stander.markers, 8, axis=1),
    )
    monkeypatch.setattr(reading, "read_recording", lambda path, plates=True: many)
    done = CliRunner().invoke(markers.app, ["walk.c3d", "--out", str(tmp_path / "mine.toml")])
    assert isinstance(done.exception, GaitvalError)
    assert "more than the 120 that are matched to a body" in str(done.exception)


def test_why_nothing_is_used_unseen_is_said(
    stander: Recording, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    count = len(stander.names)
    names = tuple(f"M{number}" for number in range(count))
    markers_away = stander.markers + np.where(np.arange(count) % 3 == 0, 1.5, 0.0)[:, None]
    lying = replace(stander, names=names, markers=markers_away)
    monkeypatch.setattr(reading, "read_recording", lambda path, plates=True: lying)
    out = tmp_path / "mine.toml"
    done = CliRunner().invoke(
        markers.app, ["walk.c3d", "--standing", "stand.c3d", "--out", str(out)]
    )
    assert done.exit_code == 0, done.output
    words = " ".join(done.output.split())
    assert "The body was not recognised, so nothing is used unseen" in words
    assert f"0 of {count} markers" in words
    assert "# The body was not recognised" in out.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["afile/x.toml", f"{'x' * 300}.toml"])
def test_where_nothing_can_be_written_is_told(name: str, tmp_path: Path) -> None:
    (tmp_path / "afile").write_text("")
    done = CliRunner().invoke(markers.app, ["walk.c3d", "--out", str(tmp_path / name)])
    assert isinstance(done.exception, GaitvalError)


def test_a_picture_is_not_overwritten_either(tmp_path: Path) -> None:
    (tmp_path / "mine.svg").write_text("mine")
    done = CliRunner().invoke(markers.app, ["walk.c3d", "--out", str(tmp_path / "mine.toml")])
    assert "mine.svg is there" in str(done.exception)
    assert (tmp_path / "mine.svg").read_text() == "mine"
