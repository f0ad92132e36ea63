"""What force plates show of the person who stands on them in the standing trial: the body's weight.

Nobody accelerates in standing, so the sum of the forces is the weight to within a few parts in a
thousand, straight up: that shows the body mass, a plate's gain and cross-talk, and a tilt, which a
walk of one step on the plates shows ten times less well. The import itself needs no forces of
standing, so they are read here, and where they cannot be used nothing is said.
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.errors import GaitvalError, RecordWarning
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Plate, Recording
from gaitval.session.measurement.kinds import KINDS as FAULTS
from gaitval.session.measurement.kinds import kind_of
from gaitval.session.read import SessionRecordings
from gaitval.session.request import Request

KINDS: Final = ("standing force x", "standing force y", "standing force z")
NOISE: Final = (0.003, 0.003, 0.004)
"""Body weights: mean forces of standing people beside what `kinds.KINDS` has. Of eleven
children (McGill and Shriners, Montreal) 0.0008, 0.0012 and, of eight whose mass is right, 0.002."""
LOADED: Final = 0.05
"""Body weights from which on a plate carries a part of the person."""
WHOLE: Final = (0.85, 1.15)
"""Body weights that the plates show of a person who stands on them and nowhere else."""
SWAY: Final = 0.05
"""Body weights, spread (SD) of the sum of the vertical forces of somebody who stands still."""


@dataclass(frozen=True)
class StandingForces:
    """Mean force (3,) N of each plate that carries the standing person, in the axes of the walk;
    horizontal ones only if `level`: else it is unknown where the walk's axes point.
    """

    force: Mapping[str, Array]
    level: bool

    def rows(
        self, weight: float, names: Sequence[str], walked: Sequence[str]
    ) -> list[tuple[str, float, float, Array]]:
        """Kind, value, noise and effects of the faults `names` (F,), for each component: the force
        over the `weight`, N, minus what it should be. Only of plates that somebody `walked` on
        does it matter what is wrong with them.
        """
        share = {plate: force / weight for plate, force in self.force.items()}
        value = np.sum([*share.values()], axis=0) - [0.0, 0.0, 1.0]
        effects = {"mass": np.array([0.0, 0.0, -1.0])}
        effects |= {"tilt forward": np.array([1.0, 0.0, 0.0])}
        effects |= {"tilt left": np.array([0.0, 1.0, 0.0])}
        noise = np.square(NOISE)
        for plate, force in share.items():
            of = {"gain": force, "rotation": np.cross([0.0, 0.0, 1.0], force)}
            for i, axis in enumerate("xyz"):
                if axis != "z":
                    of[f"cross-talk {axis}"] = force[2] * np.eye(3)[i]
                of[f"offset {axis}"] = np.eye(3)[i]
            if plate in walked:
                effects |= {f"{name} {plate}": effect for name, effect in of.items()}
            else:
                sizes = {name: FAULTS[kind_of(name)].sound for name in of}
                noise = noise + sum((sizes[name] * of[name]) ** 2 for name in of)
        table = np.stack([effects.get(name, np.zeros(3)) for name in names], axis=1)
        return [
            (kind, float(value[i]), float(np.sqrt(noise[i])), table[i])
            for i, kind in enumerate(KINDS)
            if self.level or i == 2
        ]


def standing_of(request: Request, session: SessionRecordings) -> StandingForces | None:
    """What the plates show in the standing trial of a `request`, whose trials are `session`; None
    without a standing trial, and where nobody stands still on plates and nowhere else.
    """
    recording = session.standing
    if not recording.plates and not request.stands_in_walk:
        try:
            recording = with_plates(request, session).standing
        except GaitvalError:
            return None
    if not recording.plates:
        return None
    weight = request.mass_kg * STANDARD_GRAVITY
    forces = {plate.name: plate.force for plate in recording.plates}
    loaded = {
        name: force for name, force in forces.items()
        if len(force) and np.median(force[:, 2]) > LOADED * weight
    }  # fmt: skip
    if not loaded:
        return None
    total = np.sum([force[:, 2] for force in loaded.values()], axis=0) / weight
    if not (WHOLE[0] < np.median(total) < WHOLE[1] and total.std() < SWAY):
        return None
    known = {plate.name for plate in recording.plates if np.isfinite(plate.corners).all()}
    means = {name: np.median(force, axis=0) for name, force in loaded.items()}
    return StandingForces(means, known.issuperset(means))


def with_plates(request: Request, session: SessionRecordings) -> SessionRecordings:
    """The `session` with the plates of its standing trial, in the axes of the first walk.

    Raises RecordError if the file of the standing trial, or its plates, cannot be read.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordWarning)
        found = read_recording(request.static)
    if request.plate:
        from gaitval.session.stated_plates import with_stated_plates

        found = with_stated_plates(found, request.plate)
    if request.static_time is not None:
        found = found.between(request.static_time, "static_time")
    plates = found.turned(session.axes.rotation).plates
    turn = _turn(plates, session.walking[0].plates)
    if turn is None:
        plates = tuple(replace(each, corners=np.full((4, 3), np.nan)) for each in plates)
    else:
        only = replace(session.standing, plates=plates)
        plates = only.turned(Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix()).plates
    standing: Recording = replace(session.standing, plates=plates, force_rate=found.force_rate)
    return replace(session, standing=standing)


def _turn(here: Sequence[Plate], there: Sequence[Plate]) -> float | None:
    """rad, about the vertical, that takes the plates `here` to those of the same names `there`."""
    others = {plate.name: plate for plate in there}
    edges = [
        (np.diff(one.corners[:, :2], axis=0), np.diff(others[one.name].corners[:, :2], axis=0))
        for one in here if one.name in others
    ]  # fmt: skip
    if not edges or not np.isfinite(edges).all():
        return None
    one, two = (np.concatenate(each) for each in zip(*edges, strict=True))
    across = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    return float(np.arctan2(across.sum(), (one * two).sum()))
