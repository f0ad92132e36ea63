"""Why curves are not those of a walker: what would make them so.

A curve that is wrong at one place of the cycle may have the other sign, belong to the other side's
cycle, to another joint, begin at toe-off, or be of stance alone; each calls for another remedy, and
the wrong one makes a silent mistake. So each of these is undone, and the one that brings the curves
nearest to healthy people's is named.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, mirrored
from gaitval.datasets.curve_signs import POSITIVE, healthy
from gaitval.gait.mean_curves import stance_fraction
from gaitval.gait.sampling import SAMPLES

NEAR: Final = 0.8
"""Distance from healthy people's, in their own standard deviation over the cycle: angles of the ten
built-in people are up to 0.63 off, their moments up to 1.0."""
BETTER: Final = 1.6
"""How many times smaller the distance must be with a cause undone."""
ALIKE: Final = 1.5
"""`NEAR` for two angles of pelvis or hip: of 114 people none is so near with names exchanged."""
AS_GOOD: Final = 1.3
"""A second cause that explains the curves nearly as well is named too."""
LATE: Final = 12
"""Rows. Healthy people's curves are up to 5 earlier or later than the mean, amputees' up to 11
later."""
TOE_OFF: Final = 62
"""% of the cycle, usual."""
LOADED: Final = 0.18
"""Nm/kg on the ankle of a foot in the air, 2 % after toe-off or later; the ten have up to 0.06."""
STAIRS: Final = (45.0, 80.0)
"""deg. Who strikes the ground with the knees bent by the first, and bends them by the second,
climbs or crouches."""
LONG: Final = {"r": "right", "l": "left"}
_A_SIGN: Final = re.compile(r"\w+ has the other sign|the \w+ of this side have the other sign")
SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")

Curves = Mapping[str, Array]


class Undone(NamedTuple):
    """What may have become of curves, as a sentence without its point; how far they are from
    healthy people's if it is undone.
    """

    words: str
    rest: float


def moved(values: Array, rows: int) -> Array:
    """A closed curve (101,), so many rows later."""
    once = np.roll(values[:-1], rows)
    return np.append(once, once[0])


def distance(curves: Curves, usual: Curves) -> float:
    """Of curves from the `usual` ones, in these ones' standard deviation over the cycle; offsets
    count half, for zeros differ.
    """
    parts = []
    for name, each in usual.items():
        off = curves[name] - each
        parts.append((off.var() + 0.25 * off.mean() ** 2) / each.var())
    return float(np.sqrt(np.mean(parts)))


@cache
def usual_of(kind: str) -> Mapping[str, Array]:
    """Healthy people's curves by name without side; forces of the ten built-in people, those to the
    left as of a right foot, inward.
    """
    if kind == "force":
        from gaitval.datasets.subject_file import builtin_subjects

        phase = np.linspace(0.0, 1.0, SAMPLES) % 1.0
        inward = np.array([1.0, 1.0, 1.0]), np.array([1.0, -1.0, 1.0])
        seen = [
            subject.measured().ground_reaction(side, phase) * sign
            for subject in builtin_subjects()
            for side, sign in zip(SIDES, inward, strict=True)
        ]
        return dict(zip(("forward", "left", "up"), np.mean(seen, axis=0).T, strict=True))
    names = (*SAGITTAL, "hip_adduction") if kind == "moment" else SAGITTAL
    return {name: healthy()[f"{kind}_{name}"] for name in names}


def explained(kind: str, side: str, curves: Mapping[str, Array]) -> str:
    """A sentence on what makes the `curves` of a `kind` ("angle", "moment", "force") of one side,
    by their names without the kind, unlike a walker's; empty if nothing explains it.
    """
    usual = usual_of(kind)
    sign = -1.0 if kind == "force" and side == "l" else 1.0
    own = {name: curves[f"{name}_{side}"] * (sign if name == "left" else 1.0) for name in usual}
    as_it_is = distance(own, usual)
    found = sorted(_causes(kind, side, own, usual), key=lambda each: each.rest)
    least = found[0].rest
    if least > NEAR or as_it_is < BETTER * least:
        return ""
    words = list(dict.fromkeys(each.words for each in found if each.rest < AS_GOOD * least))[:2]
    said = words[0] if len(words) == 1 else f"either {words[0]}, or {words[1]}: look which it is"
    return (
        f"{said} (as they are, the curves of this side are {as_it_is / least:.1f} times as far "
        "from healthy people's)"
    )


def advised(kind: str, side: str, curves: Mapping[str, Array], advice: str) -> str:
    """What to do about curves of a side that are not a walker's: the cause that explains them, or
    else the `advice`, which also stays where a sign explains them best.
    """
    cause = explained(kind, side, curves)
    if not cause or (advice.startswith("Change") and _A_SIGN.match(cause)):
        return advice
    return f"It seems that {cause}."


def doubts(
    degrees: Mapping[str, Array], moments: Mapping[str, Array], forces: Mapping[str, Array]
) -> Iterator[str]:
    """A sentence on each thing that may be wrong in curves (101,) by their names without the kind,
    though people may walk so: angles in deg, moments in Nm/kg, forces in body weights.
    """
    yield from _empty("angle", degrees)
    yield from _empty("moment", moments)
    if degrees and all(
        np.array_equal(values, degrees[mirrored(name)])
        for name, values in degrees.items()
        if mirrored(name) in degrees
    ):
        yield (
            "right and left have the same angles to the last digit: one side is a copy of the "
            "other, or both are the mean of both. What is found of right against left means nothing"
        )
    for side in "rl":
        if cause := explained("angle", side, degrees):
            yield f"angles of the {LONG[side]} side: it seems that {cause}."
        if moments and (cause := explained("moment", side, moments)):
            yield f"moments of the {LONG[side]} side: it seems that {cause}."
        if moments and forces:
            yield from _late_moment(moments, forces, side)
    yield from _exchanged(degrees)
    bent = [float(degrees[f"knee_angle_{side}"][0]) for side in "rl"]
    most = min(float(degrees[f"knee_angle_{side}"].max()) for side in "rl")
    if min(bent) > STAIRS[0] and most > STAIRS[1]:
        yield (
            f"the knees are bent by {bent[0]:.0f} and {bent[1]:.0f}° when the foot strikes: these "
            "look like strides on stairs. gaitval takes level walking; go on only if this person "
            "walks in so deep a crouch."
        )


def _empty(kind: str, curves: Mapping[str, Array]) -> Iterator[str]:
    still = [name for name, values in curves.items() if np.ptp(values) < 1e-9]
    if still:
        listed = ", ".join(f"{kind}_{name}" for name in still)
        yield (
            f"{listed}: the same number in all rows, so it was not measured. What is found about "
            "it means nothing."
        )


def load_in_the_air(ankle: Array, after: int) -> float:
    """Nm/kg, the largest moment of an `ankle` (101,) from the row `after` on, without those before
    the next strike.
    """
    return float(np.abs(ankle[after:97]).max(initial=0.0))


def _late_moment(
    moments: Mapping[str, Array], forces: Mapping[str, Array], side: str
) -> Iterator[str]:
    """A sentence if the ankle is loaded while its foot is in the air."""
    after = int(np.ceil(100 * stance_fraction(forces[f"up_{side}"]))) + 2
    late = load_in_the_air(moments[f"ankle_angle_{side}"], after)
    if late > LOADED:
        yield (
            f"moment_ankle_angle_{side}: {late:.2g} Nm/kg after the foot has left the ground "
            f"({after} % and later): the moments are later than the forces, or much smoother."
        )


def _exchanged(degrees: Mapping[str, Array]) -> Iterator[str]:
    """A sentence on each two angles that are healthy people's with their names exchanged."""
    names = [name for name in POSITIVE if all(f"{name}_{side}" in degrees for side in "rl")]
    for one, other in combinations(names, 2):
        usual = {name: healthy()[f"angle_{name}"] for name in (one, other)}
        own, exchanged = [], []
        for side in "rl":
            first, second = degrees[f"{one}_{side}"], degrees[f"{other}_{side}"]
            own.append(distance({one: first, other: second}, usual))
            exchanged.append(distance({one: second, other: first}, usual))
        if max(exchanged) < ALIKE and min(own) > BETTER * max(exchanged):
            yield (
                f"angle_{one} and angle_{other}: {min(own) / max(exchanged):.1f} times nearer to "
                "healthy people's with the names exchanged, on both sides. Are they?"
            )


