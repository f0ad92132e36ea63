"""What is wrong with a recording: a file for each family, and the table that all loops run over.

`look` evaluates what is there of a recording; `import.json` and its page show what was looked for,
with value and limits, and nothing else has to know a new finding. See docs/how-to/extend.md.
"""

from collections.abc import Collection
from typing import Final

from gaitval.findings import (
    feet,
    laboratory,
    markers,
    means,
    motion,
    plates,
    poses,
    stances,
    standing,
)
from gaitval.findings.finding import Finding, Looked, Result, Seen, look_for

FINDINGS: Final[tuple[Finding, ...]] = (
    markers.SELDOM,
    markers.FILLED,
    markers.SMOOTHED,
    markers.LOOSE,
    feet.MOVED,
    feet.HEIGHT,
    standing.UNLIKE,
    standing.SIDES,
    standing.LEGS,
    standing.ANKLES,
    standing.JOINT_WIDTHS,
    laboratory.BELT,
    motion.SWING,
    motion.WEIGHT,
    plates.DEAD,
    plates.SATURATED,
    plates.OUTSIDE_FOOT,
    plates.UNLOADED,
    stances.EXCHANGED_AXES,
    stances.BRAKING,
    stances.INWARD,
    stances.FREE_MOMENT,
    motion.FRAME_RATE,
    motion.MISMATCH,
    poses.NOT_FOUND,
    poses.HELD,
    means.DRIFT,
    means.SPEEDS,
)
"""A finding comes after those that explain it."""


def look(*parts: object, before: Collection[str] = ()) -> Result:
    """Look for all findings in these `parts` of a recording; see `look_for`."""
    return look_for(FINDINGS, parts, before)


__all__ = ["FINDINGS", "Finding", "Looked", "Result", "Seen", "look"]
