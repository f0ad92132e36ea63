"""Fill gaps in marker trajectories from the segment's other markers or with a spline."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

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

LARGEST_DEFORMATION: Final = 0.02
"""m root-mean-square over the markers of a segment between the frames before and after a gap. Skin
moves by about this much; if it is more, the markers are not on one segment."""
FLATTEST_CLUSTER: Final = 0.1
"""Second over first singular value of the markers about their mean; markers on a line (0) do not
determine the rotation about it."""
SPLINE_SUPPORT: Final = 0.04
"""s on each side of a gap, over which the velocity at its edge is fitted."""


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
        others = [
            other
            for other, partner in enumerate(recording.names)
            if other != column and name in segments and segments.get(partner) == segments[name]
        ]
        for begin, end in zip(*runs(~seen[:, column]), strict=True):
            # Never seen: `cleaning.clean` reports it as missing.
            if end - begin == len(markers):
                continue
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


def rebuilt(
    markers: Array, seen: Flags, column: int, others: Sequence[int], begin: int, end: int
) -> tuple[Array, list[int], float] | None:
    """Positions (n, 3) of a marker in its gap from the rigid motion of others on its segment, which
    of them, and by how much they moved against each other (m); None if they cannot say.

    Kabsch's method (1976, Acta Cryst A32:922) gives the motion of the others from an edge of the
    gap to each of its frames; the marker moves with them. At the other edge this is off by the
    skin's movement, which is spread evenly over the gap so that both edges join.

    Parameters
    ----------
    markers : (T, M, 3) m, with gaps.
    seen : (T, M) whether a marker is seen.
    column : of the marker.
    others : columns of the markers on its segment.
    begin, end : first frame of the gap, and the first after it.
    """
    edges = [frame for frame in (begin - 1, end) if 0 <= frame < len(markers)]
    # The gap with the seen frames at its edges; at an end of the trial there is only one.
    frames = np.arange(begin - (begin > 0), end + (end < len(markers)))
    used = [i for i in others if seen[frames, i].all()]
    if len(used) < 3:
        return None
    template = markers[edges[0]][used]
    centre = template.mean(axis=0)
    # Markers on a line leave the rotation about it open.
    spread = np.linalg.svd(template - centre, compute_uv=False)
    if spread[1] < FLATTEST_CLUSTER * spread[0]:
        return None
    local = markers[edges[0], column] - centre
    moved = np.empty((len(frames), 3))
    deformation = 0.0
    for row, frame in enumerate(frames):
        cluster = markers[frame][used]
        middle = cluster.mean(axis=0)
        turn, distance = Rotation.align_vectors(cluster - middle, template - centre)
        # `align_vectors` gives the root of the sum of squares over the markers.
        deformation = max(deformation, float(distance) / np.sqrt(len(used)))
        # Rotation about the middle of the cluster, and its translation.
        moved[row] = turn.apply(local) + middle
    if deformation > LARGEST_DEFORMATION:
        return None
    if len(edges) == 2:
        share = np.linspace(0.0, 1.0, len(frames))[:, None]
        moved += share * (markers[end, column] - moved[-1])
    return moved[begin - frames[0] : end - frames[0]], used, deformation


def bridge(path: Array, begin: int, end: int, rate: float) -> Array | None:
    """Positions (n, 3) in a gap: the cubic with the position and velocity at both edges; None with
    fewer than two frames at an edge.

    The velocities are those of parabolas through the frames next to the gap, so that the noise
    of two single frames does not bulge the curve.

    Parameters
    ----------
    path : (T, 3) m of one marker.
    begin, end : first frame of the gap, and the first after it.
    rate : Hz.
    """
    support = max(3, round(SPLINE_SUPPORT * rate))
    knots, positions, velocities = [], [], []
    for frame, step in ((begin - 1, -1), (end, 1)):
        frames = frame + step * np.arange(support)
        frames = frames[(frames >= 0) & (frames < len(path))]
        known = seen_frames(path[frames])
        count = len(frames) if known.all() else int(np.argmin(known))
        if count < 2:
            return None
        # A parabola through three frames would reproduce their noise.
        degree = 2 if count > 3 else 1
        fit = np.polyfit(frames[:count] - frame, path[frames[:count]], degree)
        knots.append(frame)
        positions.append(path[frame])
        # The linear coefficient of a polynomial about the edge is the velocity there, per frame.
        velocities.append(fit[-2])
    curve = CubicHermiteSpline(knots, np.array(positions), np.array(velocities))
    return np.asarray(curve(np.arange(begin, end)))
