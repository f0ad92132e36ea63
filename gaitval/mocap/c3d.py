"""Read C3D files: markers, force plates of types 1 to 7 (`c3d_plates`), events."""

from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.c3d_contents import (
    Contents,
    check_frames,
    check_size,
    labels_of,
    length_unit,
    read_contents,
)
from gaitval.mocap.c3d_plates import read_plates
from gaitval.mocap.centre_points import CentrePoint, centre_points
from gaitval.mocap.recording import Event, Recording

# What a list of points may contain besides markers: results of the laboratory's own software.
_RESULTS: Final = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
_AXES: Final = "OALP"
"""Last letters of the origin and the three axes of a segment, four points of Vicon's programs."""


def read_c3d(path: Path, *, plates: bool = True) -> Recording:
    """Read the C3D file `path`, in the laboratory's axes, SI units, with its force plates if
    `plates`.

    A marker is NaN where its residual is negative or it lies exactly at the origin. Points that the
    file declares to be results are left out, and so are axes of segments (PELO, PELA, PELL, PELP)
    and unlabelled points (`*12`). A subject's prefix that all names share (`Anna:LASI`) is removed.
    Forces are those of the plate on the person: if a file has the opposite sign it is reversed,
    because a plate can only push. Plates without channels are left out. Baselines are subtracted as
    FORCE_PLATFORM:ZERO says, unless the plate is loaded in those frames. The polynomial with which
    Kistler refines the centre of pressure of type 3 (FPCOPPOLY) is not applied: a few millimetres
    near the plate's edge.

    Raises RecordError if the file is not C3D, truncated or damaged; a unit is missing or unknown; a
    plate is of another type, or lacks what its type needs.
    """
    path = Path(path)
    promised = check_size(path)
    contents = read_contents(path)
    check_frames(path, contents, *promised)
    names, markers, centres = _markers(path, contents)
    rate = contents.number("POINT", "RATE")
    if not 0 < rate < np.inf:
        raise RecordError(
            f"{path}: POINT:RATE is {rate:g}, so the times of the frames are unknown. Enter the "
            "camera rate in the program that made the file, and export again."
        )
    found, force_rate = read_plates(path, contents, markers, rate) if plates else ((), 0.0)
    start = contents.first_frame / rate
    events: tuple[Event, ...] = ()
    if labels_of(contents, "EVENT", "LABELS"):
        from gaitval.mocap.c3d_events import stored_events

        events = stored_events(path, contents, start, len(markers) / rate)
    return Recording(
        source=str(path),
        axes="laboratory",
        names=names,
        markers=markers,
        marker_rate=rate,
        start=start,
        plates=found,
        force_rate=force_rate,
        events=events,
        centres=centres,
    )


def _markers(
    path: Path, contents: Contents
) -> tuple[tuple[str, ...], Array, dict[str, CentrePoint]]:
    """Names and trajectories (T, M, 3) m of the markers, and joint centres among all points."""
    labels = labels_of(contents, "POINT", "LABELS")
    count = contents.points.shape[1]
    if not count or not len(contents.points):
        poses = labels_of(contents, "ROTATION", "LABELS")
        instead = (
            f"It has poses of segments instead (ROTATION: {', '.join(poses)}), as Theia3D writes "
            "them, which are not read. Export places on these segments as points, from Visual3D."
            if poses
            else "Export the trial with its labelled markers."
        )
        raise RecordError(
            f"{path}: no markers in the file ({len(contents.points)} frames, {count} points). "
            f"{instead}"
        )
    if len(labels) < count:
        raise RecordError(
            f"{path}: {count} points but {len(labels)} names (POINT:LABELS). Label the markers "
            "in the program that recorded them and export again."
        )
    metres = length_unit(path, contents)
    groups = (*_RESULTS, "MODELED_MARKERS")
    results = {name for group in groups for name in labels_of(contents, "POINT", group)}
    # With an alignment device (KAX) on a knee, Plug-in Gait says where its marker will be (KNE).
    results -= {f"{name[:-3]}KNE" for name in labels if name.endswith("KAX")}
    for stem in {label[:-1] for label in labels}:
        axes = {stem + letter for letter in _AXES}
        results |= axes if axes <= set(labels) else set()
    kept = [
        i
        for i, label in enumerate(labels[:count])
        if label and not label.startswith("*") and label not in results
    ]
    if not kept:
        raise RecordError(
            f"{path}: none of the {count} points is a labelled marker. Label the markers in the "
            "program that recorded them and export again."
        )
    points = contents.points
    # The format marks an unseen point by a negative residual, but some programs write zeros
    # instead.
    hidden = (contents.residuals < 0) | (points == 0).all(axis=2)
    seen = np.where(hidden[:, :, None], np.nan, points) * metres
    centres = centre_points(labels[:count], seen)
    markers = seen[:, kept]
    names = [labels[i] for i in kept]
    # Two subjects may have the same marker, so only a prefix that all names share is removed.
    prefixes = {name.partition(":")[0] for name in names if ":" in name}
    if len(prefixes) == 1 and all(":" in name for name in names):
        names = [name.partition(":")[2] for name in names]
    return tuple(names), markers, centres
