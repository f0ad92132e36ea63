"""Virtual people, on whom the general policies are trained: bodies drawn from the prior of how a
built-in subject was measured, and its gait on a body of another size.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.gait.record import FittedCurve
from gaitval.model.parameters import nominal_parameters
from gaitval.subjects.subject import Subject


@dataclass(frozen=True)
class VirtualPeople:
    """How virtual people are drawn."""

    widest: float = 2.5
    """SDs at which draws are cut off."""
    stature_sd: float = 0.04
    """SD of a factor on all lengths: stature of adults of one sex, 39 mm per metre (ANSUR II,
    Gordon et al. 2014)."""
    build_sd: float = 0.1
    """SD of a factor on the mass at a given stature."""


VIRTUAL: Final = VirtualPeople()


def drawn_parameters(sd: Array, random: np.random.Generator) -> Array:
    """Mu (14,) drawn with the generator `random` from the prior, cut off at `VIRTUAL.widest`;
    damping and friction stay positive. `sd` (14,) are standard deviations about the nominal
    parameters, see `identification.prior`.
    """
    while True:
        z = random.standard_normal(len(sd))
        mu = nominal_parameters() + sd * z
        # All are drawn again if one is rejected, so that the accepted ones stay independent.
        if np.abs(z).max() <= VIRTUAL.widest and mu[0] >= 0.0 and mu[1] >= 0.4:
            return np.asarray(mu)


def on_legs(person: Subject, leg: float, size: float) -> Subject:
    """The gait of `person` on legs of a length, m, which are `size` times as long: without
    dimension the same, so speed and times go with the root of the size, and moments, Nm/kg, with
    the size (Hof 1996).
    """

    def larger(curve: FittedCurve) -> FittedCurve:
        cosine, sine = (tuple(size * each for each in part) for part in (curve.cosine, curve.sine))
        return curve.model_copy(update={"mean": size * curve.mean, "cosine": cosine, "sine": sine})

    moments = {name: larger(curve) for name, curve in person.gait.moments.items()}
    return person.model_copy(
        update={
            "leg_length_m": leg,
            "walking_speed_m_s": person.walking_speed_m_s * size**0.5,
            "stride_time_s": person.stride_time_s * size**0.5,
            "gait": person.gait.model_copy(update={"moments": moments}),
        }
    )


def of_another_size(person: Subject, random: np.random.Generator) -> Subject:
    """Somebody who walks as `person` does but is taller or shorter, heavier or lighter, by size and
    build drawn with the generator `random`. The body is known by stature and mass alone; further
    trials are left out.
    """
    z = np.clip(random.standard_normal(2), -VIRTUAL.widest, VIRTUAL.widest)
    size = float(1.0 + VIRTUAL.stature_sd * z[0])
    # At equal body mass index the mass grows with the square of the stature.
    mass = person.mass_kg * (size**2 * float(1.0 + VIRTUAL.build_sd * z[1]))
    values = {"height_m": person.height_m * size, "mass_kg": mass, "trials": ()}
    larger = on_legs(person.by_stature(), person.leg_length_m * size, size)
    return larger.model_copy(update=values)
