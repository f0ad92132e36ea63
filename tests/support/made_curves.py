"""Curves of a walk with devices, made up: each is flat."""

import numpy as np

from gaitval.apps.devices.curves import JOINTS, WalkCurves
from gaitval.coordinates import SIDES


def made_curves() -> WalkCurves:
    both = [(joint, side) for joint in JOINTS for side in SIDES]

    def flat(value):
        return {each: np.full(101, value) for each in both}

    return WalkCurves(
        cycles=dict.fromkeys(SIDES, 5),
        angles=flat(0.1),
        own=flat(1.0),
        device=flat(0.0),
        own_power=flat(0.0),
        device_power=flat(0.0),
        forces={side: np.full(101, 1.1) for side in SIDES},
        stride_time=dict.fromkeys(SIDES, 1.0),
        stance=dict.fromkeys(SIDES, 0.6),
        speed=1.2,
        work=dict.fromkeys(both, 0.2),
        negative_work=dict.fromkeys(both, 0.1),
    )
