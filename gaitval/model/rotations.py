"""Cardan angles of the pelvis and the feet in the convention of the record."""

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.coordinates import Side


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


def foot_angles(rotation: Array, side: Side) -> Array:
    """Pitch (toes up +), list (sole towards the midline +) and progression (toes towards the
    midline +) (N, 3) in rad of orientations `rotation` of the foot of a `side`, foot to world,
    in the pelvis's order, as the record has them. Seen from above, a foot almost upright
    in early swing points up to 37 degrees elsewhere.
    """
    own = 1.0 if side == "right" else -1.0
    return np.asarray(pelvis_angles(rotation) * np.array([-1.0, -own, own]))
