"""The estimate: a statistical answer, which need not obey Newton as a walk must.

For each quantity it is e + l + r + w · (f - s), of an ankle's moment half of this and half of what
33 people's ankles say (`gaitval.subjects.prediction.ankles`). e is what is expected of anybody at
this speed (`gaitval.subjects.prediction.population`). l is what the body's levers add (`LEVERS`):
steps that are wider by a share have a medial force that is larger by a share, and a wider pelvis
has its hip centres elsewhere. r is what a ridge regression through other people says, of the rest,
of how this person's angles and stride time differ from the expected ones. f is how the dynamic fit
of the angles differs from e, and s what the same regression says of such fits: so f - s is what
mechanics knows of this person that the regression does not (a Gaussian process with a mechanical
mean: Kennedy & O'Hagan 2001, J R Stat Soc B 63:425). w is what other people, each estimated from
the rest, would have been estimated best with (stacking: Wolpert 1992, Neural Netw 5:241; Breiman
1996, Mach Learn 24:49). It is local in the gait cycle (Cleveland & Devlin 1988, J Am Stat Assoc
83:596: from memory), as mechanics knows more where the other foot or the ground does not share the
load: of the hip's moment much late in swing, and nothing while both feet are on the ground.

The regression is the mean of four that look at different things, because a few people cannot say
which is best, with as much noise as signal in each. What it knows is of one laboratory: how its
markers sit shows in its angles and its moments. So half of l + r is of the same regressions through
these people and those of other laboratories (`gaitval.subjects.prediction.laboratories`), who say
how angles go with kinetics wherever markers sit. On another laboratory's people what is known of
one makes some moments worse (docs/how-to/predict.md), so there e + l + w · f is all, with the lever
of the step width alone, what all laboratories say of the moments of hip and knee, half of how the
ankle's angle changes its moment, and what laboratories that import differ by from that of these
people (`about_imported_joints`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.stats import t as student

from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.subjects.prediction.ankles import ankle_moment
from gaitval.subjects.prediction.deviations import (
    KINETICS,
    Deviation,
    DeviationTrial,
    deviation,
    deviations,
    kinetics_of,
)
from gaitval.subjects.prediction.laboratories import SHARE, Laboratories, differences, stored
from gaitval.subjects.prediction.worth import MissedPerson, left_by_insoles


@dataclass(frozen=True)
class EstimateSettings:
    """How an estimate weighs what it knows."""

    near: float = 2.0
    """Standard deviation, % of the gait cycle, of what counts for w at a phase. Of 1, 2, 3, 4, 7,
    10, 15 and the whole cycle, nine people choose 2 or 3 whoever the tenth is
    (docs/what-we-tried.md)."""
    noise: float = 1.0
    """Noise of a ridge regression over the signal that its features can explain: as much."""
    band: float = 0.9
    """Share of people whose curve the band around an estimate is to contain, at each percent."""
    ankle_share: float = 0.5
    """What 33 people's ankles count beside the ten with all their curves: convention."""
    all_share: float = 0.5
    """What a regression through people of all laboratories counts beside that through the built-in
    people and the 33 ankles: as much. Convention."""


ESTIMATE: Final = EstimateSettings()

WIDER_ELSEWHERE: Final = np.array([[1.9], [1.6], [1.7], [1.6], [1.3], [1.4], [1.2]])
"""By how much the bands of `KINETICS` are wider for people of another laboratory: recordings of
others with plates, imported without them, needed it when the total of both feet was shared out by
the vertical force that is expected."""
WIDER_WITH_TOTAL: Final = np.array([[1.2], [1.5], [1.3], [1.4], [1.2], [1.1], [1.0]])
"""The same, of people whose markers say the total (`python -m claims elsewhere.laboratories`)."""

OFFSETS: Final = {"hip_flexion": 0.005, "knee_angle": -0.001}
"""Arms of the vertical force, m, that moments (flexion positive) of people whom `gaitval import`
read have beside those that are estimated: about other hip centres and on other plates than those of
the built-in people. Mean of six laboratories, each as heavy (standard deviation between them 0.007
both): `python -m claims elsewhere.laboratories`. Without what people of all laboratories say
of moments they were 0.029 and -0.015.
"""


