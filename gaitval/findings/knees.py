"""Whether a walk shows its knees: pelvis and foot alone leave them to a chain of lengths, in which
a millimetre at the heel is a degree at the knee, and the fit is perfect.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.findings.finding import Finding, Seen
from gaitval.mocap.recording import Recording


@dataclass(frozen=True)
class Knees:
    """The markers of a walk, the segment of each, and the landmarks' markers."""

    recording: Recording
    segments: Mapping[str, str]
    landmarks: Mapping[str, str]


def _markers(walk: Knees) -> Iterator[Seen]:
    """How many markers thigh or shank have, the better of the two, of a leg whose knee has none."""
    seen = [
        name
        for name in walk.recording.names
        if np.isfinite(walk.recording.marker(name)).all(axis=1).any()
    ]
    for side in "RL":
        knees = [walk.landmarks.get(f"{side}.{name}", "") for name in ("Knee", "Knee.Medial")]
        if not set(knees) & set(seen):
            on = [walk.segments[name] for name in seen]
            most = max(on.count(f"{segment}_{side.lower()}") for segment in ("thigh", "shank"))
            yield Seen(float(most), knees[0] or f"{side}.Knee")


UNSEEN: Final[Finding] = Finding(
    name="knee without a marker",
    needs=Knees,
    values=_markers,
    limits=(3.0, np.inf),
    unit="markers",
    sentence=(
        "not seen in the walk, and thigh and shank have {value:.0f} other markers at most: the "
        "angles of knee and foot are some degrees less sure"
    ),
    remedy="Label it, or record with 3 markers on the thigh or the shank",
)
