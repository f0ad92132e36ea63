"""What a run is told of a person's record, and what it is not.

Everything but the comparison at the end - reference, feed-forward, reward, identification,
correction - reads the told record. By default that is the person's record. With `record.use =
"kinematics"` it has the person's angles, speed, stride time and time of left heel strike; moments,
forces and stance are what other people lead to expect of anybody at this speed. With
`record.holdout` or `record.speed` it is what the person's other trials lead to expect at another
speed (`speed`). What is not told is read by nothing but the comparison, which
tests/workflows/test_poison.py proves with NaN in its place.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal, NamedTuple

import numpy as np

from gaitval.configuration import RecordSettings
from gaitval.datasets.subject import Subject
from gaitval.errors import SubjectError
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.record import GaitRecord
from gaitval.prediction.normal_form import record_from, symmetric
from gaitval.prediction.population import (
    FEWEST_PEOPLE,
    dimensionless_speed,
    expected,
    other_people,
)
from gaitval.prediction.speed import at_speed, trials_told

Quantity = Literal["angles", "timing", "moments", "forces", "stance"]
QUANTITIES: Final[tuple[Quantity, ...]] = ("angles", "timing", "moments", "forces", "stance")
"""What a record consists of. Timing: speed, stride time, time of left heel strike."""

KINEMATIC: Final[tuple[Quantity, ...]] = ("angles", "timing")

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

PREDICTED_ACCURACY: Final = RecordAccuracy(
    sagittal=np.deg2rad(0.6),
    forward_force=0.008,
    sideways_force=0.006,
    vertical_force=0.008,
)
"""Of a record that is predicted from other trials: angles and forces are held more tightly than in
a recorded one, moments as in that, to 0.06 Nm/kg. The prediction does not miss its moments by so
much: on two trials that nothing was chosen on they are 0.033 and 0.038 Nm/kg off, and the fit takes
them to 0.072 and 0.085. The choice favours angles, which would give way with the accuracy of a
record. On the four trials that served to choose it (tuning data) the reference's sagittal angles
come 0 to 0.3 degrees nearer so, its forces stay, and its moments are up to 0.01 Nm/kg further away.
"""


class Told(NamedTuple):
    """A record, of which some may be expected instead of recorded, and how far to trust it."""

    record: GaitRecord
    accuracy: RecordAccuracy


def quantities_recorded(subject: Subject) -> tuple[Quantity, ...]:
    """What was recorded of a person."""
    return QUANTITIES if subject.has_kinetics else KINEMATIC


def quantities_told(subject: Subject, settings: RecordSettings) -> tuple[Quantity, ...]:
    """The quantities of the compared record that the run was told."""
    if is_predicted(settings):
        return ()
    return KINEMATIC if settings.use == "kinematics" else quantities_recorded(subject)


def with_expected_kinetics(subject: Subject, others: Sequence[Subject]) -> GaitRecord:
    """The person's record; if it has no moments and forces, with those to expect."""
    return _of_a_trial(subject, RecordSettings(), others).record


def is_predicted(settings: RecordSettings) -> bool:
    """Whether the walk is that of another trial or speed than those told."""
    return bool(settings.holdout) or settings.speed > 0.0


def is_unrecorded(settings: RecordSettings) -> bool:
    """Whether the walk is at a speed of which there is no record to compare it with."""
    return settings.speed > 0.0 and not settings.holdout


def told(
    subject: Subject,
    settings: RecordSettings,
    others: Sequence[Subject],
    *,
    speed: float | None = None,
    forced: bool = False,
) -> Told:
    """What a run is told.

    Parameters
    ----------
    others : people whose gait is known; the person of `subject` is left out.
    speed : m/s, instead of that of the settings.
    forced : also at a speed far from every trial.

    Raises
    ------
    SubjectError : nothing is left to tell, or the speed is too far away.
    """
    if not is_predicted(settings) and speed is None:
        return _of_a_trial(subject, settings, others)
    trials = trials_told(subject, settings.holdout or None)
    known = [_of_a_trial(trial, settings, others).record for trial in trials]
    wanted = speed or settings.speed or subject.on_trial(settings.holdout).walking_speed_m_s
    found = at_speed(subject, known, wanted, others, forced=forced)
    fully = settings.use == "all" and all(trial.has_kinetics for trial in trials)
    return Told(found, PREDICTED_ACCURACY if fully else KINEMATIC_ACCURACY)


def _of_a_trial(subject: Subject, settings: RecordSettings, others: Sequence[Subject]) -> Told:
    if settings.use == "all" and subject.has_kinetics:
        return Told(subject.record(), RecordAccuracy())
    people = other_people(subject, others)
    if len(people) < FEWEST_PEOPLE:
        raise SubjectError(
            f"{subject.identifier}: kinetics are expected from other people's, but only "
            f"{len(people)} others are known, and {FEWEST_PEOPLE} are needed. Record forces, and "
            "tell the run all that is recorded (--use all)."
        )
    gait = symmetric(expected(people, dimensionless_speed(subject)))
    guess = record_from(gait, subject.leg_length_m)
    return Told(
        replace(
            guess,
            speed=subject.walking_speed_m_s,
            stride_time=subject.stride_time_s,
            left_phase=subject.left_phase,
            angles=subject.gait.angles_of_both(),
        ),
        KINEMATIC_ACCURACY,
    )
