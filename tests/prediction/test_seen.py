"""What markers say of expected forces: contacts, and the total of both feet."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.coordinates import SIDES
from gaitval.gait.dimensionless import speed_unit
from gaitval.gait.record import FittedCurve, Force, GaitRecord, PeriodicCurve, periodic_through
from gaitval.study.estimate_stage import _seen
from gaitval.subjects.prediction.deviations import KINETICS, SAGITTAL, kinetics_of
from gaitval.subjects.prediction.estimate import WIDER_ELSEWHERE, WIDER_WITH_TOTAL, Estimate
from gaitval.subjects.prediction.force_split import (
    _OF_FORCES,
    CONTACT_TIMES,
    NOISE,
    SPLIT,
    _before_total,
    _typical,
    angles_at_contacts,
    at_contacts,
    covariance,
    difference,
    forces_elsewhere,
    with_total,
)
from gaitval.subjects.prediction.normal_form import SAMPLES, normal_form
from gaitval.subjects.prediction.population import (
    expected_record,
    other_people,
    with_others_kinetics,
)
from gaitval.subjects.prediction.seen import (
    at_own_contacts,
    contacts,
    knows_contacts,
    speeds_beyond,
)
from gaitval.subjects.stored_gait import StanceFraction
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_subjects, load_subject

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


def total_of(record: GaitRecord, later: float = 0.0) -> np.ndarray:
    when = (PHASE + later) % 1.0
    own = {"right": when, "left": (when - record.left_phase) % 1.0}
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


@pytest.mark.parametrize("left_phase", [None, 0.44])
def test_the_total_is_near_that_of_the_centre_of_mass(
    usual: GaitRecord, known: Subject, left_phase: float | None
) -> None:
    record = at_own_contacts(usual, known)
    if left_phase is not None:
        record = replace(record, left_phase=left_phase)
    # as much as anybody's total is off
    lacks = Force(
        forward=curve(0.0, (0.0, 0.02), (0.01, 0.0)),
        left=curve(0.0, (0.01, 0.0), (-0.01, 0.0)),
        up=curve(0.0, (0.01, -0.04), (0.0, 0.03)),
    )
    each = (lacks.forward, lacks.left, lacks.up)
    wanted = total_of(record) + np.stack([c.periodic()(PHASE) for c in each], axis=1)
    found = with_total(record, moved(known, forces_through(wanted)))
    kept = slice(1, int(SPLIT.highest_hz * record.stride_time))
    before, after, asked = (
        np.fft.rfft(values, axis=0)[kept] * 2.0 / len(PHASE)
        for values in (total_of(record), total_of(found), wanted)
    )
    for axis, noise in enumerate(NOISE):
        assert np.abs(before - asked)[:, axis].max() > 1.3 * noise
        assert np.sqrt(np.mean(np.abs(after - asked)[:, axis] ** 2)) < noise
    # a foot in the air carries nothing of it
    for side in SIDES:
        swing = np.linspace(found.stance_fraction[side] + 0.01, 0.99, 20)
        assert not found.ground_reaction(side, swing).any()


def forces_through(total: np.ndarray) -> Force:
    """A subject's total force, of `total` (400, 3)."""
    waves = np.fft.rfft(total, axis=0)[:12] * 2.0 / len(total)
    return Force(
        **{
            name: curve(0.5 * w[0].real, tuple(w[1:].real), tuple(-w[1:].imag))
            for name, w in zip(("forward", "left", "up"), waves.T, strict=True)
        }
    )


def test_forces_come_later_than_the_motion_says(usual: GaitRecord, known: Subject) -> None:
    record = at_own_contacts(usual, known)
    early = forces_through(total_of(record, 0.02 / record.stride_time))
    off = []
    for late in (0.02, 0.0):
        elsewhere = forces_elsewhere()._replace(late=late)
        found = with_total(record, moved(known, early), elsewhere, angles=False)
        off.append(np.std(total_of(found) - total_of(record)))
    assert off[0] < 0.5 * off[1]


def leg_angles(record: GaitRecord) -> list[tuple[str, PeriodicCurve]]:
    return [(n, c) for n, c in record.angles.items() if n[:-2] in SAGITTAL]


def test_angles_say_of_forces_what_people_s_say(usual: GaitRecord, known: Subject) -> None:
    """Where people whose right knee bends more push more, who bends it more pushes more."""
    expected = replace(expected_of(known), left_phase=0.5)
    bent = 0.1 * np.sin(2.0 * np.pi * PHASE)
    knee = periodic_through((expected.angles["knee_angle_r"](PHASE) + bent), 20)
    record = replace(expected, angles={**expected.angles, "knee_angle_r": knee})
    legs = known.leg_length_m
    shape = (angles_at_contacts(record) - angles_at_contacts(expected)).reshape(2, -1)
    shape = np.pad(shape, ((0, 0), (0, 3)))  # the walk is as others'
    push = np.zeros((2, _OF_FORCES))
    push[1, 5] = 0.2  # of the other foot
    one = np.concatenate([push, shape], axis=1).ravel()
    every = 1e-8 * np.eye(one.size)  # nobody is quite alike
    others = np.outer(one, one) + every
    found = _before_total(record, expected, legs, others)
    most = int(np.argmax(found.mean))
    assert most == _OF_FORCES + 5
    assert found.mean[most] == pytest.approx(0.2, rel=0.2)
    assert found.spread[most, most] < 0.3 * 0.2**2
    none = _before_total(record, expected, legs, others, angles=False)
    assert not none.mean.any()
    assert none.spread[most, most] > 0.9 * 0.2**2
    # nor does it where they do not
    apart = np.concatenate([push, 0.0 * shape], axis=1).ravel()
    alone = np.concatenate([0.0 * push, shape], axis=1).ravel()
    spread = np.outer(apart, apart) + np.outer(alone, alone) + every
    neither = _before_total(record, expected, legs, spread)
    assert abs(neither.mean[most]) < 0.02


