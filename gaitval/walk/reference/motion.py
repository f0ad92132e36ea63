"""Reference motion q̂(φ): what the policy imitates, for all 31 coordinates.

Lower-limb joints and pelvis orientation come from the record; the rest is derived or a
convention of this project, because the record has no markers above the pelvis or on the toes:

* hips, knees and ankles: the record, plus small constant offsets (2-3°, kept in the motion) that
  make the motion fit the ground and the recorded forces: both feet are on the ground in double
  support (otherwise the leading heel of a model scaled from markers touches down 3-5 % of the cycle
  later than the recorded force), and the flat foot is far enough to the side that the recorded
  force on it points to the centre of mass (otherwise the steps are too narrow for that force). The
  walk is always compared with the unchanged record;
* pelvis translation: the centre of mass moves as the recorded ground reaction requires (Newton's
  second law, integrated as a periodic series), and the pelvis follows from the model's centre of
  mass; a weighted least-squares fit also keeps the flat stance foot from sliding;
* trunk: upright and facing forward in the world, so the lumbar joint cancels the pelvis' rotation;
* arms: swing opposite to the leg on the same side (convention, `MOTION.arm_swing`);
* toes: flat on the ground while the heel rises in late stance, straight otherwise.

It is long because each part of the motion has its derivation beside it.
"""

import pickle
from dataclasses import dataclass, field, fields, replace
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from scipy.optimize import brentq, least_squares
from scipy.spatial.transform import Rotation
from scipy.special import logsumexp

from gaitval._internal.io.artefacts import array_names, check_arrays, read_arrays, write_arrays
from gaitval._internal.text.display import Displayed
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, SIDES, Side
from gaitval.gait.record import RECORDED_ANGLES, GaitRecord, PeriodicCurve, periodic_through
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.ground import LEVEL, Ground
from gaitval.model.parameters import NOMINAL_FRICTION
from gaitval.model.rotations import pelvis_rotation
from gaitval.model.tree import ROOT_DOFS, Tree, segment_frames, tree_arrays, whole_body_path
from gaitval.walk.contact.law import contact_law

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class MotionSettings:
    """What a reference motion is where nobody measured it, and how it is fitted."""

    samples: int = 1024
    """Samples of one cycle."""
    arm_swing: tuple[float, float] = (np.deg2rad(6.0), np.deg2rad(6.25))
    """Amplitude of shoulder flexion at no speed, rad, and its slope, rad per m/s. A convention
    between published ranges, of which none gives a regression: a range of 24.6 +- 2.4 degrees in
    ten men at their own speed (an abstract), about 30 (Perry 1992), 32 at free and 39 at fast speed
    (Murray et al. 1967, Phys Ther 47:272, from memory), 22 measured at 1.25 m/s in the walk that
    comes with Rajagopal's model. It gives 28 degrees at 1.25 m/s and 37 at 2."""
    elbow_flexion: float = np.deg2rad(25.0)
    """Constant elbow flexion; convention."""
    arm_abduction: float = np.deg2rad(8.0)
    """Keeps the arms clear of the hips; convention."""
    toe_extension_limit: float = np.deg2rad(45.0)
    """Largest toe extension of the reference in late stance; convention."""
    toe_roll: float = 1.3
    """Toe extension / pitch of the foot as the heel rises: above 1, so that the ball of the foot,
    not the toe tip, is pressed in deepest; convention."""
    toe_extension_swing: float = np.deg2rad(30.0)
    """Toe extension of the reference in swing, for clearance; convention."""
    harmonics: int = 24
    """Of the change of every coordinate by `dynamic_fit`."""
    translation_harmonics: int = 8
    offset_scale: float = np.deg2rad(1.5)
    """Offset with the same weight as a gap of `gap_scale`: marker-based angles have this error."""
    gap_scale: float = 0.002
    """m, height difference between the soles of both feet in double support, or across the sole of
    the flat foot."""
    balance_scale: float = 0.010
    """m, between the middle of the flat foot and where the recorded force line through the centre
    of mass meets the ground; the centre of pressure can easily be this far from the middle."""
    flat_foot: tuple[float, float] = (0.15, 0.40)
    """Phases of a side's own cycle between which its foot is flat on the ground."""
    acceleration_scale: float = 0.3
    """m/s²: error in the acceleration of the centre of mass with the same weight as ..."""
    sliding_scale: float = 0.05
    """m/s: this much sliding of the flat foot."""
    most_offsets: int = 8


