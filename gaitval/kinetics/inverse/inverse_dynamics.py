"""Inverse dynamics: joint moments of a measured motion with measured ground reactions.

The equations are those of `newton_euler`. The whole ground reaction of a side acts on its foot
segment and none on its toes, as OpenSim's set-ups apply it to the calcaneus: the moment of the
metatarsophalangeal joint is then only that of the toes' own weight and inertia, not of push-off.

The residual is the force and the moment that would have to act on the pelvis, in addition to the
measured forces, to explain the motion.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gaitval._internal.numba.compiled import njit
from gaitval._internal.text.display import Saved
from gaitval.arrays import Array, Flags
from gaitval.coordinates import ACTUATED, SIDES, Side
from gaitval.errors import RecordError
from gaitval.kinetics.inverse.motion_rates import Kinematics, checked_motion, differentiate
from gaitval.kinetics.inverse.newton_euler import empty_dynamics, newton_euler
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import (
    COORDINATE_COUNT,
    ROOT_DOFS,
    Tree,
    tree_arrays,
    whole_body_centre_of_mass,
)

if TYPE_CHECKING:
    import pandas as pd


JOINTS = ("hip", "knee", "ankle")
"""Joints of `InverseDynamics.joint_force` and `joint_moment`, in order."""

_JOINT_SEGMENT = np.array(
    [[SEGMENTS.index(f"{name}_{side}") for name in ("thigh", "shank", "foot")] for side in "rl"]
)

LOCKED_MOMENTS = ("knee_adduction", "knee_rotation", "ankle_rotation")
"""Moments about axes that the model's joints do not rotate about."""


@dataclass(frozen=True, repr=False)
class InverseDynamics(Saved):
    """Moments that a motion needs; T frames, SI, axes REP-103.

    Attributes
    ----------
    time : (T,) s.
    moments : (T, 25) Nm, of the joints in the order of `coordinates.ACTUATED`; positive if it would
        increase its coordinate.
    powers : (T, 25) W, moment times rate of its coordinate: positive while the joint transfers
        energy to the segments.
    residual_force : (T, 3) N, on the pelvis, world axes.
    residual_moment : (T, 3) Nm, about the pelvis' origin (middle of the hips), world axes.
    joint_force : (T, 2, 3, 3) N, of the proximal on the distal segment at hip, knee and ankle
        (`JOINTS`), right side first, world axes. It is the net (intersegmental) force; the contact
        force, which includes the muscles, is several times as large.
    joint_moment : (T, 2, 3, 3) Nm, likewise, about the joint.
    locked_moments : (T, 2, 3) Nm, right side first: `LOCKED_MOMENTS`, the components of the
        joint's moment about axes that the model does not turn about, positive in the sense of
        adduction and internal rotation. The axes are those of the distal segment (shank x and z,
        foot z), which are the floating and the distal axis of Grood and Suntay (1983) at a
        joint that does not move about them.
    centre_of_mass : (T, 3) m, of the whole body.
    peak_external_force : N, largest ground reaction on one foot.
    mass_kg : of the body.
    source : the file of the trial; "" if that is not known.
    known : (T,) whether the markers show both legs and the plates the ground reaction on both
        feet; elsewhere the moments are wrong. None if nobody said.
    foot_known : (T, 2) whether a leg's moments are known, right first: the markers show both legs
        and the plates the whole ground reaction on its foot and nothing else, and the low-pass has
        nothing of another time in it (`foot_forces.settled`). None if nobody said; `known` counts
        then for both legs.
    """

    time: Array
    moments: Array
    powers: Array
    residual_force: Array
    residual_moment: Array
    joint_force: Array
    joint_moment: Array
    locked_moments: Array
    centre_of_mass: Array
    peak_external_force: float
    mass_kg: float
    source: str = ""
    known: Flags | None = None
    foot_known: Flags | None = None

    def leg_known(self, side: Side) -> Flags:
        """(T,) whether the moments of the leg of a `side` are known; all are if nobody said."""
        if self.foot_known is None:
            return self._known()
        return self.foot_known[:, SIDES.index(side)]

    def recorded_moments(self) -> Mapping[str, Array]:
        """Moments by the names of `gait.record.MOMENT_NAMES`, (T,) Nm each."""
        found = {}
        for i, side in enumerate("rl"):
            for name in ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle"):
                found[f"{name}_{side}"] = self.moments[:, ACTUATED.index(f"{name}_{side}")]
            for j, name in enumerate(LOCKED_MOMENTS):
                found[f"{name}_{side}"] = self.locked_moments[:, i, j]
            for name in ("ankle_angle", "subtalar_angle"):
                found[f"{name}_{side}"] = self.moments[:, ACTUATED.index(f"{name}_{side}")]
        return found

    def title(self) -> str:
        """Which trial, and how large the residuals are."""
        known, where = self._known(), f"Joint moments of {self.source or 'a trial'}: "
        if not known.any() or not self.peak_external_force:
            return f"{where}in no frame is the ground reaction on both feet known"
        left = residuals(self, known)
        return (
            f"{where}{known.sum()} of {len(known)} frames known, residuals "
            f"{left.force_rms:.1f} N and {left.moment_rms:.1f} Nm RMS"
        )

    def to_frame(self) -> "pd.DataFrame":
        """The joint moments (Nm/kg), and the lengths of the residual force (N) and moment (Nm),
        by time (s); NaN where they are not known: those of a leg where its foot's force is not
        (`leg_known`), the residuals where that of either is not.
        """
        from gaitval._internal.text.frames import MOMENT, curve_frame, of_kind

        legs, both = {side[0]: self.leg_known(side) for side in SIDES}, self._known()
        residuals = (
            ("residual force", "N", self.residual_force),
            ("residual moment", "Nm", self.residual_moment),
        )
        shown = [
            *(
                (
                    of_kind(name, MOMENT),
                    "Nm/kg",
                    np.where(legs[name[-1]], each / self.mass_kg, np.nan),
                )
                for name, each in self.recorded_moments().items()
            ),
            *(
                (name, unit, np.where(both, np.linalg.norm(each, axis=1), np.nan))
                for name, unit, each in residuals
            ),
        ]
        return curve_frame(shown, axis="time", at=self.time)

    def _known(self) -> Flags:
        """(T,) whether a frame counts; all do if nobody said."""
        return np.ones(len(self.time), dtype=bool) if self.known is None else self.known


