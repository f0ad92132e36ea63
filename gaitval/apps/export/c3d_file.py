"""The walk as a laboratory would record it: markers and a force plate for each foot, in a C3D file.

The two plates lie over each other, as long as the walk: which force is whose is known in a
simulation. The axes are the project's: x forward, y left, z up.
"""

from pathlib import Path
from typing import Final

import numpy as np

from gaitval.apps.export.virtual_markers import virtual_markers
from gaitval.apps.export.walked import ExportedWalk
from gaitval.arrays import Array
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.mocap.c3d_writing import write_c3d
from gaitval.mocap.force_plates import UNLOADED_N
from gaitval.mocap.pressed_plates import plate_under
from gaitval.mocap.recording import Recording

FILE: Final = "walk.c3d"
CAMERA_STEPS: Final = 5
"""Physics steps in a frame of the markers: 100 Hz at the default step."""
MARGIN: Final = 0.5
"""m, of the plates around the places of the pelvis."""


def write_c3d_file(folder: Path, walked: ExportedWalk) -> list[Path]:
    """Write `FILE` into `folder`; returns its path. Raises ArtefactError."""
    write_c3d(folder / FILE, recording_of(walked))
    return [folder / FILE]


def recording_of(walked: ExportedWalk) -> Recording:
    """Markers and plates of the exported rows, less those that fill no frame."""
    rows, walk = walked.rows, walked.walk
    whole = slice(rows.start, rows.start + (rows.stop - rows.start) // CAMERA_STEPS * CAMERA_STEPS)
    markers = virtual_markers(walked)
    shown = walk.positions[whole]
    places = marker_positions(walked.body, markers, shown[::CAMERA_STEPS])
    rate = 1.0 / float(walk.time[1] - walk.time[0])
    wrenches = walk.wrenches()[rows][: len(shown)]
    # The smooth contact law acts a centimetre above the ground already, which no plate feels.
    wrenches[wrenches[..., 2] < UNLOADED_N] = 0.0
    corners = _corners(shown[:, 3:5])
    return Recording(
        source=f"{walked.stored.subject.identifier}, simulated by gaitval",
        axes="project",
        names=tuple(marker.name for marker in markers),
        markers=places,
        marker_rate=rate / CAMERA_STEPS,
        plates=tuple(
            plate_under(str(side + 1), corners, wrenches[:, side, :3], wrenches[:, side, 3:])
            for side in range(2)
        ),
        force_rate=rate,
    )


def _corners(places: Array) -> Array:
    """(4, 3) m, clockwise from above, so that the third axis points down, as plates have it."""
    (back, right), (front, left) = places.min(axis=0) - MARGIN, places.max(axis=0) + MARGIN
    front += MARGIN  # the foot is ahead of the pelvis
    return np.array([[front, right, 0], [back, right, 0], [back, left, 0], [front, left, 0]])
