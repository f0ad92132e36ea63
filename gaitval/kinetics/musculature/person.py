"""The muscles of a person's leg: those of `paths`, as long and as strong as this body's.

Lengths and arms follow the bones (`mapping.sizes`). Fibres and tendons keep the range in which the
published ones work: both are scaled by how much longer the whole muscle is. Strength follows the
volume of muscle of Handsfield et al. (2014) J Biomech 47:631-638, whose regression on mass times
stature is that of the published model, over the fibre's length. It is of 24 healthy adults; for
children, and for the old or the ill, it says little (`bands.SPREADS`).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import ModelError
from gaitval.kinetics.musculature.mapping import BoneSizes
from gaitval.kinetics.musculature.paths import COORDINATES, geometry, table


@dataclass(frozen=True)
class PublishedMuscles:
    """What muscles of a person are scaled from."""

    specific_tension: float = 60e4
    """N/m² (Rajagopal et al. 2016)."""
    published_mass: float = 75.0
    published_height: float = 1.70
    volume: tuple[float, float] = (47.05, 1289.6)
    """cm³ of muscle in a leg: per kg and m of mass times stature, and constant (Handsfield
    2014)."""


PUBLISHED: Final = PublishedMuscles()


_STANDING: Final = np.zeros((1, 6))

ELASTIC: Final = ("gasmed", "gaslat", "soleus")
"""Muscles whose tendon stretches: it is long against the fibres, which in a rigid tendon's place
would be stretched until their passive force silenced them before mid-stance."""


@dataclass(frozen=True)
class LegMuscles:
    """Forty muscles of a leg, in the order of `names`; arrays (40,), or (D, 40) of D draws.

    Attributes
    ----------
    names : without side.
    sizes : of the bones.
    max_force : N.
    optimal_fibre, tendon_slack : m.
    pennation : rad.
    passive_from, passive_to : fibre strains, as in `paths.Muscle`.
    volume : of the fibres, the largest being 1.
    elastic : (40,) whether the tendon stretches.
    present : (40,) whether the person has the muscle.
    """

    names: tuple[str, ...]
    sizes: BoneSizes
    max_force: Array
    optimal_fibre: Array
    tendon_slack: Array
    pennation: Array
    passive_from: Array
    passive_to: Array
    volume: Array
    elastic: Array
    present: Array


def muscle_volume(mass: float, height: float) -> float:
    """Volume of the muscles of a leg, m³, of a person of `mass` kg and `height` m."""
    slope, constant = PUBLISHED.volume
    return (slope * mass * height + constant) * 1e-6


def leg_muscles(
    own: BoneSizes,
    *,
    mass: float,
    height: float,
    strength: Mapping[str, float] | float = 1.0,
    lost: Collection[str] = (),
) -> LegMuscles:
    """The muscles of a leg with bones of the sizes `own`, of a person of `mass` kg and `height` m.

    `strength` is a factor on the force of all, or of muscles by name (without side). `lost` are
    coordinates of `paths.COORDINATES` of joints that a prosthesis has: no muscle moves them.

    Raises ModelError for a mass or height that no person has, a bone that is not within a factor of
    two and a half of an adult's, or a muscle that is not known.
    """
    if not (5.0 < mass < 350.0 and 0.6 < height < 2.6):
        raise ModelError(
            f"A person of {mass:g} kg and {height:g} m has no muscles here: mass is in kg, between "
            "5 and 350, height in m, between 0.6 and 2.6. Correct the units."
        )
    if not ((own.factors > 0.4) & (own.factors < 2.5)).all():
        raise ModelError(
            "The bones of this leg are "
            + ", ".join(f"{each:.2f}" for each in own.factors)
            + " times an adult man's (pelvis, thigh, shank, foot); muscle paths hold from 0.4 to "
            "2.5. Check that the model's lengths are in m and that it has hip, knee, ankle and "
            "toe joints."
        )
    found = table()
    names = found.names
    standing = geometry(_STANDING).length[0]
    longer = standing @ own.factors / standing.sum(axis=1)
    fibre = np.array([each.optimal_fibre for each in found.muscles])
    more = muscle_volume(mass, height) / muscle_volume(
        PUBLISHED.published_mass, PUBLISHED.published_height
    )
    force = np.array([each.max_force for each in found.muscles]) * more / longer
    volume = force * fibre * longer
    return LegMuscles(
        names=names,
        sizes=own,
        max_force=force * _factors(strength, names),
        optimal_fibre=fibre * longer,
        tendon_slack=np.array([each.tendon_slack for each in found.muscles]) * longer,
        pennation=np.array([each.pennation for each in found.muscles]),
        passive_from=np.array([each.passive_from for each in found.muscles]),
        passive_to=np.array([each.passive_to for each in found.muscles]),
        volume=volume / volume.max(),
        elastic=np.array([name in ELASTIC for name in names]),
        present=np.array(
            [
                not any(COORDINATES[i] in lost for i in muscle.coordinates)
                for muscle in found.muscles
            ]
        ),
    )


def _factors(strength: Mapping[str, float] | float, names: tuple[str, ...]) -> Array:
    if not isinstance(strength, Mapping):
        return np.full(len(names), float(strength))
    unknown = sorted(set(strength) - set(names))
    if unknown:
        raise ModelError(
            f"No muscle is called {', '.join(unknown)}. The muscles of a leg are "
            f"{', '.join(names)}."
        )
    return np.array([float(strength.get(name, 1.0)) for name in names])
