"""LocoHub's Parquet: names, signs, 150 points, and the same curves again."""

import re

import numpy as np
import pandas as pd
import pytest

from gaitval.apps.export.locohub import (
    POINTS,
    _name,
    _of_segments,
    _of_trunk,
    locohub_frame,
    write_locohub,
)
from gaitval.apps.export.walked import ExportedWalk
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES, opposite
from gaitval.datasets.subject_file import load_subject
from gaitval.gait.sampling import interpolated
from gaitval.metrics.comparison import low_pass_of
from gaitval.metrics.cycles import filtered
from gaitval.model.body import SEGMENTS
from gaitval.model.rotations import pelvis_rotation
from gaitval.model.tree import segment_frames
from gaitval.scaling.scaling import scale_subject

SIDED = (
    *(f"{joint}_{kind}_{{}}_{unit}"
      for joint in ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
      for kind, unit in (("angle", "rad"), ("velocity", "rad_s"), ("moment", "Nm_kg"))),
    *("hip_adduction_angle_{}_rad", "hip_adduction_moment_{}_Nm_kg"),
    *(f"{segment}_sagittal_angle_{{}}_rad" for segment in ("thigh", "shank", "foot")),
    *(f"grf_{axis}_{{}}_BW" for axis in ("vertical", "anterior", "lateral")),
)  # fmt: skip
"""Of LocoHub's feature_constants.py and of the catalogue of its reference."""
WHOLE = [
    f"{segment}_{plane}_angle_rad"
    for segment in ("pelvis", "trunk")
    for plane in ("sagittal", "frontal", "transverse")
]
ANGLES = {
    "hip_flexion": "hip_flexion", "hip_adduction": "hip_adduction",
    "knee_flexion": "knee_angle", "ankle_dorsiflexion": "ankle_angle",
}  # fmt: skip
ABOUT = ["subject", "subject_metadata", "task", "task_id", "task_info", "step", "phase_ipsi"]


@pytest.fixture(scope="module")
def frame(walked: ExportedWalk) -> pd.DataFrame:
    return locohub_frame(walked)


@pytest.fixture(scope="module")
def curves(walked: ExportedWalk, tmp_path_factory: pytest.TempPathFactory) -> dict[str, np.ndarray]:
    (path,) = write_locohub(tmp_path_factory.mktemp("locohub"), walked)
    assert path.name.endswith("_phase.parquet")
    numbers = pd.read_parquet(path).select_dtypes("number").drop(columns="step")
    return {name: values.to_numpy().reshape(-1, POINTS) for name, values in numbers.items()}


def test_it_has_the_standards_columns_and_no_other(frame: pd.DataFrame) -> None:
    sided = {name.format(side) for name in SIDED for side in ("ipsi", "contra")}
    assert set(frame.columns) == {*ABOUT, *sided, *WHOLE}
    assert (frame["task"] == "level_walking").all()
    assert frame["subject"].str.fullmatch(r"[A-Z]{2}\d*_AB\d{2}").all()
    assert not frame.isna().any().any()


def test_every_cycle_of_either_foot_has_150_points(
    frame: pd.DataFrame, walked: ExportedWalk
) -> None:
    cycles = walked.cycles.count("right") + walked.cycles.count("left")
    assert len(frame) == cycles * POINTS
    for _, cycle in frame.groupby("step"):
        np.testing.assert_allclose(cycle["phase_ipsi"], np.arange(POINTS) / (POINTS - 1) * 100.0)


def test_what_goes_out_comes_in_again(frame: pd.DataFrame, curves: dict[str, np.ndarray]) -> None:
    for name, values in curves.items():
        np.testing.assert_array_equal(values.ravel(), frame[name], err_msg=name)


def test_curves_are_those_of_the_walk(walked: ExportedWalk, curves: dict[str, np.ndarray]) -> None:
    starts, ends = walked.cycles.starts["left"], walked.cycles.ends["left"]
    samples = starts[:, None] + (ends - starts)[:, None] * np.linspace(0.0, 1.0, POINTS)
    first = walked.cycles.count("right")
    for name, side in (
        ("knee_flexion_angle_ipsi_rad", "l"),
        ("knee_flexion_angle_contra_rad", "r"),
    ):
        angle = walked.walk.positions[:, COORDINATES.index(f"knee_angle_{side}")]
        np.testing.assert_allclose(curves[name][first:], interpolated(angle, samples))