MOTION: Final = MotionSettings()


END_EFFECTORS = ("foot_r", "foot_l", "forearm_r", "forearm_l")


OFFSET_JOINTS = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle", "subtalar_angle")
"""Coordinates that may be offset."""

FEED_FORWARD = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")
"""Coordinates whose recorded moment is fed forward, and is a target of `dynamic_fit`."""


_SHAPES: Final = {
    "phase": (0,),
    "positions": (0, 31),
    "velocities": (0, 31),
    "moments": (0, 25),
    "ground_reaction": (0, 2, 3),
    "centre_of_mass": (0, 3),
    "end_effectors": (0, 4, 3),
    "offsets": (25,),
    "stride_time": (),
    "speed": (),
    "hip_centre": (2, 2),
    "change": (31, 1 + 2 * MOTION.harmonics),
}
"""Of a stored motion; 0 is N."""


@dataclass(frozen=True, repr=False)
class ReferenceMotion(Displayed):
    """One right gait cycle, sampled at N phases 0, 1/N, …; everything except the forward travel is
    periodic. Axes REP-103, SI units, radians; root convention as in `model.tree`.

    Attributes
    ----------
    phase : (N,).
    positions, velocities : (N, 31) q̂ and q̂̇ (per second).
    moments : (N, 25) Nm, the record's joint moments if it has them (mean of both sides), else zero.
    ground_reaction : (N, 2, 3) body weights, recorded, right and left foot.
    centre_of_mass : (N, 3) m, ĉ.
    end_effectors : (N, 4, 3) m, ê: joint origin of feet and forearms, world.
    offsets : (25,) rad, offsets of `positions` from the record.
    stride_time : s.  speed : m/s.
    hip_centre : (2, 2) m, right and left: by how much the hip centre that the record's moments are
        about lies forward and outward of the model's, as the fit finds it. `moments` are about the
        model's; `hip_moments.about_record` moves a moment.
    change : (31, 1 + 2 H) rad and m, mean, cosines and sines of how far the fit moved each
        coordinate, the pelvis's as Cardan angles. A fit of a similar body begins with it.
    """

    phase: Array
    positions: Array
    velocities: Array
    moments: Array
    ground_reaction: Array
    centre_of_mass: Array
    end_effectors: Array
    offsets: Array
    stride_time: float
    speed: float
    hip_centre: Array = field(default_factory=lambda: np.zeros((2, 2)))
    change: Array = field(default_factory=lambda: np.zeros(_SHAPES["change"]))

    def save(self, path: str | Path) -> None:
        """Write as npz to `path`."""
        write_arrays(Path(path), {f.name: np.asarray(getattr(self, f.name)) for f in fields(self)})

    @classmethod
    def load(cls, path: str | Path) -> "ReferenceMotion":
        """Read what `save` wrote to `path`. Raises ArtefactError if the file is missing or
        damaged.
        """
        # Files of earlier versions lack hip centres (their moments are compared as they are) and
        # changes.
        arrays = read_arrays(Path(path), *array_names(cls))
        check_arrays(arrays, _SHAPES, Path(path))
        stride_time, speed = float(arrays.pop("stride_time")), float(arrays.pop("speed"))
        return cls(**arrays, stride_time=stride_time, speed=speed)

    def title(self) -> str:
        """Length and speed of the cycle."""
        return f"Reference motion: stride time {self.stride_time:.2f} s, {self.speed:.2f} m/s"

    def to_frame(self) -> "pd.DataFrame":
        """Joint angles (deg), moments (Nm) and ground reaction (% of body weight), of
        both sides at % of the right gait cycle. A moment that no record has is left out.
        """
        from gaitval._internal.text.frames import (
            FORCE,
            angle_curves,
            curve_frame,
            moment_curves,
            of_kind,
        )

        moments = moment_curves(self.moments)
        forces = (
            (f"{axis}_{side}", 100.0 * self.ground_reaction[:, i, j])
            for i, side in enumerate("rl")
            for j, axis in enumerate(("forward", "left", "up"))
        )
        return curve_frame(
            [
                *angle_curves(self.positions),
                *(moment for moment in moments if np.any(moment[-1])),
                *((of_kind(name, FORCE), "% BW", each) for name, each in forces),
            ],
            at=100.0 * self.phase,
        )


