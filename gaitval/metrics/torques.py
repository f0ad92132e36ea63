"""What a walk's torques, toes and feet do that no comparison with a record can see.

Moments are compared below 10 Hz, at hip, knee and ankle; forces in three directions, without the
free moment. A walker is free in all else: its torques may ring, its toes may brake what its ankles
push, its feet may twist and creep.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit
from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, LUMBAR, RANGES, SIDES, split_side
from gaitval.gait.filters import low_pass_simulated
from gaitval.metrics.cycles import GaitCycles, step_of
from gaitval.metrics.tolerances import Measure, measured
from gaitval.metrics.unrecorded import RINGING_HZ
from gaitval.metrics.walk_muscles import CUTOFF
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.parameters import apply_parameters
from gaitval.model.tree import (
    SEGMENT_COUNT,
    Frames,
    Tree,
    empty_frames,
    forward,
    tree_arrays,
    velocities,
)
from gaitval.walk.contact.hunt_crossley import smooth_share
from gaitval.walk.simulation.rollout import Rollout

PERCENTILES: Final[Mapping[str, float]] = {"torque_rate": 99.9, "foot_creep": 95.0}
"""Of the rows of whole cycles, %, that stand for the largest value of a measure: convention."""
LOADED: Final = 0.5
"""Body weights on a foot from which its creep counts: neither landing nor leaving."""

AXES: Final = (
    *("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle"),
    *("subtalar_angle", *LUMBAR),
)
"""Coordinates, without side, whose moments are looked at above `RINGING_HZ`: every axis of hip,
knee, ankle and lumbar joint. Of two sides the worse counts."""


def _of_axes(values: Array) -> dict[str, float]:
    """The larger of both sides for each of `AXES`, of `values` (25,) of the joints."""
    found = dict.fromkeys(AXES, 0.0)
    for joint, value in zip(ACTUATED, values.tolist(), strict=True):
        name = split_side(joint)[1]
        if name in found:
            found[name] = max(found[name], value)
    return found


def moment_ringing(rollout: Rollout, rows: slice, mass: float) -> dict[str, float]:
    """RMS Nm/kg of the moments about each of `AXES` above `RINGING_HZ`, in `rows` of whole cycles
    of a `rollout`: by Parseval's theorem from the spectrum, without a filter. `mass` kg.
    """
    moments = rollout.moments[rows] / mass
    spectrum = np.abs(np.fft.rfft(moments, axis=0)) / len(moments)
    high = np.fft.rfftfreq(len(moments), step_of(rollout)) >= RINGING_HZ[0]
    # rfft keeps positive frequencies only; the negative ones have the same power.
    return _of_axes(np.sqrt(2.0 * np.sum(spectrum[high] ** 2, axis=0)))


def torque_rate(rollout: Rollout, rows: slice, mass: float) -> dict[str, float]:
    """`PERCENTILES` of how fast the moments about each of `AXES` change, Nm/kg/s, as they act;
    `rollout`, `rows` and `mass` as for `moment_ringing`.
    """
    change = np.abs(np.diff(rollout.moments[rows], axis=0)) / (mass * step_of(rollout))
    return _of_axes(np.percentile(change, PERCENTILES["torque_rate"], axis=0))


def joint_work(rollout: Rollout, rows: slice) -> Array:
    """(25,) J, net work of every joint in `rows` of a `rollout`: row by row what the engine did."""
    power = rollout.moments[rows] * rollout.velocities[rows, 6:]
    return np.asarray(power.sum(axis=0) * step_of(rollout))


def each_cycle(cycles: GaitCycles, side: int) -> Iterator[slice]:
    """Rows of each of the `cycles` of the foot of a `side`, 0 right and 1 left."""
    name = SIDES[side]
    for start, end in zip(cycles.starts[name], cycles.ends[name], strict=True):
        yield slice(int(start), int(end))


def toe_moment_peak(rollout: Rollout, cycles: GaitCycles, mass: float, side: int) -> float:
    """Mean over the `cycles` of a `side` (0 right, 1 left) of the largest size of the moment at
    the toes (metatarsophalangeal), Nm/kg, below `CUTOFF`.
    """
    column = ACTUATED.index(f"mtp_angle_{SIDES[side][0]}")
    moment = low_pass_simulated(rollout.moments[:, column], step=step_of(rollout), frequency=CUTOFF)
    peaks = [np.abs(moment[rows]).max() for rows in each_cycle(cycles, side)]
    return float(np.mean(peaks) / mass)


def free_moment_peak(
    rollout: Rollout, cycles: GaitCycles, mass: float, height: float, side: int
) -> float:
    """Mean over the `cycles` of a `side` of the largest size of the free moment under the foot,
    over weight x body `height` (m), below `CUTOFF`.
    """
    moment = low_pass_simulated(
        rollout.free_moment[:, side], step=step_of(rollout), frequency=CUTOFF
    )
    peaks = [np.abs(moment[rows]).max() for rows in each_cycle(cycles, side)]
    return float(np.mean(peaks) / (mass * GRAVITY * height))


@dataclass(frozen=True)
class GroundRows:
    """What the ground did to both feet, T rows.

    Attributes
    ----------
    power : (T, 2) W, of the ground on the right and the left foot with its toes, a foot in swing
        too, which the smooth contact law brakes by a newton or two up to 2 cm above the ground.
    slip : (T, 2) m/s, mean size of the slip of the spheres that are pressed in, weighted with the
        depth to the power of 1.5, as their force is.
    """

    power: Array
    slip: Array


@njit
def _ground_rows(
    tree: Tree, feet: Array, rollout: tuple[Array, ...], power: Array, slip: Array
) -> None:
    positions, rates, forces, centres, free = rollout
    frames, mean, load, near = empty_frames(), np.zeros((2, 3)), np.zeros(2), np.zeros(2)
    r, arm, along = np.zeros(3), np.zeros(3), np.zeros(3)
    spheres = tree.sphere_segment.shape[0]
    for row in range(positions.shape[0]):
        forward(tree.joint_position, positions[row], frames, SEGMENT_COUNT)
        velocities(rates[row], frames, SEGMENT_COUNT)
        mean[:], load[:], near[:] = 0.0, 0.0, 0.0
        for n in range(spheres):
            side = 0 if n < spheres // 2 else 1
            s, place = tree.sphere_segment[n], tree.sphere_position[n]
            turned = frames.rotation[s]
            for i in range(3):
                r[i] = turned[i, 0] * place[0] + turned[i, 1] * place[1] + turned[i, 2] * place[2]
            depth = tree.sphere_radius[n] - frames.origin[s, 2] - r[2]
            # Where the contact law has its force: in the middle of the overlap.
            r[2] = -0.5 * depth - frames.origin[s, 2]
            share = smooth_share(tree.sphere_radius[n], depth)
            depth = max(0.0, depth) ** 1.5
            _enter_velocity(frames, s, r, along)
            near[side] += share
            for i in range(3):
                mean[side, i] += share * along[i]
            load[side] += depth
            slip[row, side] += depth * np.sqrt(along[0] ** 2 + along[1] ** 2)
        for side in range(2):
            slip[row, side] = slip[row, side] / load[side] if load[side] > 0.0 else 0.0
            s, force = feet[side], forces[row, side]
            if np.isfinite(centres[row, side, 0]):  # of a rigid foot
                for i in range(3):
                    arm[i] = centres[row, side, i] - frames.origin[s, i]
                _enter_velocity(frames, s, arm, along)
                for i in range(3):
                    power[row, side] += force[i] * along[i]
                power[row, side] += free[row, side] * frames.angular[s, 2]
            elif near[side] > 0.0:
                # Where less than a newton acts is not in a walk: on the spheres that are nearest.
                for i in range(3):
                    power[row, side] += force[i] * mean[side, i]
                power[row, side] /= near[side]


@njit
def _enter_velocity(frames: Frames, segment: int, arm: Array, out: Array) -> None:
    """Velocity (3,) m/s, world, of the point of a `segment` at `arm` (3,) m from its origin."""
    w, v = frames.angular[segment], frames.linear[segment]
    out[0] = v[0] + w[1] * arm[2] - w[2] * arm[1]
    out[1] = v[1] + w[2] * arm[0] - w[0] * arm[2]
    out[2] = v[2] + w[0] * arm[1] - w[1] * arm[0]


def ground_rows(rollout: Rollout, model: BodyModel) -> GroundRows:
    """What the ground did in a `rollout` of the body `model` (before mu).

    Its power is that on a rigid foot, and on the toes besides: they turn against the foot under the
    ground's moment about their joint, which the joint's own holds (they weigh 0.2 kg). Of a foot
    without a centre of pressure it is that on the spheres, each of which moves with its own part.
    """
    power, slip = _power_and_slip(
        apply_parameters(model, rollout.mu),
        *(rollout.positions, rollout.velocities),
        *(rollout.ground_reaction, rollout.centre_of_pressure, rollout.free_moment),
    )
    for side in range(2):
        toes = ACTUATED.index(f"mtp_angle_{SIDES[side][0]}")
        loaded = np.isfinite(rollout.centre_of_pressure[:, side, 0])
        power[:, side] -= loaded * rollout.moments[:, toes] * rollout.velocities[:, 6 + toes]
    return GroundRows(power, slip)


def _power_and_slip(model: BodyModel, *motion: Array) -> tuple[Array, Array]:
    """(T, 2) each; `motion` as `_ground_rows` has it."""
    power, slip = np.zeros((2, len(motion[0]), 2))
    feet = np.array([SEGMENTS.index(f"foot_{side[0]}") for side in SIDES])
    _ground_rows(tree_arrays(model), feet, tuple(map(np.ascontiguousarray, motion)), power, slip)
    return power, slip


def creep(rollout: Rollout, ground: GroundRows, rows: slice, mass: float, side: int) -> float:
    """`PERCENTILES` of the slip, m/s, of the foot of a `side` with at least `LOADED`."""
    loaded = rollout.ground_reaction[rows, side, 2] > LOADED * mass * GRAVITY
    return float(np.percentile(ground.slip[rows, side][loaded], PERCENTILES["foot_creep"]))


def mechanical_energy(rollout: Rollout, model: BodyModel, row: int) -> float:
    """J, kinetic and potential energy of the whole body in a `row` of a `rollout`."""
    tree = tree_arrays(apply_parameters(model, rollout.mu))
    frames = empty_frames()
    forward(tree.joint_position, rollout.positions[row].copy(), frames, SEGMENT_COUNT)
    velocities(rollout.velocities[row].copy(), frames, SEGMENT_COUNT)
    total = 0.0
    for s in range(SEGMENT_COUNT):
        centre = frames.rotation[s] @ tree.centre_of_mass[s]
        speed = frames.linear[s] + np.cross(frames.angular[s], centre)
        turning = frames.rotation[s].T @ frames.angular[s]
        total += 0.5 * tree.mass[s] * float(speed @ speed)
        total += 0.5 * float(turning @ tree.inertia[s] @ turning)
        total -= float((tree.mass[s] * tree.gravity) @ (frames.origin[s] + centre))
    return total


TORQUES: Final = (
    *(("toe_moment_peak", side) for side in SIDES),
    *(("toe_work", side) for side in SIDES),
    *(("moment_ringing", axis) for axis in AXES),
    *(("torque_rate", axis) for axis in AXES),
    *(("free_moment_peak", side) for side in SIDES),
    *(("foot_creep", side) for side in SIDES),
    *(("knee_beyond_range", side) for side in SIDES),
)
"""Measure and target of what `torques_of` gives: the largest moment at the toes and the work
that they take up in a stride; moments above `RINGING_HZ`; how fast moments change; the free moment
over weight and height, in %; how fast a loaded foot creeps; and by how much the knee is extended
beyond the model's own range."""


