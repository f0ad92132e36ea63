"""A load on the trunk, as a share of the body: a vest that a person wears as a device.

It lies evenly around the trunk, so nobody has to lean against it, as one must with a pack. Its
inertia is that of a hollow cylinder of `RADIUS` and `HEIGHT`.
"""

from typing import Final

from gaitval.errors import ConfigurationError
from gaitval.model.devices.device import Device, devices_of

LARGEST: Final = 40.0
"""% of body mass: what Huang and Kuo (2014) J Exp Biol 217:605 loaded people with at most. Beyond
it nothing here was held against people."""
RADIUS, HEIGHT, ALONG = 0.15, 0.40, 0.70
"""m, m, and part of the way from the lumbar joint to the shoulders' height; chosen."""


def trunk_load(percent: float, mass: float) -> Device:
    """A vest of `percent` of the `mass` kg of a body. Raises ConfigurationError for a load that
    nobody was measured with.
    """
    if not 0.0 < percent <= LARGEST:
        raise ConfigurationError(
            f"--load {percent:g}: a load is given in % of body mass, above 0 and up to "
            f"{LARGEST:g}; {percent:g} % of {mass:.1f} kg is {percent * mass / 100.0:.1f} kg, and "
            "neither the walker nor its metabolic rate was held against people who carry that. "
            f"Give a share up to {LARGEST:g}, or write the load's own mass into a device's file "
            "(docs/how-to/devices.md)."
        )
    kilograms = percent * mass / 100.0
    across = RADIUS**2 / 2.0 + HEIGHT**2 / 12.0
    vest = {
        "name": "vest",
        "segment": "torso",
        "mass": kilograms,
        "along": ALONG,
        "inertia": [kilograms * across, kilograms * across, kilograms * RADIUS**2, 0.0, 0.0, 0.0],
    }
    table = {
        "name": f"load_{percent:g}".replace(".", "_"),
        "source": f"{percent:g} % of body mass around the trunk; place and inertia chosen",
        "parts": [vest],
    }
    return devices_of({"devices": [table]}, f"--load {percent:g}")[0]
