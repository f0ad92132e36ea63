"""The sides of an amputee: later, and the sound one's ankle larger, than angles and healthy say."""

import numpy as np
import pytest

from experiments import sound_sides
from gaitval.apps.patients.cohort import found_patients
from gaitval.apps.patients.known_record import expected_record, known_record, sound_ankle
from gaitval.apps.patients.rolling_foot import STANCE_BIAS, feet
from gaitval.apps.patients.sound_side import (
    PROSTHETIC_RESTS,
    PROSTHETIC_TABLE,
    RESTS,
    TABLE,
    expected_of,
    later_of_prosthesis,
    prosthetic_rest_of,
    rest_of,
    rows_of,
)
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import builtin_subjects

PHASE = np.arange(200) / 200


@pytest.fixture(scope="module")
def table() -> dict[str, list[float]]:
    """By person, later and larger."""
    return table_of(TABLE)


def table_of(name: str) -> dict[str, list[float]]:
    lines = (sound_sides.FOLDER / name).read_text("utf-8").splitlines()
    rows = [line.split(",") for line in lines if not line.startswith("#")]
    return {row[0]: [float(each) for each in row[1:]] for row in rows[1:]}


@pytest.fixture(scope="module")
def amputee(strides_table, people_table):
    (found,) = found_patients(strides_table, [people_table], ["P1_off=1.1"], ["well"], ["P2"])
    assert found.person.amputation == "right"
    return found


@pytest.mark.parametrize("name", ["TF01", "TF18", "P2"])
def test_a_persons_own_figures_are_left_out(table, name):
    others = np.array([row for who, row in table.items() if who != name])
    assert len(others) == (len(table) if name == "P2" else len(table) - 1)
    found = expected_of(name)
    assert (found.later, found.larger) == pytest.approx(others.mean(axis=0))
    assert found.later_sd == pytest.approx(np.std(others[:, 0], ddof=1))


@pytest.mark.parametrize("name", ["TF01", "TF18", "P2"])
def test_nor_do_they_count_for_the_prosthetic_side(name):
    others = np.array([row[0] for who, row in table_of(PROSTHETIC_TABLE).items() if who != name])
    assert later_of_prosthesis(name) == pytest.approx((others.mean(), np.std(others, ddof=1)))


def test_both_feet_leave_the_ground_later_each_by_its_own(amputee):
    subject = amputee.subject
    model = scale_subject(subject, symmetric=False).model
    angles = subject.gait.angles_of_both()
    seen = feet(angles, subject.left_phase, model).stance
    usual, stance = expected_of("P2"), subject.stance_fraction
    later, sd = later_of_prosthesis("P2")
    assert 0.0 < later < usual.later
    assert stance.right == pytest.approx(seen["right"] + later)
    assert stance.left == pytest.approx(seen["left"] + usual.later)
    sound, amputated = (amputee.estimates[f"stance_{side}"] for side in ("left", "right"))
    assert amputated.sd == pytest.approx(np.hypot(STANCE_BIAS[1], sd))
    assert sound.sd == pytest.approx(np.hypot(STANCE_BIAS[1], usual.later_sd))


def test_what_is_left_of_others_is_half_expected_of_one():
    rests = table_of(RESTS)
    others = [row for who, row in rests.items() if who != "TF01"]
    assert len(others) == len(rests) - 1 == 11
    np.testing.assert_allclose(rest_of("TF01"), 0.5 * np.mean(others, axis=0), atol=1e-12)
    np.testing.assert_allclose(rest_of("P2"), 0.5 * np.mean([*rests.values()], axis=0), atol=1e-12)


def prosthetic_curves(kind: str) -> dict[str, np.ndarray]:
    return {
        row["person"]: np.array([float(row[f"p{each}"]) for each in range(101)])
        for row in rows_of(PROSTHETIC_RESTS)
        if row["curve"] == kind
    }


def test_a_prosthetic_ankle_s_rest_goes_with_its_angle():
    """Who bends it as another does has at most half of what his is off."""
    angles, rests = prosthetic_curves("angle"), prosthetic_curves("rest")
    assert len(angles) == len(rests) == 12
    usual, rest = (np.mean([*each.values()], axis=0) for each in (angles, rests))
    np.testing.assert_allclose(prosthetic_rest_of("P2", usual), 0.5 * rest, atol=1e-9)
    shares = []
    for name, angle in angles.items():
        own = rests[name] - rest
        change = prosthetic_rest_of("P2", angle) - 0.5 * rest
        shares.append(own @ change / (own @ own))
    assert 0.1 < np.mean(shares) < 0.5


def test_nobody_s_own_rest_is_read(monkeypatch):
    angle = prosthetic_curves("angle")["TF01"]
    found = prosthetic_rest_of("TF01", angle)
    rows = tuple(
        r | {"p40": "9"} if r["person"] == "TF01" else r for r in rows_of(PROSTHETIC_RESTS)
    )
    monkeypatch.setattr("gaitval.apps.patients.sound_side.rows_of", lambda _: rows)
    assert np.array_equal(prosthetic_rest_of("TF01", angle), found)
    assert not np.array_equal(prosthetic_rest_of("TF02", angle), found)


def test_only_the_sound_ankle_beside_a_prosthesis_is_as_amputees_have_it(amputee):
    subject, others = amputee.subject, builtin_subjects()
    model = scale_subject(subject, symmetric=False).model
    whole, right = (known_record(subject, others, model, side) for side in (None, "right"))
    for name, moment in whole.moments.items():
        found = right.moments[name](PHASE)
        if name == "ankle_angle_l":
            usual, larger = expected_record(subject, others), expected_of("P2").larger
            expected = sound_ankle(subject, whole, usual, "left", model, larger)(PHASE)
            expected += np.interp(PHASE, np.linspace(0.0, 1.0, 101), rest_of("P2"))
            assert np.allclose(found, expected, atol=0.003)  # both are Fourier series
            assert not np.allclose(found, larger * moment(PHASE), atol=0.02)
        elif name != "ankle_angle_r":
            assert np.allclose(found, moment(PHASE), atol=1e-9), name


def test_a_moment_ends_where_it_has_fallen_to_a_twentieth():
    """A triangle from 0 at 10 % through -1.5 at 50 % to 0 at 70 %."""
    corners = ([0.0, 0.1, 0.5, 0.7, 1.0], [0.0, 0.0, -1.5, 0.0, 0.0])
    moment = np.interp(sound_sides.PHASE, *corners)
    assert sound_sides.ends(moment) == pytest.approx(0.7 - 0.2 * sound_sides.ENDED)


@pytest.mark.slow  # of eighteen people, and they change with the data alone
def test_the_shipped_figures_are_those_of_the_data(gait_data):
    for name, make in (
        (TABLE, sound_sides.sound_sides),
        (PROSTHETIC_TABLE, sound_sides.prosthetic_sides),
        (RESTS, sound_sides.sound_rests),
        (PROSTHETIC_RESTS, sound_sides.prosthetic_rests),
    ):
        assert make(gait_data) == (sound_sides.FOLDER / name).read_text("utf-8")
