"""Joint centres from a lateral marker and the width of the joint, where no medial marker is."""

from collections.abc import Mapping

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import ScalingError
from gaitval.scaling.landmarks import unit_vector


def chord_centre(proximal: Array, lateral: Array, wand: Array, half_width: float) -> Array:
    """Joint centre from a lateral marker and the half width of the joint, m, shape (3,).

    The centre lies in the plane of the three points, on the opposite side of the line from
    `proximal` to `lateral` from `wand`, and at `half_width` from `lateral`. The lines from the
    centre to `proximal` and `lateral` are at a right angle.

    Parameters
    ----------
    proximal : (3,) m, joint centre above.
    lateral : (3,) m, marker on the lateral epicondyle or malleolus.
    wand : (3,) m, any point on the lateral side in the plane of the joint's axis.
    half_width : from the marker's centre to the joint's, m.

    Notes
    -----
    The chord function of Plug-in Gait (Davis et al. 1991, Hum Mov Sci 10:575-587; Kadaba et al.
    1990, J Orthop Res 8:383-392) without its offset angles.
    """
    towards = proximal - lateral
    distance = float(np.linalg.norm(towards))
    along = towards / distance
    aside = (lateral - wand) - ((lateral - wand) @ along) * along
    # cos of the angle at the lateral marker: the right angle is at the centre.
    share = half_width / distance
    return np.asarray(
        lateral + half_width * (share * along + np.sqrt(1.0 - share**2) * unit_vector(aside))
    )


def hinge_centre(
    points: Mapping[str, Array], side: str, joint: str, above: str, wand: str, half_width: float
) -> Array:
    """Centre of knee or ankle, (3,) m, by `chord_centre`.

    Parameters
    ----------
    points : markers and joint centres, (3,) m each, x forward and y left.
    side : "R" or "L".
    joint, above, wand : names without a side of the lateral marker, of the joint above and of the
        wand, if no marker is on the axis; without either it is taken across the pelvis.
    half_width : from the marker's centre to the joint's, m.

    Raises
    ------
    ScalingError : the wand is not lateral to the joint.
    """
    lateral, inwards = points[f"{side}.{joint}"], np.array([0.0, 1.0 if side == "R" else -1.0, 0.0])
    device = f"{side}.{joint}.Axis"
    name = device if device in points else f"{side}.{wand}"
    place = points.get(name, lateral - 0.1 * inwards)
    centre = chord_centre(points[f"{side}.{above}"], lateral, place, half_width)
    if unit_vector(centre - lateral) @ inwards < 0.5:
        raise ScalingError(
            f"the marker {name} is not lateral to the {joint.lower()}: the axis of the joint would "
            "point more than 60 degrees away from the midline. Place a wand in the frontal plane "
            "of the segment, align a device with the axis, or use a medial marker."
        )
    return centre


def elbow_centre(
    shoulder: Array, lateral: Array, wrist: Array, half_width: float, side: str
) -> Array:
    """Elbow joint centre, (3,) m: at `half_width` (m) from the lateral marker, on an axis
    perpendicular to upper arm and forearm, such that the elbow of this `side` is flexed, not
    extended.

    With u from the marker to the centre, u·u = h², u·(shoulder - marker) = h² and
    u·(wrist - marker) = h².
    """
    first, second = shoulder - lateral, wrist - lateral
    sides = np.stack([first, second])
    # The two dot products fix u in the plane of the arm; what remains of h is perpendicular to it,
    # on one side or the other.
    in_plane = sides.T @ np.linalg.solve(sides @ sides.T, np.full(2, half_width**2))
    depth = float(np.sqrt(max(half_width**2 - float(in_plane @ in_plane), 0.0)))
    out_of_plane = depth * unit_vector(np.cross(first, second))
    centre = np.asarray(lateral + in_plane + out_of_plane)
    bend = np.cross(centre - shoulder, wrist - centre) @ (lateral - centre)
    if bend * (1.0 if side == "R" else -1.0) < 0:  # extended: the other of the two solutions
        return np.asarray(centre - 2 * out_of_plane)
    return centre