class Lever(NamedTuple):
    """A number of the body by which a curve of kinetics differs in proportion to an expected one.

    Attributes
    ----------
    of : the field of `Deviation`.
    moved, by : places in `KINETICS`, of what differs and of what is expected.
    anywhere : whether it is the same in every laboratory.
    """

    of: Literal["step_width", "pelvic_width"]
    moved: int
    by: int
    anywhere: bool


_MEDIAL: Final = KINETICS.index(("forces", "medial"))
_VERTICAL: Final = KINETICS.index(("forces", "vertical"))
_ANKLE: Final = KINETICS.index(("moments", "ankle_angle"))
_ELSEWHERE: Final = [
    KINETICS.index(("moments", name)) for name in ("hip_flexion", "hip_adduction", "knee_angle")
]
"""What that says of people of another laboratory, too: forces follow from their total, and of
ankles more people are known."""
LEVERS: Final = (
    Lever("step_width", _MEDIAL, _MEDIAL, anywhere=True),
    Lever(
        "pelvic_width",
        KINETICS.index(("moments", "hip_flexion")),
        _VERTICAL,
        anywhere=False,
    ),
)


@dataclass(frozen=True)
class Estimate:
    """Kinetics of a person, right and left side, n samples of each side's own cycle, in the units
    of a `NormalForm` (`deviations.units`).

    Attributes
    ----------
    kinetics : (2, 7, n) `KINETICS`.
    expected : (2, 7, n) of anybody at this speed.
    half_width : (7, n) of the band of `ESTIMATE.band`, by how far the estimates of others are off.
    weights : (7, n) w.
    regressed, own : (2, 7, n) l + r, and f - s.
    looked_at_angles : whether the regression was used.
    insoles_leave : (7,) share of the error, as `gaitval.subjects.prediction.worth` has it.
    """

    kinetics: Array
    expected: Array
    half_width: Array
    weights: Array
    regressed: Array
    own: Array
    looked_at_angles: bool
    insoles_leave: Array


def _shape(curves: Array) -> Array:
    return np.asarray(curves - curves.mean(axis=-1, keepdims=True))


def _level(curves: Array) -> Array:
    return np.asarray(curves.mean(axis=-1, keepdims=True))


Blocks = tuple[Array, ...]


def _blocks(of: Deviation) -> list[Blocks]:
    """What each of the four regressions looks at: blocks (2, k, m) that count equally."""
    shape = _shape(np.concatenate([of.sagittal, of.other], axis=1))
    stride_time = np.full((2, 1, 1), of.stride_time)
    return [
        (_level(of.sagittal), _shape(of.sagittal)),
        (shape,),
        (shape, shape[::-1]),  # of this leg and of the other
        (_level(of.sagittal), _shape(of.sagittal), _level(of.other), _shape(of.other), stride_time),
    ]


class _Ridge(NamedTuple):
    """A regression: the RMS of each curve of each block, and features (2p, m) with their
    coefficients (2p, q) of p trials.
    """

    scales: tuple[Array, ...]
    features: Array
    coefficients: Array

    def of(self, blocks: Blocks) -> Array:
        """(2, q) for both legs."""
        return np.asarray(_features(blocks, self.scales) @ self.features.T @ self.coefficients)


def _features(blocks: Blocks, scales: Sequence[Array]) -> Array:
    """(2, m): every curve in units of how much people differ in it, every block as heavy."""
    scaled = [each / rms / np.sqrt(each[0].size) for each, rms in zip(blocks, scales, strict=True)]
    return np.concatenate([each.reshape(2, -1) for each in scaled], axis=1)


def _ridge(seen: Sequence[Blocks], targets: Array) -> _Ridge:
    """By least squares through the legs of p trials; `targets` (2p, q)."""
    scales = tuple(
        np.sqrt(np.mean(np.square(each), axis=(0, 1, 3)))[:, None]
        for each in map(np.array, zip(*seen, strict=True))
    )
    features = np.concatenate([_features(blocks, scales) for blocks in seen])
    gram = features @ features.T
    gram += ESTIMATE.noise * np.trace(gram) / len(gram) * np.eye(len(gram))
    return _Ridge(scales, features, np.linalg.solve(gram, targets))


