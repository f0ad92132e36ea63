"""The reward of the walking task: all of it for the reference, less for every error."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulation_fixtures import changed, kinematics
from walking_states import put, reference_at, restless

from gaitval.coordinates import ACTUATED
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import nominal_parameters
from gaitval.policy import reward
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import is_mirrored
from gaitval.policy.reward import REWARD_TERMS
from gaitval.walk.reference.motion import END_EFFECTORS

NO_ACTION = np.zeros(26, dtype=np.float32)


@pytest.mark.parametrize("phase", [0.05, 0.4, 0.77])
def test_the_reference_itself_gets_the_whole_reward(task, extended, monkeypatch, phase):
    """Every kernel is 1 and the weights sum to 1; the cost of the moments is what is configured:
    0.005 / Σ weights x Σ τ² / mass². Linear interpolation of ê and ĉ between 1024 samples leaves
    1e-6."""
    extended.reset(options={"phase": phase, "mu": nominal_parameters(), "push": None, "noise": 0.0})
    put(extended, monkeypatch)
    _, reward, fell, _, info = extended.step(NO_ACTION)
    weights = [getattr(task.configuration.reward, name) for name in REWARD_TERMS]
    total = sum(weights[:-1])
    np.testing.assert_allclose(info["reward_terms"][:-1], np.array(weights[:-1]) / total, atol=1e-6)
    cost = weights[-1] / total * 25 * 100.0 / task.model.mass**2
    assert info["reward_terms"][-1] == pytest.approx(-cost, rel=1e-9)
    assert reward == pytest.approx(1.0 - cost, abs=1e-5)
    assert not fell


def test_every_term_falls_with_its_own_squared_error(task, extended, peer):
    """weight / Σ weights x exp(-sharpness x squared error), errors computed anew from the state."""
    _, reward, _, _, info, action = restless(extended, 6, mu=nominal_parameters(), phase=0.55)
    walker, reference = extended.walker, task.reference
    q, qd = walker.state
    q_ref = reference_at(task, walker.phase, reference.positions)
    rates = np.concatenate([reference.velocities, reference.velocities[:1]])
    place = walker.phase % 1.0 * 1024
    qd_ref = rates[int(place)] + place % 1.0 * (rates[int(place) + 1] - rates[int(place)])
    pace = 1.0 + extended.constants.pace_scale * float(action[-1])
    qd_ref *= pace  # who walks through the cycle faster moves faster
    middle = walker.phase - 0.5 * pace * walker.action_seconds / reference.stride_time
    row = round(middle % 1.0 * 1024) % 1024  # to half a sample; forces change by up to 0.5 %
    origin = kinematics(task.model, q, qd).origin
    effectors = np.array([origin[SEGMENTS.index(name)] for name in END_EFFECTORS])
    peer.set(q)
    turn = Rotation.from_rotvec(q[:3]) * Rotation.from_rotvec(q_ref[:3]).inv()
    has_moment = reference.moments.any(axis=0)
    moment_error = (walker.mean_moments - reference.moments[row])[has_moment] / task.model.mass
    expected_effectors = reference_at(task, walker.phase, reference.end_effectors)
    expected_effectors[:, :2] += (q - q_ref)[3:5]  # where the pelvis is, is an error of its own
    force_error = walker.mean_ground_reaction / walker.weight - reference.ground_reaction[row]
    force_weights = np.array([2.0, 3.0, 1.0])  # as the configuration says
    squares = {
        "joint_positions": ((q - q_ref)[6:] ** 2).sum(),
        "joint_velocities": ((qd - qd_ref)[6:] ** 2).sum(),
        "centre_of_mass": (
            (peer.skeleton.getCOM() - reference_at(task, walker.phase, reference.centre_of_mass))
            ** 2
        ).sum(),
        "pelvis_rotation": turn.magnitude() ** 2,
        "end_effectors": ((effectors - expected_effectors) ** 2).sum(),
        "ground_reaction": ((force_weights * force_error) ** 2).sum(),
        "joint_moments": (moment_error**2).sum(),
        "pace": (pace - 1.0) ** 2,
        "action_change": info["errors"][8],  # see the test below
    }
    assert has_moment.all()  # the fitted reference has the moment of every joint
    settings = task.configuration.reward
    total = sum(getattr(settings, name) for name in squares)
    terms = dict(zip(REWARD_TERMS, info["reward_terms"], strict=True))
    for i, (name, square) in enumerate(squares.items()):
        loose = name in ("ground_reaction", "joint_moments")
        assert info["errors"][i] == pytest.approx(square, rel=0.1 if loose else 1e-4, abs=1e-8)
        sharpness = getattr(settings, f"{name}_sharpness")
        assert terms[name] == pytest.approx(
            getattr(settings, name) / total * np.exp(-sharpness * info["errors"][i]), rel=1e-12
        )
        assert square > 0.0
    effort = walker.mean_square_moments.sum() / task.model.mass**2
    assert terms["torque"] == pytest.approx(-settings.torque / total * effort, rel=1e-12)
    assert reward == pytest.approx(info["reward_terms"].sum(), abs=1e-12)
    assert reward < 1.0


def test_the_change_of_the_action_is_that_of_what_acts(task):
    """The mean over the 26 numbers of an action of the squared change since the last one, none at
    the start; what the arms are asked for does not act, and mirrored actions are compared as the
    body gets them."""
    environment = WalkingEnvironment(task)
    options = {"mu": nominal_parameters(), "push": None, "phase": 0.2}
    environment.reset(seed=0, options=options)
    first, second = NO_ACTION.copy(), NO_ACTION.copy()
    knee, elbow = ACTUATED.index("knee_angle_r"), ACTUATED.index("elbow_flex_l")
    first[[knee, elbow]] = 0.6, 2.0
    second[[knee, elbow]] = -0.2, -2.0
    place = REWARD_TERMS.index("action_change")
    entered = 0.0
    for action in (first, second, second):
        _, _, _, _, info = environment.step(action)
        change = environment.entering * (action[knee] - entered)
        entered += change
        assert info["errors"][place] == pytest.approx(change**2 / 26, rel=1e-5)
    while not is_mirrored(environment.walker.phase):
        environment.step(second)
        entered += environment.entering * (second[knee] - entered)
    mirror_image = second.copy()
    mirror_image[[knee, ACTUATED.index("knee_angle_l")]] = 0.0, -0.2
    _, _, _, _, info = environment.step(mirror_image)
    change = environment.entering * (second[knee] - entered)
    assert info["errors"][place] == pytest.approx(change**2 / 26, rel=1e-3, abs=1e-12)


def test_weights_and_sharpness_come_from_the_configuration(task):
    only = {
        name: 0.0
        for name in REWARD_TERMS
        if name not in ("joint_positions", "joint_velocities", "torque")
    }
    single = changed(
        task, reward={**only, "joint_velocities": 0.0, "torque": 0.0, "joint_positions": 3.0}
    )
    environment = WalkingEnvironment(single)
    _, reward, _, _, info, _ = restless(environment, 2)
    sharpness = task.configuration.reward.joint_positions_sharpness
    assert reward == pytest.approx(np.exp(-sharpness * info["errors"][0]), rel=1e-12)


def test_each_term_and_error_has_its_name():
    """The names that compiled code writes by are those of the tables."""
    assert [getattr(reward, name.upper()) for name in REWARD_TERMS] == [*range(len(REWARD_TERMS))]
    assert [getattr(reward, name.upper()) for name in reward.ERRORS] == [*range(len(reward.ERRORS))]
