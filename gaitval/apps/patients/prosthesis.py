"""What a leg prosthesis weighs.

The body has a segment for every part of a leg, so an above-knee prosthesis changes the masses of
shank and foot. A spring at its ankle, with the angle of swing as its unloaded one, was tried for
the moment and is further off than healthy people's (docs/how-to/patients.md).
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

from gaitval.coordinates import SIDES, Side
from gaitval.scaling.measurements import Measurements

SHANK: Final = 1.9
"""kg: a microprocessor knee of 1.24 kg (C-Leg 4, maker's data sheet, from memory) with pylon,
adapters and cover."""
FOOT: Final = 0.9
"""kg: a carbon foot with its shell, 0.4 to 0.6 kg by makers' data sheets (from memory), in a
shoe."""


def with_prosthesis(
    measured: Measurements, side: Side, mass: float, fractions: Mapping[str, float]
) -> Measurements:
    """`measured` with the shank and foot of an above-knee prosthesis on a `side`. `mass` kg is that
    of the body with the prosthesis; `fractions` are of each segment of a sound body's mass,
    `anthropometry.mass_fractions`.

    The sound leg's masses are given too, since a mass that is known of one side only is that of
    both: its shares of the body that the person would be with two sound legs.
    """
    whole = (mass - SHANK - FOOT) / (1.0 - fractions["shank"] - fractions["foot"])
    legs = {
        each: replace(
            getattr(measured, each),
            shank_mass=SHANK if each == side else fractions["shank"] * whole,
            foot_mass=FOOT if each == side else fractions["foot"] * whole,
        )
        for each in SIDES
    }
    return replace(measured, right=legs["right"], left=legs["left"], symmetric=False)
