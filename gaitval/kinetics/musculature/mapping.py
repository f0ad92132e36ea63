"""From gaitval's motion and intersegmental loads to the angles and moments of the muscles' model.

The model that the muscles are of (`paths`) has another zero, a knee whose tibia moves along the
femur as it bends, and oblique axes of ankle and subtalar joint:

* pelvis and knee: gaitval's zero is at `MuscleSkeleton.hip_zero` and `knee_zero` of the model; of
  the pelvis, a person's own is expected beside it (`pelvis_zero`);
* hips: same axes. Moments are about the centre about which the muscles have their arms, which on
  the published pelvis is 15 mm nearer to the middle than where gaitval's regression puts it: with
  arms about one point and moments about another the forces would be wrong;
* knee: the moment that the muscles must make is by virtual work that of the intersegmental moment
  and force on the tibia, which turns *and shifts* per rate of the angle. In the body hip, knee and
  ankle are in a line; a person's knee is up to 2 cm aside of it, which the markers on the
  epicondyles show (`LegLoads.knee_aside`). What decides how the plateaus share a force is the
  moment about the person's knee;
* ankle and subtalar joint: the angles that turn the foot to where it is, as nearly as two axes can;
  the moments are those of the intersegmental moment vector, moved from the ankle's centre to each
  axis, about that axis. The moments of gaitval's own coordinates are not used. What the axes cannot
  turn about, the joint carries.

A left leg becomes a right one in the mirror.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gaitval.arrays import Array, Index
from gaitval.coordinates import COORDINATES as ALL
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics
from gaitval.kinetics.musculature.paths import COORDINATES, KNEE, MuscleSkeleton, table
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames

_TO_OPENSIM = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""x forward, y left, z up to x forward, y up, z right."""

_MIRROR = np.diag([1.0, 1.0, -1.0])


@dataclass(frozen=True)
class BoneSizes:
    """The bones of a leg against the published ones, as (4,) `factors` in the order of
    `paths.BONES`.
    """

    factors: Array

    @property
    def pelvis(self) -> float:
        """Of the half distance of the hips."""
        return float(self.factors[0])

    @property
    def femur(self) -> float:
        """Of hip to knee."""
        return float(self.factors[1])

    @property
    def tibia(self) -> float:
        """Of knee to ankle."""
        return float(self.factors[2])


def sizes(model: BodyModel, side: str) -> BoneSizes:
    """BoneSizes of the bones of a `side` ("r" or "l") of a body."""
    bones = table().skeleton
    found = [
        abs(model[f"thigh_{side}"].joint_position[1]) / bones.hip_half_width,
        float(np.linalg.norm(model[f"shank_{side}"].joint_position)) / bones.thigh,
        float(np.linalg.norm(model[f"foot_{side}"].joint_position)) / bones.shank,
        model[f"toes_{side}"].joint_position[0] / bones.foot,
    ]
    return BoneSizes(np.array(found))


@dataclass(frozen=True)
class LegLoads:
    """What a leg's muscles have to do; T frames, axes of the bones of `paths`, a left leg mirrored.

    Attributes
    ----------
    angles : (T, 6) rad, `paths.COORDINATES`.
    moments : (T, 6) Nm about them.
    moment_per_shift : (T, 6, 3) N: how `moments` change with a shift of the hip's centre, pelvis
        axes.
    hip_shift : (3,) m, from the body's hip centre to that of the muscles, pelvis axes; `moments`
        are about the latter, `moment` is about the former.
    force : (T, 4, 3) N, intersegmental, on what is beyond hip, knee, patella (0) and ankle; axes of
        `paths.JOINTS`.
    moment : (T, 4, 3) Nm, likewise, about the joints' centres.
    unturned : (T,) rad, by how much the two axes of the foot miss its orientation.
    knee_aside : m, how far the middle of the knee is to the outer side of the body's knee centre;
        None where no marker shows it.
    """

    angles: Array
    moments: Array
    moment_per_shift: Array
    hip_shift: Array
    force: Array
    moment: Array
    unturned: Array
    knee_aside: float | None = None

    def assisted(self, torques: Array) -> "LegLoads":
        """The loads of a leg whose devices make `torques` (T, 6) Nm about gaitval's coordinates of
        these names, beside its muscles.
        """
        bones, moments = table().skeleton, self.moments.copy()
        moments[:, :4] -= torques[:, :4]
        # A device at the ankle turns about gaitval's axes: dorsiflexion about z, inversion about x
        # of the foot. What it takes off is its part about the oblique axes.
        turned = _about(np.array([0.0, 0.0, 1.0]), self.angles[:, 4])[:, :, 0]
        vector = torques[:, 4, None] * np.array([0.0, 0.0, 1.0]) + torques[:, 5, None] * turned
        talus = _about(bones.ankle_axis, self.angles[:, 4])
        moments[:, 4] -= vector @ bones.ankle_axis
        moments[:, 5] -= (vector * (talus @ bones.subtalar_axis)).sum(axis=1)
        return replace(self, moments=moments)

    def part(self, rows: Index) -> "LegLoads":
        """The frames `rows` of it."""
        return replace(
            self,
            angles=self.angles[rows],
            moments=self.moments[rows],
            moment_per_shift=self.moment_per_shift[rows],
            force=self.force[rows],
            moment=self.moment[rows],
            unturned=self.unturned[rows],
        )

    def without(self, lost: Collection[str]) -> "LegLoads":
        """The loads of a leg in which no muscle has anything to do about the coordinates `lost`."""
        kept = np.array([0.0 if name in lost else 1.0 for name in COORDINATES])
        return replace(
            self,
            moments=kept * self.moments,
            moment_per_shift=kept[:, None] * self.moment_per_shift,
        )


