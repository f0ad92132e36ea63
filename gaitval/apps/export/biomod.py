"""The person and the walk for pyomeca: a bioMod file, and coordinates, rates and moments over time.

A segment of a bioMod file turns about axes of its own frame only, in a stated order. The axes of
this body are such axes, some of them reversed: those coordinates change sign in the motion.
"""

from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.apps.export.virtual_markers import virtual_markers
from gaitval.apps.export.walked import ExportedWalk
from gaitval.arrays import Array
from gaitval.artefacts import replacing, write_text
from gaitval.coordinates import ACTUATED, AXES
from gaitval.model.body import JOINT_COORDINATES, PARENTS, Segment
from gaitval.model.measured_ranges import MEASURED_RANGES

FILES: Final = ("person.bioMod", "walk.npz")
_ROOT: Final = 6
_HEADER: Final = """version 4

// Written by gaitval. SI units; x forward, y left, z up. The coordinates are those of walk.npz, in
// its order.
"""


def write_biomod(folder: Path, walked: ExportedWalk) -> list[Path]:
    """Write `FILES` into `folder`; returns their paths. Raises ArtefactError."""
    write_text(folder / "person.bioMod", biomod_text(walked))
    rows, walk = walked.rows, walked.walk
    order, signs = _coordinates()
    q, rates = _with_root_angles(walk.positions[rows], walk.velocities[rows])
    moments = np.hstack([np.zeros((len(q), _ROOT)), walk.moments[rows]])
    with replacing(folder / "walk.npz") as temporary, temporary.open("wb") as file:
        np.savez(
            file,
            time=walk.time[rows] - walk.time[rows.start],
            names=np.array(coordinate_names()),
            # a coordinate a row, as bioviz and biorbd take them
            q=(q[:, order] * signs).T,
            qdot=(rates[:, order] * signs).T,
            tau=(moments[:, order] * signs).T,
        )
    return [folder / name for name in FILES]


def coordinate_names() -> list[str]:
    """Names of the coordinates in the order of the bioMod file: of the pelvis its place, m, and its
    turns about its own x, y and z, rad, one after the other; then the joints.
    """
    root = [f"pelvis_{kind}{axis}" for kind in ("t", "r") for axis in "xyz"]
    return [*root, *(name for names in JOINT_COORDINATES.values() for name in names)]


def biomod_text(walked: ExportedWalk) -> str:
    """The scaled body with the person's markers, as a bioMod file of version 4."""
    parts = [_HEADER, f"gravity {_numbers(walked.body.ground.gravity)}\n"]
    parts += [_segment(each) for each in walked.body.segments]
    parts += [
        f"marker {each.name}\n  parent {each.segment}\n  position {_numbers(each.position)}\n"
        "endmarker\n"
        for each in virtual_markers(walked)
    ]
    return "\n".join(parts)


def _segment(segment: Segment) -> str:
    names = JOINT_COORDINATES.get(segment.name, ())
    lines = [f"segment {segment.name}"]
    if segment.name in PARENTS:
        lines.append(f"  parent {PARENTS[segment.name]}")
        lines += ["  rtinmatrix 0", f"  rt 0 0 0 xyz {_numbers(segment.joint_position)}"]
        lines.append(f"  rotations {''.join('xyz'[_axis(name)] for name in names)}")
        lines += ["  rangesQ", *(f"    {_numbers(_range(name))}" for name in names)]
    else:
        lines += ["  translations xyz", "  rotations xyz"]
    lines += [f"  mass {segment.mass!r}", "  inertia"]
    lines += [f"    {_numbers(row)}" for row in segment.inertia]
    lines += [f"  com {_numbers(segment.centre_of_mass)}", "endsegment\n"]
    return "\n".join(lines)


def _axis(name: str) -> int:
    """The axis of its segment, 0 to 2, that a coordinate turns about."""
    return int(np.argmax(np.abs(AXES[name])))


def _sign(name: str) -> float:
    """Whether it turns about this axis or its opposite, 1 or -1."""
    return float(np.sign(AXES[name][_axis(name)]))


def _range(name: str) -> Array:
    """(2,) rad, of a coordinate as the file has it."""
    return np.sort(_sign(name) * np.array(MEASURED_RANGES[name], dtype=float))


def _numbers(values: Array) -> str:
    return " ".join(repr(float(each)) for each in values)


def _coordinates() -> tuple[list[int], Array]:
    """Column of a walk and sign of each coordinate of the file, in its order (31,)."""
    joints = coordinate_names()[_ROOT:]
    order = [3, 4, 5, 0, 1, 2, *(_ROOT + ACTUATED.index(name) for name in joints)]
    return order, np.array([1.0] * _ROOT + [_sign(name) for name in joints])


def _with_root_angles(positions: Array, velocities: Array) -> tuple[Array, Array]:
    """Positions and velocities (T, 31) with the pelvis turned by angles about its own x, y and z,
    rad and rad/s, in place of its rotation vector and its angular velocity in world axes.
    """
    q, rates = positions.copy(), velocities.copy()
    q[:, :3] = Rotation.from_rotvec(positions[:, :3]).as_euler("XYZ")
    (a, b, _), zero, one = q[:, :3].T, np.zeros(len(q)), np.ones(len(q))
    # columns: the axes of the three turns in the world
    axes = np.array(
        [
            [one, zero, np.sin(b)],
            [zero, np.cos(a), -np.sin(a) * np.cos(b)],
            [zero, np.sin(a), np.cos(a) * np.cos(b)],
        ]
    )
    rates[:, :3] = np.linalg.solve(np.moveaxis(axes, -1, 0), velocities[:, :3, None])[..., 0]
    return q, rates
