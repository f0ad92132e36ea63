"""Lines of exported text, split into cells, and their numbers."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gaitval._internal.text.plain_numbers import plain_float
from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.text_table import numbers_of


def cells_of(line: str, separator: str) -> list[str]:
    """Cells without blanks and quotation marks at their ends, and without empty ones at the end."""
    cells = [cell.strip().strip('"').strip() for cell in line.split(separator)]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def numbers(
    path: Path,
    rows: Sequence[str],
    first_line: int,
    width: int,
    separator: str,
    fewest: int | None = None,
) -> Array:
    """Numbers (rows, width) in lines, NaN where a cell is empty or a gap by any program's word; a
    row that ends early lacks its last cells. Raises RecordError as `numbers_of`, without rows, and
    for a last one of fewer than `fewest` cells (`width` if not given): the file was cut off.
    """
    if not rows:
        raise RecordError(
            f"{path}: line {first_line}: no rows of numbers below the names of the columns: the "
            "file is truncated. Export it again."
        )
    fewest = width if fewest is None else fewest
    if (count := len(rows[-1].split(separator))) < fewest:
        raise RecordError(
            f"{path}: line {first_line + len(rows) - 1} has {count} cells, but the header has "
            f"{fewest}: the file is truncated. Copy or export it again."
        )
    short = [separator * (width - 1 - row.count(separator)) for row in rows]
    full = [row.rstrip("\r\n") + more for row, more in zip(rows, short, strict=True)]
    return numbers_of(path, full, first_line, width, separator)


def positive(path: Path, text: str, what: str) -> float:
    """A number above zero. Raises RecordError, which says `what` it is."""
    try:
        value = plain_float(text)
    except ValueError:
        value = np.nan
    if not 0.0 < value < np.inf:
        comma = re.fullmatch(r"\d+,\d+", text.strip())
        fix = (
            "It has a decimal comma: set the program, or the region of Windows, to a decimal point "
            "and export the trial again"
            if comma
            else "Export the trial again"
        )
        raise RecordError(
            f"{path}: {what} is {text.strip() or 'missing'!r}, but must be a number above 0: the "
            f"times would be unknown. {fix}."
        )
    return value


def markers_named(path: Path, names: Sequence[str]) -> list[int]:
    """Places of the labelled markers among `names`: unlabelled ones begin with `*` or are empty.
    Raises RecordError if there is none.
    """
    kept = [
        i
        for i, name in enumerate(names)
        if name and not name.rpartition(":")[2].startswith(("*", "Unidentified"))
    ]
    if not kept:
        raise RecordError(
            f"{path}: none of {len(names)} trajectories has a name. Label the markers in the "
            "program that recorded them and export again."
        )
    return kept


def without_prefix(names: Sequence[str]) -> tuple[str, ...]:
    """Names without a subject's prefix (`Anna:LASI`) that all of them share."""
    prefixes = {name.partition(":")[0] for name in names}
    if len(prefixes) == 1 and all(":" in name for name in names):
        return tuple(name.partition(":")[2] for name in names)
    return tuple(names)
