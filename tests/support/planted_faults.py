"""Faults planted in what a session has read: forces that are late, plates that are moved.

Each takes the trials in the project's axes, standing trial and walks, and gives them back as a
session with that fault would have recorded them: a plate's fault is there in standing as well. What
is planted in the forces acts on whatever the file gives: force with moment, or force with centre of
pressure.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.gait.filters import low_pass
from gaitval.mocap.recording import Plate, Recording
from gaitval.session.read import SessionRecordings

_Planted = Callable[[SessionRecordings], SessionRecordings]


class Fault(NamedTuple):
    """A planted fault: what it does to a session, the factor of the mass that is given with it, and
    its size, in the units of its kind (`gaitval.session.measurement.kinds`).
    """

    change: _Planted
    mass: float = 1.0
    size: float = 0.0


def _tilted(recording: Recording) -> Recording:
    return recording.turned(Rotation.from_rotvec([np.radians(2.5), 0.0, 0.0]).as_matrix())


def faults() -> dict[str, Fault]:
    """By what is done."""
    turn = float(np.radians(4.0))
    return {
        "forces 35 ms late": Fault(_walks(partial(_delayed, seconds=0.035)), size=0.035),
        "mass +10 %": Fault(lambda session: session, mass=1.1, size=0.1),
        "plate 1 40 mm forward": Fault(_all(partial(moved, plate=0, axis=0, metres=0.04))),
        "plate 2 gain -10 %": Fault(_all(partial(gained, plate=1, gain=-0.1))),
        "plate 1 rotated 8°": Fault(
            _all(partial(_on_plate, number=0, change=partial(_rotated, angle=np.radians(8.0))))
        ),
        "plate 2 cross-talk +5 % sideways": Fault(
            _all(partial(_on_plate, number=1, change=partial(_crossed, axis=1, share=0.05)))
        ),
        "forces low-passed at 5 Hz": Fault(_walks(partial(_filtered, hertz=5.0))),
        "all plates 30 mm forward": Fault(
            _all(partial(_on_all, change=partial(_moved, axis=0, metres=0.03)))
        ),
        "all plates rotated 4°": Fault(_all(partial(_turned_about_origin, angle=turn)), size=turn),
        "laboratory tilted 2.5° about x": Fault(_all(_tilted)),
    }


def moved(recording: Recording, plate: int, axis: int, metres: float) -> Recording:
    """A recording with one plate (its number) moved along an axis."""
    return _on_plate(recording, plate, lambda one: _moved(one, axis, metres))


def gained(recording: Recording, plate: int, gain: float) -> Recording:
    """A recording of which one plate shows more force, by this share."""
    return _on_plate(
        recording, plate, lambda one: _wrench(one, lambda f, m: (f * (1 + gain), m * (1 + gain)))
    )


def _walks(change: Callable[[Recording], Recording]) -> _Planted:
    return lambda session: replace(session, walking=tuple(change(r) for r in session.walking))


def _all(change: Callable[[Recording], Recording]) -> _Planted:
    return lambda session: replace(
        session,
        standing=change(session.standing),
        walking=tuple(change(r) for r in session.walking),
    )


def _on_plate(recording: Recording, number: int, change: Callable[[Plate], Plate]) -> Recording:
    return replace(
        recording,
        plates=tuple(
            change(plate) if i == number else plate for i, plate in enumerate(recording.plates)
        ),
    )


def _on_all(recording: Recording, change: Callable[[Plate], Plate]) -> Recording:
    return replace(recording, plates=tuple(map(change, recording.plates)))


def _wrench(plate: Plate, change: Callable[[Array, Array], tuple[Array, Array]]) -> Plate:
    """A plate whose force and moment about the origin are changed."""
    moment = plate.moment
    point = plate.centre_of_pressure
    if moment is None:
        moment = np.cross(np.nan_to_num(point), plate.force) + plate.free_moment
    force, moment = change(plate.force, moment)
    height = np.nanmedian(point[:, 2]) if np.isfinite(point).any() else 0.0
    loaded = np.isfinite(point[:, 2])
    vertical = np.where(loaded & (np.abs(force[:, 2]) > 5.0), force[:, 2], np.nan)
    pressure = np.stack(
        [
            (height * force[:, 0] - moment[:, 1]) / vertical,
            (height * force[:, 1] + moment[:, 0]) / vertical,
            np.where(np.isfinite(vertical), height, np.nan),
        ],
        axis=1,
    )
    free = np.zeros_like(force)
    free[:, 2] = np.where(
        np.isfinite(vertical), moment[:, 2] - np.cross(np.nan_to_num(pressure), force)[:, 2], 0.0
    )
    return replace(
        plate,
        force=force,
        centre_of_pressure=pressure,
        free_moment=free,
        moment=None if plate.moment is None else moment,
    )


def _delayed(recording: Recording, seconds: float) -> Recording:
    def late(values: Array) -> Array:
        at = np.arange(len(values)) - seconds * recording.force_rate
        return np.column_stack(
            [np.interp(at, np.arange(len(values)), values[:, i]) for i in range(values.shape[1])]
        )

    def change(plate: Plate) -> Plate:
        if plate.moment is not None:
            return _wrench(plate, lambda f, m: (late(f), late(m)))
        # without moments the centre of pressure moves on with the force
        shift = round(seconds * recording.force_rate)
        rows = np.clip(np.arange(len(plate.force)) - shift, 0, len(plate.force) - 1)
        return replace(
            plate,
            force=plate.force[rows],
            centre_of_pressure=plate.centre_of_pressure[rows],
            free_moment=plate.free_moment[rows],
        )

    return _on_all(recording, change)


def _middle(plate: Plate) -> Array:
    if np.isfinite(plate.corners).all():
        return np.asarray(plate.corners.mean(axis=0))
    return np.asarray(np.nanmean(plate.centre_of_pressure, axis=0))


def _rotated(plate: Plate, angle: float) -> Plate:
    return _turned_about(plate, angle, _middle(plate))


def _turned_about(plate: Plate, angle: float, middle: Array) -> Plate:
    turn = Rotation.from_rotvec([0, 0, angle]).as_matrix()

    def change(f: Array, m: Array) -> tuple[Array, Array]:
        turned = f @ turn.T
        return turned, (m - np.cross(middle, f)) @ turn.T + np.cross(middle, turned)

    return _wrench(plate, change)


def _turned_about_origin(recording: Recording, angle: float) -> Recording:
    """All plates turned about the middle of them all, as one block."""
    if not recording.plates:
        return recording
    middle = np.mean([_middle(plate) for plate in recording.plates], axis=0)
    return _on_all(recording, lambda plate: _turned_about(plate, angle, middle))


def _moved(plate: Plate, axis: int, metres: float) -> Plate:
    by = metres * np.eye(3)[axis]
    moved = _wrench(plate, lambda f, m: (f, m + np.cross(by, f)))
    return replace(moved, corners=moved.corners + by)


def _crossed(plate: Plate, axis: int, share: float) -> Plate:
    middle, along = _middle(plate), np.eye(3)[axis]

    def change(f: Array, m: Array) -> tuple[Array, Array]:
        more = share * f[:, 2:] * along
        return f + more, m + np.cross(middle, more)

    return _wrench(plate, change)


def _filtered(recording: Recording, hertz: float) -> Recording:
    def slow(values: Array) -> Array:
        return low_pass(values, rate=recording.force_rate, cutoff_hz=hertz)

    return _on_all(recording, lambda one: _wrench(one, lambda f, m: (slow(f), slow(m))))
