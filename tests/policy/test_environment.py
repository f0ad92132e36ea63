"""The walking task: episodes, how they end, and what is drawn at random."""

import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from scipy.spatial.transform import Rotation
from simulation_fixtures import changed
from walking_states import put, reference_at

from gaitval.coordinates import ACTUATED
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import nominal_parameters, parameter_bounds
from gaitval.model.tree import empty_frames, forward
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import (
    OBSERVATION_SIZES,
)
from gaitval.policy.reward import REWARD_TERMS
from gaitval.policy.walking_group import WalkingGroup

NO_ACTION = np.zeros(26, dtype=np.float32)


# ---- Gymnasium. ----


def test_gymnasiums_checker_has_no_objection(environment):
    """Its advice against unbounded observations does not apply: training normalises them."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*Box observation space.*infinity")
        warnings.filterwarnings("ignore", message=".*recommend.*symmetric and normalized")
        warnings.filterwarnings("ignore", message=".*not having a spec")
        check_env(environment, skip_render_check=True)


def test_spaces(paper, extended, task):
    assert paper.observation_space.shape == (71,)
    assert extended.observation_space.shape == (126,)
    assert OBSERVATION_SIZES == {"paper": 71, "extended": 126}
    assert extended.action_space.shape == (26,)
    limit = task.configuration.environment.action_limit
    assert extended.action_space.high.min() == extended.action_space.high.max() == limit


# ---- Determinism. ----


def trajectory(environment, seed):
    observations = [environment.reset(seed=seed)[0]]
    random = np.random.default_rng(5)
    rewards = []
    for _ in range(8):
        observation, reward, *_ = environment.step(random.normal(0.0, 1.0, 26).astype("f4"))
        observations.append(observation)
        rewards.append(reward)
    return np.array(observations), np.array(rewards)


def test_one_seed_gives_one_episode(environment):
    other = WalkingEnvironment(environment.task)
    first = trajectory(environment, 11)
    for again in (trajectory(environment, 11), trajectory(other, 11)):
        np.testing.assert_array_equal(first[0], again[0])
        np.testing.assert_array_equal(first[1], again[1])
    assert not np.array_equal(first[0], trajectory(environment, 12)[0])


# ---- Ends. ----


def offset_state(**values):
    q = np.zeros(31)
    for name, value in values.items():
        q[3 + "xyz".index(name)] = value
    return q


@pytest.mark.parametrize(
    ("share", "fell"),
    [
        ({"z": -0.99}, False),
        ({"z": -1.01}, True),
        ({"z": 1.01}, True),
        ({"x": 0.99}, False),
        ({"x": -1.01}, True),
        ({"y": 1.01}, True),
        ({"x": 0.7, "y": 0.7}, False),
        ({"x": 0.71, "y": 0.71}, True),
    ],
)
def test_an_episode_ends_with_the_pelvis_off_its_place(extended, monkeypatch, share, fell):
    """Shares of the tolerances: of the height, and of the drift over the ground."""
    height, drift = extended.constants.height_tolerance, extended.constants.drift_tolerance
    x, y, z = (
        share.get(axis, 0.0) * size for axis, size in (("x", drift), ("y", drift), ("z", height))
    )
    extended.reset(options={"phase": 0.3, "mu": nominal_parameters(), "push": None, "noise": 0.0})
    put(extended, monkeypatch, q=offset_state(x=x, y=y, z=z))
    _, _, terminated, truncated, info = extended.step(NO_ACTION)
    assert terminated == fell
    assert not truncated
    assert info["errors"][-3] == pytest.approx(abs(z), abs=1e-9)
    assert info["errors"][-1] == pytest.approx(np.hypot(x, y), abs=1e-9)


def turn_pelvis(environment, monkeypatch, by):
    """After each step, by a rotation vector, rad."""
    plain, state = environment.walker.step, environment.walker.state

    def turned(*arguments, **pace):
        plain(*arguments, **pace)
        root = Rotation.from_rotvec(state[0, :3])
        state[0, :3] = (Rotation.from_rotvec(by) * root).as_rotvec()

    monkeypatch.setattr(environment.walker, "step", turned)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("share", "fell"), [(0.99, False), (1.01, True), (-1.01, True)])
def test_an_episode_ends_with_the_pelvis_turned(extended, monkeypatch, axis, share, fell):
    angle = share * extended.constants.rotation_tolerance
    extended.reset(options={"phase": 0.3, "mu": nominal_parameters(), "push": None, "noise": 0.0})
    put(extended, monkeypatch)
    turn_pelvis(extended, monkeypatch, angle * np.eye(3)[axis])
    _, _, terminated, _, info = extended.step(NO_ACTION)
    assert terminated == fell
    assert info["errors"][-2] == pytest.approx(abs(angle), rel=1e-6)


@pytest.mark.parametrize("part", ["z", "x", "turn"])
@pytest.mark.parametrize(("share", "fell"), [(0.39, False), (0.41, True)])
def test_an_episode_can_end_before_what_is_a_fall(task, monkeypatch, part, share, fell):
    early = WalkingEnvironment(task)
    early.tolerance_share = 0.4
    constants = early.constants
    off = {"z": constants.height_tolerance, "x": constants.drift_tolerance}.get(part, 0.0)
    early.reset(options={"phase": 0.3, "mu": nominal_parameters(), "push": None, "noise": 0.0})
    put(early, monkeypatch, q=offset_state(**({part: share * off} if off else {})))
    if part == "turn":
        turn_pelvis(early, monkeypatch, [0.0, 0.0, share * constants.rotation_tolerance])
    assert early.step(NO_ACTION)[2] == fell


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_a_simulation_that_blows_up_ends_the_episode_with_finite_numbers(
    environment, monkeypatch, bad
):
    """One number that is not finite would poison the running statistics of a whole training."""
    environment.reset(options={"phase": 0.3, "mu": nominal_parameters(), "push": None})
    put(environment, monkeypatch, q=np.full(31, bad), qd=np.full(31, bad))
    observation, reward, terminated, _, info = environment.step(NO_ACTION)
    assert terminated
    assert np.isfinite(observation).all()
    assert np.isfinite(reward)
    assert np.isfinite(info["reward_terms"]).all()
    observation, _ = environment.reset(seed=0)
    assert np.isfinite(observation).all()


def test_an_episode_ends_with_its_time(task):
    seconds = 5 * WalkingEnvironment(task).walker.action_seconds
    environment = WalkingEnvironment(changed(task, environment={"episode_seconds": seconds}))
    environment.reset(seed=0, options={"push": None})
    ends = [environment.step(NO_ACTION)[2:4] for _ in range(5)]
    assert ends == [(False, False)] * 4 + [(False, True)]


def test_cycles_are_counted_from_the_start(extended, task):
    extended.reset(options={"phase": 0.8, "mu": nominal_parameters(), "push": None})
    action = extended.walker.action_seconds / task.reference.stride_time
    for n in (1, 2, 3):
        info = extended.step(NO_ACTION)[4]
        assert info["cycles"] == pytest.approx(n * action, rel=1e-9)


# ---- Actions. ----


def test_actions_are_offsets_of_the_joint_targets(extended, task):
    extended.reset(options={"phase": 0.2, "mu": nominal_parameters(), "push": None})
    action = np.linspace(-1.0, 1.0, 26).astype(np.float32)
    extended.step(action)
    scale = task.configuration.environment.action_scale
    arms = np.array([name.startswith(("arm", "elbow")) for name in ACTUATED])
    expected = np.where(arms, 0.0, extended.entering * scale * action[:25])
    np.testing.assert_allclose(extended.walker.offset, expected, rtol=1e-6)


def test_arms_may_be_given_to_the_policy(task):
    environment = WalkingEnvironment(changed(task, environment={"arm_share": 0.5}))
    environment.reset(options={"phase": 0.2, "mu": nominal_parameters(), "push": None})
    environment.step(np.ones(26, dtype=np.float32))
    scale = task.configuration.environment.action_scale
    elbow, knee = (
        environment.walker.offset[ACTUATED.index(f"{n}_r")] for n in ("elbow_flex", "knee_angle")
    )
    assert elbow == pytest.approx(0.5 * environment.entering * scale)
    assert knee == pytest.approx(environment.entering * scale)


@pytest.mark.parametrize("phase", [0.2, 0.7])  # the mirror leaves the pace as it is
@pytest.mark.parametrize("size", [-4.0, -1.0, 0.0, 2.0])
def test_the_last_number_of_an_action_is_the_pace(extended, task, phase, size):
    extended.reset(options={"phase": phase, "mu": nominal_parameters(), "push": None})
    action = NO_ACTION.copy()
    action[-1] = size
    _, _, _, _, info = extended.step(action)
    pace = 1.0 + extended.entering * task.configuration.environment.pace_scale * size
    share = extended.walker.action_seconds / task.reference.stride_time
    assert info["cycles"] == pytest.approx(pace * share, rel=1e-9)
    assert info["errors"][REWARD_TERMS.index("pace")] == pytest.approx((pace - 1.0) ** 2)


def test_without_a_pace_of_its_own_the_policy_keeps_to_the_record(task):
    environment = WalkingEnvironment(changed(task, environment={"pace_scale": 0.0}))
    assert environment.action_space.shape == (25,)
    environment.reset(options={"phase": 0.2, "mu": nominal_parameters(), "push": None})
    _, _, _, _, info = environment.step(np.full(25, 0.5, dtype=np.float32))
    share = environment.walker.action_seconds / task.reference.stride_time
    assert info["cycles"] == pytest.approx(share, rel=1e-9)
    with pytest.raises(ValueError, match="broadcast"):
        environment.step(NO_ACTION)


def test_actions_beyond_the_limit_are_clipped(extended, task):
    limit = task.configuration.environment.action_limit
    results = []
    for size in (limit, 100.0):
        extended.reset(seed=0, options={"phase": 0.2, "push": None})
        results.append(extended.step(np.full(26, size, dtype=np.float32))[0])
    np.testing.assert_array_equal(*results)


# ---- What is drawn at random, and what can be asked for. ----


def test_episodes_start_all_over_the_cycle_on_the_reference(task, extended):
    phases = []
    for seed in range(200):
        extended.reset(seed=seed, options={"mu": nominal_parameters(), "noise": 0.0})
        phases.append(extended.walker.phase)
        if seed < 10:
            expected = reference_at(task, phases[-1], task.reference.positions)
            np.testing.assert_allclose(extended.walker.state[0], expected, atol=1e-12)
    # Of 200 uniform draws every tenth of the cycle gets 20, SD 4.2.
    counts, _ = np.histogram(phases, bins=10, range=(0.0, 1.0))
    assert counts.min() > 4


def test_whole_cycles_ahead_differ_by_the_travel_alone(task, extended):
    options = {"mu": nominal_parameters(), "noise": 0.0, "push": None}
    extended.reset(options={"phase": 0.25, **options})
    here = extended.walker.state.copy()
    extended.reset(options={"phase": 2.25, **options})
    there = extended.walker.state.copy()
    there[0, 3] -= 2 * task.reference.speed * task.reference.stride_time
    np.testing.assert_allclose(there, here, atol=1e-12)


def test_mu_is_drawn_within_its_bounds_in_proportion_to_the_difficulty(task, extended):
    lower, upper = parameter_bounds(task.configuration.randomisation)
    nominal = nominal_parameters()
    for difficulty in (1.0, 0.5, 0.0):
        extended.difficulty = difficulty
        drawn = []
        for seed in range(60):
            extended.reset(seed=seed)
            drawn.append(extended.walker.mu)
        drawn = np.array(drawn)
        slack = 1e-12
        assert np.all(drawn >= nominal + difficulty * (lower - nominal) - slack)
        assert np.all(drawn <= nominal + difficulty * (upper - nominal) + slack)
        # 60 uniform draws cover 80 % of a range but for one time in 10 000.
        spread = np.ptp(drawn, axis=0)
        assert np.all(spread >= 0.8 * difficulty * (upper - lower) - slack)
    np.testing.assert_array_equal(drawn, np.tile(nominal, (60, 1)))
    extended.difficulty = 1.0


def test_longer_legs_start_with_their_soles_where_the_nominal_ones_are(task, extended):
    """Without the lift, 3 % longer thighs and shanks would start 2 cm in the ground."""

    def sole(mu, phase):
        extended.reset(options={"mu": mu, "phase": phase, "noise": 0.0, "push": None})
        tree = extended.walker.tree
        frames = kinematics_of(tree, extended.walker.state[0])
        rotation, origin = (values[tree.sphere_segment] for values in frames)
        centres = np.einsum("kij,kj->ki", rotation, tree.sphere_position) + origin
        return (centres[:, 2] - tree.sphere_radius).min()

    longer = nominal_parameters()
    longer[3:5] = 1.03
    for phase in (0.1, 0.3, 0.6, 0.8):
        assert sole(longer, phase) == pytest.approx(sole(nominal_parameters(), phase), abs=0.004)


def test_a_body_that_the_reference_was_made_for_is_not_lifted(task):
    longer = nominal_parameters()
    longer[3:5] = 1.03
    own = WalkingEnvironment(replace(task, reference_mu=longer))
    heights = {}
    for name, mu in (("its own", longer), ("nominal", nominal_parameters())):
        own.reset(options={"mu": mu, "phase": 0.3, "noise": 0.0, "push": None})
        heights[name] = own.walker.state[0, 5]
    assert heights["its own"] == pytest.approx(reference_at(task, 0.3, task.reference.positions)[5])
    legs = [SEGMENTS.index(name) for name in ("shank_r", "foot_r")]
    length = -sum(task.model.segments[i].joint_position[2] for i in legs)
    assert heights["its own"] - heights["nominal"] == pytest.approx(0.03 * length)


def kinematics_of(tree, q):
    frames = empty_frames()
    forward(tree.joint_position, q, frames, 14)
    return frames.rotation, frames.origin


def test_initial_noise_is_on_the_joints_only(task, extended):
    options = {"mu": nominal_parameters(), "phase": 0.4, "push": None}
    extended.reset(seed=0, options={**options, "noise": 0.0})
    exact = extended.walker.state.copy()
    deviations = []
    for seed in range(40):
        extended.reset(seed=seed, options={**options, "noise": 0.05})
        change = extended.walker.state - exact
        assert not change[0, :6].any()
        assert not change[1].any()
        deviations.append(change[0, 6:])
    assert np.std(deviations) == pytest.approx(0.05, rel=0.1)  # 1000 draws: 2 % standard error


def impulses(environment, steps=12):
    """Impulse (2,) of the push on the pelvis and the phase at its start."""
    impulse, began = np.zeros(2), None
    for _ in range(steps):
        before = environment.walker.phase
        environment.step(NO_ACTION)
        force = environment.episode.root_force
        assert not force[:3].any()
        assert force[5] == 0.0
        if force.any() and began is None:
            began = before
        impulse += force[3:5] * environment.walker.action_seconds
    return impulse, began


@pytest.mark.parametrize("steps_per_action", [3, 10, 25, 30, 80])
@pytest.mark.parametrize("seconds", [0.05, 0.03])
def test_a_push_has_its_impulse_whatever_the_length_of_an_action(task, steps_per_action, seconds):
    environment = WalkingEnvironment(
        changed(task, environment={"steps_per_action": steps_per_action, "push_seconds": seconds})
    )
    push = (0.12, 240.0, -0.7)
    environment.reset(seed=0, options={"phase": 0.1, "push": push, "mu": nominal_parameters()})
    impulse, began = impulses(environment, 24)
    expected = 240.0 * seconds * np.array([np.cos(0.7), -np.sin(0.7)])
    np.testing.assert_allclose(impulse, expected, rtol=1e-9)
    action = environment.walker.action_seconds / task.reference.stride_time
    assert began + 1e-9 >= 0.12
    assert began < 0.12 + action + 1e-9


def test_an_episode_that_ends_in_a_push_leaves_nothing_of_it(task):
    """Neither its force nor what was left of its 50 ms, alone and in a group of eight."""
    options = {"phase": 0.1, "mu": nominal_parameters(), "noise": 0.0}
    alone, group = WalkingEnvironment(task), WalkingGroup([task] * 8)
    for begin, environment in ((alone.reset, alone), (partial(group.reset, 0), None)):

        def act(environment=environment):
            if environment is None:
                group.step(np.zeros((8, 26), np.float32), np.zeros((8, 126), np.float32))
            else:
                environment.step(NO_ACTION)

        pushed = environment or group.environments[0]
        for later in (None, (0.4, 100.0, 0.0)):
            begin(options={**options, "push": (0.1, 300.0, 1.0)})
            for _ in range(2):
                act()
                assert pushed.episode.root_force.any()
            begin(options={**options, "push": later})
            for _ in range(12):
                act()
                assert not pushed.episode.root_force.any()


@pytest.mark.parametrize(("probability", "options"), [(0.0, {}), (1.0, {"push": None})])
def test_no_push_without_a_chance_and_when_asked_for_none(task, probability, options):
    settings = {"push_probability": probability, "episode_seconds": 1.2}
    environment = WalkingEnvironment(changed(task, environment=settings))
    environment.reset(seed=1, options=options)
    impulse, began = impulses(environment, 40)
    assert began is None
    assert not impulse.any()


def test_the_share_of_pushed_episodes_is_the_configured_one(task):
    pushed = WalkingEnvironment(changed(task, environment={"push_probability": 0.3}))
    count = 0
    for seed in range(200):
        pushed.reset(seed=seed)
        count += pushed._push is not None
    assert 35 <= count <= 85  # 60, SD 6.5


def test_random_pushes_are_the_papers(task):
    """Uniform in 0 to 800 N, every other one in 0 to 450 N, and in -90 to 90 degrees from straight
    ahead, every other one from 45 to 100 degrees, for 50 ms, at any moment of the gait cycle but
    the first half cycle of an episode."""
    assert task.configuration.environment.push_force == 800.0
    assert task.configuration.environment.push_seconds == 0.05
    pushed = WalkingEnvironment(changed(task, environment={"push_probability": 1.0}))
    drawn = []
    for seed in range(200):
        pushed.reset(seed=seed)
        start, force, direction = pushed._push
        drawn.append((start - pushed.walker.phase, force, direction))
    starts, forces, directions = np.array(drawn).T
    assert starts.min() >= 0.5
    longest = pushed.constants.push_interval[1]
    assert 0.5 + 0.9 * longest < starts.max() <= 0.5 + longest
    assert np.ptp(starts % 1.0) > 0.9
    assert 0.0 <= forces.min() < 80.0
    assert 720.0 < forces.max() <= 800.0
    assert np.mean(forces > 450.0) == pytest.approx(0.5 * 350.0 / 800.0, abs=0.09)  # SD 0.03
    beyond = np.abs(directions) > np.pi / 2
    assert np.rad2deg(np.abs(directions)).max() <= 100.0
    assert beyond.mean() == pytest.approx(0.5 * 10.0 / 55.0, abs=0.07)  # SD 0.02
    aside = np.abs(directions) > np.pi / 4
    assert aside.mean() == pytest.approx(0.75, abs=0.1)  # SD 0.03
    assert np.mean(directions > 0.0) == pytest.approx(0.5, abs=0.12)  # SD 0.035
    pushed.difficulty = 0.0
    pushed.reset(seed=0)
    assert pushed._push[1] == 0.0


@pytest.mark.parametrize("wanted", [False, True])
@pytest.mark.parametrize(("seconds", "steps_per_action"), [(0.05, 5), (0.1, 5), (0.03, 18)])
def test_random_pushes_come_again_whatever_rounding_leaves_of_the_last_and_asked_ones_do_not(
    task, monkeypatch, seconds, steps_per_action, wanted
):
    """0.1 s less ten actions of 0.01 s are 1e-17 s, and 0.03 s less one of 0.036 s are -3e-18 s:
    with the first every other push was left out, with the second all but one."""
    settings = {
        "push_probability": 1.0,
        "push_interval": (0.6, 0.9),
        "push_seconds": seconds,
        "steps_per_action": steps_per_action,
    }
    pushed = WalkingEnvironment(changed(task, environment=settings))
    options = {"push": (0.5, 300.0, 0.0)} if wanted else {}
    pushed.reset(seed=3, options={"phase": 0.2, **options})
    action = pushed.walker.action_seconds / task.reference.stride_time

    def walks_on(*_, **__):
        pushed.walker.phase += action

    monkeypatch.setattr(pushed.walker, "step", walks_on)
    began, before = [], False
    while pushed.walker.phase < 6.0:
        phase = pushed.walker.phase
        pushed.step(NO_ACTION)
        acts = bool(np.abs(pushed.episode.root_force).max() > 1e-6)
        if acts and not before:
            began.append(phase)
        before = acts
    if wanted:
        assert began == pytest.approx([0.5], abs=action)
        return
    assert 0.7 <= began[0] <= 0.7 + 0.9 + action
    gaps = np.diff(began)
    assert len(gaps) >= 4
    assert np.all((gaps > 0.6 - action) & (gaps < 0.9 + action))
    assert np.ptp(gaps) > 0.03


def test_a_policy_is_told_how_the_body_differs_from_the_one_of_its_reference(task):
    """So it walks a body with a reference of its own as it walks the scaled body with its own."""
    mu = nominal_parameters()
    mu[[2, 4, 8]] += [0.03, -0.02, 0.01]
    mu[0] += 0.02
    own = replace(task, reference_mu=mu)
    options = {"phase": 0.25, "push": None, "noise": 0.0}
    plain = WalkingEnvironment(task).reset(seed=0, options={**options, "mu": mu})[0]
    seen = WalkingEnvironment(own).reset(seed=0, options={**options, "mu": mu})[0]
    nominal = nominal_parameters()
    nominal[0] = mu[0]  # damping is no part of a reference
    wanted = WalkingEnvironment(task).reset(seed=0, options={**options, "mu": nominal})[0]
    differ = ~np.isclose(plain, seen)
    at_mu = np.flatnonzero(differ)
    np.testing.assert_allclose(seen[at_mu[:3]], wanted[at_mu[:3]], atol=1e-6)
    assert differ.sum() >= 3


def test_a_policy_is_told_the_whole_friction_and_damping(task):
    """A reference does not depend on them, so they are no difference from its body."""
    mu = nominal_parameters()
    mu[:2] = 0.15, 0.95
    options = {"phase": 0.25, "push": None, "noise": 0.0, "mu": mu}
    for reference_mu in (None, mu):
        message = WalkingEnvironment(replace(task, reference_mu=reference_mu))
        message.reset(seed=0, options=options)
        lower, upper = parameter_bounds(task.configuration.randomisation)
        expected = (2.0 * mu[:2] - lower[:2] - upper[:2]) / (upper[:2] - lower[:2])
        np.testing.assert_allclose(message.episode.parameters[:2], expected, rtol=1e-9)


@pytest.mark.parametrize("phase", [0.15, 0.35, 0.65])
def test_the_first_observation_has_the_references_ground_reaction(task, extended, phase):
    """In body weights, as all later ones have the simulated one."""
    options = {"mu": nominal_parameters(), "push": None, "noise": 0.0}
    seen = extended.reset(options={"phase": phase, **options})[0][93:99]
    table = task.reference.ground_reaction.reshape(-1, 6)
    expected = reference_at(task, phase, table)
    np.testing.assert_allclose(seen, expected, atol=1e-6)
    assert 0.5 < seen[2] + seen[5] < 1.5


# ---- Actions enter as muscles are activated. ----


def test_an_action_that_alternates_reaches_the_joints_smoothed(task):
    """A first-order filter: of an action held, 1 - exp(-t / time) after t; one that alternates is
    left with the share e / (2 - e) of its size."""
    settings = task.configuration.environment
    environment = WalkingEnvironment(task.with_environment(centring=0.0))
    enters = 1.0 - np.exp(-environment.walker.action_seconds / settings.action_time)
    environment.reset(seed=0, options={"phase": 0.3, "push": None})
    environment.step(NO_ACTION + 1.0)
    leg = slice(0, 3)
    np.testing.assert_allclose(environment.episode.action[leg], enters, rtol=1e-6)
    np.testing.assert_allclose(
        environment.walker.offset[leg], settings.action_scale * enters, rtol=1e-6
    )
    environment.reset(seed=0, options={"phase": 0.3, "push": None})
    for turn in range(30):
        environment.step(NO_ACTION + (-1.0) ** turn)
    np.testing.assert_allclose(
        np.abs(environment.episode.action[leg]), enters / (2.0 - enters), rtol=1e-3
    )
