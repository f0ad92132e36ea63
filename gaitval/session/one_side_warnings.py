"""Warnings about a side that was not recorded: why, and what can be done."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Final, NoReturn

import numpy as np

from gaitval.coordinates import SIDES, Side, opposite
from gaitval.errors import RecordError, count_of
from gaitval.gait.cycles import AverageCurve
from gaitval.gait.quality_flags import QualityFlag
from gaitval.session.one_side import ONE_SIDE, missing_sides
from gaitval.session.request import Request
from gaitval.session.trial import WalkingTrial

REASONS_SHOWN: Final = 3
"""Different reasons for cycles that do not count, in a message."""

MOST: Final = 4
"""Lines of cycles, and of plates, in a message."""

SAME_PLACE: Final = 0.02
"""m between the middles of two plates that lie upon each other; two that lie side by side are a
width apart.
"""

_WHEN: Final = re.compile(r" at [\d.]+-[\d.]+ s")
"""When a plate did not show a foot, which differs from cycle to cycle."""


def one_side_warnings(
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
        if kinetics:
            what, shown = "moments and forces", "the plates show no whole cycle of it alone"
            fixing = "in which it lands on a plate of its own"
        else:
            what = "angles, moments and forces" if forces else "angles"
            shown, fixing = "no trial shows a whole cycle of it that counts", "that shows it"
        yield QualityFlag(
            *(ONE_SIDE, f"{side} {'foot' if kinetics else 'leg'}", 0.0, 1.0, "cycles"),
            f"its {what} were not recorded: {shown} ({_why(walks, side, kinetics=kinetics)}). "
            f"{_instead(side, what, mirror=request.mirror)} A further --trial {fixing} records "
            "them",
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
    if not reasons:
        return count_of(len(cycles), "cycle") + (" without its forces" if kinetics else "")
    shown = reasons.most_common(REASONS_SHOWN)
    messages = [f"{count} × {reason}" for reason, count in shown]
    if more := reasons.total() - sum(count for _, count in shown):
        messages.append(f"{more} × other reasons")
    counted = count_of(len(cycles), "cycle that does not count", "cycles that do not count")
    return f"{counted}: {', '.join(messages)}"


def refuse_without_forces(walks: Sequence[WalkingTrial]) -> NoReturn:
    """Raise RecordError for `walks` in which no side has a mean ground reaction; says why."""
    reasons = [
        f"{walk.name}: {cycle}"
        for walk in walks
        for side in SIDES
        for cycle in walk.cycles[side]
        if not cycle.kinetics_valid
    ]
    plates = [f"{walk.name}: {finding}" for walk in walks for finding in walk.findings]
    raise RecordError(
        "no gait cycle whose ground reaction the plates show from heel strike to heel strike, so a "
        "subject's mean moments and forces cannot be computed.\n"
        + _some("the cycles", reasons)
        + _some("the plates", plates)
        + _upon_each_other(walks)
        + "Give a trial (or several, with --trial repeated) in which a foot lands on a plate of "
        "its own. If this is one, the forces are of another trial, of the other foot or in other "
        "axes than the markers: check their file. Or use --kinematics-only."
    ).with_way_on("--kinematics-only")


def _upon_each_other(walks: Sequence[WalkingTrial]) -> str:
    """What to say of two plates at the same place, as of a belt whose force another program divided
    between the feet, or of a walk that was simulated; nothing if there are none.
    """
    for walk in walks:
        for one, other in combinations(walk.recording.plates, 2):
            if np.abs(one.corners.mean(axis=0) - other.corners.mean(axis=0)).max() < SAME_PLACE:
                return (
                    f"Plates {one.name} and {other.name} lie upon each other. If each shows one "
                    f"foot, say which: --plate {one.name}=right --plate {other.name}=left, or the "
                    "other way round. "
                )
    return ""


def _some(what: str, lines: Sequence[str]) -> str:
    """The first of some lines, below what they are about; nothing if there are none."""
    if not lines:
        return ""
    more = f"\n  and {len(lines) - MOST} more" if len(lines) > MOST else ""
    return f"{what}:\n  " + "\n  ".join(lines[:MOST]) + more + "\n"
