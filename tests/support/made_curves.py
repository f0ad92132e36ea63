"""Curves of a walk with devices, made up."""

import numpy as np

from gaitval.apps.devices.curves import JOINTS, WalkCurves
from gaitval.coordinates import SIDES


def made_curves(
    work=0.2, negative=0.1, moment=1.0, power=0.0, force=1.1, stance=0.6, stride=1.0
) -> WalkCurves:
    """Curves that are flat; each value for both sides, or a pair right, left."""

    def pair(value):
        return dict(zip(SIDES, value if isinstance(value, tuple) else (value,) * 2, strict=True))

    def flat(value):
        of = pair(value)
        return {(joint, side): np.full(101, of[side]) for joint in JOINTS for side in SIDES}

    def each(value):
        of = pair(value)
        return {(joint, side): of[side] for joint in JOINTS for side in SIDES}

    return WalkCurves(
        cycles=pair(5),
        angles=flat(0.1),
        own=flat(moment),
        device=flat(0.0),
        total=flat(moment),
        own_power=flat(0.0),
        device_power=flat(power),
        forces={side: np.full(101, value) for side, value in pair(force).items()},
        stride_time=pair(stride),
        stance=pair(stance),
        speed=1.2,
        work=each(work),
        negative_work=each(negative),
        device_work=each(tuple(stride * of for of in pair(power).values())),
    )
