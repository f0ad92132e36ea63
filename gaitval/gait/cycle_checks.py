"""Cycles that do not count although their events are complete: gaps in the markers, odd events."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array, runs
from gaitval.coordinates import SIDES, Side
from gaitval.gait.cycles import GaitCycle

ODD_SUPPORT: Final = 0.1
"""Fraction of the cycle by which the double support that begins a cycle may differ from the trial's
median. In WBDS01 T01, the slowest walk at hand, its standard deviation is 1.7 % of the cycle; in
single strides of twelve children the sides differ by 5 % at most. More is a wrong heel strike, such
as one where the foot's markers come into view while it swings."""


def without_gaps(
    cycles: Iterable[GaitCycle], time: Array, seen: NDArray[np.bool_], *, longest_gap_s: float
) -> tuple[GaitCycle, ...]:
    """The same `cycles` of one foot, in their order; those in which the markers do not show the
    motion throughout are not valid, for that reason.

    `time` (T,) s is that of the marker frames, uniformly spaced, `seen` (T,) whether they show the
    pelvis and this foot's leg. Gaps up to `longest_gap_s` (s) are bridged, so they do not matter.
    """
    # The same length in frames: (T − 1) / duration is the marker rate.
    longest = longest_gap_s * (len(time) - 1) / (time[-1] - time[0])
    gaps = [
        slice(begin, end) for begin, end in zip(*runs(~seen), strict=True) if end - begin > longest
    ]
    last = len(time) - 1
    found = []
    for cycle in cycles:
        # Two intervals overlap if each begins before the other ends. That of a gap is from the last
        # frame before it to the first one after it, because between frames is interpolated.
        inside = [
            gap
            for gap in gaps
            if time[max(gap.start - 1, 0)] < cycle.end and time[min(gap.stop, last)] > cycle.start
        ]
        if inside:
            reasons = tuple(
                f"the markers do not show the pelvis and the {cycle.side} leg at "
                f"{time[gap.start]:.3f}-{time[gap.stop - 1]:.3f} s"
                for gap in inside
            )
            cycle = _refused(cycle, *reasons)
        found.append(cycle)
    return tuple(found)


def without_odd_support(
    cycles: Mapping[Side, tuple[GaitCycle, ...]],
) -> dict[Side, tuple[GaitCycle, ...]]:
    """The same `cycles` of both feet, in their order; those whose first double support is unlike
    the others are not valid, for that reason. The median is that of both sides; with fewer than
    three cycles none is judged.
    """
    # From heel strike to the other foot's toe-off, as a fraction of the cycle; NaN if unknown.
    support = {
        side: np.array([(c.opposite_toe_off - c.start) / c.duration for c in cycles[side]])
        for side in SIDES
    }
    known = np.concatenate([support[side] for side in SIDES])
    known = known[np.isfinite(known)]
    # Of two that differ, neither is known to be the wrong one.
    if len(known) < 3:
        return dict(cycles)
    usual = float(np.median(known))
    found = {}
    for side in SIDES:
        kept = []
        for number, (cycle, share) in enumerate(zip(cycles[side], support[side], strict=True)):
            # Sides of a patient may differ, so it must be unlike the others of its own, too. An
            # unknown share (NaN) is not odd: a missing toe-off is a reason of its own already.
            others = np.delete(support[side], number)
            others = others[np.isfinite(others)]
            own = float(np.median(others)) if len(others) else usual
            if min(abs(share - usual), abs(share - own)) > ODD_SUPPORT:
                cycle = _refused(
                    cycle,
                    f"both feet are on the ground for {100 * share:.0f} % of it after its heel "
                    f"strike, but for {100 * usual:.0f} % in the trial's median: a wrong event",
                )
            kept.append(cycle)
        found[side] = tuple(kept)
    return found


def _refused(cycle: GaitCycle, *reasons: str) -> GaitCycle:
    """The cycle, not valid, with further reasons."""
    return replace(
        cycle, kinematics_valid=False, kinetics_valid=False, reasons=cycle.reasons + reasons
    )