def side_phase(record: GaitRecord, side: str, phase: Array) -> Array:
    """Phase (N,) of the own cycle of a `side`, "right" or "left", at `phase` (N,) of the right one,
    not wrapped: the left side's, by the `left_phase` of `record`, is negative before its heel
    strike.
    """
    return phase if side == "right" else phase - record.left_phase


def _pelvis_curves(record: GaitRecord, phase: Array) -> tuple[Array, Array]:
    """Pelvis Cardan angles (N, 3) and their rates per unit phase, mean of both sides' views."""
    value, rate = np.zeros((len(phase), 3)), np.zeros((len(phase), 3))
    # Each record of a side has the pelvis as that side sees it: list and rotation change sign.
    for side, suffix, signs in (("right", "r", (1, 1, 1)), ("left", "l", (1, -1, -1))):
        at = side_phase(record, side, phase)
        for i, name in enumerate(("tilt", "list", "rotation")):
            curve = record.angles[f"pelvis_{name}_{suffix}"]
            value[:, i] += 0.5 * signs[i] * curve(at)
            rate[:, i] += 0.5 * signs[i] * curve.derivative(at)
    return value, rate


def _angular_velocity(angles: Array, rates: Array) -> Array:
    """World angular velocity (N, 3) from Cardan angles and rates as in `_pelvis_curves`."""
    # Each Cardan rate turns about the axis where the rotations before it have taken it: tilt about
    # y, list about the tilted -x, rotation about the tilted and listed z.
    tilt = Rotation.from_euler("Y", angles[:, :1]).as_matrix()
    tilt_list = Rotation.from_euler("YX", angles[:, :2] * np.array([1.0, -1.0])).as_matrix()
    y_axis = np.array([0.0, 1.0, 0.0])
    return np.asarray(
        rates[:, :1] * y_axis - rates[:, 1:2] * tilt[:, :, 0] + rates[:, 2:] * tilt_list[:, :, 2]
    )


def _toe_extension(
    record: GaitRecord, side: Side, phase: Array, offsets: dict[str, float]
) -> PeriodicCurve:
    """Toe extension: flat on the ground while the heel is up in stance (pitch of the foot
    negative), then decreasing through early swing to `MOTION.toe_extension_swing`, and to zero at
    heel strike.
    """
    suffix = side[0]
    # Angle of the sole to the ground in the sagittal plane, toes up: hip flexion and dorsiflexion
    # raise the toes, knee flexion and anterior tilt lower them.
    pitch = (
        record.angles[f"hip_flexion_{suffix}"](phase)
        - record.angles[f"knee_angle_{suffix}"](phase)
        + record.angles[f"ankle_angle_{suffix}"](phase)
        - record.angles[f"pelvis_tilt_{suffix}"](phase)
        + offsets.get(f"hip_flexion_{suffix}", 0.0)
        - offsets.get(f"knee_angle_{suffix}", 0.0)
        + offsets.get(f"ankle_angle_{suffix}", 0.0)
    )
    toe_off = record.stance_fraction[side]
    lowering = np.clip((phase - toe_off) / (0.85 - toe_off), 0.0, 1.0)
    limit = MOTION.toe_extension_limit + lowering * (
        MOTION.toe_extension_swing - MOTION.toe_extension_limit
    )
    rolled = np.clip(-MOTION.toe_roll * pitch, 0.0, limit)
    extension = np.where(phase < toe_off, rolled, limit)
    # Before 20 % the heel is landing, and a negative pitch is not the heel rising. The last factor
    # takes the toes back to zero before heel strike.
    extension = np.where(phase < 0.2, 0.0, extension) * np.clip((0.98 - phase) / 0.08, 0.0, 1.0)
    # Ten harmonics: the corners between the pieces would be jumps in velocity.
    return periodic_through(extension, 10)


