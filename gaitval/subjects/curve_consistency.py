"""Whether mean curves can be those of a walker, and which mistake explains them if not.

A table of curves is held against what is known of walkers: the offsets and shapes of healthy
people's curves; that right and left are alike and have one pelvis; that the flat foot is level and
the thigh upright. Each of `curve_mistakes` is undone, and `gaitval.consistency` weighs what is
left.

The spread is that between the ten built-in people, and wider: each group of numbers may be off by
its own factor, as a patient's are.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.consistency import ADVISED, WIDEST, Verdict, log_likelihood, weigh
from gaitval.coordinates import mirrored
from gaitval.gait.sampling import SAMPLES
from gaitval.subjects.curve_mistakes import POSITIVE, Curves, Mistake, later, mistakes

HARMONICS: Final = 5
"""Of a curve's shape."""
FLAT: Final = slice(15, 36)
"""Rows, % of the cycle, in which the foot is flat; the soles of 104 people, patients and amputees
among them, are level then to 5°."""
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


def _waves() -> Array:
    phase = 2.0 * np.pi * np.arange(SAMPLES - 1) / (SAMPLES - 1)
    waves = [wave(k * phase) for k in range(1, HARMONICS + 1) for wave in (np.cos, np.sin)]
    return np.asarray(np.sqrt(2.0) * np.array(waves) / (SAMPLES - 1))


_WAVES: Final = _waves()


def _shape(parts: Array) -> Array:
    """Cosines and sines of the harmonics of the sum of curves (N, 101), as their RMS over the
    cycle.
    """
    return np.asarray(_WAVES @ parts.sum(axis=0)[:-1])


def _mean(parts: Array) -> Array:
    return np.asarray(parts.sum(axis=0)[:-1].mean(keepdims=True))


def _flat(parts: Array) -> Array:
    """Mean, (1,), while the foot is flat."""
    return np.asarray(parts.sum(axis=0)[FLAT].mean(keepdims=True))


def _size(parts: Array) -> Array:
    """Logarithm, (1,), of the standard deviation over the cycle: it shows the unit."""
    return np.log([np.std(parts.sum(axis=0)) + 1e-6])


class Sort(NamedTuple):
    """What is looked at of a curve, or of the sum of some: how it is reduced to numbers; times
    their standard deviation that those of a patient may be off, chosen on half of the 104 people of
    `experiments` and on the ten; and the standard deviation that is added to that between the ten,
    of an angle, deg, a moment, Nm/kg, and a force, body weights. Zeros of angles differ between
    laboratories by more than between people of one.
    """

    reduce: Callable[[Array], Array]
    beyond: float
    least: tuple[float, float, float]


SORTS: Final[Mapping[str, Sort]] = {
    "offset": Sort(_mean, 4.0, (5.0, 0.05, 0.01)),
    "shape": Sort(_shape, 8.0, (1.0, 0.04, 0.01)),
    "size": Sort(_size, 2.0, (0.3, 0.3, 0.3)),
    # Of two curves; people have no right and no left, so that their means are 0.
    "sides": Sort(_shape, 8.0, (1.0, 0.04, 0.01)),
    "level": Sort(_mean, 3.0, (3.0, 0.05, 0.01)),
    "pelvis": Sort(_shape, 4.0, (1.0, 0.0, 0.0)),
    # Of several.
    "sole": Sort(_flat, 4.0, (2.0, 0.0, 0.0)),
    "thigh": Sort(_shape, 4.0, (1.0, 0.0, 0.0)),
}


_SOLE: Final = {"hip_flexion": 1.0, "knee_angle": -1.0, "ankle_angle": 1.0, "pelvis_tilt": -1.0}
_THIGH: Final = {"hip_adduction": 1.0, "pelvis_list": -1.0}
"""Angles that add up to that of the sole to the floor, and of the thigh to the vertical."""


class Group(NamedTuple):
    """Numbers that belong together, and that may be off by one factor: a sort of `SORTS` of curves,
    each with its factor and the rows that it comes later.
    """

    sort: str
    of: str
    terms: tuple[tuple[str, float, int], ...]

    def values(self, curves: Curves) -> Array:
        """The numbers."""
        parts = [
            factor * (later(curves[name], rows) if rows else curves[name])
            for name, factor, rows in self.terms
        ]
        return SORTS[self.sort].reduce(np.array(parts))


def groups(names: Sequence[str]) -> Iterator[Group]:
    """What is looked at in a table of these `names`."""
    return (each for each in _groups(names) if {*names}.issuperset(n for n, *_ in each.terms))


