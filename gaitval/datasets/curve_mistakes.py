"""Mistakes that people make in tables of mean curves, each with the curves as they are without it.

Of each are said the words, and what to do about it. Programs differ in signs, units and zeros, most
of all outside the sagittal plane.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.gait.sampling import SAMPLES

Curves = Mapping[str, Array]
"""(101,) by name with kind and side, `angle_hip_flexion_r`: deg, Nm/kg, body weights."""

PRIORS: Final[Mapping[str, float]] = {
    "sign": 0.05,
    "sign of one side": 0.02,
    "signs of all moments": 0.01,
    "unit": 0.05,
    "unit of one column": 0.02,
    "unknown unit": 0.01,
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
}
"""Of angles, and what other programs have."""
MOMENTS: Final = (
    "moments are internal, as in OpenSim, and positive where they increase the angle; in Plug-in "
    "Gait those of extensors, abductors and plantarflexors are positive"
)
FORCES: Final = "forces are of the ground on the foot, forward, to the person's left, up"

STANCE: Final = "stance"
"""Name of the mistake that cannot be undone: a curve of it is held against healthy people's with
the same mistake."""
_MASSES: Final = (20.0, 32.0, 45.0, 60.0, 78.0, 100.0, 135.0)
"""kg, of people whose mass is not known."""
UNITS: Final[Mapping[str, Mapping[str, tuple[str, float, int, int]]]] = {
    "angle": {
        "radians": ("give --angle-unit rad", 180.0 / np.pi, 0, 0),
        "degrees": ("give --angle-unit deg", np.pi / 180.0, 0, 0),
    },
    "moment": {
        "Nmm/kg": ("divide them by 1000", 1e-3, 0, 0),
        "Nm": ("divide them by the body mass, kg", 1.0, -1, 0),
        "Nmm": ("divide them by 1000 and by the body mass, kg", 1e-3, -1, 0),
        "% of body weight times height": (
            "multiply them by 0.0980665 and the height, m", 0.01 * STANDARD_GRAVITY, 0, 1,
        ),
    },
    "force": {
        "N/kg": ("divide them by 9.80665", 1.0 / STANDARD_GRAVITY, 0, 0),
        "% of body weight": ("divide them by 100", 0.01, 0, 0),
        "N": (
            "divide them by the weight, N: mass times 9.80665", 1.0 / STANDARD_GRAVITY, -1, 0,
        ),
    },
}  # fmt: skip
"""Unit that a column may be in instead of deg, Nm/kg and body weights: what to do, the factor, and
the powers of the mass, kg, and of the stature, m, by which it is multiplied too."""
UNKNOWN: Final = tuple(10.0 ** (0.2 * power) for power in range(-15, 16) if abs(power) > 2)
"""Factors of a unit that is none of these; patients' moments are half of healthy people's."""
ZEROS: Final[Mapping[str, Mapping[str, tuple[float, float]]]] = {
    "knee_angle": {"180° in standing": (-1.0, 180.0)},
    "ankle_angle": {"90° in standing": (1.0, -90.0), "90° in standing, backwards": (-1.0, 90.0)},
    "hip_flexion": {"90° in standing": (1.0, 90.0), "180° in standing": (-1.0, 180.0)},
    "pelvis_tilt": {"another axis than the vertical": (1.0, 90.0)},
    "pelvis_rotation": {"an axis of the laboratory": (1.0, -180.0)},
}
"""Where an angle may be measured from, and factor and addend, deg, that bring it to standing."""


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


def mistakes(
    curves: Curves, expected: Curves, *, mass: float | None = None, height: float | None = None
) -> Iterator[Mistake]:
    """Those that a table of these `curves` may have; `expected` are healthy people's. `mass`, kg,
    and `height`, m, are of the person if they are known.
    """
    names = tuple(curves)
    yield from _signs(names)
    yield from _units(names, _MASSES if mass is None else (mass,), height)
    yield from _times(names)
    yield from _rows(curves)
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


def _units(
    names: Sequence[str], masses: Sequence[float], height: float | None
) -> Iterator[Mistake]:
    tall = 1.5 if height is None else height
    for kind, own in _kinds(names).items():
        groups = {f"the {kind}s": own}
        for base in dict.fromkeys(name[:-2] for name in own):
            both = tuple(name for name in own if name[:-2] == base)
            groups |= {" and ".join(both): both} | {name: (name,) for name in both}
        for words, those in groups.items():
            are, whole = "are" if len(those) > 1 else "is", those == own
            for unit, (fix, factor, of_mass, of_height) in UNITS[kind].items():
                remedy = fix if whole else f"write all columns of {kind}s in one unit"
                for mass in masses if of_mass else (1.0,):
                    yield _each(
                        "unit" if whole else "unit of one column", f"{unit} {words}",
                        f"{words} {are} in {unit}", those,
                        partial(np.multiply, factor * mass**of_mass * tall**of_height), remedy,
                    )  # fmt: skip
        for factor in UNKNOWN if kind != "angle" else ():
            large = "large" if factor < 1.0 else "small"
            yield _each(
                "unknown unit", f"unknown unit {kind}",
                f"the {kind}s are about {max(factor, 1.0 / factor):.3g} times too {large}, in no "
                "usual unit",
                own, partial(np.multiply, factor),
            )  # fmt: skip


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


def _rows(curves: Curves) -> Iterator[Mistake]:
    names, rows = tuple(curves), np.arange(SAMPLES)
    again = "export the curves over 0 to 100 % of one gait cycle"
    yield _each("rows", "backwards", "the rows run backwards", names, lambda c: c[::-1], again)
    if _repeats(curves):
        yield _each(
            "rows", "two cycles", "the rows are two cycles", names,
            lambda c: np.interp(0.5 * rows, rows, c), again,
        )  # fmt: skip
    yield Mistake(
        "rows", STANCE, "the rows are of stance alone", lambda own: dict(own), names, again
    )


def of_stance(curve: Array) -> Array:
    """A curve (101,) whose stance alone was written over all rows."""
    rows = np.arange(SAMPLES)
    return np.asarray(np.interp(0.01 * TOE_OFF * rows, rows, curve))


def _repeats(curves: Curves) -> bool:
    """Whether hips and knees do in the second half of the rows what they do in the first."""
    moved = [c for n, c in curves.items() if n.startswith(("angle_hip_flexion", "angle_knee"))]
    halves = [np.corrcoef(c[:50], c[50:100])[0, 1] for c in moved if np.ptp(c) > 0.0]
    return bool(halves) and min(halves) > 0.9


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
    for base, zeros in ZEROS.items():
        both = [n for n in names if n[:-2] == f"angle_{base}"]
        for own in ([both] if len(both) > 1 else []) + [[n] for n in both]:
            words = f"{' and '.join(own)} {'are' if len(own) > 1 else 'is'}"
            for zero, (factor, add) in zeros.items():
                yield _each(
                    "right angle", f"{zero} {words}", f"{words} measured from {zero}", own,
                    lambda c, f=factor, a=add: f * c + a,  # type: ignore[misc]
                    f"give the difference from standing: {POSITIVE[base]}",
                )  # fmt: skip
