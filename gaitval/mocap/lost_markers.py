"""Markers that are no longer on the body: held, fallen and ghost markers, and fill values.

A marker keeps its distance from the others of its segment. One that lies on the floor, stays where
it was last seen, is a reflection, or has another marker's place does not.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import Repair, passed_over, repair, seen_frames

FILLED: Final = 2
"""Frames at one exact place whose three coordinates are equal, as 9999 or -1: no camera measures
that twice."""
LIMITS: Final[Mapping[str, float]] = {
    # Share of the frames in which a marker must be on the body: the distance from another
    # marker is that of the narrowest range with so many of them.
    "dense": 0.3,
    # m. A distance that varies by more in these frames is not one of a segment.
    "rigid_m": 0.03,
    # m. No skin, and no belt of the pelvis, lets a distance within a segment change by so
    # much.
    "away_m": 0.2,
    # m, likewise, of a foot, whose skin hardly moves: 0.02 m at most in eleven recordings of
    # seven laboratories (running and jumping, too).
    "foot_away_m": 0.06,
    # m. On its way from the body and back it is left out from this on.
    "leaves_m": 0.03,
    # s. For a shorter time it is a spike.
    "shortest_s": 0.06,
    # s, about a stride, in which the foot may pass by the place where its marker lies.
    "together_s": 1.0,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""

PARTNERS: Final = 6


def without_fill_values(recording: Recording) -> Recording:
    """The trial, in its file's axes, with gaps where a program wrote a number for one: 9999, -1,
    or the like, in all three coordinates.
    """
    first = recording.markers[..., 0]
    equal = (recording.markers == first[..., None]).all(axis=2)
    values, counts = np.unique(first[equal], return_counts=True)
    values = values[counts >= FILLED]
    filled = equal & np.isin(first, values)
    if not filled.any():
        return recording
    seen = zip(recording.names, np.asarray(filled.any(axis=0)), strict=True)
    names = [name for name, some in seen if some]
    shown = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    passed_over(
        f"{recording.source}: {shown}: in {np.count_nonzero(filled)} frames all three coordinates "
        f"are {values[0]:.6g} m, which a program writes where a marker was not seen; read as gaps"
    )
    return recording.with_markers(
        recording.names, np.where(filled[..., None], np.nan, recording.markers)
    )


def leave_out_lost(
    recording: Recording, markers: Array, segments: Mapping[str, str]
) -> list[Repair]:
    """Make gaps in place where a marker is not on its segment.

    Parameters
    ----------
    recording : for names, rate and the times of findings.
    markers : (T, M, 3) m, changed in place; NaN where not seen.
    segments : marker -> segment of the body model; others are not judged.
    """
    rate, names = recording.marker_rate, recording.names
    # Toes bend by less than what is not on a foot is away.
    segments = {name: each.replace("toes", "foot") for name, each in segments.items()}
    findings = []
    for number, name in enumerate(names):
        found_away = _away(number, markers, names, segments)
        if found_away is None:
            continue
        most, away = found_away
        foot = segments[name].startswith("foot")
        lost = _long(most > LIMITS["foot_away_m" if foot else "away_m"], rate)
        path = markers[:, number]
        held = np.r_[False, (path[1:] == path[:-1]).all(axis=1)]
        for begin, end in _merged(lost, held | (away > LIMITS["leaves_m"]), rate):
            largest, seconds = float(away[begin:end].max()), (end - begin) / rate
            until = "from there on" if end == len(markers) else f"for {seconds:.2f} s"
            action = (
                f"is not on its segment, but up to {largest:.2f} m off its place on the body; "
                f"left out {until}"
            )
            if np.isfinite(markers[begin:end, number]).any():
                findings.append(repair(recording, "lost", [name], begin, end, action))
    for found in findings:
        markers[found.first : found.last + 1, names.index(found.names[0])] = np.nan
    return findings


def without_lost(recording: Recording, segments: Mapping[str, str]) -> Recording:
    """The trial with gaps where a marker is not on its segment, as by `leave_out_lost`."""
    markers = recording.markers.copy()
    markers[~seen_frames(markers)] = np.nan
    leave_out_lost(recording, markers, segments)
    return recording.with_markers(recording.names, markers)


def _away(
    number: int, markers: Array, names: tuple[str, ...], segments: Mapping[str, str]
) -> tuple[Array, Array] | None:
    """(T,) m by which the distances of a marker from the others of its segment differ from what
    they usually are: most of them by at least so much, and the largest; 0 where they are not known.
    Where there is one other in its segment, it is joined by the marker of another segment whose
    distance is the steadiest. None without two.
    """
    segment = segments.get(names[number])
    if segment is None:
        return None
    rest = [i for i, name in enumerate(names) if i != number and name in segments]
    own = [i for i in rest if segments[names[i]] == segment]
    found = list[tuple[bool, float, Array]]()
    for other in own if len(own) != 1 else rest:
        distance = np.linalg.norm(markers[:, number] - markers[:, other], axis=1)
        usual = _usual(distance)
        if usual is not None:
            found.append((other not in own, usual[1], np.abs(distance - usual[0])))
    found.sort(key=lambda each: each[:2])
    if len(found) < 2 or found[0][0]:
        return None
    stacked = np.stack([each for _, _, each in found[: PARTNERS if len(own) > 1 else 2]])
    known = np.isfinite(stacked).sum(axis=0)
    # More than half of them differ by at least so much: of two both, of three two.
    ordered = np.sort(np.where(np.isfinite(stacked), stacked, 0.0), axis=0)[::-1]
    place = np.clip(known // 2, 0, len(stacked) - 1)
    middle = np.take_along_axis(ordered, place[None], axis=0)[0]
    own_ones = [beside for beside, _, _ in found].count(False)
    return np.where(known >= 2, middle, 0.0), np.nan_to_num(stacked[:own_ones]).max(axis=0)


def _usual(distance: Array) -> tuple[float, float] | None:
    """The distance, m, in the middle of the narrowest range with `LIMITS` of all frames, and the
    width of this range; None if that is no rigid one.
    """
    known = np.sort(distance[np.isfinite(distance)])
    count = int(np.ceil(LIMITS["dense"] * len(known)))
    if count < 3:
        return None
    widths = known[count - 1 :] - known[: len(known) - count + 1]
    first = int(np.argmin(widths))
    if widths[first] > LIMITS["rigid_m"]:
        return None
    return float(known[first : first + count].mean()), float(widths[first])


def _long(flags: Flags, rate: float) -> Flags:
    """Only what lasts."""
    kept = flags.copy()
    for begin, end in zip(*runs(flags), strict=True):
        if end - begin < max(2, LIMITS["shortest_s"] * rate):
            kept[begin:end] = False
    return kept


def _merged(lost: Flags, leaves: Flags, rate: float) -> list[tuple[int, int]]:
    """First frame and the one after the last of each time in which a marker is `lost` (T,), with
    its way from the body and back, where it `leaves` (T,) its place, or is held while this moves.
    """
    found: list[tuple[int, int]] = []
    together = LIMITS["together_s"] * rate
    for first, last in zip(*runs(leaves | lost), strict=True):
        if not lost[first:last].any():
            continue
        begin = found.pop()[0] if found and first - found[-1][1] < together else int(first)
        found.append((begin, int(last)))
    # Who is lost shortly before the end does not come back.
    if found and len(lost) - found[-1][1] < together:
        found[-1] = found[-1][0], len(lost)
    return found
