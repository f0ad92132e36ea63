"""Marker errors: how far measured markers are from those of the model, by our own placing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaitval.apps.judge.limits import LIMITS
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording
from gaitval.scaling.opensim.model import OsimModel
from gaitval.scaling.opensim.placing import Motion, at_times, marker_places, place


@dataclass(frozen=True)
class ModelMarkerErrors:
    """Distances between measured and model markers.

    Attributes
    ----------
    time : (T,) s.
    names : markers.
    distances : (T, M) m; NaN where a marker was not seen.
    """

    time: Array
    names: tuple[str, ...]
    distances: Array

    @property
    def whole_rms(self) -> float:
        """m, over all frames and markers."""
        return float(np.sqrt(np.nanmean(self.distances**2)))

    @property
    def whole_largest(self) -> float:
        """Largest distance, m."""
        return float(np.nanmax(self.distances))


def placed_errors(model: OsimModel, motion: Motion, recording: Recording) -> ModelMarkerErrors:
    """Errors of the frames of a `recording`, in the axes of the ground of `model`, that the
    `motion` covers; of the markers that both have. Raises RecordError if model and recording share
    no marker, or no time.
    """
    names = tuple(marker.name for marker in model.markers if marker.name in recording.names)
    if not names:
        raise RecordError(
            f"{recording.source}: none of its markers ({_few(recording.names)}) is on the model "
            f"({_few([marker.name for marker in model.markers])}). Give the markers that inverse "
            "kinematics was run on."
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
        names=names,
        distances=distances,
    )


def by_marker(errors: ModelMarkerErrors) -> dict[str, dict[str, float]]:
    """Of each marker in `errors`: RMS and largest error m, time of it s, share of frames seen."""
    found = {}
    for column, name in enumerate(errors.names):
        one = errors.distances[:, column]
        seen = np.isfinite(one)
        if seen.any():
            worst = int(np.nanargmax(one))
            found[name] = {
                "rms_m": float(np.sqrt((one[seen] ** 2).mean())),
                "largest_m": float(one[worst]),
                "at_s": float(errors.time[worst]),
                "seen": float(seen.mean()),
            }
    return found


def _few(names: Sequence[str]) -> str:
    return (", ".join(names[:6]) + (" …" if len(names) > 6 else "")) or "none"
