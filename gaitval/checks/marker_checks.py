"""Whether trajectories are those of markers that cameras saw, and whether the markers of feet
are in walking where they are in standing.

The limits were measured on the recordings named in `force_checks`.
"""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array, runs
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.lost_frames import lost_frames, lost_text
from gaitval.mocap.recording import Recording

LARGEST_NOISE: Final = 0.004
"""m, standard deviation of each coordinate: at most 0.2 mm. In the single cycles of a made-up walk
4 mm move angles by 1.3 degrees and moments by 0.06 Nm/kg, in proportion."""
DIFFERENCES: Final = 4
"""Order of the differences of frames that leave noise and little motion: what moves at 5 Hz is an
eighth of itself at 50 Hz, and a hundredth at 100 Hz."""
DIFFERENCES_NOISE: Final = 70.0**0.5
"""By what they enlarge noise: the root of the sum of the squares of 1, 4, 6, 4 and 1."""
MEDIAN_TO_SD: Final = 1.4826
"""Standard deviation of a normal distribution over the median of its absolute values."""

STUCK_SECONDS: Final = 0.05
"""A coordinate that repeats itself for longer while the marker moves on is cut off there: at most
0.01 s (a single frame)."""
STUCK_FRAMES: Final = 5
STUCK_TRAVEL: Final = 0.02
"""m that the marker moves meanwhile."""
COARSE: Final = 1e-4
"""m. Files rounded more coarsely are not checked: at a turning point, a coordinate that swings by
2 cm once a second is within half a millimetre for 0.07 s, and within 0.05 mm for 0.02 s."""

STRAIGHT_SECONDS: Final = 0.08
"""A path that is exactly straight, at constant speed, for longer was filled in; noise of 0.1 mm
bends that of every marker that was seen from frame to frame."""
STRAIGHT_FRAMES: Final = 8
STRAIGHT_BEND: Final = 0.05
"""m/s². Half of a hundredth of gravity, and at 100 Hz five times the rounding of files in mm."""

LARGEST_HEIGHT_CHANGE: Final = 0.02
"""m. When a foot is flat, each of its markers is as high as in standing, but for what the floor of
the two trials differs by: within 8 mm."""
LARGEST_ASYMMETRY: Final = 0.014
"""m, by which such a change of one foot's marker, beside the foot's other markers, may differ from
that of the other foot: at most 5 mm in 21 public recordings, 11 mm in the walk of Rajagopal et al.
2016 and 8 mm in a natural walk of the OpenCap validation. A head of a metatarsal that is 12 mm
lower in standing turns the subtalar joint by 3 degrees."""
SPINES: Final = ("R.ASIS", "L.ASIS", "R.PSIS", "L.PSIS")
LARGEST_TWIST: Final = 0.005
"""m, change of the right rear spine's distance from the plane of the other three: at most 1.8 mm in
ten walks of eight people."""
LARGEST_STRETCH: Final = 0.01
"""Change of the distance from a knee's to an ankle's lateral marker, that of the leg in which it
changes less: at most 0.4 % in nine walks of seven people."""
FLAT_PERCENTILE: Final = 15.0
"""Of a marker's height over the trial: a foot is flat for a quarter of the stride or more."""
FEWEST_MARKERS: Final = 4
NAMED: Final = 3
"""Markers that a warning names; if there are more it gives their number."""
_ON_FEET: Final = ("Heel", "Ankle", "MT1", "MT2", "MT5", "Toe")


