"""Fill gaps in marker trajectories from the segment's other markers or with a spline."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.configuration import ProcessingSettings
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import Repair, repair, seen_frames

LIMITS: Final[Mapping[str, float]] = {
    # Rebuilding from the segment bridges gaps this many times longer than a spline does.
    "rigid_gap_factor": 5.0,
    # Fraction of `largest_gap_s` up to which a spline is more accurate than the segment's
    # markers, because skin moves. Mean of the largest error in gaps cut into the walk of
    # Rajagopal et al. 2016 (shank, thigh, foot, pelvis): at 0.05 s 1.0, 0.9, 1.3, 0.7 mm by
    # spline and 1.0, 1.1, 1.6, 1.1 mm by the segment; at 0.1 s 2.3, 2.5, 3.8, 1.6 and 1.5,
    # 2.2, 3.0, 2.3 mm; at 0.2 s 9, 9, 16, 5 and 3, 4, 7, 4 mm.
    "spline_first": 0.5,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""


def fill_gaps(
    recording: Recording,
    markers: Array,
    segments: Mapping[str, str],
    processing: ProcessingSettings,
    spiked: Flags,
) -> list[Repair]:
    """Fill gaps in place from what was seen, never from what another gap was filled with.

    Parameters
    ----------
    recording : for names, rate and the times of findings.
    markers : (T, M, 3) m, changed in place; NaN where not seen.
    segments : marker -> segment of the body model; markers without one have no neighbours.
    processing : its `largest_gap_s`.
    spiked : (T, M) where a spike was removed, for the findings.

    Returns
    -------
    list
        One finding for each gap, filled or not.
    """
    rate = recording.marker_rate
    measured = markers.copy()
    seen = seen_frames(measured)
    findings = []
    for column, name in enumerate(recording.names):
        others = np.array(
            [
                other
                for other, partner in enumerate(recording.names)
                if other != column and name in segments and segments.get(partner) == segments[name]
            ],
            dtype=int,
        )
        for begin, end in zip(*runs(~seen[:, column]), strict=True):
            # Never seen: `cleaning.clean` reports it as missing.
            if end - begin == len(markers):
                continue
            from gaitval.mocap.gap_filling import bridge, rebuilt

            duration = (end - begin) / rate
            filled, action = None, "filled with a spline"
            if duration <= LIMITS["spline_first"] * processing.largest_gap_s:
                filled = bridge(measured[:, column], begin, end, rate)
            if filled is None and duration <= LIMITS["rigid_gap_factor"] * processing.largest_gap_s:
                from_others = rebuilt(measured, seen, column, others, begin, end)
                if from_others is not None:
                    filled, used, deformation = from_others
                    action = (
                        f"rebuilt from {', '.join(recording.names[i] for i in used)} (which moved "
                        f"{1000 * deformation:.1f} mm relative to each other)"
                    )
            if filled is None and duration <= processing.largest_gap_s:
                filled = bridge(measured[:, column], begin, end, rate)
            if filled is not None:
                markers[begin:end, column] = filled
            else:
                action = "left open" + (
                    " (at an end of the trial)"
                    if begin == 0 or end == len(markers)
                    else f" ({duration:.3f} s is too long without three markers of its segment)"
                )
            if spiked[begin:end, column].any():
                action += ", after a spike was removed"
            findings.append(repair(recording, "gap", [name], begin, end, action))
    return findings
