"""What the model is told of a patient: angles and timing, and the kinetics to expect.

Moments and forces are those that healthy people have at this speed (`prediction.population`), but
over this person's own stance: a sound leg that stands for 67 % of its cycle is loaded for as long.
Nothing of it is symmetric that the person is not.
The ankle's moment follows the ankle's own landmarks (`registered_ankle`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.datasets.subject import Subject
from gaitval.gait.mean_curves import FORCE_TOLERANCE
from gaitval.gait.record import GaitRecord, PeriodicCurve, fit_periodic, periodic_through
from gaitval.prediction.normal_form import record_from, symmetric
from gaitval.prediction.population import expected, other_people, with_others_kinetics
from gaitval.prediction.speed_line import dimensionless_speed

SAMPLES = 200
HARMONICS = 40
PUSH_OFF = (0.3, 0.7)
"""Of the cycle, within which the ankle of a standing leg is turned furthest."""


def told_record(subject: Subject, others: Sequence[Subject]) -> GaitRecord:
    """The record of `subject` without kinetics, with those to expect from `others`."""
    usual = expected_record(subject, others)
    told = with_others_kinetics(subject, others)
    record = over_stance(told, subject.stance_fraction.of_both())
    moments = dict(record.moments)
    for side in SIDES:
        moments[f"ankle_angle_{side[0]}"] = registered_ankle(record, usual, side)
    return replace(record, moments=moments)


def expected_record(subject: Subject, others: Sequence[Subject]) -> GaitRecord:
    """The whole gait to expect of anybody at the speed of `subject`, angles included."""
    people = other_people(subject, others)
    gait = symmetric(expected(people, dimensionless_speed(subject)))
    return record_from(gait, subject.leg_length_m)


def most_dorsiflexed(angle: PeriodicCurve, stance: float) -> float:
    """Phase at which a loaded ankle is turned furthest, before the foot leaves at `stance`."""
    phase = np.arange(SAMPLES) / SAMPLES
    loaded = (phase > PUSH_OFF[0]) & (phase < min(stance, PUSH_OFF[1]))
    return float(phase[loaded][np.argmax(angle(phase[loaded]))])


def registered_ankle(record: GaitRecord, usual: GaitRecord, side: Side) -> PeriodicCurve:
    """The ankle moment of a `usual` gait in the time of the ankle of `record` on a `side`.

    Calf or spring pulls hardest where the ankle is turned furthest, so the moment's curve is
    stretched between three landmarks: heel strike, largest dorsiflexion, toe-off (registration of
    curves: Sadeghi et al. 2003, J Biomech 36:1057, from memory).
    """
    name, stance = f"ankle_angle_{side[0]}", record.stance_fraction[side]
    before = usual.stance_fraction[side]
    phase = np.arange(SAMPLES) / SAMPLES
    here = [0.0, most_dorsiflexed(record.angles[name], stance), stance, 1.0]
    there = [0.0, most_dorsiflexed(usual.angles[name], before), before, 1.0]
    return periodic_through(usual.moments[name](np.interp(phase, here, there)), HARMONICS)


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
        fits = [fit_periodic(on, each, FORCE_TOLERANCE)[0] for each in rows.T]
        series[side] = (fits[0], fits[1], fits[2])
    return replace(record, stance_fraction=dict(stance), moments=moments, forces=series)