@dataclass(frozen=True)
class Residuals:
    """How large the residuals of a motion are, in the measures that published limits use
    (`metrics/tolerances.toml`).

    Attributes
    ----------
    force_rms, force_peak : N; the largest of the three world components, because OpenSim's
        checklist rates each separately.
    moment_rms, moment_peak : Nm, likewise, about the pelvis' origin.
    force_share : largest residual force / largest ground reaction on one foot (Hicks et al. 2015),
        in vector lengths.
    moment_share : largest residual moment / (mean height of the centre of mass times the largest
        ground reaction on one foot) (Hicks et al. 2015).
    frames : number of frames used.
    """

    force_rms: float
    force_peak: float
    moment_rms: float
    moment_peak: float
    force_share: float
    moment_share: float
    frames: int


@njit
def _all_frames(
    tree: Tree,
    positions: Array,
    rates: Array,
    second_rates: Array,
    force: Array,
    point: Array,
    free_moment: Array,
    generalised: Array,
    joint: Array,
    locked: Array,
    centre: Array,
    ankle: Array,
) -> None:
    """`newton_euler` of every frame. Out: `generalised` (T, 31); `joint` (T, 2, 3, 2, 3) by side,
    joint, moment and force, component; `locked` (T, 2, 3), `LOCKED_MOMENTS`; `centre` (T, 3) of
    mass of the body; `ankle` (T, 2, 3), origin of both feet.
    """
    segments = empty_dynamics()
    rotation, origin, wrench = segments.frames.rotation, segments.frames.origin, segments.wrench
    for t in range(len(positions)):
        newton_euler(
            tree, positions[t], rates[t], second_rates[t], force[t], point[t], free_moment[t],
            segments, generalised[t],
        )  # fmt: skip
        for side in range(2):
            for j in range(3):
                joint[t, side, j] = wrench[_JOINT_SEGMENT[side, j]]
            shank, foot = _JOINT_SEGMENT[side, 1], _JOINT_SEGMENT[side, 2]
            sign = 1.0 if side == 0 else -1.0  # adduction +x, internal rotation +z on the right
            ankle[t, side] = origin[foot]
            locked[t, side] = 0.0
            # Components of the joint's moment along x and z of the distal segment: columns of its
            # rotation matrix.
            for i in range(3):
                locked[t, side, 0] += sign * rotation[shank, i, 0] * wrench[shank, 0, i]
                locked[t, side, 1] += sign * rotation[shank, i, 2] * wrench[shank, 0, i]
                locked[t, side, 2] += sign * rotation[foot, i, 2] * wrench[foot, 0, i]
        centre[t] = whole_body_centre_of_mass(tree, segments.frames)


