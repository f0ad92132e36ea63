"""Inverse kinematics: known motion back, gaps, ranges, headings, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from marked_walk import LEG_SEGMENTS, RATE, moving_walk, spread_markers
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from gaitval.coordinates import ACTUATED, COORDINATES, RANGES
from gaitval.errors import ModelError, RecordError
from gaitval.gait.filters import low_pass
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics, marker_errors
from gaitval.kinetics.inverse.marked_body import bounds, marker_positions
from gaitval.model.markers import ModelMarker
from gaitval.model.measured_ranges import MEASURED_RANGES

FREE = {name: (-4.0, 4.0) for name in ACTUATED}
"""Ranges that nothing reaches, where a test is not about ranges."""

ROUNDING = 1e-7  # rad and m: Newton's method stops at steps whose square is far below this


def column(name: str) -> int:
    return COORDINATES.index(name)


@pytest.fixture(scope="module")
def walk():
    """Model, positions, markers on every segment and their trajectories."""
    model, positions = moving_walk()
    markers = spread_markers(model)
    return model, positions, markers, marker_positions(model, markers, positions)


def test_exact_markers_give_the_motion_back(walk):
    model, positions, markers, measured = walk
    found = inverse_kinematics(model, markers, measured, ranges=FREE)
    assert found.converged.all()
    assert found.determined.all()
    # nothing but rounding is left, far below the 0.05° at which tools agree
    np.testing.assert_allclose(found.positions, positions, atol=ROUNDING)
    assert marker_errors(found).whole_largest < ROUNDING


def test_noise_of_3_mm_leaves_less_than_a_degree(walk):
    model, positions, markers, measured = walk
    noise = np.random.default_rng(1).normal(0.0, 0.003, measured.shape)
    found = inverse_kinematics(model, markers, measured + noise, ranges=FREE)
    # as an import does: the angles are low-passed at 6 Hz, which the motion itself passes
    smooth = low_pass(found.positions, rate=RATE, cutoff_hz=6.0)
    error = smooth - low_pass(positions, rate=RATE, cutoff_hz=6.0)
    rms = np.degrees(np.sqrt((error[:, 6:] ** 2).mean(axis=0)))
    large = [name for name in ACTUATED if name.startswith("mtp")]  # 3 cm from marker to axis
    for name, value in zip(ACTUATED, rms, strict=True):
        assert value < (2.0 if name in large else 1.0), name
    # of 3 mm each way, the 12 equations of a segment's markers leave most
    assert 0.003 < marker_errors(found).whole_rms < 0.003 * np.sqrt(3)


def test_the_optimum_within_ranges_is_scipys(walk):
    model, positions, markers, measured = walk
    random = np.random.default_rng(3)
    chosen = [replace(m, weight=float(random.uniform(0.5, 2.0))) for m in markers]
    frame = measured[:1] + random.normal(0.0, 0.01, measured[:1].shape)
    # Ranges that the pose is outside of, on both sides of the body and at both ends.
    at = {name: positions[0, column(name)] for name in ACTUATED}
    ranges = FREE | {
        "knee_angle_r": (at["knee_angle_r"] + 0.1, 3.0),
        "hip_flexion_l": (-3.0, at["hip_flexion_l"] - 0.1),
        "arm_rot_l": (at["arm_rot_l"] + 0.2, 3.0),
    }
    found = inverse_kinematics(model, chosen, frame, ranges=ranges)
    weight = np.sqrt([m.weight for m in chosen])[:, None]

    def residuals(pose):
        return (weight * (marker_positions(model, chosen, pose[None])[0] - frame[0])).ravel()

    low, high = bounds(ranges)
    peer = least_squares(
        residuals,
        np.clip(positions[0], low + 1e-3, high - 1e-3),
        bounds=(low, high),
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-12,
    )
    # scipy's bounds are approached from inside, so compare what they cost as well
    np.testing.assert_allclose(found.positions[0], peer.x, atol=1e-4)
    assert (residuals(found.positions[0]) ** 2).sum() <= 2 * peer.cost * (1 + 1e-9)
    limited = {n for n, on in zip(COORDINATES, found.at_limit[0], strict=True) if on}
    assert limited == {"knee_angle_r", "hip_flexion_l", "arm_rot_l"}


def test_the_default_ranges_hold(walk):
    model, positions, markers, _ = walk
    straight = positions[:20].copy()
    straight[:, column("knee_angle_r")] = -0.6  # bent backwards by 34°
    found = inverse_kinematics(model, markers, marker_positions(model, markers, straight))
    assert np.all(found.positions[:, column("knee_angle_r")] == MEASURED_RANGES["knee_angle_r"][0])
    assert found.at_limit[:, column("knee_angle_r")].all()
    assert found.converged.all()


@pytest.mark.parametrize("heading", [37.0, 90.0, 178.0, 180.0, -135.0, 270.0])
def test_no_heading_is_special(walk, heading):
    model, _, markers, measured = walk
    noisy = measured + np.random.default_rng(6).normal(0.0, 0.003, measured.shape)
    turn = Rotation.from_euler("z", heading, degrees=True)
    turned = turn.apply(noisy.reshape(-1, 3)).reshape(noisy.shape)
    straight = inverse_kinematics(model, markers, noisy, ranges=FREE)
    found = inverse_kinematics(model, markers, turned, ranges=FREE)
    np.testing.assert_allclose(found.positions[:, 6:], straight.positions[:, 6:], atol=ROUNDING)
    np.testing.assert_allclose(
        found.positions[:, 3:6], turn.apply(straight.positions[:, 3:6]), atol=ROUNDING
    )
    pelvis = turn * Rotation.from_rotvec(straight.positions[:, :3])
    apart = (Rotation.from_rotvec(found.positions[:, :3]) * pelvis.inv()).magnitude()
    assert apart.max() < ROUNDING
    # The vector is no rougher than the turns from frame to frame that it stands for (a factor of
    # at most π/2 up to 180°).
    steps = np.linalg.norm(np.diff(found.positions[:, :3], axis=0), axis=1)
    turns = (pelvis[1:] * pelvis[:-1].inv()).magnitude()
    assert np.all(steps < 1.7 * turns + 1e-3)


def test_a_person_who_turns_round_keeps_a_continuous_rotation_vector(walk):
    model, positions, markers, _ = walk
    path = positions.copy()
    heading = np.radians(np.linspace(-60.0, 230.0, len(path)))
    turn = Rotation.from_rotvec(np.outer(heading, [0.0, 0.0, 1.0]))
    pelvis = turn * Rotation.from_rotvec(path[:, :3])
    path[:, :3] = pelvis.as_rotvec()
    found = inverse_kinematics(model, markers, marker_positions(model, markers, path), ranges=FREE)
    np.testing.assert_allclose(found.positions[:, 6:], path[:, 6:], atol=ROUNDING)
    assert (Rotation.from_rotvec(found.positions[:, :3]) * pelvis.inv()).magnitude().max() < 1e-6
    assert np.abs(np.diff(found.positions[:, :3], axis=0)).max() < np.radians(5.0)


def test_a_turn_that_no_rotation_vector_can_follow_is_refused(walk):
    model, positions, markers, _ = walk
    path = positions.copy()
    heading = np.radians(np.linspace(0.0, 400.0, len(path)))
    turn = Rotation.from_rotvec(np.outer(heading, [0.0, 0.0, 1.0]))
    path[:, :3] = (turn * Rotation.from_rotvec(path[:, :3])).as_rotvec()
    with pytest.raises(RecordError, match="Cut the trial where the person turns"):
        inverse_kinematics(model, markers, marker_positions(model, markers, path))


def test_any_first_pose_is_found(walk):
    """Arms raised sideways (a usual standing pose), a deep squat, facing backwards."""
    model, _, markers, _ = walk
    pose = np.zeros((1, 31))
    pose[0, :6] = 0.2, -0.1, 3.0, 4.0, -3.0, 0.9
    for side in "rl":
        pose[0, column(f"arm_add_{side}")] = -np.pi / 2
        pose[0, column(f"elbow_flex_{side}")] = 1.5
        pose[0, column(f"hip_flexion_{side}")] = 1.6
        pose[0, column(f"knee_angle_{side}")] = 2.0
    found = inverse_kinematics(model, markers, marker_positions(model, markers, pose))
    assert marker_errors(found).whole_largest < ROUNDING


def test_markers_that_jump_do_not_leave_the_body_in_a_wrong_pose(walk):
    """Every frame another pose of the legs and pelvis, up to 60 % of the way to their limits."""
    model, _, _, _ = walk
    random = np.random.default_rng(8)
    markers = spread_markers(model, LEG_SEGMENTS)
    poses = np.zeros((200, 31))
    for name in ACTUATED:
        if name.startswith(("hip", "knee", "ankle", "subtalar")):
            poses[:, column(name)] = 0.6 * random.uniform(*RANGES[name], len(poses))
    poses[:, :3] = random.normal(0.0, 0.3, (len(poses), 3))
    poses[:, 3:6] = random.normal(0.0, 0.5, (len(poses), 3))
    found = inverse_kinematics(model, markers, marker_positions(model, markers, poses))
    assert found.converged.all()
    assert marker_errors(found).whole_largest < ROUNDING


def test_gaps_leave_what_the_other_markers_still_show(walk):
    """Markers come and go one at a time on every segment."""
    model, positions, markers, measured = walk
    gappy = measured.copy()
    for i in range(len(markers)):
        gappy[7 * i % 200 :][:12, i] = np.nan
    found = inverse_kinematics(model, markers, gappy, ranges=FREE)
    assert found.determined.all()
    np.testing.assert_allclose(found.positions, positions, atol=ROUNDING)
    np.testing.assert_array_equal(np.isnan(found.marker_errors), np.isnan(gappy[..., 0]))


def test_what_no_marker_shows_for_a_while_runs_on_from_before_to_after(walk):
    model, positions, markers, measured = walk
    gappy = measured.copy()
    hidden = slice(50, 61)
    for i, marker in enumerate(markers):
        if marker.segment in ("foot_l", "toes_l"):
            gappy[hidden, i] = np.nan
    found = inverse_kinematics(model, markers, gappy, ranges=FREE)
    lost = [column(f"{name}_l") for name in ("ankle_angle", "subtalar_angle", "mtp_angle")]
    expected = np.ones_like(found.determined)
    for coordinate in lost:
        expected[hidden, coordinate] = False
        line = np.interp(np.arange(49, 62), [49, 61], positions[[49, 61], coordinate])
        np.testing.assert_allclose(found.positions[49:62, coordinate], line, atol=ROUNDING)
    np.testing.assert_array_equal(found.determined, expected)
    rest = [c for c in range(31) if c not in lost]
    np.testing.assert_allclose(found.positions[:, rest], positions[:, rest], atol=ROUNDING)


def test_frames_without_any_marker_are_bridged_and_said_so(walk):
    model, positions, markers, measured = walk
    gappy = measured.copy()
    gappy[100:104] = np.nan
    gappy[:3] = np.nan
    found = inverse_kinematics(model, markers, gappy, ranges=FREE)
    assert not found.converged[100:104].any()
    assert not found.determined[:3].any()
    np.testing.assert_allclose(found.positions[:3], positions[[3, 3, 3]], atol=ROUNDING)
    seen = found.converged
    assert seen.sum() == len(positions) - 7
    np.testing.assert_allclose(found.positions[seen], positions[seen], atol=ROUNDING)
    # straight on over 40 ms: near the truth, and between its neighbours
    assert np.abs(found.positions[100:104, 6:] - positions[100:104, 6:]).max() < np.radians(2.0)


def test_legs_alone_leave_toes_trunk_and_arms_at_the_values_given(walk):
    """Marker sets of the legs, as WBDS has, show nothing above the pelvis nor of the toes."""
    model, positions, _, _ = walk
    markers = spread_markers(model, LEG_SEGMENTS)
    fixed = {"lumbar_extension": 0.1, "elbow_flex_l": 0.4}
    measured = marker_positions(model, markers, positions[:50])
    found = inverse_kinematics(model, markers, measured, fixed=fixed)
    hidden = [n for n in ACTUATED if n.startswith(("mtp", "lumbar", "arm", "elbow"))]
    names = {n for n, on in zip(COORDINATES, found.determined.all(axis=0), strict=True) if not on}
    assert names == set(hidden)
    for name in hidden:
        assert np.all(found.positions[:, column(name)] == fixed.get(name, 0.0)), name
    legs = [column(n) for n in COORDINATES if n not in hidden]
    np.testing.assert_allclose(found.positions[:, legs], positions[:50][:, legs], atol=ROUNDING)


def test_one_marker_on_the_foot_leaves_inversion_undetermined(walk):
    """On the axis of the ankle's inversion, behind the ankle, it shows dorsiflexion alone."""
    model, positions, markers, _ = walk
    heel = ModelMarker("heel", "foot_r", np.array([-0.05, 0.0, 0.0]))
    chosen = [*(m for m in markers if m.segment not in ("foot_r", "toes_r")), heel]
    found = inverse_kinematics(
        model, chosen, marker_positions(model, chosen, positions[:20]), ranges=FREE
    )
    names = {n for n, on in zip(COORDINATES, found.determined.all(axis=0), strict=True) if not on}
    assert names == {"subtalar_angle_r", "mtp_angle_r"}
    ankle = column("ankle_angle_r")
    np.testing.assert_allclose(found.positions[:, ankle], positions[:20, ankle], atol=ROUNDING)


