"""A side that no trial shows: it is absent from the subject, and a warning says why."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NoReturn

from gaitval.coordinates import SIDES, Side
from gaitval.errors import RecordError, count_of
from gaitval.gait.cycles import AverageCurve
from gaitval.gait.quality_flags import QualityFlag
from gaitval.gait.record import OneSide
from gaitval.session.trial import WalkingTrial

MOST: Final = 4
"""Reasons for cycles that do not count, and lines about plates, in a message."""


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


def one_side_warnings(
    walks: Sequence[WalkingTrial],
    angles: Mapping[str, AverageCurve],
    forces: Mapping[Side, AverageCurve],
) -> Iterator[QualityFlag]:
    """Warnings about a side of which `angles` or `forces` of the `walks` were not recorded: why,
    and what can be done.
    """
    missing = missing_sides(angles, forces)
    for kind, side in missing.items():
        if kind == "kinetics" and missing.get("angles") == side:
            continue  # said with the angles
        if kind == "kinetics":
            where, what = f"{side} foot", "moments and forces"
        else:
            where, what = f"{side} leg", "angles, moments and forces" if forces else "angles"
        yield QualityFlag(
            "one side", where, 0.0, 1.0, "cycles",
            f"its {what} were not recorded: no trial shows a whole cycle of it that counts "
            f"({_why(walks, side)}). The subject has none; its walk is asked to be symmetric "
            "there, and is not judged by it. A further --trial that shows it records them",
        )  # fmt: skip


def _why(walks: Sequence[WalkingTrial], side: Side) -> str:
    """Why the cycles of a side do not count, the most frequent reasons first."""
    cycles = [cycle for walk in walks for cycle in walk.cycles[side]]
    reasons = Counter("; ".join(cycle.reasons) for cycle in cycles if cycle.reasons)
    counted = [f"{count_of(len(cycles), 'cycle')} in all"]
    return ", ".join(
        counted + [f"{count} × {reason}" for reason, count in reasons.most_common(MOST)]
    )


def refuse_without_forces(walks: Sequence[WalkingTrial]) -> NoReturn:
    """Raise RecordError for `walks` in which no side has a mean ground reaction; says why."""
    reasons = [f"the {side} foot: {_why(walks, side)}" for side in SIDES]
    reasons += [f"{walk.name}: {finding}" for walk in walks for finding in walk.findings][:MOST]
    raise RecordError(
        "no gait cycle whose ground reaction the plates show from heel strike to heel strike, so a "
        "subject's mean moments and forces cannot be computed.\n  "
        + "\n  ".join(reasons)
        + "\nGive a trial (or several, with --trial repeated) in which a foot lands on a plate of "
        "its own; of plates that both feet step on, or that lie upon each other, say with --plate "
        "whose they are. Or use --kinematics-only."
    ).with_way_on("--kinematics-only")
