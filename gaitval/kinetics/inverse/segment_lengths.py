"""The body lengths that a recording can show, and what moves with each of them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import ScalingError
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.parameters import (
    PARAMETERS,
    apply_parameters,
    nominal_parameters,
    stretched_inertia,
)

LENGTH_SD: Final[dict[str, float]] = {
    "thigh": 0.006,
    "shank": 0.006,
    "hip_half_width": 0.008,
    "hip_forward": 0.008,
    "hip_up": 0.008,
    "lumbar_forward": 0.020,
    "lumbar_up": 0.020,
    "shoulder_half_width": 0.015,
    "shoulder_up": 0.015,
    "upper_arm": 0.015,
}
"""The lengths that are fitted, m, and the standard deviations of their priors. Both sides of the
body have the same.

| length | from | to |
|---|---|---|
| thigh, shank, upper_arm | joint | next joint |
| hip_half_width, shoulder_half_width | midline | joint |
| hip_forward, hip_up | where the standing trial put the hips in the pelvis | where they are |
| lumbar_forward, lumbar_up | middle of the hips | lumbar joint |
| shoulder_up | lumbar joint | level of the shoulders |

Hips: Harrington's regression has an error of about 8-10 mm each way (Leardini et al. 1999,
Harrington et al. 2007); knee and ankle: middle of the palpated condyles and malleoli, with an error
of about a marker's size; lumbar joint, shoulder and upper arm: ANSUR II regressions on stature have
an error of 14-21 mm. The prior of the thigh refers to the knee: a hip that is further up makes the
thigh longer.
"""

LENGTHS: Final = tuple(LENGTH_SD)
"""Their order in arrays of K lengths."""


def lengths_of(model: BodyModel) -> dict[str, float]:
    """The lengths of `LENGTH_SD` in a `model`, m, of arms and legs the mean of both sides; the
    displacement of the hips is 0.
    """
    position = {segment.name: segment.joint_position for segment in model.segments}

    def mean(lower: str) -> float:
        return float(-(position[f"{lower}_r"][2] + position[f"{lower}_l"][2]) / 2)

    return {
        # A joint's position is in its parent's frame, z up and y left: knee and ankle are below,
        # right joints at negative y.
        "thigh": mean("shank"),
        "shank": mean("foot"),
        "hip_half_width": float(-position["thigh_r"][1]),
        "hip_forward": 0.0,
        "hip_up": 0.0,
        "lumbar_forward": float(position["torso"][0]),
        "lumbar_up": float(position["torso"][2]),
        "shoulder_half_width": float(-position["upper_arm_r"][1]),
        "shoulder_up": float(position["upper_arm_r"][2]),
        "upper_arm": mean("forearm"),
    }


def with_lengths(model: BodyModel, lengths: Mapping[str, float]) -> BodyModel:
    """The `model` with other `lengths`, m, by the keys of `LENGTH_SD`; those not given are
    unchanged. Raises ScalingError if one is not finite and positive.

    A longer thigh, shank or upper arm keeps its mass; its centre of mass and inertia stretch with
    it (as in `model.parameters`). `hip_forward` and `hip_up` move the hips in the pelvis; because
    the pelvis' origin is between the hips, its centre of mass moves the other way.
    """
    before = lengths_of(model)
    after = before | dict(lengths)
    bad = [
        f"{name} {after[name]:.3f} m"
        for name in ("thigh", "shank", "hip_half_width", "shoulder_half_width", "upper_arm")
        if not after[name] > 0
    ]
    if bad or not all(np.isfinite(value) for value in after.values()):
        raise ScalingError(
            f"lengths must be finite and above zero, but these are not: {', '.join(bad)}."
        )
    mu = nominal_parameters()
    mu[PARAMETERS.index("thigh_length")] = after["thigh"] / before["thigh"]
    mu[PARAMETERS.index("shank_length")] = after["shank"] / before["shank"]
    # The right hip is at −`hip_half_width` along y.
    mu[PARAMETERS.index("hip_y")] = before["hip_half_width"] - after["hip_half_width"]
    legs = apply_parameters(model, mu)
    change = np.array([after[name] - before[name] for name in LENGTHS])
    moved = joint_shifts() @ change
    hips = np.array([after["hip_forward"], 0.0, after["hip_up"]])
    arm = after["upper_arm"] / before["upper_arm"]
    segments = []
    for segment, shift in zip(legs.segments, moved, strict=True):
        if segment.name == "pelvis":
            segment = replace(segment, centre_of_mass=segment.centre_of_mass - hips)
        elif segment.name.startswith("upper_arm"):
            segment = replace(
                segment,
                centre_of_mass=segment.centre_of_mass * np.array([1.0, 1.0, arm]),
                inertia=stretched_inertia(segment.inertia, 2, arm),
            )
        # `apply_parameters` has moved the joints of the legs.
        if segment.name.startswith(("torso", "upper_arm", "forearm")):
            segment = replace(segment, joint_position=segment.joint_position + shift)
        segments.append(segment)
    return replace(legs, segments=tuple(segments))


def joint_shifts() -> Array:
    """How far the joints move in their parents' frames per metre of each length, (14, 3, K) m/m."""
    shifts = np.zeros((len(SEGMENTS), 3, len(LENGTHS)))

    def put(segment: str, axis: int, length: str, factor: float) -> None:
        shifts[SEGMENTS.index(segment), axis, LENGTHS.index(length)] = factor

    for side, outwards in (("r", -1.0), ("l", 1.0)):
        put(f"shank_{side}", 2, "thigh", -1.0)
        put(f"foot_{side}", 2, "shank", -1.0)
        put(f"forearm_{side}", 2, "upper_arm", -1.0)
        put(f"thigh_{side}", 1, "hip_half_width", outwards)
        put(f"upper_arm_{side}", 1, "shoulder_half_width", outwards)
        put(f"upper_arm_{side}", 2, "shoulder_up", 1.0)
    put("torso", 0, "lumbar_forward", 1.0)
    put("torso", 2, "lumbar_up", 1.0)
    # The pelvis' origin moves with the hips.
    put("torso", 0, "hip_forward", -1.0)
    put("torso", 2, "hip_up", -1.0)
    return shifts


