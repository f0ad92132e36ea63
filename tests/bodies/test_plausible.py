"""What cannot be one person's is said before anything is computed; people are left alone."""

import pytest

from gaitval.configuration import load_configuration
from gaitval.datasets.subject_file import load_subject
from gaitval_bodies.plausible import implausible

CONFIGURATION = load_configuration()


@pytest.mark.parametrize("name", ["S01", "S05", "S06", "S08"])
def test_nothing_is_said_of_people_whose_values_are_right(name):
    assert implausible(load_subject(name), CONFIGURATION) == []


def test_a_record_whose_plates_carry_too_little_is_found_among_the_built_in():
    """Both plates of S10 together show 0.918 body weights in the mean."""
    (warning,) = implausible(load_subject("S10"), CONFIGURATION)
    assert "0.92 body weights" in warning


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"mean_vertical_force": 1.08}, "either the mass is"),
        ({"walking_speed_m_s": 1.5}, "km/h"),
        ({"height_m": 1.75}, "the stature"),
    ],
)
def test_what_is_wrong_is_named_with_what_to_do(changed, said):
    subject = load_subject("S05").model_copy(update=changed)
    (warning,) = implausible(subject, CONFIGURATION)
    assert said in warning


def test_an_aid_carries_a_part_of_the_body():
    subject = load_subject("S05").model_copy(update={"mean_vertical_force": 0.9, "aid": "crutches"})
    assert implausible(subject, CONFIGURATION) == []
