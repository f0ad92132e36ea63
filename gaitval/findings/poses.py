"""Whether the poses of a walk are those that fit its markers best, and inside their ranges."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.coordinates import ARM, COORDINATES, ROOT, split_side
from gaitval.findings.finding import Finding, Seen
from gaitval.kinetics.inverse.inverse_kinematics import InverseKinematics
from gaitval.model.markers import ModelMarker


@dataclass(frozen=True)
class Poses:
    """Inverse kinematics of a walk with `markers` on the body."""

    kinematics: InverseKinematics
    markers: Sequence[ModelMarker]


def _not_found(of: Poses) -> Iterator[Seen]:
    """Frames whose markers show the pelvis, but whose best pose was not found."""
    shown = of.kinematics.determined[:, : len(ROOT)].all(axis=1)
    frames = np.flatnonzero(shown & ~of.kinematics.converged)
    words = {"every": len(of.kinematics.converged), "first": int(frames[0]) if len(frames) else 0}
    yield Seen(float(len(frames)), "all markers", words)


def _held(of: Poses, *, fewest: int) -> Iterator[Seen]:
    """Share of the frames that show an angle in which it is at an end of its range; of the subtalar
    angle only where `fewest` markers on the foot show it. Of arms it says nothing: straight ones
    show no rotation, the markers of an elbow lie beside its axis, and no result contains them.
    """
    kinematics = of.kinematics
    for i, name in enumerate(COORDINATES):
        side, joint = split_side(name)
        seen = [each.segment for each in of.markers if each.name in kinematics.names]
        shown = kinematics.determined[:, i]
        if joint in ARM:
            continue
        if joint == "subtalar_angle" and seen.count(f"foot_{side[:1]}") < fewest:
            continue
        held = shown & kinematics.at_limit[:, i]
        if held.any():
            end = float(np.degrees(np.median(kinematics.positions[held, i])))
            where = f"{side} {joint.replace('_', ' ')}".strip()
            yield Seen(float(held.sum() / shown.sum()), where, {"end": end})


NOT_FOUND: Final[Finding] = Finding(
    name="poses",
    needs=Poses,
    values=_not_found,
    limits=0.0,
    unit="frames",
    sentence=(
        "in {value:.0f} of {every} frames, from frame {first} on, the pose that fits best was not "
        "found, so its angles may be off"
    ),
    remedy="Look at the markers in them",
)
HELD: Final[Finding] = Finding(
    name="ends of ranges",
    needs=Poses,
    values=_held,
    numbers={"fewest": 3},
    limits=0.05,
    unit="1",
    sentence=(
        "at {end:.0f}° in {value:.0f %} of the frames: the body's joint ends there, the markers go "
        "farther, and the joints beside it make up for it, so that their angles are off, too"
    ),
    remedy=("Look at the landmarks of this joint in standing, which say where its angle is zero"),
)
