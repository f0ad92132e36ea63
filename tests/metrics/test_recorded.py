"""What a run stores of the record, what that contradicts, and the error of every walk."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_walk import LEFT_PHASE, SPEED, STANCE, STRIDE_TIME, periodic, synthetic_record

from gaitval.coordinates import SIDES
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.record import MeanSteps, PeriodicCurve
from gaitval.metrics.curve_results import by_kind, from_kinds
from gaitval.metrics.recorded import consistency, recorded_part
from gaitval.metrics.typed import array
from gaitval.subjects.subject_file import builtin_subjects, load_subject

RECORD = synthetic_record()
PERSON = load_subject("S05")


def test_curves_are_in_the_units_of_the_file_and_come_back():
    curves = recorded_curves(RECORD)
    stored = by_kind(curves)
    for kind, factor in (("angles", 180.0 / np.pi), ("moments", 1.0), ("forces", 100.0)):
        for name, curve in getattr(curves, kind).items():
            np.testing.assert_allclose(stored[kind][name], factor * curve)
    read = from_kinds(
        (kind, name, curve.tolist())
        for kind, each in stored.items()
        for name, curve in each.items()
    )
    for kind in stored:
        for name, curve in getattr(curves, kind).items():
            np.testing.assert_allclose(getattr(read, kind)[name], curve, atol=1e-12)


def test_a_curve_with_gaps_is_read():
    (curve,) = from_kinds([("angles", "knee_angle_r", [90.0, None])]).angles.values()
    assert curve[0] == pytest.approx(np.pi / 2)
    assert np.isnan(curve[1])


def test_the_timing_of_a_record():
    """A stride of 1.1 s at 1.2 m/s; stances of 62 and 60 %, the left one 48 % later, so that both
    feet are on the ground from 0 to 8 % and from 48 to 62 %."""
    found = recorded_part(RECORD).spatiotemporal
    stride = SPEED * STRIDE_TIME
    assert found.walking_speed == SPEED
    assert found.cadence == pytest.approx(120.0 / STRIDE_TIME)
    assert found.stride_time_right == found.stride_time_left == STRIDE_TIME
    assert found.stance_fraction_right == STANCE["right"]
    assert found.stance_fraction_left == STANCE["left"]
    assert found.double_support_fraction == pytest.approx(0.08 + 0.14, abs=0.0021)
    assert found.step_length_left == pytest.approx(LEFT_PHASE * stride)
    assert found.step_length_right == pytest.approx((1.0 - LEFT_PHASE) * stride)
    assert found.step_width is None
    # a left foot that is down from 35 to 95 % is off the ground when the right one lands
    early = recorded_part(replace(RECORD, left_phase=0.35)).spatiotemporal
    assert early.double_support_fraction == pytest.approx(0.62 - 0.35, abs=0.0021)


def test_steps_that_were_measured_are_not_made_from_time():
    steps = MeanSteps(right=0.70, left=0.55, width=0.11)
    found = recorded_part(replace(RECORD, steps=steps)).spatiotemporal
    assert (found.step_length_right, found.step_length_left) == (0.70, 0.55)
    assert found.step_width == 0.11


def test_power_and_centre_of_mass_go_with_the_record():
    part = recorded_part(RECORD)
    angle = np.gradient(recorded_curves(RECORD).angles["knee_angle_l"], 0.01 * STRIDE_TIME)
    power = recorded_curves(RECORD).moments["knee_angle_l"] * angle
    np.testing.assert_allclose(
        array(part.joint_power.power["knee_angle_l"])[1:-1], power[1:-1], atol=1e-9
    )
    assert np.shape(part.centre_of_mass) == (101, 3)


def test_the_record_says_what_was_done_to_its_plates():
    """As measured beside as corrected; a record alone has neither."""
    part = recorded_part(PERSON.record(), PERSON)
    assert part.plates is not None
    assert part.plates.model_dump() == PERSON.plates.model_dump()
    assert part.as_measured is not None
    moments = by_kind(recorded_curves(PERSON.measured()))["moments"]
    np.testing.assert_allclose(part.as_measured.moments["knee_angle_r"], moments["knee_angle_r"])
    alone = recorded_part(PERSON.record())
    assert alone.plates is None
    assert alone.as_measured is None


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
