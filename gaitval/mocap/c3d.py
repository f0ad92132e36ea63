"""Read C3D files: markers, force plates of types 1 to 4, events.

The bytes are read by ezc3d in a process of its own (`c3d_process.py`), for a damaged file can
make it crash, run for ever or ask for all memory: ezc3d 1.7.2 does so with two in a hundred files
of which a byte in the header or the parameters was changed. So run, the worst that a file can do is
a `RecordError`. It costs 0.2 s.
"""

import io
import json
import os
import re
import struct
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import CHANNELS, make_plate, plate_axes, plate_wrench
from gaitval.mocap.recording import Event, EventKind, Plate, Recording

METRES: Final[dict[str, float]] = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
"""Units of length that files name, in metres."""

_NEWTONS: Final[dict[str, float]] = {"n": 1.0, "kn": 1e3}
_NEWTON_METRES: Final[dict[str, float]] = {"nm": 1.0, "ncm": 1e-2, "nmm": 1e-3, "knm": 1e3}

LARGEST_ZERO_N: Final = 50.0
"""An unloaded plate's offset is under this, N. More in the frames of FORCE_PLATFORM:ZERO is a
person: many programs write the default frames 1 to 10 whoever stands there."""

CERTAIN_LOAD_N: Final = 200.0
"""Over this a force is a person's and neither an offset nor noise, N."""

PROCESS = Path(__file__).with_name("c3d_process.py")
"""The script that reads a file."""

SECONDS = 10.0
SECONDS_PER_MEGABYTE: Final = 1.0
"""Longest time to read a file; measured: 0.1 s and 0.08 s for each megabyte."""

_BLOCK: Final = 512

# What a marker list may hold beside markers: results of the laboratory's own software.
_RESULTS: Final = (
    "ANGLES",
    "FORCES",
    "MOMENTS",
    "POWERS",
    "SCALARS",
    "REACTIONS",
    "MODELED_MARKERS",
)

SAME_EVENT_S: Final = 0.2
"""Events of one side and kind that are closer than this are one event, s; half a step in running
takes longer."""

_SIDES: Final[dict[str, Side]] = {"left": "left", "right": "right", "l": "left", "r": "right"}
_STRIKES: Final = (
    *("hs", "fs", "ic", "fc", "on", "heelstrike", "heelcontact", "footstrike", "footcontact"),
    *("footon", "initialcontact"),
)
_OFFS: Final = ("to", "fo", "off", "toeoff", "footoff")


@dataclass(frozen=True)
class _Contents:
    """What ezc3d finds in a file: parameters by group and name, and the data."""

    parameters: Mapping[str, Mapping[str, Mapping[str, list[Any]]]]
    first_frame: int
    points: Array
    residuals: Array
    analogs: Array

    def get(self, group: str, name: str) -> list[Any]:
        """Values of a parameter as a flat list in the file's order; empty where it is missing."""
        return list(self.parameters.get(group, {}).get(name, {}).get("value", []))

    def number(self, group: str, name: str) -> float:
        """First value of a parameter; 0 where it is missing or no number."""
        value = next(iter(self.get(group, name)), 0)
        return float(value) if isinstance(value, int | float) else 0.0

    def text(self, group: str, name: str) -> str:
        """First value of a text parameter; empty where it is missing."""
        return str(next(iter(self.get(group, name)), "")).strip()

    def of_plate(self, name: str, index: int, *shape: int) -> Array | None:
        """A plate's part of an array of FORCE_PLATFORM, cut to this shape; None where it has none.

        Its last axis is the plate. With plates of several types the others are as long as the
        largest type needs.
        """
        stored = self.parameters.get("FORCE_PLATFORM", {}).get(name)
        if stored is None:
            return None
        sizes = [*stored["shape"], 1][: len(shape) + 1]
        if len(sizes) <= len(shape) or sizes[-1] <= index:
            return None
        if any(size < wanted for size, wanted in zip(sizes, shape, strict=False)):
            return None
        try:
            values = np.array(stored["value"], dtype=float).reshape(sizes, order="F")
        except ValueError:
            return None
        part: Array = np.moveaxis(values, -1, 0)[index]
        return part[tuple(slice(wanted) for wanted in shape)]