def checked_wrenches(
    time: Array, force: Array, point: Array, free_moment: Array
) -> tuple[Array, Array, Array]:
    """Ground reactions as float arrays that the compiled equations can use: `force` (T, 2, 3) N on
    the right and the left foot, `point` (T, 2, 3) m where it acts, NaN while the foot is in the air
    (one that is NaN in part becomes so), and `free_moment` (T, 2, 3) Nm about it.

    Raises RecordError, with its `time` (T,) s, where a foot has a centre of pressure but no force
    or free moment; ValueError for other shapes.
    """
    arrays = [np.asarray(a, dtype=float) for a in (force, point, free_moment)]
    names = ("force", "point", "free_moment")
    for name, array in zip(names, arrays, strict=True):
        if array.shape != (len(time), 2, 3):
            raise ValueError(
                f"{name} must have shape ({len(time)}, 2, 3), but its shape is {array.shape}"
            )
    known = ~np.isnan(arrays[1]).any(axis=2)
    # `newton_euler` takes a foot to be in the air where x of its point is NaN.
    arrays[1] = np.where(known[..., None], arrays[1], np.nan)
    for name, array in (("force", arrays[0]), ("free moment", arrays[2])):
        missing = known & ~np.isfinite(array).all(axis=2)
        if missing.any():
            t, side = np.argwhere(missing)[0]
            raise RecordError(
                f"The ground reaction on the {('right', 'left')[side]} foot has a centre of "
                f"pressure but no {name} at {time[t]:.4g} s. Give both, or neither if the foot is "
                "in the air."
            )
    force, point, free_moment = (np.ascontiguousarray(array) for array in arrays)
    return force, point, free_moment


def _check_feet(ankle: Array, point: Array) -> None:
    """Refuse forces that act under the other foot. The residual would not show it, because the sum
    of the forces is the same, but every moment of both legs would be wrong.
    """
    # Horizontal distances from the ankle; with the sides reversed, from the other ankle.
    own = np.linalg.norm((point - ankle)[..., :2], axis=2)
    other = np.linalg.norm((point - ankle[:, ::-1])[..., :2], axis=2)
    loaded = ~np.isnan(own)
    wrong = (own > other) & loaded
    # A majority of frames, because in push-off the point is under the toes, far from its own ankle.
    if 2 * wrong.sum() > loaded.sum():
        raise RecordError(
            f"In {wrong.sum()} of {loaded.sum()} loaded frames the centre of pressure of a foot "
            f"is nearer to the other foot (median {np.median(other[loaded]):.2f} m) than to its "
            f"own ({np.median(own[loaded]):.2f} m). Either the plates are assigned to the wrong "
            "feet, or plates and markers are in different axes. Correct the assignment or the "
            "axes."
        )


