"""The walking task: what it observes, rewards, ends on and draws at random."""

import warnings

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from scipy.spatial.transform import Rotation
from simulation_fixtures import changed, kinematics, mirror_image, symmetric

from gaitval.coordinates import ACTUATED, mirrored
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import nominal_parameters, parameter_bounds
from gaitval.model.tree import forward
from gaitval.policy.environment import OBSERVATION_SIZES, REWARD_TERMS, WalkingEnvironment
from gaitval.reference.motion import END_EFFECTORS
from gaitval.simulation.walker import WalkingTask

NO_ACTION = np.zeros(26, dtype=np.float32)
SINGLE = 1e-6  # observations are single precision: 6e-8 of numbers up to ten


@pytest.fixture(scope="module")
def paper(task):
    return WalkingEnvironment(changed(task, environment={"observation": "paper"}))


@pytest.fixture(scope="module")
def extended(task):
    return WalkingEnvironment(changed(task, environment={"mirror": False}))


@pytest.fixture(params=["paper", "extended"])
def environment(request, paper, extended):
    environment = {"paper": paper, "extended": extended}[request.param]
    environment.difficulty = 1.0
    return environment


def restless(environment, seed, **options):
    """Reset and three random actions: a state away from the reference. Returns what the last
    step returned, and its action."""
    environment.reset(seed=seed, options={"push": None, **options})
    random = np.random.default_rng(seed)
    for _ in range(3):
        action = random.normal(0.0, 0.5, 26).astype(np.float32)
        result = environment.step(action)
    return (*result, action)


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
    assert extended.observation_space.shape == (125,)
    assert OBSERVATION_SIZES == {"paper": 71, "extended": 125}
    assert extended.action_space.shape == (26,)
    limit = task.configuration.environment.action_limit
    assert extended.action_space.high.min() == extended.action_space.high.max() == limit


# ---- Observation. ----


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


def reference_at(task, phase, table):
    """A reference table (N, …) at a phase, linear between its samples, with the travel."""
    count = len(table)
    place = (phase % 1.0) * count
    row, part = int(place), place % 1.0
    stride = task.reference.speed * task.reference.stride_time
    ahead = table[(row + 1) % count].copy()
    travel = np.zeros(ahead.shape)
    if ahead.shape == (31,):
        travel[3] = stride
    elif ahead.shape[-1] == 3:
        travel[..., 0] = stride
    if row + 1 == count:
        ahead = ahead + travel
    return (1 - part) * table[row] + part * ahead + np.floor(phase) * travel


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
    origin = kinematics(task.model, q, qd)["origin"]
    effectors = reference_at(task, phase, task.reference.end_effectors)
    beside = (q - q_ref)[3:6] * [1.0, 1.0, 0.0]  # where the pelvis is, is an error of its own
    feet = [origin[SEGMENTS.index(name)] for name in END_EFFECTORS[:2]] - effectors[:2] - beside
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
            action,
        ]
    )
    np.testing.assert_allclose(observation, expected, rtol=SINGLE, atol=5e-6)


def test_an_observation_is_not_changed_by_the_next_step(environment):
    first, _ = environment.reset(seed=0)
    kept = first.copy()
    environment.step(NO_ACTION + 1.0)
    np.testing.assert_array_equal(first, kept)


# ---- Mirror. ----


@pytest.fixture(scope="module")
def twins(task):
    """Two environments of a person who is their own mirror image."""
    model, record = symmetric(task.model, task.record)
    task = WalkingTask.of(model, record, task.configuration)
    task = changed(task, environment={"mirror": True, "observation": "extended"})
    return WalkingEnvironment(task), WalkingEnvironment(task)


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
    for _ in range(
        round(0.47 / right.walker.action_seconds)
    ):  # past φ = 1/2 on one side and past 1 on the other
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


