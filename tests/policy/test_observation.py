"""What the walking task observes, and its mirror image."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulation_fixtures import changed, kinematics, mirror_image, symmetric
from walking_states import reference_at, restless

from gaitval.coordinates import ACTUATED, mirrored
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import nominal_parameters, parameter_bounds
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import OBSERVED, PARTS
from gaitval.walk.reference.motion import END_EFFECTORS
from gaitval.walk.simulation.walker import WalkingTask

SINGLE = 1e-6  # observations are single precision: 6e-8 of numbers up to ten


def whole_body(peer, q, qd):
    """Velocity of the centre of mass, and angular velocity I⁻¹ L, by DART's segments."""
    peer.set(q, qd)
    com, velocity = peer.skeleton.getCOM(), peer.skeleton.getCOMLinearVelocity()
    inertia, momentum = np.zeros((3, 3)), np.zeros(3)
    for name in SEGMENTS:
        body = peer.body(name)
        pose = body.getWorldTransform().matrix()
        turned = pose[:3, :3] @ body.getInertia().getMoment() @ pose[:3, :3].T
        arm = (pose @ [*body.getLocalCOM(), 1.0])[:3] - com
        inertia += turned + body.getMass() * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        speed = body.getCOMLinearVelocity() - velocity
        momentum += turned @ body.getAngularVelocity() + body.getMass() * np.cross(arm, speed)
    return velocity, np.linalg.solve(inertia, momentum)


def test_the_paper_observes_seventy_one_numbers_in_its_order(paper, peer):
    observation, *_ = restless(paper, 3, mu=nominal_parameters())
    q, qd = paper.walker.state
    velocity, angular_velocity = whole_body(peer, q, qd)
    blocks = {
        "positions of the actuated coordinates": q[6:],
        "their velocities": qd[6:],
        "velocity of the centre of mass": velocity,
        "angular velocity of the body about it": angular_velocity,
        "phase": [paper.walker.phase % 1.0],
        "mu": nominal_parameters(),
    }
    assert [len(block) for block in blocks.values()] == [25, 25, 3, 3, 1, 14]
    expected = np.concatenate(list(blocks.values()))
    np.testing.assert_allclose(observation, expected, rtol=SINGLE, atol=SINGLE)
    assert observation.dtype == np.float32


def test_the_extended_observation_adds_what_balance_needs(task, extended, peer):
    """The paper's blocks as errors of the reference, and the phase as a circle, the pelvis and
    the feet against the reference, the load of the feet, the last action."""
    bounds = parameter_bounds(task.configuration.randomisation)
    observation, _, _, _, _, action = restless(extended, 4, mu=nominal_parameters(), phase=0.3)
    walker = extended.walker
    q, qd = walker.state
    phase = walker.phase
    q_ref = reference_at(task, phase, task.reference.positions)
    velocities = np.concatenate([task.reference.velocities, task.reference.velocities[:1]])
    place = (phase % 1.0) * 1024
    qd_ref = velocities[int(place)] + place % 1.0 * (
        velocities[int(place) + 1] - velocities[int(place)]
    )
    qd_ref *= 1.0 + extended.constants.pace_scale * action[-1]
    velocity, angular_velocity = whole_body(peer, q, qd)
    turn = Rotation.from_rotvec(q[:3]) * Rotation.from_rotvec(q_ref[:3]).inv()
    origin = kinematics(task.model, q, qd).origin
    effectors = reference_at(task, phase, task.reference.end_effectors)
    beside = (q - q_ref)[3:6] * [1.0, 1.0, 0.0]  # where the pelvis is, is an error of its own
    feet = [origin[SEGMENTS.index(name)] for name in END_EFFECTORS[:2]] - effectors[:2] - beside
    leg = sum(np.linalg.norm(task.model[f"{name}_r"].joint_position) for name in ("shank", "foot"))
    expected = np.concatenate(
        [
            (q - q_ref)[6:],
            0.1 * (qd - qd_ref)[6:],
            velocity,
            angular_velocity,
            [phase % 1.0],
            (nominal_parameters() - np.mean(bounds, axis=0)) / (0.5 * np.diff(bounds, axis=0)[0]),
            [f(k * 2 * np.pi * phase) for k in (1, 2) for f in (np.sin, np.cos)],
            turn.as_rotvec(),
            (q - q_ref)[3:6],
            (qd - qd_ref)[:6],
            feet.ravel(),
            walker.mean_ground_reaction.ravel() / walker.weight,
            [task.reference.speed / np.sqrt(9.81 * leg)],
            np.where(
                [name.startswith(("arm", "elbow")) for name in (*ACTUATED, "pace")], 0, action
            ),
        ]
    )
    np.testing.assert_allclose(observation, expected, rtol=SINGLE, atol=5e-6)


