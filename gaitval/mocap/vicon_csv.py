"""Vicon Nexus's ASCII export: trajectories and force plates of a trial in one text file.

Sections follow each other, with a blank line between: a name (Devices, Joints, Model Outputs,
Trajectories, Events), the rate in Hz, the names of devices or markers, the names of their columns
after `Frame` and `Sub Frame`, and the units. Trajectories and the force plates of Devices are
read; a plate is three devices, `… - Force`, `… - Moment` and `… - CoP`. Nexus writes the force on
the plate, the moment about the middle of the plate and the centre of pressure, in the laboratory's
axes.

Sections are as in `tests/data` of pyomeca (github.com/pyomeca/pyomeca), read in November 2026.
"""

import re
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.io.text_tables import separator_of
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.force_plates import plate_or_fault
from gaitval.mocap.laboratory_forces import placed_plate
from gaitval.mocap.recording import Plate, Recording
from gaitval.mocap.separate_forces import with_plates
from gaitval.mocap.text_cells import (
    cells_of,
    markers_named,
    numbers,
    positive,
    without_prefix,
)
from gaitval.mocap.text_table import text_lines, with_gaps
from gaitval.units import FORCE, LENGTH, MOMENT, stated_factor

_SECTIONS: Final = ("devices", "trajectories", "joints", "model outputs", "segments", "events")
_PARTS: Final = {
    "force": (("fx", "fy", "fz"), FORCE),
    "moment": (("mx", "my", "mz"), MOMENT),
    "cop": (("cx", "cy", "cz"), LENGTH),
}
"""Columns and quantities of the three devices of a plate."""
_HEADER: Final = 5
"""Lines of a section before its rows: name, rate, devices, columns, units."""


class _Section(NamedTuple):
    """A part of the file: its rate in Hz, its header and its numbers."""

    line: int
    rate: float
    devices: list[str]
    columns: list[str]
    units: list[str]
    values: Array


def read_vicon_csv(path: Path) -> Recording:
    """Read a trial that Vicon Nexus exported as ASCII to `path`, with commas, semicolons or tabs.
    Markers are in m, in the laboratory's axes, NaN where a cell is empty; a subject's prefix that
    all share (`Anna:LASI`) is removed. Plates have what acts on the person. Model outputs, EMG and
    events are left out.

    Raises RecordError if the file is of another kind or truncated; a unit is unknown; a plate lacks
    a part, or its moment does not belong to its force; the frames of Devices are not those of
    Trajectories.
    """
    path = Path(path)
    sections = _sections(path, text_lines(path))
    if "trajectories" not in sections:
        raise RecordError(
            f"{path}: no section Trajectories among {', '.join(sections) or 'its lines'}: it is "
            "not the ASCII export of Vicon Nexus, or the markers were not exported. Tick "
            "Trajectories in Nexus's export, or give the .c3d file of the trial."
        )
    markers = sections["trajectories"]
    recording = _markers(path, markers)
    devices = sections.get("devices")
    plates = () if devices is None else _plates(path, devices, recording)
    if devices is None or not plates:
        return recording
    first, frames = markers.values[0, 0], markers.values[:, 0]
    shown = np.unique(devices.values[:, 0])
    if not np.array_equal(shown, np.unique(frames)):
        raise RecordError(
            f"{path}: line {devices.line}: Devices has the frames {shown[0]:.0f} to "
            f"{shown[-1]:.0f}, but Trajectories has {first:.0f} to {frames[-1]:.0f}, so forces and "
            "markers are of other times. Export all frames of both."
        )
    return with_plates(recording, path, plates, rate=devices.rate, start=recording.start)


def _sections(path: Path, lines: list[str]) -> dict[str, _Section]:
    """The sections by their names in small letters; those with no numbers to use are left out."""
    begins = [
        i for i, line in enumerate(lines) if cells_of(line, separator_of(line))[:1]
        and cells_of(line, separator_of(line))[0].lower() in _SECTIONS
    ]  # fmt: skip
    found: dict[str, _Section] = {}
    for begin, end in zip(begins, [*begins, len(lines)][1:], strict=True):
        name = cells_of(lines[begin], separator_of(lines[begin]))[0].lower()
        if name in ("devices", "trajectories"):
            if name in found:
                raise RecordError(
                    f"{path}: line {begin + 1}: a second section {name.title()}; one file has one "
                    "trial. Export each trial into a file of its own."
                )
            found[name] = _section(path, lines, begin, end)
    return found


