"""Functional centres and axes against made-up joints whose centre and axis are known."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitval.errors import ScalingError
from gaitval.scaling.functional import SegmentMotion, ball_centre, hinge_axis, segment_motion

RATE = 100.0
SECONDS = 20.0
LEFT = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Joint:
    """Where a joint and its markers are in standing, and the markers while it moves."""

    centre: np.ndarray
    axis: np.ndarray
    standing: tuple[np.ndarray, np.ndarray]
    moving: tuple[np.ndarray, np.ndarray]

    def motions(self) -> tuple[SegmentMotion, SegmentMotion]:
        first, second = (
            segment_motion(stood, moved)
            for stood, moved in zip(self.standing, self.moving, strict=True)
        )
        return first, second


def swaying(
    time: np.ndarray, sizes: tuple[float, ...], rates: tuple[float, ...], order="YXZ"
) -> Rotation:
    """Rotations by Cardan angles with these ranges (degrees) and frequencies (Hz)."""
    angles = [
        size / 2 * np.sin(2 * np.pi * rate * time + number)
        for number, (size, rate) in enumerate(zip(sizes, rates, strict=True))
    ]
    return Rotation.from_euler(order, np.transpose(angles), degrees=True)


def moved(random, time, centre, segments, rotations, noise, wander):
    """Markers (T, M, 3) of segments that turn about a centre which itself moves."""
    path = centre + np.transpose(
        [0.05 * np.sin(time), 0.05 * np.cos(0.8 * time), 0.02 * np.sin(2 * time)]
    )
    found = []
    for places, rotation, size in zip(segments, rotations, wander, strict=True):
        at = np.einsum("tij,mj->tmi", rotation.as_matrix(), places - centre) + path[:, None]
        phase = random.uniform(0.0, 2 * np.pi, places.shape)
        rate = random.uniform(0.3, 0.7, places.shape)
        slide = np.sqrt(2.0) * size * np.sin(2 * np.pi * rate * time[:, None, None] + phase)
        found.append(at + slide + random.normal(0.0, noise, at.shape))
    return tuple(found)


def hip(seed=0, ranges=(70.0, 40.0, 10.0), *, noise=0.0, wander=0.0, side=-1.0) -> Joint:
    """A hip, on the right for side -1; `wander` (m) is that of the thigh."""
    random = np.random.default_rng(seed)
    time = np.arange(round(SECONDS * RATE)) / RATE
    centre = np.array([0.02, 0.09 * side, 0.9])
    pelvis = np.array([[0.1, -0.13, 0.97], [0.1, 0.13, 0.97], [-0.1, -0.05, 1], [-0.1, 0.05, 1]])
    thigh = centre + random.uniform([-0.05, -0.08, -0.4], [0.08, 0.06, -0.15], (5, 3))
    trunk = swaying(time, (6.0, 7.0, 9.0), (0.17, 0.14, 0.11))
    leg = trunk * swaying(time, ranges, (0.5, 0.385, 0.265))
    moving = moved(
        random, time, centre, (pelvis, thigh), (trunk, leg), noise, (0.4 * wander, wander)
    )
    return Joint(centre, LEFT, (pelvis, thigh), moving)


def knee(seed=0, flexion=60.0, *, noise=0.0, wander=0.0) -> Joint:
    """A knee with an oblique axis."""
    random = np.random.default_rng(seed)
    time = np.arange(round(SECONDS * RATE)) / RATE
    centre = np.array([0.0, -0.09, 0.5])
    axis = np.array([0.1, 0.99, 0.1]) / np.linalg.norm([0.1, 0.99, 0.1])
    thigh = centre + random.uniform([-0.05, -0.08, 0.05], [0.08, 0.06, 0.3], (5, 3))
    shank = centre + random.uniform([-0.05, -0.06, -0.35], [0.05, 0.04, -0.1], (5, 3))
    above = swaying(time, (17.0, 34.0, 9.0), (0.17, 0.14, 0.11))
    bend = np.radians(flexion) / 2 * (1 + np.sin(2 * np.pi * 0.5 * time))
    below = above * Rotation.from_rotvec(bend[:, None] * axis)
    moving = moved(
        random, time, centre, (thigh, shank), (above, below), noise, (wander, 0.5 * wander)
    )
    return Joint(centre, axis, (thigh, shank), moving)


def degrees_between(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.degrees(np.arccos(np.clip(one @ other, -1.0, 1.0))))


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["right", "left"])
def test_the_centre_of_a_rigid_hip_is_exact(side):
    made = hip(side=side)
    found = ball_centre(*made.motions(), near=np.zeros(3))
    np.testing.assert_allclose(found.centre, made.centre, atol=1e-9)
    np.testing.assert_allclose(found.proximal, found.distal, atol=1e-9)
    assert found.standard_error < 1e-9
    assert found.residual < 1e-7  # a difference of sums of squares
    # Cardan angles of that size are not quite the components about the principal axes.
    assert found.ranges[:2] == pytest.approx((70.0, 40.0), abs=5.0)


@pytest.mark.parametrize("towards", [LEFT, -LEFT])
def test_the_axis_of_a_rigid_knee_is_exact(towards):
    made = knee()
    near = made.centre + np.array([0.03, 0.02, -0.01])
    found = hinge_axis(*made.motions(), near=near, towards=towards)
    np.testing.assert_allclose(found.direction, made.axis * towards[1], atol=1e-7)
    # The nearest point of the axis.
    assert (found.point - near) @ made.axis == pytest.approx(0.0, abs=1e-9)
    apart = found.point - made.centre
    np.testing.assert_allclose(apart, (apart @ made.axis) * made.axis, atol=1e-7)
    assert found.standard_error < 1e-6
    assert found.ranges[0] == pytest.approx(60.0, abs=0.5)


def test_the_rigid_motion_is_the_one_that_moved_the_markers():
    random = np.random.default_rng(3)
    places = random.uniform(-0.1, 0.1, (5, 3))
    rotations, shifts = Rotation.random(40, random_state=3), random.normal(size=(40, 3))
    markers = np.einsum("tij,mj->tmi", rotations.as_matrix(), places) + shifts[:, None]
    markers[:10, 0] = np.nan  # four markers are enough
    markers[10:12, :3] = np.nan  # two are not
    motion = segment_motion(places, markers)
    seen = np.arange(40) // 2 != 5
    np.testing.assert_allclose(motion.rotation[seen], rotations.as_matrix()[seen], atol=1e-9)
    np.testing.assert_allclose(motion.translation[seen], shifts[seen], atol=1e-9)
    assert np.isnan(motion.translation[~seen]).all()
    assert motion.residual < 1e-9


def test_errors_grow_with_noise_and_are_of_the_size_that_is_told():
    sizes = {}
    for noise in (0.0002, 0.0005):
        errors, message = [], []
        for seed in range(10):
            made = hip(seed, noise=noise)
            found = ball_centre(*made.motions(), near=made.centre)
            errors.append(np.linalg.norm(found.centre - made.centre))
            message.append(found.standard_error)
        sizes[noise] = np.sqrt(np.mean(np.square(errors)))
        assert (np.array(errors) < 4 * np.array(message)).all()
        # The mean square error is the one reported, within the scatter of 10 joints.
        assert 0.6 < sizes[noise] / np.sqrt(np.mean(np.square(message))) < 1.6
    assert sizes[0.0005] / sizes[0.0002] == pytest.approx(2.5, rel=0.3)


def test_noise_in_the_rotations_pulls_the_centre_to_the_markers_with_its_square():
    """Errors in variables: 0.1 mm with 1 mm of noise, 1.5 mm with 4 mm."""
    pulled = [
        np.mean([down(hip(seed, noise=noise)) for seed in range(8)]) for noise in (0.001, 0.004)
    ]
    assert 1000 * pulled[0] == pytest.approx(0.1, abs=0.1)
    assert 1000 * pulled[1] == pytest.approx(1.5, abs=0.5)


def down(made: Joint) -> float:
    return float(made.centre[2] - ball_centre(*made.motions(), near=made.centre).centre[2])


@pytest.mark.parametrize(
    ("ranges", "millimetres"), [((45.0, 20.0, 10.0), 15), ((60.0, 30.0, 10.0), 9)]
)
def test_the_error_of_a_wandering_skin_is_the_one_documented(ranges, millimetres):
    """As the docstring of `HIP_RANGES` says; the standard error shows half of it or more."""
    errors, message = [], []
    for seed in range(20):
        made = hip(seed, ranges, noise=0.0005, wander=0.005)
        found = ball_centre(*made.motions(), near=made.centre)
        errors.append(np.linalg.norm(found.centre - made.centre))
        message.append(found.standard_error)
    assert 1000 * np.mean(errors) == pytest.approx(millimetres, rel=0.3)
    assert 0.4 < np.mean(message) / np.mean(errors) < 1.5


@pytest.mark.parametrize(("flexion", "degrees"), [(40.0, 3.6), (60.0, 2.0)])
def test_the_error_of_a_knee_axis_is_the_one_documented(flexion, degrees):
    errors, message = [], []
    for seed in range(20):
        made = knee(seed, flexion, noise=0.0005, wander=0.005)
        found = hinge_axis(*made.motions(), near=made.centre, towards=LEFT)
        errors.append(degrees_between(found.direction, made.axis))
        message.append(np.degrees(found.standard_error))
    assert np.mean(errors) == pytest.approx(degrees, rel=0.3)
    assert 0.7 < np.mean(message) / np.mean(errors) < 2.0


def test_a_marker_that_moved_since_standing_sets_the_images_apart():
    made = hip()
    shifted = made.standing[0].copy()
    shifted[0, 0] += 0.02  # the right ASIS, in standing
    found = ball_centre(
        segment_motion(shifted, made.moving[0]),
        segment_motion(made.standing[1], made.moving[1]),
        near=made.centre,
    )
    np.testing.assert_allclose(found.distal, made.centre, atol=1e-6)
    apart = float(np.linalg.norm(found.proximal - found.distal))
    assert 0.003 < apart < 0.02
    along = (found.proximal - found.distal) / apart
    assert found.error_along(along) == pytest.approx(apart / 2, rel=0.05)


def test_too_small_a_range_is_refused_with_the_angles_seen():
    with pytest.raises(
        ScalingError, match=r"turned by 30\.\d° and 1\d\.\d°.*45\.0° and 20\.0° are"
    ):
        ball_centre(*hip(ranges=(30.0, 10.0, 5.0)).motions(), near=np.zeros(3))
    # A hinge has no centre, whatever its range.
    with pytest.raises(ScalingError, match=r"turned by 9\d\.\d° and 0\.0°"):
        ball_centre(*knee(flexion=90.0).motions(), near=np.zeros(3))
    with pytest.raises(ScalingError, match=r"turned by (20\.0|19\.9)°; 40° are needed"):
        hinge_axis(*knee(flexion=20.0).motions(), near=np.zeros(3), towards=LEFT)


def test_segments_that_do_not_show_how_they_turn_are_refused():
    with pytest.raises(ScalingError, match="thigh: markers in both trials: 2;"):
        segment_motion(np.zeros((2, 3)), np.zeros((9, 2, 3)), "thigh")
    line = np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.2], [0.0, 0.005, 0.3]])
    with pytest.raises(ScalingError, match=r"within 1 mm of a line \(10 mm"):
        segment_motion(line, np.zeros((9, 3, 3)))
    made = hip()
    with pytest.raises(ScalingError, match="seen in 30 frames; 50 are"):
        ball_centre(
            *(segment_motion(at, m[:30]) for at, m in zip(made.standing, made.moving, strict=True)),
            near=np.zeros(3),
        )
