"""A person with several trials."""

import pytest

from gaitval.errors import SubjectError
from gaitval.subjects.subject import make_subject
from gaitval.subjects.subject_file import load_subject, parse_subject

PERSON = load_subject("S05")


def test_on_another_trial_it_is_the_same_person_with_that_gait():
    slow = PERSON.on_trial("T03")
    assert (slow.trial, slow.person, slow.source) == ("T03", "WBDS14", "WBDS14 T03")
    assert slow.walking_speed_m_s == 0.78
    assert slow.markers == PERSON.markers
    assert slow.record().stride_time == 1.25
    assert slow.on_trial("T05").record().speed == PERSON.record().speed
    assert {trial.name for trial in slow.trials} == {"T05", "T06"}
    assert PERSON.on_trial("T05") is PERSON


def test_the_plates_of_a_further_trial_are_as_far_out_and_scaled_to_its_own_force():
    slow = PERSON.on_trial("T03")
    assert slow.plates.shift == PERSON.plates.shift
    assert slow.plates.scale == pytest.approx(1.0 / slow.mean_vertical_force)


def test_a_file_with_trials_is_read_as_it_was_written():
    text = PERSON.to_toml()
    assert text.count("[[trials]]") == 2
    again = parse_subject(text, "again")
    assert again == PERSON
    assert parse_subject(again.on_trial("T06").to_toml(), "other").on_trial(
        "T05"
    ).stride_time_s == (PERSON.stride_time_s)


def test_two_trials_of_one_name_and_implausible_ones_are_refused():
    values = PERSON.model_dump()
    values["trials"] = (*values["trials"], values["trials"][0])
    with pytest.raises(SubjectError, match="T03 is there 2 times"):
        make_subject(values, "mine")
    values = PERSON.model_dump()
    values["trials"][0]["walking_speed_m_s"] = 7.8
    with pytest.raises(SubjectError, match=r"trial T03: walking_speed_m_s = 7.8"):
        make_subject(values, "mine")
    values = PERSON.model_dump()
    values["gait"]["moments"] = {}
    with pytest.raises(SubjectError, match="there are forces, but no moments"):
        make_subject(values, "mine")


def test_a_trial_of_another_person_is_refused():
    with pytest.raises(SubjectError, match=r"a trial of another person than S05 .*mass_kg"):
        PERSON.with_trial(load_subject("S01"))
    with pytest.raises(SubjectError, match="A trial cannot be both used and held out"):
        PERSON.with_trial(PERSON.on_trial("T06"))
