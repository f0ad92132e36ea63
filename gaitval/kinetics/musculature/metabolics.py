"""Metabolic rate of muscles: heat and work by the models of Bhargava, Umberger and Uchida.

Each model is of one muscle at one instant: what its activation, its length and speed and its force
cost. With `smoothing` they are those of Falisse et al. (2019) J R Soc Interface 16:20190402, whose
public implementation (antoinefalisse/3dpredictsim, MIT) they equal to 1e-9 on the same states
(`tests/muscles/test_metabolics.py`); without, the steps are sharp, as in OpenSim's probes.

* Bhargava et al. (2004) J Biomech 37:81-88: heat of activation and of maintenance by slow and fast
  fibres, of shortening and lengthening by force, and positive work;
* Umberger (2010) J R Soc Interface 7:1329-1340: heat of activation and maintenance together, of
  shortening and lengthening by speed, and positive work;
* Uchida et al. (2016) PLoS ONE 11:e0150378: as Umberger, with orderly recruitment of the fibres,
  and negative work taken off.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.kinetics.musculature.curves import FASTEST


@dataclass(frozen=True)
class Metabolism:
    """Constants of the metabolic cost."""

    density: float = 1059.7
    """kg/m³ of muscle: the default of OpenSim's probes."""
    rest: float = 1.2
    """W/kg of the body, of a person at rest: the default of OpenSim's probes and of Falisse et al.;
    the 3.5 ml of oxygen a minute and kg that the American College of Sports Medicine takes are as
    much."""
    aerobic: float = 1.5
    """Factor on the heat of Umberger's and Uchida's models: for activity of some length."""
    unknown_slow: float = 0.5
    """Of muscles that they do not have, as there."""


METABOLISM: Final = Metabolism()


SLOW_TWITCH: Final[Mapping[str, float]] = {
    **dict.fromkeys(("glmax1", "glmax2", "glmax3", "glmed1", "glmed2", "glmed3"), 0.55),
    **dict.fromkeys(("glmin1", "glmin2", "glmin3"), 0.55),
    **dict.fromkeys(("addmagDist", "addmagIsch", "addmagMid", "addmagProx"), 0.552),
    **dict.fromkeys(("tibpost", "fdl", "fhl", "perbrev", "perlong"), 0.60),
    **dict.fromkeys(("edl", "ehl"), 0.75),
    "semimem": 0.4925,
    "semiten": 0.425,
    "bflh": 0.5425,
    "bfsh": 0.529,
    "recfem": 0.3865,
    "vasmed": 0.503,
    "vasint": 0.543,
    "vaslat": 0.455,
    "gasmed": 0.566,
    "gaslat": 0.507,
    "soleus": 0.803,
    "tibant": 0.70,
}
"""Share of slow fibres by muscle, of Uchida et al. (2016) as `getSlowTwitchRatios.m` of
3dpredictsim has them."""


@dataclass(frozen=True)
class Fibres:
    """What muscles are made of; arrays (m,).

    Attributes
    ----------
    mass : kg.
    slow : share of slow fibres, 0 to 1.
    max_force : N.
    optimal : m, optimal length.
    """

    mass: Array
    slow: Array
    max_force: Array
    optimal: Array


@dataclass(frozen=True)
class FibreStates:
    """What fibres do; arrays (…, m).

    Attributes
    ----------
    excitation, activation : 0 to 1.
    length : optimal lengths.
    speed : m/s, positive while they lengthen.
    active : N along the fibre, of the contractile element.
    passive : N along the fibre.
    isometric : force that their length allows, isometric and fully active, over `max_force`.
    """

    excitation: Array
    activation: Array
    length: Array
    speed: Array
    active: Array
    passive: Array
    isometric: Array


@dataclass(frozen=True)
class MuscleRates:
    """W of each muscle, (…, m).

    Attributes
    ----------
    activation : heat of activation and maintenance.
    shortening : heat of shortening and lengthening, which is raised where the total would be
        negative.
    work : of the fibres, as far as the model counts it.
    total : heat, which is not below 1 W/kg of muscle, and work.
    """

    activation: Array
    shortening: Array
    work: Array
    total: Array


def slow_shares(names: tuple[str, ...]) -> Array:
    """(m,) share of slow fibres of the muscles `names`."""
    return np.array([SLOW_TWITCH.get(name, METABOLISM.unknown_slow) for name in names])


def _step(values: Array, smoothing: float | None) -> Array:
    """1 where `values` are positive, else 0; with `smoothing`, by a hyperbolic tangent."""
    if smoothing is None:
        return np.asarray(values > 0.0, dtype=float)
    return np.asarray(0.5 + 0.5 * np.tanh(smoothing * values))


