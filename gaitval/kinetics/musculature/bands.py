"""How sure muscle forces and contact forces are: bands by drawing again what is not known.

What a draw changes: the criterion (`CRITERIA_OF_BANDS`, one for each draw), the strength of each
muscle and of all, slack lengths, moment arms, the hip's centre, where the middle of the knee and
its plateaus are, the moments, that which tilts the knee included, and a tone that no muscle goes
below, which stands for some co-contraction. Bands are the central 90 % of the draws.
Patients who stiffen a joint by far more than a tone are not in them.
"""

from dataclasses import dataclass, fields, replace
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array, spread_out
from gaitval.constants import GRAVITY
from gaitval.kinetics.musculature.contact import Contact, contact, knee_middle
from gaitval.kinetics.musculature.forces import (
    LegForces,
    MuscleForces,
    capacity_shares,
    change_limits,
    rate,
)
from gaitval.kinetics.musculature.mapping import LegLoads
from gaitval.kinetics.musculature.paths import COORDINATES, JOINTS, Geometry, geometry
from gaitval.kinetics.musculature.pelvis_zero import PELVIS
from gaitval.kinetics.musculature.person import LegMuscles
from gaitval.kinetics.musculature.sharing import CRITERIA, Criterion

CRITERIA_OF_BANDS: Final = (
    *("contact", "contact by volume", "contact", "squares"),
    *("contact by volume", "contact", "contact by volume", "spared knee"),
    *("contact", "contact by volume", "contact", "volume"),
    *("contact by volume", "contact", "contact by volume", "cubes"),
)
"""In turn: three quarters of the draws for little contact force, by squares or by volume, the rest
for little effort alone or a spared knee. Hips say how likely each is: those of ten people with
implants are 2.47 body weights (OrthoLoad), and the ten built-in people's come out at 3.3 and 3.5
with contact forces in the criterion, at 3.8 with effort alone."""

WEIGHTS_OF_CONTACT: Final = (0.03, 1.0)
"""Range of the weights of hip and knee force in a draw for little contact force: from 0.03 to 1 the
walkers' activations are as near to Perry's EMG (correlations of 0.44 to 0.48, see `CRITERIA`)."""


@dataclass(frozen=True)
class Spreads:
    """Standard deviations of what is drawn.

    Attributes
    ----------
    strength : of the logarithm of all muscles' force together.
    each_strength : likewise, of each muscle by itself.
    slack : of tendon slack lengths, fraction of the optimal fibre's length.
    arms : of each arm, fraction of it, about each coordinate.
    hip : m, of the hip's centre, each axis.
    moment : Nm/kg, of each moment while the leg is loaded; in swing a quarter of it.
    moment_time : s, over which an error of a moment changes.
    pelvis_zero : rad, of the angle of the pelvis at which muscles are as long as published.
    mass : of the logarithm of the mass of a stranger's scales, of moments and of strength.
    weights : not a deviation: what part of `WEIGHTS_OF_CONTACT` is drawn, 0 to 1.
    knee : m, of the middle of the knee to the side, where markers show it; `knee_unseen` where none
        does.
    plateaus : of the logarithm of the distance of the points of contact of a knee.
    tone : mean of the least activation, which is drawn from an exponential distribution.
    model_share, model_force : of contact forces, what such models were off by at implants: the
        logarithm of a factor, and body weights.
    model_hip : likewise the logarithm of a factor, of hip forces.
    model_split : likewise, body weights that one plateau carries instead of the other.
    """

    strength: float = 0.20
    each_strength: float = 0.20
    slack: float = 0.05
    arms: float = 0.10
    hip: float = 0.010
    moment: float = 0.06
    moment_time: float = 0.10
    pelvis_zero: float = PELVIS.shapes
    mass: float = 0.01
    weights: float = 1.0
    knee: float = 0.005
    knee_unseen: float = 0.007
    plateaus: float = 0.10
    tone: float = 0.01
    model_share: float = 0.12
    model_hip: float = 0.20
    model_force: float = 0.10
    model_split: float = 0.13