def test_the_pelvis_without_its_own_markers_follows_from_the_thighs(walk):
    model, positions, markers, measured = walk
    gappy = measured[:40].copy()
    for i, marker in enumerate(markers):
        if marker.segment in ("pelvis", "torso"):
            gappy[20:, i] = np.nan
    found = inverse_kinematics(model, markers, gappy, ranges=FREE)
    legs = [column(n) for n in COORDINATES if n.startswith(("pelvis", "hip", "knee", "ankle"))]
    assert found.determined[:, legs].all()
    np.testing.assert_allclose(found.positions[:, legs], positions[:40][:, legs], atol=ROUNDING)


def test_a_heavier_marker_is_met_more_closely_and_weight_0_not_at_all(walk):
    model, positions, markers, measured = walk
    pulled = measured[:5].copy()
    index = [m.name for m in markers].index("shank_r 0")
    pulled[:, index] += 0.02  # m, each way

    def error(weight):
        chosen = [replace(m, weight=weight) if i == index else m for i, m in enumerate(markers)]
        found = inverse_kinematics(model, chosen, pulled, ranges=FREE)
        return found, found.marker_errors[:, index].mean()

    (without, ignored), (_, light), (_, heavy) = error(0.0), error(1.0), error(10.0)
    assert ignored == pytest.approx(0.02 * np.sqrt(3), abs=ROUNDING)
    np.testing.assert_allclose(without.positions, positions[:5], atol=ROUNDING)
    assert ignored > 1.1 * light > 1.5 * heavy


