"""What the coordinates and bodies of somebody's OpenSim model are, in the terms of this project.

Models differ in names and in signs: the knee of Gait2392 bends negatively, that of Rajagopal's
model positively. So the sense of a coordinate is not read from its name but from the way that the
model itself moves: which way the distal body turns against the proximal one, seen in axes forward,
up and right that the hips span.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.apps.judge.limits import LIMITS
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.scaling.opensim.model import OsimModel
from gaitval.scaling.opensim.placing import place

NAMES: Final[Mapping[str, tuple[str, ...]]] = {
    "hip_flexion": ("hip_flexion", "hip_extension"),
    "hip_adduction": ("hip_adduction", "hip_abduction"),
    "hip_rotation": ("hip_rotation", "hip_internal_rotation"),
    "knee_angle": ("knee_angle", "knee_flexion", "knee_extension"),
    "ankle_angle": ("ankle_angle", "ankle_flexion", "ankle_dorsiflexion"),
    "subtalar_angle": ("subtalar_angle", "subtalar"),
}
"""Our name of a joint angle -> names that OpenSim's models have for it, before the side."""

_AXES: Final[Mapping[str, tuple[float, float, float]]] = {
    "hip_flexion": (0, 0, 1),
    "hip_adduction": (1, 0, 0),
    "hip_rotation": (0, 1, 0),
    "knee_angle": (0, 0, -1),
    "ankle_angle": (0, 0, 1),
    "subtalar_angle": (1, 0, 0),
}
"""Axis forward, up, right about which a positive angle of `gaitval.coordinates` turns on the right
side; on the left, adduction, rotation and inversion are mirrored."""
_MIRRORED: Final = ("hip_adduction", "hip_rotation", "subtalar_angle")

BODIES: Final[Mapping[str, tuple[str, ...]]] = {
    "thigh": ("femur", "thigh", "upperleg"),
    "shank": ("tibia", "shank", "lowerleg", "tibfib"),
    "talus": ("talus",),
    "foot": ("calcn", "foot", "calcaneus"),
    "toes": ("toes", "toe"),
    "upper_arm": ("humerus", "upperarm"),
    "ulna": ("ulna", "forearm", "ulna_radius_hand", "lowerarm"),
    "radius": ("radius",),
    "hand": ("hand",),
}
"""Our name of a segment, or of a part of one -> names of bodies, without the side."""
MIDDLE: Final[Mapping[str, tuple[str, ...]]] = {"pelvis": ("pelvis",)}


@dataclass(frozen=True)
class Skeleton:
    """A model and what its parts are.

    Attributes
    ----------
    bodies : our name with `_r` or `_l` (`thigh_r`), or `pelvis` -> body of the model.
    coordinates : our name with the side (`knee_angle_r`) -> coordinate of the model.
    senses : 1 if the model's coordinate is positive as ours is, -1 if it is negative; 0 if it does
        not turn about the expected axis.
    """

    model: OsimModel
    bodies: Mapping[str, str]
    coordinates: Mapping[str, str]
    senses: Mapping[str, int]

    @cached_property
    def standing(self) -> dict[str, tuple[Array, Array]]:
        """Poses of the bodies with every coordinate at its default."""
        return place(self.model, _defaults(self.model))

    def origin(self, segment: str) -> Array | None:
        """Origin (3,) m of a segment in the default pose; None if the model lacks it."""
        body = self.bodies.get(segment)
        return None if body is None else self.standing[body][1][0]

    def length(self, segment: str) -> float | None:
        """Of `thigh_r`, `shank_l` …: from joint to joint in the default pose, m."""
        name, side = segment.rsplit("_", 1)
        ends = {"thigh": ("shank",), "shank": ("talus", "foot")}[name]
        start = self.origin(segment)
        far = [end for each in ends if (end := self.origin(f"{each}_{side}")) is not None]
        return None if start is None or not far else float(np.linalg.norm(far[0] - start))

    @property
    def leg_length(self) -> float | None:
        """Thigh and shank, mean of the sides, m; None where the model has no legs."""
        lengths = [self.length(f"{name}_{side}") for name in ("thigh", "shank") for side in "rl"]
        known = [length for length in lengths if length is not None]
        return sum(known) / 2 if len(known) == 4 else None

    @property
    def has_legs(self) -> bool:
        """Whether both legs, from hip to foot, are known."""
        return all(f"{n}_{s}" in self.bodies for n in ("thigh", "shank", "foot") for s in "rl")


