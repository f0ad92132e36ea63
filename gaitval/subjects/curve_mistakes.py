"""Mistakes that people make in tables of mean curves, each with the curves as they are without it.

Of each are said the words, and what to do about it. Programs differ in signs, units and zeros, most
of all outside the sagittal plane.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.consistency import Change
from gaitval.gait.sampling import SAMPLES
from gaitval.units import ANGLE, ANKLE_MOMENT, VERTICAL_FORCE

SAGITTAL: Final = ("angle_hip_flexion", "angle_knee_angle", "angle_ankle_angle")

Curves = Mapping[str, Array]
"""(101,) by name with kind and side, `angle_hip_flexion_r`: deg, Nm/kg, body weights."""

PRIORS: Final[Mapping[str, float]] = {
    "sign": 0.05,
    "sign of one side": 0.02,
    "signs of all moments": 0.01,
    "unit": 0.05,
    "unit of one column": 0.02,
    "half a stride": 0.02,
    "late": 0.02,
    "rows": 0.01,
    "exchanged names": 0.02,
    "exchanged sides": 0.01,
    "thigh": 0.04,
    "offset": 0.03,
    "right angle": 0.02,
}
"""Probability of each family before the data, shared among its members."""
POSITIVE: Final[Mapping[str, str]] = {
    "hip_flexion": "flexion is positive",
    "hip_adduction": "adduction is positive on both sides (about y of Visual3D, on the right only)",
    "hip_rotation": "internal rotation is positive on both sides (about z of Visual3D, on the "
    "right only)",
    "knee_angle": "flexion is positive (in Visual3D and Gait2392, negative)",
    "ankle_angle": "dorsiflexion is positive",
    "subtalar_angle": "inversion is positive on both sides",
    "pelvis_tilt": "forward tilt is positive (as in Plug-in Gait; OpenSim's is positive backwards)",
    "pelvis_list": "own side up is positive on both sides (as in Plug-in Gait; OpenSim's one "
    "pelvis_list is positive with the left side up)",
    "pelvis_rotation": "own side forward is positive on both sides (OpenSim's one pelvis_rotation "
    "is positive with the right side forward)",
    "foot_progression": "toes towards the midline are positive",
}
"""Of angles, and what other programs have."""
SIGNS: Final[Mapping[str, str]] = {
    "moment": "moments are internal, as in OpenSim, and positive where they increase the angle; in "
    "Plug-in Gait those of extensors, abductors and plantarflexors are positive",
    "force": "forces are of the ground on the foot, forward, to the person's left, up",
    "angle": "signs are those of an import",
}
"""Of other curves."""
SIZES: Final = 7
"""Of a unit per kg of body mass or m of stature, from the smallest person to the largest."""
CUT: Final = "cut them from heel strike to heel strike of their own side"


@dataclass(frozen=True)
class Mistake(Change):
    """One that may have been made.

    Attributes
    ----------
    family : of `PRIORS`.
    columns : that it is about.
    undo : the curves that change, as they are without it; by name.
    """

    family: str = ""
    columns: tuple[str, ...] = ()
    undo: Callable[[Curves], dict[str, Array]] = dict

    @property
    def of_definition(self) -> bool:
        """Whether laboratories may differ so: in zeros, and outside the sagittal plane."""
        return self.family in ("offset", "thigh") or not any(
            name.startswith(("moment", "force", *SAGITTAL)) for name in self.columns
        )


@dataclass(frozen=True)
class Columns:
    """Those that one mistake may be about.

    Attributes
    ----------
    extent : `table`, or `kind` (all angles, moments, forces), these of one side (`one leg`), `both`
        sides of a curve, or `one`.
    """

    extent: str
    words: str
    names: tuple[str, ...]

    @property
    def kind(self) -> str:
        """Of the first, "angle", "moment" or "force"."""
        return self.names[0].partition("_")[0]

    @property
    def curve(self) -> str:
        """Without kind and side, of the first."""
        return self.names[0].partition("_")[2][:-2]

    def mistake(
        self, family: str, said: str, change: Callable[[Array], Array], remedy: str, name: str = ""
    ) -> Mistake:
        """The mistake that is undone by the same `change` of each of these; `said` has `{are}` and
        `{have}`, and is the name where none is given.
        """
        are, have = ("are", "have") if len(self.names) > 1 else ("is", "has")
        return Mistake(
            f"{name or said} {self.words}",
            f"{self.words} {said.format(are=are, have=have)}",
            PRIORS[family],
            remedy.format(words=self.words),
            family=family,
            columns=self.names,
            undo=lambda curves: {each: change(curves[each]) for each in self.names},
        )


def later(curve: Array, rows: int) -> Array:
    """A closed curve (101,), so many rows later."""
    once = np.roll(curve[:-1], rows)
    return np.append(once, once[0])


def mistakes(curves: Curves, expected: Curves) -> list[Mistake]:
    """Those that a table of these `curves` may have; `expected` are healthy people's."""
    found = [*_exchanged(tuple(curves)), *_of_the_thigh(curves)]
    for own in _columns(tuple(curves)):
        found += [*_signs(own), *_units(own), *_times(own), *_zeros(own, curves, expected)]
    members = Counter(family for family, _ in {(each.family, each.name) for each in found})
    return [replace(each, prior=each.prior / members[each.family]) for each in found]


