"""Muscles as straight strands between sites on the segments of our body, as MuJoCo's tendons run.

A muscle is one strand, or the mean of two or three, and a constant length. The sites are shipped
for a leg of the published size (`experiments/muscle_sites.py`), and grow with the bones that they
are on. Sites are of a right leg, in the segments' axes (x forward, y left, z up); a left one is in
the mirror. Those of the pelvis are from the hip's centre.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from gaitval.arrays import Array
from gaitval.kinetics.musculature.own_coordinates import own_lengths
from gaitval.kinetics.musculature.paths import KNEE, table

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
    text = files("gaitval.kinetics.musculature").joinpath("sites.json").read_text("utf-8")
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


_STEPS, _STIFF = 60, 1e-3
"""Of the fit to a person, and how dear 1 m of a site's way is against 1 m of length."""


def own_tendons(factors: Array) -> Mapping[str, Tendon]:
    """See `_own_tendons`; legs of equal bones have equal tendons."""
    return _own_tendons(tuple(float(each) for each in factors))


@cache
def _own_tendons(sizes: tuple[float, ...]) -> Mapping[str, Tendon]:
    """The tendons of a leg with bones of these `sizes`, 4 factors, by the name of the muscle: sites
    are in m of this leg, moved so far (least squares) that lengths are those of its muscles.
    """
    factors, angles = np.array(sizes), gait_poses()
    lengths, _ = own_lengths(angles, factors)
    size = dict(zip(SEGMENTS, factors, strict=True))
    found = {}
    for number, (name, shipped) in enumerate(tendons().items()):
        segments = [[segment for segment, _ in strand] for strand in shipped.strands]
        places = np.array([at for strand in shipped.strands for _, at in strand])
        own = np.array([size[segment] for strand in segments for segment in strand])
        x = np.append((own[:, None] * places).ravel(), shipped.more)
        wanted = lengths[:, number]

        def length(x: Array, segments: list[list[str]] = segments) -> Array:
            sites = iter(x[:-1].reshape(-1, 3))
            strands = [[(segment, next(sites)) for segment in strand] for strand in segments]
            made = strand_lengths(angles, strands, factors, scaled=True) / len(strands)
            return np.asarray(made + x[-1])

        start = x

        def off(
            x: Array, length: Callable[[Array], Array] = length, wanted: Array = wanted,
            start: Array = start,
        ) -> Array:  # fmt: skip
            return np.append(length(x) - wanted, _STIFF * (x - start)[:-1])

        low = np.full(len(x), -np.inf)
        low[-1] = 0.0
        x = least_squares(
            off, np.maximum(x, low), bounds=(low, np.inf), max_nfev=_STEPS, xtol=1e-9, ftol=1e-7
        ).x
        sites = iter(x[:-1].reshape(-1, 3).tolist())
        found[name] = Tendon(
            tuple(tuple((segment, tuple(next(sites))) for segment in each) for each in segments),
            float(x[-1]),
            float(np.quantile(np.abs(length(x) - wanted), 0.95)),
        )
    return found


@cache
def gait_poses() -> Array:
    """(N, 6) rad of gaitval's coordinates over gait: 20 degrees inside the range of the table."""
    low, high = table().ranges.T
    unit = np.clip(1.06 * (qmc.Sobol(6, seed=5).random(128) - 0.5) + 0.5, 0.0, 1.0)
    inward = np.minimum(np.radians(20.0), 0.3 * (high - low))
    found = low + inward + (high - low - 2.0 * inward) * unit
    found[:, 0] -= table().skeleton.hip_zero
    found[:, KNEE] -= table().skeleton.knee_zero
    return np.asarray(found)


def strand_lengths(
    leg: Array, strands: Sequence[Strand], factors: Array, *, scaled: bool = False
) -> Array:
    """Sum of the lengths (N,) m of `strands` at gaitval's coordinates `leg` (N, 6) rad of
    `paths.COORDINATES`, in a leg with bones of `factors` (4,) of `mapping.BoneSizes`. Sites are of
    the published size, or `scaled` already.
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
    size = dict(zip(SEGMENTS, np.ones(4) if scaled else factors, strict=True))
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
