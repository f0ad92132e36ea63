"""A stored policy walks from Python as it was validated, and is compared as it was."""

from pathlib import Path

import numpy as np
import pytest

import gaitval as gv
from gaitval.errors import PolicyError
from gaitval.interface.walks import Comparison, Policy, Rollout


@pytest.fixture(scope="module")
def walk() -> Rollout:
    return gv.rollout(gv.load_policy(5), cycles=6)


def test_a_policy_is_stored_whole(tmp_path: Path):
    policy = gv.load_policy("S05")
    policy.save(tmp_path)
    again = Policy.load(tmp_path)
    np.testing.assert_array_equal(again.identified, policy.identified)
    assert repr(again) == repr(policy)
    (tmp_path / "correction.json").unlink()
    with pytest.raises(PolicyError, match=r"correction\.json"):
        gv.load_policy(tmp_path)


def test_a_walk_is_kept_as_it_was(walk: Rollout, tmp_path: Path):
    assert "did not fall" in repr(walk)
    walk.save(tmp_path / "walk.npz")
    again = Rollout.load(tmp_path / "walk.npz")
    np.testing.assert_array_equal(again.positions, walk.positions)
    assert (again.walker, again.mass_kg) == ("S05", walk.mass_kg)


def test_a_walk_against_the_record_and_itself(walk: Rollout, tmp_path: Path):
    against = gv.compare(walk, gv.load_subject(5))
    assert "the record of S05" in repr(against)
    assert against.rmse("knee_angle_l") < gv.limits().rows[0].value
    assert set(against.to_frame().source) == {"walk of S05", "the record of S05"}
    against.save(tmp_path / "comparison.npz")
    assert repr(Comparison.load(tmp_path / "comparison.npz")) == repr(against)
    itself = gv.compare(walk, walk)
    assert max(itself.rmse(name) for name in itself.names) == 0.0
