"""Forces of another file than the markers': put together, if they can be of the same trial."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import certain_load, plate_or_fault
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.repairs import passed_over
from gaitval.units import SPREAD

LIMITS: Final[Mapping[str, float]] = {
    # Markers and forces of one trial end within this time of each other, s; exports differ
    # by a frame.
    "largest_mismatch_s": 0.1,
    # Forces at less than half of the markers' rate are not those that were recorded.
    "least_ratio": 0.5,
    # s. A shorter time that markers and forces share has no gait cycle.
    "shortest_s": 0.6,
    # The centre of pressure is at most this far outside the volume that the markers fill, m.
    "largest_distance_m": 1.0,
    # Mean cosine, under load, of the angle between the force and the line from its point to
    # the middle of the markers. In walking it is above 0.9.
    "smallest_cosine": 0.7,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""


def during(
    plates: tuple[Plate, ...], rate: float, start: float, recording: Recording
) -> tuple[tuple[Plate, ...], float]:
    """The plates in the time of the recording, and the time of their first sample, s."""
    time = start + np.arange(len(plates[0].force)) / rate
    step = 0.5 / rate
    end = recording.start + len(recording.markers) / recording.marker_rate
    inside = np.flatnonzero((time > recording.start - step) & (time < end - step))
    if not len(inside):  # `with_plates` says where they are
        return plates, start
    first, last = int(inside[0]), int(inside[-1]) + 1
    return tuple(plate.during(slice(first, last)) for plate in plates), float(time[first])


def with_plates(
    recording: Recording, path: Path, plates: tuple[Plate, ...], *, rate: float, start: float
) -> Recording:
    """The recording with force plates, cut to the time that both cover.

    Parameters
    ----------
    recording : markers without plates.
    path : where the plates come from, for messages.
    plates : with equally many samples, in the markers' axes.
    rate, start : Hz and s, of the plates' samples.

    Raises
    ------
    RecordError : the rates do not divide, or the forces are of another time. Those that are of
        another place are the fault of their plate.
    """
    ratio = rate / recording.marker_rate
    per_frame = round(ratio)
    if per_frame < 1 or abs(ratio - per_frame) > 0.002 * ratio:
        if ratio < LIMITS["least_ratio"]:
            raise RecordError(
                f"{path}: forces at {rate:.6g} Hz and markers at {recording.marker_rate:.6g} Hz "
                f"({recording.source}): forces are recorded at the rate of the markers, or at a "
                "higher one. Export them at the rate at which they were recorded."
            )
        per_frame = int(np.ceil(ratio - 0.002))
        finer = per_frame * recording.marker_rate
        passed_over(
            f"{path}: forces at {rate:.6g} Hz are no whole multiple of the markers' "
            f"{recording.marker_rate:.6g} Hz; they are resampled to {finer:.6g} Hz"
        )
        plates, rate = tuple(_resampled(plate, rate, finer) for plate in plates), finer
    # Rates written with few digits do not divide exactly; the markers' rate counts.
    rate = per_frame * recording.marker_rate
    frames, samples = len(recording.markers), len(plates[0].force)
    ends = (recording.start + frames / recording.marker_rate, start + samples / rate)
    if max(abs(recording.start - start), abs(ends[1] - ends[0])) > LIMITS["largest_mismatch_s"]:
        shared = max(recording.start, start), min(ends)
        hint = (
            ""
            if shared[1] - shared[0] < LIMITS["shortest_s"]
            else " If both are of one trial and on one clock, give the time that both cover: "
            f"--trial-time {np.ceil(1e3 * shared[0]) / 1e3:g}:{np.floor(1e3 * shared[1]) / 1e3:g}."
        )
        raise RecordError(
            f"{path}: the forces go from {start:.3f} to {ends[1]:.3f} s, the markers of "
            f"{recording.source} from {recording.start:.3f} to {ends[0]:.3f} s. Give the forces "
            f"of the same trial, cut to the same time.{hint}"
        )
    # If the forces begin later, marker frames before them are dropped.
    skipped = max(0, int(np.ceil((start - recording.start) * recording.marker_rate - 1e-3)))
    begin = recording.start + skipped / recording.marker_rate
    offset = round((begin - start) * rate)
    # As many whole frames as both have.
    kept = min(frames - skipped, (samples - offset) // per_frame)
    window = slice(offset, offset + kept * per_frame)
    cut = tuple(plate.during(window) for plate in plates)
    both = recording.frames(skipped, skipped + kept)
    shown = both.markers
    middle = np.repeat(_middle(shown), per_frame, axis=0)
    placed = [
        plate_or_fault(each.name, len(each.force), partial(_placed, each, path, shown, middle))
        for each in cut
    ]
    return replace(
        both,
        source=f"{recording.source}, {path}",
        plates=tuple(placed),
        force_rate=rate,
    )


def _resampled(plate: Plate, rate: float, finer: float) -> Plate:
    """The `plate`, of samples at `rate` Hz, at a `finer` one; linear between its samples."""
    old = np.arange(len(plate.force)) / rate
    new = np.arange(int(np.floor(old[-1] * finer + 1e-6)) + 1) / finer

    def linear(values: Array) -> Array:
        columns = [np.interp(new, old, values[:, axis]) for axis in range(3)]
        return np.stack(columns, axis=1)

    force = linear(plate.force)
    point = np.full_like(force, np.nan)
    loaded = np.asarray(np.isfinite(plate.centre_of_pressure).all(axis=1))
    if loaded.any():
        known = np.flatnonzero(loaded)
        # Between two loaded samples the line, beside the edge of a contact its last sample.
        fixed = np.stack(
            [
                np.interp(old, old[known], plate.centre_of_pressure[known, axis])
                for axis in range(3)
            ],
            axis=1,
        )
        nearest = np.clip(np.rint(new * rate).astype(int), 0, len(old) - 1)
        point[loaded[nearest]] = linear(fixed)[loaded[nearest]]
    free = np.where(np.isfinite(point), linear(plate.free_moment), 0.0)
    moment = None if plate.moment is None else linear(plate.moment)
    return replace(plate, force=force, centre_of_pressure=point, free_moment=free, moment=moment)


def _middle(markers: Array) -> Array:
    """Mean (T, 3) of each frame's markers that are near their median, because a reflection that the
    cameras took for a marker may be anywhere. NaN where none is seen.
    """
    middle = np.full((len(markers), 3), np.nan)
    some = np.isfinite(markers).all(axis=2).sum(axis=1) > 0
    shown = markers[some]
    median = np.nanmedian(shown, axis=1)
    near = np.linalg.norm(shown - median[:, None], axis=2) < SPREAD.high
    total = np.where(near[:, :, None], shown, 0.0).sum(axis=1)
    with np.errstate(invalid="ignore"):  # two reflections with nobody between them
        middle[some] = total / near.sum(axis=1)[:, None]
    return middle


def _placed(plate: Plate, path: Path, markers: Array, middle: Array) -> Plate:
    """The `plate`, of which the forces act under the `markers` (T, M, 3) and push the person up,
    whose `middle` (N, 3) is given for each sample. Raises RecordError where they do not.
    """
    size = np.linalg.norm(plate.force, axis=1)
    strong = certain_load(size)
    if not strong.any():
        return plate
    points = markers.reshape(-1, 3)
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    pressure = plate.centre_of_pressure[strong]
    where = np.median(pressure, axis=0)
    outside = np.maximum(low - where, where - high).max()
    if outside > LIMITS["largest_distance_m"]:
        raise RecordError(
            f"{path}: plate {plate.name}: the centre of pressure is at "
            f"{np.round(where, 3).tolist()} m (median under load), {outside:.3g} m outside "
            f"the space of the markers, which extends from {np.round(low, 2).tolist()} to "
            f"{np.round(high, 2).tolist()} m: the points are not in m (divide mm by 1000), the "
            "markers are in another unit than their file says, or the forces are of another trial "
            "or in other axes than the markers. Export both together."
        )
    towards = middle[strong] - pressure
    # 1 if every force points from its point to the middle of the markers.
    cosine = np.nanmean(
        (plate.force[strong] / size[strong, None] * towards).sum(axis=1)
        / np.linalg.norm(towards, axis=1)
    )
    mean = np.round(plate.force[strong].mean(axis=0), 1).tolist()
    if cosine < -LIMITS["smallest_cosine"]:
        raise RecordError(
            f"{path}: plate {plate.name}: the force (mean {mean} N) points from the person "
            "into the plate: these are forces on the plate, but those on the person are "
            "needed. Reverse the signs of the forces and torques."
        )
    if cosine < LIMITS["smallest_cosine"]:
        raise RecordError(
            f"{path}: plate {plate.name}: the force (mean {mean} N) does not point to the "
            f"person, but {np.degrees(np.arccos(cosine)):.0f}° away: the forces are in other "
            "axes than the markers, or act at the points of the other foot or of another "
            "trial. Export markers and forces of the trial together."
        )
    return plate
