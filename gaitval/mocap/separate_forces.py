"""Forces of another file than the markers': put together, if they can be of the same trial."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import certain_load, plate_or_fault
from gaitval.mocap.recording import PERSON_SPREAD_M, Plate, Recording

LARGEST_MISMATCH_S: Final = 0.1
"""Markers and forces of one trial end within this time of each other, s; exports differ by a
frame."""

LARGEST_DISTANCE_M: Final = 1.0
"""The centre of pressure is at most this far outside the volume that the markers fill, m."""

SMALLEST_COSINE: Final = 0.7
"""Mean cosine, under load, of the angle between the force and the line from its point to the middle
of the markers. In walking it is above 0.9."""


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
        raise RecordError(
            f"{path}: forces at {rate:.6g} Hz and markers at {recording.marker_rate:.6g} Hz "
            f"({recording.source}): the rate of the forces must be a whole multiple of the "
            f"markers', but the ratio is {ratio:.4g}. Resample the forces to "
            f"{max(per_frame, 1) * recording.marker_rate:.6g} Hz and export again."
        )
    # Rates written with few digits do not divide exactly; the markers' rate counts.
    rate = per_frame * recording.marker_rate
    frames, samples = len(recording.markers), len(plates[0].force)
    ends = (recording.start + frames / recording.marker_rate, start + samples / rate)
    if max(abs(recording.start - start), abs(ends[1] - ends[0])) > LARGEST_MISMATCH_S:
        raise RecordError(
            f"{path}: the forces go from {start:.3f} to {ends[1]:.3f} s, the markers of "
            f"{recording.source} from {recording.start:.3f} to {ends[0]:.3f} s. Give the forces "
            "of the same trial, cut to the same time."
        )
    # If the forces begin later, marker frames before them are dropped.
    skipped = max(0, int(np.ceil((start - recording.start) * recording.marker_rate - 1e-3)))
    begin = recording.start + skipped / recording.marker_rate
    offset = round((begin - start) * rate)
    # As many whole frames as both have.
    kept = min(frames - skipped, (samples - offset) // per_frame)
    window = slice(offset, offset + kept * per_frame)
    cut = tuple(plate.during(window) for plate in plates)
    shown = recording.markers[skipped : skipped + kept]
    middle = np.repeat(_middle(shown), per_frame, axis=0)
    placed = [
        plate_or_fault(each.name, len(each.force), partial(_placed, each, path, shown, middle))
        for each in cut
    ]
    return replace(
        recording,
        source=f"{recording.source}, {path}",
        markers=shown,
        start=begin,
        plates=tuple(placed),
        force_rate=rate,
    )


def _middle(markers: Array) -> Array:
    """Mean (T, 3) of each frame's markers that are near their median, because a reflection that the
    cameras took for a marker may be anywhere. NaN where none is seen.
    """
    middle = np.full((len(markers), 3), np.nan)
    some = np.isfinite(markers).all(axis=2).sum(axis=1) > 0
    shown = markers[some]
    median = np.nanmedian(shown, axis=1)
    near = np.linalg.norm(shown - median[:, None], axis=2) < PERSON_SPREAD_M[1]
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
    if outside > LARGEST_DISTANCE_M:
        # If a thousandth of the distances fits, the points are in millimetres.
        shrunk = np.maximum(low - where / 1e3, where / 1e3 - high).max()
        why = (
            "it looks like millimetres: divide the points (px, py, pz) by 1000"
            if shrunk < LARGEST_DISTANCE_M
            else "the forces are of another trial or in other axes than the markers, or the "
            "markers are in another unit than their file says. Export both together"
        )
        raise RecordError(
            f"{path}: plate {plate.name}: the centre of pressure is at "
            f"{np.round(where, 3).tolist()} m (median under load), {outside:.3g} m outside "
            f"the space of the markers, which extends from {np.round(low, 2).tolist()} to "
            f"{np.round(high, 2).tolist()} m; {why}."
        )
    towards = middle[strong] - pressure
    # 1 if every force points from its point to the middle of the markers.
    cosine = np.nanmean(
        (plate.force[strong] / size[strong, None] * towards).sum(axis=1)
        / np.linalg.norm(towards, axis=1)
    )
    mean = np.round(plate.force[strong].mean(axis=0), 1).tolist()
    if cosine < -SMALLEST_COSINE:
        raise RecordError(
            f"{path}: plate {plate.name}: the force (mean {mean} N) points from the person "
            "into the plate: these are forces on the plate, but those on the person are "
            "needed. Reverse the signs of the forces and torques."
        )
    if cosine < SMALLEST_COSINE:
        raise RecordError(
            f"{path}: plate {plate.name}: the force (mean {mean} N) does not point to the "
            f"person, but {np.degrees(np.arccos(cosine)):.0f}° away: the forces are in other "
            "axes than the markers, or act at the points of the other foot or of another "
            "trial. Export markers and forces of the trial together."
        )
    return plate
