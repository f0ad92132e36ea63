"""Joint centres that a program has computed and written among the markers of a trial.

| points | joints | written by |
|---|---|---|
| RFEP, RFEO, RTIO | hip, knee, ankle | Plug-in Gait, whose moments are about them |
| RHJC, R_KJC, RAJC_study | hip, knee, ankle | Nexus' other models, Visual3D, OpenSim, OpenCap |
| RIGHT_HIP | hip | Visual3D, by its pelvis |

Left ones begin with L. RHip and RKnee of a video are points of an image, not joint centres.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array

_PATTERNS: Final = (
    ("Plug-in Gait", re.compile(r"([RL])(FEP|FEO|TIO)")),
    ("the file's points", re.compile(r"(R|L|RIGHT|LEFT)[_. ]?(HJC|KJC|AJC)(?:_STUDY)?")),
    ("Visual3D", re.compile(r"(RIGHT|LEFT)_(HIP)")),
)
"""Whose points they are, the first before others, and their names in capitals."""
_JOINTS: Final = {
    **dict.fromkeys(("FEP", "HJC", "HIP"), "Hip"),
    **dict.fromkeys(("FEO", "KJC"), "Knee"),
    **dict.fromkeys(("TIO", "AJC"), "Ankle"),
}


@dataclass(frozen=True)
class CentrePoint:
    """A computed joint centre: (T, 3) m, NaN where there is none, and whose it is."""

    source: str
    places: Array


def centre_points(names: Sequence[str], points: Array) -> dict[str, CentrePoint]:
    """The joint centres among `points` (T, M, 3) m of a file, by "R.Hip.Centre" and the like; of
    several of one joint the first in the order above. `names` may have a subject's prefix.
    """
    plain = [name.rpartition(":")[2].strip().upper() for name in names]
    found: dict[str, CentrePoint] = {}
    for source, pattern in _PATTERNS:
        for column, name in enumerate(plain):
            match = pattern.fullmatch(name)
            if match is None:
                continue
            centre = f"{match[1][0]}.{_JOINTS[match[2]]}.Centre"
            if centre not in found and np.isfinite(points[:, column]).all(axis=1).any():
                found[centre] = CentrePoint(source, points[:, column])
    return found