def _summed(
    kept: Array, moving: Array, work: Array, mass: Array, smoothing: float | None
) -> MuscleRates:
    """W from the W/kg of `kept` and `moving` heat and `work`: the heat is not below 1 W/kg."""
    heat = kept + moving
    heat = heat + (1.0 - heat) * _step(1.0 - heat, smoothing)
    return MuscleRates(kept * mass, moving * mass, work * mass, (heat + work) * mass)


def bhargava(state: FibreStates, fibres: Fibres, *, smoothing: float | None = None) -> MuscleRates:
    """Rates by Bhargava et al. (2004), with lengthening heat and without negative work."""
    slow = fibres.slow * np.sin(0.5 * np.pi * state.excitation)
    fast = (1.0 - fibres.slow) * (1.0 - np.cos(0.5 * np.pi * state.excitation))
    activation = 40.0 * slow + 133.0 * fast
    maintenance = state.length * (74.0 * slow + 111.0 * fast)
    total_force = state.active + state.passive
    isometric = state.activation * state.isometric * fibres.max_force
    shortening = 0.16 * isometric + 0.18 * total_force
    longer = _step(state.speed, smoothing)
    slope = shortening + (0.157 * total_force - shortening) * longer
    moving = -slope * state.speed
    work = -state.active * state.speed * (1.0 - longer)
    kept = fibres.mass * (activation + maintenance)
    left = kept + moving + work
    moving = moving - left * _step(-left, smoothing)
    with np.errstate(invalid="ignore", divide="ignore"):
        specific = [np.nan_to_num(each / fibres.mass) for each in (kept, moving, work)]
    return _summed(specific[0], specific[1], specific[2], fibres.mass, smoothing)


def _umberger(
    state: FibreStates,
    fibres: Fibres,
    slow: Array,
    lengthening: float,
    *,
    negative_work: bool,
    smoothing: float | None,
) -> MuscleRates:
    """`slow` is the share of slow fibres among those recruited; `lengthening` heat is so many times
    the shortening heat of slow fibres.
    """
    fast = 1.0 - slow
    falling = _step(state.activation - state.excitation, smoothing)
    # Above the excitation, the activation is on its way down: the mean of both counts.
    active = state.excitation + (state.activation - state.excitation) / 2.0 * falling
    if smoothing is None:
        active = np.where(falling > 0.0, active, state.excitation)
    long = _step(state.length - 1.0, smoothing)
    heat = 128.0 * fast + 25.0
    heat = heat + (-0.6 * heat + 0.6 * heat * state.isometric) * long
    kept = heat * active**0.6 * METABOLISM.aerobic
    rate = state.speed / fibres.optimal
    shorter = 1.0 - _step(rate, smoothing)
    of_fast, of_slow = 153.0 / FASTEST, 100.0 / (FASTEST / 2.5)
    more = lengthening * of_slow * rate
    moving = more + (-more - of_slow * rate * slow - of_fast * rate * fast) * shorter
    scaled = moving * active * METABOLISM.aerobic
    scaled = scaled + (moving * active**2 * METABOLISM.aerobic - scaled) * shorter
    moving = scaled * (1.0 - long) + scaled * state.isometric * long
    with np.errstate(invalid="ignore", divide="ignore"):
        work = np.nan_to_num(-state.active * state.speed / fibres.mass)
    if negative_work:
        left = kept + moving + work
        moving = moving - left * _step(-left, smoothing)
    else:
        work = work * shorter
    return _summed(kept, moving, work, fibres.mass, smoothing)


def umberger(state: FibreStates, fibres: Fibres, *, smoothing: float | None = None) -> MuscleRates:
    """Rates by Umberger (2010): without negative work, little heat of lengthening."""
    return _umberger(state, fibres, fibres.slow, 0.3, negative_work=False, smoothing=smoothing)


def uchida(state: FibreStates, fibres: Fibres, *, smoothing: float | None = None) -> MuscleRates:
    """Rates by Uchida et al. (2016): slow fibres first, with negative work."""
    slow = fibres.slow * np.sin(0.5 * np.pi * state.excitation)
    fast = (1.0 - fibres.slow) * (1.0 - np.cos(0.5 * np.pi * state.excitation))
    some = _step(state.excitation, smoothing)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(slow + fast > 0.0, slow / (slow + fast), 1.0)
    recruited = 1.0 + (share - 1.0) * some
    return _umberger(state, fibres, recruited, 4.0, negative_work=True, smoothing=smoothing)


MuscleModel = Callable[..., MuscleRates]

MODELS: Final[Mapping[str, MuscleModel]] = {
    "bhargava": bhargava,
    "umberger": umberger,
    "uchida": uchida,
}
"""Metabolic models of muscles by name."""
