"""Convert between the project's and OpenSim's axes, coordinates and generalised forces.

OpenSim's axes are X forward, Y up, Z to the right; the project's (REP-103) x forward, y left, z up.
The 25 joint coordinates are the same in both, with the same names, axes and signs
(`gaitval.coordinates`). The root differs: the project has a rotation vector, OpenSim's models have
three Cardan angles about Z, then X, then Y:

| OpenSim's           | turns about | positive              | in `walk.reference.motion`   |
|---------------------|-------------|-----------------------|-----------------------------|
| pelvis_tilt         | Z           | backward (posterior)  | minus the anterior tilt     |
| pelvis_list         | X           | right side down       | minus the list              |
| pelvis_rotation     | Y           | turned to the left    | rotation                    |
| pelvis_tx, _ty, _tz | (X, Y, Z)   | forward, up, right    | x, z, -y of the pelvis      |

The pelvis origin is the middle of the hip joint centres; that of OpenSim's own models (Rajagopal
et al. 2016) is the middle of the ASIS. Their mtp_angle turns about an oblique axis with flexion
positive, here about the mediolateral one with extension positive.
"""

from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED
from gaitval.model.tree import ROOT_DOFS

TO_OPENSIM: Final[Array] = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""(3, 3), takes vectors in the project's axes to OpenSim's."""

PELVIS_ANGLES: Final = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")
PELVIS_TRANSLATIONS: Final = ("pelvis_tx", "pelvis_ty", "pelvis_tz")

OPENSIM_COORDINATES: Final[tuple[str, ...]] = (*PELVIS_ANGLES, *PELVIS_TRANSLATIONS, *ACTUATED)
"""The 31 coordinates of the exported model, root first."""


def vectors_to_opensim(vectors: Array) -> Array:
    """`vectors` (…, 3) from the project's axes to OpenSim's."""
    return np.asarray(vectors @ TO_OPENSIM.T)


def to_opensim(positions: Array) -> Array:
    """A motion `positions` (T, 31) rad and m, in the order of `gaitval.coordinates.COORDINATES`, in
    OpenSim's coordinates: (T, 31) rad and m, in the order of `OPENSIM_COORDINATES`. The pelvis
    angles are continuous, without jumps of a whole turn. At ±90° of list the other two angles are
    not determined.
    """
    values = np.array(positions, dtype=float)
    # A change of axes at both ends: C R Cᵀ.
    world = TO_OPENSIM @ Rotation.from_rotvec(values[:, :3]).as_matrix() @ TO_OPENSIM.T
    values[:, :3] = np.unwrap(Rotation.from_matrix(world).as_euler("ZXY"), axis=0)
    values[:, 3:6] = vectors_to_opensim(values[:, 3:6])
    return values


def from_opensim(values: Array) -> Array:
    """The motion whose `to_opensim` is `values` (T, 31) rad and m: (T, 31) in the order of
    `gaitval.coordinates.COORDINATES`, its rotation vector continuous.
    """
    positions = np.array(values, dtype=float)
    world = Rotation.from_euler("ZXY", positions[:, :3]).as_matrix()
    turns = Rotation.from_matrix(TO_OPENSIM.T @ world @ TO_OPENSIM)
    positions[:, :3] = turns.as_rotvec()
    positions[:, 3:6] = positions[:, 3:6] @ TO_OPENSIM
    return positions


def forces_to_opensim(positions: Array, forces: Array) -> Array:
    """Generalised forces (T, 31) Nm and N paired with OpenSim's coordinates, in the order of
    `OPENSIM_COORDINATES`.

    `positions` (T, 31) rad and m are in the order of `gaitval.coordinates.COORDINATES`. `forces`
    (T, 31) Nm and N are paired with velocities as in `model.tree`: moment about the pelvis origin
    and force in world axes, then the joint moments. A pelvis angle rotates the pelvis about an axis
    that depends on the angles before it; its generalised force is the root moment about that axis,
    so that the power is the same.
    """
    values = np.array(forces, dtype=float)
    angles = to_opensim(positions)[:, :ROOT_DOFS]
    moment = vectors_to_opensim(values[:, :3])
    tilt = Rotation.from_euler("Z", angles[:, :1]).as_matrix()
    tilt_list = Rotation.from_euler("ZX", angles[:, :2]).as_matrix()
    # Power is moment · ω, and ω = tilt' Z + list' (X after tilt) + rotation' (Y after both).
    values[:, 0] = moment[:, 2]
    values[:, 1] = np.einsum("ti,ti->t", moment, tilt[:, :, 0])
    values[:, 2] = np.einsum("ti,ti->t", moment, tilt_list[:, :, 1])
    values[:, 3:6] = vectors_to_opensim(values[:, 3:6])
    return values
