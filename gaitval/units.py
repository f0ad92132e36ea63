"""Which unit a column of other people's numbers is in: by what its header says, and by the size of
the numbers, for a person is neither 1.5 mm nor 1.5 km tall.

A quantity has a plausible range and the units in which programs write it. `unit_of` takes the
header's word, if there is one, and the size of the numbers, and returns the unit or the candidates,
with a sentence for a message. Every reader asks it; none has factors or ranges of its own.
"""

import math
import re
from dataclasses import dataclass
from itertools import permutations
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import POUND, STANDARD_GRAVITY
from gaitval.errors import RecordError


@dataclass(frozen=True)
class Unit:
    """A unit as programs write it.

    Attributes
    ----------
    name : in messages.
    factor : of one such unit in the first unit of its quantity.
    words : what headers call it, in the form of `plain`.
    spread : by how much `factor` may be larger or smaller, from person to person: those per kg of
        body mass are right for a mean one.
    how : what turns such numbers into the first unit, where `factor` alone does not.
    """

    name: str
    factor: float
    words: tuple[str, ...]
    spread: float = 1.0
    how: str = ""


@dataclass(frozen=True)
class Quantity:
    """What a column may have, and in which units.

    Attributes
    ----------
    what : in messages.
    units : those in which programs write it, first the one that gaitval calculates in.
    low, high : its plausible size in that unit.
    """

    what: str
    units: tuple[Unit, ...]
    low: float = 0.0
    high: float = math.inf

    def named(self, word: str) -> Unit | None:
        """The unit that a header calls by this `word`, in any spelling; None if it is unknown."""
        spelled = plain(word)
        known = {each: unit for unit in self.units for each in (plain(unit.name), *unit.words)}
        return known.get(spelled)

    def fits(self, value: float) -> bool:
        """Whether a `value` in the first unit is plausible."""
        return bool(self.low <= value <= self.high)


@dataclass(frozen=True)
class UnitSeen:
    """What the size of some numbers shows of their unit.

    Attributes
    ----------
    quantity : what they are of.
    stated : the unit that their header names; None if it names none.
    size : of the numbers as they are written.
    candidates : units in which numbers of this size are plausible: the first of the quantity, then
        those that bring it nearest to the middle of the range.
    """

    quantity: Quantity
    stated: Unit | None
    size: float
    candidates: tuple[Unit, ...]

    @property
    def unit(self) -> Unit | None:
        """The stated unit, if the numbers allow it; without one the only candidate; else None."""
        if self.stated is not None:
            return self.stated if self.stated in self.candidates else None
        return self.candidates[0] if len(self.candidates) == 1 else None

    @property
    def sentence(self) -> str:
        """What the numbers look like."""
        of, first = self.quantity, self.quantity.units[0].name
        if not self.candidates:
            return (
                f"outside the plausible {of.low:g} to {of.high:g} {first} of {of.what}, in every "
                "known unit"
            )
        return "this looks like " + " or ".join(
            f"{unit.name} ({unit.how or f'{self.size * unit.factor:.4g} {first}'})"
            for unit in self.candidates
        )


def unit_of(quantity: Quantity, word: str = "", *, size: float) -> UnitSeen:
    """Which unit some numbers are in that are so large as written (`size`), where their header
    names one by `word`, or none.
    """
    middle = math.sqrt(max(quantity.low, 1e-2 * quantity.high) * quantity.high)
    found = []
    for unit in quantity.units:
        low, high = unit.factor / unit.spread * size, unit.factor * unit.spread * size
        if low <= quantity.high and high >= quantity.low:
            off = math.inf if low <= 0.0 else abs(math.log(math.sqrt(low * high) / middle))
            found.append((unit is not quantity.units[0], off, unit))
    found.sort(key=lambda each: each[:2])
    candidates = tuple(unit for *_, unit in found)
    return UnitSeen(quantity, quantity.named(word), size, candidates)


def stated_factor(where: str, quantity: Quantity, word: str) -> float:
    """Factor to the first unit of `quantity` of the unit that a file names by `word`. Raises
    RecordError, which says `where` in the file that is, if it is missing or unknown.
    """
    unit = quantity.named(word)
    if unit is None:
        known = ", ".join(each.name for each in quantity.units)
        what = f"{word.strip()!r} is no known unit of {quantity.what} ({known})"
        raise RecordError(
            f"{where}: {what if word.strip() else 'no unit is given'}, so the numbers have no "
            "meaning: set the right unit in the program that made the file, and export again."
        )
    return unit.factor


