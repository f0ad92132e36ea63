"""Markers that change places within a trial, and labels with left and right exchanged."""

from collections.abc import Mapping
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from gaitval.arrays import Array, runs
from gaitval.errors import RecordError
from gaitval.mocap.foot_markers import facing
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import Repair, repair
from gaitval.mocap.spikes import jump_tolerance, surprise_of

LIMITS: Final[Mapping[str, float]] = {
    # Share of a trial. Labels that are another marker's for less than this are corrected;
    # otherwise it is unclear which part is right.
    "ambiguous_share": 0.25,
    # s. In this time the line between two markers of a segment turns far less than the half
    # turn that an exchange causes (the shank turns at up to 400 deg/s).
    "longest_hidden_swap": 0.2,
    # m by which a left marker may be on the right of its partner in the median frame:
    # runners' toes are by 8 mm (Hamner et al. 2010). Exchanged labels are by the width of a
    # step or a joint.
    "on_one_line_m": 0.02,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""
ARMS: Final = frozenset(
    ("torso", *(f"{part}_{side}" for part in ("upper_arm", "forearm") for side in "rl"))
)
"""Segments whose markers no leg needs."""
INNER: Final = ("Medial", "MT1")
"""Landmarks at the inside of legs, which are on the other's side where steps are narrow."""


def exchange_back(
    recording: Recording, markers: Array, segments: Mapping[str, str]
) -> list[Repair]:
    """Undo exchanges of trajectories within the trial: a finding for each part that was exchanged
    back.

    `recording` has names and rate; `markers` (T, M, 3) m, NaN where not seen, are changed in place;
    `segments` has the segment of the body model of each marker. Raises RecordError if a label is
    another marker's for so long that it is unclear which part is right.
    """
    names, count = recording.names, markers.shape[1]
    # The column that each path is in, frame by frame; named after its first one.
    columns = np.tile(np.arange(count), (len(markers), 1))
    paths = markers.copy()
    for frame, before, which in _candidates(recording, markers, segments):
        held = np.flatnonzero(np.isin(columns[frame], which))
        order = _order(paths, frame, before, held)
        paths[frame:] = paths[frame:][:, order]
        columns[frame:] = columns[frame:][:, order]
    usual = np.array([np.bincount(each).argmax() for each in columns.T])
    off = columns != usual
    if off.mean() and off.mean(axis=0).max() > LIMITS["ambiguous_share"]:
        path = int(off.mean(axis=0).argmax())
        frame = int(np.flatnonzero(np.diff(columns[:, path]))[0]) + 1
        pair = " and ".join(names[i] for i in sorted(set(columns[frame - 1 : frame + 1, path])))
        raise RecordError(
            f"{recording.source}: markers {pair} change places at frame {frame} "
            f"({recording.start + frame / recording.marker_rate:.3f} s), so it is unclear whether "
            "the labels are right before or after it. Correct the labels of the wrong part in the "
            "recording program, or cut the trial there."
        )
    markers[:, usual] = paths
    found: dict[tuple[int, int], list[str]] = {}
    for moved in np.flatnonzero(off.any(axis=0)):
        for begin, end in zip(*runs(off[:, moved]), strict=True):
            found.setdefault((int(begin), int(end)), []).append(names[usual[moved]])
    return [
        repair(recording, "swap", sorted(who), *when, "trajectories exchanged back")
        for when, who in found.items()
    ]


def _candidates(
    recording: Recording, markers: Array, segments: Mapping[str, str]
) -> list[tuple[int, int, tuple[int, ...]]]:
    """Frames at which markers may take each other's place, in order of time, the frame before in
    which they were seen, and which they are: those that leave their paths in one frame, or two of a
    segment that vanish for a moment, between which the line is reversed.
    """
    rate = recording.marker_rate
    jumped = np.stack(
        [
            surprise_of(markers[:, i]) > jump_tolerance(markers[:, i], rate)
            for i in range(markers.shape[1])
        ],
        axis=1,
    )
    found = [
        (int(frame), int(frame) - 1, tuple(np.flatnonzero(jumped[frame]).tolist()))
        for frame in np.flatnonzero(jumped.sum(axis=1) >= 2)
    ]
    longest = round(LIMITS["longest_hidden_swap"] * rate) + 1
    for pair in combinations(range(markers.shape[1]), 2):
        of = {segments.get(recording.names[i]) for i in pair}
        if len(of) == 1 and of != {None}:
            line = markers[:, pair[0]] - markers[:, pair[1]]
            shown = np.flatnonzero(np.isfinite(line).all(axis=1))
            gaps = np.flatnonzero((np.diff(shown) > 1) & (np.diff(shown) <= longest))
            found += [(int(shown[i + 1]), int(shown[i]), pair) for i in gaps]
    return sorted(found)


def _order(paths: Array, frame: int, before: int, which: NDArray[np.int64]) -> list[int]:
    """The columns that the `paths` (T, M, 3) m go on in from a `frame` on, if `which` of them were
    last seen in the frame `before`.
    """
    last, now = paths[before, which], paths[frame, which]
    if frame - before == 1:  # where they would be if they kept their velocities
        last = 2.0 * last - paths[before - 1, which]
    else:  # they may have moved far, but not turned about each other
        last, now = last - last.mean(axis=0), now - now.mean(axis=0)
    away = np.linalg.norm(last[:, None] - now, axis=2)
    order = np.arange(paths.shape[1])
    if np.isfinite(away).all():
        own, taken = linear_sum_assignment(away)
        # After an exchange each is where another was; two spikes do not meet this.
        if (away[own, taken] < 0.5 * away[own, own])[own != taken].all():
            order[which] = which[taken]
    return order.tolist()


def mirrored_arms(
    recording: Recording, segments: Mapping[str, str], landmarks: Mapping[str, str]
) -> list[tuple[str, str]]:
    """Left and right markers of `ARMS` that have each other's names throughout; which of them is
    which is plain, and no leg needs them.

    `recording` has z up, m; `segments` of the body model are by marker; `landmarks`, see
    `foot_markers`, show where the person faces. Raises RecordError if those of a leg or the pelvis
    are exchanged, so the file may be mirrored, or the direction the person faces is unknown.
    """
    forward = facing(recording, landmarks)
    leftward = np.array([-forward[1], forward[0], 0.0])
    wrong = []
    for at, left in landmarks.items():
        right = landmarks.get(f"R.{at[2:]}", "")
        if not at.startswith("L.") or at.endswith(INNER) or not {left, right} <= {*recording.names}:
            continue
        apart = (recording.marker(left) - recording.marker(right)) @ leftward
        apart = apart[np.isfinite(apart)]
        # Legs may cross for a moment, but not in the median of all frames; runners and people whose
        # legs scissor land on one line, where markers are a little across it.
        if len(apart) and np.median(apart) < -LIMITS["on_one_line_m"]:
            wrong.append((left, right))
    if not {segments.get(name) for pair in wrong for name in pair} <= ARMS:
        pairs = "; ".join(f"{left} and {right}" for left, right in wrong)
        raise RecordError(
            f"{recording.source}: left and right are exchanged for {pairs}: seen in the direction "
            "that the person faces, the markers labelled left are on the right in most frames. "
            "Exchange these labels in the recording program and export the trial again; if all "
            "markers are listed, the file is mirrored: its axes must be right-handed."
        )
    return wrong
