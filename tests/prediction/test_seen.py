"""What markers say of expected forces: contacts, and the total of both feet."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.coordinates import SIDES
from gaitval.datasets.stored_gait import StanceFraction
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.gait.record import FittedCurve, Force, GaitRecord
from gaitval.prediction.population import with_others_kinetics
from gaitval.prediction.seen import (
    DIRECTIONS,
    SAMPLES,
    _slow,
    at_own_contacts,
    contacts,
    knows_contacts,
    speeds_beyond,
    with_total,
)

PHASE = np.arange(400) / 400


def curve(mean: float, cosine: tuple[float, ...], sine: tuple[float, ...]) -> FittedCurve:
    return FittedCurve(mean=mean, cosine=cosine, sine=sine, residual=0.0)


TOTAL = Force(
    forward=curve(0.0, (0.0, 0.1), (0.0, 0.0)),
    left=curve(0.0, (0.03, 0.0), (0.05, 0.0)),
    up=curve(1.0, (0.02, 0.2), (-0.01, -0.1)),
)


@pytest.fixture(scope="module")
def known() -> Subject:
    """Somebody elsewhere without plates, by markers 0.66 and 0.62 of the cycle on their feet."""
    subject = load_subject("S05")
    gait = subject.gait.model_copy(update={"moments": {}, "forces": None})
    return subject.model_copy(
        update={
            "laboratory": "elsewhere",
            "gait": gait,
            "stance_fraction": StanceFraction(right=0.66, left=0.62),
        }
    )


@pytest.fixture(scope="module")
def usual(known: Subject) -> GaitRecord:
    return with_others_kinetics(known, builtin_subjects())


def moved(subject: Subject, total: Force | None) -> Subject:
    return subject.model_copy(
        update={"gait": subject.gait.model_copy(update={"total_force": total})}
    )


def total_of(record: GaitRecord) -> np.ndarray:
    own = {"right": PHASE, "left": (PHASE - record.left_phase) % 1.0}
    return sum(record.ground_reaction(side, own[side]) for side in SIDES)


def test_feet_leave_when_the_person_s_do(usual: GaitRecord, known: Subject) -> None:
    record = at_own_contacts(usual, known)
    assert record.stance_fraction == {"right": 0.66, "left": 0.62}
    assert record.angles == usual.angles
    for side, stance in record.stance_fraction.items():
        force = record.ground_reaction(side, [stance / 2, stance - 0.01])[:, 2]
        assert force[0] > 0.5
        assert force[1] < 0.2
        # Between the landing of the other foot and its own end a curve is stretched.
        lands = known.left_phase if side == "right" else 1.0 - known.left_phase
        before = 0.5 + 0.5 * (usual.stance_fraction[side] - 0.5)
        after = lands + 0.5 * (stance - lands)
        name = f"ankle_angle_{side[0]}"
        assert record.moments[name](after) == pytest.approx(usual.moments[name](before), abs=0.02)


def test_what_plates_recorded_is_held_out(usual: GaitRecord) -> None:
    assert at_own_contacts(usual, load_subject("S05")) is usual
    one = load_subject("S05").model_copy(
        update={"stance_fraction": StanceFraction(right=0.6, left=None)}
    )
    assert at_own_contacts(usual, one) is usual


def test_steps_without_double_support_are_left_as_they_are(
    usual: GaitRecord, known: Subject
) -> None:
    short = known.model_copy(update={"stance_fraction": StanceFraction(right=0.45, left=0.45)})
    assert at_own_contacts(usual, short) is usual
    limping = with_total(replace(usual, left_phase=0.3), moved(known, TOTAL))
    for side in SIDES:
        assert np.isfinite(limping.ground_reaction(side, PHASE)).all()


def test_contacts_of_a_limp_are_where_each_foot_lands_and_leaves(usual: GaitRecord) -> None:
    """The left foot lands at 0.42 of the right cycle and leaves at 1.04, the right one at 0.66."""
    limp = replace(usual, left_phase=0.42, stance_fraction={"right": 0.66, "left": 0.62})
    np.testing.assert_allclose(contacts(limp, "right"), [0.0, 0.04, 0.42, 0.66, 1.0])
    np.testing.assert_allclose(contacts(limp, "left"), [0.0, 0.24, 0.58, 0.62, 1.0])


@pytest.mark.parametrize(
    ("right", "left", "both"),
    [(0.66, 0.62, True), (0.66, 0.57, False), (0.43, 0.62, False), (0.66, 0.61, True)],
)
def test_both_feet_must_carry_twice_in_a_cycle(
    known: Subject, right: float, left: float, both: bool
) -> None:
    """The left foot lands at 0.42: until then the right one stands, and the left one until 1."""
    gait = known.gait.model_copy(update={"left_phase": 0.42})
    update = {"gait": gait, "stance_fraction": StanceFraction(right=right, left=left)}
    limp = known.model_copy(update={**update, "left_phase": 0.42})
    assert limp.left_phase == 0.42
    assert knows_contacts(limp) is both


def test_what_is_slower_than_5_hz_is_kept_without_its_mean() -> None:
    """Of strides of 1.1 s the fifth wave has 4.5 Hz and the sixth 5.5 Hz."""
    angle = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    slow, fast = np.sin(5.0 * angle), np.cos(6.0 * angle)
    found = _slow(np.stack([1.0 + slow + fast, fast, slow], axis=1), 1.1)
    np.testing.assert_allclose(found, np.stack([slow, 0.0 * fast, slow], axis=1), atol=1e-12)


@pytest.mark.parametrize("left_phase", [None, 0.44])
def test_the_total_is_that_of_the_centre_of_mass(
    usual: GaitRecord, known: Subject, left_phase: float | None
) -> None:
    record = at_own_contacts(usual, known)
    if left_phase is not None:
        record = replace(record, left_phase=left_phase)
    found = with_total(record, moved(known, TOTAL))
    wanted = np.stack(
        [each.periodic()(PHASE) for each in (TOTAL.forward, TOTAL.left, TOTAL.up)], axis=1
    )
    before, after = total_of(record), total_of(found)
    for axis, taken in enumerate(DIRECTIONS):
        slow = np.fft.rfft(np.stack([before, after, wanted])[:, :, axis])[:, 1:5]
        asked = (1.0 - taken) * slow[0] + taken * slow[2]
        assert np.abs(slow[1] - asked).max() / len(PHASE) < 0.004
    assert after[:, 2].mean() == pytest.approx(before[:, 2].mean(), abs=0.005)
    # a foot in the air carries nothing of it
    for side in SIDES:
        swing = np.linspace(found.stance_fraction[side] + 0.01, 0.99, 20)
        assert not found.ground_reaction(side, swing).any()


def test_a_walk_the_other_way_round_is_the_mirror_image(usual: GaitRecord, known: Subject) -> None:
    """Left and right are treated alike: half a cycle later the sideways force has changed sign."""
    even = replace(usual, left_phase=0.5)
    flipped = Force(
        forward=TOTAL.forward,
        left=curve(0.0, (0.03, 0.0), (0.05, 0.0)),
        up=curve(1.0, (-0.02, 0.2), (0.01, -0.1)),
    )
    one = with_total(even, moved(known, TOTAL))
    other = with_total(even, moved(known, flipped))
    right, left = one.ground_reaction("right", PHASE), other.ground_reaction("left", PHASE)
    assert left * [1.0, -1.0, 1.0] == pytest.approx(right, abs=0.01)


def test_nothing_known_or_a_crutch_that_carries_changes_nothing(
    usual: GaitRecord, known: Subject
) -> None:
    assert with_total(usual, known) is usual
    aided = moved(known, TOTAL).model_copy(update={"aid": "crutches"})
    assert with_total(usual, aided) is usual


def test_it_is_kept_in_the_file(known: Subject, tmp_path) -> None:
    moved(known, TOTAL).save(tmp_path / "known.toml")
    again = load_subject(str(tmp_path / "known.toml"))
    assert again.gait.total_force == TOTAL


@pytest.mark.parametrize(("speed", "beyond"), [(0.3, True), (1.1, False), (1.9, True)])
def test_a_walk_beyond_the_speeds_that_are_learned_from_is_known(speed, beyond):
    person = load_subject("S05").model_copy(update={"walking_speed_m_s": speed})
    found = speeds_beyond(person)
    assert (found is not None) == beyond
    if found:
        others = [s for s in builtin_subjects() if s.person != person.person]
        legs = np.sqrt(person.leg_length_m / np.array([s.leg_length_m for s in others]))
        own = legs * [s.walking_speed_m_s for s in others]
        assert found[0] <= own.min() < own.max() <= found[1]
