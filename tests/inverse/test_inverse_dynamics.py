"""Inverse dynamics against DART, against statics and balances, and on a walk that is known."""

from dataclasses import replace

import numpy as np
import pytest
from known_walk import RATE, known_walk
from scipy.spatial.transform import Rotation
from simulation_fixtures import random_state

from gaitval.configuration import ProcessingSettings
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, mirrored
from gaitval.errors import RecordError
from gaitval.gait.filters import low_pass
from gaitval.gait.record import MOMENT_NAMES
from gaitval.kinetics.inverse.inverse_dynamics import ground_level, inverse_dynamics, residuals
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.kinetics.inverse.motion_rates import Kinematics, differentiate
from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames, tree_arrays
from gaitval.walk.simulation.skeleton import HumanSkeleton

FEET = [SEGMENTS.index("foot_r"), SEGMENTS.index("foot_l")]


@pytest.fixture(scope="module")
def walk():
    return known_walk()


@pytest.fixture(scope="module")
def model(walk):
    return walk.model


def wild(frames: int):
    """States, accelerations and ground reactions far from any gait; one foot is in the air."""
    random = np.random.default_rng(0)
    states = [random_state(seed) for seed in range(frames)]
    q, qd = (np.array(values) for values in zip(*states, strict=True))
    qdd = random.uniform(-50.0, 50.0, (frames, 31))
    force = random.uniform(-900.0, 900.0, (frames, 2, 3))
    point = random.uniform(-1.0, 1.0, (frames, 2, 3))
    free_moment = random.uniform(-9.0, 9.0, (frames, 2, 3))
    point[3, 1] = np.nan
    return Kinematics(q, qd, qdd), force, point, free_moment


