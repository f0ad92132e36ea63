"""Walks that are held against the record: what is kept of a long one."""

from dataclasses import fields, replace

import numpy as np
import pytest
from simulation_fixtures import changed, random_policy
from synthetic_walk import SPEED, perfect_walk, sharp_filter, synthetic_record

from gaitval.errors import ArtefactError
from gaitval.metrics.rollouts import compared_part, endurance, roll_out_from
from gaitval.metrics.walk_results import Endurance
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.walking_group import WalkingGroup

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

    def each(self, function, items):
        return (function(self.environment, item) for item in items)

    def each_together(self, function, items):
        return (function(self.group, item) for item in items)


def test_walks_from_several_starts_are_single_walks(task):
    """The compared one is that of DART bit for bit, the others agree to rounding, and say so."""
    short = changed(task, validation={"settling_cycles": 0, "cycles": 2})
    policy = random_policy(short, scale=0.1)
    phases = (0.3, 0.8)
    found = roll_out_from(LocalPool(short), policy, MU, phases, cycles=1)
    alone = [
        record_rollout(
            WalkingEnvironment(short, engine="dart"), policy, mu=MU, start_phase=phase, cycles=1
        )
        for phase in phases
    ]
    np.testing.assert_array_equal(found.compared.positions, alone[0].positions)
    first, second = (endurance(one, short.configuration, engine="dart") for one in alone)
    assert found.starts[0] == first
    assert first.engine == "dart"
    assert found.starts[1].engine == "compiled"
    assert (
        found.starts[1].model_copy(update={"engine": "dart", "seconds": second.seconds}) == second
    )
    assert found.starts[1].seconds == pytest.approx(second.seconds, abs=0.011)


def test_an_endurance_that_names_no_engine_is_from_when_all_walked_in_dart():
    found = endurance(perfect_walk(RECORD, cycles=5), sharp_filter(), engine="compiled")
    values = found.as_dict()
    assert Endurance.model_validate(values).engine == "compiled"
    del values["engine"]
    assert Endurance.model_validate(values).engine == "dart"


def test_walks_that_were_stopped_go_on_to_the_same_result(task, tmp_path):
    """The compared one is kept with all its digits; a rollout that is stored has fewer."""
    short = changed(task, validation={"settling_cycles": 0, "cycles": 2})
    policy, phases = random_policy(short, scale=0.1), (0.3, 0.8, 0.1)
    whole = roll_out_from(LocalPool(short), policy, MU, phases, cycles=1)
    walked = []

    class Stopping(LocalPool):
        def each_together(self, function, items):
            for item in items:
                for result, start in zip(function(self.group, item), item, strict=True):
                    if len(walked) == 1:
                        raise KeyboardInterrupt
                    walked.append(start.phase)
                    yield [result]

    with pytest.raises(KeyboardInterrupt):
        roll_out_from(Stopping(short), policy, MU, phases, cycles=1, workspace=tmp_path)
    assert walked == [0.8]
    walked[:] = []  # one more may be walked
    found = roll_out_from(Stopping(short), policy, MU, phases, cycles=1, workspace=tmp_path)
    assert walked == [0.1]
    assert found.starts == whole.starts
    for field in fields(whole.compared):
        np.testing.assert_array_equal(
            getattr(found.compared, field.name), getattr(whole.compared, field.name)
        )
