"""What a leg prosthesis weighs.

The body has a segment for every part of a leg, so an above-knee prosthesis changes the masses of
shank and foot. A spring at its ankle, with the angle of swing as its unloaded one, was tried for
the moment and is further off than healthy people's (docs/how-to/patients.md).
"""

from dataclasses import replace
from typing import Final

from gaitval.coordinates import Side
from gaitval.scaling.measurements import Measurements

SHANK: Final = 1.9
"""kg: a microprocessor knee of 1.24 kg (C-Leg 4, maker's data sheet, from memory) with pylon,
adapters and cover."""
FOOT: Final = 0.9
"""kg: a carbon foot with its shell, 0.4 to 0.6 kg by makers' data sheets (from memory), in a
shoe."""


def with_prosthesis(measured: Measurements, side: Side) -> Measurements:
    """`measured` with the shank and foot of an above-knee prosthesis on a `side`."""
    legs = {"right": measured.right, "left": measured.left}
    legs[side] = replace(legs[side], shank_mass=SHANK, foot_mass=FOOT)
    return replace(measured, right=legs["right"], left=legs["left"], symmetric=False)
