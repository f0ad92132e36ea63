"""Whether mean curves can be those of a walker, and which mistake explains them if not.

A table of curves is held against what is known of walkers: the offsets and shapes of healthy
people's curves; that right and left are alike and have one pelvis; that the flat foot is level and
the thigh upright; that the angles of a leg turn its foot as the foot's own angles say; that moments
of neighbouring joints differ by the lever of the ground reaction, and that a foot in the air loads
no ankle. Each of `curve_mistakes` is undone, and `gaitval.consistency` weighs what is left.

The spread is that between the ten built-in people, and wider: each group of numbers may be off by
its own factor, as a patient's are.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.consistency import ADVISED, OTHER, WIDEST, Change, Verdict, log_likelihood, weigh
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import AXES, SIDES
from gaitval.gait.sampling import SAMPLES
from gaitval.model.rotations import foot_angles
from gaitval.scaling.anthropometry import STATURE, WINTER
from gaitval.subjects.curve_mistakes import (
    POSITIVE,
    PRIORS,
    Curves,
    Mistake,
    later,
    mistakes,
)

HARMONICS: Final = 5
"""Of a curve's shape."""
FLAT: Final = slice(15, 36)
"""Rows, % of the cycle, in which the foot is flat; the soles of 104 people, patients and amputees
among them, are level then to 5°."""
ON_ONE_LEG: Final = slice(15, 46)
"""Rows of single stance: no impact, and the weight and inertia of the leg are small beside the
ground reaction."""

LEAST: Final[Mapping[str, tuple[float, float, float]]] = {
    "angle": (1.0, 5.0, 3.0),
    "moment": (0.04, 0.05, 0.05),
    "force": (0.01, 0.01, 0.01),
    "sole": (2.0, 0.0, 0.0),
    "size": (0.3, 0.0, 0.0),
}
"""deg, Nm/kg, body weights: standard deviation that is added to that between the ten people, of a
harmonic, of the mean of a curve, and of the mean of right less left. Zeros of angles differ between
laboratories by more than between people of one."""
BEYOND: Final[Mapping[str, float]] = {
    "shape": 8.0, "sides": 8.0, "offset": 4.0, "level": 3.0, "size": 2.0,
    "pelvis": 4.0, "sole": 4.0, "thigh": 4.0, "chain": 4.0, "balance": 4.0, "air": 4.0,
}  # fmt: skip
"""Times the standard deviation that a group of numbers of a patient may be off: chosen on half of
the 104 people of `experiments` and on the ten."""
INDEPENDENT: Final = 0.5
"""Share of a group's numbers that count, for neighbouring harmonics go together."""
DISTURBED: Final = 0.1
"""Share of the groups that a mistake disturbs of which nobody thought."""
HOPELESS: Final = 20.0
"""Log likelihood below the best so far, from which a mistake is not looked at further."""
UNEXPLAINED: Final = 0.4
"""Log likelihood of a group of numbers, in the mean of all, below that of healthy people's means,
from which on the curves are no walker's: 0.2 of one of the ten, 0.7 of one who runs."""
UNTOLD: Final = 3.0
"""Log likelihood that a sign must cost to be known."""

_SAGITTAL: Final = ("hip_flexion", "knee_angle", "ankle_angle")
_FRONTAL: Final = ("hip_adduction", "knee_adduction", "subtalar_angle")
_UP_DOWN: Final = ("hip_rotation", "knee_rotation", "ankle_rotation")
_PELVIS: Final = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
_FOOT: Final = ("foot_pitch", "foot_list", "foot_progression")
_STILL: Final = np.zeros(SAMPLES)


@dataclass(frozen=True)
class Group:
    """Numbers that belong together, and that may be off by one factor.

    Attributes
    ----------
    kind : without the side: groups of a kind have one mean and spread.
    needs : the curves that they are of.
    """

    kind: str
    needs: tuple[str, ...]
    values: Callable[[Curves], Array]

    @property
    def sort(self) -> str:
        """Of `BEYOND`."""
        return self.kind.partition(" ")[0]


