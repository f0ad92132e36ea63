"""Quantities that follow from a gait: a file for each, and the table that everything loops over.

The import page, `import.json`, `metrics.json`, reports, comparisons, cohorts and exports show what
is in `QUANTITIES`, and nothing else has to know a new one. See docs/how-to/extend.md.
"""

from collections.abc import Mapping
from typing import Final

from gaitval.quantities.joint_power import JOINT_POWER
from gaitval.quantities.quantity import Found, Quantity
from gaitval.quantities.tendon_force import TENDON_FORCE

QUANTITIES: Final[tuple[Quantity, ...]] = (JOINT_POWER, TENDON_FORCE)

BY_NAME: Final[Mapping[str, Quantity]] = {each.name: each for each in QUANTITIES}

__all__ = ["BY_NAME", "QUANTITIES", "Found", "Quantity"]
