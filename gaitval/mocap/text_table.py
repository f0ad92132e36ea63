"""Tables of numbers in text files: lines, fields, rates."""

import re
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.text.plain_numbers import plain_float, plain_floats
from gaitval.arrays import Array
from gaitval.constants import LARGEST_SIZE
from gaitval.errors import RecordError
from gaitval.mocap.repairs import passed_over

SLOWEST_RATE: Final = 5.0
"""Hz. No camera and no force plate is sampled more slowly."""

XYZ: Final = "xyz"

LINES: Final = 20_000_000
"""Most lines of a file: two hours at 2000 Hz have fewer."""

_BREAKS: Final = "\n\r\v\f\x1c\x1d\x1e\x85\u2028\u2029"
"""What ends a line for Python."""


def _not_text(path: Path) -> RecordError:
    return RecordError(
        f"{path}: not a text file. If it is a C3D file, its name must end in .c3d; otherwise "
        "export the trial again."
    )


def text_lines(path: Path) -> list[str]:
    """Lines of the text file `path` in UTF-8 or Windows' code page. Raises RecordError if it cannot
    be opened, is empty, or is not text (`_not_text`).
    """
    try:
        # Motion Analysis and Vicon write the folder's name in Windows' code page.
        text = file_gate.read_text(
            path,
            RecordError,
            largest=file_gate.SIZES.table,
            fix="Check the name and the folder",
            encodings=("utf-8-sig", "cp1252"),
        )
    except UnicodeDecodeError:
        raise _not_text(path) from None
    if not text or text.isspace():
        raise RecordError(f"{path}: the file is empty. Copy or export it again.")
    if "\0" in text:
        raise _not_text(path)
    if sum(map(text.count, _BREAKS)) > LINES:
        raise RecordError(f"{path}: has more than {LINES:,} lines. Export one trial.")
    return _with_points(text).splitlines()


_COMMAS: Final = re.compile(r"(?<![^\t;\n])( *[+-]?\d+),(\d+(?:[eE][+-]?\d+)? *)(?=[\t;\r\n]|$)")
_POINTS: Final = re.compile(r"(?<![^\t;\n]) *[+-]?\d+\.\d+(?:[eE][+-]?\d+)? *(?=[\t;\r\n]|$)")
"""Cells between tabs or semicolons that are numbers."""


def _with_points(text: str) -> str:
    """The `text` of a table with decimal points, where nearly all its numbers have a comma instead:
    many programs write what the region of Windows has. With both, a comma may divide thousands.
    """
    if "," not in text or not ("\t" in text or ";" in text):
        return text
    points, commas = len(_POINTS.findall(text)), len(_COMMAS.findall(text))
    return _COMMAS.sub(r"\1.\2", text) if points < 0.01 * commas else text


NOTHING: Final = re.compile(
    r"(?<![^\s,;])(?:[+-]?nan\(\w*\)|[+-]?1\.#(?:QNAN|SNAN|IND)\d*|NULL|#?N/A|-{1,3})"
    r"(?![^\s,;])",
    re.IGNORECASE,
)
"""What other programs write where there is no number: C on Windows, databases, spreadsheets."""


def numbers_of(
    path: Path, rows: Sequence[str], first_line: int, width: int, separator: str | None
) -> Array:
    """Numbers in lines of text; an empty field is NaN, and so is what other programs write for it.

    Parameters
    ----------
    path : the file, for messages.
    rows : one line for each row.
    first_line : number of the first row in the file, counted from 1, for messages.
    width : number of fields that each row must have.
    separator : between fields; None for any blanks.

    Returns
    -------
    array
        (rows, width).

    Raises
    ------
    RecordError : a row has another number of fields, or a field is no number, or infinite.
    """
    table = np.empty((len(rows), width))
    for i, row in enumerate(rows):
        fields = row.rstrip("\r\n").split(separator)
        # Some programs end every row with a separator or several.
        while len(fields) > width and not fields[-1].strip():
            fields.pop()
        if len(fields) != width:
            blanks = len(row.split())
            why = (
                "they are separated by blanks, and a gap would be none: separate them by tabs"
                if separator == "\t" and len(fields) == 1 and blanks > 1
                else "the file is truncated or damaged. Export it again"
            )
            raise RecordError(
                f"{path}: line {first_line + i} has {len(fields)} fields, but the header has "
                f"{width}: {why}."
            )
        with suppress(ValueError):  # a gap, or damage
            table[i] = plain_floats(fields)
            continue
        wrong = ""
        try:
            # what a gap is called costs time to look for, and most rows have none
            spelled = NOTHING.search(row) is not None
            table[i] = [
                plain_float(wrong := NOTHING.sub("nan", field.strip() or "nan"))
                if spelled
                else plain_float(wrong := field.strip() or "nan")
                for field in fields
            ]
        except ValueError:
            fix = (
                "It has a decimal comma: set the program, or the region of Windows, to a decimal "
                "point and export the file again"
                if re.fullmatch(r"[+-]?\d+,\d+(e[+-]?\d+)?", wrong, flags=re.IGNORECASE)
                else "Correct it or export the file again"
            )
            raise RecordError(
                f"{path}: line {first_line + i}: {wrong!r} is not a number. {fix}."
            ) from None
    beyond = np.flatnonzero((np.abs(table) > LARGEST_SIZE).any(axis=1))
    if len(beyond):
        raise RecordError(
            f"{path}: line {first_line + int(beyond[0])}: a value is infinite, or larger than "
            f"anything that is measured ({LARGEST_SIZE:g}). Export the file again."
        )
    return table