def read_c3d(path: Path) -> Recording:
    """Read a C3D file.

    Returns
    -------
    Recording
        In the laboratory's axes, SI units. A marker is NaN where its residual is negative or it
        lies exactly at the origin. Points that the file declares to be angles, forces, moments
        or powers and unlabelled ones (`*12`) are left out; a subject's prefix that all names
        share (`Anna:LASI`) is taken off. Forces are of the plate on the person: a file with
        the opposite sign is turned round, for a plate only pushes. Plates without channels
        are left out. Baselines are subtracted as FORCE_PLATFORM:ZERO says, unless the
        plate is loaded then. The polynomial with which Kistler refines the centre of pressure of
        type 3 (FPCOPPOLY) is not applied: a few millimetres near the plate's edge.

    Raises
    ------
    RecordError
        Not a C3D file, truncated or damaged; unit missing or unknown; plates of another type
        or without what their type needs.
    """
    path = Path(path)
    _check_size(path)
    contents = _read(path)
    names, markers = _markers(path, contents)
    rate = contents.number("POINT", "RATE")
    if not 0 < rate < np.inf:
        raise RecordError(
            f"{path}: POINT:RATE is {rate:g}, so the times of the frames are unknown. Write the "
            "rate of the cameras into the file with the program that made it."
        )
    plates, force_rate = _plates(path, contents, markers, rate)
    start = contents.first_frame / rate
    return Recording(
        source=str(path),
        axes="laboratory",
        names=names,
        markers=markers,
        marker_rate=rate,
        start=start,
        plates=plates,
        force_rate=force_rate,
        events=_events(contents, start, len(markers) / rate),
    )


def _check_size(path: Path) -> None:
    """Refuse what is no C3D file, and a file that is shorter than its header says."""
    try:
        with path.open("rb") as file:
            head = file.read(_BLOCK)
            size = file.seek(0, io.SEEK_END)
            if len(head) == _BLOCK:
                file.seek((max(head[0], 1) - 1) * _BLOCK)
                parameters = file.read(4)
    except FileNotFoundError:
        raise RecordError(f"{path}: no such file. Check the name and the folder.") from None
    except OSError as error:
        raise RecordError(f"{path}: cannot be opened ({error.strerror}).") from None
    if not size:
        raise RecordError(f"{path}: the file is empty. Copy or export it again.")
    if len(head) > 1 and head[1] != 0x50:
        raise RecordError(
            f"{path}: not a C3D file (its second byte is {head[1]:#04x}, a C3D file's is 0x50). "
            "Give the .c3d file of the trial, or export it again."
        )
    if len(head) < _BLOCK or len(parameters) < 4:
        raise RecordError(
            f"{path}: truncated: {size} bytes do not even hold the header and the parameters. "
            "Copy or export it again."
        )
    # The processor decides the order of bytes: 84 Intel, 85 DEC (floats of its own), 86 MIPS.
    order = ">" if parameters[3] == 86 else "<"
    points, analogs, first, last = struct.unpack(f"{order}4H", head[2:10])
    data_block, samples = struct.unpack(f"{order}2H", head[16:20])
    (scale,) = struct.unpack(f"{order}f", head[12:16])
    if parameters[3] == 85:  # a DEC float has its sign in byte 1, as the others in byte 3
        scale = -1.0 if head[13] & 0x80 else 1.0
    if last < first:
        return  # more than 65535 frames: the parameters have the count, see `_read`
    word = 4 if scale < 0 else 2
    frames = last - first + 1
    needed = (data_block - 1) * _BLOCK + frames * (4 * points + analogs) * word
    if size < needed:
        raise RecordError(
            f"{path}: truncated: the header promises {frames} frames of {points} markers and "
            f"{analogs} analog values ({samples} for each channel), {needed} bytes, but the file "
            f"has {size}. Copy or export it again."
        )


def _damaged(path: Path, why: str) -> RecordError:
    return RecordError(
        f"{path}: not readable as C3D ({why}): it is damaged or breaks the format. Copy it "
        "again, or open it in the program that recorded it and save it anew."
    )


def _read(path: Path) -> _Contents:
    """Contents of a file, read in another process; see the module."""
    # -P: a json.py in the folder of the data must not take the place of Python's.
    command = [sys.executable, "-P", str(PROCESS), str(path.resolve())]
    # Each thread of OpenBLAS would count against the memory that the process may have.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    limit = SECONDS + SECONDS_PER_MEGABYTE * path.stat().st_size / 1e6
    try:
        done = subprocess.run(
            command, capture_output=True, timeout=limit, check=False, env=environment
        )
    except subprocess.TimeoutExpired:
        raise _damaged(path, f"reading did not end in {limit:.0f} s") from None
    if done.returncode:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        known = done.returncode > 0 and lines and lines[-1].startswith("c3d: ")
        # ezc3d goes on to say how to switch its check off, which helps no user of ours.
        why = lines[-1][5:].partition(". If you want")[0] if known else "reading it ends in a crash"
        raise _damaged(path, why)
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as stored:
        described = json.loads(str(stored["described"]))
        contents = _Contents(
            parameters=described["parameters"],
            first_frame=described["first_frame"],
            points=stored["points"],
            residuals=stored["residuals"],
            analogs=stored["analogs"],
        )
    promised = described["last_frame"] - described["first_frame"] + 1
    if len(contents.points) < promised:
        raise RecordError(
            f"{path}: truncated: {promised} frames are promised, {len(contents.points)} are there. "
            "Copy or export it again."
        )
    return contents


