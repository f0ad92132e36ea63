"""The largest push survived, and what counts as surviving one."""

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fell_together import fell_together
from scored import score_rollout
from simulation_fixtures import changed, random_policy
from synthetic_walk import SPEED, perfect_walk, synthetic_record

from gaitval._internal.io.artefacts import read_json
from gaitval.configuration import PushSettings
from gaitval.metrics import push_recovery as module
from gaitval.metrics.push_recovery import (
    Push,
    PushTrial,
    evenly_spaced,
    growing_forces,
    is_required,
    push_recovery,
    required_directions,
    survive_together,
)
from gaitval.metrics.validation import push_measures
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.storage import load_policy
from gaitval.policy.walking_group import WalkingGroup

MU = nominal_parameters()


def _scan(stands, *, step=100.0, resolution=25.0, ceiling=1200.0):
    """Result of the scan and all forces that it tested."""
    tested: list[float] = []
    forces, survived = growing_forces(step, resolution, ceiling), None
    while True:
        try:
            tested.append(forces.send(survived))
        except StopIteration as end:
            return end.value, tested
        survived = stands(tested[-1])


@pytest.mark.parametrize("limit", [0.0, 24.9, 25.0, 99.0, 100.0, 310.0, 574.9, 1199.0, 1200.0, 9e9])
def test_a_threshold_is_found_to_the_resolution_from_below(limit):
    found, tested = _scan(lambda force: force <= limit)
    assert found == min(1200.0, 25.0 * math.floor(limit / 25.0))
    assert max(tested) <= 1200.0


def test_every_tested_push_up_to_the_result_was_survived():
    """A walker that stands 500 N but not 400 N survives what is below 400 N."""
    falls = {400.0, 350.0}
    found, tested = _scan(lambda force: force not in falls)
    assert found == 325.0
    assert set(tested) == {100.0, 200.0, 300.0, 400.0, 325.0, 350.0}


def test_directions_go_round_from_straight_ahead_to_the_left():
    degrees = np.rad2deg(evenly_spaced(12))
    np.testing.assert_allclose(
        degrees, [0, 30, 60, 90, 120, 150, 180, -150, -120, -90, -60, -30], atol=1e-9
    )


class LocalPool:
    """What `RolloutPool` does, in this process."""

    def __init__(self, task, *, workers, engine):
        assert engine == "dart"  # what is shown does not hang on the engine of learning
        self.environment = WalkingEnvironment(task, engine=engine)
        self.group = WalkingGroup([task] * 8)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def each(self, function, items):
        return (function(self.environment, item) for item in items)

    def each_together(self, function, items):
        return (function(self.group, item) for item in items)


@pytest.fixture(scope="module")
def tried(task):
    """Two phases and four directions of a policy that does nothing, for less than a step."""
    small = changed(
        task,
        pushes={
            "phases": (0.0, 0.1),
            "directions": 4,
            "required_directions": 3,
            "step": 2000.0,
            "resolution": 500.0,
            "largest": 4000.0,
            "force": 100.0,
            "cycles": 0.4,
        },
        validation={"settling_cycles": 0},
        environment={"drift_tolerance": 100.0},
    )
    policy = random_policy(small, scale=0.0)
    heard: list[dict[str, float]] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "RolloutPool", LocalPool)
        found = push_recovery(small, policy, MU, on_progress=heard.append)
    return small, policy, found, heard


def test_the_table_is_what_single_walks_show(tried):
    small, policy, (recovery, _), heard = tried
    assert np.shape(recovery.largest) == (2, 4)
    assert np.shape(recovery.survived) == (2, 3)
    assert heard[-1] == {"pushes": 8, "total": 8}
    environment = WalkingEnvironment(small)
    stride, walked = small.reference.stride_time, set()
    for i, phase in enumerate(recovery.phases):
        for j, direction in enumerate(recovery.directions):
            largest = recovery.largest[i][j]
            for force in (largest, largest + recovery.resolution):
                if 0.0 < force <= recovery.ceiling:
                    score = score_rollout(
                        environment,
                        policy,
                        mu=MU,
                        start_phase=0.0,
                        seconds=(phase + recovery.cycles) * stride,
                        push=(phase, force, math.radians(direction)),
                    )
                    assert score.fell == (force > largest)
                    walked.add(score.fell)
    assert walked == {False, True}
    assert len(np.unique(recovery.largest)) > 1