class _Joints(NamedTuple):
    """Actuated coordinates (N, 25) and their rates per unit phase."""

    value: Array
    rate: Array

    def put(self, name: str, curve: PeriodicCurve, at: Array) -> None:
        """Let the coordinate `name` follow a `curve`, at the phases (N,) of its side."""
        self.value[:, ACTUATED.index(name)] = curve(at)
        self.rate[:, ACTUATED.index(name)] = curve.derivative(at)


def _without_offsets(record: GaitRecord, phase: Array) -> _Joints:
    """All but the lumbar coordinates and the toes, without offsets."""
    joints = _Joints(*np.zeros((2, len(phase), len(ACTUATED))))
    swing = MOTION.arm_swing[0] + MOTION.arm_swing[1] * record.speed
    for side in SIDES:
        suffix = side[0]
        at = side_phase(record, side, phase)
        for name in RECORDED_ANGLES:
            joints.put(f"{name}_{suffix}", record.angles[f"{name}_{suffix}"], at)
        # Minus a cosine: the arm is furthest back at heel strike of its side, when the leg is
        # forward.
        joints.put(f"arm_flex_{suffix}", PeriodicCurve(0.0, (-swing,), (0.0,)), at)
        joints.put(f"arm_add_{suffix}", PeriodicCurve(-MOTION.arm_abduction, (0.0,), (0.0,)), at)
        joints.put(f"elbow_flex_{suffix}", PeriodicCurve(MOTION.elbow_flexion, (0.0,), (0.0,)), at)
    return joints


def _joint_curves(
    record: GaitRecord, phase: Array, offsets: dict[str, float], without: _Joints
) -> _Joints:
    """All but the lumbar coordinates, from those of `_without_offsets`."""
    joints = _Joints(*map(np.copy, without))
    for side in SIDES:
        toes = _toe_extension(record, side, phase, offsets)
        joints.put(f"mtp_angle_{side[0]}", toes, side_phase(record, side, phase))
    for name, offset in offsets.items():
        joints.value[:, ACTUATED.index(name)] += offset
    return joints


def _sole_heights(tree: Tree, frames: Array) -> Array:
    """Height (T, 12) m of the lowest point of every sphere, of frames (T, 14, 4, 4)."""
    segments = frames[:, tree.sphere_segment]
    centres = np.einsum("tkij,kj->tki", segments[..., :3, :3], tree.sphere_position)
    return np.asarray(centres[..., 2] + segments[..., 2, 3] - tree.sphere_radius)


def _sole_middle(tree: Tree, frames: Array, foot: slice) -> Array:
    """Lateral position (T,) m of the mean of a foot's spheres, of frames (T, 14, 4, 4)."""
    segments = frames[:, tree.sphere_segment[foot]]
    lateral = np.einsum("tkj,kj->tk", segments[..., 1, :3], tree.sphere_position[foot])
    return np.asarray((lateral + segments[..., 1, 3]).mean(axis=1))


def _lowest(heights: Array) -> Array:
    """Smooth minimum (T,) over the spheres of a foot (T, 6), to about 3 mm."""
    # Smooth, so that the least squares see a gradient when the lowest sphere changes.
    return np.asarray(-0.003 * logsumexp(-heights / 0.003, axis=1))


_offsets: Final[dict[bytes, dict[str, float]]] = {}


def _ground_offsets(record: GaitRecord, model: BodyModel) -> dict[str, float]:
    """`_found_offsets`, once for equal records and bodies: a study asks for those of the body as
    scaled three times, and they take longer than all else of a reference.
    """
    content = pickle.dumps((record, model))
    key = blake2b(content, digest_size=16).digest()
    if key not in _offsets:
        while len(_offsets) >= MOTION.most_offsets:
            del _offsets[next(iter(_offsets))]
        _offsets[key] = _found_offsets(record, model)
    return dict(_offsets[key])


