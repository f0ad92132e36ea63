"""Prior of the body parameters mu, before any gait is seen: from how the body was measured.

| parameter | SD | because |
|---|---|---|
| damping | 0.05 Nms/rad | convention: half of PredSim's 0.1 |
| friction | 0.1 | shoes on a treadmill belt, 0.6-1.0 |
| thigh, by markers | 4 % | skin over the ASIS; the hip centre to 5-13 mm (Harrington 2007) |
| thigh, by tape | 4 % | the trochanter is palpated to 2 cm |
| thigh, by stature | 5.5 % | the ten built-in subjects; ANSUR II: 21 mm (Gordon 2014) |
| shank, by markers or tape | 3 % | epicondyle and malleolus to 5-10 mm each (Della Croce 2005) |
| shank, by stature | 4 % | the ten built-in subjects; ANSUR II: 14 mm |
| foot, measured / by stature | 3 / 5 % | heel and toe markers / ANSUR II |
| hip, each coordinate | 10 mm | Harrington 2007 |
| knee, each coordinate | 7 mm | Della Croce 2005 |
| ankle, each coordinate | 5 mm | Della Croce 2005 |

The mean is the body as scaled.
"""

from collections.abc import Mapping
from typing import Final, Literal

import numpy as np

from gaitval.arrays import Array
from gaitval.model.parameters import PARAMETERS
from gaitval.subjects.subject import Subject

_MeasuredBy = Literal["markers", "tape", "stature"]

LENGTHS: Final[Mapping[_MeasuredBy, Mapping[str, float]]] = {
    "markers": {"foot_length": 0.03, "shank_length": 0.03, "thigh_length": 0.04},
    "tape": {"foot_length": 0.03, "shank_length": 0.03, "thigh_length": 0.04},
    "stature": {"foot_length": 0.05, "shank_length": 0.04, "thigh_length": 0.055},
}
"""SD of the factors on a segment's length, by how it was measured."""

_OTHERS: Final = {
    "damping": 0.05,
    "friction": 0.1,
    **{f"{joint}_{axis}": size for joint, size in
       (("ankle", 0.005), ("hip", 0.010), ("knee", 0.007)) for axis in "xyz"},
}  # fmt: skip

_TAPE: Final = {"foot_length": "foot", "shank_length": "shank", "thigh_length": "thigh"}


def measured_by(subject: Subject) -> dict[str, _MeasuredBy]:
    """How each length of mu was measured in this `subject`: by markers, tape or stature."""
    if subject.measurements or subject.markers:
        return dict.fromkeys(_TAPE, "markers")
    return {name: "tape" if key in subject.tape else "stature" for name, key in _TAPE.items()}


def prior_sd(subject: Subject) -> Array:
    """Standard deviations (14,) of mu about the body of `subject` as scaled, in the order of
    `PARAMETERS` and in their units.
    """
    how = measured_by(subject)
    lengths = {name: LENGTHS[how[name]][name] for name in _TAPE}
    return np.array([(_OTHERS | lengths)[name] for name in PARAMETERS])
