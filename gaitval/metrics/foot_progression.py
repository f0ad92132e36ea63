"""Where the feet of a walk point, seen from above."""

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.cycles import GaitCycles, cut
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.simulation.rollout import Rollout


def foot_progression(rollout: Rollout, cycles: GaitCycles, model: BodyModel) -> dict[str, Array]:
    """Direction of both feet of `model` seen from above, (n, 101) rad over the `cycles` of
    `rollout`; positive with the toes towards the midline.
    """
    found = {}
    frames = segment_frames(model, rollout.positions)
    for side in SIDES:
        forward = frames[:, SEGMENTS.index(f"foot_{side[0]}"), :2, 0]
        angle = np.arctan2(forward[:, 1], forward[:, 0]) * (1.0 if side == "right" else -1.0)
        found[f"foot_progression_{side[0]}"] = cut(angle, cycles.starts[side], cycles.ends[side])
    return found
