"""How a foot meets the ground: heel bounce, heel-strike transient, and where it stands.

A foot stands where the rearmost point of its sole's outline, below the line of the ankle, is at
`FLAT` of its stance.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gaitval.arrays import Array
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES, Side
from gaitval.metrics.cycles import GaitCycles
from gaitval.metrics.results import FootContact
from gaitval.metrics.typed import number
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.parameters import apply_parameters
from gaitval.model.tree import segment_frames
from gaitval.walk.simulation.rollout import Rollout

FLAT = 0.3
"""Fraction of stance at which the foot is flat: after loading, before the heel rises."""
EARLY = 0.15
"""Fraction of stance in which a heel may bounce and the heel-strike transient occurs."""


@dataclass(frozen=True)
class Stances:
    """How one foot met the ground in each of n stances.

    Attributes
    ----------
    places : (n, 2) m, world: where the heel stands, forward and left.
    bounces : (n,) how often the vertical force fell to nothing within `EARLY` of stance.
    transient : (n,) body weights, largest unfiltered vertical force within `EARLY` of stance.
    """

    places: Array
    bounces: Array
    transient: Array

    def contact(self) -> FootContact:
        """Means over the stances."""
        some = len(self.bounces) > 0
        return FootContact(
            stances=len(self.bounces),
            bounces_per_stance=float(self.bounces.mean()) if some else None,
            transient_peak=number(100.0 * self.transient.mean()) if some else None,
        )


def heel_of(model: BodyModel, side: Side) -> Array:
    """(3,) m: the rearmost point of the sole on a `side` of `model`, in the foot's frame."""
    toes = model[f"toes_{side[0]}"].joint_position
    spheres = [s for s in model.spheres if s.segment in (f"foot_{side[0]}", f"toes_{side[0]}")]
    places = np.array(
        [s.position + (toes if s.segment.startswith("toes") else 0.0) for s in spheres]
    )
    radii = np.array([s.radius for s in spheres])
    return np.array([(places[:, 0] - radii).min(), 0.0, (places[:, 2] - radii).min()])


def foot_contacts(
    rollout: Rollout, cycles: GaitCycles, model: BodyModel, *, threshold: float
) -> Mapping[Side, Stances]:
    """How both feet met the ground in the stances that begin the `cycles` of a `rollout`.

    `model` is the body before mu, which the rollout contains. A foot is on the ground where its
    vertical force is above `threshold`, N.
    """
    # mu contains the length of the foot, and so its outline
    body = apply_parameters(model, rollout.mu)
    weight = model.mass * GRAVITY
    found: dict[Side, Stances] = {}
    for column, side in enumerate(SIDES):
        heel = heel_of(body, side)
        vertical = rollout.ground_reaction[:, column, 2]
        places, bounces, transients = [], [], []
        for start, end in zip(cycles.starts[side], cycles.ends[side], strict=True):
            # a heel strike that starts a whole cycle is followed by one toe-off within it
            toe_offs = cycles.events[side].toe_offs
            stop = toe_offs[(toe_offs > start) & (toe_offs < end)][0]
            early = vertical[start : start + max(1, round(EARLY * (stop - start)))]
            on = early > threshold
            # each loss of contact within early stance is a bounce
            bounces.append(int((on[:-1] & ~on[1:]).sum()))
            transients.append(early.max() / weight)
            flat = start + round(FLAT * (stop - start))
            pose = segment_frames(body, rollout.positions[flat : flat + 1])[0]
            foot = pose[SEGMENTS.index(f"foot_{side[0]}")]
            places.append(foot[:2, :3] @ heel + foot[:2, 3])
        found[side] = Stances(
            np.array(places).reshape(-1, 2),
            np.array(bounces, dtype=float),
            np.array(transients, dtype=float),
        )
    return found
