"""What a run is told of a person's record, and what it is not.

Everything but the comparison at the end - reference, feed-forward, reward, identification,
correction - reads the told record. With `record.use = "all"` that is the person's record. With
`"kinematics"` it has the person's angles, speed, stride time and time of left heel strike; moments,
forces and stance are what nine other people lead to expect of anybody at this speed, and the
person's own are read by nothing but the comparison (tests/workflows/test_poison.py).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal, NamedTuple, get_args

from gaitval.datasets.subject import Subject
from gaitval.errors import SubjectError
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.record import GaitRecord, PeriodicCurve
from gaitval.prediction.normal_form import record_from, symmetric
from gaitval.prediction.population import (
    FEWEST_PEOPLE,
    dimensionless_speed,
    expected,
    other_people,
)

Use = Literal["all", "kinematics"]
USES: Final[tuple[Use, ...]] = get_args(Use)

KINEMATIC_ACCURACY: Final = RecordAccuracy(
    moment=0.05,
    adduction_moment=0.05,
    forward_force=0.0045,
    sideways_force=0.0035,
    vertical_force=0.015,
)
"""A third of the error of the expected forces and half of that of the moments: the forces that the
recorded angles alone would give are further off than the expected ones, but the moments at given
forces depend on how this person moves."""


class Told(NamedTuple):
    """A record, of which some may be expected instead of recorded, and how far to trust it."""

    record: GaitRecord
    accuracy: RecordAccuracy


def told(subject: Subject, use: Use, others: Sequence[Subject]) -> Told:
    """What a run is told.

    Parameters
    ----------
    use : "all", or "kinematics" only.
    others : people whose kinetics are known; the person of `subject` is left out.

    Raises
    ------
    SubjectError : too few others to expect kinetics from.
    """
    if use == "all":
        return Told(subject.record(), RecordAccuracy())
    people = other_people(subject, others)
    if len(people) < FEWEST_PEOPLE:
        raise SubjectError(
            f"{subject.identifier}: kinetics are expected from other people's, but only "
            f"{len(people)} others are known, and {FEWEST_PEOPLE} are needed. Tell the run all "
            'that is recorded (record.use = "all").'
        )
    gait = symmetric(expected(people, dimensionless_speed(subject)))
    guess = record_from(gait, subject.leg_length_m)
    return Told(
        replace(
            guess,
            speed=subject.walking_speed_m_s,
            stride_time=subject.stride_time_s,
            left_phase=subject.left_phase,
            angles=angles_of(subject),
        ),
        KINEMATIC_ACCURACY,
    )


def angles_of(subject: Subject) -> dict[str, PeriodicCurve]:
    """The recorded angles."""
    return {name: curve.periodic() for name, curve in subject.gait.angles.items()}
