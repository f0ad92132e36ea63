"""Mistakes that people make in tables of mean curves, each with the curves as they are without it.

Programs differ in signs, units and zeros, most of all outside the sagittal plane.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.consistency import Change
from gaitval.gait.sampling import SAMPLES
from gaitval.units import ANGLE, ANKLE_MOMENT, VERTICAL_FORCE

SAGITTAL: Final = ("angle_hip_flexion", "angle_knee_angle", "angle_ankle_angle")

Curves = Mapping[str, Array]
"""(101,) by name with kind and side, `angle_hip_flexion_r`: deg, Nm/kg, body weights."""

PRIORS: Final[Mapping[str, float]] = {
    "sign": 0.08,
    "unit": 0.07,
    "late": 0.04,
    "rows": 0.01,
    "offset": 0.03,
    "right angle": 0.02,
    "exchanged names": 0.02,
    "exchanged sides": 0.01,
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
HALF: Final = SAMPLES // 2
"""Rows of half a stride."""
CUT: Final = "export 0 to 100 % of one cycle, from heel strike to heel strike of its own side"
ZERO: Final = "give the difference from standing"
FAR: Final = 45.0
"""Degrees, of a zero, beyond which right angles were not taken away."""


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
        return self.family == "offset" or not any(
            name.startswith(("moment", "force", *SAGITTAL)) for name in self.columns
        )


class Columns(NamedTuple):
    """Those that one mistake may be about.

    Attributes
    ----------
    extent : `table`, or `kind` (all angles, moments, forces), these of one side (`leg`), `both`
        sides of a curve, or `one`.
    """

    extent: str
    words: str
    names: tuple[str, ...]

    @property
    def kind(self) -> str:
        """Of the first, "angle", "moment" or "force"."""
        return self.names[0].partition("_")[0]


class Undone(NamedTuple):
    """What one change makes of each curve of its columns: its family and name, what happened, in
    words with `{are}` and `{have}`, and what to do, with the columns as `{words}`.
    """

    family: str
    name: str
    said: str
    change: Callable[[Array], Array]
    remedy: str


def later(curve: Array, rows: int) -> Array:
    """A closed curve (101,), so many rows later."""
    once = np.roll(curve[:-1], rows)
    return np.append(once, once[0])


def mistakes(curves: Curves, expected: Curves) -> list[Mistake]:
    """Those that a table of these `curves` may have; `expected` are healthy people's."""
    found = [*_exchanged(tuple(curves))]
    for own in _columns(tuple(curves)):
        found += [_mistake(own, each) for each in _undone(own, curves, expected)]
    members = Counter(family for family, _ in {(each.family, each.name) for each in found})
    return [replace(each, prior=each.prior / members[each.family]) for each in found]


def _mistake(own: Columns, undone: Undone) -> Mistake:
    are, have = ("are", "have") if len(own.names) > 1 else ("is", "has")
    return Mistake(
        f"{undone.name} {own.words}",
        f"{own.words} {undone.said.format(are=are, have=have)}",
        PRIORS[undone.family],
        undone.remedy.format(words=own.words),
        family=undone.family,
        columns=own.names,
        undo=lambda curves: {name: undone.change(curves[name]) for name in own.names},
    )


def _undone(own: Columns, curves: Curves, expected: Curves) -> Iterator[Undone]:
    """All that may have happened to these columns."""
    if own.extent in ("both", "one") or (own.extent, own.kind) == ("kind", "moment"):
        where = SIGNS[own.kind]
        if own.kind == "angle":
            where = POSITIVE.get(own.names[0][len("angle_") : -2], where)
        yield Undone(
            "sign", "sign", "{have} the other sign", np.negative,
            f"change the sign of {{words}}: {where}",
        )  # fmt: skip
    if own.extent in ("kind", "both", "one"):
        for unit, factor, fix in _wrong_units(own.kind):
            advice = fix if own.extent == "kind" else "write all columns of a kind in one unit"
            yield Undone("unit", unit, f"{{are}} in {unit}", partial(np.multiply, factor), advice)
    if own.extent in ("table", "kind", "leg", "one"):
        for rows in range(8, SAMPLES - 8, 4) if own.extent in ("table", "kind") else (HALF,):
            yield Undone("late", "late", _delay(rows), partial(later, rows=rows), CUT)
    if own.extent in ("table", "kind"):
        yield Undone("rows", "rows", "{are} run backwards", np.flip, CUT)
    if own.extent in ("both", "one") and own.kind == "angle":
        for factor in (1.0, -1.0):
            # By how much the mean of healthy people is more than `factor` times that of these.
            off = [(expected[name] - factor * curves[name])[:-1].mean() for name in own.names]
            add = float(np.mean(off))
            if abs(add) > FAR:
                add = 90.0 * round(add / 90.0)
                said = f"{{are}} measured from {abs(add):.0f}° in standing"
                change = partial(_moved, factor, add)
                yield Undone("right angle", f"{factor:g} {add:g}", said, change, ZERO)
            elif factor > 0.0 and own.extent == "one":
                said, change = "{have} another zero", partial(_moved, factor, add)
                yield Undone("offset", "offset", said, change, ZERO)


