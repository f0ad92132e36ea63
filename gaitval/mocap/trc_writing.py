"""Write markers as TRC, the format of Motion Analysis; `gaitval.mocap.trc` reads it."""

from pathlib import Path

import numpy as np

from gaitval._internal.io.artefacts import write_text
from gaitval.mocap.recording import Recording


def write_trc(path: Path, recording: Recording) -> None:
    """Write the markers of `recording`, not its plates and events, as the TRC file `path` in mm, in
    the axes they are in, whole or not at all; gaps are NaN. Raises ArtefactError if it cannot be
    written.

    OpenSim expects y up: turn the recording first. OpenSim refuses a row that ends in empty cells,
    so gaps are not left empty.
    """
    frames, count = recording.markers.shape[:2]
    rate = f"{recording.marker_rate:.12g}"
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{Path(path).name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t"
        "OrigNumFrames",
        f"{rate}\t{rate}\t{frames}\t{count}\tmm\t{rate}\t1\t{frames}",
        "Frame#\tTime\t" + "\t\t\t".join(recording.names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, count + 1) for axis in "XYZ"),
        "",
    ]
    for i, (time, row) in enumerate(zip(recording.time, recording.markers * 1e3, strict=True)):
        cells = ["NaN" if np.isnan(value) else f"{value:.9g}" for value in row.ravel()]
        lines.append("\t".join([str(i + 1), f"{time:.12g}", *cells]))
    write_text(Path(path), "\n".join(lines) + "\n")