def leg_loads(
    model: BodyModel,
    positions: Array,
    dynamics: InverseDynamics,
    side: str,
    *,
    knee_aside: float | None = None,
    pelvis_zero: float = 0.0,
) -> LegLoads:
    """Loads of the leg `side` ("r" or "l") of a motion `positions` (T, 31) with its `dynamics`.
    `knee_aside` m as in `LegLoads`; `pelvis_zero` rad, how much further forward the pelvis lies
    than its ASIS and PSIS say (`gaitval.kinetics.musculature.pelvis_zero`).
    """
    bones, own, index = table().skeleton, sizes(model, side), "rl".index(side)
    frames = segment_frames(model, positions)[..., :3, :3]
    mirror = np.eye(3) if side == "r" else _MIRROR
    to_leg = mirror @ _TO_OPENSIM
    # Turns of the published bones' axes against those of gaitval's segments, which lie the same
    # way in the pelvis and in the shank but for their zero.
    hip_zero = bones.hip_zero + pelvis_zero
    pelvis = _about_z(hip_zero)
    shank = _least_turn(np.array([0.0, -1.0, 0.0]), bones.shank_axis)
    turned = {
        "pelvis": _seen(frames, "pelvis", to_leg) @ pelvis.T,
        "femur": _seen(frames, f"thigh_{side}", to_leg),
        "tibia": _seen(frames, f"shank_{side}", to_leg) @ shank.T,
        "foot": _seen(frames, f"foot_{side}", to_leg),
    }
    force = np.zeros((len(positions), 4, 3))
    moment = np.zeros_like(force)
    world_force = dynamics.joint_force[:, index] @ to_leg.T
    # A moment is an axial vector: in a mirror it turns the other way, too.
    world_moment = np.linalg.det(mirror) * (dynamics.joint_moment[:, index] @ to_leg.T)
    for joint, (at, bone) in enumerate((("pelvis", 0), ("femur", 1), ("tibia", 2))):
        place = (0, 1, 3)[joint]
        force[:, place] = np.einsum("tji,tj->ti", turned[at], world_force[:, bone])
        moment[:, place] = np.einsum("tji,tj->ti", turned[at], world_moment[:, bone])

    angles, unturned = _angles(positions, turned, side, hip_zero, bones)
    moments, per_shift = _moments(angles, force, moment, own, bones)
    shift = own.pelvis * bones.hip_from_regression
    return LegLoads(
        angles, moments + per_shift @ shift, per_shift, shift, force, moment, unturned, knee_aside
    )


def knee_aside(model: BodyModel, side: str, markers: Sequence[ModelMarker]) -> float:
    """`LegLoads.knee_aside`, m, of the leg `side` ("r" or "l") of a body whose `markers`, two, are
    on the epicondyles of a knee, on its thigh or its shank.
    """
    centre = model[f"shank_{side}"].joint_position[1]
    left = [
        float(each.position[1]) - (centre if each.segment.startswith("thigh") else 0.0)
        for each in markers
    ]
    return float(np.mean(left)) * (1.0 if side == "l" else -1.0)


def _angles(
    positions: Array, turned: dict[str, Array], side: str, hip_zero: float, bones: MuscleSkeleton
) -> tuple[Array, Array]:
    found = np.empty((len(positions), 6))
    for i, name in enumerate(("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle")):
        found[:, i] = positions[:, ALL.index(f"{name}_{side}")]
    found[:, 0] += hip_zero
    found[:, KNEE] += bones.knee_zero
    found[:, 4:], unturned = _foot_angles(
        np.einsum("tji,tjk->tik", turned["tibia"], turned["foot"]), bones
    )
    return found, unturned


def published_angles(leg: Array) -> Array:
    """`paths.COORDINATES` (N, 6) of the published model at gaitval's own coordinates `leg` (N, 6),
    rad, of the same names.
    """
    bones = table().skeleton
    found = np.array(leg, dtype=float)
    found[:, 0] += bones.hip_zero
    found[:, KNEE] += bones.knee_zero
    # In OpenSim's axes dorsiflexion turns about z, inversion about x.
    foot = _about(np.array([0.0, 0.0, 1.0]), leg[:, 4]) @ _about(
        np.array([1.0, 0.0, 0.0]), leg[:, 5]
    )
    shank = _least_turn(np.array([0.0, -1.0, 0.0]), bones.shank_axis)
    found[:, 4:], _ = _foot_angles(shank @ foot, bones)
    return found