SPREADS: Final[Spreads] = Spreads()
"""Adults: strengths of people of equal size differ by about a quarter (Handsfield et al. 2014:
volumes of single muscles by 10 to 20 % after mass and stature); slack lengths are known to a few
hundredths of the fibre (Ackland et al. 2012); arms of a scaled model to a tenth (Scheys et al.
2008); hip centres by regression to a centimetre (Harrington et al. 2007); the plane of the ASIS and
PSIS is tilted by 5 degrees more or less in pelves that lie alike (Preece et al. 2008, read about).
The moments' is what
docs/how-to/measurement.md finds against five people whose truth is known; give their own where it
is known; the moment that tilts the knee is as uncertain as the others. A knee's middle is known as
well as two palpated epicondyles (5 mm); where they have no markers, as people's knees differ
(`knee_middles` at 60ee3cba: 7 mm). Points of contact are 38 to 46 mm apart in people and
implants (`contact.PLATEAUS`), and the bones' sizes add to that. 0.01 is the tone that OpenSim
assumes of everybody. The last three are no knowledge of the parts: at implanted knees of other
people such models are 0.3 to 0.5 body weights off. For each plateau that is as much as for both
together (medial, lateral, total: 0.26, 0.42, 0.51 body weights, Thelen et al. 2014; 292, 248 and
281 N, Third Grand Challenge, PMC3627216), so what one carries for the other is off by 0.29. The
parts above make 0.26 of it in the ten walkers (`knee_middles` at 60ee3cba), `model_split` the
rest. Of hips with implants, with the patients' own motion, peaks are off by 14 to 18, 24 to 28 and
17 to 35 % in three people at three speeds (doi 10.3389/fbioe.2022.995279, abstract), by 0.06 to
0.08 body weights in one (doi 10.1016/j.jbiomech.2023.111767, abstract): 20 % RMS."""


@dataclass(frozen=True)
class Draws:
    """Draws of one leg: D draws, T frames.

    Attributes
    ----------
    criteria : (D,) name of each draw's criterion.
    activation, force : (D, T, 40).
    hip, knee, patella, ankle : (D, T) N, sizes of contact forces.
    compression, medial, lateral : (D, T) N, of the knee.
    """

    criteria: tuple[str, ...]
    activation: Array
    force: Array
    hip: Array
    knee: Array
    patella: Array
    ankle: Array
    compression: Array
    medial: Array
    lateral: Array

    def band(self, name: str, share: float = 0.90) -> Array:
        """(2, T, …) lowest and highest of the central `share` of the draws of an attribute."""
        edges = [(1.0 - share) / 2, (1.0 + share) / 2]
        return np.asarray(np.quantile(getattr(self, name), edges, axis=0))


def draw(
    found: MuscleForces,
    side: str,
    *,
    draws: int = 200,
    spreads: Spreads = SPREADS,
    seed: int = 1,
) -> Draws:
    """Share the moments of one leg of `found` again, `draws` times with other values of what is
    not known. Frames in which nothing was shared are NaN.
    """
    whole: LegForces = found.legs[side]  # type: ignore[index]
    rows = np.flatnonzero(whole.known)
    if len(rows) == len(found.time):
        return _draw(found, whole, draws, spreads, seed)
    drawn = _draw(replace(found, time=found.time[rows]), whole.part(rows), draws, spreads, seed)
    every = {each.name: getattr(drawn, each.name) for each in fields(drawn)}
    moved = {
        name: spread_out(values, rows, len(found.time), axis=1)
        for name, values in every.items()
        if isinstance(values, np.ndarray)
    }
    return replace(drawn, **moved)  # type: ignore[arg-type]


def _draw(
    found: MuscleForces,
    leg: LegForces,
    draws: int,
    spreads: Spreads,
    seed: int,
) -> Draws:
    """`draw` of the `leg` of `found`, all of whose frames are known."""
    published = geometry(leg.loads.angles)
    random = np.random.default_rng(seed)
    weight = found.mass_kg * GRAVITY
    parts: list[tuple[Array, Array, Contact]] = []
    order = [CRITERIA_OF_BANDS[i % len(CRITERIA_OF_BANDS)] for i in range(draws)]
    speed = rate(found.time, leg.length)
    limits = change_limits(found.time) if found.dynamics_of_activation else (1.0, 1.0)
    for name in order:
        drawn = _drawn_leg(found, leg, published, speed, spreads, random)
        muscles, loads, paths = drawn.muscles, drawn.loads, drawn.paths
        shared = capacity_shares(
            drawn.length,
            drawn.speed,
            drawn.arms,
            loads,
            paths,
            muscles,
            _drawn_weights(CRITERIA[name], spreads.weights, random),
            weight,
            lowest=min(spreads.tone * random.exponential(), 0.1),
            limits=limits,
        )
        doubt = spreads.knee_unseen if loads.knee_aside is None else spreads.knee
        aside = knee_middle(loads, muscles.sizes) + doubt * random.normal()
        carried = contact(
            replace(loads, knee_aside=aside),
            paths,
            shared.force,
            muscles.sizes,
            wider=float(np.exp(spreads.plateaus * random.normal())),
        )
        parts.append((shared.activation, shared.force, carried))
    contacts = [part[2] for part in parts]
    share = random.normal(size=(draws, 1))
    factor, of_hip = np.exp(spreads.model_share * share), np.exp(spreads.model_hip * share)
    more = spreads.model_force * weight * random.normal(size=(draws, 1))
    over = spreads.model_split * weight * random.normal(size=(draws, 1))

    def off(sizes: list[Array], extra: Array = more, by: Array = factor) -> Array:
        return np.maximum(by * np.stack(sizes) + extra, 0.0)

    return Draws(
        criteria=tuple(order),
        activation=np.stack([part[0] for part in parts]),
        force=np.stack([part[1] for part in parts]),
        **{
            name: off([each.size(name) for each in contacts])
            for name in ("knee", "patella", "ankle")
        },
        hip=off([each.size("hip") for each in contacts], by=of_hip),
        compression=off([each.compression for each in contacts]),
        medial=off([each.medial for each in contacts], more / 2 + over),
        lateral=off([each.lateral for each in contacts], more / 2 - over),
    )