def test_the_summary_names_the_worst_marker(walk):
    model, _, markers, measured = walk
    found = inverse_kinematics(model, markers[:4], measured[:3, :4])
    errors = np.array(
        [[0.0, 0.003, 0.0, np.nan], [0.004, 0.0, 0.0, np.nan], [0.0, 0.0, 0.012, np.nan]]
    )
    summary = marker_errors(replace(found, marker_errors=errors))
    assert summary.names == tuple(m.name for m in markers[:4])
    np.testing.assert_allclose(summary.rms[:3], np.array([4.0, 3.0, 12.0]) / 1000 / np.sqrt(3))
    np.testing.assert_allclose(summary.largest[:3], [0.004, 0.003, 0.012])
    assert np.isnan(summary.rms[3])
    assert np.isnan(summary.largest[3])
    assert summary.whole_rms == pytest.approx(0.013 / 3)  # 3, 4 and 12 mm among nine values
    assert (summary.whole_largest, summary.worst_marker) == (0.012, markers[2].name)


def test_frames_that_show_a_part_of_the_body_are_not_judged(walk):
    """Who walks into the cameras' view: of the first frames only the trunk is known."""
    model, _, markers, measured = walk
    seen = measured[:4].copy()
    away = ("thigh", "shank", "foot", "toes")
    below = [i for i, marker in enumerate(markers) if marker.segment.startswith(away)]
    seen[:2, below] = np.nan
    found = inverse_kinematics(model, markers, seen)
    errors = np.where(np.isnan(seen[..., 0]), np.nan, 0.004)
    errors[:2] *= 80.0
    errors[2, 0] = 0.005
    summary = marker_errors(replace(found, marker_errors=errors))
    assert (summary.whole_largest, summary.worst_marker) == (0.005, markers[0].name)
    np.testing.assert_allclose(summary.rms[1:], 0.004)


