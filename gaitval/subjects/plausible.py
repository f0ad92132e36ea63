"""Implausible values of a subject, one sentence each: what was seen, why it is wrong, how to fix
it. `VALUES` and `RELATIONS` are the tables of what is held against what people are like.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np
from pydantic import ValidationError

from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES
from gaitval.gait.quality_flags import QualityFlag
from gaitval.gait.record import FittedCurve
from gaitval.units import (
    AGE,
    BODY_MASS,
    LEFT_PHASE,
    MEAN_FORCE,
    PELVIS_HEIGHT,
    STANCE,
    STATURE,
    STRIDE_TIME,
    WALKING_SPEED,
    Quantity,
    unit_of,
)

VALUES: Final[Mapping[str, Quantity]] = {
    "mass_kg": BODY_MASS,
    "height_m": STATURE,
    "leg_length_m": PELVIS_HEIGHT,
    "age_years": AGE,
    "walking_speed_m_s": WALKING_SPEED,
    "stride_time_s": STRIDE_TIME,
    "left_phase": LEFT_PHASE,
    "mean_vertical_force": MEAN_FORCE,
    "stance_fraction.right": STANCE,
    "stance_fraction.left": STANCE,
}
"""What each value of a subject is."""
LEAST_WITH_AID: Final = 0.1
"""Body weights on the feet of a person whose aid carries the rest."""


class Relation(NamedTuple):
    """A number that two values of a person, of these `names`, have together; the least and the
    most that anybody has; and what is said of another one.
    """

    names: tuple[str, str]
    value: Callable[[float, float], float]
    low: float
    high: float
    sentence: str


RELATIONS: Final = (
    Relation(
        ("mass_kg", "height_m"), lambda mass, height: mass / height**2, 10.0, 80.0,
        "mass_kg = {0:g} and height_m = {1:g}: the body mass index is {value:.1f} kg/m², outside "
        "{low:g}-{high:g}. Check both values and their units.",
    ),
    # WBDS 0.48 to 0.56, at two years 0.42.
    Relation(
        ("leg_length_m", "height_m"), lambda leg, height: leg / height, 0.38, 0.60,
        "leg_length_m = {0:g}: {value:.2f} of height_m = {1:g}, outside {low:g}-{high:g}. Leg "
        "length is from hip to floor, in metres.",
    ),
    # A fast walker's is 2.7, a runner's 2.3.
    Relation(
        ("stride_time_s", "leg_length_m"),
        lambda time, leg: time / float(np.sqrt(max(leg, 0.1) / STANDARD_GRAVITY)), 2.3, np.inf,
        "stride_time_s = {0:g}: nobody walks so fast on legs of {1:g} m; this looks like the time "
        "of a step. A stride is two: give twice the time.",
    ),
)  # fmt: skip
LARGEST: Final = {"angles": 3.0, "moments": 5.0}
"""rad, Nm/kg. Of a curve's mean and harmonics in a file of a subject: what nobody reaches."""
ADULT: Final = 18.0
"""Years of age from which a person is held against adults, where there are any."""
OLDEST_CHILD: Final = 12.0
"""Years of age until which children are about as tall as the rule says."""
BUILD: Final[Mapping[str, tuple[float, float]]] = {
    "child": (10.0, 35.0),
    "youth": (10.0, 45.0),
    "adult": (14.0, 45.0),
}
"""Body mass index, kg/m², beyond which a mistake is as likely as such a person. Convention."""
SMALLEST_ADULT: Final = 1.4
"""m. Hardly an adult is smaller."""


def statures_at(age: float) -> tuple[float, float]:
    """m, within which children of an `age` (years) are tall: 77 cm and 6 cm a year, within 4 % of
    the medians of boys and girls in CDC's growth charts of 2000 (Kuczmarski et al., Adv Data 314),
    and three standard deviations of 4.3 %. Youths are no smaller than children of `OLDEST_CHILD`.
    """
    usual = 0.77 + 0.06 * min(age, OLDEST_CHILD)
    return 0.87 * usual, 1.13 * usual if age <= OLDEST_CHILD else STATURE.high


