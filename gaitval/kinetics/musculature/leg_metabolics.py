"""Metabolic rate of the muscles of a leg, from what static optimisation found of them."""

from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.kinetics.musculature.curves import active_length
from gaitval.kinetics.musculature.forces import LegForces, change_limits, rate
from gaitval.kinetics.musculature.metabolics import (
    METABOLISM,
    MODELS,
    Fibres,
    FibreStates,
    MuscleRates,
    slow_shares,
)
from gaitval.kinetics.musculature.person import PUBLISHED, LegMuscles

_STEEPEST: Final = 0.1
"""Cosine of the pennation that a fibre may reach: a shorter one would stand across its tendon."""


def fibres_of(muscles: LegMuscles) -> Fibres:
    """What the muscles of a leg are made of; those that the person lacks have no mass."""
    force = np.where(muscles.present, muscles.max_force, 0.0)
    return Fibres(
        mass=METABOLISM.density * force * muscles.optimal_fibre / PUBLISHED.specific_tension,
        slow=slow_shares(muscles.names),
        max_force=force,
        optimal=muscles.optimal_fibre,
    )


def fibre_states(
    time: Array,
    muscles: LegMuscles,
    activation: Array,
    force: Array,
    passive: Array,
    fibre: Array,
    *,
    dynamics_of_activation: bool = False,
) -> FibreStates:
    """What the fibres of a leg do at `time` (T,) s. `force` and `passive` (T, 40) N are along the
    tendons, `fibre` in optimal lengths. Excitation is taken to be `activation`, unless this rose
    and fell with `dynamics_of_activation`: then it is what makes it do so.

    Speeds are of the solved fibre lengths, also where a tendon stretches, so that fibres and
    tendons together do the work of the whole muscle.
    """
    along = np.sqrt(np.maximum(1.0 - (np.sin(muscles.pennation) / fibre) ** 2, _STEEPEST**2))
    return FibreStates(
        excitation=excitations(time, activation) if dynamics_of_activation else activation,
        activation=activation,
        length=fibre,
        speed=rate(time, fibre) * muscles.optimal_fibre,
        active=(force - passive) / along,
        passive=passive / along,
        isometric=active_length(fibre),
    )


def muscle_rates(muscles: LegMuscles, states: FibreStates) -> dict[str, MuscleRates]:
    """W of each of the `muscles` of a leg, (T, 40), in the `states` of their fibres
    (`fibre_states`), by the name of the model (`metabolics.MODELS`).
    """
    fibres = fibres_of(muscles)
    return {name: model(states, fibres) for name, model in MODELS.items()}


def excitations(time: Array, activation: Array) -> Array:
    """(T, 40) 0 to 1, that make an `activation` (T, 40) go from frame to frame as muscles do: the
    steps are of `forces.change_limits`.
    """
    fall, rise = change_limits(time)
    change = np.diff(activation, axis=0, append=activation[-1:])
    return np.asarray(np.clip(activation + change / np.where(change > 0.0, rise, fall), 0.0, 1.0))


def leg_rates(
    time: Array, leg: LegForces, *, dynamics_of_activation: bool = False
) -> dict[str, Array]:
    """(T,) W of all muscles of a `leg` together, by the name of the model; `dynamics_of_activation`
    as for `fibre_states`.
    """
    states = fibre_states(
        time, leg.muscles, leg.activation, leg.force, leg.passive, leg.fibre,
        dynamics_of_activation=dynamics_of_activation,
    )  # fmt: skip
    rates = muscle_rates(leg.muscles, states)
    return {name: each.total.sum(axis=1) for name, each in rates.items()}


__all__ = ["excitations", "fibre_states", "fibres_of", "leg_rates", "muscle_rates"]