def skin_shifts(model: BodyModel, markers: Sequence[ModelMarker]) -> Array:
    """How the M `markers`' places in their segments would differ with other lengths than those of
    the standing trial, which `model` has: (M, 3, K) m per metre of each length.

    The skin stays where the standing trial showed it, and a segment's frame runs from its upper
    joint to its lower one.
    """
    lengths = lengths_of(model)
    coupling = np.zeros((len(markers), 3, len(LENGTHS)))

    for row, marker in zip(coupling, markers, strict=True):

        def put(axis: int, length: str, factor: float, row: Array = row) -> None:
            row[axis, LENGTHS.index(length)] = factor

        kind, side = marker.segment.split("_")[0], marker.segment[-1]
        if kind == "pelvis":
            put(0, "hip_forward", -1.0)
            put(2, "hip_up", -1.0)
        elif kind == "thigh":
            # At the hip the skin stays; at the knee it moves with the knee.
            down = -float(marker.position[2]) / lengths["thigh"]
            put(2, "thigh", -down)
            put(2, "hip_up", -(1.0 - down))
            put(0, "hip_forward", -(1.0 - down))
            # The hip moves outwards below the skin, so a marker near it moves inwards in the thigh.
            put(1, "hip_half_width", (1.0 - down) * (1.0 if side == "r" else -1.0))
        elif kind == "shank":
            # Nothing at the knee, the whole length at the ankle; z is negative below the knee.
            put(2, "shank", float(marker.position[2]) / lengths["shank"])
        elif kind == "torso":
            put(0, "lumbar_forward", -1.0)
            put(2, "lumbar_up", -1.0)
        elif kind == "upper":
            put(2, "upper_arm", float(marker.position[2]) / lengths["upper_arm"])
    return coupling


def length_precision(deviation: Array) -> Array:
    """PᵀDP, (K, K) 1/m², the inverse covariance of the lengths' prior with the standard `deviation`
    (K,) m of each; one that is fixed, with 0, gets that of `LENGTH_SD`, so that the matrix can be
    inverted.
    """
    deviation = np.where(deviation > 0, deviation, list(LENGTH_SD.values()))
    relation = np.eye(len(LENGTHS))
    # The prior is that of the knee: if the hip is higher and the thigh longer by as much, the knee
    # stays.
    relation[LENGTHS.index("thigh"), LENGTHS.index("hip_up")] = -1.0
    return np.asarray(relation.T @ (relation / deviation[:, None] ** 2))
