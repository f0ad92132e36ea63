"""How much trunk and arms may shake in a fit: as little as the moment at the back says.

Nothing that is compared with a record depends on it, and a degree of a trunk at 12 Hz is 200 Nm: as
rough as legs, fits had lumbar moments of up to 0.08 Nm/kg RMS above 12 Hz, which their walkers had
to follow.
"""

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES
from gaitval.model.body import PARENTS, SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames

FROM_HZ = 11.0
"""From which on they are held: a little below the 12 Hz from which a walk's moments count as
ringing, because strides vary. The twelfth harmonic of a stride of 0.93 s, which harmonics alone
left free, was most of what rang at that back."""

SHAKING = tuple(
    i for i, name in enumerate(COORDINATES) if i < 3 or name.startswith(("lumbar", "arm", "elbow"))
)
"""Coordinates that turn trunk or arms; the first three are the pelvis' rotations."""


def upper_body_inertia(model: BodyModel) -> float:
    """kg m², the largest moment of inertia of trunk, head and arms about the lumbar joint, standing
    (as it is bent forward or aside).
    """
    frames = segment_frames(model, np.zeros((1, len(COORDINATES))))[0]
    joint, whole = frames[SEGMENTS.index("torso"), :3, 3], np.zeros((3, 3))
    for segment in model.segments:
        name = segment.name
        while name in PARENTS and name != "torso":
            name = PARENTS[name]
        if name == "torso":
            at = frames[SEGMENTS.index(segment.name), :3, 3] + segment.centre_of_mass - joint
            whole += segment.inertia + segment.mass * (at @ at * np.eye(3) - np.outer(at, at))
    return float(np.diag(whole).max())


def steady_amplitude(model: BodyModel, rates: Array, moment: float) -> Array:
    """Amplitudes (H,) rad of angles of `SHAKING` that change at angular frequencies `rates` (H,)
    1/s, with which `moment` Nm/kg bends the upper body; infinite below `FROM_HZ`.
    """
    amplitude = moment * model.mass / (upper_body_inertia(model) * np.asarray(rates) ** 2)
    return np.where(np.asarray(rates) < 2.0 * np.pi * FROM_HZ, np.inf, amplitude)
