"""A walk whose model, motion, moments and forces belong together, as files of OpenSim."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from known_walk import KnownWalk, known_walk

from gaitval.apps.judge.motion_units import LEGS
from gaitval.apps.judge.request import JudgeRequest
from gaitval.configuration import ContactSettings
from gaitval.coordinates import ACTUATED, SIDES
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics, inverse_dynamics
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.mocap.recording import FootForces, Recording
from gaitval.model.markers import ModelMarker
from gaitval.session.opensim.motion import (
    write_external_loads,
    write_ground_reaction,
    write_markers,
    write_moments,
    write_motion,
)
from gaitval.session.opensim.osim import write_osim
from gaitval.subjects.subject_file import load_subject

RATE = 100.0
NOISE_M = 0.005
"""Standard deviation of every component of a marker: RMS distance √3 times that."""
SEGMENTS = ("pelvis", *(f"{n}_{side}" for side in "rl" for n in ("thigh", "shank", "foot")))


@pytest.fixture(scope="session")
def judged_files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with model.osim, ik.mot, id.sto, walk.trc, grf.mot, loads.xml of subject 5."""
    folder = tmp_path_factory.mktemp("judged")
    walk = known_walk(seconds=3.0, rate=RATE)
    random = np.random.default_rng(0)
    markers = tuple(
        ModelMarker(f"{s}.{i}", s, walk.model[s].centre_of_mass + random.uniform(-0.1, 0.1, 3))
        for s in SEGMENTS
        for i in range(3)
    )
    write_osim(folder / "model.osim", walk.model, markers, ContactSettings(), 0.8)
    write_motion(folder / "ik.mot", walk.time, walk.positions)
    # What plates measure: a free moment about the vertical only.
    twist = walk.free_moment * [0.0, 0.0, 1.0]
    dynamics = inverse_dynamics(walk.model, walk.time, walk.positions, *walk.wrenches)
    write_moments(folder / "id.sto", walk.positions, _as_recorded(walk, dynamics))
    forces = FootForces(
        RATE, 0.0, walk.force, walk.point, twist, np.ones(walk.force.shape[:2], dtype=bool)
    )
    write_ground_reaction(folder / "grf.mot", forces)
    write_external_loads(folder / "loads.xml", "grf.mot")
    seen = marker_positions(walk.model, markers, walk.positions)
    seen += random.normal(0.0, NOISE_M, seen.shape)
    names = tuple(marker.name for marker in markers)
    write_markers(folder / "walk.trc", Recording("made up", "project", names, seen, RATE))
    return folder


def _as_recorded(walk: KnownWalk, dynamics: InverseDynamics) -> InverseDynamics:
    """With the sagittal moments of the person's record: the walk puts each foot's force under its
    ankle, so its moments balance but are not those of people.
    """
    record = load_subject("S05").record()
    moments = dynamics.moments.copy()
    for side in SIDES:
        phase = walk.time / record.stride_time - (record.left_phase if side == "left" else 0.0)
        for name in LEGS:
            curve = record.moments[f"{name}_{side[0]}"]
            column = ACTUATED.index(f"{name}_{side[0]}")
            moments[:, column] = curve(phase) * walk.model.mass
    return replace(dynamics, moments=moments)


@pytest.fixture(scope="session")
def everything(judged_files: Path) -> JudgeRequest:
    """The request that names all of them."""
    return JudgeRequest(
        model=judged_files / "model.osim",
        ik=judged_files / "ik.mot",
        id=judged_files / "id.sto",
        markers=judged_files / "walk.trc",
        external_loads=judged_files / "loads.xml",
        mass=64.95,
        height=1.53,
    )
