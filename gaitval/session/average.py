"""Mean curves over the cycles of all trials, and the mass that the force plates measure."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import COORDINATES, SIDES, Side
from gaitval.errors import RecordError
from gaitval.gait.cycles import AverageCurve, GaitCycle, WalkedPart, average
from gaitval.gait.record import RECORDED_ANGLES, REQUIRED_ANGLES
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.rotations import foot_angles, pelvis_angles
from gaitval.model.tree import segment_frames
from gaitval.session.request import Request
from gaitval.session.trial import WalkingTrial, valid_cycles
from gaitval.subjects.plausible import LEAST_WITH_AID

MASS_TOLERANCE = 0.12
"""Fraction of the body mass by which the force plates may differ from it. Plates with a wrong
offset, or a foot beside them, miss a few per cent; a mass in pounds is 120 % off."""

NEARLY_WHOLE: Final = 0.98
"""Least share of a cycle in which the plates show both feet. A foot that ends it beside the plates
is on the ground a few samples before, by the markers, depending on their rate."""


def side_angles(model: BodyModel, positions: Array, side: Side) -> dict[str, Array]:
    """Angles of one side over a motion `positions` (T, 31) of `model`, (T,) rad each, by the names
    and signs of `gait.record.GaitRecord`: of the joints, the pelvis and the foot.
    """
    suffix, sign = side[0], 1.0 if side == "right" else -1.0
    found = {
        f"{name}_{suffix}": positions[:, COORDINATES.index(f"{name}_{suffix}")]
        for name in RECORDED_ANGLES
    }
    # The pelvis is one body, but a record has its angles over each side's cycle. List and rotation
    # are positive with that side up and forward, hence the sign.
    tilt, list_right, rotation_right = pelvis_angles(
        Rotation.from_rotvec(positions[:, :3]).as_matrix()
    ).T
    found[f"pelvis_tilt_{suffix}"] = tilt
    found[f"pelvis_list_{suffix}"] = sign * list_right
    found[f"pelvis_rotation_{suffix}"] = sign * rotation_right
    foot = segment_frames(model, positions)[:, SEGMENTS.index(f"foot_{suffix}"), :3, :3]
    for name, angle in zip(
        ("pitch", "list", "progression"), foot_angles(foot, side).T, strict=True
    ):
        found[f"foot_{name}_{suffix}"] = angle
    return found


def mean_angles(model: BodyModel, walks: Sequence[WalkingTrial]) -> dict[str, AverageCurve]:
    """Mean joint angles of `model` by name, rad, over the cycles of all trials (`walks`)."""
    found = {}
    for side in SIDES:
        sampled = [side_angles(model, walk.motion, side) for walk in walks]
        for name in sampled[0]:
            curve = average(
                (walk.recording.time, angles[name], valid_cycles(walk, side, kinetics=False))
                for walk, angles in zip(walks, sampled, strict=True)
            )
            if curve is not None:
                found[name] = curve
    return found


SAGITTAL: Final = ("pelvis_tilt", "hip_flexion", "knee_angle", "ankle_angle")
_STEADY: Final = float(np.radians(10.0))


def largest_drift(name: str, kind: str) -> float:
    """By how much (rad, Nm/kg) a mean curve of this `name` and `kind` may end elsewhere than it
    began.

    Closing it moves no point by more than half of that: 5 degrees, beyond which joint angles
    mislead (McGinley et al. 2009, Gait & Posture 29:360), for angles that show whether a walk is
    steady; those across and about a limb, which a foot that is put down a little elsewhere changes,
    may do twice that.
    """
    if kind == "moment":
        return 0.8
    return _STEADY if name.startswith(SAGITTAL) else 2.0 * _STEADY


def left_open(name: str, curve: Array) -> bool:
    """Whether the mean angle `curve` (101,) of this `name`, which a subject need not have, is left
    out because it does not close.
    """
    return name not in REQUIRED_ANGLES and bool(abs(curve[-1] - curve[0]) > _STEADY)


def mean_kinetics(
    request: Request, walks: Sequence[WalkingTrial]
) -> tuple[dict[str, AverageCurve], dict[Side, AverageCurve]]:
    """Moments in Nm/kg and ground reactions in body weights, with the mass of `request`, over the
    cycles of all `walks`; empty without forces.
    """
    moments: dict[str, AverageCurve] = {}
    forces: dict[Side, AverageCurve] = {}
    for i, side in enumerate(SIDES):
        parts: dict[str, list[WalkedPart]] = {}
        reactions: list[WalkedPart] = []
        for walk in walks:
            if walk.moments is None or walk.forces is None:
                return {}, {}
            cycles = valid_cycles(walk, side, kinetics=True)
            for name, values in walk.moments.recorded_moments().items():
                if name.endswith(f"_{side[0]}"):
                    parts.setdefault(name, []).append(
                        (walk.recording.time, values / request.mass_kg, cycles)
                    )
            weights = walk.forces.force[:, i] / (request.mass_kg * STANDARD_GRAVITY)
            reactions.append((walk.forces.time, weights, cycles))
        for name, of_name in parts.items():
            curve = average(of_name)
            if curve is not None:
                moments[name] = curve
        force = average(reactions)
        if force is not None:
            forces[side] = force
    return moments, forces


def total_forces(
    walks: Sequence[WalkingTrial],
) -> Iterator[tuple[WalkingTrial, GaitCycle, Array]]:
    """The force (n, 3) N on both feet together, over each cycle in which the plates show both."""
    for walk in walks:
        if walk.forces is None:
            continue
        time = walk.forces.time
        for side in SIDES:
            for cycle in valid_cycles(walk, side, kinetics=True):
                inside = (time >= cycle.start) & (time < cycle.end)
                known = walk.forces.valid.all(axis=1) & inside
                if known.sum() >= NEARLY_WHOLE * inside.sum():
                    yield walk, cycle, walk.forces.force[known].sum(axis=1)


def check_mass(request: Request, walks: Sequence[WalkingTrial]) -> float | None:
    """Mean vertical force of `walks` over whole gait cycles, in body weights of `request`; None if
    no cycle is shown whole.

    Raises RecordError if the plates measure another mass, perhaps because one is in pounds; less
    than the mass is right with an aid, which carries the rest.
    """
    # Momentum at both ends of a cycle of steady walking is equal, so the mean force is the weight.
    shares = [total[:, 2].mean() for _, _, total in total_forces(walks)]
    if not shares:
        return None
    weight = float(np.mean(shares)) / STANDARD_GRAVITY
    ratio = weight / request.mass_kg
    if request.aid is not None and LEAST_WITH_AID <= ratio <= 1.0 + MASS_TOLERANCE:
        return ratio
    if abs(ratio - 1.0) > MASS_TOLERANCE:
        raise RecordError(
            f"The force plates carry {weight:.1f} kg over {len(shares)} whole gait cycles, but "
            f"the mass given is {request.mass_kg:.1f} kg. Over whole cycles the two must agree "
            f"within {100 * MASS_TOLERANCE:.0f} %. Check the mass (kg, with what the person "
            "carried), the unit of the forces (N), and that the trial is of this person. If "
            "something else carries a part of the body, say so with aid in a session file. Without "
            "the forces the body keeps the mass given: only where that one is right."
        ).with_way_on("--kinematics-only")
    return ratio
