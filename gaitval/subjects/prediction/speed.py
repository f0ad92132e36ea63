"""A person's gait at a speed at which it was not recorded.

From the person's own trials, and from how other people change with speed. Between two trials and
beyond them the person's own change counts the more, the further apart the trials are; with one
trial the change is other people's alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.errors import SubjectError
from gaitval.gait.dimensionless import speed_unit
from gaitval.gait.record import REQUIRED_MOMENTS, GaitRecord
from gaitval.subjects.prediction.normal_form import (
    SAMPLES,
    NormalForm,
    combined,
    normal_form,
    record_from,
    symmetric,
)
from gaitval.subjects.prediction.population import (
    FittedPeople,
    change_with_speed,
    expected,
    on_the_line,
    other_people,
)
from gaitval.subjects.subject import Subject


@dataclass(frozen=True)
class SpeedSettings:
    """How curves change with speed, and how far that is believed."""

    largest_change: float = 0.5
    """Fraction of the nearest trial's speed: beyond it people change how they walk, not only how
    fast."""
    passing: float = 0.1
    """Fraction of the slowest trial's speed over which a prediction passes, up to `largest_change`
    below it, from how the person changes to what is expected of others: the stride time of a person
    who slows down by long steps would else go on growing, to 2.7 s at 0.3 m/s."""
    trust: float = 0.8
    """Share of other people's change that is expected of a person. What three people have in common
    is known with an error, so the whole of it predicts a fourth's angles worse
    (docs/held-out.md)."""
    stride_time_exponent: float = -0.47
    """Of speed in stride time: mean of 43 people at six to eight speeds each, between whom it has a
    standard deviation of 0.08 (Fukuchi et al. 2018; tests/prediction/test_speed.py computes it)."""
    same_speed: float = 0.003
    """Difference of dimensionless speed, a centimetre a second, below which two trials say nothing
    about the change between them."""
    own_change_span: float = 0.3
    """Difference of dimensionless speed between a person's own trials at which their own change
    counts as much as other people's beyond them. The ankles of 30 people at up to eight speeds,
    predicted from two of their trials and the change in two others, choose it
    (tests/prediction/test_speed.py of commit b13f4cd3)."""
    near_a_trial: float = 0.02
    """Difference of dimensionless speed, 6 cm a second, from a trial at which it counts as much as
    the mean of all trials; convention."""
    ripples_from: int = 8
    """Harmonic from which the moments of a trial are more its own than the person's
    (docs/what-we-tried.md)."""


SPEED: Final = SpeedSettings()


def at_speed(
    subject: Subject,
    records: Sequence[GaitRecord],
    speed: float,
    others: Sequence[Subject],
    *,
    forced: bool = False,
) -> GaitRecord:
    """The expected gait of a person at another speed.

    Parameters
    ----------
    subject : the person.
    records : of the person, as far as they are known to the model.
    speed : m/s.
    others : people with several trials; the person of `subject` is left out.
    forced : also beyond `SPEED.largest_change`.

    Raises
    ------
    SubjectError : the speed is too far from those of the records.
    """
    speeds = [record.speed for record in records]
    if not speed > 0.0:
        raise SubjectError(f"speed {speed:g} m/s: not a walking speed. Give one above zero.")
    change = min(abs(speed / each - 1.0) for each in speeds)
    if change > SPEED.largest_change and not forced:
        walked = ", ".join(f"{each:g}" for each in sorted(speeds))
        raise SubjectError(
            f"{subject.identifier}: {speed:g} m/s is {100 * change:.0f} % from the nearest speed "
            f"that was walked ({walked} m/s), and beyond {100 * SPEED.largest_change:.0f} % a "
            "prediction "
            "is a guess. Give a speed nearer to one that was walked, or --force."
        )
    wanted = speed / speed_unit(subject.leg_length_m)
    own = _distinct([normal_form(record, subject.leg_length_m) for record in records])
    people = other_people(subject, others)
    gait = _with_all_trials(_moved(own, wanted, _change_of_others(people)), own, people)
    slower = 1.0 - speed / min(speeds)
    if slower > SPEED.largest_change - SPEED.passing:
        far = _far_slower(own, wanted, people)
        share = min(1.0, 1.0 - (SPEED.largest_change - slower) / SPEED.passing)
        gait = combined([gait, far], np.array([1.0 - share, share]))
    # The speed as given: through the dimensionless one and back it would be rounded.
    return replace(record_from(gait, subject.leg_length_m), speed=speed)


def trials_known(subject: Subject, without: str | None = None) -> list[Subject]:
    """The person on each of their trials that are known to the model: all but one that is held out.

    Parameters
    ----------
    subject : the person, with all trials.
    without : name of the trial that is held out; None holds out none.

    Raises
    ------
    SubjectError : there is no trial of that name, or none is left.
    """
    names = [subject.trial, *(trial.name for trial in subject.trials)]
    if without is not None:
        # Raises the error for a name that does not exist; its result is not needed.
        subject.on_trial(without)
        names.remove(without)
    if not names:
        raise SubjectError(
            f"{subject.identifier}: {without} is the only trial, so nothing is left to predict it "
            "from. Add another trial ([[trials]] in the subject's file; `gaitval curves --to` "
            "writes it), or hold out none."
        )
    return [subject.on_trial(name) for name in names]


def _change_of_others(people: FittedPeople) -> NormalForm:
    """Change of the gait of other `people` per unit of dimensionless speed, within each; between
    them, where nobody has several trials.
    """
    change = change_with_speed(people)
    if change is not None:
        return change
    # Nobody has several trials: the slope of the line through all people.
    return combined([on_the_line(people, speed) for speed in (1.0, 0.0)], np.array([1.0, -1.0]))


def _far_slower(own: Sequence[NormalForm], speed: float, people: FittedPeople) -> NormalForm:
    """What is expected of other people at a slow dimensionless speed, with what this person differs
    by from what is expected at their slowest. A power of speed would make the steps ever longer.
    """
    slowest = min(own, key=lambda gait: gait.speed)
    there, here = (symmetric(expected(people, each)) for each in (speed, slowest.speed))
    gait = combined([slowest, there, here], np.array([1.0, 1.0, -1.0]))
    stride_time = slowest.stride_time * there.stride_time / here.stride_time
    return replace(gait, speed=speed, stride_time=stride_time)


def _distinct(gaits: Sequence[NormalForm]) -> list[NormalForm]:
    """The gaits, slowest first; the mean of those of `SPEED.same_speed`."""
    groups: list[list[NormalForm]] = []
    for gait in sorted(gaits, key=lambda each: each.speed):
        if groups and gait.speed - groups[-1][0].speed < SPEED.same_speed:
            groups[-1].append(gait)
        else:
            groups.append([gait])
    return [combined(group, np.full(len(group), 1.0 / len(group))) for group in groups]


def _moved(own: Sequence[NormalForm], speed: float, change: NormalForm) -> NormalForm:
    """A person's gaits, slowest first, interpolated or extrapolated to a dimensionless speed."""
    nearest = min(own, key=lambda gait: abs(gait.speed - speed))
    away = speed - nearest.speed
    gaits, weights = [nearest, change], [1.0, SPEED.trust * away]
    # Curves change linearly with speed, stride time with a power of it.
    exponent = SPEED.stride_time_exponent
    if len(own) > 1:
        # The person's own change, over the trials on both sides of the speed or the last two.
        speeds = [gait.speed for gait in own]
        place = int(np.clip(np.searchsorted(speeds, speed), 1, len(own) - 1))
        below, above = own[place - 1], own[place]
        span = above.speed - below.speed
        # Between two trials their straight line is all that is needed.
        between = below.speed <= speed <= above.speed
        share = 1.0 if between else span**2 / (span**2 + SPEED.own_change_span**2)
        gaits += [above, below]
        weights = [
            1.0,
            (1.0 - share) * SPEED.trust * away,
            share * away / span,
            -share * away / span,
        ]
        # Stride time is a power of speed, so its exponent is the slope of the logarithms.
        step = np.log(above.stride_time / below.stride_time) / np.log(above.speed / below.speed)
        exponent += share * (float(step) - exponent)
    stride_time = nearest.stride_time * (speed / nearest.speed) ** exponent
    return replace(combined(gaits, np.array(weights)), speed=speed, stride_time=stride_time)


