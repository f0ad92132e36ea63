"""Results print themselves, become tidy tables, and come back from a file as they were."""

from pathlib import Path

import numpy as np
import pytest
from synthetic_recording import Rectangle, walk

import gaitval as gv
from gaitval._internal.text.frames import COLUMNS
from gaitval.errors import ArtefactError
from gaitval.kinetics.inverse.scaled_markers import MarkedBody
from gaitval.metrics.tolerances import Registry
from gaitval.mocap.recording import Recording


def test_a_subject(tmp_path: Path):
    subject = gv.load_subject(5)
    assert repr(subject).startswith("Subject S05")
    assert f"{subject.mass_kg:.4g} kg" in " ".join(repr(subject).split())
    frame = subject.to_frame()
    assert tuple(frame.columns) == COLUMNS
    knee = frame[(frame.side == "left") & (frame.quantity == "knee_angle")]
    assert knee.percent.tolist() == list(range(101))
    angle = subject.record().angles["knee_angle_l"](np.linspace(0.0, 1.0, 101))
    np.testing.assert_allclose(knee.value, np.degrees(angle))
    subject.save(tmp_path / "subject.toml")
    assert gv.load_subject(tmp_path / "subject.toml").to_toml() == subject.to_toml()


def test_a_body(tmp_path: Path):
    body = gv.scale(gv.load_subject(5))
    assert "thigh" in repr(body)
    assert tuple(body.to_frame().columns) == COLUMNS
    body.save(tmp_path)
    again = MarkedBody.load(tmp_path)
    assert again.frame().equals(body.frame())
    assert again.model.mass == pytest.approx(body.model.mass, abs=1e-9)
    for ours, theirs in zip(again.markers, body.markers, strict=True):
        assert (ours.name, ours.segment) == (theirs.name, theirs.segment)
        np.testing.assert_allclose(ours.position, theirs.position, atol=1e-9)


def test_a_recording(tmp_path: Path):
    made = recording = walk(1.0, plates=[Rectangle((-1.0, 3.0), (-1.0, 1.0))])
    assert "force plates" in repr(recording)
    assert len(recording.to_frame()) == made.markers.size
    recording.save(tmp_path / "walk.npz")
    again = Recording.load(tmp_path / "walk.npz")
    np.testing.assert_array_equal(again.markers, made.markers)
    np.testing.assert_array_equal(again.plates[0].moment, made.plates[0].moment)
    assert (again.names, again.events, again.force_rate) == (made.names, (), made.force_rate)


def test_a_recording_turned_is_still_one():
    recording = walk(0.5)
    assert isinstance(recording.turned(np.eye(3)), Recording)


def test_limits(tmp_path: Path):
    limits = gv.limits()
    assert "at most" in repr(limits)
    limits.save(tmp_path / "limits.json")
    assert Registry.load(tmp_path / "limits.json") == limits
    with pytest.raises(ValueError, match="acceptance"):
        gv.limits(role="acceptence")


def test_a_damaged_file_is_refused(tmp_path: Path):
    (tmp_path / "walk.npz").write_bytes(b"no npz")
    with pytest.raises(ArtefactError):
        Recording.load(tmp_path / "walk.npz")
