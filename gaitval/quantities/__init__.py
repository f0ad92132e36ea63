"""Quantities that follow from a gait: a file for each, and the table that everything loops over.

The import page, `import.json`, `metrics.json`, reports, comparisons, cohorts and exports show what
is in `QUANTITIES`, and nothing else has to know a new one. See docs/how-to/extend.md.
"""

from collections.abc import Mapping
from typing import Final

from gaitval.quantities.joint_contact import JOINT_CONTACT
from gaitval.quantities.joint_power import JOINT_POWER
from gaitval.quantities.metabolic_rate import METABOLIC_JOINTS, METABOLIC_MUSCLES
from gaitval.quantities.muscle_activation import MUSCLE_ACTIVATION
from gaitval.quantities.quantity import Found, Quantity
from gaitval.quantities.tendon_force import TENDON_FORCE

QUANTITIES: Final[tuple[Quantity, ...]] = (
    JOINT_POWER,
    TENDON_FORCE,
    MUSCLE_ACTIVATION,
    JOINT_CONTACT,
    METABOLIC_JOINTS,
    METABOLIC_MUSCLES,
)

BY_NAME: Final[Mapping[str, Quantity]] = {each.name: each for each in QUANTITIES}

__all__ = [
    "BY_NAME",
    "JOINT_CONTACT",
    "METABOLIC_JOINTS",
    "METABOLIC_MUSCLES",
    "MUSCLE_ACTIVATION",
    "QUANTITIES",
    "Found",
    "Quantity",
]