def _foot_angles(foot: Array, bones: MuscleSkeleton) -> tuple[Array, Array]:
    """Ankle and subtalar angle (T, 2) of a `foot` (T, 3, 3) in the tibia's axes, by Newton's method
    on what is left to turn, and the size of what is left in the end, (T,) rad.
    """
    ankle = np.zeros((len(foot), 2))
    for _ in range(8):
        first = _about(bones.ankle_axis, ankle[:, 0])
        made = first @ _about(bones.subtalar_axis, ankle[:, 1])
        left = _rotation_vector(foot @ made.transpose(0, 2, 1))
        axes = np.stack(
            [np.broadcast_to(bones.ankle_axis, left.shape), first @ bones.subtalar_axis], axis=2
        )
        # Least squares: what is left about both axes.
        ankle += np.linalg.solve(
            axes.transpose(0, 2, 1) @ axes, np.einsum("tij,ti->tj", axes, left)[..., None]
        )[..., 0]
    return ankle, np.linalg.norm(left, axis=1)


def _moments(
    angles: Array, force: Array, moment: Array, own: BoneSizes, bones: MuscleSkeleton
) -> tuple[Array, Array]:
    found, per_shift = np.empty((len(angles), 6)), np.zeros((len(angles), 6, 3))
    flexion, adduction = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    first = _about(flexion, angles[:, 0])
    second = first @ _about(adduction, angles[:, 1])
    axes = [np.broadcast_to(flexion, (len(angles), 3)), first[:, :, 0], second[:, :, 1]]
    for i, axis in enumerate(axes):
        found[:, i] = (axis * moment[:, 0]).sum(axis=1)
        # The hip centre moves by d: the moment about it is that before, less d × F.
        per_shift[:, i] = -np.cross(force[:, 0], axis)
    motion = _series(bones.knee_motion, angles[:, KNEE])
    found[:, KNEE] = (motion[:, :3] * moment[:, 1]).sum(axis=1)
    found[:, KNEE] += own.femur * (motion[:, 3:] * force[:, 1]).sum(axis=1)
    at_ankle, load = moment[:, 3], force[:, 3]
    at_axis = at_ankle - np.cross(own.tibia * bones.ankle_in_shank, load)
    found[:, 4] = at_axis @ bones.ankle_axis
    talus = _about(bones.ankle_axis, angles[:, 4])
    at_subtalar = at_axis - np.cross(own.factors[3] * (talus @ bones.subtalar_in_talus), load)
    found[:, 5] = (at_subtalar * (talus @ bones.subtalar_axis)).sum(axis=1)
    return found, per_shift


def _series(series: Array, knee: Array) -> Array:
    low, high = table().ranges[KNEE]
    unit = np.clip((2 * knee - low - high) / (high - low), -1.0, 1.0)
    return np.asarray(np.polynomial.chebyshev.chebval(unit, series.T)).T


def tibia_axes(knee: Array) -> Array:
    """Axes of the tibia in those of the femur, (T, 3, 3), at the knee angles (T,) of the model."""
    return _about(np.array([0.0, 0.0, -1.0]), knee)


def _seen(frames: Array, segment: str, to_leg: Array) -> Array:
    """Orientation (T, 3, 3) of a `segment`, both world and segment in the leg's axes."""
    return np.asarray(to_leg @ frames[:, SEGMENTS.index(segment)] @ to_leg.T)


def _about_z(angle: float) -> Array:
    return np.asarray(_about(np.array([0.0, 0.0, 1.0]), np.array([angle]))[0])


def _about(axis: Array, angles: Array) -> Array:
    """Turns (T, 3, 3) by `angles` (T,) about a unit `axis` (3,): Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross))


def _least_turn(start: Array, end: Array) -> Array:
    """The least turn (3, 3) that takes the unit vector `start` to `end`."""
    axis = np.cross(start, end)
    size = float(np.linalg.norm(axis))
    if size < 1e-12:
        return np.eye(3)
    return np.asarray(_about(axis / size, np.array([np.arctan2(size, float(start @ end))]))[0])


def _rotation_vector(turns: Array) -> Array:
    """(T, 3) of turns (T, 3, 3) well below π."""
    skew = (
        np.stack(
            [
                turns[:, 2, 1] - turns[:, 1, 2],
                turns[:, 0, 2] - turns[:, 2, 0],
                turns[:, 1, 0] - turns[:, 0, 1],
            ],
            axis=1,
        )
        / 2
    )
    sine = np.linalg.norm(skew, axis=1, keepdims=True)
    cosine = (np.trace(turns, axis1=1, axis2=2)[:, None] - 1.0) / 2
    angle = np.arctan2(sine, cosine)
    return np.asarray(np.where(sine > 1e-9, skew * angle / np.maximum(sine, 1e-12), skew))