def test_the_mirror_acts_in_the_second_half_only(task):
    """Subject 5's left and right differ, so the reference keeps its sides; what the policy sees
    of the right leg in the first half of the cycle, it sees of the left one in the second."""
    plain = WalkingEnvironment(changed(task, environment={"mirror": False}))
    mirror = WalkingEnvironment(changed(task, environment={"mirror": True}))
    options = {"mu": nominal_parameters(), "push": None}
    for phase, acts in ((0.2, False), (0.7, True)):
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


# ---- Reward. ----


def put(environment, monkeypatch, *, q=None, qd=None, perfect=True):
    """Make the next step lead to a given state with the reference's mean forces and moments."""
    walker, task = environment.walker, environment.task

    def step(offset, root_force, recording, *, pace):
        del offset, root_force, recording
        walker.phase += walker.action_seconds / task.reference.stride_time
        walker.state[0] = reference_at(task, walker.phase, task.reference.positions)
        rates = np.concatenate([task.reference.velocities, task.reference.velocities[:1]])
        place = walker.phase % 1.0 * 1024
        walker.state[1] = rates[int(place)] + place % 1.0 * (
            rates[int(place) + 1] - rates[int(place)]
        )
        if q is not None:
            walker.state[0] += q
        if qd is not None:
            walker.state[1] += qd
        if perfect:
            middle = walker.phase - 0.5 * walker.action_seconds / task.reference.stride_time
            place = middle % 1.0 * 1024
            row, part = int(place), place % 1.0
            for target, table in (
                (walker.mean_ground_reaction, task.reference.ground_reaction * walker.weight),
                (walker.mean_moments, task.reference.moments),
            ):
                target[:] = (1 - part) * table[row] + part * table[(row + 1) % 1024]
        walker.mean_square_moments[:] = 100.0

    monkeypatch.setattr(walker, "step", step)


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
    origin = kinematics(task.model, q, qd)["origin"]
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
    assert info["errors"][8] == pytest.approx(abs(z), abs=1e-9)
    assert info["errors"][10] == pytest.approx(np.hypot(x, y), abs=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("share", "fell"), [(0.99, False), (1.01, True), (-1.01, True)])
def test_an_episode_ends_with_the_pelvis_turned(extended, monkeypatch, axis, share, fell):
    angle = share * extended.constants.rotation_tolerance
    extended.reset(options={"phase": 0.3, "mu": nominal_parameters(), "push": None, "noise": 0.0})
    put(extended, monkeypatch)
    plain = extended.walker.step

    def turned(*arguments, **pace):
        plain(*arguments, **pace)
        turn = Rotation.from_rotvec(angle * np.eye(3)[axis])
        root = Rotation.from_rotvec(extended.walker.state[0, :3])
        extended.walker.state[0, :3] = (turn * root).as_rotvec()

    monkeypatch.setattr(extended.walker, "step", turned)
    _, _, terminated, _, info = extended.step(NO_ACTION)
    assert terminated == fell
    assert info["errors"][9] == pytest.approx(abs(angle), rel=1e-6)


@pytest.mark.parametrize("part", ["z", "x", "turn"])
@pytest.mark.parametrize(("share", "fell"), [(0.39, False), (0.41, True)])
def test_an_episode_can_end_before_what_is_a_fall(task, monkeypatch, part, share, fell):
    early = WalkingEnvironment(task)
    early.tolerance_share = 0.4
    constants = early.constants
    off = {"z": constants.height_tolerance, "x": constants.drift_tolerance}.get(part, 0.0)
    early.reset(options={"phase": 0.3, "mu": nominal_parameters(), "push": None, "noise": 0.0})
    put(early, monkeypatch, q=offset_state(**({part: share * off} if off else {})))
    plain = early.walker.step

    def turned(*arguments, **pace):
        plain(*arguments, **pace)
        if part == "turn":
            turn = Rotation.from_rotvec([0.0, 0.0, share * constants.rotation_tolerance])
            root = Rotation.from_rotvec(early.walker.state[0, :3])
            early.walker.state[0, :3] = (turn * root).as_rotvec()

    monkeypatch.setattr(early.walker, "step", turned)
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
    np.testing.assert_allclose(extended.walker.offset, scale * action[:25], rtol=1e-6)