def _found_offsets(record: GaitRecord, model: BodyModel) -> dict[str, float]:
    """Smallest constant offsets (rad) of `OFFSET_JOINTS`, right and left, for the motion to fit
    the ground (soles at one height in double support, the flat foot level) and the direction of
    the recorded force on the flat foot, seen from behind.
    """
    tree = tree_arrays(model)
    phase = np.arange(100) / 100
    # Rounded, so that a sample at the edge of stance is treated the same on both sides.
    own = {side: np.mod(side_phase(record, side, phase).round(9), 1.0) for side in SIDES}
    both = np.all([own[side] <= record.stance_fraction[side] for side in SIDES], axis=0)
    flat = {
        side: (own[side] > MOTION.flat_foot[0]) & (own[side] < MOTION.flat_foot[1])
        for side in SIDES
    }
    names = [f"{joint}_{side[0]}" for joint in OFFSET_JOINTS for side in SIDES]
    angles, _ = _pelvis_curves(record, phase)
    positions = np.zeros((len(phase), ROOT_DOFS + len(ACTUATED)))
    rotation = pelvis_rotation(angles[:, 0], angles[:, 1], angles[:, 2])
    # Position zero: only differences of heights and places count here.
    positions[:, :3] = Rotation.from_matrix(rotation).as_rotvec()
    names_of_spheres = [sphere.name for sphere in model.spheres]
    without = _without_offsets(record, phase)
    slope = {}  # sideways / vertical force on the flat foot
    for side in SIDES:
        force = record.ground_reaction(side, own[side][flat[side]])
        slope[side] = force[:, 1] / force[:, 2]

    def residuals(values: Array) -> Array:
        offsets = dict(zip(names, values, strict=True))
        positions[:, ROOT_DOFS:] = _joint_curves(record, phase, offsets, without).value
        frames = segment_frames(model, positions)
        heights = _sole_heights(tree, frames)
        centre = whole_body_path(tree, frames)
        half = heights.shape[1] // 2
        feet = {"right": slice(0, half), "left": slice(half, None)}
        gap = _lowest(heights[:, feet["right"]]) - _lowest(heights[:, feet["left"]])
        parts = [gap[both] / np.sqrt(both.sum())]
        for side in SIDES:
            sphere = {
                name: heights[flat[side], names_of_spheres.index(f"contact_{name}_{side[0]}")]
                for name in ("heel", "ball_medial", "ball_lateral")
            }
            ball = 0.5 * (sphere["ball_medial"] + sphere["ball_lateral"])
            count = np.sqrt(flat[side].sum())
            parts.append((sphere["heel"] - ball) / count)
            parts.append((sphere["ball_medial"] - sphere["ball_lateral"]) / count)
            com = centre[flat[side]]
            height = com[:, 2] - _lowest(heights[flat[side], feet[side]])
            middle = _sole_middle(tree, frames[flat[side]], feet[side])
            # Seen from behind, the recorded force must point from the foot to the centre of mass;
            # otherwise it would tip the body over sideways.
            miss = middle - (com[:, 1] - height * slope[side])
            # Everything is in units of `MOTION.gap_scale`, by which the whole is divided below.
            parts.append(miss / count * MOTION.gap_scale / MOTION.balance_scale)
        return np.concatenate(
            [np.concatenate(parts) / MOTION.gap_scale, values / MOTION.offset_scale]
        )

    solution = least_squares(residuals, np.zeros(len(names)), ftol=1e-14, xtol=1e-14, gtol=1e-14)
    return dict(zip(names, map(float, solution.x), strict=True))


def trunk_upright(rotation: Array, ground: Ground = LEVEL) -> Array:
    """Lumbar coordinates (N, 3) rad that keep the trunk upright and facing forward (+x): extension
    (trunk backward), bending (to the right), rotation (to the left). `rotation` (N, 3, 3) is that
    of the pelvis, pelvis to world, whose axes are those of the `ground`.
    """
    # The lumbar joint turns about -y, x, z of the pelvis in this order.
    # The joint must undo the pelvis's rotation: its matrix is the transpose.
    upright = np.swapaxes(rotation, 1, 2) @ ground.from_level
    angles = Rotation.from_matrix(upright).as_euler("YXZ")
    return np.asarray(angles * np.array([-1.0, 1.0, 1.0]))


