"""What a run knows of a record."""

import numpy as np
import pytest

from gaitval.configuration import RecordSettings, load_configuration
from gaitval.errors import SubjectError
from gaitval.metrics.origin import status, uses
from gaitval.subjects.prediction.known import known_record, quantities_known
from gaitval.subjects.subject_file import builtin_subjects, load_subject

SUBJECTS = builtin_subjects()
PERSON = load_subject("S05")
PHASE = np.arange(100) / 100
ALL, KINEMATICS = RecordSettings(), RecordSettings(use="kinematics")


def test_all_is_the_record():
    found = known_record(PERSON, ALL, SUBJECTS).record
    np.testing.assert_array_equal(
        found.ground_reaction("left", PHASE), PERSON.record().ground_reaction("left", PHASE)
    )


def test_kinematics_are_the_person_and_kinetics_are_not():
    found, record = known_record(PERSON, KINEMATICS, SUBJECTS).record, PERSON.record()
    for name, curve in record.angles.items():
        np.testing.assert_array_equal(found.angles[name](PHASE), curve(PHASE))
    assert (found.speed, found.stride_time, found.left_phase) == (
        record.speed, record.stride_time, record.left_phase,
    )  # fmt: skip
    difference = found.moments["hip_flexion_r"](PHASE) - record.moments["hip_flexion_r"](PHASE)
    assert 0.03 < np.sqrt(np.mean(difference**2)) < 0.3
    assert found.stance_fraction["right"] == found.stance_fraction["left"]


def test_expected_kinetics_do_not_depend_on_the_persons_own_file():
    """Also not when the same person is among the others."""
    before = known_record(PERSON, KINEMATICS, SUBJECTS).record
    after = known_record(
        PERSON, KINEMATICS, [each for each in SUBJECTS if each.identifier != "S05"]
    ).record
    np.testing.assert_array_equal(
        before.ground_reaction("right", PHASE), after.ground_reaction("right", PHASE)
    )


def test_too_few_others_are_refused():
    with pytest.raises(SubjectError, match="only 2 others are known, and 3 are needed"):
        known_record(PERSON, KINEMATICS, SUBJECTS[:2])


def test_a_person_without_plates_is_told_kinematics_only():
    gait = PERSON.gait.model_copy(update={"moments": {}, "forces": None})
    person = PERSON.model_copy(update={"gait": gait, "plates": None, "trials": ()})
    np.testing.assert_array_equal(
        known_record(person, ALL, SUBJECTS).record.ground_reaction("right", PHASE),
        known_record(PERSON, KINEMATICS, SUBJECTS).record.ground_reaction("right", PHASE),
    )
    assert quantities_known(person, ALL) == ("angles", "timing")
    with pytest.raises(SubjectError, match="no moments and forces were recorded"):
        person.record()


@pytest.mark.parametrize(
    ("settings", "moment", "angle", "epsilon"),
    [
        ((), "fitted", "fitted", "fitted"),
        (("record.use=kinematics",), "predicted", "fitted", "partly fitted"),
        (('record.holdout="T03"',), "predicted", "predicted", "predicted"),
    ],
)
def test_every_comparison_says_whether_it_was_told(settings, moment, angle, epsilon):
    configuration = load_configuration(settings=settings)
    found = uses(PERSON, configuration, trained=True)
    known = [name for name, read_by in found.items() if read_by]
    assert status("moment_rmse", known) == moment
    assert status("angle_rmse", known) == angle
    assert status("epsilon", known) == epsilon
    assert status("shoulder_moment_rms", known) == "not compared"


def test_only_what_ran_has_read_the_record():
    found = uses(PERSON, load_configuration(), trained=True)
    assert found["angles"] == ["reference", "reward", "identification", "correction"]
    assert "correction" not in found["timing"]
    none = load_configuration(settings=["identification.method=none", "correction.steps=0"])
    assert uses(PERSON, none, trained=False)["angles"] == ["reference"]
    assert uses(PERSON, none, trained=False)["moments"] == ["reference", "feed-forward"]