def _on(markers, **changes):
    return [replace(markers[0], **changes), *markers[1:]]


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        (lambda m, x: (_on(m, segment="femur_r"), x), ModelError, "femur_r"),
        (lambda m, x: (_on(m, name=m[1].name), x), ModelError, "2 markers of this name"),
        (lambda m, x: (_on(m, position=np.array([0.0, np.nan, 0.0])), x), ModelError, "three"),
        (lambda m, x: (_on(m, position=np.array([0.0, 80.0, 9.0])), x), ModelError, "millim"),
        (lambda m, x: (_on(m, weight=-1.0), x), ModelError, "weight -1.0 is not 0 or more"),
        (lambda m, x: ([], x[:, :0]), ModelError, "there are none"),
        (lambda m, x: (m, x[:, 1:]), RecordError, r"shape \(frames, 56, 3\)"),
        (lambda m, x: (m, x[:0]), RecordError, r"\(0, 56, 3\)"),
        (lambda m, x: (m, 1000 * x), RecordError, "looks like millimetres"),
        (lambda m, x: (m, np.nan * x), RecordError, "no frame shows enough markers"),
        (
            lambda m, x: (m, np.where(np.arange(56)[:, None] < 2, x, np.nan)),
            RecordError,
            "shows with a weight above 0: pelvis 0, pelvis 1",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_with_the_reason(walk, change, error, message):
    model, _, markers, measured = walk
    chosen, trajectories = change(markers, measured[:3])
    with pytest.raises(error, match=message):
        inverse_kinematics(model, chosen, trajectories)