def _unit(path: Path, text: str, units: Mapping[str, float], what: str) -> float:
    """Factor to SI of a unit as a file writes it."""
    plain = re.sub(r"[\s.*·]", "", text).lower()
    if plain not in units:
        seen = f"is {text.strip()!r}, which is not known" if plain else "is missing"
        raise RecordError(
            f"{path}: {what} {seen}, so the numbers have no meaning. Known are "
            f"{', '.join(units)}: write the right one into the file with the program that made it."
        )
    return units[plain]


def _labels(contents: _Contents, group: str, name: str) -> list[str]:
    """Values of a text parameter that goes on in NAME2, NAME3 after 255 entries."""
    found = [str(text).strip() for text in contents.get(group, name)]
    for number in range(2, 100):
        more = contents.get(group, f"{name}{number}")
        if not more:
            break
        found += [str(text).strip() for text in more]
    return found


def _markers(path: Path, contents: _Contents) -> tuple[tuple[str, ...], Array]:
    """Names and trajectories (T, M, 3) m of the markers."""
    labels = _labels(contents, "POINT", "LABELS")
    count = contents.points.shape[1]
    if not count or not len(contents.points):
        raise RecordError(
            f"{path}: no markers in the file ({len(contents.points)} frames, {count} points). "
            "Export the trial with its labelled markers."
        )
    if len(labels) < count:
        raise RecordError(
            f"{path}: {count} points but {len(labels)} names (POINT:LABELS). Label the markers "
            "in the program that recorded them and export again."
        )
    metres = _unit(path, contents.text("POINT", "UNITS"), METRES, "POINT:UNITS")
    results = {name for group in _RESULTS for name in _labels(contents, "POINT", group)}
    kept = [
        i
        for i, label in enumerate(labels[:count])
        if label and not label.startswith("*") and label not in results
    ]
    if not kept:
        raise RecordError(
            f"{path}: none of the {count} points is a labelled marker. Label the markers in the "
            "program that recorded them and export again."
        )
    points = contents.points[:, kept]
    hidden = (contents.residuals[:, kept] < 0) | (points == 0).all(axis=2)
    markers = np.where(hidden[:, :, None], np.nan, points) * metres
    names = [labels[i] for i in kept]
    prefixes = {name.partition(":")[0] for name in names if ":" in name}
    if len(prefixes) == 1 and all(":" in name for name in names):
        names = [name.partition(":")[2] for name in names]
    return tuple(names), markers


def _plates(
    path: Path, contents: _Contents, markers: Array, marker_rate: float
) -> tuple[tuple[Plate, ...], float]:
    used = int(contents.number("FORCE_PLATFORM", "USED"))
    rate = contents.number("ANALOG", "RATE")
    if used < 1 or not contents.analogs.size:
        return (), 0.0
    per_frame = round(len(contents.analogs) / len(markers))
    if per_frame < 1 or abs(rate - per_frame * marker_rate) > 1e-3 * rate:
        raise RecordError(
            f"{path}: forces at {rate:g} Hz (ANALOG:RATE) and markers at {marker_rate:g} Hz, but "
            f"{len(contents.analogs)} force samples on {len(markers)} frames. The rate of the "
            "forces must be a whole multiple of the markers'; export the trial again."
        )
    plates = []
    for index in range(used):
        plate = _plate(path, contents, index, markers, per_frame)
        if plate is not None:
            plates.append(plate)
    return tuple(plates), per_frame * marker_rate if plates else 0.0


