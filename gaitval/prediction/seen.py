"""What markers say of the forces: when each foot carries, and how much both carry together.

What is expected of anybody has the double support of anybody. Of a person without plates the import
knows when the feet land and leave; and the total of both forces is the acceleration of the centre
of mass (Newton's law), for which no law of load transfer is needed. What both are worth:
`python -m claims prediction.seen`.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.gait.dimensionless import speed_unit
from gaitval.gait.mean_curves import FORCE_TOLERANCE
from gaitval.gait.record import (
    HARMONICS_CAP,
    GaitRecord,
    PeriodicCurve,
    fit_periodic,
    periodic_through,
)
from gaitval.prediction.population import other_people
from gaitval.prediction.speed_line import dimensionless_speed

SAMPLES: Final = 200
_PHASES: Final = np.arange(SAMPLES) / SAMPLES
SHORTEST: Final = 0.02
"""Of the cycle, of a double support or a swing that is stretched to."""
HIGHEST_HZ: Final = 5.0
"""Of what is taken from the motion of the centre of mass: above it the low-pass of the markers
leaves less than the whole."""
DIRECTIONS: Final = np.array([0.5, 1.0, 1.0])
"""Forward, left, up: the share that is taken from it. The fore-aft force that is expected of
anybody is as near, and off for other reasons, so that both count half."""


def knows_contacts(subject: Subject) -> bool:
    """Whether markers say when both feet of `subject` land and leave, and it matters: not in the
    laboratory of the people expected from, where their contacts are as near. Where plates recorded
    it, it is held out with their forces.
    """
    right, left = subject.stance_fraction.right, subject.stance_fraction.left
    if right is None or left is None or subject.has_kinetics or is_of_the_laboratory(subject):
        return False
    # What is expected of a walk cannot be stretched over a step without double support.
    both = (subject.left_phase + left - 1.0, right - subject.left_phase)
    return min(both) > SHORTEST and max(right, left) < 1.0 - SHORTEST


def is_of_the_laboratory(subject: Subject) -> bool:
    """Whether `subject` was recorded where the built-in people were."""
    return any(subject.laboratory == other.laboratory for other in builtin_subjects())


def speeds_beyond(subject: Subject) -> tuple[float, float] | None:
    """The slowest and the fastest walk that estimates are learned from, m/s on the legs of
    `subject`, whose own walk is slower or faster; None if it is between them.
    """
    people = other_people(subject, builtin_subjects())
    speeds = [gait.speed for person in people for gait in person]
    if min(speeds) <= dimensionless_speed(subject) <= max(speeds):
        return None
    one = speed_unit(subject.leg_length_m)
    return one * min(speeds), one * max(speeds)


def knows_total(subject: Subject) -> bool:
    """Whether the motion of `subject` says what both feet carry: not what a crutch does."""
    return subject.gait.total_force is not None and subject.aid is None


def at_own_contacts(record: GaitRecord, subject: Subject) -> GaitRecord:
    """The `record` that is expected of `subject`, with moments and forces stretched so that both
    feet land and leave when this person's do, if that is known.
    """
    if not knows_contacts(subject):
        return record
    own = replace(record, stance_fraction=subject.stance_fraction.of_both())
    even = replace(record, left_phase=0.5)  # what is expected is symmetric
    moments, forces = {}, {}
    for side in SIDES:
        at = np.interp(_PHASES, contacts(own, side), contacts(even, side))
        for name in (each for each in record.moments if each.endswith(f"_{side[0]}")):
            moments[name] = periodic_through(record.moments[name](at), HARMONICS_CAP)
        forces[side] = _fitted(record.ground_reaction(side, at), own.stance_fraction[side])
    return replace(own, moments=moments, forces=forces)


def contacts(record: GaitRecord, side: Side) -> list[float]:
    """Phases of the cycle of a `side`: its foot lands, the other one leaves, the other one lands,
    it leaves, and lands again.
    """
    lands = record.left_phase if side == "right" else 1.0 - record.left_phase
    leaves = lands + record.stance_fraction[opposite(side)] - 1.0
    return [0.0, leaves, lands, record.stance_fraction[side], 1.0]


def _fitted(rows: Array, stance: float) -> tuple[PeriodicCurve, PeriodicCurve, PeriodicCurve]:
    """Curves through the forces (200, 3) of a stance."""
    on = np.append(np.flatnonzero(stance >= _PHASES), SAMPLES)
    closed = np.vstack([rows, rows[:1]])[on]
    forward, left, up = (fit_periodic(on / SAMPLES, each, FORCE_TOLERANCE)[0] for each in closed.T)
    return forward, left, up


def with_total(record: GaitRecord, subject: Subject) -> GaitRecord:
    """The `record` with forces whose total is what the motion of the centre of mass of `subject`
    needs, if that is known: of what it lacks, each foot carries its share of the vertical force.
    """
    total = subject.gait.total_force
    if total is None or not knows_total(subject):
        return record
    own = {"right": _PHASES, "left": _PHASES - record.left_phase}
    forces = np.array([record.ground_reaction(side, own[side] % 1.0) for side in SIDES])
    needed = np.stack([each.periodic()(_PHASES) for each in (total.forward, total.left, total.up)])
    lacks = needed.T - forces.sum(axis=0)
    lacks = DIRECTIONS * _slow(lacks, record.stride_time)
    moved = {}
    for side, force in zip(SIDES, shared(forces, lacks), strict=True):
        later = record.left_phase if side == "left" else 0.0
        x = np.append(_PHASES, 1.0)
        rows = np.stack(
            [np.interp((_PHASES + later) % 1.0, x, np.append(f, f[0])) for f in force.T], axis=1
        )
        moved[side] = _fitted(rows, record.stance_fraction[side])
    return replace(record, forces=moved)


def shared(forces: Array, lacks: Array) -> Array:
    """Forces of both feet (2, n, 3) with what both together lack (n, 3), by vertical share."""
    weight = np.maximum(forces[..., 2:], 0.0)
    # Where nobody is expected to carry, nothing is shared out.
    return np.asarray(forces + lacks * weight / np.maximum(weight.sum(axis=0), 0.01))


def _slow(values: Array, stride_time: float) -> Array:
    """What of a cycle (200, 3) is slower than `HIGHEST_HZ`, without its mean."""
    spectrum = np.fft.rfft(values, axis=0)
    spectrum[0] = 0.0
    spectrum[int(HIGHEST_HZ * stride_time) + 1 :] = 0.0
    return np.asarray(np.fft.irfft(spectrum, SAMPLES, axis=0))