def _section(path: Path, lines: list[str], begin: int, end: int) -> _Section:
    block = lines[begin:end]
    title = block[0].strip().strip(",;\t")
    if len(block) < _HEADER:
        raise RecordError(
            f"{path}: line {begin + 1}: section {title} has {len(block)} lines, but five of header "
            "and the frames must follow its name: the file is truncated. Export it again."
        )
    separator = separator_of(block[3])
    rate = re.sub(r"\s*hz$", "", cells_of(block[1], separator)[0:1][0] if block[1].strip() else "",
                  flags=re.IGNORECASE)  # fmt: skip
    columns = cells_of(block[3], separator)
    if [name.lower() for name in columns[:2]] != ["frame", "sub frame"]:
        raise RecordError(
            f"{path}: line {begin + 4}: the columns of {title} begin with "
            f"{', '.join(columns[:2]) or 'nothing'}, but must with Frame, Sub Frame, as Nexus "
            "writes them. Export the trial again."
        )
    rows = []
    for line in block[_HEADER:]:
        if not line.strip(" \t,;"):
            break
        rows.append(line)
    first = begin + _HEADER + 1
    values = numbers(path, rows, first, len(columns), separator)
    if not np.isfinite(values[:, :2]).all():
        raise RecordError(
            f"{path}: from line {first}: a Frame or Sub Frame of {title} is missing, so the times "
            "are unknown. Export the trial again."
        )
    count = len(columns)
    full = [[*cells_of(line, separator), *[""] * count][:count] for line in (block[2], block[4])]
    where = f"line {begin + 2}: the rate of {title} (Hz)"
    return _Section(begin + 1, positive(path, rate, where), full[0], columns, full[1], values)


def _markers(path: Path, section: _Section) -> Recording:
    frames = section.values[:, 0]
    if (np.diff(frames) != 1.0).any():
        row = int(np.flatnonzero(np.diff(frames) != 1.0)[0])
        raise RecordError(
            f"{path}: line {section.line + _HEADER + row + 1}: frame {frames[row + 1]:.0f} follows "
            f"frame {frames[row]:.0f}, so frames are missing or twice. Export all frames, with "
            "gaps left empty."
        )
    names, paths = [], []
    starts = [i for i, name in enumerate(section.devices) if name]
    for begin, end in zip(starts, [*starts, len(section.columns)][1:], strict=True):
        axes = [name.lower()[:1] for name in section.columns[begin:end]]
        name = section.devices[begin]
        if axes[:3] != ["x", "y", "z"]:
            # Nexus's own model, or a quantity that it made of a marker, such as its magnitude
            if name.startswith(("*", "|")):
                continue
            raise RecordError(
                f"{path}: line {section.line + 3}: the columns of marker {name} are "
                f"{', '.join(section.columns[begin:end])}, but must be X, Y, Z. Export the "
                "trajectories as components."
            )
        where = f"{path}: line {section.line + 4}: the unit of marker {name}"
        metres = stated_factor(where, LENGTH, section.units[begin])
        names.append(name)
        paths.append(metres * section.values[:, begin : begin + 3])
    kept = markers_named(path, names)
    return Recording(
        source=str(path),
        axes="laboratory",
        names=without_prefix([names[i] for i in kept]),
        markers=with_gaps(np.stack([paths[i] for i in kept], axis=1)),
        marker_rate=section.rate,
        start=float(frames[0] - 1.0) / section.rate,  # Nexus counts frames from 1
    )


def _plates(path: Path, section: _Section, recording: Recording) -> tuple[Plate, ...]:
    found: dict[str, dict[str, Array]] = {}
    for begin in [i for i, name in enumerate(section.devices) if name]:
        named = re.fullmatch(r"(.*\S)\s+[-–]\s*(force|moment|cop)", section.devices[begin], re.I)
        if named is None or "combined" in named[1].lower():
            continue
        part = named[2].lower()
        columns, quantity = _PARTS[part]
        if [name.lower() for name in section.columns[begin : begin + 3]] != list(columns):
            raise RecordError(
                f"{path}: line {section.line + 3}: the columns of {section.devices[begin]} are "
                f"{', '.join(section.columns[begin : begin + 3])}, but must be "
                f"{', '.join(columns).title()}. Export the device's components."
            )
        factors = [
            stated_factor(
                f"{path}: line {section.line + 4}: the unit of {named[0]}", quantity, unit
            )
            for unit in section.units[begin : begin + 3]
        ]
        found.setdefault(named[1], {})[part] = section.values[:, begin : begin + 3] * factors
    plates = []
    for name, parts in found.items():
        missing = [part for part in _PARTS if part not in parts]
        if missing:
            raise RecordError(
                f"{path}: line {section.line + 2}: force plate {name} has no "
                f"{' and no '.join(missing)}, without which its force has no place. Export Force, "
                "Moment and CoP of every plate."
            )
        wrench = parts["force"], parts["cop"], parts["moment"]
        places = {"the middle of the plate": None, "the origin": np.zeros(3)}
        stated = {"the stated unit": 1.0}
        make = partial(placed_plate, path, name, recording, wrench, places, stated)
        plates.append(plate_or_fault(name, len(section.values), make))
    return tuple(plates)
