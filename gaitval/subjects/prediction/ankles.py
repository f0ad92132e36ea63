"""What an ankle's angle says of its moment, by more people than have all curves.

Of 33 of the 42 people of Fukuchi et al. (2018, PeerJ 6:e4640, CC BY 4.0) the right ankle's angle
and moment are known at up to eight treadmill speeds each. `ankles.json` has them as scores of
principal components (`experiments/ankle_scores.py`). A parabola on dimensionless speed is drawn
through them, and a ridge regression says how the moment differs from it by how the angle does;
every person has the same weight, however many trials there are of one. How free it is, the
people themselves say, each left out once. With 32 others somebody's moment is 0.091 Nm/kg off at
all speeds, with the parabola alone 0.113 (`claims/ankles.py` of commit 60ee3cba).
"""

from collections.abc import Iterable
from functools import cache
from importlib import resources
from json import loads
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.arrays import Array, Flags

STORE: Final = "ankles.json"
UNIT: Final = 1e-5
"""Of the whole numbers in `STORE`."""
DEGREE: Final = 2
"""Of the polynomial on speed: a parabola is 4 % nearer than a line."""
FREEDOMS: Final = (3.0, 1.0, 0.3, 0.1, 0.03)
"""Noise over signal of one person, divided by the number of people, so that the regression is freer
with more. Of them that is taken which is not further off than the best by a standard error of the
difference in people who are left out, and is least free (Breiman et al. 1984, Classification and
regression trees, as Hastie et al. 2009, section 7.10, describe it: from memory)."""


class AnkleTrials(NamedTuple):
    """Right ankles of many people.

    Attributes
    ----------
    people : (n,) whose trial it is, as `Subject.person` has it.
    speeds : (n,) without dimension.
    angles, moments : (n, a) and (n, b) scores; of angles in rad, dorsiflexion positive, and of
        moments in weights times leg lengths (`NormalForm`), plates corrected.
    angle_mean, moment_mean : (100,) by percent of the cycle.
    angle_shapes, moment_shapes : (a, 100) and (b, 100), orthonormal.
    """

    people: Array
    speeds: Array
    angles: Array
    moments: Array
    angle_mean: Array
    moment_mean: Array
    angle_shapes: Array
    moment_shapes: Array


class AnkleRegression(NamedTuple):
    """Through the trials of some people: coefficients of the polynomial of scores, (d, a) and
    (d, b), of the regression (a, b), and its freedom.
    """

    angles: Array
    moments: Array
    slopes: Array
    freedom: float


class AnkleMoment(NamedTuple):
    """Of a right or a left ankle, by percent of its cycle, in weights times leg lengths: what is
    expected of anybody at this speed (100,), and how each of the angles changes it (k, 100).
    """

    usual: Array
    change: Array


@cache
def ankle_trials() -> AnkleTrials:
    """Those that come with the package."""
    text = (resources.files("gaitval.subjects.prediction") / STORE).read_text(encoding="utf-8")
    stored: dict[str, Any] = loads(text)
    people = [name for name, trials in stored["people"].items() for _ in trials]
    rows = np.array([row for trials in stored["people"].values() for row in trials], float) * UNIT
    mean, shapes = (
        {kind: UNIT * np.array(stored[kind][part], float) for kind in ("angle", "moment")}
        for part in ("mean", "shapes")
    )
    count = len(shapes["angle"])
    return AnkleTrials(
        np.array(people),
        rows[:, 0],
        rows[:, 1 : 1 + count],
        rows[:, 1 + count :],
        mean["angle"],
        mean["moment"],
        shapes["angle"],
        shapes["moment"],
    )


def ankle_moment(angles: Array, speed: float, without: Iterable[str] = ()) -> AnkleMoment:
    """The moment of ankles with `angles` (k, 100) rad of someone at a dimensionless `speed`, by all
    people but those called `without`.
    """
    trials, found = ankle_trials(), _through(frozenset(without))
    at = _powers(np.array([speed]))
    differs = (angles - trials.angle_mean) @ trials.angle_shapes.T - at @ found.angles
    usual = trials.moment_mean + (at @ found.moments)[0] @ trials.moment_shapes
    return AnkleMoment(usual, differs @ found.slopes @ trials.moment_shapes)


@cache
def _through(without: frozenset[str]) -> AnkleRegression:
    """The regression through all people but some, as free as these people themselves say."""
    trials = ankle_trials()
    kept = ~np.isin(trials.people, sorted(without))
    people = list(dict.fromkeys(trials.people[kept].tolist()))
    errors = np.array(
        [
            [
                np.sqrt(np.mean(np.square(missed(trials, out, regression(trials, kept & ~out, f)))))
                for f in FREEDOMS
            ]
            for out in (trials.people == person for person in people)
        ]
    )
    return regression(trials, kept, least_free(errors))


def least_free(errors: Array) -> float:
    """The one of `FREEDOMS` that is taken, by the errors (people, freedoms)."""
    beyond = errors - errors[:, [np.argmin(errors.mean(axis=0))]]
    doubtful = beyond.std(axis=0, ddof=1) / np.sqrt(len(errors))
    return FREEDOMS[int(np.argmax(beyond.mean(axis=0) <= doubtful))]


def regression(trials: AnkleTrials, kept: Flags, freedom: float) -> AnkleRegression:
    """Through the `trials` that are `kept` (n,), every person as heavy as another."""
    names, count = np.unique(trials.people[kept], return_counts=True)
    weight = 1.0 / count[np.searchsorted(names, trials.people[kept])][:, None]
    powers = _powers(trials.speeds[kept])
    draw = np.linalg.solve((powers * weight).T @ powers, (powers * weight).T)
    angles, moments = draw @ trials.angles[kept], draw @ trials.moments[kept]
    differs = trials.angles[kept] - powers @ angles
    rest = trials.moments[kept] - powers @ moments
    spread = (differs * weight).T @ differs
    noise = freedom * np.trace(spread) / len(names) * np.eye(len(spread))
    slopes = np.linalg.solve(spread + noise, (differs * weight).T @ rest)
    return AnkleRegression(angles, moments, slopes, freedom)


def missed(trials: AnkleTrials, which: Flags, found: AnkleRegression) -> Array:
    """(m, b) scores by which the moments of the `trials` that are `which` (n,) are off what was
    `found`.
    """
    powers = _powers(trials.speeds[which])
    differs = trials.angles[which] - powers @ found.angles
    return np.asarray(powers @ found.moments + differs @ found.slopes - trials.moments[which])


def _powers(speeds: Array) -> Array:
    return np.asarray(np.power.outer(speeds, np.arange(DEGREE + 1)))