@dataclass(frozen=True)
class Judged:
    """What is thought of a table of curves.

    Attributes
    ----------
    verdict : its causes, in words.
    named : the mistakes that these are.
    untold : angles, without kind and side, whose sign the curves do not show.
    explained : whether the curves without the likeliest mistake are a walker's.
    """

    verdict: Verdict
    named: tuple[Mistake, ...]
    untold: tuple[str, ...]
    explained: bool = True

    @property
    def words(self) -> str:
        """A sentence on what is wrong, and what to do; empty if nothing is."""
        if not self.verdict.named:
            return ""
        if not self.named:
            return (
                f"these curves contradict each other, or are no walker's: {self.verdict}. No known "
                "mistake explains them; look at each curve."
            )
        if not self.explained:
            return (
                f"these are no walker's curves: not even if {self.verdict}. Look at each curve, "
                "and whether the rows are one cycle of walking."
            )
        remedy = self.verdict.remedy
        advice = f" {remedy[0].upper()}{remedy[1:]}." if remedy else ""
        return f"it seems that {self.verdict}.{advice}"

    @property
    def unseen(self) -> str:
        """A sentence on angles whose sign the curves do not show; empty if they show all."""
        listed = "; ".join(f"{name}: {POSITIVE[name]}" for name in self.untold if name in POSITIVE)
        if not listed:
            return ""
        return f"these curves do not show whether the sign is right of {listed}. Look it up."

    @property
    def refused(self) -> bool:
        """Whether it is certain that no walker has these curves. Angles outside the sagittal plane
        and zeros are a matter of definition, and are only said.
        """
        return (
            self.verdict.sound < 1.0 - ADVISED
            and len(self.named) == len(self.verdict.named) > 0
            and not any(
                each.family in ("offset", "thigh") or _by_the_way(each) for each in self.named
            )
        )


def _by_the_way(mistake: Mistake) -> bool:
    return all(
        name.startswith("angle_") and name[6:-2] not in _SAGITTAL for name in mistake.columns
    )


@dataclass(frozen=True)
class People:
    """To whom curves are compared.

    Attributes
    ----------
    expected : mean curves (101,) by name; right and left have one.
    spread : mean and standard deviation of each kind of `groups`.
    """

    expected: Curves
    spread: Mapping[str, tuple[Array, Array]]


def judge_curves(curves: Curves) -> Judged:
    """What may be wrong with `curves` of both sides; those that healthy people have are looked
    at.
    """
    people = _built_in()
    expected = people.expected
    own = {n: c for n, c in curves.items() if n in expected and np.ptp(c) > 0.0}
    likely = _Likelihood(own, people)
    tried = list(mistakes(own, expected))
    members: dict[str, set[str]] = {}
    for each in tried:
        members.setdefault(each.family, set()).add(each.name)
    logs = [likely.without(each) for each in tried]
    by_words = {each.words: each for each in tried}
    verdict = weigh(
        [
            (
                Change(
                    each.name, each.words, PRIORS[each.family] / len(members[each.family]),
                    each.remedy, alters=bool(each.remedy),
                ),
                log,
            )
            for each, log in zip(tried, logs, strict=True)
        ],
        likely.sound, 0.0, square=0.0, other=likely.other,
    )  # fmt: skip
    untold = () if verdict.named else tuple(
        each.columns[0][6:-2]
        for each, log in zip(tried, logs, strict=True)
        if each.family == "sign" and each.columns[0].startswith("angle_")
        and log > likely.sound - UNTOLD
    )  # fmt: skip
    named = [by_words[c.change.words] for c in verdict.named if c.change.name != OTHER.name]
    explained = max(likely.best, likely.sound) > likely.perfect - UNEXPLAINED * len(likely.groups)
    return Judged(verdict, tuple(named), untold, explained)


_SQUARES: Final = np.linspace(-8.0, 25.0, 400)
"""Logarithms of squares, between which a likelihood is interpolated."""


@cache
def _logs(count: float, widest: float) -> Array:
    return np.array([log_likelihood(float(np.exp(each)), count, widest) for each in _SQUARES])


