"""The 14 body parameters mu, which are randomised in training and identified from a record."""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.configuration import RandomisationSettings
from gaitval.errors import ModelError
from gaitval.model.body import BodyModel, ContactSphere, Segment

PARAMETERS: Final[tuple[str, ...]] = (
    "damping",
    "friction",
    "foot_length",
    "shank_length",
    "thigh_length",
    "ankle_x",
    "ankle_y",
    "ankle_z",
    "hip_x",
    "hip_y",
    "hip_z",
    "knee_x",
    "knee_y",
    "knee_z",
)
"""Names of the elements of mu, in the paper's order beta, sigma, f_l, s_l, t_l, f_j, h_j, s_j.

| elements | unit | meaning |
|---|---|---|
| damping | Nms/rad | passive damping of every actuated coordinate |
| friction | 1 | friction between foot and ground |
| ..._length | 1 | factor on the length of the segment as scaled, both legs |
| ankle, hip, knee | m | added to the joint's position in the frame of its parent segment |

Offsets are forward, to the left and up in the neutral pose for the right leg; y is mirrored for the
left leg. A factor on the thigh or shank stretches it downwards from its upper joint; one on the
foot stretches foot and toes forwards and backwards from the ankle. Masses do not change.
"""
UNITS: Final = {
    **dict.fromkeys(PARAMETERS, "m"),
    "damping": "Nms/rad",
    **{name: "1" for name in PARAMETERS if name == "friction" or name.endswith("_length")},
}

NOMINAL_DAMPING: Final = 0.1
"""Nms/rad (PredSim: D'Hondt, Falisse et al.)."""
NOMINAL_FRICTION: Final = 0.8
"""Static friction coefficient (Falisse et al. 2022)."""

_LENGTHS = {"foot": 2, "toes": 2, "shank": 3, "thigh": 4}
"""Element of mu with the length factor of each segment."""
_LONG_AXIS = {"foot": 0, "toes": 0, "shank": 2, "thigh": 2}
_OFFSETS = {"foot": slice(5, 8), "thigh": slice(8, 11), "shank": slice(11, 14)}
"""Elements of mu with the offset of the joint at which each segment begins."""


def nominal_parameters() -> NDArray[np.float64]:
    """mu (14,) of the model as scaled: published damping and friction, factors 1, no offsets."""
    mu = np.zeros(len(PARAMETERS))
    mu[:2] = NOMINAL_DAMPING, NOMINAL_FRICTION
    mu[2:5] = 1.0
    return mu


def parameter_bounds(randomisation: RandomisationSettings) -> tuple[Array, Array]:
    """Lowest and highest mu, each of shape (14,), that the configuration `randomisation` allows."""
    offset = (-randomisation.joint_offset, randomisation.joint_offset)
    pairs = [getattr(randomisation, name) for name in PARAMETERS[:5]] + [offset] * 9
    low, high = np.array(pairs, dtype=np.float64).T
    return low, high


def apply_parameters(model: BodyModel, mu: NDArray[np.float64]) -> BodyModel:
    """The model with its leg lengths and joint positions changed by mu.

    Parameters
    ----------
    model : the model as scaled.
    mu : (14,) body parameters, see `PARAMETERS`. Damping and friction are not part of the model:
        contact and joints take them from mu.

    Raises
    ------
    ModelError : mu has another shape, is not finite, or has a length that is not positive.

    Notes
    -----
    A stretched segment keeps its mass; positions along its long axis, and its second moments of
    mass, change as if every point moved with the stretch.
    """
    mu = np.asarray(mu, dtype=np.float64)
    if mu.shape != (len(PARAMETERS),):
        raise ModelError(f"mu must have shape ({len(PARAMETERS)},), but its shape is {mu.shape}.")
    if not np.isfinite(mu).all() or mu[2:5].min() <= 0:
        raise ModelError(f"mu must be finite with positive lengths, but it is {mu}.")
    return replace(
        model,
        segments=tuple(_changed(s, mu) if s.kind in _LENGTHS else s for s in model.segments),
        spheres=tuple(_moved(sphere, mu[2]) for sphere in model.spheres),
    )


def _changed(segment: Segment, mu: NDArray[np.float64]) -> Segment:
    kind = segment.kind
    joint = segment.joint_position.copy()
    # A segment begins where its parent ends, so its joint moves with the stretch of the parent.
    if kind == "toes":
        joint[0] *= mu[_LENGTHS["foot"]]
    elif kind == "foot":
        joint[2] *= mu[_LENGTHS["shank"]]
    elif kind == "shank":
        joint[2] *= mu[_LENGTHS["thigh"]]
    if kind in _OFFSETS:
        x, y, z = mu[_OFFSETS[kind]].tolist()
        joint += (x, -y if segment.side == "left" else y, z)
    axis, factor = _LONG_AXIS[kind], float(mu[_LENGTHS[kind]])
    centre = segment.centre_of_mass.copy()
    centre[axis] *= factor
    return Segment(
        segment.name, joint, segment.mass, centre, stretched_inertia(segment.inertia, axis, factor)
    )


def stretched_inertia(inertia: Array, axis: int, factor: float) -> Array:
    """Inertia (3, 3) of a body of inertia `inertia` stretched by `factor` along a coordinate axis
    (`axis` 0, 1 or 2).

    With the second moments S = tr(I)/2 - I, stretching multiplies a row and a column of S, and I =
    tr(S) - S.
    """
    # tr(I)/2 - I_aa = S_aa = ∫ a² dm; it grows by the factor's square and is a part of the other
    # two moments of inertia only.
    moments = (inertia[0, 0] + inertia[1, 1] + inertia[2, 2]) / 2
    gained = (factor * factor - 1.0) * (moments - inertia[axis, axis])
    stretched = inertia.copy()
    stretched[axis, :] *= factor
    stretched[:, axis] *= factor
    # Row and column have both multiplied it: about the stretched axis nothing moves away.
    stretched[axis, axis] = inertia[axis, axis]
    for other in range(3):
        if other != axis:
            stretched[other, other] += gained
    return stretched


def _moved(sphere: ContactSphere, factor: float) -> ContactSphere:
    position = sphere.position.copy()
    position[0] *= factor
    return ContactSphere(sphere.name, sphere.segment, position, sphere.radius)