@pytest.mark.parametrize("phase", [0.2, 0.7])  # the mirror leaves the pace as it is
@pytest.mark.parametrize("size", [-4.0, -1.0, 0.0, 2.0])
def test_the_last_number_of_an_action_is_the_pace(extended, task, phase, size):
    extended.reset(options={"phase": phase, "mu": nominal_parameters(), "push": None})
    action = NO_ACTION.copy()
    action[-1] = size
    _, _, _, _, info = extended.step(action)
    pace = 1.0 + task.configuration.environment.pace_scale * size
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


def kinematics_of(tree, q):
    rotation, origin, axes = np.empty((14, 3, 3)), np.empty((14, 3)), np.zeros((31, 3))
    forward(tree.joint_position, q, rotation, origin, axes, 14)
    return rotation, origin


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
        force = environment._root_force
        assert not force[:3].any()
        assert force[5] == 0.0
        if force.any() and began is None:
            began = before
        impulse += force[3:5] * environment.walker.action_seconds
    return impulse, began


@pytest.mark.parametrize("steps_per_action", [10, 25, 30, 80])
@pytest.mark.parametrize("seconds", [0.05, 0.03])
def test_a_push_has_its_impulse_whatever_the_length_of_an_action(task, steps_per_action, seconds):
    environment = WalkingEnvironment(
        changed(task, environment={"steps_per_action": steps_per_action, "push_seconds": seconds})
    )
    push = (0.12, 240.0, -0.7)
    environment.reset(seed=0, options={"phase": 0.1, "push": push, "mu": nominal_parameters()})
    impulse, began = impulses(environment)
    expected = 240.0 * seconds * np.array([np.cos(0.7), -np.sin(0.7)])
    np.testing.assert_allclose(impulse, expected, rtol=1e-9)
    action = environment.walker.action_seconds / task.reference.stride_time
    assert began + 1e-9 >= 0.12
    assert began < 0.12 + action + 1e-9


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
    ahead, for 50 ms, at any moment of the gait cycle but the first half cycle of an episode."""
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
    assert starts.max() <= 0.5 + pushed.constants.push_interval[1]
    assert np.ptp(starts % 1.0) > 0.9
    assert 0.0 <= forces.min() < 80.0
    assert 720.0 < forces.max() <= 800.0
    assert np.mean(forces > 450.0) == pytest.approx(0.5 * 350.0 / 800.0, abs=0.09)  # SD 0.03
    assert -np.pi / 2 <= directions.min() < -0.4 * np.pi
    assert 0.4 * np.pi < directions.max() <= np.pi / 2
    pushed.difficulty = 0.0
    pushed.reset(seed=0)
    assert pushed._push[1] == 0.0


@pytest.mark.parametrize("asked", [False, True])
def test_random_pushes_come_again_and_asked_ones_do_not(task, monkeypatch, asked):
    interval = (0.6, 0.9)
    pushed = WalkingEnvironment(
        changed(task, environment={"push_probability": 1.0, "push_interval": interval})
    )
    options = {"push": (0.5, 300.0, 0.0)} if asked else {}
    pushed.reset(seed=3, options={"phase": 0.2, **options})

    def walks_on(*_, **__):
        pushed.walker.phase += pushed.walker.action_seconds / task.reference.stride_time

    monkeypatch.setattr(pushed.walker, "step", walks_on)
    acts, phases = [], []
    for _ in range(150):
        phases.append(pushed.walker.phase)
        pushed.step(NO_ACTION)
        acts.append(pushed._root_force.any())
    began = np.array(phases)[np.flatnonzero(np.diff([False, *acts]) & np.array(acts))]
    if asked:
        assert began == pytest.approx([0.5], abs=0.03)
        return
    assert 0.7 <= began[0] <= 0.7 + interval[1] + 0.03
    gaps = np.diff(began)
    assert len(gaps) >= 3
    assert np.all((gaps > interval[0] - 0.03) & (gaps < interval[1] + 0.03))
    assert np.ptp(gaps) > 0.03