def counted(path: Path, what: str, promised: object, seen: int, of: str) -> None:
    """Warn of `what` at `path`, whose header has `promised` another count `of` something than the
    `seen` one.
    """
    passed_over(
        f"{path}: {what} is {promised}, but there are {seen} {of}, which are used (but "
        "for a last row that may be incomplete): the file was cut after it was exported"
    )


def cut_off(path: Path, what: str, promised: object, seen: int) -> RecordError:
    """The error of a file at `path` that ends in the middle of a row, of which `what` of its header
    `promised` more rows than were `seen`.
    """
    return RecordError(
        f"{path}: {what} is {promised}, but there are {seen} rows, the last of them incomplete: "
        "the file is truncated. Export it again."
    )


def sound_rows(path: Path, time: Array) -> int:
    """How many of the times (T,) of the file `path` are evenly spaced: all, or all but the last.

    Some programs write one row more at the end, off the others' clock. Any other uneven time is
    left to `sample_rate`.
    """
    steps = np.diff(time)
    if len(steps) < 3 or not np.isfinite(steps).all():
        return len(time)
    usual = np.median(steps)
    off = abs(steps - usual) > 0.3 * usual
    if off[:-1].any() or not off[-1] or not 0.0 < steps[-1] < 2.5 * usual:
        return len(time)
    passed_over(
        f"{path}: the last of {len(time)} samples, at {time[-1]:g} s, is "
        f"{1e3 * abs(steps[-1] - usual):.2g} ms off the others' spacing; left out"
    )
    return len(time) - 1


def sample_rate(path: Path, time: Array) -> float:
    """Rate of uniform samples, Hz, from times that may be rounded.

    The rate is that of the straight line through all times; a whole number of Hz is preferred if it
    explains the times as well (WBDS: 0.007, 0.013, 0.020 s are 150 Hz).

    Parameters
    ----------
    path : the file, for messages.
    time : (T,) s.

    Raises
    ------
    RecordError
        A time is missing, there is only one, or they do not increase, are not evenly spaced or not
        in seconds.
    """
    if not np.isfinite(time).all():
        raise RecordError(f"{path}: a time is missing or not a number. Export the file again.")
    if len(time) < 2:
        raise RecordError(f"{path}: a single sample has no rate. Export the whole trial.")
    steps = np.diff(time)
    if (steps <= 0).any():
        row = int(np.flatnonzero(steps <= 0)[0])
        raise RecordError(
            f"{path}: the time goes from {time[row]:g} s to {time[row + 1]:g} s in sample "
            f"{row + 2} instead of increasing: the file contains two trials, or the times are "
            "rounded too much. Export it again."
        )
    index = np.arange(len(time), dtype=float)
    step, first = np.polyfit(index, time, 1)
    spread = float(np.abs(time - first - step * index).max())
    if spread > 0.3 * step:
        row = int(np.argmax(np.abs(time - first - step * index)))
        raise RecordError(
            f"{path}: the times are not evenly spaced: around sample {row + 1} (t = {time[row]:g} "
            f"s) they are off by {spread / step:.1f} steps of {step:.4g} s. Samples are missing; "
            "export the whole trial, with gaps left empty."
        )
    rate = 1.0 / float(step)
    if rate < SLOWEST_RATE:
        raise RecordError(
            f"{path}: the times go in steps of {step:.4g} s, {rate:.3g} Hz: they look like "
            "milliseconds or frame numbers. Write the time in seconds and export again."
        )
    whole = round(rate)
    if whole:
        misfit = time - index / whole
        # `spread` is about the rounding of the times. A whole rate that misses them by no more than
        # rounding can is as good as the line.
        if np.ptp(misfit) <= 2 * max(2 * spread, 1e-7):
            return float(whole)
    return rate


def with_gaps(markers: Array) -> Array:
    """Trajectories `markers` (T, M, 3) in any unit with NaN where one was not seen: it lacks a
    coordinate or is exactly at the origin.
    """
    hidden = np.isnan(markers).any(axis=2) | (markers == 0).all(axis=2)
    return np.where(hidden[:, :, None], np.nan, markers)