def spectral_rate(values: Array) -> Array:
    """Derivative by phase (d/dφ, φ = 1 for a cycle) of `values` (N, …), equally spaced samples of
    one cycle, without its end: (N, …) in their unit per cycle, exact for the harmonics that the
    samples resolve.
    """
    n = len(values)
    k = np.fft.rfftfreq(n, 1.0 / n).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(np.fft.irfft(2j * np.pi * k * np.fft.rfft(values, axis=0), n, axis=0))


def _series(phase: Array, order: int) -> Array:
    """(N, 2 H) cosines and sines of the harmonics, differentiated `order` times in phase."""
    k = 2 * np.pi * np.arange(1, MOTION.translation_harmonics + 1)
    # Each derivative of a cosine or sine multiplies by k and turns by a quarter of a cycle.
    angles = np.outer(phase, k) + 0.5 * np.pi * order
    return np.hstack([k**order * np.cos(angles), k**order * np.sin(angles)])


def _pelvis_translation(
    record: GaitRecord, phase: Array, com_offset: Array, foot_offset: Array, up: Array
) -> Array:
    """Periodic part of the pelvis position (N, 3), mean zero, at the phases `phase` of a `record`;
    `up` (3,) is the unit vector against gravity. From the pelvis' origin it is `com_offset` (N, 3)
    m to the centre of mass, and `foot_offset` (N, 2, 3) m to the right and the left ankle, world
    axes.

    Least squares over a Fourier series: the centre of mass accelerates as the recorded forces
    require (with their mean scaled to what periodic motion needs), and the flat foot is stationary
    (on a belt it moves backwards at the mean speed relative to the walker).
    """
    force = sum(
        (record.ground_reaction(side, side_phase(record, side, phase)) for side in SIDES),
        start=np.zeros((len(phase), 3)),
    )
    # Forces are in body weights, so force x g is acceleration. In a periodic motion the mean force
    # is one body weight upwards and nothing else: the measured mean is removed, and the force along
    # the ground's normal scaled to it.
    acceleration = GRAVITY * (force - force.mean(axis=0))
    acceleration[:, 2] *= 1.0 / (force @ up).mean()
    time = record.stride_time
    # Centre of mass = pelvis + offset, so the pelvis accelerates by the rest.
    offset_acceleration = spectral_rate(spectral_rate(com_offset)) / time**2
    foot_rate = spectral_rate(foot_offset) / time
    rows = [_series(phase, 2) / time**2 / MOTION.acceleration_scale]
    targets = [(acceleration - offset_acceleration) / MOTION.acceleration_scale]
    for i, side in enumerate(SIDES):
        at = np.mod(side_phase(record, side, phase), 1.0)
        flat = (at > MOTION.flat_foot[0]) & (at < MOTION.flat_foot[1])
        rows.append(_series(phase[flat], 1) / time / MOTION.sliding_scale)
        # In the frame that moves with the walker a foot on the ground moves back at walking speed.
        velocity = -foot_rate[flat, i] - np.array([record.speed, 0.0, 0.0])
        targets.append(velocity / MOTION.sliding_scale)
    solution, *_ = np.linalg.lstsq(np.vstack(rows), np.vstack(targets), rcond=None)
    return np.asarray(_series(phase, 0) @ solution)


def _standing_height(tree: Tree, contact: ContactSettings, frames: Array) -> float:
    """Height to add so that the mean static contact force over the cycle is what of the body's
    weight the ground's normal carries.
    """
    heights = _sole_heights(tree, frames)
    weight = tree.mass.sum() * -tree.gravity[2]
    law = contact_law(contact, NOMINAL_FRICTION)

    def excess(lift: float) -> float:
        depth = np.maximum(-(heights + lift), 0.0)
        force = law.static_force(tree.sphere_radius, depth)
        return float(force.sum(axis=1).mean() - weight)

    # At `top` no sphere touches the ground; half a metre lower all do. The force grows with depth,
    # so there is one root between.
    top = -float(heights.min())
    return float(brentq(excess, top - 0.5, top))


