"""What the model knows of a patient: angles and timing, and the kinetics to expect.

Moments and forces are those that healthy people have at this speed
(`subjects.prediction.population`), but over this person's own stance: a sound leg that stands for
67 % of its cycle is loaded for as long. Nothing of it is symmetric that the person is not. An
ankle's moment is in the time of its own foot: when its heel rises and the other foot lands
(`rolled_ankle`), or, of a foot without a calf, when it is bent furthest (`bent_ankle`). Beside a
foot without a calf, the other ankle's is larger than healthy people's (`sound_side`), and goes with
its angle as theirs do (`subjects.prediction.ankles`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitval.apps.patients.rolling_foot import POINTS, leg_frames
from gaitval.apps.patients.sound_side import expected_of, rest_of
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.gait.mean_curves import TOLERANCES
from gaitval.gait.record import GaitRecord, PeriodicCurve, fit_periodic, periodic_through
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.subjects.prediction.ankles import ankle_moment
from gaitval.subjects.prediction.deviations import KINETICS, units
from gaitval.subjects.prediction.estimate import ESTIMATE
from gaitval.subjects.prediction.normal_form import record_from, symmetric
from gaitval.subjects.prediction.population import expected, other_people, with_others_kinetics
from gaitval.subjects.prediction.speed_line import dimensionless_speed
from gaitval.subjects.subject import Subject

SAMPLES = 200
HARMONICS = 40
RISEN = float(np.radians(5.0))
"""rad. From 3 to 6 degrees `rolled_ankle` is equally near in the ten (0.083 to 0.086 Nm/kg), and
with 8 less (0.091)."""


class StancePhases(NamedTuple):
    """When in the cycle a foot does what, of the cycle.

    Attributes
    ----------
    push_off : within which the ankle of a standing leg is turned furthest.
    flat : in which the foot lies on the ground, between foot flat and the earliest heel rise of
        healthy people (Perry 1992, from memory: 12 and 31 %).
    mid_stance : before it no heel rises, even that of someone who vaults.
    shortest : between two landmarks: a curve is not stretched beyond measure.
    """

    push_off: tuple[float, float]
    flat: tuple[float, float]
    mid_stance: float
    shortest: float


STANCE = StancePhases(push_off=(0.3, 0.7), flat=(0.15, 0.30), mid_stance=0.2, shortest=0.02)


def known_record(
    subject: Subject, others: Sequence[Subject], model: BodyModel, amputation: Side | None = None
) -> GaitRecord:
    """The record of `subject` without kinetics, with those to expect from `others`, both as
    `subjects.prediction.population.with_others_kinetics` takes them. `model` is the body, to which
    the angles say where its feet are; `amputation` is the side whose ankle has no calf.
    """
    usual = expected_record(subject, others)
    known = with_others_kinetics(subject, others)
    record = over_stance(known, subject.stance_fraction.of_both())
    moments, phase = dict(record.moments), np.arange(SAMPLES) / SAMPLES
    for side in SIDES:
        if side == amputation:
            ankle = bent_ankle(record, usual, side)
        elif amputation is None:
            ankle = rolled_ankle(record, usual, side, model)
        else:
            larger = expected_of(subject.identifier).larger
            moment = sound_ankle(subject, record, usual, side, model, larger)
            rest = np.interp(phase, np.linspace(0.0, 1.0, 101), rest_of(subject.identifier))
            ankle = periodic_through(moment(phase) + rest, HARMONICS)
        moments[f"ankle_angle_{side[0]}"] = ankle
    return replace(record, moments=moments)


def expected_record(subject: Subject, others: Sequence[Subject]) -> GaitRecord:
    """The whole gait to expect of anybody at the speed of `subject`, angles included."""
    people = other_people(subject, others)
    gait = symmetric(expected(people, dimensionless_speed(subject)))
    return record_from(gait, subject.leg_length_m)


def most_dorsiflexed(angle: PeriodicCurve, stance: float) -> float:
    """Phase at which a loaded ankle is turned furthest, before the foot leaves at `stance`."""
    phase = np.arange(SAMPLES) / SAMPLES
    loaded = (phase > STANCE.push_off[0]) & (phase < min(stance, STANCE.push_off[1]))
    return float(phase[loaded][np.argmax(angle(phase[loaded]))])


def bent_ankle(record: GaitRecord, usual: GaitRecord, side: Side) -> PeriodicCurve:
    """The ankle moment of a `usual` gait in the time of the ankle of `record` on a `side`.

    A spring pulls hardest where it is bent furthest, so the moment's curve is stretched between
    heel strike, largest dorsiflexion and toe-off (registration of curves: Sadeghi et al. 2003,
    J Biomech 36:1057, from memory).
    """
    name, stance = f"ankle_angle_{side[0]}", record.stance_fraction[side]
    before = usual.stance_fraction[side]
    return _stretched(
        usual.moments[name],
        [most_dorsiflexed(record.angles[name], stance), stance],
        [most_dorsiflexed(usual.angles[name], before), before],
    )


def rolled_ankle(
    record: GaitRecord, usual: GaitRecord, side: Side, model: BodyModel
) -> PeriodicCurve:
    """The ankle moment of a `usual` gait in the time in which the foot of `record` on a `side`
    rolls off.

    A foot whose heel is off the ground carries the body on its ball, so the lever is as long as it
    becomes; the load lasts until the other foot lands, and ends at toe-off. The moment's curve is
    stretched between these. So someone who rises on the toes of the sound leg to swing a prosthesis
    through (vaulting; Drevelle et al. 2014, Clin Biomech 29:679, from memory) has a moment that
    comes early and stays. In the ten built-in people it is 0.085 Nm/kg off, and 0.097 by the
    landmarks of `bent_ankle`.
    """
    found = []
    for each in (record, usual):
        stance = each.stance_fraction[side]
        lands = each.left_phase if side == "right" else 1.0 - each.left_phase
        rises = min(heel_rise(each, side, model), lands - STANCE.shortest)
        found.append([rises, min(lands, stance - STANCE.shortest), stance])
    return _stretched(usual.moments[f"ankle_angle_{side[0]}"], *found)


def sound_ankle(
    subject: Subject,
    record: GaitRecord,
    usual: GaitRecord,
    side: Side,
    model: BodyModel,
    larger: float,
) -> PeriodicCurve:
    """The moment of the ankle on the sound `side` of an amputee: `rolled_ankle`, `larger` by a
    factor, and half of what the ankle's angle says of it in other people
    (`subjects.prediction.ankles`).
    """
    phase, cycle = np.arange(SAMPLES) / SAMPLES, np.arange(101) / 100.0
    angle = record.angles[f"ankle_angle_{side[0]}"](cycle[:-1])
    change = ankle_moment(angle[None], dimensionless_speed(subject), {subject.person}).change[0]
    unit = float(units(subject.leg_length_m)[KINETICS.index(("moments", "ankle_angle")), 0])
    moment = larger * rolled_ankle(record, usual, side, model)(phase)
    moment += ESTIMATE.ankle_share * unit * np.interp(phase, cycle, np.append(change, change[0]))
    return periodic_through(moment, HARMONICS)


def heel_rise(record: GaitRecord, side: Side, model: BodyModel) -> float:
    """Phase of a side's own cycle at which its foot has turned by `RISEN` from where it lies flat;
    toe-off if it never does.
    """
    frames = leg_frames(record.angles, record.left_phase, model, side)
    forward = frames[:, SEGMENTS.index(f"foot_{side[0]}"), :, 0]
    pitch = -np.arcsin(np.clip(forward[:, 2], -1.0, 1.0))
    phase = np.arange(POINTS) / POINTS
    flat = (phase > STANCE.flat[0]) & (phase < STANCE.flat[1])
    stance = record.stance_fraction[side]
    up = (phase > STANCE.mid_stance) & (phase < stance) & (pitch > np.median(pitch[flat]) + RISEN)
    return float(phase[np.argmax(up)]) if up.any() else stance


def _stretched(
    moment: PeriodicCurve, here: Sequence[float], there: Sequence[float]
) -> PeriodicCurve:
    """`moment` with what is at the phases `there` moved to those `here`."""
    phase = np.arange(SAMPLES) / SAMPLES
    return periodic_through(
        moment(np.interp(phase, [0.0, *here, 1.0], [0.0, *there, 1.0])), HARMONICS
    )


def warped(phase: Array, stance: float, expected: float) -> Array:
    """Phase of a cycle with a stance fraction `expected` at the same share of stance or swing as
    `phase` (n,) in 0…1 of one with `stance`.
    """
    swing = expected + (phase - stance) / (1.0 - stance) * (1.0 - expected)
    return np.where(phase <= stance, phase * expected / stance, swing)


def over_stance(record: GaitRecord, stance: Mapping[Side, float]) -> GaitRecord:
    """`record` with moments and forces stretched to another `stance` of each side; the forces keep
    a mean of one body weight.
    """
    phase = np.arange(SAMPLES) / SAMPLES
    moments = dict(record.moments)
    forces = {}
    level = 0.0
    for side in SIDES:
        before = record.stance_fraction[side]
        at = warped(phase, stance[side], before)
        for name in record.moments:
            if name.endswith(f"_{side[0]}"):
                moments[name] = periodic_through(record.moments[name](at), HARMONICS)
        on = phase[phase <= stance[side]]
        values = record.ground_reaction(side, np.minimum(warped(on, stance[side], before), before))
        rows = np.concatenate([values, values[:1]])
        level += float(np.sum(values[:, 2])) / SAMPLES
        forces[side] = (np.append(on, 1.0), rows)
    series: dict[Side, tuple[PeriodicCurve, PeriodicCurve, PeriodicCurve]] = {}
    for side, (on, rows) in forces.items():
        rows = rows * np.array([1.0, 1.0, 1.0 / level])
        fits = [fit_periodic(on, each, TOLERANCES.force_tolerance)[0] for each in rows.T]
        series[side] = (fits[0], fits[1], fits[2])
    return replace(record, stance_fraction=dict(stance), moments=moments, forces=series)
