"""Subjects of one stride a side: what is known stays, what is estimated has an interval."""

from dataclasses import replace

import numpy as np
import pytest
from made_strides import stride_rows, write_strides

from gaitval._internal.io.artefacts import read_json
from gaitval.apps.patients.cohort import found_patients, written
from gaitval.apps.patients.estimates import (
    EstimatedValue,
    leg_length,
    pace,
)
from gaitval.apps.patients.known_record import (
    expected_record,
    heel_rise,
    known_record,
    over_stance,
    rolled_ankle,
    warped,
)
from gaitval.apps.patients.one_stride import TOLERANCE, left_strike, smoothed
from gaitval.apps.patients.page import write_pages
from gaitval.apps.patients.people import PersonRow
from gaitval.apps.patients.records import two_sided
from gaitval.apps.patients.results import PatientResult, result_of
from gaitval.apps.patients.rolling_foot import feet
from gaitval.coordinates import SIDES
from gaitval.errors import ConfigurationError, RecordError, SubjectError
from gaitval.gait.record import PeriodicCurve, periodic_through
from gaitval.identification.prior import measured_by
from gaitval.metrics.norms import norms
from gaitval.scaling.anthropometry import mass_fractions
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.prediction.population import with_others_kinetics
from gaitval.subjects.subject_file import builtin_subjects, load_subject, parse_subject

PHASE = np.linspace(0.0, 1.0, 101)


@pytest.fixture(scope="session")
def patients(strides_table, people_table):
    return found_patients(strides_table, [people_table], ["P2=1.1"], ["well"])


def test_a_smooth_stride_is_kept_within_the_tolerance():
    values = 0.3 * np.sin(2 * np.pi * PHASE) + 0.1 * np.cos(6 * np.pi * PHASE)
    found = smoothed(values)
    assert found.rms < TOLERANCE
    assert abs(found.closure) < 1e-12


def test_a_jump_is_smoothed_and_told_not_refused():
    values = np.where(PHASE < 0.6, 0.2, -0.1) + 0.02 * PHASE
    found = smoothed(values)
    assert len(found.curve.cosine) == 12
    assert np.isclose(found.closure, values[-1] - values[0])
    error = np.abs(found.curve.periodic()(PHASE) - values)
    assert np.isclose(found.curve.residual, error.max())
    assert found.curve.residual > 0.1


@pytest.mark.parametrize("shift", [0.38, 0.5, 0.61])
def test_the_left_strike_is_found_where_it_is(shift):
    random = np.random.default_rng(1)
    curves = {}
    for name, sign in (("tilt", 1), ("list", -1), ("rotation", -1)):
        # A pelvis with odd harmonics, so that half a cycle is not a whole one.
        cosine, sine = 0.05 * random.normal(size=(2, 4))
        right = PeriodicCurve(0.1, tuple(cosine), tuple(sine))
        curves[f"pelvis_{name}_r"] = right
        values = sign * right(np.arange(100) / 100 + shift)
        curves[f"pelvis_{name}_l"] = smoothed(np.append(values, values[0])).curve.periodic()
    found = left_strike(curves, EstimatedValue(0.5, 0.05, ""))
    assert abs(found.phase - shift) < 0.01
    assert found.sd < 0.02


def test_a_pelvis_that_hardly_moves_leaves_what_was_thought_before():
    flat = PeriodicCurve(0.1, (0.0,), (0.0,))
    curves = {f"pelvis_{name}_{s}": flat for name in ("tilt", "list", "rotation") for s in "rl"}
    found = left_strike(curves, EstimatedValue(0.47, 0.05, ""))
    assert np.isclose(found.phase, 0.47, atol=1e-3)
    assert np.isclose(found.sd, 0.05, rtol=0.05)


@pytest.mark.parametrize("name", ["1", "4", "8"])
def test_the_rolling_foot_says_how_long_a_stride_is(name):
    subject = load_subject(name)
    tape = {"hip_height": subject.leg_length_m}
    model = scale_subject(subject.by_stature().model_copy(update={"tape": tape})).model
    found = feet(subject.gait.angles_of_both(), subject.left_phase, model)
    true = subject.walking_speed_m_s * subject.stride_time_s
    assert abs(found.stride_length - true) < 3.0 * found.sd
    for side in SIDES:
        assert abs(found.stance[side] - subject.stance_fraction.of(side)) < 0.05