def test_moments_and_residuals_are_those_of_darts_equations_of_motion(model):
    """τ = M q̈ + c - Σ Jᵀ f over the feet, which DART forms another way."""
    kinematics, force, point, free_moment = wild(12)
    time = np.arange(12) * 0.01
    result = inverse_dynamics(
        model, time, kinematics.positions, force, point, free_moment, kinematics=kinematics
    )
    seen = np.hstack([result.residual_moment, result.residual_force, result.moments])
    human = HumanSkeleton(model, physics_step=0.001).skeleton
    for t, (q, qd, qdd) in enumerate(zip(*kinematics, strict=True)):
        human.setPositions(q)
        human.setVelocities(qd)
        expected = human.getMassMatrix() @ qdd + human.getCoriolisAndGravityForces()
        for side, name in enumerate(("foot_r", "foot_l")):
            if np.isnan(point[t, side, 0]):
                continue
            foot = human.getBodyNode(name)
            local = np.linalg.inv(foot.getWorldTransform().matrix()) @ [*point[t, side], 1.0]
            expected -= human.getLinearJacobian(foot, local[:3]).T @ force[t, side]
            expected -= human.getAngularJacobian(foot).T @ free_moment[t, side]
        np.testing.assert_allclose(seen[t], expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def momentum(model, positions, velocities):
    """Linear momentum and angular momentum about the world's origin (T, 3), and
    energy (T,), segment by segment from poses and their central differences."""
    tree, step = tree_arrays(model), 1e-5

    def moved(sign):
        turned = Rotation.from_rotvec(sign * step * velocities[:, :3]) * Rotation.from_rotvec(
            positions[:, :3]
        )
        rest = positions[:, 3:] + sign * step * velocities[:, 3:]
        return segment_frames(model, np.hstack([turned.as_rotvec(), rest]))

    frames, before, after = segment_frames(model, positions), moved(-1.0), moved(1.0)
    rotation = frames[..., :3, :3]
    local = np.append(tree.centre_of_mass, np.ones((len(SEGMENTS), 1)), axis=1)
    place = np.einsum("tsij,sj->tsi", frames, local)[..., :3]
    speed = np.einsum("tsij,sj->tsi", (after - before) / (2 * step), local)[..., :3]
    spin_matrix = (after - before)[..., :3, :3] / (2 * step) @ np.swapaxes(rotation, 2, 3)
    spin = np.stack([spin_matrix[..., 2, 1], spin_matrix[..., 0, 2], spin_matrix[..., 1, 0]], -1)
    inertia = rotation @ tree.inertia @ np.swapaxes(rotation, 2, 3)
    turning = np.einsum("tsij,tsj->tsi", inertia, spin)
    linear = np.einsum("s,tsi->ti", tree.mass, speed)
    angular = (turning + tree.mass[:, None] * np.cross(place, speed)).sum(axis=1)
    kinetic = 0.5 * ((speed**2).sum(-1) @ tree.mass + (spin * turning).sum((1, 2)))
    return linear, angular, kinetic + GRAVITY * place[..., 2] @ tree.mass


def test_momentum_and_energy_change_as_forces_and_moments_say(walk):
    """A walk whose ground reactions are off by a fifth: the residual makes up for it, in force,
    in moment about the origin, and in power."""
    force, point, free_moment = 0.8 * walk.force, walk.point, walk.free_moment
    result = inverse_dynamics(
        walk.model, walk.time, *(walk.positions, force, point, free_moment),
        kinematics=walk.kinematics,
    )  # fmt: skip
    positions, velocities, _ = walk.kinematics
    linear, angular, energy = momentum(walk.model, positions, velocities)
    weight = np.array([0.0, 0.0, -walk.model.mass * GRAVITY])

    def rate(values):  # sixth order: the motion has no more than eight harmonics
        coefficients = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60
        slices = [values[i : len(values) - 6 + i] for i in range(7)]
        return sum(c * s for c, s in zip(coefficients, slices, strict=True)) * 150.0

    inner = slice(3, -3)
    at = np.nan_to_num(point)
    total = force.sum(axis=1) + result.residual_force + weight
    np.testing.assert_allclose(rate(linear), total[inner], atol=0.05)
    moment = (np.cross(at, force) + free_moment).sum(axis=1)
    moment += np.cross(positions[:, 3:6], result.residual_force) + result.residual_moment
    moment += np.cross(result.centre_of_mass, weight)
    np.testing.assert_allclose(rate(angular), moment[inner], atol=0.05)

    power = result.powers.sum(axis=1)
    power += (velocities[:, 3:6] * result.residual_force).sum(axis=1)
    power += (velocities[:, :3] * result.residual_moment).sum(axis=1)
    # The ground does work on the foot, a rigid body that moves.
    step = 1e-5
    for side, foot in enumerate(FEET):
        ahead = positions + step * velocities
        turned = Rotation.from_rotvec(step * velocities[:, :3]) * Rotation.from_rotvec(
            positions[:, :3]
        )
        ahead[:, :3] = turned.as_rotvec()
        now, then = (segment_frames(walk.model, q)[:, foot] for q in (positions, ahead))
        spin = Rotation.from_matrix(then[:, :3, :3] @ np.swapaxes(now[:, :3, :3], 1, 2))
        spin = spin.as_rotvec() / step
        speed = (then - now)[:, :3, 3] / step + np.cross(spin, at[:, side] - now[:, :3, 3])
        power += (speed * force[:, side]).sum(axis=1) + (spin * free_moment[:, side]).sum(axis=1)
    np.testing.assert_allclose(rate(energy), power[inner], atol=0.05)


def standing(model, frames: int = 8):
    time = np.arange(frames) * 0.01
    positions = np.zeros((frames, 31))
    positions[:, 5] = 0.9
    return time, positions


def test_standing_on_one_leg_is_statics(model):
    """The whole weight acts under the centre of mass on the left foot: nothing is left at the
    pelvis, and each moment is the lever of the force less the weight of what hangs below."""
    time, positions = standing(model)
    tree = tree_arrays(model)
    frames = segment_frames(model, positions)[0]
    place = np.einsum("sij,sj->si", frames[:, :3, :3], tree.centre_of_mass) + frames[:, :3, 3]
    centre = tree.mass @ place / tree.mass.sum()
    weight = model.mass * GRAVITY
    force = np.zeros((len(time), 2, 3))
    point = np.full((len(time), 2, 3), np.nan)
    force[:, 1, 2] = weight
    point[:, 1] = [centre[0], centre[1], 0.0]
    result = inverse_dynamics(model, time, positions, force, point, np.zeros_like(force))
    np.testing.assert_allclose(result.residual_force, 0.0, atol=1e-7)  # splines of 0.9
    np.testing.assert_allclose(result.residual_moment, 0.0, atol=1e-7)
    np.testing.assert_allclose(result.powers, 0.0, atol=1e-7)
    np.testing.assert_allclose(result.centre_of_mass, np.tile(centre, (len(time), 1)), atol=1e-12)

    def moment_about(joint, distal):
        """Moment (3,) that the proximal segment gives, of the weights `distal` and the ground."""
        at = frames[SEGMENTS.index(joint), :3, 3]
        total = -np.cross(point[0, 1] - at, force[0, 1])
        for name in distal:
            s = SEGMENTS.index(name)
            total -= np.cross(place[s] - at, [0.0, 0.0, -tree.mass[s] * GRAVITY])
        return total

    found = {name: values[0] for name, values in result.recorded_moments().items()}
    ankle = moment_about("foot_l", ("foot_l", "toes_l"))
    assert found["ankle_angle_l"] == pytest.approx(-ankle[1])
    assert found["subtalar_angle_l"] == pytest.approx(-ankle[0])
    knee = moment_about("shank_l", ("shank_l", "foot_l", "toes_l"))
    assert found["knee_angle_l"] == pytest.approx(knee[1])
    assert found["knee_adduction_l"] == pytest.approx(-knee[0])
    hip = moment_about("thigh_l", ("thigh_l", "shank_l", "foot_l", "toes_l"))
    assert found["hip_flexion_l"] == pytest.approx(-hip[1])
    assert found["hip_adduction_l"] == pytest.approx(-hip[0])
    # The ground pushes medially of knee and hip: both joints hold against it with an abduction
    # moment, as everyone does who stands on one leg.
    assert found["hip_adduction_l"] < -20.0
    assert found["knee_adduction_l"] < -10.0


def test_a_free_moment_twists_ankle_knee_and_hip_alike(model):
    """Outwards about the upright leg (right: -z, left: +z), so each joint holds inwards."""
    time, positions = standing(model)
    force, point = np.zeros((len(time), 2, 3)), np.zeros((len(time), 2, 3))
    free_moment = np.zeros_like(force)
    free_moment[:, 0, 2], free_moment[:, 1, 2] = -6.0, 4.0
    point[:] = segment_frames(model, positions)[:, FEET][..., :3, 3]
    found = inverse_dynamics(model, time, positions, force, point, free_moment).recorded_moments()
    assert set(found) == set(MOMENT_NAMES)
    for side, size in (("r", 6.0), ("l", 4.0)):
        for name in ("ankle_rotation", "knee_rotation", "hip_rotation"):
            np.testing.assert_allclose(found[f"{name}_{side}"], size, atol=1e-7)


def test_joint_forces_carry_the_weight_above(model):
    time, positions = standing(model)
    weight = model.mass * GRAVITY
    force, point = np.zeros((len(time), 2, 3)), np.zeros((len(time), 2, 3))
    force[:, :, 2] = 0.5 * weight
    point[:] = segment_frames(model, positions)[:, FEET][..., :3, 3]
    result = inverse_dynamics(model, time, positions, force, point, np.zeros_like(force))
    below = np.cumsum(
        [model["foot_r"].mass + model["toes_r"].mass, model["shank_r"].mass, model["thigh_r"].mass]
    )[::-1]
    expected = -(0.5 * weight - below * GRAVITY)  # hip, knee, ankle; down on the distal segment
    for side in (0, 1):
        np.testing.assert_allclose(result.joint_force[0, side, :, 2], expected)


def test_a_mirrored_walk_has_mirrored_moments(walk):
    order = [COORDINATES.index(mirrored(name)) for name in COORDINATES]
    positions = walk.positions[:, order]
    positions[:, :6] *= [-1, 1, -1, 1, -1, 1]  # rotations about x and z, and the place along y
    lumbar = [COORDINATES.index(name) for name in ("lumbar_bending", "lumbar_rotation")]
    positions[:, lumbar] *= -1
    side = [1, 0]
    polar, axial = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
    seen = inverse_dynamics(
        walk.model, walk.time, positions,
        walk.force[:, side] * polar, walk.point[:, side] * polar, walk.free_moment[:, side] * axial,
    )  # fmt: skip
    here = inverse_dynamics(walk.model, walk.time, walk.positions, *walk.wrenches)
    expected = here.moments[:, [ACTUATED.index(mirrored(name)) for name in ACTUATED]]
    expected[:, [i - 6 for i in lumbar]] *= -1
    # The scaled model is symmetric to the last bits only.
    np.testing.assert_allclose(seen.moments, expected, atol=1e-6)
    np.testing.assert_allclose(seen.locked_moments, here.locked_moments[:, side], atol=1e-6)


def test_moments_of_a_known_walk_come_back(walk):
    """At most 0.1 % of the peak without noise, from angles alone, in every frame."""
    result = inverse_dynamics(walk.model, walk.time, walk.positions, *walk.wrenches)
    error = np.abs(result.moments - walk.moments) / np.abs(walk.moments).max(axis=0)
    legs = [i for i, name in enumerate(ACTUATED) if name.split("_")[0] in ("hip", "knee", "ankle")]
    assert error[:, legs].max() < 1e-3
    # An arm's moments are a few newton metres; its first and last frame miss by more.
    assert error[1:-1].max() < 1e-3
    measures = residuals(result)
    assert measures.force_peak < 1e-3 * walk.model.mass * GRAVITY
    assert measures.moment_share < 1e-3
    assert measures.frames == len(walk.time)


@pytest.mark.parametrize("heading", [np.pi, 0.75 * np.pi, -0.5 * np.pi])
def test_the_direction_of_the_walk_does_not_matter(walk, heading):
    """Also where the rotation vector of the pelvis jumps from one side of half a turn to the
    other within the trial."""
    turned = known_walk(heading=heading)
    if heading == np.pi:
        assert np.abs(np.diff(turned.positions[:, :3], axis=0)).max() > np.pi
    here = inverse_dynamics(walk.model, walk.time, walk.positions, *walk.wrenches)
    there = inverse_dynamics(turned.model, turned.time, turned.positions, *turned.wrenches)
    np.testing.assert_allclose(there.moments, here.moments, atol=0.02)


def test_forces_of_the_wrong_feet_are_refused(walk):
    """The residual does not see it: a force is where it is, whichever foot it is said to act on."""
    exchanged = [array[:, [1, 0]] for array in walk.wrenches]
    with pytest.raises(RecordError, match=r"nearer to the other foot .* wrong feet"):
        inverse_dynamics(walk.model, walk.time, walk.positions, *exchanged)
    turned = [array * [-1.0, -1.0, 1.0] for array in walk.wrenches]
    shifted = walk.positions + np.where(np.arange(31) == 4, 0.5, 0.0)
    with pytest.raises(RecordError, match=r"different axes"):
        inverse_dynamics(walk.model, walk.time, shifted, *turned)


def test_the_level_of_the_ground_is_where_feet_press():
    point = np.full((4, 2, 3), np.nan)
    assert ground_level(point) == 0.0
    point[:3, 0], point[3, 1] = [1.0, 2.0, 0.25], [0.0, 0.0, 0.25]
    assert ground_level(point) == 0.25


def test_measures_of_residuals(walk):
    """Against their definitions: per component for OpenSim's, by length for Hicks et al.'s."""
    result = inverse_dynamics(walk.model, walk.time, walk.positions, *walk.wrenches)
    force, moment = np.zeros_like(result.residual_force), np.zeros_like(result.residual_force)
    force[0], force[1] = [3.0, 4.0, 0.0], [0.0, -4.0, 0.0]
    moment[2] = [0.0, 6.0, -8.0]
    result = replace(
        result, residual_force=force, residual_moment=moment, peak_external_force=500.0
    )
    chosen = np.arange(len(walk.time)) < 4
    measures = residuals(result, chosen, ground_height=0.1)
    assert (measures.force_peak, measures.moment_peak, measures.frames) == (4.0, 8.0, 4)
    assert measures.force_rms == pytest.approx(np.sqrt(2 * 16 / 4))
    assert measures.moment_rms == pytest.approx(4.0)
    assert measures.force_share == pytest.approx(0.01)
    height = result.centre_of_mass[chosen, 2].mean() - 0.1
    assert measures.moment_share == pytest.approx(10.0 / (height * 500.0))


def test_what_cannot_be_used_is_said(walk):
    model, time, positions = walk.model, walk.time, walk.positions

    def run(time=time, positions=positions, force=walk.force, free_moment=walk.free_moment):
        return inverse_dynamics(model, time, positions, force, walk.point, free_moment)

    holed = positions.copy()
    holed[5, 9] = np.nan
    with pytest.raises(RecordError, match=r"no value of knee_angle_r at 0\.03333 s \(1 of 450"):
        run(positions=holed)
    with pytest.raises(RecordError, match=r"do not increase: 0\.06 s is followed by 0\.05 s"):
        run(time=np.where(np.arange(len(time)) == 10, 0.05, time))
    lost = walk.force.copy()
    lost[:, 0] = np.nan
    with pytest.raises(RecordError, match="right foot has a centre of pressure but no force"):
        run(force=lost)
    with pytest.raises(RecordError, match="5 frames; velocities and accelerations need at least 6"):
        differentiate(time[:5], positions[:5])
    with pytest.raises(ValueError, match=r"force must have shape \(450, 2, 3\)"):
        run(force=walk.force[:-1])
    with pytest.raises(RecordError, match="in no frame is the ground reaction"):
        residuals(run(), np.zeros(len(time), dtype=bool))
    air = np.full_like(walk.point, np.nan)
    floating = inverse_dynamics(model, time, positions, air, air, air)
    with pytest.raises(RecordError, match="no foot has a ground reaction"):
        residuals(floating)
    # Without a ground reaction the residual carries the body.
    mean = floating.residual_force.mean(axis=0)
    assert mean[2] == pytest.approx(model.mass * GRAVITY, rel=0.05)


MARKERS = {
    "pelvis": [(0.09, 0.13, 0.08), (0.09, -0.13, 0.08), (-0.1, 0.05, 0.09), (-0.1, -0.05, 0.09)],
    "thigh": [(0.05, -0.1, -0.05), (0.08, -0.02, -0.2), (0.0, -0.06, -0.38)],
    "shank": [(0.04, -0.03, -0.08), (0.05, 0.0, -0.2), (0.0, -0.04, -0.36)],
    "foot": [(-0.06, 0.0, -0.03), (0.12, 0.05, -0.03), (0.11, -0.05, -0.04)],
}
"""m, about where a laboratory puts them."""
UNSEEN = [name for name in ACTUATED if name.split("_")[0] in ("mtp", "lumbar", "arm", "elbow")]


@pytest.mark.parametrize(("noise", "share"), [(0.0, 0.001), (0.003, 0.05)])
def test_moments_come_back_from_markers(walk, noise, share):
    """Markers to angles to moments, at most 0.1 % of the peak without noise; at most 5 %
    RMS with 3 mm of it, filtered as a recording is, in its default."""
    model, processing = walk.model, ProcessingSettings()
    markers = [
        ModelMarker(f"{segment}.{i}", segment, np.array(place))
        for segment in SEGMENTS
        for i, place in enumerate(MARKERS.get(segment.split("_")[0], ()))
    ]
    frames = segment_frames(model, walk.positions)
    on = [SEGMENTS.index(marker.segment) for marker in markers]
    places = np.array([[*marker.position, 1.0] for marker in markers])
    measured = np.einsum("tmij,mj->tmi", frames[:, on, :3], places)
    measured += np.random.default_rng(0).normal(0.0, noise, measured.shape)
    positions = inverse_kinematics(model, markers, measured, fixed=dict.fromkeys(UNSEEN, 0.0))
    positions = positions.positions
    if noise:
        positions = low_pass(
            positions,
            rate=RATE,
            cutoff_hz=processing.marker_cutoff_hz,
            order=processing.filter_order,
        )
    result = inverse_dynamics(model, walk.time, positions, *walk.wrenches)
    legs = [i for i, n in enumerate(ACTUATED) if n.split("_")[0] in ("hip", "knee", "ankle")]
    # The filter needs a cycle of its cut-off to settle at both ends of the trial.
    settled = slice(30, -30) if noise else slice(None)
    error = (result.moments - walk.moments)[settled, legs]
    size = np.sqrt((error**2).mean(axis=0)) if noise else np.abs(error).max(axis=0)
    assert (size / np.abs(walk.moments[:, legs]).max(axis=0)).max() < share