def _length(*names: str) -> tuple[Unit, ...]:
    known = {
        "metres": Unit("metres", 1.0, ("m",)),
        "centimetres": Unit("centimetres", 1e-2, ("cm",)),
        "millimetres": Unit("millimetres", 1e-3, ("mm",)),
        "inches": Unit("inches", 0.0254, ("in",)),
        "feet": Unit("feet", 0.3048, ("ft",)),
    }
    return tuple(known[name] for name in names or known)


CONFUSED: Final = (
    *permutations(_length("metres", "centimetres", "millimetres"), 2),
    _length("inches", "millimetres"),
)
"""A unit of length, and the one that it is called; programs that know no inches call them mm."""


def confused(quantity: Quantity, size: float) -> str:
    """Which unit was taken for which, in numbers that are of this `size` in the first unit of
    `quantity` by the unit that their file states: "millimetres that are called metres"; empty if no
    such error makes them plausible.
    """
    if quantity.fits(size):
        return ""
    middle = math.sqrt(quantity.low * quantity.high)
    fits = {
        abs(math.log(right / middle)): f"{true.name} that are called {called.name}"
        for true, called in CONFUSED
        if quantity.fits(right := size * true.factor / called.factor)
    }
    return fits[min(fits)] if fits else ""


def looks_like(spread: float) -> str:
    """The error of the unit that makes a person's markers spread over so many metres, in brackets
    for a message; empty if none does.
    """
    words = confused(SPREAD, spread)
    return f" (it looks like {words})" if words else ""


def from_middle(points: Array) -> Array:
    """Distance (M,) of each of the markers `points` (M, 3), m, from the median of all: small
    wherever in the laboratory a person stands. Twice their median is about the spread.
    """
    return np.asarray(np.linalg.norm(points - np.median(points, axis=0), axis=1))


_PARTS: Final = (
    (r"millimet(er|re)s?", "mm"), (r"centimet(er|re)s?", "cm"), (r"met(er|re?)s?|mete$", "m"),
    (r"newtons?|^nt", "n"), (r"inch(es)?", "in"), (r"f(oo|ee)t", "ft"),
    (r"kilograms?", "kg"), (r"kg1", "/kg"), (r"bodyweights?|xbw", "bw"),
    (r"(^|/)seconds?|sec$", r"\1s"), (r"ms1$", "m/s"),
)  # fmt: skip
"""Other spellings of parts of a unit, millimetre before metre; the files of c3d.org have `nt`,
`ntmm`, and `mete`, cut to four letters."""


def plain(word: str) -> str:
    """A unit `word` of a file, for example `Millimeters`, `N.mm` or `Nm kg⁻¹`, in one spelling."""
    # `N.mm`, `N*mm` and `N-mm` are all `nmm`.
    short = re.sub(r"[\s.·⋅*^()\[\]⁻-]", "", word.replace("¹", "1")).lower()
    for written, part in _PARTS:
        short = re.sub(written, part, short)
    return short


_SI_LENGTHS: Final = ("metres", "centimetres", "millimetres")
_FORCES: Final = (Unit("N", 1.0, ("n",)), Unit("kN", 1e3, ("kn",)))
_MOMENTS: Final = (
    Unit("Nm", 1.0, ("nm",)), Unit("Ncm", 1e-2, ("ncm",)), Unit("Nmm", 1e-3, ("nmm",)),
    Unit("kNm", 1e3, ("knm",)),
)  # fmt: skip
_TIMES: Final = (Unit("seconds", 1.0, ("s",)), Unit("milliseconds", 1e-3, ("ms", "msec")))
_ANGLES: Final = (
    Unit("radians", 1.0, ("rad", "radian")),
    Unit("degrees", math.pi / 180.0, ("deg", "degree", "°", "grad")),
)
_PER_WEIGHT: Final = (
    Unit("body weights", 1.0, ("bw", "n/n")),
    Unit("% of body weight", 1e-2, ("%bw",)),
    Unit("N/kg", 1.0 / STANDARD_GRAVITY, ("n/kg",), how="divide by 9.80665"),
    Unit("N", 1.0 / (75.0 * STANDARD_GRAVITY), ("n",), 2.0,
         "divide by the weight in N, mass times 9.80665"),
)  # fmt: skip
_PER_MASS: Final = (
    Unit("Nm/kg", 1.0, ("nm/kg", "nm/kgbm")),
    Unit("Nmm/kg", 1e-3, ("nmm/kg",)),
    Unit("% of body weight times height", 1e-2 * STANDARD_GRAVITY * 1.6, ("%bwh",), 1.3,
         "multiply by 0.0980665 and the height in m"),
    Unit("Nm", 1.0 / 75.0, ("nm",), 2.0, "divide by the body mass in kg"),
    Unit("Nmm", 1e-3 / 75.0, ("nmm",), 2.0, "divide by 1000 and by the body mass in kg"),
)  # fmt: skip
_SHARES: Final = (Unit("of the whole", 1.0, ("1",)), Unit("per cent", 1e-2, ("%", "percent")))