def build_reference(
    record: GaitRecord, model: BodyModel, contact: ContactSettings | None = None
) -> ReferenceMotion:
    """Reference motion of a `record` on the scaled `model`. The law of `contact`, by default the
    configuration's, sets how deep the feet press into the ground, so that the mean contact force of
    the reference is one body weight.
    """
    contact = contact or ContactSettings()
    tree = tree_arrays(model)
    phase = np.arange(MOTION.samples) / MOTION.samples
    time = record.stride_time
    offsets = _ground_offsets(record, model)
    without = _without_offsets(record, phase)
    joint, joint_rate = _joint_curves(record, phase, offsets, without)
    angles, angle_rates = _pelvis_curves(record, phase)
    rotation = pelvis_rotation(angles[:, 0], angles[:, 1], angles[:, 2])
    lumbar = slice(ACTUATED.index("lumbar_extension"), ACTUATED.index("lumbar_rotation") + 1)
    joint[:, lumbar] = trunk_upright(rotation, model.ground)
    # Numerically: the lumbar angles are not curves of the record, but follow from the pelvis.
    joint_rate[:, lumbar] = spectral_rate(joint[:, lumbar])

    positions = np.zeros((MOTION.samples, ROOT_DOFS + len(ACTUATED)))
    velocities = np.zeros_like(positions)
    positions[:, :3] = Rotation.from_matrix(rotation).as_rotvec()
    positions[:, ROOT_DOFS:] = joint
    velocities[:, :3] = _angular_velocity(angles, angle_rates) / time
    velocities[:, ROOT_DOFS:] = joint_rate / time

    frames = segment_frames(model, positions)
    com_offset = whole_body_path(tree, frames)
    feet = [SEGMENTS.index("foot_r"), SEGMENTS.index("foot_l")]
    translation = _pelvis_translation(
        record, phase, com_offset, frames[:, feet][..., :3, 3], model.ground.up
    )
    velocities[:, 3:6] = spectral_rate(translation) / time
    velocities[:, 3] += record.speed
    # Walk along y = 0 with the mean centre of mass in the middle.
    translation[:, 1] -= (translation[:, 1] + com_offset[:, 1]).mean()
    travel = np.zeros((MOTION.samples, 3))
    travel[:, 0] = record.speed * time * phase
    positions[:, 3:6] = translation + travel
    frames[..., :3, 3] += positions[:, None, 3:6]
    lift = _standing_height(tree, contact, frames)
    positions[:, 5] += lift
    frames[..., 2, 3] += lift

    moments = np.zeros((MOTION.samples, len(ACTUATED)))
    ground_reaction = np.zeros((MOTION.samples, 2, 3))
    for i, side in enumerate(SIDES):
        at = side_phase(record, side, phase)
        ground_reaction[:, i] = record.ground_reaction(side, at)
        for name in FEED_FORWARD:
            # The mean of both sides at the side's own phase: the recorded sagittal moments of
            # right and left differ by a shift of the centre of pressure between the plates.
            mean = 0.5 * (record.moments[f"{name}_r"](at) + record.moments[f"{name}_l"](at))
            moments[:, ACTUATED.index(f"{name}_{side[0]}")] = mean * model.mass
    return ReferenceMotion(
        phase=phase,
        positions=positions,
        velocities=velocities,
        moments=moments,
        ground_reaction=ground_reaction,
        centre_of_mass=whole_body_path(tree, frames),
        end_effectors=_end_effectors(frames),
        offsets=np.array([offsets.get(name, 0.0) for name in ACTUATED]),
        stride_time=time,
        speed=record.speed,
    )


def moved(
    reference: ReferenceMotion, model: BodyModel, positions: Array, velocities: Array
) -> ReferenceMotion:
    """The `reference` with another motion, `positions` and `velocities` (N, 31) rad, m and per
    second, and everything that follows from it on the body `model`; phases, forces and moments are
    unchanged.
    """
    frames = segment_frames(model, positions)
    return replace(
        reference,
        positions=positions,
        velocities=velocities,
        centre_of_mass=whole_body_path(tree_arrays(model), frames),
        end_effectors=_end_effectors(frames),
    )


def _end_effectors(frames: Array) -> Array:
    """(N, 4, 3) m of segment frames (N, 14, 4, 4)."""
    effectors = [SEGMENTS.index(name) for name in END_EFFECTORS]
    return np.asarray(frames[:, effectors][..., :3, 3])