class _Likelihood:
    """Of a table of curves, as it is and with a mistake undone."""

    def __init__(self, curves: Curves, people: People) -> None:
        self.curves, self.known = curves, people.spread
        found = [each for each in groups(tuple(curves)) if each.kind in self.known]
        # What costs most to compute is looked at last.
        self.groups = sorted(found, key=lambda each: len(each.needs))
        self.touched: dict[str, set[int]] = {}
        for i, group in enumerate(self.groups):
            for name in group.needs:
                self.touched.setdefault(name, set()).add(i)
        self.now = [self._log(each, curves) for each in self.groups]
        perfect = [float(_logs(self._count(each), BEYOND[each.sort])[0]) for each in self.groups]
        self.perfect = sum(perfect)
        self.hopes = [most - log for most, log in zip(perfect, self.now, strict=True)]
        self.sound = self.best = sum(self.now)
        self.other = sum(
            float(np.logaddexp(np.log1p(-DISTURBED) + log, np.log(DISTURBED) + wide))
            for log, wide in zip(
                self.now, (self._log(each, curves, WIDEST) for each in self.groups), strict=True
            )
        )

    def without(self, mistake: Mistake) -> float:
        """Log likelihood of the curves without a `mistake`; a little too high if it is hopeless."""
        changed = mistake.changes(self.curves)
        after = {**self.curves, **changed}
        touched = sorted(set().union(*(self.touched[name] for name in changed)))
        total, hope = self.sound, sum(self.hopes[i] for i in touched)
        for i in touched:
            total += self._log(self.groups[i], after) - self.now[i]
            hope -= self.hopes[i]
            if total + hope < self.best - HOPELESS:
                break
        self.best = max(self.best, total)
        return total

    def _count(self, group: Group) -> float:
        size = len(self.known[group.kind][0])
        return INDEPENDENT * size if size > 1 else 1.0

    def _log(self, group: Group, curves: Curves, widest: float | None = None) -> float:
        mean, deviation = self.known[group.kind]
        off = (group.values(curves) - mean) / deviation
        count = self._count(group)
        square = np.log(count / len(off) * float(off @ off) + 1e-3)
        return float(np.interp(square, _SQUARES, _logs(count, widest or BEYOND[group.sort])))


# ---- What is looked at. ----


