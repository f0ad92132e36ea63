"""Numbers of the contact law of `gaitval.model.contact`."""

from typing import NamedTuple

from gaitval.configuration import ContactSettings

SMOOTHING = 1e-5
"""cf, m² and m²/s²."""
PENETRATION_SLOPE = 300.0
"""bd, 1/m."""
RATE_SLOPE = 50.0
"""bv, s/m."""


class ContactLaw(NamedTuple):
    """Numbers of the contact law; units as in `configuration.ContactSettings`, and k = E^(2/3) /
    2.
    """

    stiffness: float
    k: float
    dissipation: float
    static_friction: float
    dynamic_friction: float
    viscous_friction: float
    transition_velocity: float


def contact_law(contact: ContactSettings, friction: float) -> ContactLaw:
    """The law with a static friction coefficient `friction` (the body parameter sigma)."""
    return ContactLaw(
        stiffness=contact.stiffness,
        k=0.5 * contact.stiffness ** (2.0 / 3.0),
        dissipation=contact.dissipation,
        static_friction=friction,
        dynamic_friction=friction * contact.dynamic_to_static,
        viscous_friction=contact.viscous_friction,
        transition_velocity=contact.transition_velocity,
    )
