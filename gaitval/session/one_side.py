"""A side that no trial shows: its mean curves are the other side's, mirrored."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.gait.record import Mirrored
from gaitval.session.average import unseen_side
from gaitval.session.session import Import

ACROSS = np.array([1.0, -1.0, 1.0])
"""What a mirror does to a force forward, left, up."""


@dataclass(frozen=True)
class Completed:
    """Mean curves of both sides, (101, ...) each, 0 to 100 % of the side's cycle.

    Attributes
    ----------
    angles, moments : rad and Nm/kg, by name; a mirror keeps them, for they have the same sign on
        both sides (adduction, internal rotation and a pelvis dropped on the other side are +).
    forces : (101, 3) body weights, forward, left, up; empty without forces.
    mirrored : the side that was not recorded, of the angles and of moments and forces.
    seen : a side whose cycles the trials show.
    """

    angles: Mapping[str, Array]
    moments: Mapping[str, Array]
    forces: Mapping[Side, Array]
    mirrored: Mirrored
    seen: Side


def completed_sides(found: Import) -> Completed:
    """The mean curves of an import, with a side that no cycle shows taken from the other."""
    angles = {name: np.asarray(curve.mean) for name, curve in found.angles.items()}
    moments = {name: np.asarray(curve.mean) for name, curve in found.moments.items()}
    forces = {side: np.asarray(found.forces[side].mean) for side in SIDES if side in found.forces}
    mirrored: Mirrored = {}
    unseen = unseen_side(found.angles)
    seen: Side = "right" if unseen is None else opposite(unseen)
    if unseen is not None:
        mirrored["angles"] = unseen
        angles = _mirrored(angles, seen, unseen)
    if len(forces) == 1:
        (shown,) = forces
        hidden = opposite(shown)
        mirrored["kinetics"] = hidden
        moments = _mirrored(moments, shown, hidden)
        forces[hidden] = forces[shown] * ACROSS
    return Completed(angles, moments, forces, mirrored, seen)


def _mirrored(curves: Mapping[str, Array], shown: Side, hidden: Side) -> dict[str, Array]:
    """The curves of a side, and the same under the names of the other."""
    own = {name: curve for name, curve in curves.items() if name.endswith(f"_{shown[0]}")}
    return own | {f"{name[:-2]}_{hidden[0]}": curve for name, curve in own.items()}
