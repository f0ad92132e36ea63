"""What a C3D file contains: its parameters and its data, as stored.

They are read by ezc3d in a separate process (`c3d_process.py`), because a damaged file can make
ezc3d crash, run for ever or ask for all memory: ezc3d 1.7.2 does so with 2 % of the files in which
one byte of the header or the parameters was changed. In a separate process, the worst that a file
can cause is a `RecordError`. It costs 0.2 s.
"""

import io
import json
import os
import signal
import struct
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval._internal.io import file_gate
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.repairs import passed_over
from gaitval.units import LENGTH, SPREAD, stated_factor, unit_of

PROCESS = Path(__file__).with_name("c3d_process.py")
"""The script that reads a file."""

SECONDS = 10.0
SECONDS_PER_MEGABYTE: Final = 1.0
"""Longest computing time to read a file; measured: 0.1 s plus 0.08 s per megabyte."""
BUSY = 10.0
"""Times as long by the clock: a machine that is busy with ten other things has taken 11 s for a
file of 1 MB, which is no fault of the file."""

OUT_OF_TIME: Final = getattr(signal, "SIGXCPU", 24)
"""With which a system ends a process that has computed for too long."""

_BLOCK: Final = 512
_MOST_COUNTED: Final = 65535
"""Frames that the 16 bits of a header can count."""


@dataclass(frozen=True)
class Contents:
    """What ezc3d finds in a file: parameters by group and name, and the data; T frames.

    Attributes
    ----------
    parameters : by group and name; each has its `value` as a flat list and its `shape`.
    first_frame : number of the first frame that is kept, as ezc3d counts; frame 0 is at time 0.
    points : (T, M, 3) in POINT:UNITS.
    residuals : (T, M), negative where a point was not seen.
    analogs : (samples, channels), a whole number of samples for each frame.
    """

    parameters: Mapping[str, Mapping[str, Mapping[str, list[Any]]]]
    first_frame: int
    points: Array
    residuals: Array
    analogs: Array

    def get(self, group: str, name: str) -> list[Any]:
        """Values of a parameter as a flat list in the file's order; empty where it is missing."""
        return list(self.parameters.get(group, {}).get(name, {}).get("value", []))

    def number(self, group: str, name: str) -> float:
        """First value of a parameter; 0 if it is missing or not a number."""
        value = next(iter(self.get(group, name)), 0)
        return float(value) if isinstance(value, int | float) else 0.0

    def text(self, group: str, name: str) -> str:
        """First value of a text parameter; empty where it is missing."""
        return str(next(iter(self.get(group, name)), "")).strip()

    def of_plate(self, name: str, index: int, *shape: int) -> Array | None:
        """A plate's part of an array of FORCE_PLATFORM, cut to this shape; None where it has none.

        Its last axis is the plate. If the plates are of several types, the other axes are as long
        as the largest type needs.
        """
        stored = self.parameters.get("FORCE_PLATFORM", {}).get(name)
        if stored is None:
            return None
        # Programs leave out the last axis of an array for a single plate.
        sizes = [*stored["shape"], 1][: len(shape) + 1]
        if len(sizes) <= len(shape) or sizes[-1] <= index:
            return None
        if any(size < wanted for size, wanted in zip(sizes, shape, strict=False)):
            return None
        try:
            # C3D stores the first index fastest, as Fortran does.
            values = np.array(stored["value"], dtype=float).reshape(sizes, order="F")
        except ValueError:
            return None
        part: Array = np.moveaxis(values, -1, 0)[index]
        return part[tuple(slice(wanted) for wanted in shape)]