def _levered(
    found: Sequence[Deviation],
    of: Deviation,
    levers: Sequence[Lever],
    others: Sequence[Deviation] = (),
) -> tuple[Array, list[Array]]:
    """What `levers` say of another person's kinetics, (2, 7, n), by `found`; and what they leave of
    these and of `others`, who do not say how much they count.
    """
    explained, every = np.zeros_like(of.usual), [*found, *others]
    rest = [each.kinetics.copy() for each in every]
    for of_what, moved, by, _ in levers:
        arms = [getattr(each, of_what) * each.usual[:, by] for each in every]
        known = list(zip(arms, rest, strict=True))[: len(found)]
        upper = sum(np.sum(arm * left[:, moved]) for arm, left in known)
        lower = sum(np.sum(arm**2) for arm, _ in known) * (1.0 + ESTIMATE.noise / len(found))
        share = upper / lower if lower > 0.0 else 0.0
        for arm, left in zip(arms, rest, strict=True):
            left[:, moved] -= share * arm
        explained[:, moved] += share * getattr(of, of_what) * of.usual[:, by]
    return explained, rest


def _explained(found: Sequence[Deviation], targets: Sequence[Array], of: Deviation) -> Array:
    """(2, k, n) what the gaits `found` say of another person's, of their `targets` (2, k, n)."""
    seen, flat = list(zip(*map(_blocks, found), strict=True)), np.concatenate([*targets])
    by_kind = [
        _ridge(kind, flat.reshape(len(flat), -1)).of(mine)
        for kind, mine in zip(seen, _blocks(of), strict=True)
    ]
    return np.asarray(np.mean(by_kind, axis=0).reshape(2, *flat.shape[1:]))


def _regressed(
    found: Sequence[Deviation], rest: Sequence[Array], of: Deviation
) -> tuple[Array, Array]:
    """What the gaits `found` say of the `rest` of kinetics and of the fit (2, 7, n) of another
    person's.
    """
    both = [np.concatenate([r, each.fit], axis=1) for r, each in zip(rest, found, strict=True)]
    kinetics, fit = np.split(_explained(found, both, of), 2, axis=1)
    return kinetics, fit


def _through_all(
    people: Sequence[Sequence[Deviation]],
    others: Sequence[Deviation],
    rest: Sequence[Array],
    of: Deviation,
) -> Array:
    """(2, 7, n) what gaits of `people` and rows of other laboratories say of the `rest` of another
    person's kinetics. A regression is weighted by rows that are as much larger.
    """
    count = len(people)
    weights = [(1.0 - SHARE) / count / len(each) for each in people for _ in each]
    weights += [SHARE] * len(others)
    every = [each for person in people for each in person] + [*others]
    heavy = [
        each._replace(
            sagittal=root * each.sagittal,
            other=root * each.other,
            stride_time=root * each.stride_time,
        )
        for root, each in zip(np.sqrt(weights), every, strict=True)
    ]
    targets = [root * left for root, left in zip(np.sqrt(weights), rest, strict=True)]
    return _explained(heavy, targets, of)


class _Parts(NamedTuple):
    """Of one person: what levers and regression say of the kinetics, and mechanics' own part."""

    regressed: Array
    own: Array


def _parts(
    of: Deviation,
    trial: DeviationTrial,
    people: Sequence[Sequence[DeviationTrial]],
    without: str,
    angles: bool,
    laboratories: Laboratories,
) -> _Parts:
    """Of a `trial` that differs as `of` from what is expected of anybody; nothing is read of the
    person called `without`.
    """
    at_home, others = deviations(people), differences(laboratories, people)
    found = [each for person in at_home for each in person]
    levers = [each for each in LEVERS if angles or each.anywhere]
    explained, rest = _levered(found, of, levers, others)
    by_all = explained + _through_all(at_home, others, rest, of)
    if not angles:
        explained[:, _ELSEWHERE] = by_all[:, _ELSEWHERE]
        return _with_ankles(_Parts(explained, of.fit), trial, of.usual, without, angles)
    kinetics, fit = _regressed(found, rest[: len(found)], of)
    parts = _Parts(explained + kinetics, of.fit - fit)
    parts = _with_ankles(parts, trial, of.usual, without, angles)
    return parts._replace(
        regressed=parts.regressed + ESTIMATE.all_share * (by_all - parts.regressed)
    )


