"""At which angle a person's pelvis is as the published one.

Muscles are as long as published where the plane of the person's ASIS and PSIS lies as on the
published pelvis. But that plane is tilted by 5 degrees more or less in pelves that lie alike
(`PELVIS.shapes`), and healthy people walk with a tilt that differs by hardly more
(`PELVIS.spread`): nearly all of what one person's mean tilt is off is the shape of the bone and
where the markers are, not posture. Where it was taken for posture, the thigh of who walked with a
tilt of 3 degrees was 28 degrees behind the pelvis; passive flexors of the hip pulled three times as
much as hips make there, and what held against them had nothing left: 12 % of a moment was made by
no muscle.

So a person's mean tilt in walking is drawn to what is usual, by the share that shapes are expected
to make of it. What is farther out than 95 % of healthy people is taken for posture, as in crouch.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames


@dataclass(frozen=True)
class PelvisZero:
    """Where the pelvis of a model has its zero."""

    usual: float = math.radians(9.3)
    spread: float = math.radians(5.3)
    """rad, mean and standard deviation of the mean tilt of healthy adults who walk over ground at
    their own speed, positive where the front is lower: 32 of the 42 of Fukuchi et al. (2018) PeerJ
    6:e4640, without the built-in ten (`tests/muscles/test_pelvis_zero.py`)."""
    shapes: float = 0.087
    """rad, standard deviation of the tilt of the plane of ASIS and PSIS in pelves that lie alike: 5
    degrees (Preece et al. 2008, read about)."""
    farthest: float = 2.0
    """Of `spread`."""


PELVIS: Final = PelvisZero()


class GaitMotion(Protocol):
    """What `gait.LoadedMotion` has that tells the tilt."""

    @property
    def model(self) -> BodyModel:
        """The scaled body."""

    @property
    def positions(self) -> Array:
        """(T, 31)."""

    @property
    def dynamics(self) -> InverseDynamics:
        """Of them."""

    @property
    def cycles(self) -> Mapping[Side, Sequence[tuple[float, float]]]:
        """s, starts and ends of whole gait cycles."""


def pelvis_zero(tilt: float) -> float:
    """How much further forward, rad, a pelvis lies than its ASIS and PSIS say, expected of a person
    who walks with the mean `tilt` (rad) of their plane.
    """
    share = min(1.0, (PELVIS.shapes / PELVIS.spread) ** 2)
    most = PELVIS.farthest * PELVIS.spread
    return -share * float(np.clip(tilt - PELVIS.usual, -most, most))


def tilts(model: BodyModel, positions: Array) -> Array:
    """Tilt (T,) rad of the pelvis of `model` to gravity at `positions` (T, 31)."""
    frames = segment_frames(model, positions)
    forward = frames[:, SEGMENTS.index("pelvis"), :3, 0]
    return np.asarray(-np.arcsin(np.clip(forward @ model.ground.up, -1.0, 1.0)))


def walking_tilt(motions: Iterable[GaitMotion]) -> float | None:
    """Mean tilt (rad) over all whole cycles of `motions`; None without a cycle: part of a stride
    does not say.
    """
    found = [_within(motion, cycles) for motion in motions for cycles in motion.cycles.values()]
    together = np.concatenate([np.zeros(0), *found])
    return float(together.mean()) if len(together) else None


def _within(motion: GaitMotion, cycles: Sequence[tuple[float, float]]) -> Array:
    time = motion.dynamics.time
    inside = np.zeros(len(time), dtype=bool)
    for start, end in cycles:
        inside |= (time >= start) & (time <= end)
    return tilts(motion.model, motion.positions[inside])


__all__ = ["PELVIS", "pelvis_zero", "tilts", "walking_tilt"]
