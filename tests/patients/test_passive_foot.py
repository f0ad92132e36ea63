"""A prosthetic foot's moment is that of two springs that carry the body."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.apps.patients.cohort import found_patients
from gaitval.apps.patients.known_record import known_record, most_dorsiflexed
from gaitval.apps.patients.passive_foot import expected_ankles, passive_ankle
from gaitval.constants import GRAVITY
from gaitval.gait.record import periodic_through
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import builtin_subjects

PHASE = np.arange(200) / 200


@pytest.fixture(scope="module")
def amputee(strides_table, people_table):
    (found,) = found_patients(strides_table, [people_table], ["P1_off=1.1"], ["well"], ["P2"])
    assert found.person.amputation == "right"
    model = scale_subject(found.subject, symmetric=False).model
    return found, known_record(found.subject, builtin_subjects(), model, "right"), model


def test_the_springs_pull_as_healthy_people_do_where_the_foot_is_bent_furthest(amputee):
    _, record, model = amputee
    side = "right"
    name, stance = f"ankle_angle_{side[0]}", record.stance_fraction[side]
    furthest = most_dorsiflexed(record.angles[name], stance)
    # The curve of 40 harmonics is cut off at toe-off, elsewhere it is exact to that.
    found = passive_ankle(record, model, side)(furthest)
    assert np.isclose(found, record.moments[name](PHASE).min(), atol=0.03)


@pytest.mark.parametrize("side", ["right", "left"])
def test_the_moment_follows_the_angle_and_the_load_alone(amputee, side):
    """In stance M + F (b - a) / 2 is a line through the angle, which is the unloaded foot's law."""
    _, record, model = amputee
    name, stance = f"ankle_angle_{side[0]}", record.stance_fraction[side]
    # A series of 40 harmonics rings where the moment is cut off at toe-off.
    within = PHASE[(PHASE > 0.1) & (stance - 0.1 > PHASE)]
    places = {each.name: each.position[0] for each in model.spheres}
    # Of PredSim's foot: heel 0.0019, toes 0.2388, the ball's two spheres 0.1484 and 0.1330 m.
    share = (0.5 * (0.1484 + 0.1330) - 0.0019) / (0.2388 - 0.0019)
    toes = model[f"toes_{side[0]}"].joint_position[0] + places[f"contact_toes_medial_{side[0]}"]
    heel = places[f"contact_heel_{side[0]}"]
    ball = heel + share * (toes - heel)
    load = record.ground_reaction(side, within)[:, 2]
    shift = 0.5 * GRAVITY * load * (ball + heel)
    spring = passive_ankle(record, model, side)(within) + shift
    angle = record.angles[name](within)
    line = np.polyfit(angle, spring, 1)
    assert line[0] < 0.0
    assert np.abs(np.polyval(line, angle) - spring).max() < 0.03
    # It is unloaded at the angle of swing.
    swings = record.angles[name](PHASE[(stance + 0.05 < PHASE) & (PHASE < 0.96)]).mean()
    assert np.isclose(-line[1] / line[0], swings, atol=np.radians(1.0))


def test_an_angle_that_is_measured_from_elsewhere_changes_nothing(amputee):
    """A foot that was set in another angle on the shank bends as it did."""
    _, record, model = amputee
    angle = periodic_through(record.angles["ankle_angle_r"](PHASE) + np.radians(7.0), 40)
    turned = replace(record, angles=dict(record.angles) | {"ankle_angle_r": angle})
    before, after = (passive_ankle(each, model, "right")(PHASE) for each in (record, turned))
    assert np.allclose(before, after, atol=1e-6)


def test_the_sound_side_is_not_touched(amputee):
    patient, record, _ = amputee
    found = expected_ankles(patient, builtin_subjects())
    assert np.array_equal(found["left"](PHASE), record.moments["ankle_angle_l"](PHASE))
    assert not np.allclose(found["right"](PHASE), record.moments["ankle_angle_r"](PHASE), atol=0.02)


def test_a_foot_that_is_never_bent_further_than_in_swing_has_no_stiffness(amputee):
    """What remains is the load's, whose lever is the same for every angle."""
    _, record, model = amputee
    name, stance = "ankle_angle_r", record.stance_fraction["right"]
    swing = (stance + 0.05 < PHASE) & (PHASE < 0.96)
    found = []
    for higher in (np.radians(60.0), np.radians(70.0)):
        angle = record.angles[name](PHASE) + np.where(swing, higher, 0.0)
        lifted = replace(record, angles=record.angles | {name: periodic_through(angle, 60)})
        found.append(passive_ankle(lifted, model, "right")(PHASE))
    np.testing.assert_allclose(*found, atol=1e-9)
    assert np.abs(found[0]).max() < 2.0