def _kinds(names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Curves of each kind, and all where there are several kinds."""
    found = {
        f"the {kind}s": own
        for kind in ("angle", "moment", "force")
        if (own := tuple(name for name in names if name.startswith(kind)))
    }
    return found if len(found) < 2 else {"all curves": tuple(names), **found}


def _columns(names: Sequence[str]) -> Iterator[Columns]:
    for words, own in _kinds(names).items():
        yield Columns("table" if words == "all curves" else "kind", words, own)
        for side, long in (("r", "right"), ("l", "left")):
            if leg := tuple(name for name in own if name.endswith(side)):
                yield Columns("one leg", f"{words} of the {long} side", leg)
    for base in dict.fromkeys(name[:-2] for name in names):
        both = tuple(name for name in names if name[:-2] == base)
        if len(both) > 1:
            yield Columns("both", " and ".join(both), both)
        for name in both:
            yield Columns("one", name, (name,))


def _signs(own: Columns) -> Iterator[Mistake]:
    family = {"both": "sign", "one": "sign of one side"}.get(own.extent)
    if (own.extent, own.kind) == ("kind", "moment"):
        family = "signs of all moments"
    if family:
        where = SIGNS[own.kind]
        if own.kind == "angle":
            where = POSITIVE.get(own.curve, where)
        yield own.mistake(
            family, "{have} the other sign", np.negative, f"change the sign of {{words}}: {where}",
            "sign",
        )  # fmt: skip


def _units(own: Columns) -> Iterator[Mistake]:
    if own.extent in ("table", "one leg"):
        return
    whole = own.extent == "kind"
    for unit, factors, fix in _wrong_units(own.kind):
        for factor in factors:
            yield own.mistake(
                "unit" if whole else "unit of one column", f"{{are}} in {unit}",
                partial(np.multiply, factor),
                fix if whole else f"write all columns of {own.kind}s in one unit", unit,
            )  # fmt: skip


def _wrong_units(kind: str) -> Iterator[tuple[str, tuple[float, ...], str]]:
    """Units other than deg, Nm/kg and body weights: name, factors, and what to do."""
    if kind == "angle":
        radian, degree = ANGLE.units
        yield radian.name, (1.0 / degree.factor,), "give --angle-unit rad"
        yield degree.name, (degree.factor,), "give --angle-unit deg"
        return
    for unit in (ANKLE_MOMENT if kind == "moment" else VERTICAL_FORCE).units[1:]:
        sizes = np.geomspace(1.0 / unit.spread, unit.spread, SIZES) if unit.spread > 1.0 else [1.0]
        fix = unit.how or f"multiply them by {unit.factor:g}, or say the unit in the headers"
        yield unit.name, tuple(unit.factor * each for each in sizes), fix


def _times(own: Columns) -> Iterator[Mistake]:
    if own.extent in ("table", "kind"):
        for rows in range(8, SAMPLES - 8, 4):
            early = rows if rows < SAMPLES // 2 else rows - (SAMPLES - 1)
            said = f"about {abs(early)} % of the cycle too {'early' if early > 0 else 'late'}"
            if abs(rows - SAMPLES // 2) <= 4:
                said = "over the other side's cycle, half a stride off"
            yield own.mistake("late", f"{{are}} {said}", partial(later, rows=rows), CUT, "late")
        yield own.mistake(
            "rows", "run backwards", lambda c: c[::-1],
            "export the curves over 0 to 100 % of one gait cycle",
        )  # fmt: skip
    if own.extent in ("one leg", "one"):
        yield own.mistake(
            "half a stride", "{are} over the other side's cycle, half a stride off",
            partial(later, rows=SAMPLES // 2), CUT, "half",
        )  # fmt: skip


def _zeros(own: Columns, curves: Curves, expected: Curves) -> Iterator[Mistake]:
    if own.kind != "angle" or own.extent not in ("both", "one"):
        return

    def off(factor: float) -> float:
        """By how much the mean of healthy people is more than `factor` times that of these."""
        return float(np.mean([(expected[n] - factor * curves[n])[:-1].mean() for n in own.names]))

    # else a right angle is nearer
    if own.extent == "one" and abs(off(1.0)) < 45.0:
        yield own.mistake(
            "offset", "{have} another zero, or the foot is never put down flat",
            partial(np.add, off(1.0)), "give it from standing", "offset",
        )  # fmt: skip
    for factor in (1.0, -1.0):
        if add := 90.0 * round(off(factor) / 90.0):
            yield own.mistake(
                "right angle", f"{{are}} measured from {abs(add):.0f}° in standing",
                lambda c, f=factor, a=add: f * c + a,  # type: ignore[misc]
                f"give the difference from standing: {POSITIVE.get(own.curve, '')}",
                f"{factor:g} {add:g}",
            )  # fmt: skip


def _exchanged(names: Sequence[str]) -> Iterator[Mistake]:
    def swapped(family: str, words: str, *pairs: tuple[str, str]) -> Mistake:
        def changes(curves: Curves) -> dict[str, Array]:
            return {a: curves[b] for pair in pairs for a, b in (pair, pair[::-1])}

        columns = tuple(each for pair in pairs for each in pair)
        return Mistake(
            words, words, PRIORS[family], "exchange their names",
            family=family, columns=columns, undo=changes,
        )  # fmt: skip

    for whose, own in _kinds(names).items():
        sides = [(n, f"{n[:-2]}_l") for n in own if n.endswith("_r") and f"{n[:-2]}_l" in own]
        if sides:
            yield swapped("exchanged sides", f"right and left are exchanged in {whose}", *sides)
        if whose == "all curves":
            continue
        for one, other in combinations(sides, 2):
            pairs = [*zip(one, other, strict=True)]
            for few in (pairs, pairs[:1], pairs[1:]):
                words = "; ".join(" and ".join(pair) for pair in few)
                yield swapped("exchanged names", f"{words} are exchanged", *few)


def _of_the_thigh(curves: Curves) -> Iterator[Mistake]:
    names = tuple(n for n in curves if n.startswith("angle_hip_flexion"))
    if names and all(f"angle_pelvis_tilt_{n[-1]}" in curves for n in names):
        yield Mistake(
            "thigh",
            f"{' and '.join(names)} are of the thigh against the vertical, not the pelvis",
            PRIORS["thigh"], "add the tilt of the pelvis to them",
            family="thigh", columns=names,
            undo=lambda own: {n: own[n] + own[f"angle_pelvis_tilt_{n[-1]}"] for n in names},
        )  # fmt: skip
