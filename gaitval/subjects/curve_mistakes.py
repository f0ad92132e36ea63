"""Mistakes that people make in tables of mean curves, each with the curves as they are without it.

Of each are said the words, and what to do about it. Programs differ in signs, units and zeros, most
of all outside the sagittal plane.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.sampling import SAMPLES
from gaitval.units import ANKLE_MOMENT, VERTICAL_FORCE

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
LONG: Final = {"r": "right", "l": "left"}
TOE_OFF: Final = 62
"""% of the cycle, usual."""
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
MOMENTS: Final = (
    "moments are internal, as in OpenSim, and positive where they increase the angle; in Plug-in "
    "Gait those of extensors, abductors and plantarflexors are positive"
)
FORCES: Final = "forces are of the ground on the foot, forward, to the person's left, up"

SIZES: Final = 7
"""Of a unit per kg of body mass or m of stature, from the smallest person to the largest."""


@dataclass(frozen=True)
class Mistake:
    """One that may have been made.

    Attributes
    ----------
    family : of `PRIORS`.
    name : of the kind; those of one name differ by a parameter.
    words : what happened, a clause.
    changes : the curves that change, as they are without it; by name.
    columns : that it is about.
    remedy : what to do about it.
    """

    family: str
    name: str
    words: str
    changes: Callable[[Curves], dict[str, Array]]
    columns: tuple[str, ...]
    remedy: str = ""


def later(curve: Array, rows: int) -> Array:
    """A closed curve (101,), so many rows later."""
    once = np.roll(curve[:-1], rows)
    return np.append(once, once[0])


def mistakes(curves: Curves, expected: Curves) -> Iterator[Mistake]:
    """Those that a table of these `curves` may have; `expected` are healthy people's."""
    names = tuple(curves)
    yield from _signs(names)
    yield from _units(names)
    yield from _times(names)
    yield from _exchanged(names)
    yield from _zeros(curves, expected)


def _each(
    family: str, name: str, words: str, own: Sequence[str], change: Callable[[Array], Array],
    remedy: str = "",
) -> Mistake:  # fmt: skip
    """A mistake that is undone by the same `change` of each of its `own` curves."""
    return Mistake(
        family, name, words, lambda curves: {n: change(curves[n]) for n in own}, tuple(own), remedy
    )