def test_a_push_that_is_survived_in_one_engine_only_counts_as_a_fall(tried, monkeypatch):
    """A shown push at which the second engine falls: that one changes, and no other."""
    small, policy, (recovery, traces), _ = tried
    shown = module.trace_of

    def fell_to_the_left(environment, trial):
        trace = shown(environment, trial)
        return replace(trace, fell=trace.push == traces[3].push)

    monkeypatch.setattr(module, "RolloutPool", LocalPool)
    monkeypatch.setattr(module, "trace_of", fell_to_the_left)
    found, _ = push_recovery(small, policy, MU)
    changed_by = np.argwhere(np.array(found.survived) != np.array(recovery.survived))
    assert changed_by.tolist() == [[1, 2]]  # the second phase, 90 degrees to the left
    assert found.largest == recovery.largest


def test_a_trace_shows_the_velocity_that_the_push_gives(tried):
    small, _, (recovery, traces), _ = tried
    assert [(t.push.phase, t.push.direction) for t in traces] == [
        (0.0, 0.0),
        (0.1, 0.0),
        (0.0, 0.5 * math.pi),
        (0.1, 0.5 * math.pi),
    ]
    for trace in traces:
        assert trace.push.force == recovery.force
        assert trace.cycles[0] >= -1.0
        assert trace.cycles[-1] == pytest.approx(recovery.cycles, abs=0.05)
        assert trace.velocity[0, 0] == pytest.approx(small.record.speed, abs=0.4)


def test_being_displaced_is_no_fall(task):
    """The same walk ends by drift in a training episode, and goes on in a test of pushes."""
    narrow = changed(task, environment={"drift_tolerance": 1e-4})
    policy = random_policy(task, scale=0.0)

    def fell(which):
        environment = WalkingEnvironment(which, engine="dart")
        return score_rollout(environment, policy, mu=MU, start_phase=0.3, seconds=0.15).fell

    assert fell(narrow)
    assert not fell(module.without_drift(narrow))


def test_pushes_are_tested_without_drift_and_lighter_on_a_lighter_person(tried, monkeypatch):
    """A table with hardly any room to drift is the same; half the full weight, half the force."""
    small, policy, (expected, _), _ = tried
    monkeypatch.setattr(module, "RolloutPool", LocalPool)
    narrow = changed(small, environment={"drift_tolerance": 1e-4})
    assert push_recovery(narrow, policy, MU)[0].as_dict() == expected.as_dict()
    monkeypatch.setattr("gaitval.configuration.FULL_MASS_KG", 2.0 * small.model.mass)
    light, traces = push_recovery(small, policy, MU)
    assert (light.force, light.resolution, light.ceiling) == (50.0, 250.0, 2000.0)
    assert {trace.push.force for trace in traces} == {50.0}


def test_the_pushes_that_are_replayed_are_ahead_and_to_the_left(tried):
    """At the first phase; the force and its direction are in the walk, whose first row is after its
    first step."""
    small, policy, _, _ = tried
    walks = module.pushed_walks(small, policy, MU)
    forces = [walk.root_force[:, 3:][walk.root_force.any(axis=1)] for walk in walks]
    for force, axis in zip(forces, (0, 1), strict=True):
        step = small.configuration.environment.physics_step
        seconds = small.configuration.environment.push_seconds - step
        impulse = step * force.sum(axis=0)
        np.testing.assert_allclose(impulse, 100.0 * seconds * np.eye(3)[axis], atol=1e-9)
    assert [walk.phase[walk.root_force.any(axis=1)][0] < 0.02 for walk in walks] == [True, True]


def stored_walker():
    """The policy of subject 5, and its mu."""
    folder = Path(__file__).parents[2] / "reports" / "S05" / "baseline"
    mu = np.array(read_json(folder / "identification.json")["identified"])
    return load_policy(folder / "policy"), mu


def fell_in(group, task, trials):
    """Which of the trials fall, of one policy, each walked from its start."""
    return fell_together(
        group,
        trials[0].policy,
        mu=trials[0].mu,
        starts=[each.start() for each in trials],
        seconds=[each.planned_cycles() * task.reference.stride_time for each in trials],
    )