def test_signs_are_those_of_a_gait(curves: dict[str, np.ndarray]) -> None:
    """Of the first right cycle: braking before pushing, and so on."""
    at = {name: values[0] for name, values in curves.items()}
    early, late, swing = slice(15, 35), slice(70, 85), slice(100, 125)
    assert at["knee_flexion_angle_ipsi_rad"][swing].max() > 0.8
    assert at["ankle_dorsiflexion_moment_ipsi_Nm_kg"][late].min() < -0.8  # plantarflexor
    assert at["hip_flexion_moment_ipsi_Nm_kg"][early].mean() < 0.0  # extensor
    assert at["grf_anterior_ipsi_BW"][early].mean() < 0.0 < at["grf_anterior_ipsi_BW"][late].max()
    assert at["grf_lateral_ipsi_BW"][early].mean() < 0.0  # to the left, as the midline is
    assert at["grf_lateral_contra_BW"][swing].mean() > 0.0
    assert at["grf_vertical_ipsi_BW"][early].mean() > 0.8
    assert (
        at["thigh_sagittal_angle_ipsi_rad"][0]
        > 0.2
        > -0.2
        > at["shank_sagittal_angle_ipsi_rad"][90]
    )
    assert at["foot_sagittal_angle_ipsi_rad"][0] > 0.1  # the heel strikes
    assert at["pelvis_transverse_angle_rad"][0] > 0.0  # the right side is ahead


@pytest.mark.parametrize(
    ("turn", "seen"),
    [((0.2, 0, 0), "sagittal"), ((0, 0.15, 0), "frontal"), ((0, 0, 0.3), "transverse")],
)
def test_pelvis_and_trunk_are_positive_forward_and_with_the_right_side_up_and_ahead(turn, seen):
    frames = np.tile(np.eye(3), (1, len(SEGMENTS), 1, 1))
    for segment in ("pelvis", "torso"):
        frames[:, SEGMENTS.index(segment)] = pelvis_rotation(*np.array(turn, float)[:, None])
    found = _of_trunk(frames)
    for segment in ("pelvis", "trunk"):
        for plane in ("sagittal", "frontal", "transverse"):
            expected = max(turn) if plane == seen else 0.0
            assert found[f"{segment}_{plane}_angle_rad"] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("side", ["right", "left"])
def test_legs_are_positive_with_their_lower_end_ahead_and_the_toes_up(side):
    model = scale_subject(load_subject("S05")).model
    standing = np.zeros((1, len(COORDINATES)))
    standing[0, COORDINATES.index(f"hip_flexion_{side[0]}")] = 0.4
    standing[0, COORDINATES.index(f"knee_angle_{side[0]}")] = 0.5
    standing[0, COORDINATES.index(f"ankle_angle_{side[0]}")] = 0.3
    poses = segment_frames(model, standing)
    found = _of_segments(side, poses[..., :3, :3])
    hip, knee, ankle = (
        poses[0, SEGMENTS.index(f"{name}_{side[0]}"), :3, 3] for name in ("thigh", "shank", "foot")
    )
    for name, above, below in (("thigh", hip, knee), ("shank", knee, ankle)):
        ahead, _, up = below - above
        assert found[f"{name}_sagittal_angle_SIDE_rad"] == pytest.approx(
            np.arctan2(ahead, -up), abs=0.03
        )
    assert found["thigh_sagittal_angle_SIDE_rad"] == pytest.approx(0.4)
    assert found["shank_sagittal_angle_SIDE_rad"] == pytest.approx(0.4 - 0.5)
    assert found["foot_sagittal_angle_SIDE_rad"] == pytest.approx(0.4 - 0.5 + 0.3)


