"""A side that no trial shows: absent from the subject, or mirrored from the other if asked."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.gait.cycles import AverageCurve
from gaitval.gait.record import Mirrored, OneSide

ACROSS: Final = np.array([1.0, -1.0, 1.0])
"""What a mirror does to a force forward, left, up."""
ONE_SIDE: Final = "one side"
"""`QualityFlag.check` of a side that was not recorded."""


@dataclass(frozen=True)
class Completed:
    """Mean curves of the sides, (101, ...) each, 0 to 100 % of the side's cycle.

    Attributes
    ----------
    angles, moments : rad and Nm/kg, by name; a mirror keeps them, for they have the same sign on
        both sides (adduction, internal rotation and a pelvis dropped on the other side are +).
    forces : (101, 3) body weights, forward, left, up; empty without forces.
    not_recorded : the side that is not here, of the angles and of moments and forces.
    mirrored : the side that was not recorded and has the other side's curves.
    seen : a side whose cycles the trials show.
    """

    angles: Mapping[str, Array]
    moments: Mapping[str, Array]
    forces: Mapping[Side, Array]
    not_recorded: OneSide
    mirrored: Mirrored
    seen: Side


def missing_sides(
    angles: Mapping[str, AverageCurve], forces: Mapping[Side, AverageCurve]
) -> OneSide:
    """The side of which no trial shows a whole cycle that counts: in `angles`, in `forces`."""
    missing: OneSide = {}
    for side in SIDES:
        if f"hip_flexion_{side[0]}" not in angles:
            missing["angles"] = side
        if forces and side not in forces:
            missing["kinetics"] = side
    return missing


def completed_sides(
    angles: Mapping[str, AverageCurve],
    moments: Mapping[str, AverageCurve],
    forces: Mapping[Side, AverageCurve],
    *,
    mirror: bool,
) -> Completed:
    """The mean curves of an import: `angles`, `moments` and `forces` by name and side, in the units
    of `session.Import`; a side that was not recorded is missing or, with `mirror`, the other one's
    mirror image.
    """
    missing = missing_sides(angles, forces)
    of_angles = {name: np.asarray(curve.mean) for name, curve in angles.items()}
    of_moments = {name: np.asarray(curve.mean) for name, curve in moments.items()}
    of_forces = {side: np.asarray(forces[side].mean) for side in SIDES if side in forces}
    seen: Side = opposite(missing["angles"]) if "angles" in missing else "right"
    if not mirror:
        # moments go with forces: inverse dynamics of a foot without its force is not of a walk
        hidden = missing.get("kinetics")
        known = {n: c for n, c in of_moments.items() if hidden is None or n[-1] != hidden[0]}
        return Completed(of_angles, known, of_forces, missing, {}, seen)
    if "angles" in missing:
        of_angles = _mirrored(of_angles, seen, missing["angles"])
    if "kinetics" in missing:
        hidden = missing["kinetics"]
        of_moments = _mirrored(of_moments, opposite(hidden), hidden)
        # Angles and moments have the same sign on both sides; the lateral force has not.
        of_forces[hidden] = of_forces[opposite(hidden)] * ACROSS
    return Completed(of_angles, of_moments, of_forces, {}, missing, seen)


def _mirrored(curves: Mapping[str, Array], shown: Side, hidden: Side) -> dict[str, Array]:
    """The curves of a side, and the same under the names of the other."""
    own = {name: curve for name, curve in curves.items() if name.endswith(f"_{shown[0]}")}
    return own | {f"{name[:-2]}_{hidden[0]}": curve for name, curve in own.items()}
