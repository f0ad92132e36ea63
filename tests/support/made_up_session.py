"""A laboratory's session whose truth is known: a made-up person stands, and walks a known walk.

The files are as a laboratory exports them: markers of WBDS in mm and forces in N, m and Nm, in
ISB axes (x forward, y up, z to the right); standing as C3D, walking as TRC with a MOT of the
ground reaction on each foot.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from known_walk import KnownWalk, known_walk
from scipy.spatial.transform import Rotation
from standing_person import HEADING, PERSON, StandingPerson, standing_person

from gaitval.gait.quality_flags import QualityFlag
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.mocap.c3d_writing import write_c3d
from gaitval.mocap.recording import FootForces, Recording
from gaitval.mocap.trc_writing import write_trc
from gaitval.model.markers import ModelMarker
from gaitval.scaling.marker_set import MarkerSet
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.session.opensim.coordinates import TO_OPENSIM
from gaitval.session.opensim.motion import write_ground_reaction
from gaitval.session.request import Request
from gaitval.session.session import Import

MARKER_RATE = 200.0
FORCES_PER_FRAME = 5
SECONDS = 4.0
STANDING_FRAMES = 200
SHORT = {"seconds": 2.4, "rate": 150.0, "per_frame": 2, "standing_frames": 60}
"""Of a session whose import takes half the time: for tests that look at something else than how
closely the truth comes back."""

CONTRADICTED = "measurement: unexplained"
"""The check that forces and markers contradict each other without one cause. Those of a made-up
session do: it has subject 5's motion on another body, which needs centres of pressure up to 10 cm
beside the ankles."""


@dataclass(frozen=True)
class MadeUpSession:
    """What was written, and the truth: `walk` at the frames of the markers."""

    person: StandingPerson
    walk: KnownWalk
    standing: Path
    walking: Path
    forces: Path

    @property
    def request(self) -> Request:
        return Request(
            static=self.standing,
            trials=(self.walking,),
            forces=(self.forces,),
            identifier=PERSON.identifier,
            mass=PERSON.mass_kg,
            height=PERSON.height_m,
            sex=PERSON.sex,
        )


@cache
def _truth(seconds: float, rate: float) -> tuple[StandingPerson, KnownWalk]:
    person = standing_person(toe_out={"r": 0.0, "l": 0.0})
    return person, known_walk(
        seconds=seconds,
        rate=rate,
        body=person.model,
        settling=0.06,
    )


def made_up_session(
    folder: Path,
    *,
    noise: float,
    misplaced: Mapping[str, tuple[float, float, float]] | None = None,
    seed: int = 0,
    seconds: float = SECONDS,
    rate: float = MARKER_RATE,
    per_frame: int = FORCES_PER_FRAME,
    standing_frames: int = STANDING_FRAMES,
) -> MadeUpSession:
    """Write the files of a session into a folder.

    Parameters
    ----------
    noise : standard deviation of every coordinate of every marker in every frame, m.
    misplaced : by how much markers are off their landmarks on the skin of the standing person,
        m forward, left, up; by what their names contain.
    seconds, rate, per_frame : of the walk, s; of the markers, Hz; samples of the forces in a frame.
    """
    random = np.random.default_rng(seed)
    person, walk = _truth(seconds, rate * per_frame)
    person = _with_misplaced(person, misplaced or {})
    marker_set = load_marker_set("wbds")
    places, local = person.markers(marker_set)
    stand = np.tile([places[name] for name in places], (standing_frames, 1, 1))
    stand = (
        Rotation.from_rotvec([0.0, 0.0, -np.radians(HEADING)])
        .apply(stand.reshape(-1, 3))
        .reshape(stand.shape)
    )
    stand += random.normal(0.0, noise, stand.shape)
    seen = _every(walk, per_frame)
    fitted = _worn(marker_set, local)
    walking = marker_positions(person.model, fitted, seen.positions)
    walking += random.normal(0.0, noise, walking.shape)

    session = MadeUpSession(
        person, seen, folder / "stand.c3d", folder / "walk.trc", folder / "walk_forces.mot"
    )
    standing = Recording("stand", "project", tuple(places), stand, rate)
    write_c3d(session.standing, standing.turned(TO_OPENSIM))
    names = tuple(marker.name for marker in fitted)
    trial = Recording("walk", "project", names, walking, rate)
    write_trc(session.walking, trial.turned(TO_OPENSIM))
    write_ground_reaction(session.forces, _forces(walk, rate * per_frame))
    return session


def _with_misplaced(
    person: StandingPerson, misplaced: Mapping[str, tuple[float, float, float]]
) -> StandingPerson:
    heading = Rotation.from_rotvec([0.0, 0.0, np.radians(HEADING)])
    landmarks = dict(person.landmarks)
    for part, shift in misplaced.items():
        for name in landmarks:
            if part in name:
                landmarks[name] = landmarks[name] + heading.apply(shift)
    return replace(person, landmarks=landmarks)


def _worn(marker_set: MarkerSet, local: dict[str, np.ndarray]) -> list[ModelMarker]:
    """Markers that stay on for walking."""
    return [
        ModelMarker(name, marker_set.markers[name].segment, place)
        for name, place in local.items()
        if not marker_set.markers[name].static_only
    ]


def _every(walk: KnownWalk, step: int) -> KnownWalk:
    return KnownWalk(
        walk.model,
        walk.time[::step],
        type(walk.kinematics)(*(values[::step] for values in walk.kinematics)),
        walk.force[::step],
        walk.point[::step],
        walk.free_moment[::step],
        walk.moments[::step],
    )


def _forces(walk: KnownWalk, rate: float) -> FootForces:
    """The wrenches of the walk as a plate shows them: no other free moment than the vertical."""
    force, moment = walk.force, walk.free_moment
    loaded = force[..., 2] > 0.0
    vertical = np.where(loaded, force[..., 2], 1.0)
    away = np.stack([-moment[..., 1], moment[..., 0], 0.0 * vertical], axis=-1)
    away /= vertical[..., None]
    free = moment - np.cross(away, force)
    return FootForces(
        rate=rate,
        start=0.0,
        force=np.where(loaded[..., None], force, 0.0),
        centre_of_pressure=np.where(loaded[..., None], walk.point + away, np.nan),
        free_moment=np.where(loaded[..., None], free, 0.0),
        valid=np.ones(loaded.shape, dtype=bool),
    )


def doubts(found: Import) -> list[QualityFlag]:
    """Warnings of an import of a made-up session, without `CONTRADICTED`."""
    return [flag for _, flag in found.warnings if flag.check != CONTRADICTED]
