"""What other people's gait says about a person's: at a speed, and about a change of speed.

A few people with a few trials each. Between people, gaits differ for many reasons, so a straight
line on speed through all of them is noisy; within a person, a change of speed has much the same
effect in everybody, but only people with several trials show it. `expected` uses both.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaitval.configuration import NoiseSettings
from gaitval.errors import SubjectError
from gaitval.gait.record import GaitRecord
from gaitval.subjects.prediction.normal_form import (
    NormalForm,
    combined,
    normal_form,
    record_from,
    symmetric,
)
from gaitval.subjects.prediction.speed_line import FEWEST_PEOPLE, dimensionless_speed, line_weights
from gaitval.subjects.subject import Subject

FittedPeople = Sequence[Sequence[NormalForm]]
"""The gaits of every person, one for each trial."""


def gaits_of(subject: Subject) -> list[NormalForm]:
    """All trials of the person of a `subject`, the subject's own trial first."""
    trials = [subject, *(subject.on_trial(trial.name) for trial in subject.trials)]
    return [normal_form(trial.record(), subject.leg_length_m) for trial in trials]


def other_people(subject: Subject, others: Sequence[Subject]) -> list[list[NormalForm]]:
    """The gaits of all people among `others` but the person of `subject`."""
    return [gaits_of(other) for other in others if not subject.is_person_of(other)]


def on_the_line(people: FittedPeople, speed: float) -> NormalForm:
    """The straight line through all gaits of `people`, trials once, at a dimensionless `speed`."""
    gaits = [gait for person in people for gait in person]
    return combined(gaits, line_weights(np.array([gait.speed for gait in gaits]), speed))


def change_with_speed(people: FittedPeople) -> NormalForm | None:
    """Change of a person's gait per unit of dimensionless speed, by least squares within those
    `people`, each with the own gait first, who have several trials; None if nobody has.
    """
    steps = [(person[0], gait) for person in people for gait in person[1:]]
    if not steps:
        return None
    rise = np.array([gait.speed - first.speed for first, gait in steps])
    # The slope of a line through the origin: Σ rise · change / Σ rise².
    weights = rise / np.sum(rise**2)
    return combined(
        [gait for _, gait in steps] + [first for first, _ in steps],
        np.concatenate([weights, -weights]),
    )


def expected(people: FittedPeople, speed: float) -> NormalForm:
    """The gait to expect of someone who is only known to walk at this dimensionless `speed`, from
    other `people`, each with the own gait first.

    The mean of two predictions: the straight line through all trials, and the mean person, moved to
    this speed as speed changes people's gait (which nine people predict a tenth better with than
    with either alone).
    """
    line = on_the_line(people, speed)
    change = change_with_speed(people)
    if change is None:
        return line
    first = [person[0] for person in people]
    away = speed - float(np.mean([gait.speed for gait in first]))
    # Half the mean person, half the change from their mean speed to this one, half the line.
    weights = np.append(np.full(len(first), 0.5 / len(first)), [0.5 * away, 0.5])
    return combined([*first, change, line], weights)


def expected_record(subject: Subject, people: FittedPeople) -> GaitRecord:
    """The gait to expect of anybody at the speed of `subject` and on such legs, from other
    `people`: both sides equal, half a cycle apart. Raises SubjectError if these are too few.
    """
    if len(people) < FEWEST_PEOPLE:
        raise SubjectError(
            f"{subject.identifier}: kinetics are expected from other people's, but only "
            f"{len(people)} others are known, and {FEWEST_PEOPLE} are needed. Record forces, and "
            "give the run all that is recorded (--use all)."
        )
    # Other people's sides differ for their own reasons, which say nothing about this person's.
    gait = symmetric(expected(people, dimensionless_speed(subject)))
    return record_from(gait, subject.leg_length_m)


def with_others_kinetics(subject: Subject, others: Sequence[Subject]) -> GaitRecord:
    """The angles and times of `subject` with what is expected of the rest from the `others`. Raises
    SubjectError if these are too few.
    """
    return replace(
        expected_record(subject, other_people(subject, others)),
        # What was recorded of the person takes the place of what is expected.
        speed=subject.walking_speed_m_s,
        stride_time=subject.stride_time_s,
        left_phase=subject.left_phase,
        angles=subject.gait.angles_of_both(),
    )


def noise_of_expected(noise: NoiseSettings) -> NoiseSettings:
    """The noise model for moments and forces that are not this person's, but what people of their
    speed have: half as large again as such a prediction misses by, because it is wrong in its own
    way at every percent of the cycle. The other fields of the person's own `noise` are kept.
    """
    return noise.model_copy(
        update={
            "moment": 0.15,
            "adduction_moment": 0.2,
            "vertical_force": 0.08,
            "forward_force": 0.02,
            "medial_force": 0.02,
            "independent": 2.0,
        }
    )