def test_walks_to_a_push_are_kept_and_make_no_difference(task):
    """Later pushes begin where the same walk came to for earlier ones: falls, and where the walkers
    are in the end, are those of a new group; also if it falls before it is pushed, or is no longer
    followed then."""
    (stored, mu), fast = stored_walker(), random_policy(task, scale=3.0)
    group = WalkingGroup([task] * 8)
    for policy, begins in (
        *((stored, 0.6), (stored, 0.3), (fast, 3.0), (stored, 0.9)),
        *((stored, 0.6), (stored, 0.55)),  # just before one that is kept
    ):
        for cycles in (-0.1, 0.5, 1.4):
            trials = [
                PushTrial(policy, mu, Push(begins, 0.8 * n, 150.0 * n), 0, cycles) for n in range(7)
            ]
            new = WalkingGroup([task] * 8)
            survived = survive_together(group, trials)
            fell = fell_in(new, task, trials)
            assert survived == [not each for each in fell]
            if cycles > 0 and policy is stored:
                # who lies, or is falling when the others end, is not followed equally long
                stands = [n for n, each in enumerate(survived) if each and 150.0 * n < 1000.0]
                assert len(stands) >= 3
                np.testing.assert_array_equal(
                    group._arrays.walkers.state[stands], new._arrays.walkers.state[stands]
                )
    by_policy = {key: sorted(walk) for (key, *_), walk in module._walked[group].items()}
    assert by_policy == {stored.key: [0.3, 0.55, 0.6, 0.9], fast.key: []}


def test_a_walker_that_is_done_takes_the_next_push(task):
    """Twenty pushes at four phases, one after another on eight walkers: each ends as in a new group
    of eight."""
    policy, mu = stored_walker()
    trials = [
        PushTrial(policy, mu, Push(0.3 + 0.2 * (n % 4), 0.8 * n, 70.0 * n), 0, 0.4 + 0.1 * (n % 3))
        for n in range(20)
    ]
    fell = [
        bool(fallen)
        for first in range(0, 20, 8)
        for fallen in fell_in(WalkingGroup([task] * 8), task, trials[first : first + 8])
    ]
    assert set(fell) == {False, True}
    survived = survive_together(WalkingGroup([task] * 8), trials)
    assert survived == [not each for each in fell]


def test_a_trace_begins_a_cycle_before_its_push(monkeypatch, task):
    """A row for each action, in cycles since the push."""
    walk = perfect_walk(synthetic_record(), cycles=5.0)
    monkeypatch.setattr(module, "record_rollout", lambda *_, **__: walk)
    environment = WalkingEnvironment(task)
    push = Push(0.25, 100.0, 0.0)
    nobody = SimpleNamespace(key="nobody's")
    trial = PushTrial(nobody, MU, push, settling_cycles=2, cycles=2.0)
    trace = module.trace_of(environment, trial)
    each = environment.walker.steps_per_action * (walk.phase[1] - walk.phase[0])
    assert -1.0 <= trace.cycles[0] <= -1.0 + walk.phase[1]
    np.testing.assert_allclose(np.diff(trace.cycles), each)
    assert trace.cycles[-1] == pytest.approx(2.75, abs=2 * each)
    np.testing.assert_allclose(trace.velocity[:, 0].mean(), SPEED, rtol=0.02)
    assert not trace.fell


def test_a_light_person_is_pushed_by_as_much_less():
    usual = PushSettings()
    assert usual.of_mass(46.0) == usual == usual.of_mass(90.0)
    child = usual.of_mass(23.0)
    assert (child.force, child.step, child.resolution, child.largest) == (150.0, 50.0, 12.5, 600.0)
    assert child.phases == usual.phases


def test_a_push_that_is_not_the_usual_one_is_named(tried):
    _, _, (recovery, _), _ = tried
    assert recovery.model_copy(update={"force": 300.0}).targets()[0] == "phase 0"
    (measure, *_) = push_measures(recovery.model_copy(update={"force": 196.4}))
    assert measure.target == "phase 0, 196 N"


@pytest.mark.parametrize("count", [1, 2, 3, 8])
def test_every_direction_that_must_be_survived_is_required(count):
    """The two sideways ones too, whose cosines are rounded to a little below zero."""
    directions = required_directions(PushSettings(required_directions=count))
    assert len(directions) == count
    assert all(is_required(Push(0.0, each, 1.0)) for each in directions)
    assert not is_required(Push(0.0, math.radians(91.0), 1.0))