def inverse_dynamics(
    model: BodyModel,
    time: Array,
    positions: Array,
    force: Array,
    point: Array,
    free_moment: Array,
    *,
    kinematics: Kinematics | None = None,
) -> InverseDynamics:
    """Joint moments and residuals of a motion with measured ground reactions.

    Parameters
    ----------
    model : the scaled body, with the masses and inertia of its segments.
    time : (T,) s.
    positions : (T, 31), filtered (nothing is smoothed here), root convention of
        `model.tree`.
    force : (T, 2, 3) N, ground on the right and the left foot, world axes, at the same times.
    point : (T, 2, 3) m, where `force` acts (centre of pressure); NaN while the foot is in the air,
        whatever its force.
    free_moment : (T, 2, 3) Nm, ground on the foot about `point`.
    kinematics : rates to use instead of `differentiate(time, positions)`.

    Raises
    ------
    RecordError : the motion cannot be differentiated, there is a centre of pressure without a
        force, or the forces are on the wrong feet.
    ValueError : other shapes.
    """
    time, positions = checked_motion(time, positions)
    force, point, free_moment = checked_wrenches(time, force, point, free_moment)
    rates = kinematics or differentiate(time, positions)
    frames = len(time)
    generalised = np.empty((frames, COORDINATE_COUNT))
    joint, locked = np.empty((frames, 2, 3, 2, 3)), np.empty((frames, 2, 3))
    centre, ankle = np.empty((frames, 3)), np.empty((frames, 2, 3))
    motion = (np.ascontiguousarray(values, dtype=float) for values in rates)
    ground, found = (force, point, free_moment), (generalised, joint, locked, centre, ankle)
    _all_frames(tree_arrays(model), *motion, *ground, *found)
    _check_feet(ankle, point)
    loaded = ~np.isnan(point[..., 0])
    # A force without a point does not act on the body, so it is no peak either.
    size = np.linalg.norm(force, axis=2)[loaded]
    return InverseDynamics(
        time=time,
        moments=generalised[:, ROOT_DOFS:],
        # Each coordinate is a rotation about one axis, so its power is moment times rate.
        powers=generalised[:, ROOT_DOFS:] * rates.velocities[:, ROOT_DOFS:],
        # A generalised root force is the moment first, then the force (`model.tree`).
        residual_force=generalised[:, 3:6],
        residual_moment=generalised[:, :3],
        joint_force=joint[:, :, :, 1],
        joint_moment=joint[:, :, :, 0],
        locked_moments=locked,
        centre_of_mass=centre,
        peak_external_force=float(size.max(initial=0.0)),
        mass_kg=model.mass,
    )


def ground_level(point: Array) -> float:
    """Median height, m, of where the ground acts, `point` (..., 3); 0 if it never does."""
    heights = point[..., 2][np.isfinite(point[..., 2])]
    return float(np.median(heights)) if len(heights) else 0.0


def residuals(
    result: InverseDynamics, frames: Flags | None = None, *, ground_height: float = 0.0
) -> Residuals:
    """Measures of the residuals in `result`, of some `frames` (T,), for example those with known
    ground reaction, else of all. `ground_height`, m above z = 0, is for the height of the centre of
    mass. Raises RecordError if no frame is left, or no foot is on the ground in the whole motion.
    """
    chosen = np.ones(len(result.time), dtype=bool) if frames is None else np.asarray(frames)
    if not chosen.any():
        raise RecordError(
            "The residuals cannot be judged: in no frame is the ground reaction of both feet "
            "known. Use a trial in which each foot steps on its own plate."
        )
    if result.peak_external_force == 0.0:
        raise RecordError(
            "The residuals cannot be judged: no foot has a ground reaction in the whole motion. "
            "Check that the force plates were recorded and assigned to the feet."
        )
    return residual_measures(
        result.residual_force[chosen],
        result.residual_moment[chosen],
        height=float(result.centre_of_mass[chosen, 2].mean()) - ground_height,
        peak=result.peak_external_force,
    )


def residual_measures(force: Array, moment: Array, *, height: float, peak: float) -> Residuals:
    """Measures of residual `force` and `moment` (T, 3), N and Nm on the pelvis, world axes, with
    the mean `height` (m) of the centre of mass above the ground and the `peak` (N) of the ground
    reaction on one foot, NaN if not known, as are then the shares; see `Residuals`.
    """
    return Residuals(
        force_rms=float(np.sqrt((force**2).mean(axis=0)).max()),
        force_peak=float(np.abs(force).max()),
        moment_rms=float(np.sqrt((moment**2).mean(axis=0)).max()),
        moment_peak=float(np.abs(moment).max()),
        force_share=float(np.linalg.norm(force, axis=1).max() / peak),
        moment_share=float(np.linalg.norm(moment, axis=1).max() / (height * peak)),
        frames=len(force),
    )
