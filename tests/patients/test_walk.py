"""A person of whom only strides are known walks without training, near the strides."""

import csv

import numpy as np
import pytest
from made_strides import write_strides

from experiments.sound_sides import tables
from gaitval._internal.io.artefacts import read_json
from gaitval.apps.patients.cohort import found_patients, walked
from gaitval.apps.patients.gentle_fit import gentle_reference
from gaitval.apps.patients.passive_foot import patient_record
from gaitval.apps.patients.turned_feet import turned_feet, with_turned_feet
from gaitval.apps.patients.walk import KINEMATIC_ACCURACY
from gaitval.configuration import Configuration
from gaitval.coordinates import COORDINATES
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import builtin_subjects
from gaitval.walk.reference.motion import build_reference


@pytest.mark.slow
def test_a_person_walks_from_angles_alone_and_is_not_walked_twice(
    strides_table, people_table, tmp_path
):
    patients = found_patients(strides_table, [people_table], ["P2=1.1"], ["well"], ["P1_off"])
    messages = []
    (found,) = walked(patients, tmp_path, messages.append)
    assert (found["falls"], found["starts"]) == (0, 8)
    assert found["cycles"] >= 100
    assert found["angle"] < 2.5
    assert abs(found["scores"]["walk"] - found["scores"]["stride"]) < 2.0
    first, *_, last = found["correction"]["errors"]
    assert last < first
    assert found["correction"]["refused"] is None
    stored = read_json(tmp_path / "walks" / "P1_off.json")
    assert walked(patients, tmp_path, messages.append) == [stored]


@pytest.mark.slow  # six fits of one person
def test_a_sound_foot_carries_until_it_leaves_the_ground(gait_data, tmp_path):
    """TF07's angles have it leave 0.03 of the cycle earlier; fits that begin from the angles alone
    end with hips, knees and ankles that are 3.6 degrees off.
    """
    strides, people = tables(gait_data)
    with strides.open(encoding="utf-8") as file:
        rows = [row for row in csv.reader(file) if row[1] == "TF07"]  # alone: the rest takes long
    own = write_strides(tmp_path / "TF07.csv", rows)
    (found,) = found_patients(own, people, ["TF07=0.8"])
    straight = scale_subject(found.subject, symmetric=False).model
    record = patient_record(found, builtin_subjects(), straight)
    model = with_turned_feet(straight, turned_feet(found.strides, record, straight))
    contact = Configuration().contact
    reference = gentle_reference(
        record, model, contact, KINEMATIC_ACCURACY, found.person.amputation
    )
    names = [
        COORDINATES.index(f"{name}_{side}")
        for name in ("hip_flexion", "knee_angle", "ankle_angle")
        for side in "rl"
    ]
    off = (reference.positions - build_reference(record, model, contact).positions)[:, names]
    assert np.degrees(np.sqrt(np.mean(off**2, axis=0))).mean() < 3.0
