"""What cannot be one person's is said before anything is computed; people are left alone."""

import pytest

from gaitval.configuration import load_configuration
from gaitval.identification.plausible import implausible
from gaitval.subjects.subject_file import load_subject

CONFIGURATION = load_configuration()


def said_of(subject, configuration=CONFIGURATION):
    return implausible(subject, configuration, subject.record())


@pytest.mark.parametrize("name", ["S01", "S05", "S06", "S08"])
def test_nothing_is_said_of_people_whose_values_are_right(name):
    assert said_of(load_subject(name)) == []


def test_a_record_whose_plates_carry_too_little_is_found_among_the_built_in():
    """Both plates of S10 together show 0.918 body weights in the mean."""
    (warning,) = said_of(load_subject("S10"))
    assert "0.92 body weights" in warning


def test_forces_that_are_held_out_are_not_looked_at():
    fixed = load_configuration(settings=["record.use=kinematics"])
    assert said_of(load_subject("S10"), fixed) == []


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"mean_vertical_force": 1.08}, "either the mass is"),
        ({"walking_speed_m_s": 1.5}, "km/h"),
        ({"height_m": 1.75}, "the stature"),
    ],
)
def test_what_is_wrong_is_named_with_what_to_do(changed, message):
    subject = load_subject("S05").model_copy(update=changed)
    (warning,) = said_of(subject)
    assert message in warning


def test_an_aid_carries_a_part_of_the_body():
    subject = load_subject("S05").model_copy(update={"mean_vertical_force": 0.9, "aid": "crutches"})
    assert said_of(subject) == []
