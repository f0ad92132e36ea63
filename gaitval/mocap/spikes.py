"""Whether a marker leaves its path; frames in which it does so for a moment are cut."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.errors import count_of
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import Repair, repair, seen_frames

LIMITS: Final[Mapping[str, float]] = {
    # s. A marker that returns later than this is not a spike; it was somewhere else.
    "longest_spike": 0.05,
    # s. In this time the line between two markers of a segment turns far less than the half
    # turn that an exchange causes (the shank turns at up to 400 deg/s).
    "longest_hidden_s": 0.2,
    # After a spike the marker returns to where its earlier velocity would have taken it, to
    # within this fraction of the spike's size. Velocity changes during a spike, so much less
    # cannot be required.
    "returned": 0.4,
    # m/s². No marker of a walking person exceeds this between neighbouring frames: the
    # largest is 153 in the walks of Rajagopal et al. 2016 (toe, 100 Hz) and 128 in WBDS at
    # 1.26 m/s, both mostly noise, for which `jump_noise` is added.
    "largest_acceleration": 150.0,
    # m. What camera noise may add to a second difference (2.4 times the noise itself).
    "jump_noise": 0.006,
    # In a noisy trial its own noise is used instead: this many medians of a marker's second
    # differences, which is 6 standard deviations of noise in three directions and so never
    # exceeded.
    "noise_multiple": 4.0,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""


def jump_tolerance(path: Array, rate: float, frames: int = 1) -> float:
    """Largest distance, m, that a marker with the `path` (T, 3) m, NaN where not seen, at `rate` Hz
    may be from where its velocity, extrapolated over so many `frames`, would take it.
    """
    usual = surprise_of(path)
    # 0 stands for unknown.
    usual = usual[usual > 0.0]
    noise = LIMITS["noise_multiple"] * float(np.median(usual)) if len(usual) else 0.0
    # Over a time step dt an acceleration a makes a second difference of a dt².
    return max(LIMITS["jump_noise"], noise) + LIMITS["largest_acceleration"] * (frames / rate) ** 2


def surprise_of(path: Array) -> Array:
    """Distance (T,) m of a marker with the `path` (T, 3) m, NaN where not seen, from where its last
    velocity points; 0 where this frame or one of the two before it is not seen.
    """
    distance = np.zeros(len(path))
    if len(path) > 2:
        # Second difference: x₂ less its extrapolation x₁ + (x₁ − x₀).
        distance[2:] = np.linalg.norm(path[2:] - 2.0 * path[1:-1] + path[:-2], axis=1)
    return np.nan_to_num(distance)


def cut_spikes(
    recording: Recording, markers: Array, segments: Mapping[str, str]
) -> tuple[list[Repair], Flags]:
    """Turn frames in which a marker briefly leaves its path into gaps, and find those from which
    markers do not return: all that jump at the same frames are one finding.

    Parameters
    ----------
    recording : for names, rate and the times of findings.
    markers : (T, M, 3) m, changed in place; NaN where not seen.
    segments : that of the body model by marker.

    Returns
    -------
    tuple
        Findings of spikes and of jumps that remain, and (T, M) True in frames that were cut.
    """
    rate = recording.marker_rate
    findings = []
    spiked = np.zeros(markers.shape[:2], dtype=bool)
    surprise = np.zeros(markers.shape[:2])
    jumped = np.zeros(markers.shape[:2], dtype=bool)
    for column, name in enumerate(recording.names):
        path = markers[:, column]
        for begin, end, away in _spikes(path, rate):
            path[begin:end] = np.nan
            spiked[begin:end, column] = True
            action = f"up to {1000 * away:.0f} mm off its path; removed"
            findings.append(repair(recording, "spike", [name], begin, end, action))
        # A jump that is left when the spikes are cut does not come back.
        surprise[:, column] = surprise_of(path)
        jumped[:, column] = surprise[:, column] > jump_tolerance(path, rate)
    jumped |= _turned_round(recording, markers, segments)
    places: dict[tuple[str, ...], list[int]] = {}
    for frame in np.flatnonzero(jumped.any(axis=1)):
        names = (name for name, off in zip(recording.names, jumped[frame], strict=True) if off)
        places.setdefault(tuple(names), []).append(int(frame))
    for together, frames in places.items():
        action = (
            f"off their paths by up to {1000 * surprise[frames].max():.0f} mm in "
            f"{count_of(len(frames), 'frame')}, and not back; left as they are: another marker has "
            "the label from there on, or the marker was moved; if it is most of them, frames are "
            "missing or are there twice"
        )
        findings.append(repair(recording, "jump", together, frames[0], frames[-1] + 1, action))
    return findings, spiked


def _turned_round(recording: Recording, markers: Array, segments: Mapping[str, str]) -> Flags:
    """(T, M) whether a marker is seen again after a short gap, but the line between it and another
    of its segment points the other way: they have each other's names.
    """
    found = np.zeros(markers.shape[:2], dtype=bool)
    longest = round(LIMITS["longest_hidden_s"] * recording.marker_rate) + 1
    for pair in combinations(range(markers.shape[1]), 2):
        of = {segments.get(recording.names[i]) for i in pair}
        if len(of) != 1 or of == {None}:
            continue
        line = markers[:, pair[0]] - markers[:, pair[1]]
        shown = np.flatnonzero(seen_frames(line))
        before, after = shown[:-1], shown[1:]
        hidden = (after - before > 1) & (after - before <= longest)
        turned = (line[before] * line[after]).sum(axis=1) < 0.0
        found[np.ix_(after[hidden & turned], pair)] = True
    return found


def _spikes(path: Array, rate: float) -> list[tuple[int, int, float]]:
    """First frame, frame after the last, and largest distance from the path (m) of each spike."""
    longest = max(1, round(LIMITS["longest_spike"] * rate))
    # by the number of frames over which a velocity is extrapolated
    allowed = [jump_tolerance(path, rate, frames) for frames in range(longest + 2)]
    path = path.copy()
    found = []
    # forwards, then backwards for spikes that the start of the trial or of a block hides
    for reverse in (False, True):
        # A view, so that a spike found forwards is a gap for the search backwards.
        view = path[::-1] if reverse else path
        for frame in np.flatnonzero(surprise_of(view) > allowed[1]):
            spike = _spike_at(view, int(frame), allowed)
            if spike is not None:
                begin, end, away = spike
                view[begin:end] = np.nan
                found.append((len(path) - end, len(path) - begin, away) if reverse else spike)
    return found


def _spike_at(path: Array, frame: int, allowed: Sequence[float]) -> tuple[int, int, float] | None:
    """The shortest spike that begins at a frame in which the marker jumped."""
    seen = seen_frames(path[frame - 2 : frame + len(allowed)])
    if not seen[:3].all():
        return None  # a spike that ended here has become a gap
    base, velocity = path[frame - 1], path[frame - 1] - path[frame - 2]
    for length in range(1, len(allowed) - 1):
        back = frame + length
        steps = np.arange(1, length + 1)[:, None]
        # from a path that continues as before
        away = float(np.linalg.norm(path[frame:back] - base - steps * velocity, axis=1).max())
        # Not seen afterwards, so nothing shows that the marker really was there.
        if back >= len(path) or not seen[length + 2]:
            return frame, back, away
        # From the base frame to the return there are length + 1 steps.
        miss = float(np.linalg.norm(path[back] - base - (length + 1) * velocity))
        if miss < min(LIMITS["returned"] * away, allowed[length + 1]):
            return frame, back, away
    return None