def _moved(factor: float, add: float, curve: Array) -> Array:
    return factor * curve + add


def _delay(rows: int) -> str:
    """What happened to curves that are undone by being so many rows later."""
    if abs(rows - HALF) < 4:
        return "{are} over the other side's cycle, half a stride off"
    early = rows if rows < HALF else rows - (SAMPLES - 1)
    return f"{{are}} about {abs(early)} % of the cycle too {'early' if early > 0 else 'late'}"


def _wrong_units(kind: str) -> Iterator[tuple[str, float, str]]:
    """Units other than deg, Nm/kg and body weights: name, factor, and what to do."""
    if kind == "angle":
        radian, degree = ANGLE.units
        yield radian.name, 1.0 / degree.factor, "give --angle-unit rad"
        yield degree.name, degree.factor, "give --angle-unit deg"
        return
    for unit in (ANKLE_MOMENT if kind == "moment" else VERTICAL_FORCE).units[1:]:
        fix = unit.how or f"multiply them by {unit.factor:g}, or say the unit in the headers"
        for size in np.geomspace(1.0 / unit.spread, unit.spread, SIZES if unit.spread > 1.0 else 1):
            yield unit.name, unit.factor * float(size), fix


def _kinds(names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Curves of each kind."""
    kinds = {
        f"the {kind}s": tuple(name for name in names if name.startswith(kind))
        for kind in ("angle", "moment", "force")
    }
    return {words: own for words, own in kinds.items() if own}


def _columns(names: tuple[str, ...]) -> Iterator[Columns]:
    kinds = _kinds(names)
    if len(kinds) > 1:
        yield Columns("table", "all curves", names)
    for words, own in kinds.items():
        yield Columns("kind", words, own)
    for words, own in {"all curves": names, **kinds}.items():
        for side, long in (("r", "right"), ("l", "left")):
            if leg := tuple(name for name in own if name.endswith(side)):
                yield Columns("leg", f"{words} of the {long} side", leg)
    for base in dict.fromkeys(name[:-2] for name in names):
        both = tuple(name for name in names if name[:-2] == base)
        if len(both) > 1:
            yield Columns("both", " and ".join(both), both)
        for name in both:
            yield Columns("one", name, (name,))


def _exchanged(names: tuple[str, ...]) -> Iterator[Mistake]:
    """Sides of all curves, or of a kind; and two curves of one kind."""
    kinds = _kinds(names)
    for whose, own in {"all curves": names, **kinds}.items():
        sides = [(n, f"{n[:-2]}_l") for n in own if n.endswith("_r") and f"{n[:-2]}_l" in own]
        if sides and (whose in kinds or len(kinds) > 1):
            yield _swapped("exchanged sides", f"right and left are exchanged in {whose}", sides)
        for one, other in combinations(sides, 2) if whose in kinds else ():
            pairs = [*zip(one, other, strict=True)]
            for few in (pairs, pairs[:1], pairs[1:]):
                words = "; ".join(" and ".join(pair) for pair in few)
                yield _swapped("exchanged names", f"{words} are exchanged", few)


def _swapped(family: str, words: str, pairs: Iterable[tuple[str, str]]) -> Mistake:
    swapped = {a: b for pair in pairs for a, b in (pair, pair[::-1])}
    return Mistake(
        words, words, PRIORS[family], "exchange their names",
        family=family, columns=(*swapped,),
        undo=lambda curves: {name: curves[other] for name, other in swapped.items()},
    )  # fmt: skip
