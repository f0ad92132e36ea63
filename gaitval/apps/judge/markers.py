"""Marker errors: how far measured markers are from those of the model, by our own placing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gaitval.apps.judge.limits import LIMITS
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.mot import read_storage
from gaitval.mocap.recording import Recording
from gaitval.scaling.opensim.fields import child, flag, number, objects, read_document
from gaitval.scaling.opensim.model import OsimModel
from gaitval.scaling.opensim.placing import Motion, at_times, marker_places, place

RMS_COLUMN, LARGEST_COLUMN = "marker_error_RMS", "marker_error_max"
NEAREST, LIKELY = 0.001, 0.1
"""m, between which inverse kinematics leaves the markers of a person, RMS."""


@dataclass(frozen=True)
class ModelMarkerErrors:
    """Distances between measured and model markers.

    Attributes
    ----------
    time : (T,) s.
    rms, largest : (T,) m of each frame over its markers.
    names : markers; empty if only a log was read.
    distances : (T, M) m; NaN where a marker was not seen.
    """

    time: Array
    rms: Array
    largest: Array
    names: tuple[str, ...]
    distances: Array

    @property
    def whole_rms(self) -> float:
        """m, over all frames and markers, or over the frames of a log."""
        if self.names:
            return float(np.sqrt(np.nanmean(self.distances**2)))
        return float(np.sqrt((self.rms**2).mean()))

    @property
    def whole_largest(self) -> float:
        """Largest distance, m."""
        return float(np.nanmax(self.largest))


def placed_errors(
    model: OsimModel, motion: Motion, recording: Recording, used: Sequence[str] | None
) -> ModelMarkerErrors:
    """Errors of the frames of a `recording`, in the axes of the ground of `model`, that the
    `motion` covers; of the markers that inverse kinematics `used`, all that both have if None.
    Raises RecordError if model and recording share no marker, or no time.
    """
    both = [marker.name for marker in model.markers if marker.name in recording.names]
    names = tuple(name for name in both if used is None or name in used)
    if not names:
        raise RecordError(
            f"{recording.source}: none of its markers ({_few(recording.names)}) is on the model "
            f"({_few([marker.name for marker in model.markers])})"
            + (", or the set-up uses none of them" if both else "")
            + ". Give the markers that inverse kinematics was run on."
        )
    inside = (recording.time >= motion.time[0] - LIMITS.same_time) & (
        recording.time <= motion.time[-1] + LIMITS.same_time
    )
    if not inside.any():
        raise RecordError(
            f"{recording.source}: goes from {recording.time[0]:.3f} to {recording.time[-1]:.3f} s, "
            f"the motion from {motion.time[0]:.3f} to {motion.time[-1]:.3f} s. Give the markers "
            "of the same trial."
        )
    times = recording.time[inside]
    moved = at_times(motion, times)
    places = marker_places(model, place(model, moved.values), names)
    seen = np.stack([recording.marker(name)[inside] for name in names], axis=1)
    distances = np.linalg.norm(seen - places, axis=2)
    # A frame without any marker has no error, not a small one.
    known = np.isfinite(distances).any(axis=1)
    if not known.any():
        raise RecordError(f"{recording.source}: no marker of the model is seen in the motion.")
    distances, times = distances[known], times[known]
    return ModelMarkerErrors(
        time=times,
        rms=np.sqrt(np.nanmean(distances**2, axis=1)),
        largest=np.nanmax(distances, axis=1),
        names=names,
        distances=distances,
    )


def logged_errors(path: Path) -> ModelMarkerErrors:
    """Errors that OpenSim's inverse kinematics reported in `path` (`…_ik_marker_errors.sto`).
    Raises RecordError if it is not such a file.
    """
    table = read_storage(path)
    missing = [name for name in (RMS_COLUMN, LARGEST_COLUMN) if name not in table.columns]
    if missing:
        raise RecordError(
            f"{path}: lacks {' and '.join(missing)}. Give the file that inverse kinematics writes "
            "with report_errors (…_ik_marker_errors.sto)."
        )
    rms, largest = table.column(RMS_COLUMN), table.column(LARGEST_COLUMN)
    if not (np.isfinite(rms).all() and np.isfinite(largest).all()):
        raise RecordError(f"{path}: an error is not a number. Run inverse kinematics again.")
    usual = float(np.median(rms))
    for unit, metres in (("cm", 0.01), ("mm", 0.001)):
        if usual > LIMITS.farthest_marker and NEAREST < usual * metres < LIKELY:
            raise RecordError(
                f"{path}: the RMS error is {usual:.3g} m in the median, which no marker has; it "
                f"looks like {unit}. OpenSim's log is in m: divide its columns by "
                f"{1 / metres:.0f}."
            )
    return ModelMarkerErrors(table.time, rms, largest, (), np.empty((len(rms), 0)))


def difference(ours: ModelMarkerErrors, logged: ModelMarkerErrors) -> tuple[float, int]:
    """Largest difference, m, of a frame's RMS or largest error in `ours` from that in `logged`, and
    the number of frames that both have; NaN and 0 if they share none.
    """
    # The first logged frame that is not earlier, within the rounding of the file's times.
    index = np.searchsorted(logged.time, ours.time - LIMITS.same_time)
    index = np.minimum(index, len(logged.time) - 1)
    same = np.abs(logged.time[index] - ours.time) <= LIMITS.same_time
    if not same.any():
        return float("nan"), 0
    apart = [
        np.abs(mine[same] - theirs[index[same]]).max()
        for mine, theirs in ((ours.rms, logged.rms), (ours.largest, logged.largest))
    ]
    return float(max(apart)), int(same.sum())


def used_markers(path: Path) -> tuple[str, ...]:
    """Markers that a set-up of inverse kinematics (`path`) applies with a weight above zero. Raises
    ModelError if it is not such a set-up.
    """
    tool = child(read_document(path), "InverseKinematicsTool", path)
    tasks = [one for one in objects(tool, "IKTaskSet") if one.tag == "IKMarkerTask"]
    return tuple(
        one.get("name", "")
        for one in tasks
        if flag(one, "apply", default=True)
        and number(one, "weight", f"{path}: {one.get('name', '')}", default=1.0) > 0.0
    )


def by_marker(errors: ModelMarkerErrors) -> Mapping[str, tuple[float, float, float, float]]:
    """Of each marker in `errors`: RMS and largest error m, time of it s, share of frames seen."""
    found = {}
    for column, name in enumerate(errors.names):
        one = errors.distances[:, column]
        seen = np.isfinite(one)
        if seen.any():
            worst = int(np.nanargmax(one))
            rms = float(np.sqrt((one[seen] ** 2).mean()))
            found[name] = (rms, float(one[worst]), float(errors.time[worst]), float(seen.mean()))
    return found


def _few(names: Sequence[str]) -> str:
    return (", ".join(names[:6]) + (" …" if len(names) > 6 else "")) or "none"