class Torques(NamedTuple):
    """What `torques_of` finds of a walk.

    Attributes
    ----------
    measures : `TORQUES`; without values if there is no cycle.
    energy : where the walk's energy goes, J/kg in a right stride: net work of all joints of a kind,
        both sides, and of the ground on both feet (`contact`; of a device the joints' is the
        person's and its own together), the `change` of the body's energy, and what of the change
        none of them explains (`unexplained`). Empty without a cycle of the right foot.
    """

    measures: list[Measure]
    energy: dict[str, float]


def torques_of(rollout: Rollout, cycles: GaitCycles, *, model: BodyModel, height: float) -> Torques:
    """Measures and energy of the compared `cycles` of a `rollout` of the body `model` (before mu)
    of a person of a `height`, m.
    """
    nothing = [measured(*each, None) for each in TORQUES]
    if cycles.count("right") == 0:
        return Torques(nothing, {})
    ground, rows = ground_rows(rollout, model), cycles.rows()
    work = joint_work(rollout, rows) / (model.mass * cycles.count("right"))
    energy = _energy(rollout, cycles, model, work, ground)
    if cycles.count("left") == 0:
        return Torques(nothing, energy)
    mass, both = model.mass, range(len(SIDES))
    values = (
        *(toe_moment_peak(rollout, cycles, mass, side) for side in both),
        *(-float(work[ACTUATED.index(f"mtp_angle_{side[0]}")]) for side in SIDES),
        *moment_ringing(rollout, rows, mass).values(),
        *torque_rate(rollout, rows, mass).values(),
        *(100.0 * free_moment_peak(rollout, cycles, mass, height, side) for side in both),
        *(100.0 * creep(rollout, ground, rows, mass, side) for side in both),
        *(_beyond_range(rollout, rows, f"knee_angle_{side[0]}") for side in SIDES),
    )
    found = [measured(*each, value) for each, value in zip(TORQUES, values, strict=True)]
    return Torques(found, energy)


