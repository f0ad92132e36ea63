"""Whether masses, inertias and lengths of a model can be those of a person."""

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from gaitval.apps.judge.results import JudgedSegment
from gaitval.apps.judge.skeleton import Skeleton
from gaitval.arrays import Array
from gaitval.metrics.tolerances import Measure, measured
from gaitval.scaling.anthropometry import DE_LEVA, STATURE, Proportions
from gaitval.scaling.opensim.model import OpenSimBody

PARTS: Final[Mapping[str, tuple[str, ...]]] = {
    "thigh": ("thigh",),
    "shank": ("shank",),
    "foot": ("talus", "foot", "toes"),
    "upper arm": ("upper_arm",),
    "forearm": ("ulna", "radius"),
}
"""Segment of de Leva's table -> parts that models make of it; hands are in some models part of the
forearm, heads of the trunk, and are not compared."""


def stature_of_legs(leg_length: float) -> float:
    """Stature, m, of people with a thigh and shank of `leg_length` m (mean of de Leva's)."""
    shares = [
        (table["thigh"].length + table["shank"].length) / STATURE[sex]
        for sex, table in DE_LEVA.items()
    ]
    return leg_length / float(np.mean(shares))


def segment_shares(skeleton: Skeleton) -> dict[str, JudgedSegment]:
    """Masses of limb segments that the model of `skeleton` has, by `thigh_r`, `thigh_l`, ..."""
    model, found = skeleton.model, {}
    for segment, parts in PARTS.items():
        expected = _mean(segment, lambda one: one.mass)
        for side in "rl":
            bodies = [b for part in parts if (b := skeleton.bodies.get(f"{part}_{side}"))]
            if bodies:
                mass = sum(model.bodies[name].mass for name in bodies)
                found[f"{segment.replace(' ', '_')}_{side}"] = JudgedSegment(
                    mass_kg=mass, share=mass / model.mass, expected_share=expected
                )
    return found


def body_measures(skeleton: Skeleton, stature: float | None, mass: float | None) -> list[Measure]:
    """What can be judged of the model of `skeleton` alone; `stature` (m) and `mass` (kg) of the
    person where they are known.
    """
    model = skeleton.model
    measures = [
        measured("inertia_triangle", name, _triangle(body.inertia))
        for name, body in model.bodies.items()
        if body.mass > 0.0 and np.abs(body.inertia).max() > 0.0
    ]
    if mass is not None:
        measures.append(measured("model_mass_error", "model", 100 * abs(model.mass / mass - 1)))
    if stature is not None:
        measures.append(measured("body_mass_index", "model", model.mass / stature**2))
    shares = segment_shares(skeleton)
    measures += [
        measured("mass_share_factor", name, _factor(one.share, one.expected_share))
        for name, one in shares.items()
    ]
    for segment in ("thigh", "shank"):
        for side in "rl":
            measures += _gyration(skeleton, f"{segment}_{side}")
    return [*measures, *_sides(skeleton, shares)]


def _gyration(skeleton: Skeleton, segment: str) -> list[Measure]:
    length, name = skeleton.length(segment), skeleton.bodies.get(segment)
    if length is None or name is None or skeleton.model.bodies[name].mass <= 0.0:
        return []
    body = skeleton.model.bodies[name]
    expected = _mean(segment[:-2], lambda one: (one.sagittal + one.transverse) / 2)
    return [measured("gyration_factor", segment, _factor(_across(body) / length, expected))]


def _across(body: OpenSimBody) -> float:
    """Radius of gyration about the axes across the long one, m: the two larger moments."""
    moments = np.sort(np.linalg.eigvalsh(body.inertia))
    return float(np.sqrt(max(moments[1:].mean(), 0.0) / body.mass))


def _sides(skeleton: Skeleton, shares: Mapping[str, JudgedSegment]) -> list[Measure]:
    masses = {name: one.mass_kg for name, one in shares.items()}
    lengths = {
        f"{name}_{side}": length
        for name in ("thigh", "shank")
        for side in "rl"
        if (length := skeleton.length(f"{name}_{side}")) is not None
    }
    found = []
    for kind, values in (("side_length_difference", lengths), ("side_mass_difference", masses)):
        for name, right in values.items():
            left = values.get(f"{name[:-2]}_l")
            if name.endswith("_r") and left is not None and right + left > 0.0:
                off = 200 * abs(right - left) / (right + left)
                found.append(measured(kind, name[:-2], off))
    return found


def _triangle(inertia: Array) -> float:
    """Largest principal moment over the sum of the others; infinite where one is negative."""
    # Of any mass the largest principal moment is at most the sum of the others: 2 ∫ z² dm ≥ 0.
    low, middle, high = np.linalg.eigvalsh(inertia)
    rounding = 1e-9 * abs(high)
    if low < -rounding or low + middle <= 0.0:
        return float("inf")
    return float(high / (low + middle))


def _factor(value: float, expected: float) -> float:
    if value <= 0.0:
        return float("inf")
    return max(value / expected, expected / value)


def _mean(segment: str, of: Callable[[Proportions], float]) -> float:
    return float(np.mean([of(table[segment]) for table in DE_LEVA.values()]))
