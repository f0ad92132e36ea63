"""How much of a policy's action bias to remove, found from the reference without the record.

A policy of one person at one speed walks nearest to its reference with half of its action bias
removed (`environment.centring`). One that has learned several speeds is more biased at some of them
than at others. So the share is found at each speed: that of the walk nearest to the reference.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES
from gaitval.gait.cycle_curves import (
    FORCES,
    JOINT_ANGLES,
    JOINT_MOMENTS,
    PELVIS_ANGLES,
    Curves,
    recorded_curves,
)
from gaitval.metrics.comparison import curves_of
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.epsilon import epsilon
from gaitval.model.rotations import pelvis_angles
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy
from gaitval.reference.motion import ReferenceMotion
from gaitval.simulation.walker import WalkingTask

SHARES: Final = (0.25, 0.5, 0.75, 1.0)
_CYCLES: Final = 8
_PERCENT: Final = np.linspace(0.0, 1.0, 101)


def reference_curves(reference: ReferenceMotion, mass: float, left_phase: float) -> Curves:
    """`reference` over each side's own cycle, as `cycle_curves.recorded_curves` has a record.
    `mass` (kg) is the model's; the left heel strikes at `left_phase` of the right cycle.
    """
    curves = Curves({}, {}, {})
    pelvis = pelvis_angles(Rotation.from_rotvec(reference.positions[:, :3]).as_matrix())
    for column, side in enumerate(SIDES):
        # the reference is stored over the right cycle; the left one starts at the left heel strike
        at = (_PERCENT + (0.0 if side == "right" else left_phase)) % 1.0

        def sampled(values: Array, at: Array = at) -> Array:
            phase = np.append(reference.phase, 1.0)
            return np.asarray(np.interp(at, phase, np.append(values, values[0])))

        for name in JOINT_ANGLES:
            place = COORDINATES.index(f"{name}_{side[0]}")
            curves.angles[f"{name}_{side[0]}"] = sampled(reference.positions[:, place])
        for name in JOINT_MOMENTS:
            moment = reference.moments[:, ACTUATED.index(f"{name}_{side[0]}")]
            curves.moments[f"{name}_{side[0]}"] = sampled(moment) / mass
        mirror = 1.0 if side == "right" else -1.0
        for index, name in enumerate(PELVIS_ANGLES):
            sign = 1.0 if name == "pelvis_tilt" else mirror
            curves.angles[f"{name}_{side[0]}"] = sampled(sign * pelvis[:, index])
        medial = np.array([1.0, mirror, 1.0])
        for axis, name in enumerate(FORCES):
            force = medial[axis] * reference.ground_reaction[:, column, axis]
            curves.forces[f"{name}_{side[0]}"] = sampled(force)
    return curves


def floor_of(task: WalkingTask) -> float:
    """Epsilon of the reference of `task` itself, of a walker that would follow it exactly."""
    asked = reference_curves(task.reference, task.model.mass, task.record.left_phase)
    once = Curves(
        **{
            kind: {name: curve[None] for name, curve in getattr(asked, kind).items()}
            for kind in ("angles", "moments", "forces")
        }
    )
    found = epsilon(once, recorded_curves(task.record))
    assert found is not None  # one whole cycle
    assert found.total is not None
    return found.total


def with_centring(task: WalkingTask, share: float) -> WalkingTask:
    """The `task` with another `share` of the policy's action bias removed."""
    environment = task.configuration.environment.model_copy(update={"centring": share})
    configuration = task.configuration.model_copy(update={"environment": environment})
    return replace(task, configuration=configuration)


def centred(
    task: WalkingTask, policy: Policy, mu: Array, shares: Sequence[float] = SHARES
) -> float:
    """The share of action bias to remove so that the walk is nearest to its reference, by epsilon.

    Each of `shares` is tried on a walk of `policy` on `task` with the body parameters `mu` (14,).
    Walks that fall do not count; if all do, the configured share is returned.
    """
    validation = task.configuration.validation
    wanted = reference_curves(task.reference, task.model.mass, task.record.left_phase)
    best, least = task.configuration.environment.centring, np.inf
    for share in shares:
        walker = WalkingEnvironment(with_centring(task, share))
        rollout = record_rollout(
            walker, policy, mu=mu, start_phase=0.0, cycles=validation.settling_cycles + _CYCLES
        )
        if rollout.fell[0]:
            continue
        found = epsilon(
            curves_of(task, rollout, find_cycles(rollout, task.configuration)),
            wanted,
        )
        if found is not None and found.total is not None and found.total < least:
            best, least = share, found.total
    return best