def test_every_curve_of_both_feet_is_its_sides_of_the_walk(
    walked: ExportedWalk, frame: pd.DataFrame
) -> None:
    """In a cycle of either foot: angles and their rates as they are, moments over the mass, forces
    over the weight and to the right; both filtered as the report's."""
    walk, mass, task = walked.walk, walked.stored.subject.mass_kg, walked.stored.task
    frequency = task.configuration.validation.filter_frequency
    moments, force = filtered(walk, low_pass_of(task.record, frequency))
    force = force / (mass * GRAVITY)
    cycles = walked.cycles
    for number, own in ((0, "right"), (cycles.count("right"), "left")):
        of_cycle = frame[frame["step"] == number]
        start, end = cycles.starts[own][0], cycles.ends[own][0]
        at = start + (end - start) * np.linspace(0.0, 1.0, POINTS)
        assert f"ipsi_side:{own}," in of_cycle["task_info"].iloc[0]
        for foot, side in (("ipsi", own), ("contra", opposite(own))):
            expected = {}
            for theirs, ours in ANGLES.items():
                name = f"{ours}_{side[0]}"
                place, joint = COORDINATES.index(name), ACTUATED.index(name)
                expected[f"{theirs}_angle_{foot}_rad"] = walk.positions[:, place]
                expected[f"{theirs}_velocity_{foot}_rad_s"] = walk.velocities[:, place]
                expected[f"{theirs}_moment_{foot}_Nm_kg"] = moments[:, joint] / mass
            for axis, sign, column in (("anterior", 1, 0), ("lateral", -1, 1), ("vertical", 1, 2)):
                of_foot = force[:, SIDES.index(side), column]
                expected[f"grf_{axis}_{foot}_BW"] = sign * of_foot
            del expected[f"hip_adduction_velocity_{foot}_rad_s"]
            for name, values in expected.items():
                there = interpolated(values, at[None])[0]
                np.testing.assert_allclose(of_cycle[name], there, atol=1e-8, err_msg=name)


def test_rates_are_slopes_of_the_angles_and_feet_carry_the_weight(
    walked: ExportedWalk, curves: dict[str, np.ndarray], frame: pd.DataFrame
) -> None:
    """By the file alone: the time of a cycle from what its speed says of the distance."""
    starts, ends = (getattr(walked.cycles, each)["right"] for each in ("starts", "ends"))
    time, place = walked.walk.time, walked.walk.centre_of_mass[:, 0]
    message = frame["task_info"].str.extract(r"speed_m_s:([\d.]+)")[0].astype(float)
    for number, (start, end) in enumerate(zip(starts, ends, strict=True)):
        speed = (place[end] - place[start]) / (time[end] - time[start])
        assert message[POINTS * number] == pytest.approx(speed, abs=6e-4)
    stride = time[ends[0]] - time[starts[0]]
    for joint in ("hip_flexion", "knee_flexion", "ankle_dorsiflexion"):
        for foot in ("ipsi", "contra"):
            slope = np.gradient(curves[f"{joint}_angle_{foot}_rad"][0], stride / (POINTS - 1))
            rate = curves[f"{joint}_velocity_{foot}_rad_s"][0]
            assert np.sqrt(np.mean((slope - rate) ** 2)) < 0.15 * np.std(rate)
    total = sum(curves[f"grf_vertical_{foot}_BW"][:, :-1].mean() for foot in ("ipsi", "contra"))
    assert total == pytest.approx(1.0, abs=0.02)


def test_segments_follow_from_the_joints(curves: dict[str, np.ndarray]) -> None:
    """In the sagittal plane a knee is what lies between its thigh and its shank."""
    between = curves["thigh_sagittal_angle_ipsi_rad"] - curves["shank_sagittal_angle_ipsi_rad"]
    np.testing.assert_allclose(between, curves["knee_flexion_angle_ipsi_rad"], atol=0.1)


def test_two_people_have_two_names():
    names = [
        _name(each) for each in ("S05", "P05", "P05-pre", "S1_2", "S12", "patient_a", "patient_b")
    ]
    assert names[0] == "GV_AB05"
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"GV_AB\d+", name) for name in names)
