"""Markers attached to the segments of a body model."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class ModelMarker:
    """A marker that is fixed to a segment.

    Attributes
    ----------
    name : as in the recording, after aliases are resolved.
    segment : one of `model.body.SEGMENTS`.
    position : (3,) m, in the segment's frame (REP-103 in the neutral pose).
    weight : weight of its squared distance in inverse kinematics, relative to the others.
    """

    name: str
    segment: str
    position: NDArray[np.float64]
    weight: float = 1.0
