"""Inverse kinematics and dynamics from Python: what they give, keep and refuse.

That they give what an import gives stands in `tests/workflows/test_import_truth.py`.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gaitval as gv
from gaitval.errors import ConfigurationError, RecordError, ScalingError
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics
from gaitval.kinetics.inverse.inverse_kinematics import InverseKinematics
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.kinetics.inverse.scaled_markers import MarkedBody
from gaitval.mocap.recording import Plate, Recording
from gaitval.walk.reference.motion import ReferenceMotion, build_reference


@pytest.fixture(scope="module")
def body() -> MarkedBody:
    return gv.scale(gv.load_subject(5))


@pytest.fixture(scope="module")
def recording(body: MarkedBody) -> Recording:
    """One stride of a known walk over a plate for each foot, with forces 5 cm before the ankle."""
    known = build_reference(gv.load_subject(5).record(), body.model)
    positions, rate = known.positions[::8], 128 / known.stride_time
    plates = []
    for foot, (right, left) in enumerate([(-1.0, 0.0), (0.0, 1.0)]):
        corners = np.array([[-2, left, 0], [4, left, 0], [4, right, 0], [-2, right, 0]], float)
        force = known.ground_reaction[::8, foot] * body.model.mass * 9.81
        below = known.end_effectors[::8, foot] * [1, 1, 0] + [0.05, 0, 0]
        plates.append(Plate(f"plate {foot}", corners, force, below, 0.0 * force))
    names = tuple(marker.name for marker in body.markers)
    places = marker_positions(body.model, body.markers, positions)
    return Recording("walk", "project", names, places, rate, 0.0, tuple(plates), rate)


@pytest.fixture(scope="module")
def motion(recording: Recording, body: MarkedBody) -> InverseKinematics:
    return gv.inverse_kinematics(recording, body)


def test_joint_angles(motion: InverseKinematics, tmp_path: Path):
    assert "mm RMS" in repr(motion)
    frame = motion.to_frame()
    assert list(frame.columns) == ["side", "quantity", "time", "value", "unit"]
    assert set(frame.unit) == {"deg"}
    assert "elbow_flex" not in set(frame.quantity), "no marker shows the arms"
    motion.save(tmp_path / "motion.npz")
    again = InverseKinematics.load(tmp_path / "motion.npz")
    np.testing.assert_array_equal(again.determined, motion.determined)
    assert repr(again) == repr(motion)


def test_joint_moments(
    motion: InverseKinematics, recording: Recording, body: MarkedBody, tmp_path: Path
):
    moments = gv.inverse_dynamics(motion, recording, body)
    assert "residuals" in moments.title()
    frame = moments.to_frame()
    assert {"knee_angle moment", "residual force"} <= set(frame.quantity)
    ankle = frame[(frame.quantity == "ankle_angle moment") & (frame.side == "right")]
    forces = recording.plates[0].force[:, 2] / body.model.mass
    # 5 cm is the lever of the vertical force; the fore-aft one adds a little at push-off
    assert ankle.value.min() == pytest.approx(-0.05 * forces.max(), rel=0.2)
    moments.save(tmp_path / "moments.npz")
    assert repr(InverseDynamics.load(tmp_path / "moments.npz")) == repr(moments)


def test_moments_are_not_shown_where_the_forces_are_not_known(
    motion: InverseKinematics, recording: Recording, body: MarkedBody
):
    moments = replace(
        gv.inverse_dynamics(motion, recording, body), known=np.zeros(len(motion.time), dtype=bool)
    )
    assert "in no frame" in moments.title()
    frame = replace(moments, foot_known=None).to_frame()
    assert frame.value.isna().all()
    assert len(moments.time) == len(moments.foot_known)
    right = replace(moments, foot_known=np.zeros_like(moments.foot_known) | [True, False])
    frame = right.to_frame()
    assert frame[frame.side == "right"].value.notna().all()
    assert frame[frame.side != "right"].value.isna().all()


def test_settings_are_those_of_the_commands(
    motion: InverseKinematics, recording: Recording, body: MarkedBody
):
    slower = gv.inverse_kinematics(recording, body, settings=["processing.marker_cutoff_hz=4"])
    assert np.abs(slower.positions - motion.positions).max() > 1e-3


def test_what_cannot_be_used_is_refused(
    motion: InverseKinematics, recording: Recording, body: MarkedBody
):
    with pytest.raises(ScalingError, match="no markers on it"):
        gv.inverse_kinematics(recording, MarkedBody(body.model, body.table))
    with pytest.raises(RecordError, match="laboratory's axes"):
        gv.inverse_kinematics(replace(recording, axes="laboratory"), body)
    with pytest.raises(RecordError, match="no force plates"):
        gv.inverse_dynamics(motion, replace(recording, plates=(), force_rate=0.0), body)
    with pytest.raises(RecordError, match="the motion is of walk"):
        gv.inverse_dynamics(motion, replace(recording, start=1.0), body)
    # another trial of as many frames from the same time
    with pytest.raises(RecordError, match=r"^other has 128 frames .* the motion is of walk"):
        gv.inverse_dynamics(motion, replace(recording, source="other"), body)
    with pytest.raises(ConfigurationError, match="motion is Recording"):
        gv.inverse_dynamics(recording, recording, body)
    with pytest.raises(ConfigurationError, match="recording is None"):
        gv.inverse_kinematics(None, body)
    with pytest.raises(ConfigurationError, match="subject is 'S05', of type str"):
        gv.reference_motion("S05")
    with pytest.raises(ConfigurationError, match="symmetric is 5"):
        gv.scale(gv.load_subject(5), symmetric=5)
    with pytest.raises(RecordError, match=r"no marker .nobody.\. It has"):
        recording.marker("nobody")


def test_a_reference_motion_is_kept_as_the_command_keeps_it(body: MarkedBody, tmp_path: Path):
    known = build_reference(gv.load_subject(5).record(), body.model)
    known.save(tmp_path / "reference.npz")
    reference = ReferenceMotion.load(tmp_path / "reference.npz")
    assert "stride time" in repr(reference)
    assert {"deg", "Nm", "% BW"} == set(reference.to_frame().unit)
    reference.save(tmp_path / "again.npz")
    np.testing.assert_array_equal(
        ReferenceMotion.load(tmp_path / "again.npz").positions, known.positions
    )