def _kinds(names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    found = {k: tuple(n for n in names if n.startswith(k)) for k in ("angle", "moment", "force")}
    return {kind: own for kind, own in found.items() if own}


def _pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Of right and left."""
    return [(n, f"{n[:-2]}_l") for n in names if n.endswith("_r") and f"{n[:-2]}_l" in names]


def _signs(names: Sequence[str]) -> Iterator[Mistake]:
    for kind, own in _kinds(names).items():
        for base in dict.fromkeys(name[:-2] for name in own):
            both = [name for name in own if name[:-2] == base]
            where = {"moment": MOMENTS, "force": FORCES}.get(kind) or POSITIVE.get(
                base.partition("_")[2], "signs are those of an import"
            )
            have = "have" if len(both) > 1 else "has"
            yield _each(
                "sign", f"sign {base}", f"{' and '.join(both)} {have} the other sign", both,
                np.negative, f"change the sign of {' and '.join(both)}: {where}",
            )  # fmt: skip
            for name in both if len(both) > 1 else ():
                yield _each(
                    "sign of one side", f"sign {name}", f"{name} has the other sign", [name],
                    np.negative, f"change the sign of {name}: {where}",
                )  # fmt: skip
    if moments := _kinds(names).get("moment"):
        yield _each(
            "signs of all moments", "external moments",
            "all moments have the other sign: they are external", moments, np.negative,
            f"change the sign of all moments: {MOMENTS}",
        )  # fmt: skip


def _units(names: Sequence[str]) -> Iterator[Mistake]:
    for kind, own in _kinds(names).items():
        groups = {f"the {kind}s": own}
        for base in dict.fromkeys(name[:-2] for name in own):
            both = tuple(name for name in own if name[:-2] == base)
            groups |= {" and ".join(both): both} | {name: (name,) for name in both}
        for words, those in groups.items():
            are, whole = "are" if len(those) > 1 else "is", those == own
            for unit, factors, fix in _wrong_units(kind):
                for factor in factors:
                    yield _each(
                        "unit" if whole else "unit of one column", f"{unit} {words}",
                        f"{words} {are} in {unit}", those, partial(np.multiply, factor),
                        fix if whole else f"write all columns of {kind}s in one unit",
                    )  # fmt: skip


def _wrong_units(kind: str) -> Iterator[tuple[str, tuple[float, ...], str]]:
    """Units other than deg, Nm/kg and body weights: name, factors, and what to do."""
    if kind == "angle":
        yield "radians", (math.degrees(1.0),), "give --angle-unit rad"
        yield "degrees", (math.radians(1.0),), "give --angle-unit deg"
        return
    quantity = ANKLE_MOMENT if kind == "moment" else VERTICAL_FORCE
    for unit in quantity.units[1:]:
        sizes = np.geomspace(1.0 / unit.spread, unit.spread, SIZES) if unit.spread > 1.0 else [1.0]
        yield (
            unit.name,
            tuple(unit.factor * each for each in sizes),
            unit.how or f"multiply them by {unit.factor:g}, or say the unit in the headers",
        )


def _times(names: Sequence[str]) -> Iterator[Mistake]:
    kinds = _kinds(names)
    every = {"all curves": tuple(names)}
    if len(kinds) > 1:
        every |= {f"the {kind}s": own for kind, own in kinds.items()}
    for words, own in every.items():
        for rows in range(8, SAMPLES - 8, 4):
            yield _each(
                "late", f"late {words}", _shifted(words, rows), own,
                partial(later, rows=rows),
                "cut them from heel strike to heel strike of their own side",
            )  # fmt: skip
    yield _each(
        "rows", "backwards", "the rows run backwards", names, lambda c: c[::-1],
        "export the curves over 0 to 100 % of one gait cycle",
    )  # fmt: skip
    for side in "rl":
        parts = {
            f"{words} of the {LONG[side]} side": tuple(n for n in own if n.endswith(side))
            for words, own in every.items()
        } | {name: (name,) for name in names if name.endswith(side)}
        for words, own in parts.items():
            are = "are" if len(own) > 1 else "is"
            yield _each(
                "half a stride", f"half {words}",
                f"{words} {are} over the other side's cycle, half a stride off", own,
                lambda c: later(c, SAMPLES // 2),
                "cut them from heel strike to heel strike of their own side",
            )  # fmt: skip


def _shifted(words: str, rows: int) -> str:
    """What curves are that have to come `rows` later to be a walker's."""
    if abs(rows - SAMPLES // 2) <= 4:
        return f"{words} are over the other side's cycle, half a stride off"
    if abs(rows - TOE_OFF) <= 4:
        return f"the rows of {words} begin at toe-off, not at heel strike"
    early = rows if rows < SAMPLES // 2 else rows - (SAMPLES - 1)
    return f"{words} are about {abs(early)} % of the cycle too {'early' if early > 0 else 'late'}"


def _exchanged(names: Sequence[str]) -> Iterator[Mistake]:
    def swapped(family: str, name: str, words: str, pairs: Sequence[tuple[str, str]]) -> Mistake:
        def changes(curves: Curves) -> dict[str, Array]:
            return {a: curves[b] for one, other in pairs for a, b in ((one, other), (other, one))}

        columns = tuple(each for pair in pairs for each in pair)
        return Mistake(family, name, words, changes, columns, "exchange their names")

    for kind, own in _kinds(names).items():
        both = [right[:-2] for right, _ in _pairs(own)]
        for one, other in combinations(both, 2):
            pairs = [(f"{one}_{side}", f"{other}_{side}") for side in "rl"]
            yield swapped(
                "exchanged names", f"{one}, {other}", f"{one} and {other} are exchanged", pairs
            )
            for pair in pairs:
                words = f"{' and '.join(pair)} are exchanged"
                yield swapped("exchanged names", ", ".join(pair), words, [pair])
        yield swapped(
            "exchanged sides", f"sides of {kind}s",
            f"right and left are exchanged in the {kind}s", _pairs(own),
        )  # fmt: skip
    if len(_kinds(names)) > 1:
        yield swapped(
            "exchanged sides", "sides", "right and left are exchanged in all columns",
            _pairs(names),
        )  # fmt: skip


def _zeros(curves: Curves, expected: Curves) -> Iterator[Mistake]:
    names = tuple(curves)
    thighs = [n for n in names if n.startswith("angle_hip_flexion")]
    if thighs and all(f"angle_pelvis_tilt_{n[-1]}" in names for n in thighs):
        yield Mistake(
            "thigh", "thigh",
            f"{' and '.join(thighs)} are of the thigh against the vertical, not the pelvis",
            lambda own: {n: own[n] + own[f"angle_pelvis_tilt_{n[-1]}"] for n in thighs},
            tuple(thighs), "add the tilt of the pelvis to them",
        )  # fmt: skip
    for name in _kinds(names).get("angle", ()):
        off = float((expected[name] - curves[name])[:-1].mean())
        if abs(off) < 45.0:  # else a right angle is nearer
            yield _each(
                "offset", f"offset {name}",
                f"{name} has another zero, or the foot is never put down flat", [name],
                partial(np.add, off), "give it from standing",
            )  # fmt: skip
    for base in dict.fromkeys(name[:-2] for name in _kinds(names).get("angle", ())):
        both = [n for n in names if n[:-2] == base]
        for own in ([both] if len(both) > 1 else []) + [[n] for n in both]:
            for factor in (1.0, -1.0):
                off = np.mean([(expected[n] - factor * curves[n])[:-1].mean() for n in own])
                if add := 90.0 * round(float(off) / 90.0):
                    words = f"{' and '.join(own)} {'are' if len(own) > 1 else 'is'}"
                    yield _each(
                        "right angle", f"{factor:g} {add:g} {words}",
                        f"{words} measured from {abs(add):.0f}° in standing", own,
                        lambda c, f=factor, a=add: f * c + a,  # type: ignore[misc]
                        f"give the difference from standing: {POSITIVE.get(base[6:], '')}",
                    )  # fmt: skip