LENGTH: Final = Quantity("a length", _length())
MILLIMETRE: Final = _length("millimetres")[0].factor
"""m."""
FORCE: Final = Quantity("a force", _FORCES)
MOMENT: Final = Quantity("a moment", _MOMENTS)
TIME: Final = Quantity("a time", _TIMES)
ANGLE: Final = Quantity("an angle", _ANGLES)
MOMENT_PER_MASS: Final = Quantity("a moment by mass", _PER_MASS[:2])
FORCE_PER_WEIGHT: Final = Quantity("a force by weight", _PER_WEIGHT[:3])
"""Those before are of any size: for words of headers."""

# ---- Of a person. Ranges catch units, not unusual people: from two years on. ----
SPREAD: Final = Quantity(
    "the space of a person's markers",
    _length("metres", "centimetres", "millimetres", "inches"), 0.4, 2.2,
)  # fmt: skip
"""From a child's legs to a tall adult with the arms up; in feet a child's legs would be as far
apart as an adult is in metres, and no program writes them."""
REACH: Final = Quantity("a marker from the middle of a person", _length(), 0.0, 2.0)
"""No marker on a tall adult with arms raised is farther away."""
PELVIS_HEIGHT: Final = Quantity("a pelvis above the ankles", _length(), 0.3, 1.4)
PLACE: Final = Quantity("the place of a walker in a laboratory", _length(), 0.0, 20.0)
STATURE: Final = Quantity("a stature", _length(), 0.8, 2.3)
BODY_MASS: Final = Quantity(
    "a body mass",
    (Unit("kilograms", 1.0, ("kg",)), Unit("pounds", POUND, ("lb", "lbs")),
     Unit("newtons", 1.0 / STANDARD_GRAVITY, ("n",)), Unit("grams", 1e-3, ("g",))),
    10.0, 200.0,
)  # fmt: skip
KNEE_WIDTH: Final = Quantity("a width of a knee", _length(*_SI_LENGTHS), 0.04, 0.17)
ANKLE_WIDTH: Final = Quantity("a width of an ankle", _length(*_SI_LENGTHS), 0.03, 0.12)
ELBOW_WIDTH: Final = Quantity("a width of an elbow", _length(*_SI_LENGTHS), 0.03, 0.12)
"""Across the bones, of children and adults; nobody measures them in inches."""
AGE: Final = Quantity(
    "an age",
    (Unit("years", 1.0, ("y", "yr", "yrs", "year", "a")), Unit("months", 1.0 / 12.0, ("mo",))),
    2.0,
    105.0,
)
WALKING_SPEED: Final = Quantity(
    "a speed of walking",
    (Unit("m/s", 1.0, ()), Unit("km/h", 1.0 / 3.6, ("kmh", "kmph")), Unit("cm/s", 1e-2, ()),
     Unit("mm/s", 1e-3, ())),
    0.1, 2.5,
)  # fmt: skip
STRIDE_TIME: Final = Quantity("a time of a stride", _TIMES, 0.5, 3.5)
LEFT_PHASE: Final = Quantity("the left strike in the right cycle", _SHARES, 0.2, 0.8)
STANCE: Final = Quantity("a stance", _SHARES, 0.4, 0.9)
JOINT_SWING: Final = Quantity(
    "the swing of a leg's joint in a walk", _ANGLES, math.radians(3.0), 2.0 * math.pi
)
"""Over a trial. No joint of a leg is ever turned right round; one of them moves by more than 3°."""
FREE_MOMENT: Final = Quantity(
    "a free moment by the force of its foot", (_MOMENTS[0], _MOMENTS[2]), 6e-4, 0.06
)
"""Nm for each N: a foot's is 0.004 to 0.04 on average, and friction keeps it below 0.1."""
ANKLE_MOMENT: Final = Quantity("the largest moment of an ankle", _PER_MASS, 0.35, 4.0)
"""It is 0.6 to 2 Nm/kg in walking, 0.35 at the least on a patient's better side."""
VERTICAL_FORCE: Final = Quantity("the largest vertical force", _PER_WEIGHT, 0.6, 3.0)
"""It is 0.8 to 1.5 body weights in walking."""
MEAN_FORCE: Final = Quantity("the mean vertical force", _PER_WEIGHT[:3], 0.85, 1.1)
"""Over a cycle of both feet, of which it is 1 where gait repeats itself and plates are true."""
