"""A recording in other forms: as its title, a small table and a tidy one (`display.Displayed`), and
as a file of its arrays.
"""

from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import pandas as pd

from gaitval.artefacts import check_arrays
from gaitval.frames import value_frame
from gaitval.mocap.recording import Event, Plate, Recording
from gaitval.saved_records import edited, read_record, write_record


def title(recording: Recording) -> str:
    """File and axes of a `recording`."""
    return f"Recording {recording.source}, {recording.axes} axes"


def overview(recording: Recording) -> pd.DataFrame:
    """How much of what was recorded in a `recording`."""
    seen = np.isfinite(recording.markers).all(axis=2).mean() if recording.markers.size else np.nan
    return value_frame(
        [
            ("", "duration", len(recording.markers) / recording.marker_rate, "s"),
            ("", "markers", len(recording.names), "1"),
            ("", "marker rate", recording.marker_rate, "Hz"),
            ("", "markers seen", 100.0 * float(seen), "%"),
            ("", "force plates", len(recording.plates), "1"),
            ("", "force rate", recording.force_rate, "Hz"),
            ("", "events", len(recording.events), "1"),
        ]
    ).drop(columns=["side", "percent"])


def to_frame(recording: Recording) -> pd.DataFrame:
    """Marker positions of `recording`: marker, quantity (x, y, z), time (s), value, unit (m)."""
    count, markers, _ = recording.markers.shape
    return pd.DataFrame(
        {
            "marker": np.tile(np.repeat(recording.names, 3), count),
            "quantity": np.tile(["x", "y", "z"], count * markers),
            "time": np.repeat(recording.time, 3 * markers),
            "value": recording.markers.reshape(-1),
            "unit": "m",
        }
    )


def save(recording: Recording, path: Path) -> None:
    """Write `recording` to `path` as one npz file, whole or not at all."""
    arrays = {"markers": recording.markers}
    for number, plate in enumerate(recording.plates):
        for name, values in vars(plate).items():
            if isinstance(values, np.ndarray):
                arrays[f"plate{number}.{name}"] = values
    others = {
        each.name: getattr(recording, each.name)
        for each in fields(Recording)
        if each.name not in ("markers", "plates", "events")
    }
    others["plates"] = [plate.name for plate in recording.plates]
    others["events"] = [list(asdict(event).values()) for event in recording.events]
    write_record(path, Recording.__name__, arrays, others)


def load(path: Path) -> Recording:
    """The recording in the file `path` of `save`. Raises ArtefactError (inside, ValueError)."""
    arrays, others = read_record(path, Recording.__name__)
    plates = []
    try:
        for number, name in enumerate(others.pop("plates")):
            start = f"plate{number}."
            found = {k.removeprefix(start): v for k, v in arrays.items() if k.startswith(start)}
            found = {"force": found.pop("force"), **found}  # T is that of the force
            shapes = {each: (4, 3) if each == "corners" else (0, 3) for each in found}
            check_arrays(found, shapes, path, may_lack=found)
            plates.append(Plate(name, **found))
        events = tuple(Event(*each) for each in others.pop("events"))
        markers = {"markers": arrays["markers"]}
        shape = (0, len(others["names"]), 3)
        check_arrays(markers, {"markers": shape}, path, may_lack=markers)
        if not (others["marker_rate"] > 0 and others["force_rate"] >= 0):
            raise ValueError("its rates are not positive")
        return Recording(**markers, plates=tuple(plates), events=events, **others)
    except (KeyError, TypeError, ValueError) as error:
        raise edited(path, error) from None