def trajectory_warnings(recording: Recording) -> Iterator[QualityFlag]:
    """Warnings about markers whose trajectories cannot be as the cameras saw them: one about frames
    that were lost or are there twice, one about noise, each for all markers together, and one for
    each marker with a stuck coordinate. `recording` is as read, in the axes of its file, along
    which coordinates are cut off or repeated.
    """
    yield from _lost(recording)
    yield from _straight(recording)
    noise = _noise(recording)
    noisy = [name for name in noise if noise[name] > LARGEST_NOISE]
    if noisy:
        worst = max(noisy, key=lambda name: noise[name])
        where = ", ".join(noisy) if len(noisy) <= NAMED else f"{len(noisy)} of {len(noise)} markers"
        yield QualityFlag(
            "noise", where, noise[worst], LARGEST_NOISE, "m",
            f"from frame to frame {worst} scatters by {1000 * noise[worst]:.1f} mm (cameras: below "
            f"1 mm; at most {1000 * LARGEST_NOISE:.0f} mm): angles and moments of single cycles "
            "are off. Look at the calibration of the cameras, or the reconstruction",
        )  # fmt: skip
    for number, name in enumerate(recording.names):
        path = recording.markers[:, number]
        seconds = _longest_stuck(path, recording.marker_rate) / recording.marker_rate
        if seconds > 0.0:
            yield QualityFlag(
                "stuck coordinate", name, seconds, STUCK_SECONDS, "s",
                f"one of its coordinates stays exactly the same for {seconds:.2f} s while the "
                "marker moves on: the trajectory was cut off at the edge of the volume, or filled. "
                "Look at the trajectory in the recording program",
            )  # fmt: skip


def _straight(recording: Recording) -> Iterator[QualityFlag]:
    """Markers whose path is an exact straight line for a while, as no marker's of a person is."""
    rate = recording.marker_rate
    least = max(STRAIGHT_FRAMES, round(STRAIGHT_SECONDS * rate))
    found: dict[str, float] = {}
    bent = np.full(recording.markers.shape[:2], np.nan)
    bent[1:-1] = np.linalg.norm(np.diff(recording.markers, n=2, axis=0), axis=2)
    exact = bent < STRAIGHT_BEND * (1.0 / rate) ** 2
    # Something that moves as one, without a person's accelerations, is no person.
    if np.nanmean(exact[np.isfinite(bent)]) > 0.5:
        return
    for number, name in enumerate(recording.names):
        path = recording.markers[:, number]
        for begin, end in zip(*runs(exact[:, number]), strict=True):
            moved = np.linalg.norm(path[end - 1] - path[begin])
            if end - begin >= least and moved > STUCK_TRAVEL:
                found[name] = found.get(name, 0.0) + (end - begin) / rate
    for name, seconds in found.items():
        yield QualityFlag(
            "straight line", name, seconds, STRAIGHT_SECONDS, "s",
            f"its path is an exact straight line for {seconds:.2f} s in all, as no marker's on a "
            "person is: a gap was filled so before the file was written, and the angles of its "
            "segment are wrong there. Export the trial with the gaps left open",
        )  # fmt: skip


def _lost(recording: Recording) -> Iterator[QualityFlag]:
    """All places where frames are missing or too many."""
    lost = lost_frames(recording.markers)
    rate = recording.marker_rate
    parts = [
        f"before frame {at} ({recording.start + at / rate:.3f} s) {lost_text(frames)}"
        for at, frames in lost[:NAMED]
    ]
    if len(lost) > NAMED:
        parts.append(f"and so {len(lost) - NAMED} × more")
    if lost:
        late = sum(frames for _, frames in lost) / rate
        yield QualityFlag(
            "lost frames", "all markers", abs(late), 0.0, "s",
            f"{'; '.join(parts)}: the times after it are wrong, and forces that lost nothing come "
            f"{1000 * abs(late):.0f} ms {'later' if late > 0.0 else 'earlier'} than the markers "
            "from there to the end. Export the trial again, or use a part of it (--trial-time)",
        )  # fmt: skip


def _noise(recording: Recording) -> dict[str, float]:
    """Standard deviation of a coordinate of each marker, m; those without enough frames left out.

    The median is that of most frames, so a heel that strikes the ground is not taken for noise.
    """
    if len(recording.markers) <= DIFFERENCES:
        return {}
    wander = np.abs(np.diff(recording.markers, n=DIFFERENCES, axis=0)) / DIFFERENCES_NOISE
    found = {}
    for number, name in enumerate(recording.names):
        own = wander[:, number][np.isfinite(wander[:, number]).all(axis=1)]
        if len(own):
            # Root mean square over the three coordinates.
            found[name] = float(MEDIAN_TO_SD * np.sqrt((np.median(own, axis=0) ** 2).mean()))
    return found