_OF_ALL_TRIALS: Final = np.array([[name.startswith("hip_adduction")] for name in REQUIRED_MOMENTS])
"""(8, 1) the moments that differ more from trial to trial than with speed: a trial that is copied
brings what was its own."""


def _with_all_trials(
    gait: NormalForm, own: Sequence[NormalForm], people: FittedPeople
) -> NormalForm:
    """A `gait` that was predicted from a person's trials (`own`), with the moments that differ from
    trial to trial (`_OF_ALL_TRIALS`) by all of these trials and by other `people`.
    """
    away = min(abs(each.speed - gait.speed) for each in own)
    # at the speed of a trial it is that trial
    share = away**2 / (away**2 + SPEED.near_a_trial**2)
    moments = share * _by_all_trials(own, gait.speed, people) + (1.0 - share) * gait.moments
    return replace(gait, moments=np.where(_OF_ALL_TRIALS, moments, gait.moments))


def _by_all_trials(own: Sequence[NormalForm], speed: float, people: FittedPeople) -> Array:
    """Moments (8, n) at a dimensionless speed: what is expected of other `people` there, with what
    the person's trials (`own`) differ from that. A trial counts less if it ripples (`_weights`), a
    harmonic by how much of it is the person's (`_own_shares`).
    """
    beyond = np.fft.rfft(_beyond(own, people))
    variances = _variances(people)
    if variances is None:
        changed = beyond.mean(axis=0)
    else:
        weights = _weights(beyond, variances.of_trial)
        changed = _own_shares(variances, weights) * np.sum(weights * beyond, axis=0)
        changed /= weights.sum(axis=0)
    found = symmetric(expected(people, speed)).moments + np.fft.irfft(changed, SAMPLES)
    return np.asarray(found)


