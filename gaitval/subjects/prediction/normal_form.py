"""Gaits as numbers that can be added and averaged.

Records of different people and speeds become comparable: speed and stride time without dimension
(`gait.dimensionless`), curves by percent of the gait cycle. Everything predicted without a
model is a linear combination of such numbers. (Forces by percent of stance instead predict other
people's forces worse: they rise and fall with the other foot's step.)
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.gait.dimensionless import speed_unit, time_unit
from gaitval.gait.mean_curves import TOLERANCES
from gaitval.gait.record import (
    HARMONICS,
    REQUIRED_ANGLES,
    REQUIRED_MOMENTS,
    GaitRecord,
    fit_periodic,
    periodic_through,
)

SAMPLES = 100
_CYCLE = np.arange(SAMPLES) / SAMPLES
TO_MIDLINE = {"right": np.array([1.0, 1.0, 1.0]), "left": np.array([1.0, -1.0, 1.0])}
"""Signs of a foot's force in the world (x forward, y left, z up) that make it forward, to the
midline and up."""


@dataclass(frozen=True)
class NormalForm:
    """A gait without dimension; n is `SAMPLES`.

    Attributes
    ----------
    speed, stride_time : in units of the leg (`gait.dimensionless`).
    left_phase : as `GaitRecord.left_phase`.
    stance : (2,) stance fractions, right and left.
    angles : (18, n) rad, `REQUIRED_ANGLES` by percent of each side's cycle.
    moments : (8, n) `REQUIRED_MOMENTS` likewise, in `moment_units`.
    forces : (2, n, 3) body weights likewise, zero in swing: forward, towards the midline, up.
    """

    speed: float
    stride_time: float
    left_phase: float
    stance: Array
    angles: Array
    moments: Array
    forces: Array


def moment_units(leg_length: float) -> Array:
    """(8, 1) Nm/kg that one of each of `NormalForm.moments` is on legs of `leg_length`, m: an
    ankle's, whose lever is the foot, gravity times leg length (Hof 1996). By it nine of the ten
    people predict the tenth's ankle better (RMS 0.081, not 0.100 Nm/kg); no knee or hip gains.
    """
    ankle = [name.startswith("ankle") for name in REQUIRED_MOMENTS]
    return np.where(ankle, GRAVITY * leg_length, 1.0)[:, None]


def normal_form(record: GaitRecord, leg_length: float) -> NormalForm:
    """A `record` with moments and forces without dimension, on legs of `leg_length`, m."""
    return NormalForm(
        speed=record.speed / speed_unit(leg_length),
        stride_time=record.stride_time / time_unit(leg_length),
        left_phase=record.left_phase,
        stance=np.array([record.stance_fraction[side] for side in SIDES]),
        angles=np.array([record.angles[name](_CYCLE) for name in REQUIRED_ANGLES]),
        moments=np.array([record.moments[name](_CYCLE) for name in REQUIRED_MOMENTS])
        / moment_units(leg_length),
        # Towards the midline is left (+y) for the right foot and right (-y) for the left one.
        forces=np.array(
            [record.ground_reaction(side, _CYCLE) * TO_MIDLINE[side] for side in SIDES]
        ),
    )


def combined(gaits: Sequence[NormalForm], weights: Array) -> NormalForm:
    """The sum of n gaits times weights (n,), number by number: an average if the weights add up to
    one, a change of gait if they add up to zero.
    """

    def total(name: str) -> Array:
        return np.asarray(np.tensordot(weights, [getattr(gait, name) for gait in gaits], 1))

    return NormalForm(
        float(total("speed")),
        float(total("stride_time")),
        float(total("left_phase")),
        *(total(each.name) for each in fields(NormalForm)[3:]),
    )


def symmetric(gait: NormalForm) -> NormalForm:
    """The mean of `gait` and its mirror image: both sides are equal, half a cycle apart."""

    def sides(values: Array) -> Array:
        # all of the right come first, then all of the left in the same order
        mean = 0.5 * (values[: len(values) // 2] + values[len(values) // 2 :])
        return np.concatenate([mean, mean])

    return NormalForm(
        gait.speed,
        gait.stride_time,
        0.5,
        sides(gait.stance),
        sides(gait.angles),
        sides(gait.moments),
        sides(gait.forces),
    )


def record_from(gait: NormalForm, leg_length: float) -> GaitRecord:
    """The record of a dimensionless `gait` on legs of `leg_length`, m."""
    forces, stance = {}, {}
    for i, side in enumerate(SIDES):
        values = gait.forces[i] * TO_MIDLINE[side]
        # A force is fitted over stance alone, from heel strike on, and the sample that ends the
        # cycle is the first one again.
        rows = np.concatenate([values, values[:1]])
        # In an average of several gaits the force fades out after the mean end of stance.
        stance[side] = float(gait.stance[i])
        on = np.append(np.arange(int(stance[side] * SAMPLES) + 1), SAMPLES)
        series = [
            fit_periodic(on / SAMPLES, each, TOLERANCES.force_tolerance)[0] for each in rows[on].T
        ]
        forces[side] = (series[0], series[1], series[2])
    moments = moment_units(leg_length) * gait.moments
    return GaitRecord(
        speed=float(gait.speed * speed_unit(leg_length)),
        stride_time=float(gait.stride_time * time_unit(leg_length)),
        left_phase=float(gait.left_phase),
        stance_fraction=stance,
        angles={
            name: periodic_through(values, HARMONICS.harmonics_cap)
            for name, values in zip(REQUIRED_ANGLES, gait.angles, strict=True)
        },
        moments={
            name: periodic_through(values, HARMONICS.harmonics_cap)
            for name, values in zip(REQUIRED_MOMENTS, moments, strict=True)
        },
        forces=forces,
    )
