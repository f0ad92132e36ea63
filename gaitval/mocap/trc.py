"""Read markers as TRC, the format of Motion Analysis.

All in the laboratory's axes.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gaitval._internal.text.plain_numbers import plain_float, plain_int
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import passed_over
from gaitval.mocap.text_table import (
    counted,
    cut_off,
    numbers_of,
    sample_rate,
    sound_rows,
    text_lines,
    with_gaps,
)
from gaitval.units import LENGTH, stated_factor


def read_trc(path: Path) -> Recording:
    """Read a TRC file; blank, NaN and 0, 0, 0 are gaps.

    Columns without a name are unlabelled markers and are left out; to the right of the named ones
    Cortex writes them, not in every row. A row that ends early lacks its last markers.

    Parameters
    ----------
    path : the file.

    Returns
    -------
    Recording
        Markers in m, in the laboratory's axes.

    Raises
    ------
    RecordError
        The file is not TRC or cut off in a row; rate and times disagree; the unit is missing or
        unknown. Counts of the header unlike the rows are a `RecordWarning`.
    """
    path = Path(path)
    lines = text_lines(path)
    rate, frames, names, metres = _header(path, lines)
    count = len(names)
    # Five lines of header; a blank sixth, which some programs write, is left out with all others.
    numbered = [(i, line) for i, line in enumerate(lines[5:], start=6) if line.strip()]
    if not numbered:
        raise RecordError(f"{path}: no frames. Export the trial again.")
    if len(numbered) != frames:
        if len(numbered) > 1 and numbered[-1][1].count("\t") < numbered[-2][1].count("\t"):
            raise cut_off(path, "NumFrames", frames, len(numbered))
        counted(path, "NumFrames", frames, len(numbered), "rows")
        # A row that the file's end cut in a number looks whole.
        if 1 < len(numbered) < frames:
            numbered.pop()
        frames = len(numbered)
    rows = _named_columns(numbered, 2 + 3 * count)
    table = numbers_of(path, rows, numbered[0][0], 2 + 3 * count, separator="\t")
    table = table[: sound_rows(path, table[:, 1])]
    time, frames = table[:, 1], len(table)
    if frames > 1:
        seen = sample_rate(path, time)
        # A rate of 119.88 Hz may be written as 120, and the other way round.
        if abs(seen - rate) > 0.005 * rate:
            raise RecordError(
                f"{path}: DataRate is {rate:g} Hz, but the times go in steps of {1 / seen:.5g} s "
                f"({seen:.5g} Hz). Correct the one that is wrong."
            )
        # Beyond that of television (1.001) it is no rounding.
        if abs(seen - rate) > 0.002 * rate:
            passed_over(
                f"{path}: DataRate is {rate:g} Hz, but the times go at {seen:.6g} Hz, by which the "
                "trial is read. Correct the one that is wrong"
            )
        # The times decide: a rounded rate would shift the last frames of a long trial.
        rate = seen
    named = [place for place, name in enumerate(names) if name]
    markers = table[:, 2:].reshape(frames, count, 3)[:, named]
    return Recording(
        source=str(path),
        axes="laboratory",
        names=tuple(names[place] for place in named),
        markers=with_gaps(markers) * metres,
        marker_rate=rate,
        start=float(time[0]),
    )


def _header(path: Path, lines: list[str]) -> tuple[float, int, tuple[str, ...], float]:
    """Rate in Hz, number of frames, names of the markers ("" between them for one without), and
    metres in the file's unit.
    """
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise RecordError(
            f"{path}: not a TRC file: the first line must begin with PathFileType, and there must "
            "be five header lines. Export it again."
        )
    if not all("\t" in line for line in lines[1:4]):
        raise RecordError(
            f"{path}: the fields of lines 2 to 4 are not separated by tabs (by commas, semicolons "
            "or blanks?), as the format has them. Export the file again as TRC."
        )
    keys, values = lines[1].split(), lines[2].split()
    header = dict(zip(keys, values, strict=False))
    for key in ("DataRate", "NumFrames", "NumMarkers", "Units"):
        if len(keys) != len(values) or key not in header:
            raise RecordError(
                f"{path}: line 3 has {len(values)} values for the {len(keys)} names of line 2, "
                f"and {key} must be among them. Write units (mm), rate and counts into line 3."
            )
    metres = stated_factor(f"{path}: line 3: Units", LENGTH, header["Units"])
    try:
        rate, frames, count = (
            plain_float(header["DataRate"]),
            plain_int(header["NumFrames"]),
            plain_int(header["NumMarkers"]),
        )
    except ValueError:
        rate = np.nan
    if not 0 < rate < np.inf:
        raise RecordError(
            f"{path}: line 3: DataRate, NumFrames and NumMarkers are {header['DataRate']}, "
            f"{header['NumFrames']}, {header['NumMarkers']}; but the rate must be above 0 Hz and "
            "the counts whole numbers. Correct them."
        )
    # Frame and time come first; each name heads three columns, so two empty cells follow it.
    cells = [cell.strip() for cell in lines[3].rstrip().split("\t")[2:]]
    named = [cell for cell in cells if cell]
    # A marker between others may have columns and no name; some programs leave out the empty cells.
    names = cells[::3] if named == [cell for cell in cells[::3] if cell] else named
    if not named:
        raise RecordError(
            f"{path}: line 4 names no marker. Label the markers in the program that recorded them "
            "and export again."
        )
    widest = max((line.rstrip().count("\t") for line in lines[5:]), default=0)
    if count not in (len(named), len(names)) and not (len(names) < count and widest >= 3 * count):
        counted(path, "NumMarkers", count, len(named), "names in line 4")
    return rate, frames, tuple(names), metres


def _named_columns(numbered: Sequence[tuple[int, str]], width: int) -> list[str]:
    """Rows of the named markers only, as long as the header says where it is plain what is meant:
    whole markers too many, or too few in a row that the file's end did not cut off.
    """
    rows = []
    for place, (_, line) in enumerate(numbered, start=1):
        fields = line.rstrip("\r\n").split("\t")
        if len(fields) > width and not fields[-1].strip():
            fields.pop()
        # Three columns for each marker; any other difference is damage, which `numbers_of` reports.
        if (len(fields) - width) % 3 == 0 and (len(fields) > width or place < len(numbered)):
            fields = fields[:width] + [""] * (width - len(fields))
        rows.append("\t".join(fields))
    return rows
