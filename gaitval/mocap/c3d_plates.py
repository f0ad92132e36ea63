"""Force plates of a C3D file, of types 1 to 7."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.arrays import Array, runs
from gaitval.errors import RecordError
from gaitval.mocap.c3d_contents import Contents, labels_of, length_unit
from gaitval.mocap.force_plates import (
    CALIBRATIONS,
    CHANNELS,
    UNLOADED_N,
    certain_load,
    make_plate,
    plate_axes,
    plate_or_fault,
    plate_wrench,
)
from gaitval.mocap.recording import Plate
from gaitval.mocap.repairs import passed_over
from gaitval.units import FORCE, LENGTH, MOMENT, stated_factor

OF_KISTLER: Final = (3, 7)
"""Types of plates with eight sensors, of which Kistler corrects the centre of pressure."""
LIMITS: Final[Mapping[str, float]] = {
    # s. A force changes little in that time: a plate is low-passed at 20 Hz.
    "longest_missing": 0.02,
    # An unloaded plate's offset is below this, N. More in the frames of FORCE_PLATFORM:ZERO
    # is a person: many programs write the default frames 1 to 10 even if someone is standing
    # there.
    "largest_zero_n": 50.0,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""


def read_plates(
    path: Path, contents: Contents, markers: Array, marker_rate: float
) -> tuple[tuple[Plate, ...], float]:
    """The plates in the `contents` of a file `path` that have channels, in the laboratory's axes,
    and their sample rate, Hz; 0 Hz without plates. `markers` (T, M, 3) m of the same file at
    `marker_rate` Hz, laboratory axes, show which side of a plate is up. Raises RecordError as
    `read_c3d`, for plates.
    """
    used = int(contents.number("FORCE_PLATFORM", "USED"))
    rate = contents.number("ANALOG", "RATE")
    if used < 1 or not contents.analogs.size:
        return (), 0.0
    # The data decide how many samples a frame has; the declared rates must agree with them.
    per_frame = round(len(contents.analogs) / len(markers))
    if per_frame < 1 or abs(rate - per_frame * marker_rate) > 1e-3 * rate:
        raise RecordError(
            f"{path}: forces are at {rate:g} Hz (ANALOG:RATE) and markers at {marker_rate:g} Hz, "
            f"but there are {len(contents.analogs)} force samples for {len(markers)} frames. The "
            "rate of the forces must be a whole multiple of the markers'; export the trial again."
        )
    plates = []
    for index in range(used):
        make = partial(_plate, path, contents, index, markers, per_frame)
        plate = plate_or_fault(str(index + 1), len(contents.analogs), make)
        if plate is not None:
            plates.append(plate)
    return tuple(plates), per_frame * marker_rate if plates else 0.0


def _plate(
    path: Path, contents: Contents, index: int, markers: Array, per_frame: int
) -> Plate | None:
    """Plate number `index`; None without data."""
    where = f"{path}: force plate {index + 1}"
    kind, numbers = _channel_numbers(where, contents, index)
    if not numbers:
        return None
    metres = length_unit(path, contents)
    corners = _corners(where, contents, index, metres)
    centre = corners.mean(axis=0)
    # The person is above the plate, whichever way the plate's own z points.
    person = np.nanmedian(markers.reshape(-1, 3), axis=0) - centre
    side = np.sign(plate_axes(corners)[:, 2] @ person)
    origin = _origin(where, contents, index, kind, metres)
    # The surface is above the sensors; many files have the opposite vector, or the depth.
    if origin[2] * (1.0 if side > 0 else -1.0) < 0:
        origin = -origin
    calibration = None
    if kind in CALIBRATIONS:
        from gaitval.mocap.plate_sensors import stored_calibration

        calibration = stored_calibration(where, contents, kind, index, CALIBRATIONS[kind])
    channels = _numbers_only(where, contents, kind, numbers, per_frame)
    if channels is None:
        return None
    if calibration is None:
        channels = channels * _channel_units(path, where, contents, kind, numbers, metres, channels)
    # A matrix gives newtons, and newtons times POINT:UNITS; ANALOG:UNITS does not apply.
    unit = 1.0 if calibration is None else metres
    force, moment = plate_wrench(kind, channels, origin / unit, calibration)
    moment = moment * unit
    first, last = _zero_samples(contents, per_frame, len(force))
    if last > first and abs(force[first:last, 2].mean()) < LIMITS["largest_zero_n"]:
        force = force - force[first:last].mean(axis=0)
        moment = moment - moment[first:last].mean(axis=0)
    normal = force[:, 2] * side
    # The plate seems to pull: the file has the force on the plate, not on the person.
    if normal[certain_load(np.abs(normal))].sum() < 0:
        force, moment = -force, -moment
    if kind in OF_KISTLER:
        moment = _corrected(contents, index, force, moment, metres)
    plate = make_plate(str(index + 1), corners, force, moment)
    # Without the way to the origin, with which a moment that is too small puts the force elsewhere.
    sensed = plate_wrench(kind, channels, np.zeros(3), calibration)
    _check_moments(where, kind, plate, centre, sensed[1] * unit)
    return plate


def _channel_numbers(where: str, contents: Contents, index: int) -> tuple[int, list[int]]:
    """A plate's type and its channels, counted from 1; none if it was not recorded."""
    types = contents.of_plate("TYPE", index)
    kind = 0 if types is None else int(types)
    if kind not in CHANNELS:
        raise RecordError(
            f"{where} is of type {kind or 'unknown'}, but only types 1 to 7 can be read. "
            "Export the trial with forces and moments (type 2) instead."
        )
    listed = contents.of_plate("CHANNEL", index, CHANNELS[kind])
    numbers = [] if listed is None else [int(n) for n in listed]
    # All channels are 0: the plate is declared but was not recorded.
    if numbers and not any(numbers):
        return kind, []
    if not numbers or not all(1 <= n <= contents.analogs.shape[1] for n in numbers):
        raise RecordError(
            f"{where} (type {kind}) needs {CHANNELS[kind]} of the {contents.analogs.shape[1]} "
            f"analog channels, but FORCE_PLATFORM:CHANNEL names {numbers}. Export it again."
        )
    return kind, numbers