def _plate(
    path: Path, contents: _Contents, index: int, markers: Array, per_frame: int
) -> Plate | None:
    """Plate number `index`; None where the file reserves one but has no data of it."""
    where = f"{path}: force plate {index + 1}"
    types = contents.of_plate("TYPE", index)
    kind = 0 if types is None else int(types)
    if kind not in CHANNELS:
        raise RecordError(
            f"{where} is of type {kind or 'unknown'}; types 1 to 4 are read. Export the trial "
            "with forces and moments (type 2) instead."
        )
    listed = contents.of_plate("CHANNEL", index, CHANNELS[kind])
    numbers = [] if listed is None else [int(n) for n in listed]
    if numbers and not any(numbers):
        return None
    if not numbers or not all(1 <= n <= contents.analogs.shape[1] for n in numbers):
        raise RecordError(
            f"{where} (type {kind}) needs {CHANNELS[kind]} of the {contents.analogs.shape[1]} "
            f"analog channels, but FORCE_PLATFORM:CHANNEL names {numbers}. Export it again."
        )
    metres = _unit(path, contents.text("POINT", "UNITS"), METRES, "POINT:UNITS")
    stored = contents.of_plate("CORNERS", index, 3, 4)
    corners = np.zeros((4, 3)) if stored is None else stored.T * metres
    if not _span(corners):
        seen = "are missing" if stored is None else f"are {np.round(corners, 3).tolist()} m"
        raise RecordError(
            f"{where}: its corners (FORCE_PLATFORM:CORNERS) {seen}; they do not span a plate, so "
            "the place of the force is unknown. Enter them in the recording program; export again."
        )
    to_origin = contents.of_plate("ORIGIN", index, 3)
    if to_origin is None and kind != 1:
        raise RecordError(
            f"{where}: FORCE_PLATFORM:ORIGIN is missing, so the moments have no point of "
            "reference. Enter it in the recording program and export again."
        )
    origin = np.zeros(3) if to_origin is None else to_origin * metres
    calibration = None
    if kind == 4:
        calibration = contents.of_plate("CAL_MATRIX", index, 6, 6)
        if calibration is None or not np.any(calibration):
            raise RecordError(
                f"{where} is of type 4, but FORCE_PLATFORM:CAL_MATRIX has no calibration of it. "
                "Enter it in the recording program and export again."
            )
        if contents.text("FORCE_PLATFORM", "MATRIX_STORE").upper() == "BYROW":
            calibration = calibration.T
    channels = contents.analogs[:, [n - 1 for n in numbers]]
    if not np.isfinite(channels).all():
        raise RecordError(
            f"{where}: {np.count_nonzero(~np.isfinite(channels))} values of its channels are not "
            "numbers. Export the trial again."
        )
    if kind == 4:
        # The matrix gives newtons and newtons times POINT:UNITS; ANALOG:UNITS is of no use.
        force, moment = plate_wrench(4, channels, origin / metres, calibration)
        moment = moment * metres
    else:
        channels = channels * _channel_units(path, where, contents, kind, numbers, metres, channels)
        force, moment = plate_wrench(kind, channels, origin)
    first, last = _zero_samples(contents, index, per_frame, len(force))
    if last > first and abs(force[first:last, 2].mean()) < LARGEST_ZERO_N:
        force = force - force[first:last].mean(axis=0)
        moment = moment - moment[first:last].mean(axis=0)
    centre = corners.mean(axis=0)
    person = np.nanmedian(markers.reshape(-1, 3), axis=0) - centre
    normal = force[:, 2] * np.sign(plate_axes(corners)[:, 2] @ person)
    if normal[np.abs(normal) > CERTAIN_LOAD_N].sum() < 0:
        force, moment = -force, -moment
    plate = make_plate(str(index + 1), corners, force, moment)
    _check_moments(where, plate, centre)
    return plate


def _span(corners: Array) -> bool:
    """Whether corners (4, 3) m span a surface of more than a square centimetre."""
    area = np.cross(corners[0] - corners[1], corners[0] - corners[3])
    return bool(np.isfinite(corners).all() and np.linalg.norm(area) > 1e-4)


def _channel_units(
    path: Path,
    where: str,
    contents: _Contents,
    kind: int,
    numbers: Sequence[int],
    metres: float,
    channels: Array,
) -> Array:
    """Factors to N, Nm and m of the channels of a plate of type 1, 2 or 3."""
    units = _labels(contents, "ANALOG", "UNITS")
    overall = contents.text("FORCE_PLATFORM", "UNITS")
    factors = []
    for place, number in enumerate(numbers):
        unit = units[number - 1] if number <= len(units) else ""
        if unit.lower() in ("v", "mv", "volt", "volts"):
            # Programs scale to newtons and leave the label; no converter gives more than 10 V.
            if np.abs(channels[:, :3]).max() <= 10.0:
                raise RecordError(
                    f"{where}: channel {number} is in {unit} and a plate of type {kind} has no "
                    "calibration. Export the forces in N."
                )
            unit = ""
        if kind == 3 or place < 3:
            what = f"the unit of channel {number} (ANALOG:UNITS)"
            factors.append(_unit(path, unit or overall or "N", _NEWTONS, what))
        elif kind == 1 and place < 5:
            factors.append(METRES.get(unit.lower(), metres))
        elif unit:
            what = f"the unit of channel {number} (ANALOG:UNITS)"
            factors.append(_unit(path, unit, _NEWTON_METRES, what))
        else:
            factors.append(metres)  # the format's rule: newtons times POINT:UNITS
    return np.array(factors)