def check_size(path: Path) -> tuple[int, int, int]:
    """Refuse a file `path` that is not C3D, or that is shorter than its header says, by its first
    bytes. Returns the analog values of a frame and of each channel in it, by a header that its size
    shows to be right, else zeros; and how many values its data have room for, less the blocks that
    may be filled up. Raises RecordError if it cannot be opened, is empty, truncated, of another
    format, or in the byte order of MIPS processors.
    """
    fix = "Check the name and the folder"
    with file_gate.opened(path, RecordError, largest=file_gate.SIZES.binary, fix=fix) as file:
        head = file.read(_BLOCK)
        size = file.seek(0, io.SEEK_END)
        if len(head) == _BLOCK:
            # Byte 0 is the number of the first block of parameters, counted from 1.
            file.seek((max(head[0], 1) - 1) * _BLOCK)
            parameters = file.read(4)
    if not size:
        raise RecordError(f"{path}: the file is empty. Copy or export it again.")
    if len(head) > 1 and head[1] != 0x50:
        raise RecordError(
            f"{path}: not a C3D file (its second byte is {head[1]:#04x}; in a C3D file it is "
            "0x50). Give the .c3d file of the trial, or export it again."
        )
    if len(head) < _BLOCK or len(parameters) < 4:
        raise RecordError(
            f"{path}: truncated: {size} bytes are too few even for the header and the parameters. "
            "Copy or export it again."
        )
    # The processor sets the byte order: 84 Intel, 85 DEC (with its own floats), 86 MIPS.
    if parameters[3] == 86:
        raise RecordError(
            f"{path}: stored in the byte order of MIPS processors (SGI workstations), which cannot "
            "be read. Open it in a program that reads it, such as Mokka, and save it for Intel."
        )
    # Words 2 to 5 and 9 to 10 of the header; bytes 12 to 15 are the scale of integer data.
    points, analogs, first, last = struct.unpack("<4H", head[2:10])
    data_block, samples = struct.unpack("<2H", head[16:20])
    (scale,) = struct.unpack("<f", head[12:16])
    if parameters[3] == 85:  # a DEC float has its sign in byte 1, the others in byte 3
        scale = -1.0 if head[13] & 0x80 else 1.0
    # A negative scale marks floating-point data; otherwise they are integers of 16 bits.
    word = 4 if scale < 0 else 2
    room = (size - (data_block + 1) * _BLOCK) // word
    if last < first:
        return 0, 0, room  # over 65535 frames, see `check_frames`
    frames = last - first + 1
    # A point takes four words in each frame: x, y, z, and the residual with the cameras.
    needed = (data_block - 1) * _BLOCK + frames * (4 * points + analogs) * word
    if size < needed:
        raise RecordError(
            f"{path}: truncated: the header promises {frames} frames of {points} markers and "
            f"{analogs} analog values ({samples} for each channel), {needed} bytes, but the file "
            f"has {size}. Copy or export it again."
        )
    # Only the rest of a block may follow the data.
    return (analogs, samples, room) if size - needed < _BLOCK else (0, 0, room)


def _damaged(path: Path, why: str) -> RecordError:
    return RecordError(
        f"{path}: cannot be read as C3D ({why}): it is damaged or violates the format. Copy it "
        "again, or open it in the program that recorded it and save it again."
    )


def read_contents(path: Path) -> Contents:
    """Contents of a file `path` that `check_size` has passed, read in another process (see the
    module's docstring). Raises RecordError if it is damaged (`_damaged` gives the message), or has
    fewer frames than its header says.
    """
    # -P: a json.py in the data folder must not replace Python's own.
    limit = SECONDS + SECONDS_PER_MEGABYTE * path.stat().st_size / 1e6
    command = [sys.executable, "-P", str(PROCESS), str(path.resolve()), str(limit)]
    # Each OpenBLAS thread would count towards the process' memory limit.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, capture_output=True, timeout=BUSY * limit, check=False, env=environment
        )
    except subprocess.TimeoutExpired:
        raise _damaged(path, f"reading did not finish within {BUSY * limit:.0f} s") from None
    # A negative exit code is the signal that ended the process.
    if done.returncode == -OUT_OF_TIME:
        raise _damaged(path, f"reading did not finish within {limit:.0f} s of computing")
    if done.returncode:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        # A message of `c3d_process`, and neither a crash (a negative code) nor an error of
        # Python's.
        known = done.returncode > 0 and lines and lines[-1].startswith("c3d: ")
        # ezc3d then explains how to switch its check off, which does not help our users.
        why = lines[-1][5:].partition(". If you want")[0] if known else "the reader crashes"
        raise _damaged(path, why)
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as stored:
        described = json.loads(str(stored["described"]))
        contents = Contents(
            parameters=described["parameters"],
            first_frame=described["first_frame"],
            points=stored["points"],
            residuals=stored["residuals"],
            analogs=stored["analogs"],
        )
    promised = described["last_frame"] - described["first_frame"] + 1
    if len(contents.points) < promised:
        raise RecordError(
            f"{path}: truncated: the header promises {promised} frames, but there are "
            f"{len(contents.points)}. Copy or export it again."
        )
    return contents