def _beyond(own: Sequence[NormalForm], people: FittedPeople) -> Array:
    """(trials, 8, n) moments of a person's trials less those expected of other `people`."""
    each = [gait.moments - symmetric(expected(people, gait.speed)).moments for gait in own]
    return np.array(each)


class _Variances(NamedTuple):
    """(8, n / 2 + 1) of each harmonic of a moment, how much people differ from what is expected of
    anybody, and trials of one person from one another.
    """

    of_person: Array
    of_trial: Array


def _variances(people: FittedPeople) -> _Variances | None:
    """Of `people`, each beside what is expected of the others; None where nobody has several
    trials.
    """
    freedom = sum(len(person) - 1 for person in people)
    if len(people) < 2 or not freedom:
        return None
    each = [
        np.fft.rfft(_beyond(person, [*people[:index], *people[index + 1 :]]))
        for index, person in enumerate(people)
    ]
    between = [_of_both_sides(harmonics).mean(axis=0) for harmonics in each]
    within = [_of_both_sides(harmonics - harmonics.mean(axis=0)).sum(axis=0) for harmonics in each]
    of_trial = np.sum(within, axis=0) / freedom
    # trials of one person differ, so the variance over people has that of their trials in it
    return _Variances(np.maximum(np.mean(between, axis=0) - of_trial, 0.0), of_trial)


def _weights(beyond: NDArray[np.complex128], of_trial: Array) -> Array:
    """(trials, 8, 1) of a person's trials, which are `beyond` what is expected: 1, or for a curve
    whose ripples vary more than those of usual trials (`of_trial`), as many times less. A plate
    that rippled in a trial was at fault in that trial's slow harmonics, too.
    """
    ripples = (np.abs(beyond[..., SPEED.ripples_from :]) ** 2).sum(axis=-1)
    usual = of_trial[:, SPEED.ripples_from :].sum(axis=-1)
    # no other person's trials ripple where nothing is known of them
    louder = ripples / np.maximum(usual, np.finfo(float).eps)
    return np.asarray(1.0 / np.maximum(louder, 1.0))[..., None]


def _own_shares(variances: _Variances, weights: Array) -> Array:
    """(8, n / 2 + 1) of each harmonic of a moment, the share that is the person's own in how far
    the weighted mean of trials (`weights` (trials, 8, 1)) is from what is expected: the variance
    between people, over it and that of the mean; the best linear prediction by these variances.
    """
    of_person, of_trial = variances
    of_mean = of_trial / weights.sum(axis=0)
    return np.asarray(of_person / np.maximum(of_person + of_mean, np.finfo(float).tiny))


def _of_both_sides(harmonics: NDArray[np.complex128]) -> Array:
    """Squares of `harmonics` (trials, 8, f), the mean of the right side's and the left one's."""
    squares = np.abs(harmonics) ** 2
    sides = squares.reshape(len(squares), 2, -1, squares.shape[-1]).mean(axis=1)
    return np.asarray(np.tile(sides, (1, 2, 1)))