def test_rhythm_speed_and_size_say_of_forces_what_people_s_say(known: Subject) -> None:
    """Where people with longer legs push more, who has longer legs pushes more; far beyond all
    people no more than at the end of what is known of them.
    """
    expected, (speed, usual_legs) = expected_of(known), _typical()

    def walk(longer: float) -> tuple[GaitRecord, float]:
        legs = usual_legs + longer
        return replace(expected, speed=speed * speed_unit(legs)), legs

    differs = difference(walk(0.1)[0], expected, walk(0.1)[1])[:, _OF_FORCES:]
    assert differs == pytest.approx(np.tile([0.0] * (differs.shape[1] - 1) + [0.1], (2, 1)))
    people = np.pad(differs, ((0, 0), (_OF_FORCES, 0)))
    people[0, 5] = 0.02  # up, of the right foot
    spread = np.outer(people, people) + 1e-8 * np.eye(people.size)
    pushes = []
    for longer in (0.1, -0.1, 0.3, 3.0):
        record, legs = walk(longer)
        found = _before_total(record, expected, legs, spread)
        pushes.append(float(found.mean[5]))
    assert pushes[0] == pytest.approx(0.02, rel=0.3)
    assert pushes[1:] == pytest.approx([-pushes[0], 3.0 * pushes[0], 3.0 * pushes[0]])


def expected_of(person: Subject) -> GaitRecord:
    return expected_record(person, other_people(person, builtin_subjects()))


def test_the_total_says_how_people_s_feet_share_it(usual: GaitRecord, known: Subject) -> None:
    """In double support, of people whose forces differ as people's do. With the total and no
    knowledge of how people share it out, forces are 0.78 as far off as what is expected.
    """
    record = at_own_contacts(usual, known)
    values, directions = np.linalg.eigh(covariance(known.person, forces_elsewhere().spread))
    rng = np.random.default_rng(84)
    errors = []
    for _ in range(4):
        drawn = directions @ (np.sqrt(np.maximum(values, 0.0)) * rng.normal(size=len(values)))
        differs = drawn.reshape(2, -1)[:, :_OF_FORCES].reshape(2, -1, 3)
        truth = at_contacts(record) + differs
        total = np.zeros((len(PHASE), 3))
        for i, (side, to_midline) in enumerate(zip(SIDES, (1.0, -1.0), strict=True)):
            own = (PHASE - (record.left_phase if side == "left" else 0.0)) % 1.0
            on = contacts(record, side)[:4]
            when = np.interp(own, on, np.arange(4))
            force = [np.interp(when, CONTACT_TIMES, truth[i, :, c]) for c in range(3)]
            total += np.stack(force, axis=1) * [1.0, to_midline, 1.0] * (own <= on[3])[:, None]
        person = moved(known, forces_through(total))
        found = at_contacts(with_total(record, person, angles=False))
        both = (CONTACT_TIMES < 1.0) | (CONTACT_TIMES > 2.0)
        off = [
            np.sqrt(np.mean(np.square(e - truth)[:, both, 2])) for e in (at_contacts(record), found)
        ]
        errors.append(off)
    before, after = np.mean(errors, axis=0)
    assert after < 0.66 * before


@pytest.mark.parametrize("total", [TOTAL, None])
def test_where_the_total_is_known_mechanics_adds_nothing_to_forces(
    usual: GaitRecord, known: Subject, total: Force | None
) -> None:
    subject = moved(known, total)
    expected = kinetics_of(normal_form(usual, subject.leg_length_m))
    none, wide = np.zeros_like(expected), np.ones((len(KINETICS), SAMPLES))
    bare, found = (
        _seen(
            Estimate(
                expected, expected, wide, np.full_like(wide, share), none, none + 0.1, False, none
            ),
            usual,
            subject,
            None,
        )
        for share in (0.0, 0.5)
    )
    adds = (found.kinetics - bare.kinetics).mean(axis=(0, 2))
    for added, width, (kind, _), less, more in zip(
        adds, found.half_width[:, 0], KINETICS, WIDER_WITH_TOTAL, WIDER_ELSEWHERE, strict=True
    ):
        knows = total is not None
        assert added == pytest.approx(0.0 if knows and kind == "forces" else 0.05, abs=1e-9)
        assert width == pytest.approx(less[0] / more[0] if knows else 1.0)


def test_other_laboratories_right_and_left_differ_alike() -> None:
    pooled = forces_elsewhere().spread
    half = len(pooled) // 2
    assert pooled[:half, :half] == pytest.approx(pooled[half:, half:], abs=2e-5)
    # up, in early stance, by more than the unit of the file and less than half a body weight
    assert 1e-3 < np.sqrt(pooled[3 * 8 + 2, 3 * 8 + 2]) < 0.5


def test_a_walk_the_other_way_round_is_the_mirror_image(usual: GaitRecord, known: Subject) -> None:
    """Left and right are treated alike: half a cycle later the sideways force has changed sign."""
    even = replace(usual, left_phase=0.5)
    other_legs = {name[:-1] + {"r": "l", "l": "r"}[name[-1]]: c for name, c in leg_angles(even)}
    turned = replace(even, angles={**even.angles, **other_legs})
    flipped = Force(
        forward=TOTAL.forward,
        left=curve(0.0, (0.03, 0.0), (0.05, 0.0)),
        up=curve(1.0, (-0.02, 0.2), (0.01, -0.1)),
    )
    one = with_total(even, moved(known, TOTAL))
    other = with_total(turned, moved(known, flipped))
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