def _zero_samples(contents: _Contents, index: int, per_frame: int, count: int) -> tuple[int, int]:
    """Range of samples that FORCE_PLATFORM:ZERO declares unloaded; empty where it does not."""
    zero = [int(n) for n in contents.get("FORCE_PLATFORM", "ZERO")[:2]]
    if len(zero) < 2 or not 1 <= zero[0] <= zero[1]:
        return 0, 0
    first = (zero[0] - 1) * per_frame
    last = zero[1] * per_frame
    return (first, last) if last <= count else (0, 0)


def _check_moments(where: str, plate: Plate, centre: Array) -> None:
    """Refuse moments in the wrong unit: the centre of pressure leaves the plate or never moves."""
    strong = np.linalg.norm(plate.force, axis=1) > CERTAIN_LOAD_N
    if np.count_nonzero(strong) < 10:
        return
    away = np.linalg.norm(plate.centre_of_pressure[strong] - centre, axis=1)
    reach = float(np.linalg.norm(plate.corners - centre, axis=1).max())
    if np.median(away) > 5 * reach or away.max() < reach / 500:
        raise RecordError(
            f"{where}: under load its centre of pressure is {np.median(away):.3g} m from the "
            f"middle of the plate (median), whose corners are at {reach:.3g} m: the moments are in "
            "the wrong unit or the origin or calibration is wrong. Check ANALOG:UNITS (Nmm or "
            "Nm), FORCE_PLATFORM:ORIGIN and CAL_MATRIX."
        )


def _event(label: str, context: str) -> tuple[Side, EventKind, bool] | None:
    """Side and kind of an event, and whether it is a plate's contact; None for other events."""
    plain = re.sub(r"[^a-z]", "", label.lower())
    named = context.strip().lower()[:1]
    side: Side | None = "left" if named == "l" else "right" if named == "r" else None
    for prefix, found in _SIDES.items():
        rest = plain.removeprefix(prefix)
        if rest != plain and rest in _STRIKES + _OFFS:
            plain, side = rest, found
            break
    if side is None or plain not in _STRIKES + _OFFS:
        return None
    return side, "heel_strike" if plain in _STRIKES else "toe_off", plain in ("on", "off")


def _events(contents: _Contents, start: float, duration: float) -> tuple[Event, ...]:
    """Gait events within the recording, in order of time, each once.

    Times are of the clock in which the trial's first frame is frame 1, also where the file has
    been cut. Some programs count from the first frame that is kept: taken so where no event
    fits otherwise. Where a file has an event twice, as a plate's contact (ON, OFF) and as gait
    event (HS, TO), the contact is kept: in WBDS01walkT01.c3d six of 15 RHS are 53 ms before any
    force.
    """
    labels = _labels(contents, "EVENT", "LABELS")
    contexts = _labels(contents, "EVENT", "CONTEXTS")
    times = contents.get("EVENT", "TIMES")
    found = []
    for index, label in enumerate(labels[: len(times) // 2]):
        meaning = _event(label, contexts[index] if index < len(contexts) else "")
        if meaning is not None:
            side, kind, contact = meaning
            seconds = 60.0 * float(times[2 * index]) + float(times[2 * index + 1])
            found.append((Event(seconds, side, kind), contact))
    inside = [pair for pair in found if start - 0.05 <= pair[0].time <= start + duration]
    if start and not inside:
        found = [(replace(event, time=event.time + start), contact) for event, contact in found]
        inside = [pair for pair in found if start - 0.05 <= pair[0].time <= start + duration]
    kept: list[Event] = []
    for event, _ in sorted(inside, key=lambda pair: (not pair[1], pair[0].time)):
        if not any(
            (event.side, event.kind) == (other.side, other.kind)
            and abs(event.time - other.time) < SAME_EVENT_S
            for other in kept
        ):
            kept.append(event)
    return tuple(sorted(kept, key=lambda event: event.time))
