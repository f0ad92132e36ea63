"""Muscles as straight strands between sites on the segments of our body, as MuJoCo's tendons run.

A muscle is one strand, or the mean of two or three, and a constant length. The sites are shipped
for a leg of the published size (`experiments/muscle_sites.py`), and grow with the bones that they
are on. Sites are of a right leg, in the segments' axes (x forward, y left, z up); a left one is in
the mirror. Those of the pelvis are from the hip's centre.
"""

import json
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.musculature.paths import table

SEGMENTS: Final = ("pelvis", "thigh", "shank", "foot")

Strand = Sequence[tuple[str, Array]]
"""Segment and place (3,) m of each site."""


class Tendon(NamedTuple):
    """Sites of a muscle.

    Attributes
    ----------
    strands : whose mean length, and `more` m, is the muscle's.
    error : m, how far 95 % of poses of gait are off in a leg of the published size.
    """

    strands: tuple[tuple[tuple[str, tuple[float, ...]], ...], ...]
    more: float
    error: float


@cache
def tendons() -> Mapping[str, Tendon]:
    """The shipped tendons by the name of the muscle, without side."""
    text = files("gaitval.musculature").joinpath("sites.json").read_text("utf-8")
    return {
        row["muscle"]: Tendon(
            tuple(
                tuple((site["segment"], tuple(site["at_m"])) for site in strand)
                for strand in row["strands"]
            ),
            float(row["more_m"]),
            1e-3 * float(row["error_95_mm"]),
        )
        for row in json.loads(text)["muscles"]
    }


def strand_lengths(leg: Array, strands: Sequence[Strand], factors: Array) -> Array:
    """Sum of the lengths (N,) m of `strands` at gaitval's coordinates `leg` (N, 6) rad of
    `paths.COORDINATES`, in a leg with bones of `factors` (4,) of `mapping.BoneSizes`.
    """
    bones = table().skeleton
    flexion, adduction, rotation, knee, ankle, subtalar = leg.T
    hip = _turn(-flexion, 1) @ _turn(adduction, 0) @ _turn(rotation, 2)
    shank = hip @ _turn(knee, 1)
    foot = shank @ _turn(-ankle, 1) @ _turn(subtalar, 0)
    at_knee = hip @ np.array([0.0, 0.0, -factors[1] * bones.thigh])
    at_ankle = at_knee + shank @ np.array([0.0, 0.0, -factors[2] * bones.shank])
    turns = {
        "pelvis": np.broadcast_to(np.eye(3), hip.shape),
        "thigh": hip,
        "shank": shank,
        "foot": foot,
    }
    origins = {
        "pelvis": np.zeros_like(at_knee), "thigh": np.zeros_like(at_knee), "shank": at_knee,
        "foot": at_ankle,
    }  # fmt: skip
    size = dict(zip(SEGMENTS, factors, strict=True))
    total = np.zeros(len(leg))
    for strand in strands:
        places = [
            origins[segment] + turns[segment] @ (size[segment] * np.asarray(at))
            for segment, at in strand
        ]
        for first, second in pairwise(places):
            total += np.linalg.norm(second - first, axis=1)
    return total


def _turn(angle: Array, axis: int) -> Array:
    """(N, 3, 3) about a coordinate axis."""
    sine, cosine = np.sin(angle), np.cos(angle)
    found = np.zeros((len(angle), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    found[:, axis, axis] = 1.0
    found[:, i, i] = found[:, j, j] = cosine
    found[:, j, i], found[:, i, j] = sine, -sine
    return found
