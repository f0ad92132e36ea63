"""A person of whom one leg is longer than the other in every length is imported, and it is said."""

from pathlib import Path

import numpy as np
import pytest

from gaitval.configuration import ProcessingSettings
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.scaling.hip_regressions import hip_joint_centre
from gaitval.scaling.joint_centres import pelvis_frame
from gaitval.session.importing.importing import work_out
from gaitval.session.request import Request

SAMPLES = Path(__file__).parents[2] / "gaitval" / "samples"
LEFT_LEG = ("LFLE", "LFME", "LFAL", "LTAM", "LFCC", "LFMT1", "LFMT2", "LFMT5")


def scaled_about_the_hip(recording: Recording, factor: float) -> Recording:
    """All markers of the sample's left leg, nearer to its hip or farther from it."""
    right, left, *rear = (recording.marker(name) for name in ("RASIS", "LASIS", "RPSIS", "LPSIS"))
    middle, back = (right + left) / 2, sum(rear) / 2
    size = [float(np.linalg.norm(each, axis=1).mean()) for each in (left - right, middle - back)]
    hip = hip_joint_centre(*size) * [1.0, -1.0, 1.0]
    frames = zip(right, left, back, strict=True)
    centre = middle + np.array([pelvis_frame(*points) @ hip for points in frames])
    markers = recording.markers.copy()
    for name in LEFT_LEG:
        number = recording.names.index(name)
        markers[:, number] = centre + factor * (markers[:, number] - centre)
    return recording.with_markers(recording.names, markers)


@pytest.mark.parametrize("factor", [0.81, 0.91, 1.09, 1.19])
def test_legs_that_truly_differ_are_imported_each_with_its_own_lengths(tmp_path, factor):
    names = ("standing", "walking")
    planted = [scaled_about_the_hip(read_recording(SAMPLES / f"{n}.c3d"), factor) for n in names]
    right, left = (planted[0].marker(name)[:, 2].mean() for name in ("RFCC", "LFCC"))
    for name, recording in zip(names, planted, strict=True):
        # The longer leg stands on the floor, the other one on a lift.
        recording.markers[..., 2] += max(right - left, 0.0)
        write_trc(tmp_path / f"{name}.trc", recording)
    request = Request(
        static=tmp_path / "standing.trc", trials=(tmp_path / "walking.trc",), identifier="uneven",
        mass=64.95, height=1.53, sex="F", kinematics_only=True,
    )  # fmt: skip
    found = work_out(request, ProcessingSettings())
    assert [warning.check for _, warning in found.warnings] == ["one leg is longer"]
    limbs = found.body.chosen.modelled
    assert limbs["left"].thigh / limbs["right"].thigh == pytest.approx(factor, abs=0.02)
    assert limbs["left"].shank / limbs["right"].shank == pytest.approx(factor, abs=0.02)
