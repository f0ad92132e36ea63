"""What markers say of the forces: when each foot carries, and whether they say how much both carry.

What is expected of anybody has the double support of anybody. Of a person without plates the import
knows when the feet land and leave; and the total of both forces is the acceleration of the centre
of mass (`gaitval.subjects.prediction.force_split`). What both are worth: `claims/prediction.py` of
commit 60ee3cba.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.gait.dimensionless import speed_unit
from gaitval.gait.mean_curves import TOLERANCES
from gaitval.gait.record import HARMONICS, GaitRecord, PeriodicCurve, fit_periodic, periodic_through
from gaitval.subjects.prediction.population import other_people
from gaitval.subjects.prediction.speed_line import dimensionless_speed
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_subjects

PHASES: Final = np.arange(200) / 200
"""Of the right cycle, at which forces are known here."""
SHORTEST: Final = 0.02
"""Of the cycle, of a double support or a swing that is stretched to."""


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
        at = np.interp(PHASES, contacts(own, side), contacts(even, side))
        for name in (each for each in record.moments if each.endswith(f"_{side[0]}")):
            moments[name] = periodic_through(record.moments[name](at), HARMONICS.harmonics_cap)
        forces[side] = stance_curves(record.ground_reaction(side, at), own.stance_fraction[side])
    return replace(own, moments=moments, forces=forces)


def contacts(record: GaitRecord, side: Side) -> list[float]:
    """Phases of the cycle of a `side`: its foot lands, the other one leaves, the other one lands,
    it leaves, and lands again.
    """
    lands = record.left_phase if side == "right" else 1.0 - record.left_phase
    leaves = lands + record.stance_fraction[opposite(side)] - 1.0
    return [0.0, leaves, lands, record.stance_fraction[side], 1.0]


def stance_curves(rows: Array, stance: float) -> tuple[PeriodicCurve, PeriodicCurve, PeriodicCurve]:
    """Curves through the forces (n, 3) of a stance, at `PHASES` of its foot's cycle."""
    at = np.append(PHASES, 1.0)
    on = np.append(stance >= PHASES, True)
    closed = np.vstack([rows, rows[:1]])[on]
    forward, left, up = (
        fit_periodic(at[on], each, TOLERANCES.force_tolerance)[0] for each in closed.T
    )
    return forward, left, up