def _causes(kind: str, side: str, own: Curves, usual: Curves) -> Iterator[Undone]:
    def of(*names: str) -> str:
        return " and ".join(f"{kind}_{name}_{side}" for name in names)

    def undone(words: str, **changed: Array) -> Undone:
        return Undone(words, distance({**own, **changed}, usual))

    def all_by(change: Callable[[Array], Array]) -> dict[str, Array]:
        return {name: change(values) for name, values in own.items()}

    every = "the forces on this foot" if kind == "force" else f"the {kind}s of this side"
    shifts = [
        undone(_shifted(every, rows), **{name: moved(own[name], rows) for name in own})
        for rows in range(SAMPLES - 1)
    ]
    best = int(np.argmin([each.rest for each in shifts]))
    if LATE <= best <= SAMPLES - 1 - LATE:
        yield shifts[best]
    yield undone(f"the rows of {every} run backwards", **all_by(lambda values: values[::-1]))
    yield undone(f"{every} have the other sign", **all_by(np.negative))
    for name in own:
        yield undone(f"{of(name)} has the other sign", **{name: -own[name]})
        yield undone(
            f"{of(name)} is over the other side's cycle, half a stride off",
            **{name: moved(own[name], SAMPLES // 2)},
        )
    for one, other in combinations(own, 2):
        yield undone(f"{of(one, other)} are exchanged", **{one: own[other], other: own[one]})
        yield undone(
            f"{of(one, other)} have the other sign", **{one: -own[one], other: -own[other]}
        )
    rows = np.arange(SAMPLES)
    for words, at in (
        (f"the rows of {every} are of stance alone", 0.01 * TOE_OFF * rows),
        (f"the rows of {every} are two cycles", 2.0 * rows % (SAMPLES - 1)),
    ):
        yield Undone(words, distance(own, {n: np.interp(at, rows, v) for n, v in usual.items()}))


def _shifted(every: str, rows: int) -> str:
    """What curves are that have to come `rows` later to be a walker's."""
    if abs(rows - SAMPLES // 2) <= 4:
        return f"{every} are over the other side's cycle, half a stride off"
    if abs(rows - TOE_OFF) <= 5:
        return f"the rows of {every} begin at toe-off, not at heel strike"
    early = rows if rows < SAMPLES // 2 else rows - (SAMPLES - 1)
    return f"{every} are {abs(early)} % of the cycle too {'early' if early > 0 else 'late'}"
