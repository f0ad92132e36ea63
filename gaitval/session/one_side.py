"""A side that no trial shows: absent from the subject, or mirrored from the other if asked."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.gait.cycles import AverageCurve
from gaitval.gait.quality_flags import QualityFlag
from gaitval.gait.record import Mirrored, OneSide
from gaitval.session.request import Request
from gaitval.session.trial import WalkingTrial

ACROSS: Final = np.array([1.0, -1.0, 1.0])
"""What a mirror does to a force forward, left, up."""
ONE_SIDE: Final = "one side"
"""`QualityFlag.check` of a side that was not recorded."""
REASONS_SHOWN: Final = 3
"""Different reasons for cycles that do not count, in a message."""

_WHEN: Final = re.compile(r" at [\d.]+-[\d.]+ s")
"""When a plate did not show a foot, which differs from cycle to cycle."""


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


def one_side_doubts(
    request: Request,
    walks: Sequence[WalkingTrial],
    angles: Mapping[str, AverageCurve],
    forces: Mapping[Side, AverageCurve],
) -> Iterator[QualityFlag]:
    """Warnings about a side of which `angles` or `forces` of the `walks` were not recorded: why,
    and what can be done in view of `request`.
    """
    missing = missing_sides(angles, forces)
    for kind, side in missing.items():
        if kind == "kinetics" and missing.get("angles") == side:
            continue  # said with the angles
        kinetics = kind == "kinetics"
        what = "moments and forces" if kinetics or not forces else "angles, moments and forces"
        what = "angles" if not (kinetics or forces) else what
        shown = (
            "the plates show no whole cycle of it alone"
            if kinetics
            else "no trial shows a whole cycle of it that counts"
        )
        mends = (
            "A further --trial in which it lands on a plate of its own records them"
            if kinetics
            else "A further --trial that shows it records them"
        )
        yield QualityFlag(
            *(ONE_SIDE, f"{side} {'foot' if kinetics else 'leg'}", 0.0, 1.0, "cycles"),
            f"its {what} were not recorded: {shown} ({_why(walks, side, kinetics=kinetics)}). "
            f"{_instead(side, what, mirror=request.mirror)} {mends}",
        )


def _instead(side: Side, what: str, *, mirror: bool) -> str:
    """What the subject has in place of a side."""
    if mirror:
        return (
            f"As --mirror asks, the subject has those of the {opposite(side)} side, mirrored; they "
            "stay marked as not recorded, and no walk is judged by them."
        )
    return (
        f"The subject has no {side} {what}; its walk is asked to be symmetric there, and is not "
        f"judged by it. With --mirror (mirror = true in a session file and in Python) the "
        f"{opposite(side)} side's mirror image is put in their place, marked as not recorded."
    )


def _why(walks: Sequence[WalkingTrial], side: Side, *, kinetics: bool) -> str:
    """Why the cycles of a side do not count, the most frequent reasons first."""
    cycles = [cycle for walk in walks for cycle in walk.cycles[side]]
    if not cycles:
        return "no two heel strikes of it in one trial"
    reasons = Counter(_WHEN.sub("", "; ".join(cycle.reasons)) for cycle in cycles if cycle.reasons)
    said = [f"{count} × {reason}" for reason, count in reasons.most_common(REASONS_SHOWN)]
    more = sum(reasons.values()) - sum(count for _, count in reasons.most_common(REASONS_SHOWN))
    if more:
        said.append(f"{more} × other reasons")
    counted = f"{len(cycles)} {'cycle' if len(cycles) == 1 else 'cycles'} that do not count"
    return (
        f"{counted}: {', '.join(said)}"
        if said
        else f"{len(cycles)} cycles" + (" without its forces" if kinetics else "")
    )
