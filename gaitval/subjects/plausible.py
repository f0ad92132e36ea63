"""Implausible values of a subject, one sentence each: what was seen, why it is wrong, how to fix
it.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

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
    REACH,
    STANCE,
    STATURE,
    STRIDE_TIME,
    VERTICAL_FORCE,
    WALKING_SPEED,
    Quantity,
    from_middle,
    looks_like,
    unit_of,
)

BUILD: Final[Mapping[str, float]] = {
    "thinnest": 10.0,
    "fattest": 80.0,
    "thin": 14.0,
    "obese": 45.0,
    "obese child": 35.0,
    "small": 1.4,
}
"""Body mass index, kg/m²: the least and most that a person has; below which an adult hardly walks,
and many a child is so; above which pounds for kilograms are as likely, and the same of children,
who weigh less for their stature. And the stature, m, below which hardly an adult is. Convention."""
LEG_RATIO: Final = (0.38, 0.60)
"""Leg length over stature: WBDS 0.48 to 0.56, at two years 0.42."""
STEP_LIKE: Final = 2.3
"""Stride time over sqrt(leg length / g): a fast walker's is 2.7, a runner's 2.3."""
LEAST_WITH_AID: Final = 0.1
"""Body weights on the feet of a person whose aid carries the rest."""
LARGEST: Final[Mapping[str, tuple[float, str]]] = {
    "angles": (3.0, "rad"),
    "moments": (5.0, "Nm/kg"),
}
"""Of curves in a file of a subject: what nobody reaches."""


_STATURES: Final = {
    24.0: ((0.941523967, 86.45220101, 0.040321528), (1.07244896, 84.97555512, 0.040791394)),
    60.5: ((1.266367398, 109.1751441, 0.042593311), (-0.057729947, 107.9566031, 0.044276588)),
    84.5: ((0.753244292, 122.0305342, 0.044403374), (-0.210210748, 121.7616844, 0.045460702)),
    108.5: ((0.415687443, 133.7344759, 0.046217028), (0.08414848, 133.1303527, 0.04688401)),
    144.5: ((0.420919142, 149.3088178, 0.049947823), (1.303044695, 151.4865636, 0.048599314)),
}
"""L, M (cm), S of statures of boys and girls by age in months: CDC growth charts of 2000
(Kuczmarski et al., Adv Data 314; table statage, in the public domain, read in a program that has
it). A stature z SD from the median is M (1 + L S z)^(1/L)."""
OLDEST_CHILD: Final = max(_STATURES) / 12.0
"""Years of age until which a stature is held against them; later people grow at unlike ages, and
are no smaller than then."""


def statures_at(age: float) -> tuple[float, float]:
    """m, within which all but one child in a thousand of an `age` (years) are tall: three SD from
    the median, of boys and girls together. Of later ages those of `OLDEST_CHILD`.
    """

    def at(z: float, which: Callable[[Iterable[float]], float]) -> float:
        tall = [
            which(m * (1.0 + power * share * z) ** (1.0 / power) for power, m, share in both)
            for both in _STATURES.values()
        ]
        return 0.01 * float(np.interp(12.0 * age, list(_STATURES), tall))

    return at(-3.0, min), at(3.0, max)


ADULT: Final = 18.0
"""Years of age from which a person is held against adults, where there are any."""


def _number(values: Mapping[str, Any], name: str) -> float | None:
    """The finite number stored under `name`, or None: other checks report anything else."""
    value = values.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        return None
    return float(value)


def _within(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]


def mass_and_height_problems(mass: float, height: float) -> list[str]:
    """What is wrong with a body `mass` (kg) and a stature `height` (m), one sentence each."""
    given = {"mass_kg": mass, "height_m": height}
    problems = [
        *_range_problem(given, "mass_kg", BODY_MASS),
        *_range_problem(given, "height_m", STATURE),
    ]
    if problems:
        return problems
    index, thin, fat = mass / height**2, BUILD["thinnest"], BUILD["fattest"]
    return [] if thin <= index <= fat else [
        f"mass_kg = {mass:g} and height_m = {height:g}: the body mass index is {index:.1f} kg/m², "
        f"outside {thin:g}-{fat:g}. Check both values and their units."
    ]  # fmt: skip


def unusual_build(mass: float, height: float, age: float | None) -> Iterator[QualityFlag]:
    """What may be a mistake, though people are so, of a body of this `mass` (kg), `height` (m) and
    `age` (years): a body mass index or a stature that is rare at this age.
    """
    index = mass / height**2
    child = age is not None and age <= OLDEST_CHILD
    years = "no age was given" if age is None else f"{age:g} years old"
    thin, fat = BUILD["thinnest"], BUILD["obese child" if child else "obese"]
    low, high = BUILD["small"], STATURE.high
    if age is not None and age < ADULT:
        low, high = statures_at(age)[0], statures_at(age)[1] if child else STATURE.high
    elif height >= low:
        thin = BUILD["thin"]
    for value, limits, unit, what in (
        (index, (thin, fat), "kg/m²", f"a body mass index of {index:.0f} kg/m²"),
        (height, (low, high), "m", f"{height:g} m"),
    ):
        if not _within(value, limits):
            yield QualityFlag(
                "build", "the person", value, limits[0] if value < limits[0] else limits[1], unit,
                f"{mass:g} kg at {height:g} m, and {years}: {what} is hardly anybody's of this age "
                f"({limits[0]:.3g} to {limits[1]:.3g} {unit}). Check mass, stature and age, and "
                "their units",
            )  # fmt: skip


def _range_problem(values: Mapping[str, Any], name: str, of: Quantity) -> list[str]:
    """A sentence on a value that is out of the range of its quantity, and the unit it may be in."""
    value = _number(values, name)
    if value is None or of.fits(value):
        return []
    first = of.units[0].name
    for unit in unit_of(of, size=value).candidates:
        return [
            f"{name} = {value:g}: this looks like {unit.name}; "
            f"give {first}: {name} = {value * unit.factor:g}."
        ]
    return [
        f"{name} = {value:g}: outside the plausible {of.low:g}-{of.high:g} {first}. "
        "Check value and unit."
    ]


def age_problems(age: float | None) -> list[str]:
    """What is wrong with an `age` in years, in a sentence; nothing if it is not known."""
    return _range_problem({"age_years": age}, "age_years", AGE)


def _marker_problems(markers: Mapping[str, Any]) -> list[str]:
    positions = {
        name: np.array(at, dtype=float)
        for name, at in markers.items()
        if isinstance(at, list | tuple)
        and len(at) == 3
        and all(isinstance(value, int | float) for value in at)
        and np.all(np.isfinite(at))
    }
    away = from_middle(np.array([*positions.values()])) if positions else np.zeros(0)
    far = [name for name, distance in zip(positions, away, strict=True) if distance > REACH.high]
    if far:
        return [
            f"markers: {len(far)} of {len(positions)} are more than {REACH.high:g} m from the "
            f"middle of the person (the first is {far[0]} at {positions[far[0]].tolist()}). "
            f"Correct their places, or the unit{looks_like(2.0 * float(np.median(away)))}."
        ]
    hips, knees = ([positions.get(f"{side}.{name}") for side in "RL"] for name in ("ASIS", "Knee"))
    wrong = [
        f"{side}.ASIS is not above {side}.Knee"
        for side, hip, knee in zip("RL", hips, knees, strict=True)
        if hip is not None and knee is not None and hip[2] <= knee[2]
    ]
    right, left = hips
    if right is not None and left is not None and left[1] <= right[1]:
        wrong.append("L.ASIS is not to the left of R.ASIS")
    return [
        f"markers: {each}. Axes must be x forward, y left, z up, and the sides the person's own; "
        "ISB axes (y up, z right) convert as x, -z, y."
        for each in wrong[:1]
    ]


def _curve_values(curve: Any, until: float = 1.0) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    """Samples of a curve as written in the TOML, over phases 0…`until`; None if malformed."""
    try:
        periodic = FittedCurve.model_validate(curve).periodic()
    except ValidationError:
        return None
    return periodic(np.linspace(0, until, 100))


def _curve_problems(gait: Mapping[str, Any], stance: Mapping[str, Any]) -> list[str]:
    problems = []
    for group, (largest, unit) in LARGEST.items():
        curves = gait.get(group)
        for name, curve in curves.items() if isinstance(curves, Mapping) else ():
            values = _curve_values(curve)
            if values is not None and np.abs(values).max() > largest:
                problems.append(
                    f"gait.{group}.{name}: reaches {np.abs(values).max():.3g} {unit}, more than "
                    f"anybody's {largest:g}. Check the unit."
                )
    forces = gait.get("forces")
    for side in SIDES:
        until = _number(stance, side)
        force = forces.get(side) if isinstance(forces, Mapping) else None
        up = force.get("up") if isinstance(force, Mapping) else None
        values = None if until is None or up is None else _curve_values(up, until)
        if values is None:
            continue
        if np.abs(values).max() > VERTICAL_FORCE.high or values.mean() <= 0:
            problems.append(
                f"gait.forces.{side}.up: goes from {values.min():.3g} to {values.max():.3g} body "
                f"weights in stance, where the ground pushes up. Check sign and unit."
            )
    return problems


def implausible(values: Mapping[str, Any]) -> list[str]:
    """Every implausible value of a subject's tables (`values`), one sentence each.

    It works on the keys that are there, so it can add to the list of missing and malformed keys.
    """
    mass, height = _number(values, "mass_kg"), _number(values, "height_m")
    leg = _number(values, "leg_length_m")
    problems = []
    if mass is not None and height is not None:
        problems += mass_and_height_problems(mass, height)
    if leg and height and STATURE.fits(height) and not _within(leg / height, LEG_RATIO):
        problems.append(
            f"leg_length_m = {leg:g}: {leg / height:.2f} of height_m = {height:g}, outside "
            f"{LEG_RATIO[0]:g}-{LEG_RATIO[1]:g}. Leg length is from hip to floor, in metres."
        )
    problems += age_problems(_number(values, "age_years"))
    problems += _range_problem(values, "walking_speed_m_s", WALKING_SPEED)
    problems += _range_problem(values, "stride_time_s", STRIDE_TIME)
    time = _number(values, "stride_time_s")
    if time is not None and leg is not None and time >= STRIDE_TIME.low and leg <= STATURE.high:
        pendulum = np.sqrt(max(leg, 0.1) / STANDARD_GRAVITY)
        if time < STEP_LIKE * pendulum:
            problems.append(
                f"stride_time_s = {time:g}: nobody walks so fast on legs of {leg:g} m; this looks "
                f"like the time of a step. A stride is two: stride_time_s = {2 * time:g}."
            )
    problems += _range_problem(values, "left_phase", LEFT_PHASE)
    aided = MEAN_FORCE if values.get("aid") is None else replace(MEAN_FORCE, low=LEAST_WITH_AID)
    share = _number(values, "mean_vertical_force")
    carried = "" if mass is None or share is None else f" The plates carry {share * mass:.1f} kg."
    problems += [f"{p}{carried}" for p in _range_problem(values, "mean_vertical_force", aided)]
    stance = values.get("stance_fraction")
    stance = stance if isinstance(stance, Mapping) else {}
    gait = values.get("gait")
    lacking = gait.get("not_recorded") if isinstance(gait, Mapping) else None
    for side in SIDES:
        unseen = isinstance(lacking, Mapping) and side in lacking.values()
        if stance and stance.get(side) is None and not unseen:
            problems.append(f"stance_fraction.{side}: missing. Add it.")
        problems += [
            f"stance_fraction.{problem}" for problem in _range_problem(stance, side, STANCE)
        ]
    if isinstance(values.get("markers"), Mapping):
        problems += _marker_problems(values["markers"])
    if isinstance(values.get("gait"), Mapping):
        problems += _curve_problems(values["gait"], stance)
    return problems