def test_pace_of_a_known_speed_is_length_over_time():
    length, leg = EstimatedValue(1.2, 0.04, "made"), EstimatedValue(0.9, 0.0, "made")
    known = pace(length, leg, 1.0, patient=True)
    assert (known.speed.sd, known.stride_time.value) == (0.0, pytest.approx(1.2))
    unknown = pace(length, leg, None, patient=True)
    assert unknown.speed.value * unknown.stride_time.value == pytest.approx(1.2)
    low, high = unknown.speed.interval()
    assert low < unknown.speed.value < high
    healthy = pace(length, leg, None, patient=False)
    assert healthy.speed.sd < unknown.speed.sd * 1.5


def test_subjects_keep_both_sides_and_can_be_read_again(patients):
    one, two = patients
    for each in patients:
        gait = each.subject.gait
        assert (gait.mirrored, gait.not_recorded, gait.moments) == ({}, {}, {})
        again = parse_subject(each.subject.to_toml(), "again")
        assert again.identifier == each.subject.identifier
    assert (one.subject.person, one.subject.trial, one.affected) == ("P1", "off", "left")
    assert two.subject.prosthesis == two.affected == "right"
    right, left = (two.subject.gait.angles[f"knee_angle_{side}"].mean for side in "rl")
    assert left - right > np.radians(4.0)


def test_speed_is_estimated_with_an_interval_that_holds_the_truth(patients):
    speed = patients[0].estimates["speed"]
    low, high = speed.interval()
    assert low < load_subject("5").walking_speed_m_s < high
    assert patients[1].estimates["speed"].sd == 0.0


def test_a_prosthetic_leg_is_lighter(patients):
    two = patients[1]
    assert two_sided(two.person)
    table = {row.name: row for row in scale_subject(two.subject, symmetric=False).table}
    assert table["right shank"].mass_kg == pytest.approx(1.9)
    assert table["left shank"].mass_kg == pytest.approx(
        mass_fractions(two.subject.sex)["shank"] * two.subject.mass_kg, rel=0.05
    )
    total = scale_subject(two.subject, symmetric=False).model.mass
    assert total == pytest.approx(two.subject.mass_kg)


def test_two_measured_legs_make_a_body_with_two_legs(strides_table, tmp_path):
    people = tmp_path / "people.csv"
    people.write_text(
        "ID,Sex,Age,Height (m),Mass (kg),Right leg length (m),Left leg length (m)\n"
        "P2,F,30,1.65,60,0.86,0.83\n",
        encoding="utf-8",
    )
    (two,) = found_patients(strides_table, [people], only=["P2"])
    assert two.estimates["leg_difference"].value == pytest.approx(0.03)
    table = {row.name: row for row in scale_subject(two.subject, symmetric=False).table}
    assert table["right thigh"].length_m > table["left thigh"].length_m
    assert PersonRow("x").legs is None


def test_kinetics_are_expected_over_the_own_stance(patients):
    subject, others = patients[1].subject, builtin_subjects()
    message = known_record(subject, others, scale_subject(subject).model)
    stance = subject.stance_fraction.of_both()
    assert message.stance_fraction == stance
    phase = np.arange(200) / 200
    total = sum(message.ground_reaction(side, phase)[:, 2].mean() for side in SIDES)
    assert total == pytest.approx(1.0, abs=0.01)


