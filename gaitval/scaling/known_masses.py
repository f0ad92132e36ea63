"""Masses of the segments of a body of which some are known."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from gaitval.coordinates import SIDES, Side
from gaitval.errors import ScalingError
from gaitval.scaling.anthropometry import PAIRED

if TYPE_CHECKING:
    from gaitval.scaling.person import Individual

Masses = dict[tuple[str, Side], float]
"""kg, by segment and side."""


def with_known(known: Masses, fractions: Mapping[str, float], subject: "Individual") -> Masses:
    """The masses of all segments of `subject`: those `known`, and of the others their shares of the
    rest by their `fractions` of a body. Raises ScalingError if nothing is left for them.
    """
    others = {
        (name, side): share
        for name, share in fractions.items()
        for side in (SIDES if name in PAIRED else SIDES[:1])
        if (name, side) not in known
    }
    rest = (subject.mass_kg - math.fsum(known.values())) / math.fsum(others.values())
    if rest <= 0:
        raise ScalingError(
            f"the known masses of segments of {subject.identifier} add up to "
            f"{math.fsum(known.values()):.1f} kg, more than the body's {subject.mass_kg:.1f} kg. "
            "Give kilograms, and check the body mass."
        )
    return known | {key: share * rest for key, share in others.items()}
