"""OpenSim's files of an import: the model, and of each trial markers, motion, loads and moments."""

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array, runs
from gaitval.configuration import ContactSettings
from gaitval.coordinates import ACTUATED, COORDINATES, ROOT
from gaitval.kinetics.inverse.device_moments import device_moments
from gaitval.mocap.mot_writing import StorageTable, write_storage
from gaitval.mocap.recording import FootForces
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.quantities.quantity import OverTime
from gaitval.session.opensim.coordinates import vectors_to_opensim
from gaitval.session.opensim.motion import (
    moments_shown,
    write_external_loads,
    write_ground_reaction,
    write_markers,
    write_moments,
    write_motion,
    write_quantities,
)
from gaitval.session.opensim.osim import write_osim
from gaitval.session.session import Import
from gaitval.session.trial import WalkingTrial

MOSTLY: Final = 0.5
"""Share of a contact that must be used for the rest to be written."""
FILES: Final = (
    "markers.trc", "ik.mot", "grf.mot", "external_loads.xml", "id.sto", "quantities.sto",
)  # fmt: skip


def write_import(target: Path, found: Import, contact: ContactSettings) -> list[Path]:
    """Write OpenSim's files of everything `found` to `target`; returns them.

    They belong together: OpenSim's inverse dynamics finds the written moments from the written
    motion and ground reaction. So the ground reaction is the one that inverse dynamics used, and a
    trial that was made consistent has a model with its own masses. The models' feet have this
    `contact`.
    """
    determined = np.asarray(found.trials[0].kinematics.determined.any(axis=0))
    locked = {
        name: 0.0
        for name, seen in zip(COORDINATES, determined, strict=True)
        if not seen and name not in ROOT
    }
    friction = float(nominal_parameters()[PARAMETERS.index("friction")])

    def write_model(path: Path, model: BodyModel) -> None:
        write_osim(path, model, found.body.markers, contact, friction, locked=locked)
        written.append(path)

    written: list[Path] = []
    write_model(target / "model.osim", found.body.model)
    for number, walk in enumerate(found.trials, start=1):
        written += write_trial(target, number, walk)
        if walk.recording.devices:
            path = target / f"trial{number}_devices.sto"
            model = found.body.model if walk.consistent is None else walk.consistent.model
            written += [path] if write_devices(path, model, walk) else []
        if walk.consistent is not None:
            write_model(target / f"trial{number}_model.osim", walk.consistent.model)
    return written


def write_trial(target: Path, number: int, walk: WalkingTrial) -> list[Path]:
    """Write OpenSim's files of a trial `walk` to `target`, with `number` in their names."""
    files = {name: target / f"trial{number}_{name}" for name in FILES}
    write_markers(files["markers.trc"], walk.recording)
    write_motion(files["ik.mot"], walk.recording.time, walk.motion)
    if walk.loads is None or walk.moments is None:
        return [files["markers.trc"], files["ik.mot"]]
    write_ground_reaction(files["grf.mot"], used(walk))
    write_external_loads(files["external_loads.xml"], files["grf.mot"].name)
    write_moments(files["id.sto"], walk.motion, walk.moments, shown=walk.moments.foot_known)
    known = moments_shown(walk.moments.moments, walk.moments.foot_known)
    powers = np.where(np.isnan(known), np.nan, walk.moments.powers)
    motion = OverTime(walk.motion[:, len(ROOT) :], known, powers)
    write_quantities(files["quantities.sto"], walk.moments.time, motion)
    return list(files.values())


def write_devices(path: Path, model: BodyModel, walk: WalkingTrial) -> bool:
    """Write the torques of the devices of a trial `walk` to `path` (`.sto`, Nm), and what they do
    at the joints of `model` that their names say: `hip_flexion_r_device_moment`, and what is left
    of the joint's moment for the person, `hip_flexion_r_person_moment`. NaN where the moment is not
    known. Nothing is written of a trial whose frames are not those of the devices; returns whether
    it was.
    """
    devices, motion = walk.recording.devices, walk.motion
    if any(len(device.torque) != len(motion) for device in devices):
        return False
    columns: dict[str, Array] = {}
    for name, moment in device_moments(model, motion, devices).items():
        columns[f"{name}_device_moment"] = moment
        if walk.loads is not None and walk.moments is not None:
            known = moments_shown(walk.moments.moments, walk.moments.foot_known)
            columns[f"{name}_person_moment"] = known[:, ACTUATED.index(name)] - moment
    for device in devices:
        torque = vectors_to_opensim(device.torque)
        columns |= {f"{device.name}_torque_{x}": torque[:, i] for i, x in enumerate("xyz")}
    table = np.column_stack(list(columns.values()))
    time = walk.recording.time
    write_storage(path, StorageTable(tuple(columns), time, table, name="Devices"))
    return True


def used(walk: WalkingTrial) -> FootForces:
    """The forces of a trial without those that are not used: zero where the plates do not show a
    foot alone. A foot that markers hide for a moment keeps its force.
    """
    loads, forces = walk.loads, walk.forces
    assert loads is not None
    assert forces is not None
    nearest = np.rint((loads.time - forces.start) * forces.rate).astype(int)
    shown = forces.valid[np.clip(nearest, 0, len(forces.valid) - 1)]
    for column in (0, 1):
        # The low-pass spreads a force beyond its contact: its tails are not used either.
        loaded = np.isfinite(loads.centre_of_pressure[:, column, 0])
        for begin, end in zip(*runs(loaded), strict=True):
            if shown[begin:end, column].mean() < MOSTLY:
                shown[begin:end, column] = False
    shown = shown[..., None]
    return replace(
        loads,
        force=np.where(shown, loads.force, 0.0),
        centre_of_pressure=np.where(shown, loads.centre_of_pressure, np.nan),
        free_moment=np.where(shown, loads.free_moment, 0.0),
    )