def _longest_stuck(path: Array, rate: float) -> int:
    """Frames for which a coordinate repeats itself while the marker moves on, 0 if they are few."""
    longest = 0
    for column in range(3):
        # NaN in front keeps the length: change t is that from frame t − 1 to t.
        changes = np.abs(np.diff(path[:, column], prepend=np.nan))
        if COARSE < changes[changes > 0.0].min(initial=np.inf) < np.inf:
            continue
        same = changes == 0.0
        for begin, end in zip(*runs(same), strict=True):
            enough = end - begin > max(STUCK_SECONDS * rate, STUCK_FRAMES)
            if enough and np.ptp(path[begin:end], axis=0).max() > STUCK_TRAVEL:
                longest = max(longest, int(end - begin))
    return longest


def foot_marker_warnings(
    standing: Recording, walking: Recording, landmarks: Mapping[str, str]
) -> Iterator[QualityFlag]:
    """Warnings about foot markers that are higher or lower in the walk's flat foot than in
    standing: one for each marker beyond `LARGEST_HEIGHT_CHANGE`; if there is none, one for the pair
    beyond `LARGEST_ASYMMETRY`. `standing` and `walking` are in the project's axes (REP-103, z up);
    `landmarks` are as in `foot_markers`.
    """
    changes = _height_changes(standing, walking, landmarks)
    if len(changes) < FEWEST_MARKERS:
        return
    # Another height of the floor moves all markers alike, so the median change takes it out.
    floor = float(np.median(list(changes.values())))
    moved = {mark: change - floor for mark, change in changes.items()}
    far = [mark for mark, change in moved.items() if abs(change) > LARGEST_HEIGHT_CHANGE]
    for mark in far:
        size = abs(moved[mark])
        yield QualityFlag(
            "height of a foot's marker", landmarks[mark], size, LARGEST_HEIGHT_CHANGE, "m",
            f"with the foot flat it is {1000 * size:.0f} mm "
            f"{'higher' if moved[mark] > 0.0 else 'lower'} in walking than in standing (elsewhere "
            f"within {1000 * LARGEST_HEIGHT_CHANGE:.0f} mm): it has moved or is mislabelled in "
            "one of the trials, or the foot is never put down flat",
        )  # fmt: skip
    # A marker that is reported already would make the feet asymmetric, too.
    if not far:
        yield from _asymmetry(changes, landmarks)


def pelvis_marker_warnings(
    standing: Recording, walking: Recording, landmarks: Mapping[str, str]
) -> Iterator[QualityFlag]:
    """A warning if the four spines of the pelvis are twisted otherwise in the walk than in
    standing. A spine's marker that is put up or down leaves all distances as they are: they lie
    nearly in a plane. `landmarks` are as in `foot_markers`.
    """
    names = [landmarks.get(mark, "") for mark in SPINES]
    if not all(name in trial.names for name in names for trial in (standing, walking)):
        return
    stood, walked = (_off_plane(*(trial.marker(n) for n in names)) for trial in (standing, walking))
    if stood is None or walked is None or abs(walked - stood) <= LARGEST_TWIST:
        return
    size = abs(walked - stood)
    front, rear = (
        float(np.nanmedian(np.linalg.norm(standing.marker(one) - standing.marker(two), axis=1)))
        for one, two in (names[:2], names[2:])
    )
    yield QualityFlag(
        "twist of the pelvis", ", ".join(names), size, LARGEST_TWIST, "m",
        f"{names[2]} is {1000 * size:.0f} mm nearer to, or farther from, the plane of the other "
        "three in walking than in standing (elsewhere within "
        f"{1000 * LARGEST_TWIST:.0f} mm): one of the four has moved between the trials, by about "
        f"{1000 * size:.0f} mm at the rear or {1000 * size * front / rear:.0f} mm at the front, "
        "up or down. Tilt, list and the hips' angles are some degrees off. Record both with the "
        "markers untouched",
    )  # fmt: skip


