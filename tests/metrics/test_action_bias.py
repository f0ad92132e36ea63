"""The share of a policy's habit that brings the walk nearest to its reference."""

import numpy as np
import pytest
from simulation_fixtures import random_policy

from gaitval.datasets.subject_file import load_subject
from gaitval.gait.cycle_curves import FORCES, JOINT_MOMENTS, recorded_curves
from gaitval.metrics import action_bias
from gaitval.metrics.action_bias import centred, floor_of, reference_curves
from gaitval.metrics.comparison import rms
from gaitval.metrics.epsilon import ANGLES
from gaitval.metrics.round_errors import Epsilon
from gaitval.model.parameters import nominal_parameters


def test_the_references_curves_have_the_records_names_signs_and_sides(task):
    """A reference that was fitted to a record is near it on both sides."""
    record = load_subject("S05").record()
    found = reference_curves(task.reference, task.model.mass, record.left_phase)
    truth = recorded_curves(record)
    for kind, largest in (("angles", np.deg2rad(3.0)), ("moments", 0.13), ("forces", 0.02)):
        for name, curve in getattr(found, kind).items():
            assert rms(curve - getattr(truth, kind)[name]) < largest, name
    assert found.forces["medial_l"][20:40].mean() > 0.0
    assert found.forces["medial_r"][20:40].mean() > 0.0


def test_the_floor_is_the_error_of_the_reference_itself(task):
    """About a sixth of the record; none for a record that is what the reference does."""
    floor = floor_of(task)
    assert 0.05 < floor < 0.5
    curves = reference_curves(task.reference, task.model.mass, task.record.left_phase)
    parts = []
    for kind, names in (("angles", ANGLES), ("moments", JOINT_MOMENTS), ("forces", FORCES)):
        recorded = getattr(recorded_curves(task.record), kind)
        keys = [f"{name}_{side}" for name in names for side in "rl"]
        off = np.array([getattr(curves, kind)[key] - recorded[key] for key in keys])
        size = np.array([recorded[key] for key in keys])
        parts.append(np.linalg.norm(off, axis=0).mean() / np.sqrt(np.mean(np.sum(size**2, axis=0))))
    assert floor == pytest.approx(sum(parts))


def test_walks_that_fall_choose_nothing(task):
    policy = random_policy(task, scale=5.0)
    assert centred(task, policy, nominal_parameters()) == 0.5


@pytest.mark.parametrize("best", [0.25, 1.0])
def test_the_share_with_the_least_error_is_chosen(task, monkeypatch, best):
    shares = []

    class Walked:
        fell = np.zeros(1)

    def walk(environment, *_, **__):
        shares.append(environment.constants.centring)
        return Walked()

    def error(*_):
        return Epsilon(angles=0.0, moments=0.0, forces=0.0, total=abs(shares[-1] - best))

    monkeypatch.setattr(action_bias, "record_rollout", walk)
    monkeypatch.setattr(action_bias, "find_cycles", lambda *_: None)
    monkeypatch.setattr(action_bias, "curves_of", lambda *_, **__: None)
    monkeypatch.setattr(action_bias, "epsilon", error)
    assert centred(task, None, nominal_parameters()) == best
    assert shares == list(action_bias.SHARES)
