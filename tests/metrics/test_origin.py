"""Where what a walk is compared with comes from."""

import pytest

from gaitval.configuration import RecordSettings
from gaitval.metrics.origin import (
    curve_origin,
    everything,
    furthest,
    is_judged,
    measure_origin,
    not_recorded,
    record_origins,
)
from gaitval.subjects.subject_file import load_subject


def origins(**changed):
    """All recorded but for `quantity_side` = origin."""
    found = everything("recorded")
    for key, origin in changed.items():
        quantity, side = key.rsplit("_", 1)
        found[quantity][side] = origin
    return found


def test_a_comparison_is_as_good_as_its_worst_part():
    assert furthest(["recorded", "expected", "mirrored"]) == "expected"
    assert furthest(["predicted", "expected"]) == "predicted"
    assert furthest(["recorded"]) == "recorded"


@pytest.mark.parametrize(
    ("measure", "target", "origin"),
    [
        ("moment_rmse", "knee_angle_l", "mirrored"),
        ("moment_rmse", "knee_angle_r", "recorded"),
        ("angle_rmse", "knee_angle_l", "recorded"),
        ("power_burst_error", "A2_l", "mirrored"),
        ("epsilon", "walk", "mirrored"),
        ("epsilon", "left", "mirrored"),
        # an axis of the whole body, which is no side
        ("centre_of_mass_rmse", "left", "expected"),
        ("force_rmse", "vertical_l", "recorded"),
        ("force_rmse", "vertical_r", "expected"),
        ("stance_fraction_error", "left", "recorded"),
        ("push_survival", "phase 0.5", None),
    ],
)
def test_a_measure_is_of_the_sides_that_it_names(measure, target, origin):
    where = origins(moments_left="mirrored", forces_right="expected")
    if measure == "epsilon":
        where = origins(moments_left="mirrored")
    assert measure_origin(measure, target, where) == origin


def test_a_curve_is_of_its_kind_and_side():
    where = origins(moments_left="mirrored")
    assert curve_origin("moments", "hip_flexion_l", where) == "mirrored"
    assert curve_origin("moments", "hip_flexion_r", where) == "recorded"
    assert curve_origin("angles", "hip_flexion_l", where) == "recorded"
    assert not_recorded(where) == [("moments", "left", "mirrored")]


def test_only_what_was_recorded_is_judged():
    assert [
        is_judged(each) for each in (None, "recorded", "mirrored", "expected", "predicted")
    ] == [*(True, True, False, False, False)]


def test_a_person_with_a_record_and_without():
    person = load_subject("S05")
    assert not_recorded(record_origins(person, RecordSettings())) == []
    other = RecordSettings(speed=1.0)
    assert {each[2] for each in not_recorded(record_origins(person, other))} == {"predicted"}
