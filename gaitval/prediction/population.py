"""What other people's gait says about a person's: at a speed, and about a change of speed.

A few people with a few trials each. Between people, gaits differ for many reasons, so a straight
line on speed through all of them is noisy; within a person, a change of speed has much the same
effect in everybody, but only people with several trials show it. `expected` uses both.
"""

from collections.abc import Sequence

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.datasets.subject import Subject
from gaitval.prediction.normal_form import NormalForm, combined, normal_form

FEWEST_PEOPLE = 3
"""People that a straight line needs so that it does not pass through all of them."""

People = Sequence[Sequence[NormalForm]]
"""The gaits of every person, one for each trial."""


def dimensionless_speed(subject: Subject) -> float:
    """Speed over the square root of gravity times leg length (Hof 1996, Gait Posture 4:222)."""
    return float(subject.walking_speed_m_s / np.sqrt(GRAVITY * subject.leg_length_m))


def gaits_of(subject: Subject) -> list[NormalForm]:
    """All trials of a person, the subject's own first."""
    trials = [subject, *(subject.on_trial(trial.name) for trial in subject.trials)]
    return [normal_form(trial.record(), subject.leg_length_m) for trial in trials]


def other_people(subject: Subject, others: Sequence[Subject]) -> list[list[NormalForm]]:
    """The gaits of everybody else."""
    return [gaits_of(other) for other in others if not same_person(subject, other)]


def same_person(one: Subject, other: Subject) -> bool:
    """Whether two subjects have the same identifier, or are the same person of a source."""
    return one.identifier == other.identifier or one.person == other.person


def line_weights(speeds: Array, speed: float) -> Array:
    """Weights (n,) of gaits at these speeds (n,) that give the straight line through them, by least
    squares, at a speed.
    """
    design = np.column_stack([np.ones(len(speeds)), speeds])
    return np.asarray(np.array([1.0, speed]) @ np.linalg.pinv(design))


def on_the_line(people: People, speed: float) -> NormalForm:
    """The straight line through all gaits at a dimensionless speed."""
    gaits = [gait for person in people for gait in person]
    return combined(gaits, line_weights(np.array([gait.speed for gait in gaits]), speed))


def change_with_speed(people: People) -> NormalForm | None:
    """Change of a person's gait per unit of dimensionless speed, by least squares within the people
    who have several trials; None if nobody has.
    """
    steps = [(person[0], gait) for person in people for gait in person[1:]]
    if not steps:
        return None
    rise = np.array([gait.speed - first.speed for first, gait in steps])
    weights = rise / np.sum(rise**2)
    return combined(
        [gait for _, gait in steps] + [first for first, _ in steps],
        np.concatenate([weights, -weights]),
    )


def expected(people: People, speed: float) -> NormalForm:
    """The gait to expect of someone who is only known to walk at this dimensionless speed.

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
    weights = np.append(np.full(len(first), 0.5 / len(first)), [0.5 * away, 0.5])
    return combined([*first, change, line], weights)
