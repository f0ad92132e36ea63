"""Walks that are held against the record: what is kept of a long one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from simulation_fixtures import changed
from synthetic_walk import SPEED, perfect_walk, sharp_filter, synthetic_record

from gaitval._internal.io.artefacts import read_json
from gaitval.errors import ArtefactError
from gaitval.metrics import rollouts
from gaitval.metrics.results import Endurance
from gaitval.metrics.rollouts import (
    compared_cycles,
    compared_part,
    endurance,
    roll_out_from,
    walked_far,
)
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import load_policy
from gaitval.policy.walking_group import WalkingGroup

BASELINE = Path(__file__).resolve().parents[2] / "reports" / "S05" / "baseline"
RECORD = synthetic_record()
MU = nominal_parameters()


def test_endurance_tells_of_the_whole_walk():
    rollout = perfect_walk(RECORD, cycles=30)
    found = endurance(rollout, sharp_filter(), engine="dart")
    # the first strike is that of phase 1, the first cycle settles, the last one ends at phase 30
    assert found.cycles.right == 28
    assert not found.fell
    assert found.walking_speed == pytest.approx(SPEED)
    assert found.seconds == pytest.approx(30 * RECORD.stride_time)
    assert Endurance.model_validate(found.as_dict()) == found


@pytest.mark.parametrize("column", range(6))
def test_a_pushed_walk_is_refused(column):
    rollout = perfect_walk(RECORD, cycles=5)
    load = rollout.root_force.copy()
    load[700:705, column] = 1e-12
    with pytest.raises(ArtefactError, match=r"from phase 0 the pelvis is pushed at 0\.7 s"):
        endurance(replace(rollout, root_force=load), sharp_filter(), engine="dart")


def test_the_compared_part_has_all_its_cycles_and_no_more():
    rollout = perfect_walk(RECORD, cycles=30, start_phase=0.25)
    part = compared_part(rollout, sharp_filter(cycles=5))
    assert part.phase[-1] == pytest.approx(0.25 + 1 + 5 + 2, abs=1e-3)
    assert len(part.ground_reaction) == len(part.time)
    np.testing.assert_array_equal(part.mu, rollout.mu)


class LocalPool:
    """What `RolloutPool` does, in this process."""

    def __init__(self, task):
        self.environment = WalkingEnvironment(task, engine="dart")
        self.group = WalkingGroup([task] * 8)

    def each(self, function, items, engine):
        assert engine == "dart"
        return (function(self.environment, item) for item in items)

    def each_together(self, function, items):
        return (function(self.group, item) for item in items)


def alone(task, policy, phase, cycles):
    environment = WalkingEnvironment(task, engine="dart")
    return record_rollout(environment, policy, mu=MU, start_phase=phase, cycles=cycles)


def two_short_walks(task):
    """A task of two cycles, a policy, two start phases and a pool."""
    walks = {"settling_cycles": 0, "cycles": 2, "consecutive_cycles": 2}
    short = changed(task, validation=walks)
    return short, load_policy(BASELINE / "policy"), (0.3, 0.8), LocalPool(short)


def test_walks_from_several_starts_are_single_walks(task):
    """The compared one is that of DART bit for bit; how far they get agrees to rounding."""
    short, policy, phases, pool = two_short_walks(task)
    found = roll_out_from(pool, policy, MU, walked_far(pool, policy, MU, phases))
    compared = alone(short, policy, phases[0], compared_cycles(short.configuration))
    np.testing.assert_array_equal(
        found.compared.positions, compared_part(compared, short.configuration).positions
    )
    for went, phase in zip(found.starts, phases, strict=True):
        one = endurance(alone(short, policy, phase, 2), short.configuration, engine="dart")
        assert went.engine == "compiled"
        same = {"engine": "dart", "seconds": one.seconds, "walking_speed": one.walking_speed}
        assert went.model_copy(update=same) == one
        assert went.seconds == pytest.approx(one.seconds, abs=0.011)
        assert went.walking_speed == pytest.approx(one.walking_speed, rel=1e-3)


def test_a_first_walk_that_falls_in_dart_has_fallen(task, monkeypatch):
    _, policy, phases, pool = two_short_walks(task)
    single = rollouts.record_rollout

    def falls(*arguments, **settings):
        rollout = single(*arguments, **settings)
        return replace(rollout, fell=np.ones_like(rollout.fell))

    monkeypatch.setattr(rollouts, "record_rollout", falls)
    first, second = roll_out_from(pool, policy, MU, walked_far(pool, policy, MU, phases)).starts
    assert (first.fell, first.engine, first.start_phase) == (True, "dart", 0.3)
    assert (second.fell, second.engine) == (False, "compiled")


@pytest.mark.slow
def test_a_hundred_cycles_are_the_same_walk_in_dart(task):
    """Of a stored walker: as far and with as few scuffs, as fast within a thousandth."""
    policy = load_policy(BASELINE / "policy")
    mu = np.array(read_json(BASELINE / "identification.json")["identified"])
    pool = LocalPool(task)
    (compiled,) = walked_far(pool, policy, mu, (0.0,))
    walked = record_rollout(pool.environment, policy, mu=mu, start_phase=0.0, cycles=105)
    dart = endurance(walked, task.configuration, engine="dart")
    assert not dart.fell
    assert dart.cycles.right >= 98
    same = dart.model_copy(
        update={
            key: getattr(compiled, key) for key in ("engine", "seconds", "walking_speed", "cycles")
        }
    )
    assert same == compiled
    for side in ("right", "left"):  # the last heel strike may be a step before or after the end
        assert abs(getattr(dart.cycles, side) - getattr(compiled.cycles, side)) <= 1
    assert compiled.walking_speed == pytest.approx(dart.walking_speed, rel=1e-3)


def test_an_endurance_that_names_no_engine_is_from_when_all_walked_in_dart():
    found = endurance(perfect_walk(RECORD, cycles=5), sharp_filter(), engine="compiled")
    values = found.as_dict()
    assert Endurance.model_validate(values).engine == "compiled"
    del values["engine"]
    assert Endurance.model_validate(values).engine == "dart"
