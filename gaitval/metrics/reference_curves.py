"""What the reference asks of a walk: its curves, and the epsilon of one that follows them."""

from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES
from gaitval.gait.cycle_curves import (
    FORCES,
    JOINT_ANGLES,
    JOINT_MOMENTS,
    PELVIS_ANGLES,
    Curves,
    recorded_curves,
)
from gaitval.metrics.epsilon import epsilon
from gaitval.model.rotations import pelvis_angles
from gaitval.walk.reference.hip_moments import about_record
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.walker import WalkingTask

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
            vertical = reference.ground_reaction[:, column, 2] * mass * GRAVITY
            moment = about_record(moment, name, reference.hip_centre[column], vertical)
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
    target = reference_curves(task.reference, task.model.mass, task.record.left_phase)
    once = Curves(
        **{
            kind: {name: curve[None] for name, curve in getattr(target, kind).items()}
            for kind in ("angles", "moments", "forces")
        }
    )
    found = epsilon(once, recorded_curves(task.record))
    assert found is not None  # one whole cycle
    assert found.total is not None
    return found.total
