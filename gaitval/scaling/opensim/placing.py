"""Where the bodies and markers of an OpenSim model are: its forward kinematics, without OpenSim."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval._internal.io.text_tables import MISSING
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.mot_writing import StorageTable
from gaitval.scaling.opensim.model import GROUND, Frame, Marker, OpenSimJoint, OsimModel


@dataclass(frozen=True)
class Motion:
    """Values of all coordinates of a model over time.

    Attributes
    ----------
    time : (T,) s.
    values : (T,) rad or m by coordinate.
    given : coordinates that the file has; the others have their default, or follow a coupler.
    coupler_errors : largest difference of a given value from what its coupler says, rad or m; of a
        file in degrees, in that unit in which it is smaller.
    """

    time: Array
    values: Mapping[str, Array]
    given: frozenset[str]
    coupler_errors: Mapping[str, float]


def motion_of(model: OsimModel, table: StorageTable, source: str) -> Motion:
    """The motion of `model` in a `table` of inverse kinematics or of states.

    Angles in degrees are turned into radians as OpenSim does: those of rotational coordinates, and
    of coupled ones where the numbers agree with the coupler so. A coordinate that a coupler
    determines is the coupler's, whatever the file says. Raises RecordError, which names the
    `source`, if the table has no coordinate of the model, lacks one that moves the body from the
    ground, or a value is not a number.
    """
    columns = {_coordinate_name(column): column for column in table.columns}
    known = [name for name in model.coordinates if name in columns]
    if not known:
        raise RecordError(
            f"{source}: has none of the model's coordinates ({_few(model.coordinates)}), but "
            f"{_few(table.columns)}. Give the motion that inverse kinematics wrote for this model."
        )
    root = model.root()
    missing = [name for name in (root.coordinates if root else ()) if name not in columns]
    if missing:
        raise RecordError(
            f"{source}: lacks {', '.join(missing)}, which say where the body is. Give the motion "
            "that inverse kinematics wrote for this model."
        )
    values: dict[str, Array] = {}
    for name, coordinate in model.coordinates.items():
        if name not in columns:
            values[name] = np.full(len(table.time), coordinate.default)
            continue
        found = table.column(columns[name])
        if not np.isfinite(found).all():
            raise RecordError(f"{source}: {columns[name]}: a value is not a number. Export again.")
        if (gap := np.flatnonzero(np.isin(np.abs(found), MISSING))).size:
            raise RecordError(
                f"{source}: {columns[name]} is {found[gap[0]]:g} at {table.time[gap[0]]:g} s, "
                "which stands for a value that is missing. Fill the gap, or cut the motion."
            )
        in_degrees = table.in_degrees and coordinate.motion == "rotational"
        values[name] = np.deg2rad(found) if in_degrees else found
    errors = {}
    for coupler in model.couplers:
        expected = coupler.function(values[coupler.independent])
        if coupler.dependent in columns:
            written = values[coupler.dependent]
            # OpenSim 3.3 turns coupled coordinates into degrees as all others, OpenSim 4 does not:
            # the numbers show which of them wrote the file.
            turned = table.in_degrees and model.coordinates[coupler.dependent].motion == "coupled"
            read = (written, np.deg2rad(written)) if turned else (written,)
            errors[coupler.dependent] = min(float(np.abs(v - expected).max()) for v in read)
        values[coupler.dependent] = expected
    return Motion(table.time, values, frozenset(known), errors)


def at_times(motion: Motion, times: Array) -> Motion:
    """The motion at other times, linearly interpolated; beyond its ends it does not move."""
    values = {n: np.interp(times, motion.time, v) for n, v in motion.values.items()}
    return Motion(times, values, motion.given, motion.coupler_errors)


def _coordinate_name(column: str) -> str:
    """`knee_angle_r` of `knee_angle_r`, of `/jointset/knee_r/knee_angle_r/value` and of
    `knee_r/knee_angle_r/value`.
    """
    parts = column.split("/")
    return parts[-2] if len(parts) > 1 and parts[-1] == "value" else column


def _few(names: Sequence[str] | Mapping[str, object]) -> str:
    some = list(names)
    return ", ".join(some[:5]) + (" …" if len(some) > 5 else "")


Poses = Mapping[str, tuple[Array, Array]]
"""Rotation (T, 3, 3) and origin (T, 3) m in the ground of every body."""


def place(model: OsimModel, values: Mapping[str, Array]) -> dict[str, tuple[Array, Array]]:
    """Poses of all bodies of `model` for `values` (T,) rad or m of every coordinate."""
    count = len(next(iter(values.values()))) if values else 1
    poses = {GROUND: (np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)))}
    for joint, reverse in model.tree:
        rotation, origin = _across(joint, values, count)
        near, far = joint.parent, joint.child
        if reverse:
            # A joint that is written from the child's side is passed the other way.
            near, far = far, near
            rotation, origin = _inverse(rotation, origin)
        at, start = _then(*poses[near.body], near)
        origin = start + np.einsum("tij,tj->ti", at, origin)
        rotation = at @ rotation @ far.rotation.T
        poses[far.body] = rotation, origin - rotation @ far.origin
    return poses


def marker_places(model: OsimModel, poses: Poses, names: Sequence[str]) -> Array:
    """Places (T, M, 3) m in the ground of the markers `names` of `model`, its bodies at `poses`."""
    by_name: Mapping[str, Marker] = {marker.name: marker for marker in model.markers}
    found = []
    for name in names:
        rotation, origin = poses[by_name[name].body]
        found.append(origin + rotation @ by_name[name].location)
    return np.stack(found, axis=1)


def centre_of_mass(model: OsimModel, poses: Poses) -> Array:
    """Centre of mass of the whole `model` with its bodies at `poses`, (T, 3) m in the ground."""
    moments = [
        body.mass * (poses[name][1] + poses[name][0] @ body.centre)
        for name, body in model.bodies.items()
    ]
    return np.asarray(np.sum(moments, axis=0) / model.mass)


def _across(joint: OpenSimJoint, values: Mapping[str, Array], count: int) -> tuple[Array, Array]:
    """From the parent's to the child's frame of a joint: rotation (T, 3, 3), origin (T, 3)."""
    still = np.zeros(count)
    rotation = np.tile(np.eye(3), (count, 1, 1))
    origin = np.zeros((count, 3))
    for index, axis in enumerate(joint.axes):
        moved = axis.function(still if axis.coordinate is None else values[axis.coordinate])
        # The first three axes are rotations, the last three translations in the parent's frame.
        if index >= 3:
            origin += moved[:, None] * axis.axis
        elif moved.any():
            rotation = rotation @ Rotation.from_rotvec(moved[:, None] * axis.axis).as_matrix()
    return rotation, origin


def _then(rotation: Array, origin: Array, frame: Frame) -> tuple[Array, Array]:
    return rotation @ frame.rotation, origin + rotation @ frame.origin


def _inverse(rotation: Array, origin: Array) -> tuple[Array, Array]:
    back = np.swapaxes(rotation, 1, 2)
    return back, -np.einsum("tij,tj->ti", back, origin)