def _beyond_range(rollout: Rollout, rows: slice, name: str) -> float:
    """Degrees by which a coordinate goes below the model's own range; 0 if it does not."""
    lowest = float(rollout.positions[rows, COORDINATES.index(name)].min())
    return float(np.rad2deg(max(0.0, RANGES[name][0] - lowest)))


def _energy(
    rollout: Rollout, cycles: GaitCycles, model: BodyModel, work: Array, ground: GroundRows
) -> dict[str, float]:
    """`Torques.energy`, of the net `work` (25,) of every joint, J/kg in a stride."""
    rows, share = cycles.rows(), model.mass * cycles.count("right")
    found: dict[str, float] = {}
    for name, each in zip(ACTUATED, work.tolist(), strict=True):
        kind = KINDS_OF_JOINT[name.split("_")[0]]
        found[kind] = found.get(kind, 0.0) + each
    found["contact"] = float(ground.power[rows].sum()) * step_of(rollout) / share
    ends = (mechanical_energy(rollout, model, row) for row in (rows.stop, rows.start))
    after, before = ends
    found["change"] = float(after - before) / share
    found["unexplained"] = found["change"] - sum(
        value for kind, value in found.items() if kind != "change"
    )
    return found


KINDS_OF_JOINT: Final[Mapping[str, str]] = {
    "hip": "hip",
    "knee": "knee",
    "ankle": "ankle",
    "subtalar": "ankle",
    "mtp": "toes",
    "lumbar": "trunk",
    "arm": "arms",
    "elbow": "arms",
}
"""By the first part of a coordinate's name."""
