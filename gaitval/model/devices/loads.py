"""A load on the trunk, as a share of the body: a vest that a person wears as a device.

It lies evenly around the trunk, so nobody has to lean against it, as one must with a pack. Its
inertia is that of a hollow cylinder of `LOADS.radius` and `LOADS.height`.
"""

from dataclasses import dataclass
from typing import Final

from gaitval.errors import ConfigurationError
from gaitval.model.devices.device import Device, devices_of


@dataclass(frozen=True)
class CarriedLoads:
    """Carried loads and where they hang."""

    largest: float = 40.0
    """% of body mass: what Huang and Kuo (2014) J Exp Biol 217:605 loaded people with at most.
    Beyond it nothing here was held against people."""
    radius: float = 0.15
    height: float = 0.40
    along: float = 0.70
    """m, m, and part of the way from the lumbar joint to the shoulders' height; chosen."""


LOADS: Final = CarriedLoads()


def trunk_load(percent: float, mass: float) -> Device:
    """A vest of `percent` of the `mass` kg of a body. Raises ConfigurationError for a load that
    nobody was measured with.
    """
    if not 0.0 < percent <= LOADS.largest:
        raise ConfigurationError(
            f"--load {percent:g}: a load is given in % of body mass, above 0 and up to "
            f"{LOADS.largest:g}; {percent:g} % of {mass:.1f} kg is {percent * mass / 100.0:.1f} "
            "kg, and "
            "neither the walker nor its metabolic rate was held against people who carry that. "
            f"Give a share up to {LOADS.largest:g}, or write the load's own mass into a device's "
            "file "
            "(docs/how-to/devices.md)."
        )
    kilograms = percent * mass / 100.0
    across = LOADS.radius**2 / 2.0 + LOADS.height**2 / 12.0
    vest = {
        "name": "vest",
        "segment": "torso",
        "mass": kilograms,
        "along": LOADS.along,
        "inertia": [
            kilograms * across,
            kilograms * across,
            kilograms * LOADS.radius**2,
            0.0,
            0.0,
            0.0,
        ],
    }
    table = {
        "name": f"load_{percent:g}".replace(".", "_"),
        "source": f"{percent:g} % of body mass around the trunk; place and inertia chosen",
        "parts": [vest],
    }
    return devices_of({"devices": [table]}, f"--load {percent:g}")[0]