def groups(names: Sequence[str]) -> Iterator[Group]:
    """What is looked at in a table of these `names`."""
    for name in names:
        kind, other = name[:-2], f"{name[:-2]}_l"
        # To the left is inward for a right foot, outward for a left one.
        sign = -1.0 if name == "force_left_l" else 1.0
        for sort, reduce in (("offset", _mean), ("shape", _shape)):
            yield Group(f"{sort} {kind}", (name,), _one(reduce, name, sign))
        yield Group(f"size {kind}", (name,), _one(_size, name))
        if name.endswith("_r") and other in names:
            mirror = -1.0 if kind == "force_left" else 1.0
            for sort, reduce in (("sides", _shape), ("level", _mean)):
                yield Group(f"{sort} {kind}", (name, other), _apart(reduce, name, other, mirror))
    for name, sign in zip(_PELVIS, (1.0, -1.0, -1.0), strict=True):
        pair = f"angle_{name}_r", f"angle_{name}_l"
        if set(pair) <= set(names):
            yield Group(
                f"pelvis {name}", pair, _apart(_shape, pair[0], pair[1], sign, SAMPLES // 2)
            )
    for side in "rl":
        yield from _of_leg(names, side)


def _one(
    reduce: Callable[[Array], Array], name: str, sign: float = 1.0
) -> Callable[[Curves], Array]:
    return lambda curves: sign * reduce(curves[name])


def _apart(
    reduce: Callable[[Array], Array], one: str, other: str, sign: float = 1.0, rows: int = 0
) -> Callable[[Curves], Array]:
    """Of `one` curve less the `other`, with a `sign` and so many `rows` later."""
    return lambda curves: reduce(curves[one] - sign * later(curves[other], rows))


def _of_leg(names: Sequence[str], side: str) -> Iterator[Group]:
    def of(kind: str, *parts: str) -> tuple[str, ...]:
        return tuple(f"{kind}_{part}_{side}" for part in parts)

    def there(*wanted: str) -> bool:
        return set(names).issuperset(wanted)

    leg = of("angle", *_SAGITTAL, "pelvis_tilt")
    if there(*leg):
        yield Group("sole", leg, lambda c: _pitch(*(c[n] for n in leg)))
    thigh = of("angle", "hip_adduction", "pelvis_list")
    if there(*thigh):
        yield Group("thigh", thigh, _apart(_shape, thigh[0], thigh[1]))
    turned = of("angle", *_SAGITTAL, *_FRONTAL, *_UP_DOWN, *_PELVIS)
    if there(*turned, *of("angle", *_FOOT)):
        yield Group("chain", (*turned, *of("angle", *_FOOT)), lambda c: _turned_off(c, side))
    forces = of("force", "forward", "left", "up")
    every = (*forces, *turned, *of("moment", *_SAGITTAL, *_FRONTAL, *_UP_DOWN))
    moved = tuple(name for name in every if name in names)
    if there(*forces, *leg[:3], *of("moment", *_SAGITTAL)):
        yield Group("balance sagittal", moved, lambda c: _unbalanced(c, side)[:4])
        if there(*of("moment", *_FRONTAL[:2])):
            yield Group("balance frontal", moved, lambda c: _unbalanced(c, side)[4:])
    ankle = f"moment_ankle_angle_{side}"
    if there(forces[2], ankle):
        yield Group("air", (forces[2], ankle), lambda c: _in_the_air(c[ankle], c[forces[2]]))


def _waves() -> Array:
    phase = 2.0 * np.pi * np.arange(SAMPLES - 1) / (SAMPLES - 1)
    waves = [wave(k * phase) for k in range(1, HARMONICS + 1) for wave in (np.cos, np.sin)]
    return np.asarray(np.sqrt(2.0) * np.array(waves) / (SAMPLES - 1))


_WAVES: Final = _waves()


def _shape(curve: Array) -> Array:
    """Cosines and sines of the harmonics of a curve (101,), as their RMS over the cycle."""
    return np.asarray(_WAVES @ curve[:-1])


def _size(curve: Array) -> Array:
    """Logarithm, (1,), of the standard deviation of a curve over the cycle: it shows the unit."""
    return np.log([np.std(curve) + 1e-6])


def _mean(curve: Array) -> Array:
    return np.asarray(curve[:-1].mean(keepdims=True))


def _pitch(hip: Array, knee: Array, ankle: Array, tilt: Array) -> Array:
    """deg, (1,), of the flat foot by the angles of the leg."""
    return np.array([(hip - knee + ankle - tilt)[FLAT].mean()])


def _in_the_air(ankle: Array, up: Array) -> Array:
    """Nm/kg, RMS of the ankle's moment while its foot is in the air, and two rows off the ends."""
    loaded = up[:-1] > 0.02
    near = np.any([np.roll(loaded, rows) for rows in range(-2, 3)], axis=0)
    return np.sqrt([np.mean(ankle[:-1][~near] ** 2) if not near.all() else 0.0])


def _axes(side: str) -> tuple[tuple[Array, Array, Array], ...]:
    """Of hip, knee and ankle: the axes of flexion, adduction and internal rotation."""
    names = ("hip_flexion", "knee_angle", "hip_adduction", "hip_rotation")
    flexion, knee, adduction, rotation = (np.array(AXES[f"{name}_{side}"]) for name in names)
    return tuple((bend, adduction, rotation) for bend in (flexion, knee, flexion))


_JOINTS: Final = tuple(zip(_SAGITTAL, _FRONTAL, _UP_DOWN, strict=True))


def _turns(curves: Curves, side: str, rows: slice) -> list[Rotation]:
    """Orientations of thigh, shank and foot in the ground's axes; angles that are not given are
    0.
    """
    axes = _axes(side)

    def turn(name: str, axis: Array) -> Rotation:
        degrees = curves.get(f"angle_{name}_{side}", _STILL)[rows]
        return Rotation.from_rotvec(np.outer(np.radians(degrees), axis))

    # Own side forward is internal rotation's axis, own side up adduction's reversed, anterior tilt
    # flexion's reversed.
    flexion, adduction, rotation = axes[0]
    at = (
        turn("pelvis_rotation", rotation)
        * turn("pelvis_list", -adduction)
        * turn("pelvis_tilt", -flexion)
    )
    found = []
    for names, own in zip(_JOINTS, axes, strict=True):
        for name, axis in zip(names, own, strict=True):
            at = at * turn(name, axis)
        found.append(at)
    return found


def _turned_off(curves: Curves, side: str) -> Array:
    """deg, (3,), RMS by which the angles from pelvis to ankle turn the foot otherwise than its own
    angles do.
    """
    rows = slice(0, SAMPLES, 5)
    seen = np.stack([curves[f"angle_{name}_{side}"][rows] for name in _FOOT], axis=1)
    turned = _turns(curves, side, rows)[-1].as_matrix()
    off = np.degrees(foot_angles(turned, "right" if side == "r" else "left")) - seen
    return np.asarray(np.sqrt(np.mean(off**2, axis=0)))


_LEVERS: Final = tuple(
    np.array([0.0, 0.0, WINTER[segment] * float(np.mean(list(STATURE.values())))])
    for segment in ("thigh", "shank")
)
"""m, of thigh and shank of a person of mean stature."""


def _unbalanced(curves: Curves, side: str) -> Array:
    """Nm/kg, (6,), mean and slope in single stance of what moments of neighbouring joints differ by
    besides the lever of the ground reaction: hip and knee, knee and ankle about the axis to the
    left, hip and knee about that forward.
    """
    rows = slice(ON_ONE_LEG.start, ON_ONE_LEG.stop, 3)
    turned = _turns(curves, side, rows)
    force = STANDARD_GRAVITY * np.stack(
        [curves[f"force_{axis}_{side}"][rows] for axis in ("forward", "left", "up")], axis=1
    )
    vectors = [
        segment.apply(
            np.sum(
                [
                    np.outer(curves.get(f"moment_{name}_{side}", _STILL)[rows], axis)
                    for name, axis in zip(names, own, strict=True)
                ],
                axis=0,
            )
        )
        for segment, names, own in zip(turned, _JOINTS, _axes(side), strict=True)
    ]
    hip, knee = (
        upper - lower - np.cross(segment.apply(lever), force)
        for upper, lower, segment, lever in zip(vectors, vectors[1:], turned, _LEVERS, strict=False)
    )
    along = np.linspace(-1.0, 1.0, len(force))
    return np.array(
        [
            part
            for rest in (hip[:, 1], knee[:, 1], hip[:, 0])
            for part in (rest.mean(), rest @ along / (along @ along))
        ]
    )


# ---- Of healthy people. ----


@cache
def _tables() -> tuple[Curves, ...]:
    """Curves of the ten built-in people."""
    from gaitval.subjects.subject_file import builtin_subjects

    phase, found = np.linspace(0.0, 1.0, SAMPLES), []
    for subject in builtin_subjects():
        record = subject.measured()
        table = {f"angle_{n}": np.degrees(curve(phase)) for n, curve in record.angles.items()}
        table |= {f"moment_{n}": curve(phase) for n, curve in record.moments.items()}
        for side in SIDES:
            force = record.ground_reaction(side, phase % 1.0)
            table |= {
                f"force_{axis}_{side[0]}": values
                for axis, values in zip(("forward", "left", "up"), force.T, strict=True)
            }
        found.append(table)
    return tuple(found)


@cache
def _built_in() -> People:
    tables, expected = _tables(), {}
    for name in tables[0]:
        mirror = -1.0 if name.startswith("force_left") else 1.0
        other = name[:-1] + {"r": "l", "l": "r"}[name[-1]]
        both = [[each[name], mirror * each[other]] for each in tables]
        expected[name] = np.mean(both, axis=(0, 1))
    return People(expected, _spread_of(tables))


def expected_curve(name: str) -> Array:
    """The mean curve (101,) of healthy people of this `name`."""
    return _built_in().expected[name]


def _spread_of(tables: Sequence[Curves]) -> Mapping[str, tuple[Array, Array]]:
    """Mean and standard deviation of each kind of `groups` between the people of `tables`."""
    seen: dict[str, list[Array]] = {}
    for table in tables:
        for group in groups(tuple(table)):
            seen.setdefault(group.kind, []).append(group.values(table))
    found = {}
    for kind, values in seen.items():
        sort, _, name = kind.partition(" ")
        unit = {"sole": sort, "size": sort, "balance": "moment", "air": "moment"}.get(
            sort, name.partition("_")[0]
        )
        each = {"offset": 1, "level": 2}.get(sort, 0)
        least = LEAST[unit if unit in LEAST else "angle"][each]
        mean = np.mean(values, axis=0)
        if sort in ("sides", "level", "pelvis"):
            mean = 0.0 * mean  # people have no right and no left
        found[kind] = mean, np.sqrt(np.var(values, axis=0, ddof=1) + least**2)
    return found
