"""Forces that a laboratory's program exports with a centre of pressure, as plates of a recording.

Programs differ in what they leave unsaid: whether a force is that on the plate or on the person,
about which point a moment is, and in Nm or Nmm. Each is found from the numbers themselves, where
they show it beyond doubt, and the file is refused where they do not:

- a plate can only push, so a force that points away from the markers is that on the plate;
- about the centre of pressure a foot exerts no other moment than the vertical one, so of all points
  and units that a moment may have, those are right which leave the least other moment.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import UNLOADED_N, certain_load
from gaitval.mocap.pressed_plates import measured_points, pressed_plate
from gaitval.mocap.recording import Plate, Recording

FREE: Final = 0.02
"""m. Largest moment across the vertical about the centre of pressure, over the force (median): what
rounding and a centre of pressure found for another depth of the surface leave. The moment about
another point or in another unit leaves ten times as much on a plate that a person walks over."""
FEWEST: Final = 10
"""Samples under load that show anything."""


def person_of(recording: Recording) -> Array:
    """Median place (3,) m of all markers of a recording, above every plate."""
    seen = recording.markers.reshape(-1, 3)
    seen = seen[np.isfinite(seen).all(axis=1)]
    return np.median(seen, axis=0) if len(seen) else np.zeros(3)


def sign_on_person(recording: Recording, force: Array, point: Array) -> float:
    """-1 if a force (T, 3) N at a point (T, 3) m is that on the plate, else 1."""
    strong = certain_load(np.linalg.norm(force, axis=1))
    towards = (force * (person_of(recording) - point))[strong].sum(axis=1)
    return -1.0 if np.nansum(towards) < 0.0 else 1.0


def vertical_of(force: Array) -> Array:
    """Unit vector (3,) along the axis of the laboratory nearest to the mean of a force (T, 3)."""
    mean = force.sum(axis=0)
    axis = np.zeros(3)
    axis[int(np.argmax(np.abs(mean)))] = 1.0
    return axis


def placed_plate(
    path: Path,
    name: str,
    recording: Recording,
    wrench: tuple[Array, Array, Array],
    places: Mapping[str, Array | None],
    units: Mapping[str, float],
    corners: Array | None = None,
) -> Plate:
    """A plate from force, centre of pressure and a moment about one of several points.

    Parameters
    ----------
    path, name : of the file and the plate, for messages.
    recording : the markers, which show which way is up.
    wrench : force (T, 3) N, point (T, 3) m and moment (T, 3), in the markers' axes, the two
        with the same sign.
    places : points (3,) m that the moment may be about, by what they are called; None for one at
        rest that is not known.
    units : Nm in the units that the moment may have, by their names.
    corners : (4, 3) m, if they are known.

    Returns
    -------
    Plate
        With what acts on the person.

    Raises
    ------
    RecordError : a force is missing or a point or moment under load; or the moment fits none of
        `places` and `units`.
    """
    force, point, moment = wrench
    point = measured_points(path, name, force, point)
    plain = np.nan_to_num(point), np.nan_to_num(moment)
    torque = _about_pressure(path, name, force, *plain, places, units)
    torque[~np.isfinite(moment).all(axis=1)] = np.nan
    sign = sign_on_person(recording, force, point)
    plate = pressed_plate(path, name, sign * force, point, sign * torque)
    return plate if corners is None else replace(plate, corners=corners)


def _about_pressure(
    path: Path,
    name: str,
    force: Array,
    point: Array,
    moment: Array,
    places: Mapping[str, Array | None],
    units: Mapping[str, float],
) -> Array:
    """The vertical moment (T, 3) Nm about the centre of pressure."""
    size = np.linalg.norm(force, axis=1)
    strong = certain_load(size)
    if np.count_nonzero(strong) < FEWEST:
        # No step: a foot that hardly touches twists nothing that counts.
        return np.zeros_like(force)
    up = vertical_of(force[strong])
    best, left = np.zeros_like(force), np.inf
    for place in places.values():
        for unit in units.values():
            about = unit * moment - _lever(place, point, force, unit * moment, up, strong)
            across = about - np.outer(about @ up, up)
            size_left = float(np.median(np.linalg.norm(across[strong], axis=1) / size[strong]))
            if size_left < left:
                best, left = np.outer(about @ up, up), size_left
    if left > FREE:
        raise RecordError(
            f"{path}: plate {name}: the moment does not belong to the force at the centre of "
            f"pressure: about {', '.join(places)}, in {' or '.join(units)}, {1e3 * left:.0f} mm "
            f"times the force is left across the vertical (median; {1e3 * FREE:.0f} mm at most). "
            "It is in other axes than the force, or about another point. Export the trial as C3D, "
            "or force, moment and centre of pressure in the laboratory's axes."
        )
    return np.where(size[:, None] >= UNLOADED_N, best, 0.0)


def _lever(
    place: Array | None, point: Array, force: Array, moment: Array, up: Array, strong: Flags
) -> Array:
    """(p - r) x F; r is found by least squares if it is not known."""
    if place is None:
        # Across the vertical M = p × F - r × F, and r × F is linear in r.
        flat = np.eye(3) - np.outer(up, up)
        turned = np.cross(np.eye(3)[None], force[strong][:, None, :])  # of each axis of r
        equations = -np.einsum("tik,kj->tji", turned, flat).reshape(-1, 3)
        wanted = (moment - np.cross(point, force))[strong] @ flat
        place = np.linalg.lstsq(equations, wanted.ravel(), rcond=None)[0]
    return np.cross(point - place, force)
