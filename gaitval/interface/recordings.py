"""Motion-capture trials from Python."""

from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Self

import numpy as np
import pandas as pd

from gaitval.interface.result import Result, read_record, same_fields, value_frame, write_record
from gaitval.mocap import reading, recording
from gaitval.mocap.axes import parse_axes


@dataclass(frozen=True, repr=False)
class Recording(Result, recording.Recording):
    """`gaitval.mocap.recording.Recording` that prints itself: markers in m, forces in N."""

    def title(self) -> str:
        """File and axes."""
        return f"Recording {self.source}, {self.axes} axes"

    def summary(self) -> pd.DataFrame:
        """How much of what was recorded."""
        seen = np.isfinite(self.markers).all(axis=2).mean() if self.markers.size else np.nan
        return value_frame(
            [
                ("", "duration", len(self.markers) / self.marker_rate, "s"),
                ("", "markers", len(self.names), "1"),
                ("", "marker rate", self.marker_rate, "Hz"),
                ("", "markers seen", 100.0 * float(seen), "%"),
                ("", "force plates", len(self.plates), "1"),
                ("", "force rate", self.force_rate, "Hz"),
                ("", "events", len(self.events), "1"),
            ]
        ).drop(columns=["side", "percent"])

    def to_frame(self) -> pd.DataFrame:
        """Marker positions: columns marker, quantity (x, y, z), time (s), value, unit (m)."""
        count, markers, _ = self.markers.shape
        return pd.DataFrame(
            {
                "marker": np.tile(np.repeat(self.names, 3), count),
                "quantity": np.tile(["x", "y", "z"], count * markers),
                "time": np.repeat(self.time, 3 * markers),
                "value": self.markers.reshape(-1),
                "unit": "m",
            }
        )

    def save(self, path: str | Path) -> None:
        """Write one npz file, whole or not at all."""
        arrays = {"markers": self.markers}
        for number, plate in enumerate(self.plates):
            for name, values in vars(plate).items():
                if isinstance(values, np.ndarray):
                    arrays[f"plate{number}.{name}"] = values
        others = {
            each.name: getattr(self, each.name)
            for each in fields(self)
            if each.name not in ("markers", "plates", "events")
        }
        others["plates"] = [plate.name for plate in self.plates]
        others["events"] = [list(asdict(event).values()) for event in self.events]
        write_record(Path(path), type(self).__name__, arrays, others)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote. Raises ArtefactError."""
        arrays, others = read_record(Path(path), cls.__name__)
        plates = []
        for number, name in enumerate(others.pop("plates")):
            start = f"plate{number}."
            found = {k.removeprefix(start): v for k, v in arrays.items() if k.startswith(start)}
            plates.append(recording.Plate(name, **found))
        events = tuple(recording.Event(*each) for each in others.pop("events"))
        return cls(markers=arrays["markers"], plates=tuple(plates), events=events, **others)


def read_recording(
    path: str | Path, *, forces: str | Path | None = None, axes: str | None = None
) -> Recording:
    """Read one trial: C3D, TRC, or a marker file of WBDS.

    Parameters
    ----------
    path : .c3d, .trc, or `…mkr.txt` of WBDS.
    forces : ground reaction of markers without: .mot, .sto, or `…grf.txt` of WBDS.
    axes : the laboratory's, as "forward=+x up=+y"; the trial is then turned into the project's
        (x forward, y left, z up). When not given it stays in the laboratory's.

    Returns
    -------
    Recording
        `markers` (T, M, 3) m, NaN where not seen; plates in N and Nm, (T, 3) each.

    Raises
    ------
    RecordError
        The file is of an unknown kind, damaged, in another unit, or does not fit `forces`.

    References
    ----------
    The C3D format, www.c3d.org; the axes follow REP-103 (ROS).

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import gaitval as gv
    >>> from gaitval.mocap.trc import write_trc
    >>> from gaitval.mocap.recording import Recording
    >>> places = np.array([[0.1, -0.1, 0.9], [0.1, 0.1, 0.9], [0.0, -0.1, 0.0]])
    >>> names = ("R.ASIS", "L.ASIS", "R.Heel")
    >>> made = Recording("stand", "laboratory", names, np.tile(places, (10, 1, 1)), 100.0)
    >>> write_trc(Path("stand.trc"), made)
    >>> trial = gv.read_recording("stand.trc", axes="forward=+x up=+z")
    >>> trial.names
    ('R.ASIS', 'L.ASIS', 'R.Heel')
    >>> print(*trial.marker("R.ASIS")[0])
    0.1 -0.1 0.9
    """
    found = reading.read_recording(Path(path), forces=None if forces is None else Path(forces))
    if axes is not None:
        found = found.turned(parse_axes(axes).rotation)
    shown: Recording = same_fields(Recording, found)
    return shown
