"""The shipped paths against the published model in OpenSim, as it is and scaled to other people."""

import json
from importlib.resources import files

import numpy as np
import pytest

from gaitval.kinetics.musculature.paths import BONES, geometry, table

pytest.importorskip("opensim")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sizes", "length_mm", "arm_mm"),
    [
        ((1.0, 1.0, 1.0, 1.0), 0.1, 0.6),
        ((1.05, 1.08, 0.94, 1.03), 0.6, 0.8),
        ((0.80, 0.75, 0.72, 0.75), 0.3, 0.8),
    ],
    ids=["published", "long thighs", "child"],
)
def test_lengths_and_arms_are_those_of_the_model(gait_data, sizes, length_mm, arm_mm):
    """95 % of poses of gait; goals are 0.5 mm and 1 mm, what must be is 1 mm and 3 mm."""
    from experiments.muscle_paths import GAIT, Leg, derivatives, osim

    osim.Logger.setLevelString("Off")
    leg = Leg(str(gait_data / "opensim_rajagopal" / "RajagopalLaiUhlrich2023.osim"))
    if sizes != (1.0, 1.0, 1.0, 1.0):
        leg.scaled(dict(zip(BONES, sizes, strict=True)))
    assert tuple(m.getName()[:-2] for m in leg.muscles) == table().names
    share = np.random.default_rng(5).random((40, 6))
    poses = GAIT[:, 0] + (GAIT[:, 1] - GAIT[:, 0]) * share
    lengths, slopes = leg.lengths(poses), derivatives(leg, poses)
    found = geometry(poses)
    off = np.abs(found.length @ np.array(sizes) - lengths) * 1e3
    arms_off = np.abs(found.slope @ np.array(sizes) - slopes)[np.abs(slopes) > 1e-6] * 1e3
    assert np.quantile(off, 0.95) < length_mm
    assert np.quantile(arms_off, 0.95) < arm_mm


@pytest.mark.slow
def test_the_left_leg_is_the_right_one_in_the_mirror(gait_data):
    """Only right muscles are shipped."""
    from experiments.muscle_paths import osim

    osim.Logger.setLevelString("Off")
    model = osim.Model(str(gait_data / "opensim_rajagopal" / "RajagopalLaiUhlrich2023.osim"))
    for coordinate in model.getCoordinateSet():
        coordinate.set_locked(False)
    state = model.initSystem()
    pose = {"hip_flexion": 0.4, "hip_adduction": -0.1, "hip_rotation": 0.1, "knee_angle": 0.6}
    pose |= {"knee_angle_beta": 0.6, "ankle_angle": 0.2, "subtalar_angle": 0.1}
    for side in "rl":
        for name, angle in pose.items():
            full = f"knee_angle_{side}_beta" if "beta" in name else f"{name}_{side}"
            model.getCoordinateSet().get(full).setValue(state, angle, False)
    model.realizePosition(state)
    for name in table().names:
        right, left = (model.getMuscles().get(f"{name}_{side}") for side in "rl")
        assert left.getGeometryPath().getLength(state) == pytest.approx(
            right.getGeometryPath().getLength(state), abs=1.5e-3
        )
        assert left.getMaxIsometricForce() == pytest.approx(right.getMaxIsometricForce(), rel=1e-3)


def test_the_table_says_how_right_it_is():
    """Of every muscle over the whole range, as computed when it was made."""
    with (
        files("gaitval.kinetics.musculature").joinpath("paths.npz").open("rb") as file,
        np.load(file) as stored,
    ):
        rows = json.loads(stored["about"].tobytes().decode())["muscles"]
    assert len(rows) == 40
    for row in rows:
        assert row["length_error_95_mm"] < 0.5
        assert row["arm_error_95_mm"] < 2.0
        assert row["arm_error_gait_95_mm"] < 1.0
        assert row["jumps_gait"] < 0.01
