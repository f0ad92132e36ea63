"""Mean curves and figures of a walk with devices, to hold beside the walk without."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.apps.devices.device_walk import DeviceWalk
from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, SIDES, Side
from gaitval.errors import RecordError
from gaitval.gait.filters import low_pass_simulated
from gaitval.metrics.cycles import cut, find_cycles, step_of, walking_speed
from gaitval.model.tree import ROOT_DOFS

JOINTS: Final = ("hip_flexion", "knee_angle", "ankle_angle")
"""Joints that are shown and compared."""
CUTOFF: Final = 10.0
"""Hz, of the zero-lag filter on moments and forces, as in the comparison with a record."""


@dataclass(frozen=True)
class WalkCurves:
    """Mean curves (101,) over the gait cycles of a side, by `(joint, side)`.

    Attributes
    ----------
    cycles : how many, by side.
    angles : rad.
    own, device : Nm/kg, moments of the person's muscles, and of the devices; kg of the person.
    own_power, device_power : W/kg, of the filtered moments and of rates as the report has them.
    forces : body weights of the person, vertical, by side.
    stride_time, stance : s, and fraction of the stride on the ground, by side.
    speed : m/s.
    work : J/kg a stride, positive work of the muscles, by `(joint, side)`: of each stride by
        itself, then the mean.
    negative_work : likewise, not negative.
    """

    cycles: Mapping[Side, int]
    angles: Mapping[tuple[str, Side], Array]
    own: Mapping[tuple[str, Side], Array]
    device: Mapping[tuple[str, Side], Array]
    own_power: Mapping[tuple[str, Side], Array]
    device_power: Mapping[tuple[str, Side], Array]
    forces: Mapping[Side, Array]
    stride_time: Mapping[Side, float]
    stance: Mapping[Side, float]
    speed: float
    work: Mapping[tuple[str, Side], float]
    negative_work: Mapping[tuple[str, Side], float]


def walk_curves(walk: DeviceWalk, configuration: Configuration, mass: float) -> WalkCurves:
    """Curves of a `walk` of a person of a `mass` in kg, without devices. Raises RecordError if a
    side has no complete gait cycle.
    """
    rollout = walk.rollout
    cycles = find_cycles(rollout, configuration)
    if not (cycles.count("right") and cycles.count("left")):
        raise RecordError(
            f"no complete gait cycle of both feet in {rollout.time[-1]:.1f} s of walking with "
            "these devices, so there are no curves. Change them."
        )
    step = step_of(rollout)
    device = walk.total_moments - rollout.moments
    smooth = low_pass_simulated(rollout.moments, step=step, frequency=CUTOFF)
    smooth_device = low_pass_simulated(device, step=step, frequency=CUTOFF)
    vertical = low_pass_simulated(rollout.ground_reaction[..., 2], step=step, frequency=CUTOFF)
    found: dict[str, dict[tuple[str, Side], Array]] = {
        name: {} for name in ("angles", "own", "device", "own_power", "device_power")
    }
    forces, stride, stance = {}, {}, {}
    work: dict[tuple[str, Side], float] = {}
    negative: dict[tuple[str, Side], float] = {}
    for column, side in enumerate(SIDES):
        starts, ends = cycles.starts[side], cycles.ends[side]
        stride[side] = float(np.mean(ends - starts)) * step
        for joint in JOINTS:
            i = ACTUATED.index(f"{joint}_{side[0]}")
            angle, muscles, given = (
                cut(values, starts, ends)
                for values in (
                    rollout.positions[:, ROOT_DOFS + i],
                    smooth[:, i] / mass,
                    smooth_device[:, i] / mass,
                )
            )
            # as `joint_power`, so that one walk has one power in the report and here
            seconds = (ends - starts) * step
            rate = np.gradient(angle, 0.01, axis=1, edge_order=2) / seconds[:, None]
            power, of_device = muscles * rate, given * rate
            for name, curves in (
                ("angles", angle), ("own", muscles), ("device", given),
                ("own_power", power), ("device_power", of_device),
            ):  # fmt: skip
                found[name][joint, side] = curves.mean(axis=0)
            for into, curves in ((work, power), (negative, -power)):
                # of each stride: in their mean, power of unlike strides cancels
                positive = np.maximum(curves[:, :-1], 0.0).mean(axis=1) * seconds
                into[joint, side] = float(positive.mean())
        forces[side] = cut(vertical[:, column] / (mass * GRAVITY), starts, ends).mean(axis=0)
        on = cycles.events[side].on_ground
        stance[side] = float(np.mean([on[a:b].mean() for a, b in zip(starts, ends, strict=True)]))
    return WalkCurves(
        cycles={side: cycles.count(side) for side in SIDES},
        forces=forces,
        stride_time=stride,
        stance=stance,
        speed=float(walking_speed(rollout, cycles) or 0.0),
        work=work,
        negative_work=negative,
        **found,
    )