def _corners(where: str, contents: Contents, index: int, metres: float) -> Array:
    """Corners (4, 3) m of a plate, of a file whose lengths are in `metres`."""
    stored = contents.of_plate("CORNERS", index, 3, 4)
    # The file has a column for each corner.
    corners = np.zeros((4, 3)) if stored is None else stored.T * metres
    if not _span(corners):
        seen = "are missing" if stored is None else f"are {np.round(corners, 3).tolist()} m"
        raise RecordError(
            f"{where}: its corners (FORCE_PLATFORM:CORNERS) {seen}; they do not span a plate, so "
            "the plate's position is unknown. Enter them in the recording program and export "
            "again."
        )
    return corners


def _origin(where: str, contents: Contents, index: int, kind: int, metres: float) -> Array:
    """The stored origin (3,) m of a plate's sensors, either way; zero if it needs none."""
    stored = contents.of_plate("ORIGIN", index, 3)
    # Type 1 measures its centre of pressure itself, so it needs no origin.
    if stored is None and kind != 1:
        raise RecordError(
            f"{where}: FORCE_PLATFORM:ORIGIN is missing, so the moments have no point of "
            "reference. Enter it in the recording program and export again."
        )
    return np.zeros(3) if stored is None else stored * metres


def _numbers_only(
    where: str, contents: Contents, kind: int, numbers: Sequence[int], per_frame: int
) -> Array | None:
    """The channels (T, C), in which short gaps are filled; None if they have a long one."""
    channels = contents.analogs[:, [n - 1 for n in numbers]]
    if kind == 1:
        # Its programs divide by the force, and have no centre of pressure without one.
        idle = np.abs(channels[:, 2:3]) < UNLOADED_N
        channels[:, 3:] = np.where(idle & np.isnan(channels[:, 3:]), 0.0, channels[:, 3:])
    if np.isfinite(channels).all():
        return channels
    missing = np.asarray(~np.isfinite(channels).all(axis=1))
    longest = max(end - begin for begin, end in zip(*runs(missing), strict=True))
    short = longest <= LIMITS["longest_missing"] * per_frame * contents.number("POINT", "RATE")
    passed_over(
        f"{where}: {np.count_nonzero(~np.isfinite(channels))} values in its channels are not "
        f"numbers; {'they are put between those around them' if short else 'it is left out'}. "
        "Export the trial again"
    )
    if not short:
        return None
    there = np.flatnonzero(~missing)
    for column in channels.T:
        column[:] = np.interp(np.arange(len(column)), there, column[there])
    return channels


def _corrected(contents: Contents, index: int, force: Array, moment: Array, metres: float) -> Array:
    """The `moment` (T, 3) Nm about the middle of the surface, with which the centre of pressure is
    where Kistler's polynomial puts it (FORCE_PLATFORM:FPCOPPOLY, in the file's unit of length of so
    many `metres`): its top plate bends. `force` (T, 3) is in N; both are in the plate's axes.

    x is smaller by (c1 y⁴ + c2 y² + c3) x³ + (c4 y⁴ + c5 y² + c6) x, and y likewise by the second
    six (Kistler; ezc3d, issue 253). The moment about the vertical is measured, and stays.
    """
    polynomial = contents.of_plate("FPCOPPOLY", index, 6, 2)
    if polynomial is None or not np.any(polynomial):
        return moment
    loaded = np.abs(force[:, 2]) >= UNLOADED_N
    vertical = np.where(loaded, force[:, 2], np.inf)
    x, y = -moment[:, 1] / vertical / metres, moment[:, 0] / vertical / metres

    def less(coefficients: Array, along: Array, across: Array) -> Array:
        powers = np.stack([across**4, across**2, np.ones_like(across)])
        third, first = coefficients.reshape(2, 3) @ powers
        return np.asarray(metres * (third * along**3 + first * along))

    by_x, by_y = less(polynomial[:, 0], x, y), less(polynomial[:, 1], y, x)
    lifted = np.where(loaded, force[:, 2], 0.0)
    change = np.column_stack([-by_y * lifted, by_x * lifted, np.zeros_like(lifted)])
    return np.asarray(moment + change)


