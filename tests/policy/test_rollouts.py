"""Walks of a policy: scored, recorded, in worker processes."""

import gc
import json
import os
import pickle
import subprocess
import sys
import textwrap
import time
import weakref
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from fell_together import fell_together
from scored import score_rollout
from simulation_fixtures import changed, random_policy

from gaitval.errors import ModelError
from gaitval.metrics.rollouts import _Start, _walk
from gaitval.model.parameters import nominal_parameters
from gaitval.model.tree import empty_frames, forward
from gaitval.policy import rollouts as module
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.processes import keeping_workers, kept_workers
from gaitval.policy.rollouts import (
    RolloutPool,
    record_rollout,
    record_together,
)
from gaitval.policy.storage import load_policy
from gaitval.policy.travel import travel_together
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.reference.adjustment import JOINTS, Adjustment, adjusted

ACTIONS = 150
MU = nominal_parameters()


@pytest.fixture(scope="module")
def environment(task):
    return WalkingEnvironment(task)


def by_hand(environment, policy, start_phase, steps, push=None):
    options = {"phase": start_phase, "mu": MU, "push": push, "noise": 0.0}
    environment.centre(policy.act, MU)
    observation, _ = environment.reset(seed=0, options=options)
    rewards, fell = [], False
    while len(rewards) < steps and not fell:
        observation, reward, fell, _, info = environment.step(policy.act(observation))
        rewards.append(reward)
    return rewards, fell, info


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("phase", [0.005, 0.245, 0.255, 0.605])
def test_on_the_reference_a_share_of_the_habit_is_left(task, share, phase):
    """Wherever the habit is known, on both sides of the mirror's seam at a quarter of the cycle;
    away from the reference the policy answers as it did."""
    policy = random_policy(task, scale=0.1)
    environment = WalkingEnvironment(changed(task, environment={"centring": share, "arm_share": 1}))
    options = {"phase": phase, "mu": MU, "push": None, "noise": 0.0}
    wanted = {}
    for centred in (False, True):
        if centred:
            environment.centre(policy.act, MU)
        observation, _ = environment.reset(seed=0, options=options)
        environment.step(policy.act(observation))
        wanted[centred] = environment.walker.offset.copy()
    assert np.abs(wanted[False]).max() > 1e-4
    # rad; a hundred actions at a time are rounded otherwise than a single one
    np.testing.assert_allclose(wanted[True], (1.0 - share) * wanted[False], atol=1e-8)
    observation, _ = environment.reset(seed=0, options=options)
    away = policy.act(observation) + np.float32(0.1)
    environment.step(away)
    gained = environment.walker.offset - wanted[True]
    entered = 0.1 * environment.constants.action_scale * environment.entering
    np.testing.assert_allclose(np.abs(gained), entered, atol=1e-6)


def test_a_new_training_environment_has_no_habit_taken_away(task):
    assert WalkingEnvironment(task)._habit is None


@pytest.mark.parametrize("engine", ["compiled", "dart"])
def test_a_recorded_walk_is_the_scored_walk(task, engine):
    environment = WalkingEnvironment(task, engine=engine)
    policy = random_policy(task, scale=0.1)
    rollout = record_rollout(
        WalkingEnvironment(task, engine=engine), policy, mu=MU, start_phase=0.3, cycles=0.2
    )
    # a walk has no row of its last state, which no step follows
    actions = round((len(rollout.time) + 1) / environment.walker.steps_per_action)
    by_hand(environment, policy, 0.3, actions)
    after, rates = environment.walker.state
    step = environment.walker.physics_step
    np.testing.assert_allclose(rollout.positions[-1, 6:] + step * rates[6:], after[6:], atol=1e-12)
    np.testing.assert_array_equal(rollout.mu, MU)
    assert rollout.start_phase[0] == 0.3