def test_an_ankles_moment_is_in_the_time_of_its_foot(patients):
    """A gait is its own measure: nothing moves; a heel that rises earlier brings the moment."""
    subject, others = patients[0].subject, builtin_subjects()
    model = scale_subject(subject).model
    usual = expected_record(subject, others)
    phase = np.arange(200) / 200
    own = rolled_ankle(usual, usual, "left", model)(phase)
    assert np.allclose(own, usual.moments["ankle_angle_l"](phase), atol=0.02)
    stands = phase < usual.stance_fraction["left"]
    # By 10 degrees more on the toes, in the middle of stance.
    rise = np.radians(10.0) * np.exp(-(((phase - 0.42) / 0.06) ** 2))
    angle = periodic_through(usual.angles["ankle_angle_l"](phase) - rise, 40)
    vaults = replace(usual, angles=dict(usual.angles) | {"ankle_angle_l": angle})
    assert heel_rise(vaults, "left", model) < heel_rise(usual, "left", model) - 0.02
    found = rolled_ankle(vaults, usual, "left", model)(phase)
    assert found[stands].mean() < own[stands].mean() - 0.01
    right = rolled_ankle(vaults, usual, "right", model)(phase)
    assert np.allclose(right, usual.moments["ankle_angle_r"](phase), atol=0.02)


def test_the_same_stance_changes_nothing():
    subject, others = load_subject("5"), builtin_subjects()
    before = with_others_kinetics(subject, others)
    after = over_stance(before, before.stance_fraction)
    for name, curve in before.moments.items():
        assert np.allclose(after.moments[name](PHASE), curve(PHASE), atol=2e-3)
    assert np.allclose(warped(PHASE, 0.6, 0.6), PHASE)
    assert np.allclose(warped(np.array([0.0, 0.7, 1.0]), 0.7, 0.6), [0.0, 0.6, 1.0])


def test_a_page_names_side_norms_and_what_cannot_be_said(patients, tmp_path):
    one, two = (result_of(each, None) for each in patients)
    rows = {row.name: row for row in two.angles}
    assert rows["knee_angle"].difference > 4.0
    assert rows["knee_angle"].beyond_left is not None
    assert any("prosthesis" in each for each in two.cannot)
    assert any("How fast" in each for each in one.cannot)
    written(patients, tmp_path)
    folder = write_pages(patients, None, tmp_path) / "P2"
    text = (folder / "patient.html").read_text(encoding="utf-8")
    for words in ("The right leg is a prosthesis", "90 % interval", "spastic"):
        assert words in text
    assert PatientResult.model_validate(read_json(folder / "patient.json")) == two
    assert (folder / "values.csv").read_text().startswith("name,value,low,high,norm")
    assert (tmp_path / "table.csv").read_text().splitlines()[2] == (
        "P2,subjects/P2.toml,kinematics,false"
    )


def test_two_measured_legs_may_change_places(strides_table, tmp_path):
    """The trunk stands on their mean, so a body in the mirror is the body's mirror image."""
    found = []
    for right, left in (("0.89", "0.84"), ("0.84", "0.89")):
        people = tmp_path / "people.csv"
        people.write_text(
            "ID,Sex,Age,Height (m),Mass (kg),Right leg length (m),Left leg length (m)\n"
            f"P2,F,30,1.65,60,{right},{left}\n",
            encoding="utf-8",
        )
        (two,) = found_patients(strides_table, [people], only=["P2"])
        found.append(scale_subject(two.subject, symmetric=False).model)
    one, other = found
    for segment in one.segments:
        name = segment.name
        same = other[{"_r": name[:-2] + "_l", "_l": name[:-2] + "_r"}.get(name[-2:], name)]
        assert segment.mass == pytest.approx(same.mass)
        mirror = np.diag([1.0, -1.0, 1.0])
        np.testing.assert_allclose(segment.inertia, mirror @ same.inertia @ mirror, atol=1e-12)
        np.testing.assert_allclose(segment.centre_of_mass, mirror @ same.centre_of_mass, atol=1e-12)


def test_what_is_not_recorded_widens_what_rests_on_it(strides_table, tmp_path):
    tall, guessed = (
        EstimatedValue(1.70, 0.0, "recorded"),
        EstimatedValue(1.70, 0.09, "the mean of adults"),
    )
    assert leg_length(tall, None).value == leg_length(guessed, None).value
    known, wide = leg_length(tall, None).sd, leg_length(guessed, None).sd
    assert wide == pytest.approx(np.hypot(known, leg_length(tall, None).value * 0.09 / 1.70))
    (one,) = found_patients(strides_table, [], only=["P2"])
    mass, height = one.estimates["mass"], one.estimates["height"]
    assert mass.sd / mass.value > 2.0 * height.sd / height.value