def check_frames(path: Path, contents: Contents, analogs: int, samples: int, room: int) -> None:
    """Refuse a file at `path` whose parameters gave each frame of its `contents` another number of
    values than `check_size` (`analogs`, `samples`): its frames were read askew; or of which a count
    that does not fit into 16 bits left frames unread (`room`). Raises RecordError.
    """
    frames = len(contents.points)
    found = contents.analogs.size // max(frames, 1)
    fits = room // max(4 * contents.points.shape[1] + found, 1)
    # Rotations of segments follow the points and would be taken for more frames.
    if fits > max(frames, _MOST_COUNTED) and not contents.number("ROTATION", "USED"):
        raise RecordError(
            f"{path}: has about {fits} frames, but its header counts {frames}: it cannot count "
            f"more than {_MOST_COUNTED}. Export the trial in parts of at most {_MOST_COUNTED} "
            "frames."
        )
    if not analogs or found == analogs:
        return
    raise RecordError(
        f"{path}: POINT:RATE {contents.number('POINT', 'RATE'):g} and ANALOG:RATE "
        f"{contents.number('ANALOG', 'RATE'):g} contradict the header, which says {samples} "
        "samples of each channel in a frame. Correct them in the program that wrote the file."
    )


def continued(contents: Contents, group: str, name: str) -> list[Any]:
    """Values of a parameter of `contents` by its `group` and `name`, as a flat list; they continue
    in NAME2, NAME3 after 255 entries. Empty where it is missing.
    """
    found = contents.get(group, name)
    for number in range(2, 100):
        more = contents.get(group, f"{name}{number}")
        if not more:
            break
        found += more
    return found


def labels_of(contents: Contents, group: str, name: str) -> list[str]:
    """Texts of `continued`, for example of POINT and LABELS, without blanks at their ends."""
    return [str(text).strip() for text in continued(contents, group, name)]


def length_unit(path: Path, contents: Contents) -> float:
    """Metres of the unit of points, corners and origins of a C3D file.

    Programs of before 1998 write no `POINT:UNITS`. Then the only unit in which the points of a
    frame are as far apart as a person's markers is taken, with a warning. Raises RecordError if it
    is unknown, or if it is missing and none or several could be meant.
    """
    where = f"{path}: POINT:UNITS"
    text = contents.text("POINT", "UNITS")
    if text.strip():
        return stated_factor(where, LENGTH, text)
    points, hidden = contents.points, contents.residuals < 0
    seen = np.where((hidden | (points == 0.0).all(axis=2))[..., None], np.nan, points)
    seen = seen[np.isfinite(seen).all(axis=2).sum(axis=1) > 1]
    # The longest side of what the points fill, in the middle of all frames.
    extent = (np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1)).max(axis=1)
    spread = float(np.median(extent)) if len(seen) else 0.0
    found = unit_of(SPREAD, size=spread)
    if found.unit is None:
        raise RecordError(
            f"{where} is missing, and the points of a frame spread over {spread:.3g}: "
            f"{found.sentence}. Correct it: set the right unit in the program that made the "
            "file, and export again."
        )
    passed_over(
        f"{where} is missing. The points of a frame spread over {spread:.3g}, as a person's do in "
        f"{found.unit.name}, which is taken; also for the force plates"
    )
    return found.unit.factor
