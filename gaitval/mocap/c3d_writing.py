"""Write a recording as a C3D file that `gaitval.mocap.c3d.read_c3d` reads as the same."""

from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval._internal.io.artefacts import replacing
from gaitval.arrays import Array, Flags
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import plate_axes
from gaitval.mocap.recording import Plate, Recording

_MILLIMETRES: Final = 1e3


def write_c3d(path: Path, recording: Recording) -> None:
    """Write markers in mm and force plates as type 2, in N and Nmm, in the recording's axes, to
    `path`, whole or not at all. The `recording` has the `moment` and the corners of every plate, as
    `make_plate` gives them.

    A marker that was not seen gets the residual -1. A plate's channels are the force on the person
    and its moment about the middle of the surface, in the axes that its corners give. Events and
    `start` are not written. C3D stores single precision: 1e-4 mm of a marker a metre away.

    Raises RecordError if a plate has no corners or only a centre of pressure, or its samples are
    not a whole number for every frame of the markers; ArtefactError if the file cannot be written.
    """
    import ezc3d

    file = ezc3d.c3d()
    seen: Flags = np.asarray(np.isfinite(recording.markers).all(axis=2))
    # ezc3d takes homogeneous coordinates, with a fourth row of ones.
    points = np.ones((4, len(recording.names), len(recording.markers)))
    markers = np.where(seen[..., None], recording.markers, 0.0)
    # As ezc3d has them: coordinate, marker, frame.
    points[:3] = _MILLIMETRES * markers.transpose(2, 1, 0)
    parameters = file["parameters"]
    parameters["POINT"]["RATE"]["value"] = [recording.marker_rate]
    parameters["POINT"]["LABELS"]["value"] = list(recording.names)
    parameters["POINT"]["UNITS"]["value"] = ["mm"]
    file["data"]["points"] = points
    file["data"]["meta_points"]["residuals"] = np.where(seen, 0.0, -1.0).T[None]
    if recording.plates:
        _add_plates(file, recording)
    with replacing(path) as temporary:
        file.write(str(temporary))


def _add_plates(file: Any, recording: Recording) -> None:
    plates = recording.plates
    samples = recording.force_rate / recording.marker_rate * len(recording.markers)
    for plate in plates:
        if plate.moment is None or not np.isfinite(plate.corners).all():
            raise RecordError(
                f"{recording.source}: force plate {plate.name} has no "
                f"{'moment' if plate.moment is None else 'corners'}, which a C3D file needs."
            )
        if abs(samples - len(plate.force)) > 1e-6:
            raise RecordError(
                f"{recording.source}: force plate {plate.name} has {len(plate.force)} samples for "
                f"{len(recording.markers)} frames of markers; C3D needs as many for each frame."
            )
    parameters, count = file["parameters"], len(plates)
    parameters["ANALOG"]["RATE"]["value"] = [recording.force_rate]
    parameters["ANALOG"]["LABELS"]["value"] = [
        f"{kind}{axis}{number}" for number in range(1, count + 1) for kind in "FM" for axis in "xyz"
    ]
    parameters["ANALOG"]["UNITS"]["value"] = (["N"] * 3 + ["Nmm"] * 3) * count
    file["data"]["analogs"] = np.column_stack([_channels(plate) for plate in plates]).T[None]
    declared = parameters["FORCE_PLATFORM"]
    declared["USED"]["value"] = np.array([count])
    declared["TYPE"]["value"] = np.array([2] * count)
    # 0, 0: a reader must not subtract a baseline.
    declared["ZERO"]["value"] = np.array([0, 0])
    declared["CHANNEL"]["value"] = np.arange(1, 6 * count + 1).reshape(count, 6).T
    # (3, 4, plates) as the format has them.
    corners = np.stack([_MILLIMETRES * plate.corners.T for plate in plates], axis=2)
    file.add_parameter("FORCE_PLATFORM", "CORNERS", corners)
    # The moments are about the middle of the surface already.
    file.add_parameter("FORCE_PLATFORM", "ORIGIN", np.zeros((3, count)))


def _channels(plate: Plate) -> Array:
    """(T, 6) N and Nmm in the plate's axes, the moment about the middle of its surface."""
    assert plate.moment is not None
    axes, centre = plate_axes(plate.corners), plate.corners.mean(axis=0)
    about_centre = plate.moment - np.cross(centre, plate.force)
    return np.hstack([plate.force @ axes, _MILLIMETRES * about_centre @ axes])
