"""The person and the walk as OpenSim reads them: model, motion, moments, ground reaction, loads."""

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.apps.export.virtual_markers import virtual_markers
from gaitval.apps.export.walked import ExportedWalk
from gaitval.arrays import Array
from gaitval.coordinates import ROOT, SIDES
from gaitval.kinetics.musculature.gait import muscles_of
from gaitval.metrics.walk_muscles import lost_joints, walk_motion
from gaitval.mocap.recording import FootForces
from gaitval.quantities.quantity import OverTime
from gaitval.session.opensim.motion import (
    write_external_loads,
    write_forces,
    write_ground_reaction,
    write_motion,
    write_quantities,
)
from gaitval.session.opensim.muscle_motion import write_storages
from gaitval.session.opensim.osim import write_osim

LOADED_N: Final = 1.0
"""Below this vertical force a centre of pressure is noise, and OpenSim is given none."""
FILES: Final = (
    "model.osim", "walk.mot", "moments.sto", "ground_reaction.mot", "loads.xml", "quantities.sto",
    "model_with_muscles.osim", "walk_activation.sto", "walk_force.sto", "walk_contact.sto",
)  # fmt: skip


def write_opensim(folder: Path, walked: ExportedWalk) -> list[Path]:
    """Write `FILES` into `folder`; returns their paths. Raises ArtefactError or ModelError."""
    paths = [folder / name for name in FILES]
    model, motion, moments, reaction, loads, quantities, with_muscles, *_ = paths
    rows, walk = walked.rows, walked.walk
    time, positions = walk.time[rows] - walk.time[rows.start], walk.positions[rows]
    contact = walked.stored.configuration.contact
    write_osim(model, walked.body, virtual_markers(walked), contact, walked.friction)
    subject = walked.stored.subject
    lost, (person, laden) = lost_joints(subject), walked.person
    write_osim(
        with_muscles, walked.body, virtual_markers(walked), contact, walked.friction,
        height=subject.height_m, lost=lost, person=person,
    )  # fmt: skip
    write_motion(motion, time, positions)
    # Nothing but gravity and the ground acts on the pelvis.
    of_joints = walk.moments[rows]
    write_forces(moments, time, positions, np.hstack([np.zeros((len(time), 6)), of_joints]))
    powers = of_joints * walk.velocities[rows, len(ROOT) :]
    write_quantities(quantities, time, OverTime(positions[:, len(ROOT) :], of_joints, powers))
    write_ground_reaction(reaction, foot_forces(walked))
    write_external_loads(loads, reaction.name)
    whole = walk_motion(
        walk, walked.cycles, person, height=subject.height_m, lost=lost, laden=laden
    )
    start, end = float(walk.time[rows.start]), float(walk.time[rows.stop - 1])
    # Both legs over the rows of the motion, so that one file has both.
    over = replace(whole, cycles={}, spans=dict.fromkeys(SIDES, ((start, end),)))
    list(write_storages(folder, muscles_of([over]), start=start))
    return paths


def foot_forces(walked: ExportedWalk) -> FootForces:
    """Force, centre of pressure and free moment on each foot, over the exported rows."""
    wrenches = walked.walk.wrenches()[walked.rows]
    force, moment = wrenches[..., :3].copy(), wrenches[..., 3:]
    loaded = force[..., 2] > LOADED_N
    force[~loaded] = 0.0
    point = _centre_of_pressure(np.where(loaded, force[..., 2], np.nan), moment)
    free = np.nan_to_num(moment - np.cross(point, force))
    step = float(walked.walk.time[1] - walked.walk.time[0])
    return FootForces(1.0 / step, 0.0, force, point, free, np.ones(loaded.shape, dtype=bool))


def _centre_of_pressure(vertical: Array, moment: Array) -> Array:
    """(…, 3) m on the floor: M_x = y F_z and M_y = -x F_z."""
    return np.stack(
        [-moment[..., 1] / vertical, moment[..., 0] / vertical, 0.0 * vertical], axis=-1
    )
