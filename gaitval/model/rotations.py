"""Cardan angles of the pelvis in the convention of the record."""

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array


def pelvis_rotation(tilt: Array, list_right: Array, rotation_right: Array) -> Array:
    """Pelvis orientation (N, 3, 3), pelvis to world, from its Cardan angles in rad, in the record's
    order: anterior `tilt`, then `list_right` (right side up), then `rotation_right` (right side
    forward).
    """
    # y is to the left and z up: anterior tilt is positive about y, right side up negative about x,
    # right side forward positive about z.
    angles = np.column_stack([tilt, -list_right, rotation_right])
    return np.asarray(Rotation.from_euler("YXZ", angles).as_matrix())


def pelvis_angles(rotation: Array) -> Array:
    """Tilt, list (right side up +) and rotation (right side forward +) (N, 3) in rad of pelvis
    orientations `rotation`; the inverse of `pelvis_rotation`.
    """
    angles = Rotation.from_matrix(rotation).as_euler("YXZ")
    return np.asarray(angles * np.array([1.0, -1.0, 1.0]))