def skeleton(model: OsimModel) -> Skeleton:
    """Find bodies, coordinates and senses of a model."""
    bodies = {name: found for name, known in MIDDLE.items() if (found := _named(model, known))}
    for name, known in BODIES.items():
        for side in SIDES:
            found = _named(model, _sided(known, side[0]))
            if found:
                bodies[f"{name}_{side[0]}"] = found
    coordinates = {}
    for name, known in NAMES.items():
        for side in SIDES:
            lower = {each.lower(): each for each in model.coordinates}
            named = [lower[n] for n in _sided(known, side[0]) if n in lower]
            if named:
                coordinates[f"{name}_{side[0]}"] = named[0]
    return Skeleton(model, bodies, coordinates, _senses(model, bodies, coordinates))


def _sided(names: tuple[str, ...], side: str) -> list[str]:
    word = {"r": "right", "l": "left"}[side]
    forms = ("{0}_{1}", "{1}_{0}", "{0}_{2}", "{2}_{0}", "{2}{0}", "{0}{2}")
    return [form.format(name, side, word) for name in names for form in forms]


def _named(model: OsimModel, names: tuple[str, ...] | list[str]) -> str | None:
    lower = {each.lower(): each for each in model.bodies}
    return next((lower[name] for name in names if name in lower), None)


def _defaults(model: OsimModel) -> dict[str, Array]:
    values = {name: np.array([each.default]) for name, each in model.coordinates.items()}
    for coupler in model.couplers:
        values[coupler.dependent] = coupler.function(values[coupler.independent])
    return values


def _senses(
    model: OsimModel, bodies: Mapping[str, str], coordinates: Mapping[str, str]
) -> dict[str, int]:
    axes = body_axes(model, bodies)
    if axes is None:
        return {}
    # The limbs are straight: a bent knee would tilt the axes of the ankle.
    straight = {name: np.zeros(1) for name in model.coordinates}
    root = model.root()
    for name in root.coordinates if root else ():
        straight[name] = np.array([model.coordinates[name].default])
    found = {}
    for ours, name in coordinates.items():
        turn = axes @ _turn(model, straight, name)
        kind, side = ours.rsplit("_", 1)
        mirror = -1.0 if side == "l" and kind in _MIRRORED else 1.0
        along = mirror * float(turn @ np.array(_AXES[kind]))
        size = float(np.linalg.norm(turn))
        found[ours] = (
            0 if abs(along) < LIMITS.about_the_axis * size or size == 0.0 else int(np.sign(along))
        )
    return found


def _turn(model: OsimModel, values: Mapping[str, Array], name: str) -> Array:
    """Rotation vector (3,) of the distal against the proximal body when a coordinate grows."""
    joint = model.joint_of(name)
    relative = []
    # The sense that a coordinate has is seen from a small turn, whatever its function says.
    for moved in (0.0, LIMITS.nudge):
        poses = place(model, {**values, name: values[name] + moved})
        relative.append((poses[joint.parent.body][0][0], poses[joint.child.body][0][0]))
    (near, before), (_, after) = relative
    assert near.shape == (3, 3)
    return np.asarray(Rotation.from_matrix(after @ before.T).as_rotvec())


def body_axes(model: OsimModel, bodies: Mapping[str, str]) -> Array | None:
    """(3, 3), takes vectors of the ground to forward, up, right of the person who stands."""
    if "thigh_r" not in bodies or "thigh_l" not in bodies:
        return None
    poses = place(model, _defaults(model))
    right = poses[bodies["thigh_r"]][1][0] - poses[bodies["thigh_l"]][1][0]
    right = right - (right @ model.up) * model.up
    if np.linalg.norm(right) < 1e-6:
        return None
    right = right / np.linalg.norm(right)
    return np.stack([np.cross(model.up, right), model.up, right])