def _with_ankles(
    parts: _Parts, trial: DeviationTrial, usual: Array, without: str, angles: bool
) -> _Parts:
    """The `parts` of a `trial`, with what the ankles of more people say of its ankles' moments.
    `usual` (2, 7, n) is expected of anybody; nothing is read of the person called `without`.
    """
    known = ankle_moment(trial.ankle_angles, trial.gait.speed, {trial.person, without})
    regressed = parts.regressed.copy()
    if angles:
        # What is expected of anybody is known from both.
        differs = known.change + 0.5 * (known.usual - usual[:, _ANKLE])
        regressed[:, _ANKLE] += ESTIMATE.ankle_share * (differs - regressed[:, _ANKLE])
    else:
        regressed[:, _ANKLE] += ESTIMATE.ankle_share * known.change
    return parts._replace(regressed=regressed)


def _weights(remains: Sequence[Array], own: Sequence[Array], errors: Sequence[Array]) -> Array:
    """(7, n) w in 0 to 1, least squares of what remains by mechanics' own part `ESTIMATE.near` each
    phase; each person's squared error counts against that of the expectation.
    """
    upper, lower = (
        sum(np.mean(a * f, axis=0) / e[:, None] for a, f, e in zip(by, own, errors, strict=True))
        for by in (remains, own)
    )
    near = ESTIMATE.near * remains[0].shape[-1] / 100.0
    upper, lower = (gaussian_filter1d(each, near, axis=1, mode="wrap") for each in (upper, lower))
    return np.asarray(np.clip(upper / np.maximum(lower, 1e-30), 0.0, 1.0))


def estimate(
    trial: DeviationTrial,
    people: Sequence[Sequence[DeviationTrial]],
    *,
    angles: bool = True,
    laboratories: Laboratories | None = None,
) -> Estimate:
    """The kinetics of a person whose forces were not recorded, from angles, times and fit of their
    `trial`; kinetics of its gait are not read. `people` are the trials of others, at least four,
    the own first. `angles`: look at how angles differ, too: only for people of the others'
    laboratory. `laboratories`: people of others, else those that come with the package.
    """
    known = stored() if laboratories is None else laboratories
    remains, own, errors = [], [], []
    for i, person in enumerate(people):
        rest = [*people[:i], *people[i + 1 :]]
        truth = deviation(person[0], rest)
        parts = _parts(truth, person[0], rest, trial.person, angles, known)
        remains.append(truth.kinetics - parts.regressed)
        own.append(parts.own)
        errors.append(np.mean(truth.kinetics**2, axis=(0, 2)))
    weights = _weights(remains, own, errors)
    # what is missed of a person is so with the weight that the others choose
    missed = []
    for i, (left, mechanics) in enumerate(zip(remains, own, strict=True)):
        others = [[*each[:i], *each[i + 1 :]] for each in (remains, own, errors)]
        missed.append(left - _weights(*others) * mechanics)
    # With few people the band is wider than the normal distribution's, by Student's t. What was
    # missed is of people who were left out, so it has the error of the others' mean in it.
    seen = [
        MissedPerson(off, kinetics_of(person[0].gait))
        for off, person in zip(missed, people, strict=True)
    ]
    wide = student.ppf(0.5 + 0.5 * ESTIMATE.band, len(people) - 1)
    half_width = wide * np.sqrt(np.mean(np.square(missed), axis=(0, 1)))
    half_width = half_width if angles else WIDER_ELSEWHERE * half_width
    of = deviation(trial, people)
    parts = _parts(of, trial, people, trial.person, angles, known)
    kinetics = of.usual + parts.regressed + weights * parts.own
    kinetics[:, -1] = np.maximum(kinetics[:, -1], 0.0)  # the ground does not pull
    left = left_by_insoles(seen)
    return Estimate(kinetics, of.usual, half_width, weights, *parts, angles, left)


def about_imported_joints(found: Estimate) -> Estimate:
    """What was `found` without angles, of a person of another laboratory: with the `OFFSETS`."""
    kinetics, regressed = found.kinetics.copy(), found.regressed.copy()
    for name, lever in OFFSETS.items():
        moved = lever * STANDARD_GRAVITY * found.expected[:, _VERTICAL]
        for values in (kinetics, regressed):
            values[:, KINETICS.index(("moments", name))] += moved
    return replace(found, kinetics=kinetics, regressed=regressed)
