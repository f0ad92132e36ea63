"""Motion, moments and ground reaction as files of OpenSim, in its axes, names and signs.

They belong to the model that `osim.write_osim` writes. `write_external_loads` ties the ground
reaction to its feet for OpenSim's inverse dynamics.
"""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from gaitval._internal.io.artefacts import write_text
from gaitval.arrays import Array, Flags
from gaitval.coordinates import COORDINATES, LEG, ROOT, SIDES
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics
from gaitval.mocap.mot_writing import StorageTable, write_storage
from gaitval.mocap.recording import FootForces, Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.quantities import QUANTITIES
from gaitval.quantities.quantity import OverTime
from gaitval.session.opensim.coordinates import (
    OPENSIM_COORDINATES,
    PELVIS_TRANSLATIONS,
    TO_OPENSIM,
    forces_to_opensim,
    to_opensim,
    vectors_to_opensim,
)
from gaitval.session.opensim.osim import BODIES, DOCUMENT_VERSION, component_name

_ROTATIONS = np.array([name not in PELVIS_TRANSLATIONS for name in OPENSIM_COORDINATES])


def write_markers(path: Path, recording: Recording) -> None:
    """Write the markers of `recording`, which is in the project's axes, to `path` as TRC for
    OpenSim's inverse kinematics (mm, OpenSim's axes), by the names that a model has of them.
    """
    names = tuple(map(component_name, recording.names))
    write_trc(path, replace(recording.turned(TO_OPENSIM), names=names))


def write_motion(path: Path, time: Array, positions: Array) -> None:
    """Write a motion to `path` (`.mot`, degrees and metres) for OpenSim: `time` (T,) s and
    `positions` (T, 31) rad and m, in the order of `coordinates.COORDINATES`.
    """
    values = to_opensim(positions)
    values[:, _ROTATIONS] = np.rad2deg(values[:, _ROTATIONS])
    write_storage(
        path, StorageTable(OPENSIM_COORDINATES, time, values, in_degrees=True, name="Coordinates")
    )


def write_moments(
    path: Path, positions: Array, dynamics: InverseDynamics, shown: Flags | None = None
) -> None:
    """Write joint moments and the residuals on the pelvis to `path`, as `write_forces`; `dynamics`
    is that of the motion `positions` (T, 31) rad and m.

    `shown` (T, 2) is whether the plates and markers show each leg and its force, right first: a leg
    of which they do not has no moments (NaN) there, nor has the pelvis a residual.
    """
    moments = moments_shown(dynamics.moments, shown)
    forces = np.hstack([dynamics.residual_moment, dynamics.residual_force, moments])
    if shown is not None:
        forces[~np.asarray(shown.all(axis=1)), : len(ROOT)] = np.nan
    write_forces(path, dynamics.time, positions, forces)


def moments_shown(moments: Array, shown: Flags | None) -> Array:
    """Joint `moments` (T, 25) without those of a leg where it and its force are not `shown` (T, 2),
    right first: NaN there; all of them if nobody said.
    """
    known = moments.copy()
    if shown is None:
        return known
    for column, side in enumerate(SIDES):
        leg = np.array([COORDINATES.index(f"{name}_{side[0]}") - len(ROOT) for name in LEG])
        known[np.ix_(np.flatnonzero(~shown[:, column]), leg)] = np.nan
    return known


def write_forces(path: Path, time: Array, positions: Array, forces: Array) -> None:
    """Write generalised `forces` (T, 31) Nm and N to `path` (`.sto`), under the names of OpenSim's
    inverse dynamics: `hip_flexion_r_moment`, `pelvis_tx_force`, … They are at `time` (T,) s of the
    motion `positions` (T, 31) rad and m, see `forces_to_opensim`.
    """
    names = tuple(
        f"{name}_moment" if rotation else f"{name}_force"
        for name, rotation in zip(OPENSIM_COORDINATES, _ROTATIONS, strict=True)
    )
    values = forces_to_opensim(positions, forces)
    name = "Inverse Dynamics Generalized Forces"
    write_storage(path, StorageTable(names, time, values, name=name))


def write_quantities(path: Path, time: Array, motion: OverTime) -> None:
    """Write what follows from a `motion` to `path` (`.sto`), at `time` (T,) s: a column for each
    curve of `gaitval.quantities` that is defined over time, `ankle_angle_power_r`, in its
    `time_unit`.
    """
    columns: dict[str, Array] = {}
    for each in QUANTITIES:
        if each.of_time is not None:
            for name, values in each.of_time(motion).items():
                columns[f"{name[:-2]}_{each.name}{name[-2:]}"] = values
    table = np.column_stack(list(columns.values()))
    write_storage(path, StorageTable(tuple(columns), time, table, name="Quantities"))


def write_ground_reaction(path: Path, forces: FootForces) -> None:
    """Write the ground reaction on both feet, `forces`, to `path` (`.mot`, N, m, Nm in OpenSim's
    axes).

    A foot in the air has no force; its centre of pressure then moves from its last to its next
    position, because OpenSim interpolates and cannot read missing values (in version 4.6, NaN gives
    wrong moments without a warning). For the same reason the zero force of a foot that the plates
    did not show (`FootForces.valid` false) is not marked: give OpenSim's tools a time range in
    which both feet are shown.
    """
    time = forces.time
    names: list[str] = []
    values = []
    for i, side in enumerate(SIDES):
        known = np.asarray(np.isfinite(forces.centre_of_pressure[:, i]).all(axis=1))
        point = np.zeros((len(time), 3))
        if known.any():
            for axis in range(3):
                place = forces.centre_of_pressure[known, i, axis]
                point[:, axis] = np.interp(time, time[known], place)
        for kind, vectors in (
            ("force_{}_v", np.where(known[:, None], forces.force[:, i], 0.0)),
            ("force_{}_p", point),
            ("torque_{}_", np.where(known[:, None], forces.free_moment[:, i], 0.0)),
        ):
            names += [f"ground_{kind.format(side[0])}{axis}" for axis in "xyz"]
            values.append(vectors_to_opensim(vectors))
    table = StorageTable(tuple(names), time, np.hstack(values), name="Ground reaction")
    write_storage(path, table)


def write_external_loads(path: Path, ground_reaction: Path | str) -> None:
    """Write to `path` which forces of `write_ground_reaction`'s file act on which body (XML).

    `ground_reaction` is the file, as written in the XML: relative to the folder of `path`. OpenSim
    first looks in its current folder, and uses a file of this name there.
    """
    document = ElementTree.Element("OpenSimDocument", Version=DOCUMENT_VERSION)
    loads = ElementTree.SubElement(document, "ExternalLoads", name="ground_reaction")
    objects = ElementTree.SubElement(loads, "objects")
    for side in SIDES:
        force = ElementTree.SubElement(objects, "ExternalForce", name=f"{side}_foot")
        for tag, text in (
            ("applied_to_body", BODIES[f"foot_{side[0]}"]),
            ("force_expressed_in_body", "ground"),
            ("point_expressed_in_body", "ground"),
            ("force_identifier", f"ground_force_{side[0]}_v"),
            ("point_identifier", f"ground_force_{side[0]}_p"),
            ("torque_identifier", f"ground_torque_{side[0]}_"),
        ):
            ElementTree.SubElement(force, tag).text = text
    ElementTree.SubElement(loads, "datafile").text = str(ground_reaction)
    ElementTree.indent(document)
    text = ElementTree.tostring(document, encoding="unicode")
    write_text(Path(path), f'<?xml version="1.0" encoding="UTF-8" ?>\n{text}\n')
