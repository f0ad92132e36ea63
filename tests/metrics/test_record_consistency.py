"""What a record contradicts, and the error that no walk can be without."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_walk import STANCE, periodic, synthetic_record

from gaitval.coordinates import SIDES
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.gait.record import PeriodicCurve
from gaitval.metrics.record_consistency import consistency

PHASE = np.arange(1000) / 1000


def _with_vertical(record, function):
    """The record with vertical forces `function(phase, stance)` on both feet."""
    forces = {
        side: (
            *record.forces[side][:2],
            periodic(lambda phase, s=STANCE[side]: function(phase, s), harmonics=200),
        )
        for side in SIDES
    }
    return replace(record, forces=forces)


RECORD = synthetic_record()


def _record_of_mean(mean: float):
    """Vertical forces constant in stance that average `mean` body weights."""
    level = mean / sum(STANCE.values())
    return _with_vertical(RECORD, lambda phase, stance: np.full_like(phase, level))


@pytest.mark.parametrize("mean", [0.92, 1.0, 1.03])
def test_the_missing_weight_is_measured(mean):
    found = consistency(_record_of_mean(mean))
    assert found.mean_force.vertical == pytest.approx(mean, abs=2e-3)
    assert found.force_rmse_bound.vertical == pytest.approx(abs(1 - mean) / 2, abs=1e-3)


def test_the_bound_in_stance_is_reached_and_never_undercut():
    """Walks that carry the weight which the record lacks, in many ways."""
    mean = 0.92
    record = _record_of_mean(mean)
    missing = 1.0 - consistency(record).mean_force.vertical
    bound = consistency(record).vertical_rmse_bound_in_stance
    root = {side: np.sqrt(STANCE[side]) for side in SIDES}
    on = {side: STANCE[side] >= PHASE for side in SIDES}

    def rmse(error, side):
        return np.sqrt(np.mean(np.where(on[side], error, 0.0) ** 2))

    best = {
        side: missing * root[side] / sum(root.values()) / on[side].mean() * np.ones(1000)
        for side in SIDES
    }
    assert max(rmse(best[side], side) for side in SIDES) == pytest.approx(bound, rel=2e-3)
    random = np.random.default_rng(1)
    for _ in range(50):
        error = {side: random.normal(0.1, 0.2, 1000) for side in SIDES}
        carried = sum(np.where(on[side], error[side], 0.0).mean() for side in SIDES)
        found = [rmse(error[side] * missing / carried, side) for side in SIDES]
        assert max(found) >= bound
        assert np.mean(found) >= consistency(record).force_rmse_bound.vertical


def test_a_mean_force_along_the_ground_is_a_contradiction_too():
    push = PeriodicCurve(0.02, (), ())
    record = replace(
        RECORD,
        forces={side: (push, push, RECORD.forces[side][2]) for side in SIDES},
    )
    found = consistency(record)
    expected = 0.02 * sum(STANCE.values())
    for axis in ("forward", "left"):
        assert getattr(found.mean_force, axis) == pytest.approx(expected, abs=1e-4)
        assert getattr(found.force_rmse_bound, axis) == pytest.approx(expected / 2, abs=1e-4)


def test_an_offset_of_one_leg_is_an_asymmetry_of_moments():
    right = RECORD.moments["knee_angle_r"]
    moments = {
        **RECORD.moments,
        "knee_angle_r": replace(right, mean=right.mean + 0.3),
        "knee_angle_l": right,
    }
    found = consistency(replace(RECORD, moments=moments)).moment_asymmetry.knee_angle
    assert found.mean_difference == pytest.approx(0.3)
    assert found.rms_difference == pytest.approx(0.3)


def test_all_recorded_people_seem_lighter_than_they_are():
    """Which is why the bound is in every report."""
    for subject in builtin_subjects():
        found = consistency(subject.measured())
        assert 0.9 < found.mean_force.vertical < 1.0, subject.identifier
        assert found.force_rmse_bound.vertical < found.vertical_rmse_bound_in_stance < 0.06
