"""What the model knows of a patient: angles and timing, and the kinetics to expect.

Moments and forces are those that healthy people have at this speed
(`subjects.prediction.population`), but over this person's own stance: a sound leg that stands for
67 % of its cycle is loaded for as long. Nothing of it is symmetric that the person is not. An
ankle's moment is in the time of its own foot: when its heel rises and the other foot lands
(`rolled_ankle`). A prosthetic foot is taken for a sound one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitval.apps.patients.rolling_foot import POINTS, leg_frames
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.gait.mean_curves import TOLERANCES
from gaitval.gait.record import GaitRecord, PeriodicCurve, fit_periodic, periodic_through
from gaitval.model.body import SEGMENTS, BodyModel
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
    flat : in which the foot lies on the ground, between foot flat and the earliest heel rise of
        healthy people (Perry 1992, from memory: 12 and 31 %).
    mid_stance : before it no heel rises, even that of someone who vaults.
    shortest : between two landmarks: a curve is not stretched beyond measure.
    """

    flat: tuple[float, float]
    mid_stance: float
    shortest: float


STANCE = StancePhases(flat=(0.15, 0.30), mid_stance=0.2, shortest=0.02)


def known_record(subject: Subject, others: Sequence[Subject], model: BodyModel) -> GaitRecord:
    """The record of `subject` without kinetics, with those to expect from `others`, both as
    `subjects.prediction.population.with_others_kinetics` takes them. `model` is the body, to which
    the angles say where its feet are.
    """
    usual = expected_record(subject, others)
    known = with_others_kinetics(subject, others)
    record = over_stance(known, subject.stance_fraction.of_both())
    moments = dict(record.moments)
    for side in SIDES:
        moments[f"ankle_angle_{side[0]}"] = rolled_ankle(record, usual, side, model)
    return replace(record, moments=moments)


def expected_record(subject: Subject, others: Sequence[Subject]) -> GaitRecord:
    """The whole gait to expect of anybody at the speed of `subject`, angles included."""
    people = other_people(subject, others)
    gait = symmetric(expected(people, dimensionless_speed(subject)))
    return record_from(gait, subject.leg_length_m)


def rolled_ankle(
    record: GaitRecord, usual: GaitRecord, side: Side, model: BodyModel
) -> PeriodicCurve:
    """The ankle moment of a `usual` gait in the time in which the foot of `record` on a `side`
    rolls off.

    A foot whose heel is off the ground carries the body on its ball, so the lever is as long as it
    becomes; the load lasts until the other foot lands, and ends at toe-off. The moment's curve is
    stretched between these (registration of curves: Sadeghi et al. 2003, J Biomech 36:1057, from
    memory). So someone who rises on the toes of the sound leg to swing a prosthesis
    through (vaulting; Drevelle et al. 2014, Clin Biomech 29:679, from memory) has a moment that
    comes early and stays. In the ten built-in people it is 0.085 Nm/kg off.
    """
    found = []
    for each in (record, usual):
        stance = each.stance_fraction[side]
        lands = each.left_phase if side == "right" else 1.0 - each.left_phase
        rises = min(heel_rise(each, side, model), lands - STANCE.shortest)
        found.append([rises, min(lands, stance - STANCE.shortest), stance])
    return _stretched(usual.moments[f"ankle_angle_{side[0]}"], *found)


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
