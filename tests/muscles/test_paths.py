"""The shipped paths obey what a path must obey."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.passive_hip import published_strains
from gaitval.errors import ModelError
from gaitval.kinetics.musculature.curves import (
    active_length,
    passive_length,
    tendon_strain,
    velocity,
)
from gaitval.kinetics.musculature.forces import capacity
from gaitval.kinetics.musculature.mapping import BoneSizes
from gaitval.kinetics.musculature.paths import BONES, COORDINATES, JOINTS, geometry, table
from gaitval.kinetics.musculature.person import leg_muscles

POSES = np.radians(
    [
        [0, 0, 0, 5, 0, 0],
        [25, -3, -5, 15, 2, -5],
        [-10, 3, 2, 10, 12, 3],
        [20, -8, 5, 60, -15, 5],
    ]
)


def test_slopes_are_those_of_the_lengths():
    found, step = geometry(POSES), 1e-5
    for c in range(len(COORDINATES)):
        aside = np.zeros(len(COORDINATES))
        aside[c] = step
        difference = geometry(POSES + aside).length - geometry(POSES - aside).length
        np.testing.assert_allclose(difference / (2 * step), found.slope[:, :, c], atol=1e-7)


def test_a_leg_twice_as_large_has_muscles_twice_as_long_and_arms_twice_as_large():
    found = geometry(POSES)
    one, two = np.ones(4), np.full(4, 2.0)
    np.testing.assert_allclose(found.length @ two, 2 * (found.length @ one))
    assert (found.length @ one).min() > 0.02
    assert (found.length @ one).max() < 0.6


def test_what_pulls_does_so_along_its_line():
    """A muscle that crosses a joint in one straight strand pulls with its tension, whatever way."""
    found, names = geometry(POSES), table().names
    for name, joint in (("glmed1", "hip"), ("soleus", "ankle"), ("bfsh", "knee")):
        size = np.linalg.norm(found.pull[:, names.index(name), JOINTS.index(joint)], axis=1)
        np.testing.assert_allclose(size, 1.0, atol=0.03)


def test_the_pull_makes_the_arm_at_the_ankle():
    """The soleus pulls the heel up, and so turns the foot down."""
    found, names = geometry(POSES), table().names
    soleus = names.index("soleus")
    assert (found.pull[:, soleus, JOINTS.index("ankle"), 1] > 0.9).all()
    arm = -(found.slope[:, soleus, COORDINATES.index("ankle_angle")] @ np.ones(len(BONES)))
    assert ((arm > -0.06) & (arm < -0.03)).all()


@pytest.mark.parametrize(
    ("muscle", "coordinate", "sign"),
    [
        ("psoas", "hip_flexion", 1),
        ("glmax2", "hip_flexion", -1),
        ("glmed1", "hip_adduction", -1),
        ("addlong", "hip_adduction", 1),
        ("vaslat", "knee_angle", -1),
        ("semimem", "knee_angle", 1),
        ("gasmed", "knee_angle", 1),
        ("tibant", "ankle_angle", 1),
        ("perlong", "subtalar_angle", -1),
        ("tibpost", "subtalar_angle", 1),
    ],
)
def test_muscles_do_what_anatomy_says(muscle, coordinate, sign):
    found = geometry(POSES)
    slope = found.slope[:, table().names.index(muscle), COORDINATES.index(coordinate)]
    assert (sign * -(slope @ np.ones(len(BONES))) > 0.003).all()


def test_beyond_the_table_is_said():
    beyond = POSES.copy()
    beyond[1, 3] = np.radians(120)
    found = geometry(beyond)
    assert found.outside.sum() == 1
    assert found.outside[1, 3]
    at_end = POSES.copy()
    at_end[1, 3] = table().ranges[3, 1]
    np.testing.assert_allclose(found.length, geometry(at_end).length)


def test_a_published_leg_has_the_published_muscles():
    own = leg_muscles(BoneSizes(np.ones(4)), mass=75.0, height=1.70)
    for i, each in enumerate(table().muscles):
        assert own.max_force[i] == pytest.approx(each.max_force)
        assert own.optimal_fibre[i] == pytest.approx(each.optimal_fibre)


def test_a_scaled_leg_works_in_the_same_range():
    """So that a child's fibres are at the same normalised lengths as an adult's."""
    one = leg_muscles(BoneSizes(np.ones(4)), mass=75.0, height=1.70)
    small = leg_muscles(BoneSizes(np.full(4, 0.6)), mass=30.0, height=1.30)
    found = geometry(POSES).length

    def along(muscles):
        return (found @ muscles.sizes.factors - muscles.tendon_slack) / muscles.optimal_fibre

    np.testing.assert_allclose(along(small), along(one), rtol=1e-9)
    assert (small.max_force < 0.8 * one.max_force).all()


@pytest.mark.parametrize(
    ("mass", "height", "sizes", "message"),
    [
        (75.0, 180.0, np.ones(4), "180"),
        (75.0, 1.80, np.array([1.0, 1000.0, 1.0, 1.0]), "1000.00"),
    ],
)
def test_a_body_that_nobody_has_is_refused(mass, height, sizes, message):
    with pytest.raises(ModelError, match=message):
        leg_muscles(BoneSizes(sizes), mass=mass, height=height)


def _passive_of_a_relaxed_leg(hips, start=None, full=None):
    """Nm about `paths.COORDINATES`, of the published man, in neutral with the knee at 15 deg."""
    muscles = leg_muscles(BoneSizes(np.ones(4)), mass=75.0, height=1.70)
    if start is not None:
        muscles = replace(muscles, passive_from=start, passive_to=full)
    poses = np.zeros((len(hips), 6))
    poses[:, 0], poses[:, COORDINATES.index("knee_angle")] = np.radians(hips), np.radians(15.0)
    paths = geometry(poses)
    length = paths.length.sum(axis=2)
    passive = capacity(length, np.zeros_like(length), muscles).passive
    return np.einsum("tm,tmj->tj", passive, -paths.slope.sum(axis=3))


def test_a_relaxed_hip_is_pulled_to_no_side():
    """It is flexed as Silder et al. (2007) measured (`experiments/passive_hip.py`): 28 Nm at 15 deg
    of extension, 7 in neutral, 1 at 15 of flexion. The published strains pull it inwards with half
    as much.
    """
    hips = np.array([-15.0, 0.0, 15.0, 30.0])
    moments = _passive_of_a_relaxed_leg(hips)
    flexion, adduction, rotation = moments.T[:3]
    np.testing.assert_allclose(flexion[:3], [28.0, 7.0, 1.0], atol=8.0)
    assert np.abs(adduction).max() < 5.0
    assert np.abs(rotation).max() < 3.5
    published = _passive_of_a_relaxed_leg(hips, *published_strains())
    assert published[0, 1] > 14.0


def test_the_curves_are_those_of_opensim():
    """OpenSim has the same curves of De Groote et al., written by others."""
    osim = pytest.importorskip("opensim")
    osim.Logger.setLevelString("Off")
    muscle = osim.DeGrooteFregly2016Muscle()
    for x in (0.6, 0.8, 1.0, 1.2, 1.5):
        theirs = muscle.calcActiveForceLengthMultiplier(x)
        assert active_length(np.array([x]))[0] == pytest.approx(theirs, abs=1e-9)
    for v in (-0.9, -0.3, 0.0, 0.2, 0.8):
        assert velocity(np.array([v]))[0] == pytest.approx(
            muscle.calcForceVelocityMultiplier(v), abs=0.01
        )
    for force in (0.05, 0.5, 1.0):
        length = 1 + tendon_strain(np.array([force]))[0]
        assert muscle.calcTendonForceMultiplier(length) == pytest.approx(force, abs=1e-9)


def test_passive_forces_are_those_of_the_published_muscles():
    """The spline of OpenSim's Millard muscle, with the strains of a muscle of the table."""
    osim = pytest.importorskip("opensim")
    for name in ("gaslat", "recfem", "psoas"):
        each = table().muscles[table().names.index(name)]
        start, full = each.passive_from, each.passive_to
        # Stiffness and curviness as the published model has them, of every muscle.
        theirs = osim.FiberForceLengthCurve(start, full, 0.2, 2.0 / (full - start), 0.75)
        lengths = 1 + np.linspace(start - 0.1, full, 12)
        ours = passive_length(lengths, np.array(start), np.array(full))
        published = [theirs.calcValue(float(x)) for x in lengths]
        np.testing.assert_allclose(ours, published, atol=0.025)
