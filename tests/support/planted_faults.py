"""Faults planted in what a session has read: forces that are late, plates that are moved.

Each takes the trials in the project's axes, standing trial and walks, and gives them back as a
session with that fault would have recorded them: a plate's fault is there in standing as well. What
is planted in the forces acts on whatever the file gives: force with moment, or force with centre of
pressure.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from scipy.signal import butter, sosfilt
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array
from gaitval.gait.filters import low_pass
from gaitval.mocap.recording import Plate, Recording
from gaitval.session.read import SessionRecordings

_Planted = Callable[[SessionRecordings], SessionRecordings]


@dataclass(frozen=True)
class Fault:
    """A planted fault.

    Attributes
    ----------
    name : what is done.
    causes : names of the right cause, as the warnings call it.
    change : what it does to a session.
    mass : factor of the mass that is given with it.
    size : of the parameter, in the units of `gaitval.measurement.expected.USUAL`.
    plate : number of the plate; None of all.
    """

    name: str
    causes: tuple[str, ...]
    change: _Planted
    mass: float = 1.0
    size: float = 0.0
    plate: int | None = None


def unchanged(session: SessionRecordings) -> SessionRecordings:
    """The session as it was."""
    return session


@dataclass(frozen=True)
class Sizes:
    """What is planted: of a plate, (size, plate) or (size, axis, plate), plate 0 the first and -1
    the last; of all plates and of the laboratory, (size, axis).
    """

    delays_ms: Sequence[float] = (-50, -30, 20, 25, 35, 50)
    masses: Sequence[float] = (0.90, 0.92, 1.08, 1.10)
    rotations: Sequence[tuple[float, int]] = ((5, 0), (-6, -1), (8, 0))
    gains: Sequence[tuple[float, int]] = ((0.10, 0), (-0.10, -1), (0.08, -1))
    places_mm: Sequence[tuple[float, int, int]] = (
        (25, 0, 0),
        (-30, 0, -1),
        (25, 1, -1),
        (-25, 1, 0),
        (40, 0, 0),
    )
    crossed: Sequence[tuple[float, int, int]] = (
        (0.05, 0, 0),
        (-0.05, 0, -1),
        (0.05, 1, -1),
        (-0.06, 1, 0),
    )
    places_of_all_mm: Sequence[tuple[float, int]] = ((30, 0), (-30, 0), (25, 1))
    turns_of_all: Sequence[float] = (4, -5)
    slow_forces_hz: Sequence[float] = (4, 5)
    causal_hz: float = 8
    slow_markers_hz: float = 3.0
    wands: Sequence[float] = (1.02, 0.975)
    rates: Sequence[float] = (1.10, 0.90, 1.06)
    tilts: Sequence[tuple[float, int]] = ((2, 1), (-2, 0), (2.5, 0))


def faults(plates: Sequence[str], sizes: Sizes = Sizes()) -> tuple[Fault, ...]:
    """The list, for a session whose `plates` have these names. All plates of one are that one."""
    every = "all" if len(plates) > 1 else plates[0]
    return (
        *(
            Fault(
                f"forces {abs(ms):g} ms {'late' if ms > 0 else 'early'}",
                ("delay",),
                _walks(partial(_delayed, seconds=ms / 1000)),
                size=ms / 1000,
            )
            for ms in sizes.delays_ms
        ),
        *(
            Fault(f"mass {100 * (f - 1):+.0f} %", ("mass",), unchanged, mass=f, size=f - 1)
            for f in sizes.masses
        ),
        *_of_a_plate(plates, sizes),
        *_of_all_plates(every, sizes),
        *_of_filters(sizes),
        *_of_laboratory(sizes),
    )


def _of_a_plate(plates: Sequence[str], sizes: Sizes) -> Iterator[Fault]:
    """One plate that is turned, scaled, moved, or shows vertical forces along an axis."""

    def fault(
        place: int, words: str, kind: str, size: float, change: Callable[..., Recording]
    ) -> Fault:
        number = place % len(plates)
        name = plates[number]
        everywhere = _all(partial(change, plate=number))
        return Fault(
            f"plate {name} {words}", (f"{kind} {name}",), everywhere, size=size, plate=number
        )

    for degrees, p in sizes.rotations:
        angle = float(np.radians(degrees))
        yield fault(p, f"rotated {degrees:g}°", "rotation", angle, partial(rotated, angle=angle))
    for gain, p in sizes.gains:
        yield fault(p, f"gain {100 * gain:+.0f} %", "gain", gain, partial(gained, gain=gain))
    for mm, axis, p in sizes.places_mm:
        words = f"{mm:g} mm {'forward' if axis == 0 else 'left'}"
        change = partial(moved, axis=axis, metres=mm / 1000)
        yield fault(p, words, "place", mm / 1000, change)
    for share, axis, p in sizes.crossed:
        words = f"cross-talk {100 * share:+.0f} % {'fore-aft' if axis == 0 else 'sideways'}"
        yield fault(p, words, "cross-talk", share, partial(crossed, axis=axis, share=share))


def _of_all_plates(every: str, sizes: Sizes) -> Iterator[Fault]:
    """All plates moved or turned together, beside the cameras; `every` is what they are called."""
    for mm, axis in sizes.places_of_all_mm:
        metres = mm / 1000
        yield Fault(
            f"all plates {mm:g} mm {'forward' if axis == 0 else 'left'}",
            (f"place {every}",),
            _all(partial(_on_all, change=partial(_moved, axis=axis, metres=metres))),
            size=metres,
        )
    for degrees in sizes.turns_of_all:
        angle = float(np.radians(degrees))
        yield Fault(
            f"all plates rotated {degrees:g}° beside the cameras",
            (f"rotation {every}",),
            _all(partial(_turned_about_origin, angle=angle)),
            size=angle,
        )


def _of_filters(sizes: Sizes) -> Iterator[Fault]:
    """Forces or markers that were low-passed before they were stored."""
    for hertz in sizes.slow_forces_hz:
        yield Fault(
            f"forces low-passed at {hertz:g} Hz",
            ("forces low-passed",),
            _walks(partial(_filtered, hertz=hertz)),
            size=hertz,
        )
    yield Fault(
        f"forces low-passed at {sizes.causal_hz:g} Hz, forwards only",
        ("delay", "forces low-passed"),
        _walks(partial(_filtered, hertz=sizes.causal_hz, causal=True)),
        size=sizes.causal_hz,
    )
    slow = sizes.slow_markers_hz
    yield Fault(
        f"markers low-passed at {slow:g} Hz",
        ("markers low-passed",),
        _walks(lambda r: replace(r, markers=_slow(r.markers, r.marker_rate, slow))),
        size=slow,
    )


def _of_laboratory(sizes: Sizes) -> Iterator[Fault]:
    """A wrong wand, a wrong clock, and a vertical that is not."""

    def longer(recording: Recording, factor: float) -> Recording:
        return replace(recording, markers=recording.markers * factor)

    def faster(recording: Recording, factor: float) -> Recording:
        rates = recording.marker_rate * factor, recording.force_rate * factor
        return replace(recording, marker_rate=rates[0], force_rate=rates[1])

    for factor in sizes.wands:
        name = f"wand {100 * (factor - 1):+.1f} %"
        yield Fault(name, ("scale",), _all(partial(longer, factor=factor)), size=factor - 1)
    for factor in sizes.rates:
        name = f"rate of both {100 * (factor - 1):+.0f} %"
        yield Fault(name, ("rate",), _walks(partial(faster, factor=factor)), size=factor - 1)
    for degrees, axis in sizes.tilts:
        angle = float(np.radians(degrees))
        turn = Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix()
        name = f"laboratory tilted {degrees:g}° about {'xy'[axis]}"
        yield Fault(name, ("tilt",), _all(partial(_turned, turn=turn)), size=angle)


def _turned(recording: Recording, turn: Array) -> Recording:
    return recording.turned(turn)


def moved(recording: Recording, plate: int, axis: int, metres: float) -> Recording:
    """A recording with one plate (its number) moved along an axis."""
    return _on_plate(recording, plate, lambda one: _moved(one, axis, metres))


def crossed(recording: Recording, plate: int, axis: int, share: float) -> Recording:
    """A recording of which one plate shows a share of the vertical force along an axis, too."""
    return _on_plate(recording, plate, lambda one: _crossed(one, axis, share))


def gained(recording: Recording, plate: int, gain: float) -> Recording:
    """A recording of which one plate shows more force, by this share."""
    return _on_plate(
        recording, plate, lambda one: _wrench(one, lambda f, m: (f * (1 + gain), m * (1 + gain)))
    )


def rotated(recording: Recording, plate: int, angle: float) -> Recording:
    """A recording of which one plate is turned, rad."""
    return _on_plate(recording, plate, lambda one: _rotated(one, angle))


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


def _slow(values: Array, rate: float, hertz: float) -> Array:
    return low_pass(values, rate=rate, cutoff_hz=hertz)


def _filtered(recording: Recording, hertz: float, *, causal: bool = False) -> Recording:
    rate = recording.force_rate

    def slow(values: Array) -> Array:
        if causal:
            return np.asarray(sosfilt(butter(2, hertz, fs=rate, output="sos"), values, axis=0))
        return _slow(values, rate, hertz)

    def change(plate: Plate) -> Plate:
        found = _wrench(plate, lambda f, m: (slow(f), slow(m)))
        if plate.moment is not None:
            return found
        # a file with centres of pressure only is made of filtered channels with a threshold
        moment = slow(
            np.cross(np.nan_to_num(plate.centre_of_pressure), plate.force) + plate.free_moment
        )
        force = slow(plate.force)
        on = force[:, 2] > 10.0
        height = np.nanmedian(plate.centre_of_pressure[:, 2])
        vertical = np.where(on, force[:, 2], np.nan)
        pressure = np.stack(
            [
                (height * force[:, 0] - moment[:, 1]) / vertical,
                (height * force[:, 1] + moment[:, 0]) / vertical,
                np.where(on, height, np.nan),
            ],
            axis=1,
        )
        free = np.zeros_like(force)
        free[:, 2] = np.where(
            on, moment[:, 2] - np.cross(np.nan_to_num(pressure), force)[:, 2], 0.0
        )
        return replace(
            plate,
            force=np.where(on[:, None], force, 0.0),
            centre_of_pressure=pressure,
            free_moment=free,
        )

    return _on_all(recording, change)


SIZES: Final = {"angle": 2.0, "moment": 0.1, "force": 3.0, "speed": 2.0}
"""Errors from which on a fault counts: degrees, Nm/kg, % of the body's weight, %."""
