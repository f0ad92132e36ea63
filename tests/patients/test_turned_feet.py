"""A foot is built turned on its shank by what the recorded foot progression says."""

import numpy as np
import pytest

from gaitval.apps.patients.cohort import found_patients
from gaitval.apps.patients.known_record import known_record
from gaitval.apps.patients.turned_feet import turned_feet, with_turned_feet
from gaitval.coordinates import SIDES
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import ROOT_DOFS, segment_frames
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import builtin_subjects


@pytest.fixture(scope="module")
def person(strides_table, people_table):
    (found,) = found_patients(strides_table, [people_table], ["P2=1.1"], ["well"], ["P1_off"])
    model = scale_subject(found.subject).model
    return found, known_record(found.subject, builtin_subjects(), model)


def test_a_foot_that_points_further_out_is_turned_by_as_much(person):
    patient, message = person
    model = scale_subject(patient.subject).model
    before = turned_feet(patient.strides, message, model)
    angles = dict(patient.strides.angles)
    angles["foot_progression_l"] = angles["foot_progression_l"] - 6.0
    strides = type(patient.strides)(**vars(patient.strides) | {"angles": angles})
    after = turned_feet(strides, message, model)
    assert np.isclose(after["left"] - before["left"], np.radians(6.0))
    assert np.isclose(after["right"], before["right"])


def test_turned_feet_point_outwards_and_are_the_same_feet(person):
    model = scale_subject(person[0].subject).model
    turns = dict.fromkeys(SIDES, np.radians(10.0))
    turned = with_turned_feet(model, turns)
    assert np.isclose(turned.mass, model.mass)
    for straight, other in zip(model.spheres, turned.spheres, strict=True):
        assert np.isclose(np.linalg.norm(straight.position), np.linalg.norm(other.position))
        assert np.isclose(straight.position[2], other.position[2])
    frames = segment_frames(turned, np.zeros((1, ROOT_DOFS + 25)))[0]
    toes, foot = (frames[SEGMENTS.index(f"{name}_r"), :2, 3] for name in ("toes", "foot"))
    was = model["toes_r"].joint_position
    out = np.arctan2(*(toes - foot)[::-1]) - np.arctan2(was[1], was[0])
    assert np.isclose(out, -np.radians(10.0))
    assert np.isclose(np.trace(turned["foot_l"].inertia), np.trace(model["foot_l"].inertia))