def test_a_given_mu_is_simulated_and_observed(task, paper):
    mu = nominal_parameters()
    mu[:5] = 1.3, 0.7, 0.98, 1.01, 1.02
    mu[5:] = np.linspace(-0.008, 0.008, 9)
    observation, _ = paper.reset(options={"mu": mu})
    np.testing.assert_allclose(observation[57:71], mu, rtol=SINGLE)
    np.testing.assert_array_equal(paper.walker.mu, mu)


def test_the_extended_observation_scales_mu_to_its_bounds(task, extended):
    bounds = parameter_bounds(task.configuration.randomisation)
    for sign, bound in zip((-1.0, 1.0), bounds, strict=True):
        observation, _ = extended.reset(options={"mu": bound, "phase": 0.1})
        np.testing.assert_allclose(observation[57:71], sign, rtol=SINGLE)


@pytest.fixture(scope="module")
def twins(task):
    """Two environments of a person who is their own mirror image."""
    model, record = symmetric(task.model, task.record)
    task = WalkingTask.of(model, record, task.configuration)
    task = changed(task, environment={"mirror": True, "observation": "extended"})
    return WalkingEnvironment(task), WalkingEnvironment(task)


@pytest.mark.slow
def test_a_left_step_is_a_right_step_in_the_mirror(twins):
    """The same actions from phase φ and φ + 1/2: the same rewards, states that are mirror images,
    and the same observations but for the phase, which tells the legs apart. So a policy that does
    not look at the phase itself makes a symmetric walk of a symmetric body."""

    def compare(seen, other, tolerance):
        np.testing.assert_allclose(np.delete(seen, 56), np.delete(other, 56), atol=tolerance)
        assert abs(seen[56] - other[56]) == pytest.approx(0.5, abs=1e-5)

    right, left = twins
    options = {"mu": nominal_parameters(), "push": None, "noise": 0.0}
    seen, _ = right.reset(options={"phase": 0.11, **options})
    other, _ = left.reset(options={"phase": 0.61, **options})
    compare(seen, other, SINGLE)
    stride = right.task.reference.speed * right.task.reference.stride_time
    random = np.random.default_rng(0)
    # past φ = 1/4 and 1/2 on one side, past 3/4 and 1 on the other
    for _ in range(round(0.47 / right.walker.action_seconds)):
        action = random.normal(0.0, 0.4, 26).astype(np.float32)
        seen, reward, *_ = right.step(action)
        other, other_reward, *_ = left.step(action)
        # The walk amplifies the rounding of mirrored sums, ten times in 0.1 s at most.
        compare(seen, other, 1e-4)
        assert reward == pytest.approx(other_reward, abs=1e-5)
        state = left.walker.state[0].copy()
        state[3] -= 0.5 * stride
        np.testing.assert_allclose(mirror_image(state), right.walker.state[0], atol=1e-5)
    assert right.walker.phase > 0.5
    assert left.walker.phase > 1.0


def test_the_mirror_acts_around_the_left_heel_strike_only(task):
    """Subject 5's left and right differ, so the reference keeps its sides; what the policy sees
    of the right leg around its heel strike, it sees of the left one around that leg's."""
    plain = WalkingEnvironment(changed(task, environment={"mirror": False}))
    mirror = WalkingEnvironment(changed(task, environment={"mirror": True}))
    options = {"mu": nominal_parameters(), "push": None}
    for phase, acts in ((0.24, False), (0.26, True), (0.74, True), (0.76, False)):
        straight, _ = plain.reset(seed=1, options={"phase": phase, **options})
        seen, _ = mirror.reset(seed=1, options={"phase": phase, **options})
        for i, name in enumerate(ACTUATED):
            twin = ACTUATED.index(mirrored(name)) if acts else i
            sign = -1 if acts and name in ("lumbar_bending", "lumbar_rotation") else 1
            assert seen[i] == sign * straight[twin]
        assert seen[56] == pytest.approx(phase)


def test_the_papers_observation_is_never_mirrored(task):
    both = [
        WalkingEnvironment(changed(task, environment={"observation": "paper", "mirror": mirror}))
        for mirror in (True, False)
    ]
    first, second = (environment.reset(seed=1, options={"phase": 0.7})[0] for environment in both)
    np.testing.assert_array_equal(first, second)


def test_the_parts_of_an_observation_follow_each_other():
    places = [OBSERVED[part.name] for part in PARTS]
    assert [place.start for place in places] == [0, *(place.stop for place in places[:-1])]
    assert OBSERVED["speed"] == slice(99, 100)  # stored policies were trained on this order
    assert OBSERVED["feet"] == slice(87, 93)
    assert all(len(part.mirrors) == len(part.signs) for part in PARTS)
