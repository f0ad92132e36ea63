"""A stored policy walks from Python as it was validated, and is compared as it was."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gaitval as gv
from evidence.unrecorded_verdicts import expected
from gaitval.errors import PolicyError
from gaitval.metrics.walk_comparison import Comparison
from gaitval.simulation.simulated_walk import SimulatedWalk
from gaitval.simulation.walker import WalkingTask
from gaitval.study.stored_policy import StoredPolicy


def test_a_policy_is_stored_whole(policy: StoredPolicy, tmp_path: Path):
    policy.save(tmp_path)
    again = StoredPolicy.load(tmp_path)
    np.testing.assert_array_equal(again.identified, policy.identified)
    assert repr(again) == repr(policy)
    (tmp_path / "correction.json").unlink()
    with pytest.raises(PolicyError, match=r"correction\.json"):
        gv.load_policy(tmp_path)


def test_the_reference_motion_of_a_policy_is_built_once(
    policy: StoredPolicy, walk: SimulatedWalk, monkeypatch: pytest.MonkeyPatch
):
    """And a second walk is the same as the first."""

    def refuse(*_: object) -> None:
        raise AssertionError("the walking task was built again")

    gv.rollout(policy, cycles=1, body="nominal")
    monkeypatch.setattr(WalkingTask, "of", refuse)
    np.testing.assert_array_equal(gv.rollout(policy, cycles=6).positions, walk.positions)
    nominal = gv.rollout(policy, cycles=1, body="nominal")
    np.testing.assert_array_equal(nominal.mu, policy.nominal)


def test_a_walk_is_kept_as_it_was(walk: SimulatedWalk, tmp_path: Path):
    assert "did not fall" in repr(walk)
    walk.save(tmp_path / "walk.npz")
    again = SimulatedWalk.load(tmp_path / "walk.npz")
    np.testing.assert_array_equal(again.positions, walk.positions)
    assert (again.walker, again.mass_kg) == ("S05", walk.mass_kg)


def test_a_walk_against_the_record_and_itself(walk: SimulatedWalk, tmp_path: Path):
    against = gv.compare(walk, gv.load_subject(5))
    assert "the record of S05" in repr(against)
    assert against.rmse("knee_angle_l") < gv.limits().tolerance[0].value
    assert set(against.to_frame().source) == {"walk of S05", "the record of S05"}
    against.save(tmp_path / "comparison.npz")
    assert repr(Comparison.load(tmp_path / "comparison.npz")) == repr(against)
    itself = gv.compare(walk, walk)
    assert max(itself.rmse(name) for name in itself.names) == 0.0


@pytest.mark.slow  # four dynamic fits
def test_without_plates_a_policy_walks_after_the_estimate(policy: StoredPolicy):
    """As does one whose run was not to know the kinetics; both had walked after recorded ones."""
    person, configuration = expected(policy.subject, policy.configuration)
    unknown = replace(policy, subject=person, configuration=configuration).task
    record = policy.configuration.record.model_copy(update={"use": "kinematics"})
    untold = replace(
        policy, configuration=policy.configuration.model_copy(update={"record": record})
    ).task
    np.testing.assert_array_equal(untold.reference.positions, unknown.reference.positions)
    assert np.abs(policy.task.reference.positions - untold.reference.positions).max() > 0.01
    moments = [each.record.moments["hip_flexion_r"] for each in (policy.task, untold)]
    assert moments[0] == policy.subject.record().moments["hip_flexion_r"]
    assert moments[1] != moments[0]