def test_a_speed_that_was_given_is_not_called_recorded(strides_table, people_table):
    """`--speed` may be that of a whole group."""
    (one,) = found_patients(strides_table, [people_table], ["P2=0.8"], only=["P2"])
    assert one.estimates["speed"] == EstimatedValue(0.8, 0.0, "given")


def test_lengths_by_stature_are_not_taken_for_those_of_markers(strides_table, people_table):
    (one,) = found_patients(strides_table, [people_table], only=["P1_off"])
    assert measured_by(one.subject)["thigh_length"] == "stature"
    assert one.subject.tape == {"hip_height": load_subject("5").leg_length_m}


def test_the_side_of_an_unnamed_state_holds_for_every_state(strides_table, tmp_path):
    people = tmp_path / "people.csv"
    people.write_text("ID,Sex,Affected side\nP1,M,Left\n", encoding="utf-8")
    (one,) = found_patients(strides_table, [people], only=["P1_off"])
    assert one.affected == "left"


def test_two_people_who_would_be_one_are_refused(tmp_path):
    rows = stride_rows("5", "well", "P 1") + stride_rows("2", "ill", "P.1")
    table = write_strides(tmp_path / "strides.csv", rows)
    with pytest.raises(RecordError, match=r"P 1 of well and P\.1 of ill would both be P_1"):
        found_patients(table, [])
    assert len(found_patients(table, [], only=["ill"])) == 1


def test_tables_that_contradict_each_other_are_refused(strides_table, tmp_path):
    tables = []
    for name, mass in (("a", 80), ("b", 50), ("c", 80)):
        tables.append(tmp_path / f"{name}.csv")
        tables[-1].write_text(f"ID,Sex,Weight (kg)\nP2,F,{mass}\n", encoding="utf-8")
    with pytest.raises(RecordError, match=r"b\.csv: P2 is in an earlier --people table"):
        found_patients(strides_table, tables[:2])
    assert found_patients(strides_table, tables[::2], only=["P2"])[0].subject.mass_kg == 80.0


@pytest.mark.parametrize(
    ("cells", "lacking"),
    [
        ("9,,", "no height and no mass"),
        ("9,,28", "no height"),
        ("9,1.32,", "no mass"),
        ("40,,", None),
        ("9,1.32,28", None),
    ],
)
def test_a_child_is_not_estimated_from_adults(tmp_path, strides_table, cells, lacking):
    table = tmp_path / "people.csv"
    table.write_text(f"Subject,Age,Height,Mass\nP1,{cells}\n", encoding="utf-8")
    if lacking is None:
        assert found_patients(strides_table, [table], [], [])
        return
    with pytest.raises(SubjectError, match=rf"P1\w*: 9 years old, and {lacking}: "):
        found_patients(strides_table, [table], [], [])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("amputee=0.8", "amputee is no group .* Give WHO=M/S, with one of ill, well, P1_off"),
        ("P2=quick", "quick is no speed. Give WHO=M/S, such as P2=1.1"),
        ("P2=80", r"80 m/s is no walking speed \(above 0, below 3\)"),
    ],
)
def test_a_speed_that_cannot_be_used_says_which_part_of_it(
    strides_table, people_table, text, message
):
    with pytest.raises(ConfigurationError, match=message):
        found_patients(strides_table, [people_table], [text], [])


@pytest.mark.parametrize("beyond", [-3.0, 3.0])
def test_a_curve_on_either_side_of_the_norm_is_beyond_it(patients, beyond):
    norm = norms(patients[0].subject)["angles/hip_flexion"]
    curves = patients[0].strides.angles | {"hip_flexion_r": norm.mean + beyond * norm.sd}
    moved = replace(patients[0], strides=replace(patients[0].strides, angles=curves))
    (row,) = [row for row in result_of(moved, None).angles if row.name == "hip_flexion"]
    assert row.beyond_right == 100.0
