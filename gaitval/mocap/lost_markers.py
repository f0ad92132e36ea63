"""Markers that are no longer on the body: fill values of exporters, held, fallen and ghost markers.

A marker keeps its distance from the others of its segment. One that lies on the floor, stays where
it was last seen, is a reflection, or has another marker's place does not.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import Repair, passed_over, repair, seen_frames
from gaitval.model.body import PARENTS

FILLED: Final = 2
"""Frames at one exact place whose three coordinates are equal, as 9999 or -1: no camera measures
that twice."""
LIMITS: Final[Mapping[str, float]] = {
    # m. No marker moves so far from one frame to the next, and none on a body is so far from
    # where it usually is in one coordinate alone.
    "leap_m": 3.0,
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
    # m, likewise, between segments: a leg that bends nears its ankle to the pelvis by 0.4 m.
    "joint_away_m": 0.6,
    # m, likewise, of a marker that rests: feet bend by 0.03 m.
    "held_away_m": 0.08,
    # m, likewise, of one that is exactly where it was.
    "same_away_m": 0.015,
    # m, likewise, of such a one, from one other marker of its segment that moves: a foot
    # bends by 0.03 m.
    "one_away_m": 0.04,
    # m. On its way from the body and back it is left out from this on.
    "leaves_m": 0.03,
    # m/s. A marker that lies on the floor, or whose last place is held, is slower.
    "rests": 0.05,
    # s. For a shorter time it is a spike.
    "shortest_s": 0.06,
    # s, about a stride, in which the foot may pass by the place where its marker lies.
    "together_s": 1.0,
    # Share of the frames in which a distance must be that of the standing trial for this to
    # be right; else the marker was put elsewhere between the trials.
    "as_standing": 0.1,
    # m. No two markers are nearer to each other.
    "one_place_m": 0.005,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""

PARTNERS: Final = 6


def without_fill_values(recording: Recording) -> Recording:
    """The trial, in its file's axes, with gaps where a program wrote a number for one: 9999, -1,
    or the like, in all three coordinates, or in one.
    """
    markers = recording.markers
    with np.errstate(invalid="ignore"):
        equal = (markers[..., 0] == markers[..., 1]) & (markers[..., 1] == markers[..., 2])
    values, counts = np.unique(markers[..., 0][equal], return_counts=True)
    in_all = equal & np.isin(markers[..., 0], values[counts >= FILLED])
    in_one = _one_filled(np.where(in_all[..., None], np.nan, markers))
    for filled, what in (
        (in_all, "all three coordinates are"),
        (np.asarray(in_one.any(axis=2)), "one is"),
    ):
        if not filled.any():
            continue
        value = markers[in_one][0] if what == "one is" else values[counts >= FILLED][0]
        seen = zip(recording.names, np.asarray(filled.any(axis=0)), strict=True)
        names = [name for name, some in seen if some]
        shown = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
        passed_over(
            f"{recording.source}: {shown}: in {np.count_nonzero(filled)} frames {what} "
            f"{value:.6g} m, which a program writes where a marker was not seen; read as gaps"
        )
    filled = np.asarray(in_all | in_one.any(axis=2))
    if not filled.any():
        return recording
    return recording.with_markers(recording.names, np.where(filled[..., None], np.nan, markers))


def _one_filled(markers: Array) -> Flags:
    """(T, M, 3) which coordinates a program wrote for a gap while it kept the others: they leap to
    one exact number, far away, again and again.
    """
    filled = np.zeros(markers.shape, dtype=bool)
    with np.errstate(invalid="ignore"):
        leaps = np.abs(np.diff(markers, axis=0)) > LIMITS["leap_m"]
        for number, axis in np.argwhere(leaps.any(axis=0)):
            path = markers[:, number, axis]
            values, counts = np.unique(path[np.isfinite(path)], return_counts=True)
            far = np.abs(path - np.nanmedian(path)) > LIMITS["leap_m"]
            filled[:, number, axis] = far & np.isin(path, values[counts >= FILLED])
    # A marker that rests where nobody is, is lost in another way.
    same = np.zeros(markers.shape[:2], dtype=bool)
    same[1:] = (markers[1:] == markers[:-1]).all(axis=2)
    same[:-1] |= same[1:]
    filled[same] = False
    return filled


class _Away(NamedTuple):
    """(T,) m by which the distances of a marker from the others of its segment differ from what
    they usually are: `most` of them differ by at least so much, `own` is the largest of its own
    segment. 0 where they are not known. More than `furthest` m is not on the segment. The only
    marker of a segment is `alone`: joints move it from the others, too.
    """

    most: Array
    own: Array
    furthest: float
    alone: bool


def leave_out_lost(
    recording: Recording,
    markers: Array,
    segments: Mapping[str, str],
    standing: Recording | None = None,
) -> list[Repair]:
    """Make gaps in place where a marker is not on its segment.

    Parameters
    ----------
    recording : for names, rate and the times of findings.
    markers : (T, M, 3) m, changed in place; NaN where not seen.
    segments : marker -> segment of the body model; others are not judged.
    standing : a trial in which the markers are in their places, in any axes.
    """
    rate, names = recording.marker_rate, recording.names
    places = _places(standing)
    # A place that a program holds says nothing about where the others are.
    held = np.stack([_held(markers[:, i], rate) for i in range(len(names))], axis=1)
    measured = np.where(held[..., None], np.nan, markers)
    away = {
        name: _away(number, markers, measured, names, segments, places)
        for number, name in enumerate(names)
    }
    seen = seen_frames(markers)
    findings = []
    for number, name in enumerate(names):
        distances = away[name]
        if distances is None:
            continue
        furthest = np.maximum(distances.most, distances.own)
        if not (furthest > LIMITS["same_away_m"]).any():
            continue
        path = markers[:, number]
        lost = _lost(path, distances, rate, _elsewhere(number, markers, names, segments))
        for begin, end in _merged(lost, distances, path, rate):
            during = slice(begin, end)
            largest, seconds = (
                float(furthest[during].max()),
                (end - begin) / rate,
            )
            until = "from there on" if end == len(markers) else f"for {seconds:.2f} s"
            action = (
                f"is not on its segment, but up to {largest:.2f} m off its place on the body; "
                f"left out {until}"
            )
            if seen[during, number].any():
                findings.append(repair(recording, "lost", [name], begin, end, action))
    for found in findings:
        markers[found.first : found.last + 1, names.index(found.names[0])] = np.nan
    return findings


def without_lost(
    recording: Recording, segments: Mapping[str, str], standing: Recording | None = None
) -> Recording:
    """The trial with gaps where a marker is not on its segment, as by `leave_out_lost`."""
    markers = recording.markers.copy()
    markers[~seen_frames(markers)] = np.nan
    leave_out_lost(recording, markers, segments, standing)
    return recording.with_markers(recording.names, markers)


def _places(standing: Recording | None) -> dict[str, Array]:
    """Median place (3,) m of each marker of the standing trial."""
    if standing is None:
        return {}
    return {
        name: np.median(path[seen_frames(path)], axis=0)
        for name in standing.names
        if seen_frames(path := standing.marker(name)).any()
    }


def _elsewhere(
    number: int, markers: Array, names: tuple[str, ...], segments: Mapping[str, str]
) -> Flags:
    """(T,) whether a marker is where one of another segment is."""
    others = [i for i, name in enumerate(names) if segments.get(name) != segments[names[number]]]
    with np.errstate(invalid="ignore"):
        apart = np.linalg.norm(markers[:, others] - markers[:, number, None], axis=2)
        return np.asarray((apart < LIMITS["one_place_m"]).any(axis=1))


def _away(
    number: int,
    markers: Array,
    measured: Array,
    names: tuple[str, ...],
    segments: Mapping[str, str],
    places: Mapping[str, Array],
) -> _Away | None:
    """How far a marker is off its distances from the others, as they are `measured`. Where there
    is one other in its segment, it is joined by the marker of another segment whose distance is
    the steadiest; where there is none, as on toes, those of the segments that a joint holds to
    it stand for it. None without two.
    """
    segment = segments.get(names[number])
    if segment is None:
        return None
    rest = [i for i, name in enumerate(names) if i != number and name in segments]
    own = [i for i in rest if segments[names[i]] == segment]
    if not own:  # of the segments that a joint holds to it
        rest = [i for i in rest if _joined(segment, segments[names[i]])]
    differences, steady = list[tuple[float, Array]](), list[tuple[float, Array]]()
    for other in own if len(own) > 1 else rest:
        distance = np.linalg.norm(markers[:, number] - measured[:, other], axis=1)
        both = [places[names[i]] for i in (number, other) if names[i] in places]
        stands = float(np.linalg.norm(both[0] - both[1])) if len(both) == 2 else None
        usual = _usual(distance, stands if other in own else None)
        if usual is not None:
            found = usual[1], np.abs(distance - usual[0])
            (differences if other in own else steady).append(found)
    within = [each for _, each in differences]
    if len(own) == 1 and differences and steady:
        differences.append(min(steady, key=lambda each: each[0]))
    if not own:
        differences = steady
    if len(differences) < 2:
        return None
    differences.sort(key=lambda each: each[0])
    stacked = np.stack([each for _, each in differences[:PARTNERS]])
    known = np.isfinite(stacked).sum(axis=0)
    # More than half of them differ by at least so much: of two both, of three two.
    ordered = np.sort(np.where(np.isfinite(stacked), stacked, -1.0), axis=0)[::-1]
    place = np.clip(known // 2, 0, len(stacked) - 1)
    middle = np.take_along_axis(ordered, place[None], axis=0)[0]
    largest = np.nan_to_num(np.stack(within or [0.0 * stacked[0]])).max(axis=0)
    furthest = (
        LIMITS["foot_away_m"] if segment.startswith("foot") and len(own) > 1 else LIMITS["away_m"]
    )
    return _Away(np.where(known >= 2, np.maximum(middle, 0.0), 0.0), largest, furthest, not own)


def _joined(one: str, other: str) -> bool:
    """Whether a joint of the model is between two segments."""
    return PARENTS.get(one) == other or PARENTS.get(other) == one


def _usual(distance: Array, stands: float | None) -> tuple[float, float] | None:
    """That of standing, `stands`, if it is met; else the distance, m, in the middle of the
    narrowest range with `LIMITS` of all frames. With the width of this range; None if that is no
    rigid one.
    """
    known = np.sort(distance[np.isfinite(distance)])
    if stands is not None and len(known):
        near = known[np.abs(known - stands) < LIMITS["leaves_m"]]
        if len(near) >= LIMITS["as_standing"] * len(known):
            return float(np.median(near)), float(np.ptp(near))
    count = int(np.ceil(LIMITS["dense"] * len(known)))
    if count < 3:
        return None
    widths = known[count - 1 :] - known[: len(known) - count + 1]
    first = int(np.argmin(widths))
    if widths[first] > LIMITS["rigid_m"]:
        return None
    return float(known[first : first + count].mean()), float(widths[first])


def _lost(path: Array, away: _Away, rate: float, elsewhere: Flags) -> Flags:
    """(T,) whether a marker with the `path` (T, 3) m, which is `away` from its place and may be at
    another's (`elsewhere`), is lost.
    """
    off = away.most
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    step = np.nan_to_num(np.r_[step[:1], step], nan=np.inf)
    same = _held(path, rate)
    rests = _long(step < LIMITS["rests"] / rate, rate)
    # One coordinate that is cut off is told as such; the others are the marker's own.
    furthest = np.where(_cut_off(path, rate), LIMITS["away_m"], away.furthest)
    lost = (off > furthest) | ((rests | elsewhere) & (off > LIMITS["held_away_m"]))
    if away.alone:  # a joint moves it so far, but does not hold it there
        lost = (off > LIMITS["joint_away_m"]) | ((rests | elsewhere) & (off > LIMITS["away_m"]))
    odd = (off > (LIMITS["away_m"] if away.alone else LIMITS["same_away_m"])) | (
        away.own > LIMITS["one_away_m"]
    )
    for begin, end in zip(*runs(same), strict=True):
        # It is held all the while, also where its distances pass through what they were.
        if odd[begin:end].any():
            lost[begin:end] = True
    return _long(lost, rate)


def _held(path: Array, rate: float) -> Flags:
    """(T,) whether a marker with the `path` (T, 3) m is exactly where it was, for some time."""
    with np.errstate(invalid="ignore"):
        return _long(np.r_[False, (path[1:] == path[:-1]).all(axis=1)], rate)


def _cut_off(path: Array, rate: float) -> Flags:
    """(T,) whether one coordinate of a marker with the `path` (T, 3) m is exactly what it was, for
    some time, while another is not.
    """
    with np.errstate(invalid="ignore"):
        same = path[1:] == path[:-1]
    return _long(np.r_[False, same.any(axis=1) & ~same.all(axis=1)], rate)


def _long(flags: Flags, rate: float) -> Flags:
    """Only what lasts."""
    kept = flags.copy()
    for begin, end in zip(*runs(flags), strict=True):
        if end - begin < max(2, LIMITS["shortest_s"] * rate):
            kept[begin:end] = False
    return kept


def _merged(lost: Flags, away: _Away, path: Array, rate: float) -> list[tuple[int, int]]:
    """First frame and the one after the last of each time in which a marker is lost, with its way
    from the body and back: there even the nearest of the others is no longer as far as it was.
    """
    found: list[tuple[int, int]] = []
    off, leaves = away.most, np.maximum(away.most, away.own)
    margin = int(np.ceil(LIMITS["shortest_s"] * rate))
    for begin, end in zip(*runs(lost), strict=True):
        first, last = int(begin), int(end)
        while first > 0 and leaves[first - 1] > LIMITS["leaves_m"]:
            first -= 1
        while last < len(off) and leaves[last] > LIMITS["leaves_m"]:
            last += 1
        # Who does not leave in a jump was on its way already.
        if first < begin and _step(path, first) < LIMITS["leaves_m"]:
            first = max(first - margin, 0)
        if end < last < len(off) and _step(path, last) < LIMITS["leaves_m"]:
            last = min(last + margin, len(off))
        # The foot passes by the place where its marker stays.
        while (
            last < len(off) and np.linalg.norm(path[last] - path[last - 1]) < LIMITS["rests"] / rate
        ):
            last += 1
        if found and first - found[-1][1] < LIMITS["together_s"] * rate:
            first = found.pop()[0]
        found.append((first, last))
    # Who is lost shortly before the end does not come back.
    if found and len(found) and len(off) - found[-1][1] < LIMITS["together_s"] * rate:
        begin, end = found[-1]
        if end - begin > LIMITS["together_s"] * rate:
            found[-1] = begin, len(off)
    return found


def _step(path: Array, frame: int) -> float:
    """m from the frame before to this one; 0 where one of them is not seen."""
    return float(np.nan_to_num(np.linalg.norm(path[frame] - path[max(frame - 1, 0)])))
