"""How computed muscles and hips are held against electromyograms and implants."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.kinetics.musculature.forces import LegForces
from gaitval.kinetics.musculature.gait import GROUPS, LegGait
from gaitval.kinetics.musculature.paths import table

DELAY: Final = 4
"""% of the cycle from an electromyogram to what a muscle without dynamics would have to do."""
ON, OF_PEAK, OF_EMG = 0.02, 0.25, 5.0
"""A muscle is on above both of the first, activation and part of its peak; Perry's above the last,
percent."""
WITHIN: Final = 10.0
"""% of the cycle, by which a muscle's timing may be off."""

MUSCLES: Final[Mapping[str, tuple[str, ...]]] = {
    "AdductorLongus": ("addlong",),
    "AdductorMagnus": ("addmagDist", "addmagIsch", "addmagMid", "addmagProx"),
    "BicepsFemorisLongHead": ("bflh",),
    "BicepsFemorisShortHead": ("bfsh",),
    "ExtensorDigitorumLongus": ("edl",),
    "ExtensorHallucisLongus": ("ehl",),
    "FlexorDigitorumLongus": ("fdl",),
    "FlexorHallucisLongus": ("fhl",),
    "Gastrocnemius": ("gasmed", "gaslat"),
    "GluteusMaximusLower": ("glmax3",),
    "GluteusMaximusUpper": ("glmax1",),
    "GluteusMedius": ("glmed1", "glmed2", "glmed3"),
    "Gracilis": ("grac",),
    "Iliacus": ("iliacus",),
    "PeroneusBrevis": ("perbrev",),
    "PeroneusLongus": ("perlong",),
    "RectusFemoris": ("recfem",),
    "Sartorius": ("sart",),
    "Semimembranosus": ("semimem",),
    "Semitendinosus": ("semiten",),
    "Soleus": ("soleus",),
    "TensorFasciaLata": ("tfl",),
    "TibialisAnterior": ("tibant",),
    "TibialisPosterior": ("tibpost",),
    "VastusIntermedius": ("vasint",),
    "VastusLateralis": ("vaslat",),
    "VastusMedialisLongus": ("vasmed",),
}
"""Columns of Perry and Burnfield's electromyograms, and the muscles that they are of."""

NINE: Final[Mapping[str, str]] = {
    "gluteus_maximus": "GluteusMaximusUpper",
    "gluteus_medius": "GluteusMedius",
    "iliopsoas": "Iliacus",
    "hamstrings": "Semimembranosus",
    "rectus_femoris": "RectusFemoris",
    "vasti": "VastusLateralis",
    "gastrocnemius": "Gastrocnemius",
    "soleus": "Soleus",
    "tibialis_anterior": "TibialisAnterior",
}
"""Column of each of `gait.GROUPS`."""


def perry(path: Path) -> dict[str, Array]:
    """Each column of Perry and Burnfield's table, % of the largest manual test at 0, 1, … 100 % of
    the cycle, `DELAY` later.
    """
    with path.open() as file:
        rows = list(csv.DictReader(file))
    percent = [float(row["percent_gait_cycle"]) for row in rows]
    return {
        name: np.roll(
            np.interp(np.arange(101.0), percent, [float(r[name] or 0) for r in rows]), DELAY
        )
        for name in MUSCLES
    }


def together(legs: Sequence[LegGait], muscles: Sequence[str]) -> Array:
    """(101,) mean activation of `muscles`, which count by their strength, over `legs`."""
    which = [table().names.index(name) for name in muscles]
    strength = legs[0].strengths[which]
    mean = np.mean([leg.activation[which] for leg in legs], axis=0)
    return np.asarray(strength @ mean / strength.sum())


def on_and_off(activation: Array, seen: Array) -> tuple[float, float]:
    """Share of the cycle in which both are on or both are off, and that by chance."""
    on, also = activation > max(ON, OF_PEAK * activation.max()), seen > OF_EMG
    chance = on.mean() * also.mean() + (1 - on.mean()) * (1 - also.mean())
    return float((on == also).mean()), float(chance)


def off_in_time(activation: Array, seen: Array) -> float:
    """% of the cycle by which the centre of `activation` is later than that of `seen`: their mean
    phases on the circle, weighted by how active the muscle is.
    """
    turn = np.exp(2j * np.pi * np.arange(100) / 100)
    phases = [np.angle((np.asarray(each)[:100] * turn).sum()) for each in (activation, seen)]
    return float((100 * (phases[0] - phases[1]) / (2 * np.pi) + 50) % 100 - 50)


def in_time(legs: Sequence[LegGait], seen: Mapping[str, Array]) -> int:
    """How many of the nine groups are timed within `WITHIN`."""
    off = [
        off_in_time(together(legs, GROUPS[group][1]), seen[column])
        for group, column in NINE.items()
    ]
    return sum(abs(each) <= WITHIN for each in off)


def as_implants_say(leg: LegForces, time: Array, span: tuple[float, float], weight: float) -> float:
    """Hip force as OrthoLoad's ten people's is given (Bergmann et al. 2016, as collected by
    RWTHmediTEC/HipJointForceModel): length of the mean vector, of the femur, over 5 % of the cycle
    about each of the two peaks of stance; body weights.
    """
    at = span[0] + (span[1] - span[0]) * np.arange(101) / 100
    to_femur = Rotation.from_euler("ZXY", leg.loads.angles[:, :3]).inv()
    vectors = to_femur.apply(leg.contact.hip) / weight
    force = np.stack([np.interp(at, time, vectors[:, axis]) for axis in range(3)], axis=1)
    size = np.linalg.norm(force, axis=1)
    first, second = 2 + int(size[2:33].argmax()), 33 + int(size[33:68].argmax())
    both = [*range(first - 2, first + 3), *range(second - 2, second + 3)]
    return float(np.linalg.norm(force[both].mean(axis=0)))