def scale_warnings(
    standing: Recording, walking: Recording, landmarks: Mapping[str, str]
) -> Iterator[QualityFlag]:
    """A warning if both legs are longer, or shorter, from knee to ankle in the walk than in
    standing: no marker that moves does so on both sides. `landmarks` are as in `foot_markers`.
    """
    changes = []
    for side in "RL":
        names = [landmarks.get(f"{side}.{part}", "") for part in ("Knee", "Ankle")]
        if not all(name in trial.names for name in names for trial in (standing, walking)):
            return
        lengths = []
        for trial in (standing, walking):
            apart = np.linalg.norm(trial.marker(names[0]) - trial.marker(names[1]), axis=1)
            apart = apart[np.isfinite(apart)]
            if not len(apart):
                return
            lengths.append(float(np.median(apart)))
        changes.append(lengths[1] / lengths[0] - 1.0)
    least = min(changes, key=abs)
    if changes[0] * changes[1] > 0.0 and abs(least) > LARGEST_STRETCH:
        mean = 100 * float(np.mean(changes))
        yield QualityFlag(
            "scale of the trials", "both legs", abs(least), LARGEST_STRETCH, "1",
            f"from knee to ankle they are {abs(mean):.1f} % {'longer' if mean > 0 else 'shorter'} "
            "in walking than in standing (elsewhere within "
            f"{100 * LARGEST_STRETCH:.0f} %): the two trials have another scale, at least along "
            "the vertical. Look at the calibration of the cameras and the length of its wand, and "
            "that both trials are of one session and one person",
        )  # fmt: skip


def _off_plane(right: Array, left: Array, rear: Array, other_rear: Array) -> float | None:
    """m, median over a trial of the signed distance of the right rear spine (T, 3) from the plane
    of the three others; None if they are never seen together.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        normal = np.cross(left - right, other_rear - right)
        off = ((rear - right) * normal).sum(axis=1) / np.linalg.norm(normal, axis=1)
    off = off[np.isfinite(off)]
    return float(np.median(off)) if len(off) else None


def _height_changes(
    standing: Recording, walking: Recording, landmarks: Mapping[str, str]
) -> dict[str, float]:
    """How much higher each landmark of the feet is in the walk's flat foot than in standing, m."""
    changes = {}
    for landmark, name in landmarks.items():
        shown = name in standing.names and name in walking.names
        if shown and landmark.rpartition(".")[2] in _ON_FEET:
            stood, walked = (
                heights[np.isfinite(heights)]
                for heights in (standing.marker(name)[:, 2], walking.marker(name)[:, 2])
            )
            if len(stood) and len(walked):
                flat = np.percentile(walked, FLAT_PERCENTILE)
                changes[landmark] = float(flat - np.median(stood))
    return changes


def _asymmetry(changes: Mapping[str, float], landmarks: Mapping[str, str]) -> Iterator[QualityFlag]:
    """The landmark whose height changes most differently in the two feet, if that is too much."""
    # Keys without the side, so that the feet compare; the median of a foot's other markers takes
    # out the floor. With the marker itself among them, one of two would hide half of its change.
    beside = {
        side: {
            mark[2:]: change - float(np.median([own[other] for other in own if other != mark]))
            for mark, change in own.items()
            if len(own) > 1
        }
        for side in "RL"
        for own in [{mark: change for mark, change in changes.items() if mark[0] == side}]
    }
    both = beside["R"].keys() & beside["L"].keys()
    if not both:
        return
    part = max(sorted(both), key=lambda part: abs(beside["R"][part] - beside["L"][part]))
    right, left = (beside[side][part] for side in "RL")
    if abs(right - left) > LARGEST_ASYMMETRY:
        # Of two markers each is beside the other, and either may have moved.
        either = sorted(both) if len(both) == 2 else [part]
        where = [" and ".join(landmarks[f"{side}.{part}"] for side in "RL") for part in either]
        yield QualityFlag(
            "height of a foot's marker", ", or ".join(where), abs(right - left),
            LARGEST_ASYMMETRY, "m",
            "from standing to the flat foot of the walk they rise by "
            f"{round(1000 * right)} and {round(1000 * left)} mm beside the rest of their feet "
            f"(elsewhere within {1000 * LARGEST_ASYMMETRY:.0f} mm of each other): one of them has "
            "moved or is mislabelled in one of the trials, or one foot is never put down flat",
        )  # fmt: skip