def unusual_build(mass: float, height: float, age: float | None) -> Iterator[QualityFlag]:
    """What may be a mistake, though people are so, of a body of this `mass` (kg), `height` (m) and
    `age` (years): a body mass index or a stature that is rare at this age.
    """
    index = mass / height**2
    years = "no age was given" if age is None else f"{age:g} years old"
    group, tall = "adult", (SMALLEST_ADULT, STATURE.high)
    if age is not None and age < ADULT:
        group, tall = "child" if age <= OLDEST_CHILD else "youth", statures_at(age)
    for value, (low, high), unit, what in (
        (index, BUILD[group], "kg/m²", f"a body mass index of {index:.0f} kg/m²"),
        (height, tall, "m", f"{height:g} m"),
    ):
        if not low <= value <= high:
            yield QualityFlag(
                "build", "the person", value, low if value < low else high, unit,
                f"{mass:g} kg at {height:g} m, and {years}: {what} is hardly anybody's of this age "
                f"({low:.3g} to {high:.3g} {unit}). Check mass, stature and age, and their units",
            )  # fmt: skip


def value_problems(
    values: Mapping[str, float | None], *, of: Mapping[str, Quantity] = VALUES
) -> list[str]:
    """What is wrong with `values` of a person by their name in a subject's file, one sentence
    each; those that are None or no number are not looked at.
    """
    problems, fitting = list[str](), dict[str, float]()
    for name, quantity in of.items():
        value = values.get(name)
        if value is None or not np.isfinite(value):
            continue
        if quantity.fits(value):
            fitting[name] = value
            continue
        first = quantity.units[0].name
        like = unit_of(quantity, size=value).candidates[:1]
        problems += [
            f"{name} = {value:g}: this looks like {unit.name}; "
            f"give {first}: {name} = {value * unit.factor:g}."
            for unit in like
        ] or [
            f"{name} = {value:g}: outside the plausible {quantity.low:g}-{quantity.high:g} "
            f"{first}. Check value and unit."
        ]
    for names, together, low, high, sentence in RELATIONS:
        given = [fitting[name] for name in names if name in fitting]
        if len(given) == len(names) and not low <= (found := together(*given)) <= high:
            problems.append(sentence.format(*given, value=found, low=low, high=high))
    return problems


def _curve_problems(gait: Mapping[str, Any]) -> Iterator[str]:
    for group, largest in LARGEST.items():
        for name, curve in _table(gait, group).items():
            try:
                fitted = FittedCurve.model_validate(curve)
            except ValidationError:  # said elsewhere
                continue
            if max(map(abs, (fitted.mean, *fitted.cosine, *fitted.sine))) > largest:
                yield f"gait.{group}.{name}: nobody has so large a curve. Check the unit."


def implausible(values: Mapping[str, Any]) -> list[str]:
    """Every implausible value of a subject's tables (`values`), one sentence each.

    It works on the keys that are there, so it can add to the list of missing and malformed keys.
    """
    stance, gait = (_table(values, name) for name in ("stance_fraction", "gait"))
    aided = replace(MEAN_FORCE, low=LEAST_WITH_AID)
    of = VALUES if values.get("aid") is None else {**VALUES, "mean_vertical_force": aided}
    shares = {f"stance_fraction.{side}": stance.get(side) for side in SIDES}
    problems = value_problems({n: _number({**values, **shares}.get(n)) for n in of}, of=of)
    unseen = _table(gait, "not_recorded").values()
    problems += [
        f"stance_fraction.{side}: missing. Add it."
        for side in SIDES
        if stance and stance.get(side) is None and side not in unseen
    ]
    return [*problems, *_curve_problems(gait)]


def _number(value: Any) -> float | None:
    """A finite number, or None: other checks report anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        return None
    return float(value)


def _table(values: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """The table of this `name`; an empty one where there is none."""
    found = values.get(name)
    return found if isinstance(found, Mapping) else {}
