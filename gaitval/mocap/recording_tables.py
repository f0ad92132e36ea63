"""A recording as its title, a small table and a tidy one (`display.Displayed`)."""

import numpy as np
import pandas as pd

from gaitval.frames import value_frame
from gaitval.mocap.recording import Recording


def title(recording: Recording) -> str:
    """File and axes."""
    return f"Recording {recording.source}, {recording.axes} axes"


def overview(recording: Recording) -> pd.DataFrame:
    """How much of what was recorded."""
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
    """Marker positions: columns marker, quantity (x, y, z), time (s), value, unit (m)."""
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