def _span(corners: Array) -> bool:
    """Whether corners (4, 3) m span a surface of more than a square centimetre."""
    area = np.cross(corners[0] - corners[1], corners[0] - corners[3])
    return bool(np.isfinite(corners).all() and np.linalg.norm(area) > 1e-4)


def _channel_units(
    path: Path,
    where: str,
    contents: Contents,
    kind: int,
    numbers: Sequence[int],
    metres: float,
    channels: Array,
) -> Array:
    """Factors to N, Nm and m of the channels of a plate of type 1, 2 or 3."""
    units = labels_of(contents, "ANALOG", "UNITS")
    overall = contents.text("FORCE_PLATFORM", "UNITS")
    factors = []
    for place, number in enumerate(numbers):
        unit = units[number - 1] if number <= len(units) else ""
        what = f"{path}: the unit of channel {number} (ANALOG:UNITS)"
        if unit.lower() in ("v", "mv", "volt", "volts"):
            # Programs scale to newtons but leave the label; no converter gives more than 10 V.
            if np.abs(channels[:, :3]).max() <= 10.0:
                raise RecordError(
                    f"{where}: channel {number} is in {unit}, and a plate of type {kind} has no "
                    "calibration to convert it. Export the forces in N."
                )
            unit = ""
        if kind == 3 or place < 3:
            factors.append(stated_factor(what, FORCE, unit or overall or "N"))
        elif kind == 1 and place < 5:
            length = LENGTH.named(unit)
            factors.append(length.factor if length else metres)
        elif unit and unit != "N":
            factors.append(stated_factor(what, MOMENT, unit))
        else:  # BTS writes N for all channels
            factors.append(metres)  # the format's rule: newtons times POINT:UNITS
    return np.array(factors)


def _zero_samples(contents: Contents, per_frame: int, count: int) -> tuple[int, int]:
    """Range of samples that FORCE_PLATFORM:ZERO declares unloaded; empty where it does not."""
    zero = [int(n) for n in contents.get("FORCE_PLATFORM", "ZERO")[:2]]
    if len(zero) < 2 or not 1 <= zero[0] <= zero[1]:
        return 0, 0
    # Frames are counted from 1, and the last one is included.
    first = (zero[0] - 1) * per_frame
    last = zero[1] * per_frame
    return (first, last) if last <= count else (0, 0)


def _check_moments(where: str, kind: int, plate: Plate, centre: Array, sensed: Array) -> None:
    """Refuse forces or moments in the wrong unit: they put the centre of pressure off the plate or
    fix it (`sensed` (T, 3) Nm, about the sensors' origin). A plate of `kind` 1 has the centre of
    pressure itself.
    """
    strong = certain_load(np.linalg.norm(plate.force, axis=1))
    strong &= np.isfinite(plate.centre_of_pressure).all(axis=1)
    if np.count_nonzero(strong) < 10:
        return
    away = np.linalg.norm(plate.centre_of_pressure[strong] - centre, axis=1)
    reach = float(np.linalg.norm(plate.corners - centre, axis=1).max())
    lever = away
    if kind in (2, 4, 5):
        size = np.linalg.norm(plate.force[strong], axis=1)
        lever = np.linalg.norm(sensed[strong, :2], axis=1) / size
    # Nmm read as Nm put the point a thousand times too far away; Nm read as Nmm keep it under the
    # sensors' origin.
    if np.median(away) > 5 * reach or lever.max() < reach / 500:
        why = (
            "channels 4 and 5 are in the wrong unit, or no centres of pressure. Check ANALOG:UNITS "
            "(mm or m), or export the plate with its moments (type 2)."
            if kind == 1
            else "forces or moments are in the wrong unit, or the origin or calibration is wrong. "
            "Check ANALOG:UNITS (N or kN, Nmm or Nm), FORCE_PLATFORM:ORIGIN and CAL_MATRIX."
        )
        load = np.linalg.norm(plate.force[strong], axis=1).max()
        raise RecordError(
            f"{where}: under load (up to {load:,.0f} N) its centre of pressure is "
            f"{np.median(away):.3g} m from the middle of the plate (median), but its corners are "
            f"{reach:.3g} m from it: {why}"
        )