def _groups(names: Sequence[str]) -> Iterator[Group]:
    for name in names:
        curve, left = name[:-2], f"{name[:-2]}_l"
        # To the left is inward for a right foot, outward for a left one.
        sign = -1.0 if name == "force_left_l" else 1.0
        for sort in ("offset", "shape", "size"):
            yield Group(sort, curve, ((name, 1.0 if sort == "size" else sign, 0),))
        if name.endswith("_r"):
            mirror = -1.0 if curve == "force_left" else 1.0
            for sort in ("sides", "level"):
                yield Group(sort, curve, ((name, 1.0, 0), (left, -mirror, 0)))
    for name, sign in (("tilt", 1.0), ("list", -1.0), ("rotation", -1.0)):
        right, left = (f"angle_pelvis_{name}_{side}" for side in "rl")
        yield Group("pelvis", f"angle_{name}", ((right, 1.0, 0), (left, -sign, SAMPLES // 2)))
    for sort, terms in (("sole", _SOLE), ("thigh", _THIGH)):
        for side in "rl":
            of = tuple((f"angle_{name}_{side}", factor, 0) for name, factor in terms.items())
            yield Group(sort, "angle", of)


Spread = Mapping[tuple[str, str], tuple[Array, Array]]
"""Mean and standard deviation of `groups` by their sort and what they are of."""


@cache
def healthy() -> tuple[Curves, Spread]:
    """Mean curves of the ten built-in people, of which right and left are one, and the spread
    between them.
    """
    from gaitval.subjects.curve_template import curves_of
    from gaitval.subjects.subject_file import builtin_subjects

    tables = [curves_of(subject) for subject in builtin_subjects()]
    expected = {}
    for name in tables[0]:
        mirror = -1.0 if name.startswith("force_left") else 1.0
        both = [[each[name], mirror * each[mirrored(name)]] for each in tables]
        expected[name] = np.mean(both, axis=(0, 1))
    seen: dict[tuple[str, str], list[Array]] = {}
    for table in tables:
        for group in groups(tuple(table)):
            seen.setdefault((group.sort, group.of), []).append(group.values(table))
    spread = {}
    for (sort, of), found in seen.items():
        least = SORTS[sort].least[("angle", "moment", "force").index(of.partition("_")[0])]
        mean = np.mean(found, axis=0) * (sort not in ("sides", "level", "pelvis"))
        spread[sort, of] = mean, np.sqrt(np.var(found, axis=0, ddof=1) + least**2)
    return expected, spread


def expected_curve(name: str) -> Array:
    """The mean curve (101,) of healthy people of this `name`."""
    return healthy()[0][name]


_SQUARES: Final = np.linspace(-8.0, 25.0, 400)
"""Logarithms of squares, between which a likelihood is interpolated."""


@cache
def _logs(count: float, widest: float) -> Array:
    return np.array([log_likelihood(float(np.exp(each)), count, widest) for each in _SQUARES])


def _count(group: Group) -> float:
    numbers = len(healthy()[1][group.sort, group.of][0])
    return INDEPENDENT * numbers if numbers > 1 else 1.0


def _log(group: Group, curves: Curves, widest: float | None = None) -> float:
    mean, deviation = healthy()[1][group.sort, group.of]
    off = (group.values(curves) - mean) / deviation
    count = _count(group)
    square = np.log(count / len(off) * float(off @ off) + 1e-3)
    return float(np.interp(square, _SQUARES, _logs(count, widest or SORTS[group.sort].beyond)))


@dataclass(frozen=True)
class Judged:
    """What is thought of a table of curves.

    Attributes
    ----------
    verdict : its causes, in words.
    untold : angles, without kind and side, whose sign the curves do not show.
    explained : whether the curves without the likeliest mistake are a walker's.
    """

    verdict: Verdict
    untold: tuple[str, ...]
    explained: bool

    @property
    def named(self) -> tuple[Mistake, ...]:
        """The mistakes that are named."""
        return tuple(c.change for c in self.verdict.named if isinstance(c.change, Mistake))

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
        """Whether it is certain that no walker has these curves; what is a matter of definition is
        only said.
        """
        certain = self.verdict.sound < 1.0 - ADVISED
        known = len(self.named) == len(self.verdict.named) > 0
        return certain and known and not any(each.of_definition for each in self.named)


def judge_curves(curves: Curves) -> Judged:
    """What may be wrong with `curves` of both sides; those that healthy people have are looked
    at.
    """
    expected, _ = healthy()
    own = {n: c for n, c in curves.items() if n in expected and np.ptp(c) > 0.0}
    seen = [*groups(tuple(own))]
    now = [_log(group, own) for group in seen]
    perfect = [float(_logs(_count(each), SORTS[each.sort].beyond)[0]) for each in seen]
    touched: dict[str, set[int]] = {}
    for i, group in enumerate(seen):
        for name, *_ in group.terms:
            touched.setdefault(name, set()).add(i)
    best, tried = 0.0, list[tuple[Mistake, float]]()
    for mistake in mistakes(own, expected):
        changed = mistake.undo(own)
        after = {**own, **changed}
        # What the mistake costs most shows soonest that it is none.
        among = set().union(*(touched[name] for name in changed))
        concerned = sorted(among, key=lambda i: -_count(seen[i]))
        better, hope = 0.0, sum(perfect[i] - now[i] for i in concerned)
        for i in concerned:
            better += _log(seen[i], after) - now[i]
            hope -= perfect[i] - now[i]
            if better + hope < best - HOPELESS:
                break
        best = max(best, better)
        tried.append((mistake, better))
    wide = [_log(group, own, WIDEST) for group in seen]
    other = np.logaddexp(np.log1p(-DISTURBED) + np.array(now), np.log(DISTURBED) + np.array(wide))
    verdict = weigh(tried, 0.0, float(other.sum()) - sum(now))
    untold = () if verdict.named else tuple(
        each.columns[0][6:-2] for each, log in tried
        if each.family == "sign" and len(each.columns) > 1
        and each.columns[0].startswith("angle_") and log > -UNTOLD
    )  # fmt: skip
    return Judged(verdict, untold, best > sum(perfect) - sum(now) - UNEXPLAINED * len(seen))