class _DrawnLeg(NamedTuple):
    """A leg with other muscles, loads and paths."""

    muscles: LegMuscles
    loads: LegLoads
    paths: Geometry
    length: Array
    speed: Array
    arms: Array


def _drawn_leg(
    found: MuscleForces,
    leg: LegForces,
    paths: Geometry,
    speed: Array,
    spreads: Spreads,
    random: np.random.Generator,
) -> _DrawnLeg:
    muscles, loads = leg.muscles, leg.loads
    count = len(muscles.names)
    log_force = spreads.each_strength * random.normal(size=count)
    log_force += spreads.strength * random.normal()
    slack = spreads.slack * random.normal(size=count) * muscles.optimal_fibre
    muscles = replace(
        muscles,
        max_force=muscles.max_force * np.exp(log_force),
        tendon_slack=muscles.tendon_slack + slack,
    )
    length, own_arms = leg.length, leg.arms
    if spreads.pelvis_zero:
        angles = loads.angles.copy()
        angles[:, 0] += spreads.pelvis_zero * random.normal()
        paths = geometry(angles)
        length = paths.length @ muscles.sizes.factors
        own_arms = -(paths.slope @ muscles.sizes.factors)
        speed = rate(found.time, length)
    arms = own_arms * (1.0 + spreads.arms * random.normal(size=(count, len(COORDINATES))))
    shift = spreads.hip * random.normal(size=3)
    moments = loads.moments + loads.moment_per_shift @ shift
    moments = moments * np.exp(spreads.mass * random.normal())
    error = spreads.moment * found.mass_kg * _wandering(found.time, spreads.moment_time, random)
    error = error * _loaded(loads)
    loads = replace(
        loads,
        moments=moments + error[:, : len(COORDINATES)],
        moment=_tilted(loads.moment, error[:, -1]),
    )
    return _DrawnLeg(muscles, loads, paths, length, speed, arms)


def _tilted(moment: Array, error: Array) -> Array:
    """`LegLoads.moment` with an `error` (T,) Nm of that which tilts the knee, about the axis
    forward.
    """
    found = moment.copy()
    found[:, JOINTS.index("knee"), 0] += error
    return found


def _drawn_weights(criterion: Criterion, part: float, random: np.random.Generator) -> Criterion:
    """A `criterion` of contact forces with other weights of them, even in their logarithms: so much
    of the way (`part`) from its own to those of `WEIGHTS_OF_CONTACT`.
    """
    low, high = np.log(WEIGHTS_OF_CONTACT)
    drawn = random.uniform(low, high, size=2)
    if not (criterion.knee and criterion.hip):
        return criterion
    own = np.log([criterion.knee, criterion.hip])
    knee, hip = np.exp(own + part * (drawn - own))
    return replace(criterion, knee=float(knee), hip=float(hip))


def _wandering(time: Array, scale: float, random: np.random.Generator) -> Array:
    """(T, 7) of unit variance, correlated over `scale` s: one for each coordinate, and for the
    moment that tilts the knee.
    """
    knots = np.arange(time[0] - 3 * scale, time[-1] + 3 * scale, scale / 2)
    near = np.exp(-0.5 * ((time[:, None] - knots) / scale) ** 2)
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    return np.asarray(near @ random.normal(size=(len(knots), len(COORDINATES) + 1)))


def _loaded(loads: LegLoads) -> Array:
    """(T, 1) 1/4 to 1: an error of moments grows with the load on the leg."""
    size = np.linalg.norm(loads.force[:, -1], axis=1)
    share = np.minimum(2.0 * size / max(float(size.max(initial=0.0)), 1e-9), 1.0)
    return np.asarray(np.maximum(share, 0.25)[:, None])


__all__ = ["CRITERIA_OF_BANDS", "SPREADS", "Draws", "Geometry", "Spreads", "draw"]
