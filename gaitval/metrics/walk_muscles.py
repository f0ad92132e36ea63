"""A simulated walk as a motion whose moments are known, for its muscles."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import RecordSettings
from gaitval.coordinates import SIDES, Side
from gaitval.gait.filters import low_pass_simulated
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics, inverse_dynamics
from gaitval.kinetics.musculature.gait import SAMPLED, LoadedMotion
from gaitval.kinetics.musculature.paths import COORDINATES
from gaitval.metrics.cycles import GaitCycles, step_of, walking_speed
from gaitval.model.body import BodyModel
from gaitval.model.parameters import apply_parameters
from gaitval.subjects.prediction.slopes import body_without
from gaitval.subjects.subject import Subject
from gaitval.walk.simulation.rollout import Rollout

CUTOFF: Final = 10.0
"""Hz, of the zero-lag filter on motion and forces: the same on both, or impacts would show."""

LEAST_N: Final = 20.0
"""Vertical force below which a foot is off the ground: the filter spreads a force."""


def lost_joints(subject: Subject) -> dict[Side, Collection[str]]:
    """Coordinates of the joints of a leg that a prosthesis of the `subject` has: those of hinges
    without muscles of its devices, and the whole leg where only its side is known.
    """
    found: dict[Side, set[str]] = {}
    for device in subject.devices:
        for side in device.sides:
            gone = {each.joint for each in device.hinges if not each.muscles}
            found.setdefault(side, set()).update(gone)
    for side in SIDES:
        if subject.prosthesis == side and not found.get(side):
            found[side] = set(COORDINATES)
    return {side: gone for side, gone in found.items() if gone}


def person_and_laden(
    model: BodyModel, mu: Array, settings: RecordSettings
) -> tuple[BodyModel, BodyModel | None]:
    """The person's own body of a walk of `model` with parameters `mu`, and that with the load of
    `settings`, None without one: `model` and `laden` of `walk_motion`.
    """
    person = body_without(model, settings)
    laden = None if person is model else apply_parameters(model, mu)
    return apply_parameters(person, mu), laden


def walk_motion(
    rollout: Rollout,
    cycles: GaitCycles,
    model: BodyModel,
    *,
    height: float,
    name: str = "walk",
    lost: Mapping[Side, Collection[str]] | None = None,
    torques: Array | None = None,
    laden: BodyModel | None = None,
) -> LoadedMotion:
    """The `cycles` of a `rollout` of the body `model`, with its parameters mu, of a person of
    `height` m; `laden` is the body with what the person wears, whose moments the muscles make
    (`person_and_laden` has both).

    `lost` are coordinates of joints that a prosthesis has. `torques` (T, 25) Nm are of devices at
    the joints; the muscles have to make what is left.
    """
    dynamics, positions = walk_dynamics(rollout, model if laden is None else laden)
    assist = None
    if torques is not None:
        given = low_pass_simulated(torques, step=step_of(rollout), frequency=CUTOFF)
        assist = given[_thinned(step_of(rollout))]
    return LoadedMotion(
        name=name,
        model=model if laden is None else replace(model, ground=laden.ground),
        height=height,
        positions=positions,
        dynamics=dynamics,
        cycles={
            side: [
                (float(rollout.time[a]), float(rollout.time[b]))
                for a, b in zip(cycles.starts[side], cycles.ends[side], strict=True)
                if b < len(rollout.time)
            ]
            for side in SIDES
        },
        lost=lost or {},
        assist=assist,
        speed=walking_speed(rollout, cycles),
        laden=laden,
    )


def _thinned(step: float) -> slice:
    return slice(None, None, max(1, round(1.0 / (step * SAMPLED.rate))))


def walk_dynamics(rollout: Rollout, model: BodyModel) -> tuple[InverseDynamics, Array]:
    """Inverse dynamics of a `rollout` at about `SAMPLED.rate`, and its low-passed positions (T,
    31).
    """
    step = step_of(rollout)
    every = _thinned(step)
    positions = low_pass_simulated(rollout.positions, step=step, frequency=CUTOFF)[every]
    force = low_pass_simulated(rollout.ground_reaction, step=step, frequency=CUTOFF)
    point = rollout.centre_of_pressure.copy()
    for foot in range(2):
        known = np.isfinite(point[:, foot, 0])
        if known.any():
            for axis in range(3):
                values = np.interp(rollout.time, rollout.time[known], point[known, foot, axis])
                point[:, foot, axis] = low_pass_simulated(values, step=step, frequency=CUTOFF)
        point[force[:, foot, 2] <= LEAST_N, foot] = np.nan
    free = np.zeros_like(force)
    free[..., 2] = low_pass_simulated(rollout.free_moment, step=step, frequency=CUTOFF)
    time = rollout.time[every]
    found = inverse_dynamics(model, time, positions, force[every], point[every], free[every])
    return found, positions