@pytest.mark.parametrize("action", [-3.0, 2.0])
def test_a_recorded_walk_covers_its_cycles_at_any_pace(task, action):
    task = changed(task, environment={"centring": 0.0})
    policy = random_policy(task, scale=0.0)
    policy.tensors["action_net.bias"][-1] = action
    rollout = record_rollout(WalkingEnvironment(task), policy, mu=MU, start_phase=0.3, cycles=0.2)
    pace = 1.0 + task.configuration.environment.pace_scale * action
    seconds = 0.2 * task.reference.stride_time / pace
    row = np.diff(rollout.phase).max()  # the state after the last row is where the walk ends
    assert 0.5 - row <= rollout.phase[-1] < 0.5 + 0.03 * pace / task.reference.stride_time + 1e-9
    assert rollout.time[-1] == pytest.approx(seconds, abs=0.031)


def test_a_walk_that_falls_is_cut_off_and_says_so(task):
    rollout = record_rollout(
        WalkingEnvironment(task, engine="dart"),
        random_policy(task, scale=20.0),
        mu=MU,
        start_phase=0.3,
        cycles=8.0,
    )
    assert rollout.fell[0] == 1.0
    assert rollout.time[-1] < 4.0
    assert len(rollout.positions) == len(rollout.time)


def test_a_recorded_centre_of_pressure_is_under_its_foot(task):
    """Within a sphere's radius and a step of 2 cm of the spheres' centres, and only under load; the
    first sample is a physics step after the start."""
    walker = WalkingEnvironment(task)
    rollout = record_rollout(
        walker, random_policy(task, scale=0.0), mu=MU, start_phase=0.1, cycles=0.5
    )
    assert rollout.time[0] == walker.walker.physics_step
    tree, count = walker.walker.tree, len(task.model.spheres)
    frames = empty_frames()
    rotation, origin = frames.rotation, frames.origin
    loaded = rollout.ground_reaction[..., 2] > 1.0
    np.testing.assert_array_equal(np.isfinite(rollout.centre_of_pressure[..., 0]), loaded)
    assert loaded.any(axis=0).all()
    for t in range(len(rollout.time)):
        forward(tree.joint_position, rollout.positions[t], frames, 14)
        turned = np.einsum("kij,kj->ki", rotation[tree.sphere_segment], tree.sphere_position)
        centres = (turned + origin[tree.sphere_segment])[:, :2].reshape(2, count // 2, 2)
        for side in np.flatnonzero(loaded[t]):
            place = rollout.centre_of_pressure[t, side, :2]
            assert np.all(place > centres[side].min(axis=0) - 0.02)
            assert np.all(place < centres[side].max(axis=0) + 0.02)


def test_a_fall_after_the_end_of_a_walk_is_none_of_it(task, monkeypatch):
    """Its body walks on beside those that have not ended."""
    real = module.walks_together

    def fall_at_last(*arguments):
        yield from real(*arguments)
        yield np.zeros(2, dtype=bool), np.ones(2, dtype=bool)

    group, policy = WalkingGroup([task] * 8), random_policy(task, scale=0.0)
    walk = {"mu": MU, "start_phases": (0.1, 0.6), "cycles": 0.1}
    monkeypatch.setattr(module, "walks_together", fall_at_last)
    monkeypatch.setattr("gaitval.policy.travel.walks_together", fall_at_last)
    for found in (record_together(group, policy, **walk), travel_together(group, policy, **walk)):
        assert [each.fell[0] for each in found] == [0.0, 0.0]


def test_a_pushed_walk_records_the_push(task):
    push = (0.35, 200.0, np.pi / 2)
    rollout = record_rollout(
        WalkingEnvironment(task, engine="dart"),
        random_policy(task, scale=0.0),
        mu=MU,
        start_phase=0.3,
        cycles=0.3,
        push=push,
    )
    impulse = (rollout.time[1] - rollout.time[0]) * rollout.root_force.sum(axis=0)
    np.testing.assert_allclose(impulse, [0, 0, 0, 0, 200.0 * 0.05, 0], atol=1e-9)


def stored_walker():
    """The stored policy of subject 5, which survives some pushes, and its mu."""
    folder = Path(__file__).parents[2] / "reports" / "S05" / "baseline"
    found = json.loads((folder / "identification.json").read_text(encoding="utf-8"))
    return load_policy(folder / "policy"), np.array(found["identified"])


def test_walks_side_by_side_fall_as_single_ones_do(task):
    """Pushes far below and far above what the walker stands, of other phases and durations; nobody
    walks on after a fall, and a group can be used again."""
    policy, mu = stored_walker()
    group, alone = WalkingGroup([task] * 8), WalkingEnvironment(task)
    forces = (0.0, 3000.0, 50.0, 2500.0, 0.0, 4000.0, 50.0)
    starts = [
        {"phase": 0.1 * n, "push": (0.1 * n + 0.3, force, 0.5 * n)}
        for n, force in enumerate(forces)
    ]
    seconds = [1.2 + 0.1 * n for n in range(len(forces))]
    single = [
        score_rollout(
            alone, policy, mu=mu, start_phase=each["phase"], seconds=lasts, push=each["push"]
        ).fell
        for each, lasts in zip(starts, seconds, strict=True)
    ]
    assert single == [force > 1000.0 for force in forces]
    for _ in range(2):
        fell = fell_together(group, policy, mu=mu, starts=starts, seconds=seconds)
        assert fell.tolist() == single
    turned = fell_together(group, policy, mu=mu, starts=starts[::-1], seconds=seconds[::-1])
    assert turned.tolist() == single[::-1]


def with_references(task, count):
    """Tasks whose references differ in the angle of a knee."""
    random = np.random.default_rng(4)
    tasks = []
    for _ in range(count):
        numbers = np.zeros((len(JOINTS), 1))
        numbers[JOINTS.index("knee_angle_r")] = np.deg2rad(random.uniform(-1.0, 1.0))
        reference = adjusted(task.reference, task.reference_body, Adjustment(numbers, 0.001))
        tasks.append(replace(task, reference=reference))
    return tasks


def test_walks_of_a_group_are_those_of_single_walkers(task):
    """Of different references and starts, each with its own habit. The policy acts on eight in
    another order of its sums: 1e-7 of an action to begin with, which grows by some hundred times in
    a fifth of a cycle."""
    policy, mu = stored_walker()
    tasks = with_references(task, 3)
    phases = (0.1, 0.4, 0.85)
    group = WalkingGroup([*tasks, *[tasks[-1]] * 5])
    found = list(record_together(group, policy, mu=mu, start_phases=phases, cycles=0.2))
    assert len(found) == 3
    for one, rollout, phase in zip(tasks, found, phases, strict=True):
        alone = record_rollout(
            WalkingEnvironment(one), policy, mu=mu, start_phase=phase, cycles=0.2
        )
        assert len(rollout.time) == len(alone.time)
        for field in fields(alone):
            single, together = getattr(alone, field.name), getattr(rollout, field.name)
            scale = np.nanmax(np.abs(single)) + 1.0
            np.testing.assert_allclose(
                together / scale, single / scale, atol=2e-4, err_msg=field.name
            )
        np.testing.assert_allclose(rollout.positions, alone.positions, atol=1e-5)
    apart = np.abs(found[0].positions[:20] - found[1].positions[:20]).max()
    assert apart > 0.01


@pytest.mark.parametrize("observation", ["extended", "paper"])
@pytest.mark.parametrize("mirror", [True, False])
def test_what_a_group_sees_is_bit_for_bit_what_single_walkers_see(task, observation, mirror):
    """Observation, reward and its terms, errors and falls, with pushes, other bodies and other
    references, and of one whose simulation blows up in the last action."""
    tasks = [
        changed(each, environment={"observation": observation, "mirror": mirror})
        for each in with_references(task, 3)
    ]
    tasks = [tasks[e % 3] for e in range(8)]
    group, alone = WalkingGroup(tasks), [WalkingEnvironment(each) for each in tasks]
    random = np.random.default_rng(5)
    for e, environment in enumerate(alone):
        options = {"phase": e / 8, "push": (e / 8 + 0.02, 400.0 * e, float(e))}
        seen = group.reset(e, seed=e, options=options)
        np.testing.assert_array_equal(seen, environment.reset(seed=e, options=options)[0])
    together = np.zeros_like(group._seen)
    falls = 0
    for number in range(ACTIONS):
        wanted = random.normal(0.0, 0.4, (8, 26)).astype(np.float32)
        if number == ACTIONS - 1:
            for environment in (group.environments[5], alone[5]):
                environment.walker.state[1, 7] = np.nan
        rewards, fell = group.step(wanted, together)
        for e, environment in enumerate(alone):
            seen, reward, down, _, info = environment.step(wanted[e].copy())
            np.testing.assert_array_equal(together[e], seen)
            assert (rewards[e], fell[e]) == (reward, down)
            np.testing.assert_array_equal(group.terms[e], info["reward_terms"])
            if number < ACTIONS - 1:
                np.testing.assert_array_equal(group.environments[e].episode.errors, info["errors"])
            if down and number < ACTIONS - 1:
                group.reset(e, seed=e, options={"phase": 0.3, "push": None})
                environment.reset(seed=e, options={"phase": 0.3, "push": None})
                falls += 1
    assert falls
    assert fell[5]
    assert np.isfinite(together).all()


def test_a_walk_does_not_depend_on_those_beside_it(task):
    """Not even a fall, after which its lane starts again."""
    policy, mu = stored_walker()
    tasks = with_references(task, 2)
    wild = random_policy(task, scale=20.0)
    group = WalkingGroup(tasks * 4)
    for walker, cycles in ((policy, 0.2), (wild, 2.0)):
        phases = (0.1, 0.4, 0.1, 0.4, 0.6)
        all_of_them = list(
            record_together(group, walker, mu=mu, start_phases=phases, cycles=cycles)
        )
        few = list(record_together(group, walker, mu=mu, start_phases=phases[:2], cycles=cycles))
        for one, other in zip(few, all_of_them, strict=False):
            for field in fields(one):
                np.testing.assert_array_equal(
                    getattr(one, field.name), getattr(other, field.name), err_msg=field.name
                )
        np.testing.assert_array_equal(all_of_them[2].positions, all_of_them[0].positions)
        assert [bool(each.fell[0]) for each in all_of_them] == [walker is wild] * 5
    assert len({len(each.time) for each in all_of_them}) > 1


def test_a_group_that_is_no_longer_needed_gives_its_arrays_back(task):
    group = WalkingGroup([task] * 8)
    lanes = weakref.ref(group.beside.arrays.phase), weakref.ref(group.beside.account.moments)
    wanted, seen = (np.zeros(each.shape, np.float32) for each in (group._requested, group._seen))
    for e in range(8):
        group.reset(e, seed=0)
    group.step(wanted, seen)
    assert np.isfinite(seen).all()
    assert seen.any()
    del group
    gc.collect()
    assert [each() for each in lanes] == [None, None]


@pytest.mark.parametrize("scale", [0.1, 20.0])
def test_of_a_long_walk_what_is_kept_is_what_was_recorded(task, monkeypatch, scale):
    """Also of those that fall, and where a part ends with the walk."""
    policy, phases = random_policy(task, scale=scale), (0.3, 0.8, 0.1)
    group = WalkingGroup([task] * 8)
    walk = {"mu": MU, "start_phases": phases, "cycles": 0.5}
    whole = list(record_together(group, policy, **walk))
    for part in (200, 7):
        monkeypatch.setattr("gaitval.policy.travel._PART", part)
        for kept, rollout in zip(travel_together(group, policy, **walk), whole, strict=True):
            for field in fields(kept):
                np.testing.assert_array_equal(
                    getattr(kept, field.name), getattr(rollout, field.name), err_msg=field.name
                )


def test_a_group_that_is_not_full_would_round_otherwise(task):
    policy = random_policy(task, scale=0.1)
    with pytest.raises(ValueError, match="3 would act with other rounding than one of 8"):
        list(record_together(WalkingGroup([task] * 3), policy, mu=MU, start_phases=[0], cycles=1))


def test_in_which_lane_a_walk_is_makes_no_difference_to_its_actions(task):
    """So pushes that go on after a kill, in other lanes, end alike."""
    policy, _ = stored_walker()
    seen = np.random.default_rng(0).normal(0.0, 2.0, (8, 126)).astype(np.float32)
    actions = policy.act(seen)
    for turn in range(1, 8):
        np.testing.assert_array_equal(policy.act(np.roll(seen, turn, axis=0))[turn], actions[0])
        np.testing.assert_array_equal(
            policy.act(np.roll(seen, turn, axis=0)), np.roll(actions, turn, axis=0)
        )


def test_worker_processes_give_the_same_walks_in_order(task, environment):
    policy = random_policy(task, scale=0.1)
    starts = [_Start(policy, MU, phase) for phase in (0.1, 0.9, 0.4, 0.6, 0.2)]

    def went(walks):
        return [endurance for endurance, _ in walks]

    expected = went(_walk(environment, each) for each in starts)
    assert len({each.start_phase for each in expected}) == 5
    with RolloutPool(task, workers=2) as pool:
        assert went(pool.each(_walk, starts)) == expected
        with pytest.raises(ModelError, match="mu must have shape"):
            list(pool.each(_walk, [_Start(policy, np.zeros(3), 0.1)]))
        assert went(pool.each(_walk, starts[:1])) == expected[:1]  # the workers survive it
    with RolloutPool(task, workers=1) as alone:
        assert went(alone.each(_walk, starts)) == expected


@pytest.mark.parametrize("workers", [1, 2])
def test_a_pool_may_have_a_second_task_between_those_of_its_own(task, workers):
    other = replace(task, record=replace(task.record, stride_time=2.0))
    with RolloutPool(task, workers=workers) as pool:
        second = pool.with_task(other)
        started = [each.each(getattr, ["task"] * 3) for each in (pool, second, pool, second)]
        for found, each in zip(started, (task, other, task, other), strict=True):
            assert {one.record.stride_time for one in found} == {each.record.stride_time}


def test_kept_workers_serve_one_pool_after_the_other_each_with_its_task(task):
    other = replace(task, record=replace(task.record, stride_time=2.0))
    assert kept_workers() is None
    with keeping_workers(2):
        kept = kept_workers()
        for each in (task, other, task):
            with RolloutPool(each, workers=2) as pool:
                found = list(pool.each(getattr, ["task"] * 4))
            assert {one.record.stride_time for one in found} == {each.record.stride_time}
        assert kept_workers() is kept
        processes = {kept.submit(os.getpid).result(60) for _ in range(8)}
        assert os.getpid() not in processes
        assert len(processes) <= 2
        threads = [kept.submit(os.getenv, "OMP_NUM_THREADS").result(60) for _ in range(4)]
        assert threads == ["1"] * 4
    assert kept_workers() is None
    with pytest.raises(RuntimeError, match="shutdown"):
        kept.submit(os.getpid)


WAITING = """
    import operator
    import pickle
    import sys
    from pathlib import Path

    from gaitval.policy.rollouts import RolloutPool

    task = pickle.loads(Path(sys.argv[1]).read_bytes())
    with RolloutPool(task, workers=2) as pool:
        assert list(pool.each(operator.is_not, [1, 2])) == [True, True]
        print("waiting", flush=True)
        sys.stdin.read()
"""


@pytest.mark.skipif(
    not Path("/proc/self/task").exists(), reason="finds the workers of a process in /proc"
)
def test_workers_end_with_a_process_that_is_killed(task, tmp_path):
    """They wait for work at a queue that they could fill themselves, so they would wait for ever,
    with multiprocessing's own process and its semaphores."""
    script, stored = tmp_path / "pool.py", tmp_path / "task.pickle"
    script.write_text(textwrap.dedent(WAITING))
    stored.write_bytes(pickle.dumps(task))
    process = subprocess.Popen(
        [sys.executable, str(script), str(stored)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout.readline() == "waiting\n"
        descendants = _descendants(str(process.pid))
    finally:
        process.kill()
        process.wait()
    # two workers, the server that forked them, and multiprocessing's resource tracker
    assert len(descendants) == 4
    end = time.monotonic() + 10.0
    while any(map(_alive, descendants)) and time.monotonic() < end:
        time.sleep(0.02)
    assert not any(map(_alive, descendants))


def _descendants(pid):
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [*children, *(each for child in children for each in _descendants(child))]


def _alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False
