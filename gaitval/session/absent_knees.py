"""Legs whose knee has no marker in a walk: what else shows where it is.

Pelvis and foot alone leave the knee to a chain of lengths, in which a millimetre at the heel is a
degree at the knee, and no measure notices: the fit is perfect.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from gaitval.errors import RecordError
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_set import MarkerSet

CLUSTER: Final = 3
"""Markers on thigh or shank that show it, and so the knee, as well as one on the knee does."""


def absent_knees(recording: Recording, marker_set: MarkerSet) -> Iterator[QualityFlag]:
    """Warnings about the sides whose knee no marker of the walk `recording` shows, and no cluster.

    Raises RecordError if no other marker of a thigh and its shank is seen either.
    """
    seen = {
        name: definition
        for name, definition in marker_set.markers.items()
        if name in recording.names and np.isfinite(recording.marker(name)).any()
    }
    lost, left = list[str](), list[str]()
    for side in "RL":
        knees = [
            name
            for name, definition in marker_set.markers.items()
            if definition.landmark in (f"{side}.Knee", f"{side}.Knee.Medial")
        ]
        if any(name in seen for name in knees):
            continue
        on = {
            segment: [name for name, each in seen.items()
                      if each.segment == f"{segment}_{side.lower()}"]
            for segment in ("thigh", "shank")
        }  # fmt: skip
        if max(len(names) for names in on.values()) >= CLUSTER:
            continue
        beside = [
            name for names in on.values() for name in names
            if not (seen[name].landmark or "").startswith(f"{side}.Ankle")
        ]  # fmt: skip
        missing = " and ".join(knees[:1] or [f"the landmark {side}.Knee"])
        if not beside:
            raise RecordError(
                f"{recording.source}: no marker shows the {'right' if side == 'R' else 'left'} "
                f"knee in the walk: {missing} is not seen, nor any other marker of thigh and "
                "shank but those of the ankle, and pelvis and foot alone do not show how a knee "
                "bends. Label it in the recording program and export again; or record with at "
                f"least {CLUSTER} markers on the thigh or the shank, which carry the knee of the "
                "standing trial."
            )
        lost.append(missing)
        left += beside
    if lost:
        yield QualityFlag(
            "knee without a marker", " and ".join(lost), 0.0, 1.0, "markers",
            f"not seen in the walk: where the knee is follows from {', '.join(left)}, the hip's "
            "centre and the foot, and the angles of knee and foot are some degrees less sure. "
            f"Label it, or record with {CLUSTER} markers on the thigh or the shank",
        )  # fmt: skip
