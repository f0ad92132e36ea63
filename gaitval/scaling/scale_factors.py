"""Scale factors from distances between pairs of points, as OpenSim's ScaleTool finds them.

A measurement is a set of pairs. Its factor is the mean over the pairs of measured distance / model
distance. The measured distance is the mean over the frames of the distance in each frame (not the
distance between mean positions): `ModelScaler::computeMeasurementScaleFactor` and
`takeExperimentalMarkerMeasurement` of opensim-core 4.x.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final, Unpack

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import ScalingError
from gaitval.scaling.anthropometry import Sex, mean_length
from gaitval.scaling.joint_centres import SURFACE, locate, measure
from gaitval.scaling.landmarks import Widths
from gaitval.scaling.measurements import Limbs, Measurements
from gaitval.scaling.stature import measure_by_stature

_Pair = tuple[str, str]


BODY_PAIRS: Final[dict[str, tuple[_Pair, ...]]] = {
    "thigh": tuple((f"{side}.Hip.Centre", f"{side}.Knee.Centre") for side in "RL"),
    "shank": tuple((f"{side}.Knee.Centre", f"{side}.Ankle.Centre") for side in "RL"),
    "ankle height": tuple((f"{side}.Ankle.Centre", f"{side}.Ankle.Floor") for side in "RL"),
    "foot": tuple((f"{side}.Heel", f"{side}.{head}") for side in "RL" for head in ("MT1", "MT5")),
    "hips": (("R.Hip.Centre", "L.Hip.Centre"),),
    "upper arm": tuple((f"{side}.Shoulder.Centre", f"{side}.Elbow.Centre") for side in "RL"),
    "forearm": tuple((f"{side}.Elbow.Centre", f"{side}.Wrist.Centre") for side in "RL"),
}
"""Measurements of our body model, and the pairs of landmarks and joint centres (`locate`) of each.
Ankle.Floor is the point on the floor below the ankle joint."""

_SKIN: Final = np.array([SURFACE.marker_offset, 0.0, 0.0])


def scale_factor(
    model: Mapping[str, Array], measured: Mapping[str, Array], pairs: Sequence[_Pair]
) -> float:
    """Mean over `pairs` of points, by their names, of their mean `measured` distance over that in
    the unscaled `model` in one pose. Points are (3,) m there, and (T, 3) m measured; frames in
    which one of the two was not seen do not count for their pair. Raises ScalingError, which lists
    all, for points that are missing, never seen together, or at the same place in the model.
    """
    needed = {name for pair in pairs for name in pair}
    problems = [
        f"{name}: not in the {where}"
        for where, points in (("model", model), ("trial", measured))
        for name in sorted(needed - points.keys())
    ]
    found = []
    for first, second in pairs if not problems else ():
        at_rest = float(np.linalg.norm(np.asarray(model[first]) - np.asarray(model[second])))
        distances = np.linalg.norm(
            np.asarray(measured[first]) - np.asarray(measured[second]), axis=-1
        )
        distances = distances[np.isfinite(distances)]
        if at_rest < 1e-6:
            problems.append(f"{first} and {second}: at the same place in the model")
        elif not len(distances):
            problems.append(f"{first} and {second}: not seen together in any frame")
        else:
            found.append(float(distances.mean()) / at_rest)
    if problems:
        raise ScalingError(
            "the scale factors cannot be found:\n  "
            + "\n  ".join(problems)
            + "\nCheck the names of the markers in the pairs."
        )
    return float(np.mean(found))


def scale_by_pairs(
    standing: Mapping[str, Array],
    *,
    height_m: float,
    sex: Sex,
    **widths: Unpack[Widths],
) -> tuple[Measurements, dict[str, float]]:
    """The mean body of a stature `height_m` (m) and `sex`, scaled by `BODY_PAIRS` to a standing
    trial, and their factors. `standing` has each landmark in T frames, (T, 3) m, project axes, NaN
    where not seen; `widths` (m) are as for `measure`, as which, and as `scale_factor`, it raises
    ScalingError.

    Both legs are alike. This is the published method that a joint fit is compared with; `measure`
    gives each leg its own lengths and foot.
    """
    mean = {name: np.nanmean(points, axis=0) for name, points in standing.items() if _seen(points)}
    whole = measure(mean, **widths)
    measured = _frames(standing, locate(mean, **widths).keys(), widths)
    generic = measure_by_stature(height_m=height_m)
    limbs = replace(
        generic.right,
        upper_arm=mean_length(sex, "upper arm", height_m),
        forearm=mean_length(sex, "forearm", height_m),
    )
    generic = replace(generic, right=limbs, left=limbs)
    points = _neutral_points(generic)
    factors = {
        name: scale_factor(points, measured, pairs)
        for name, pairs in BODY_PAIRS.items()
        if all(point in measured for pair in pairs for point in pair)
    }
    return _scaled(generic, whole, factors), factors


def _seen(points: Array) -> bool:
    return bool(np.isfinite(points).all(axis=-1).any())


def _frames(
    standing: Mapping[str, Array], names: Iterable[str], widths: Widths
) -> dict[str, Array]:
    """Landmarks and joint centres in every frame that shows all landmarks, (T, 3)."""
    used = {name: np.asarray(points) for name, points in standing.items() if _seen(points)}
    whole = np.all([np.isfinite(points).all(axis=-1) for points in used.values()], axis=0)
    if not whole.any():
        raise ScalingError(
            "no frame of the standing trial shows all its markers: fill the gaps, or use another "
            "standing trial."
        )
    found = [
        locate({name: points[frame] for name, points in used.items()}, **widths)
        for frame in np.flatnonzero(whole)
    ]
    measured = {name: np.array([points[name] for points in found]) for name in names}
    for side in "RL":
        measured[f"{side}.Ankle.Floor"] = measured[f"{side}.Ankle.Centre"] * [1.0, 1.0, 0.0]
    return measured


def _neutral_points(body: Measurements) -> dict[str, Array]:
    """The points of `BODY_PAIRS` in a body that stands straight with hanging arms."""
    points: dict[str, Array] = {}
    for side, leg, sign in (("R", body.right, 1.0), ("L", body.left, -1.0)):
        ankle = np.array([0.0, -sign * body.hip_half_width, leg.ankle_height])
        mirror = np.array([1.0, sign, 1.0])
        assert leg.upper_arm is not None
        assert leg.forearm is not None
        # Anywhere: only distances along the arm are measured.
        shoulder = np.array([0.0, 0.0, 1.0])
        up = np.array([0.0, 0.0, 1.0])
        points |= {
            f"{side}.Ankle.Floor": ankle * [1.0, 1.0, 0.0],
            f"{side}.Ankle.Centre": ankle,
            f"{side}.Knee.Centre": ankle + leg.shank * up,
            f"{side}.Hip.Centre": ankle + (leg.shank + leg.thigh) * up,
            f"{side}.Heel": ankle + mirror * (leg.heel - _SKIN),
            f"{side}.MT1": ankle + mirror * leg.metatarsals[0],
            f"{side}.MT5": ankle + mirror * leg.metatarsals[1],
            f"{side}.Shoulder.Centre": shoulder,
            f"{side}.Elbow.Centre": shoulder - leg.upper_arm * up,
            f"{side}.Wrist.Centre": shoulder - (leg.upper_arm + leg.forearm) * up,
        }
    return points


def _scaled(
    generic: Measurements, whole: Measurements, factors: Mapping[str, float]
) -> Measurements:
    """The generic body times the factors; posture, and what no pair measures, come from `whole`."""
    old = generic.right
    ankle_height = old.ankle_height * factors["ankle height"]
    # The pairs measure the foot along the floor; heights above the sole stay.
    foot = np.array([factors["foot"], factors["foot"], 1.0])

    def point(place: Array) -> Array:
        height = place[2] + old.ankle_height
        return np.asarray(foot * [place[0], place[1], height] - [0.0, 0.0, ankle_height])

    def arm(length: float | None, name: str) -> float | None:
        return None if length is None or name not in factors else length * factors[name]

    limbs = Limbs(
        thigh=old.thigh * factors["thigh"],
        shank=old.shank * factors["shank"],
        ankle_height=ankle_height,
        heel=point(old.heel - _SKIN) + _SKIN,
        metatarsals=np.stack([point(head) for head in old.metatarsals]),
        upper_arm=arm(old.upper_arm, "upper arm"),
        forearm=arm(old.forearm, "forearm"),
    )
    return replace(
        whole,
        right=limbs,
        left=limbs,
        one_sided={},
        hip_half_width=generic.hip_half_width * factors["hips"],
        sources={
            name: "markers, mean body scaled by pairs"
            for name in ("thigh", "shank", "foot", "ankle height", "upper arm", "forearm")
        },
    )
