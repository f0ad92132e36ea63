"""Tables as text: read as whatever program wrote them, with notes at the top, separators and the
comma as a point; and written.
"""

import csv
import io
import re
from collections import Counter
from collections.abc import Iterable
from importlib import resources
from itertools import dropwhile
from typing import Final, NamedTuple

_DECIMAL: Final = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*")
"""A number with a comma for the point."""
MISSING: Final = (999.0, 9999.0, 99999.0, 999999.0)
"""Numbers that programs write where a value is missing, of either sign."""
HIDDEN: Final = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters but tab and line feed, those that turn the direction of a text, and halves of
characters, which a name of a file has that is not UTF-8: no table, page or terminal gets one."""
_SEPARATOR: Final = re.compile(r"\"?sep=.\"?", re.IGNORECASE)
"""A first line that says what separates the columns."""

_ENDINGS: Final = {
    **{"s": "s", "rad": "rad", "deg": "deg", "Nm/kg": "nm_kg", "W/kg": "w_kg", "1": "1"},
    **{"BW": "bw", "% BW": "percent_bw"},
}
"""What the name of a column ends in, by the unit of its values."""


class TextTable(NamedTuple):
    """A table: the names of its columns, and the cells of each row with the number of its line."""

    names: list[str]
    rows: list[tuple[int, list[str]]]

    def by_name(self) -> list[dict[str, str]]:
        """The rows, each cell by the name of its column."""
        return [dict(zip(self.names, cells, strict=True)) for _, cells in self.rows]


def separator_of(header: str) -> str:
    """What separates the columns of a table by its `header`: a comma, semicolons or tabs, as
    spreadsheets of many countries write it; with these a comma may be the decimal point.
    """
    return max("\t;,", key=header.count)  # of none, the first


def text_table(lines: list[str]) -> TextTable:
    """The table in `lines`. Notes before its header, which begin with `#`, and lines without
    anything are passed over. Of a table with semicolons or tabs, numbers with a comma for the point
    are given with the point. Raises csv.Error where quotation marks do not close, which would take
    all that follows for one cell, or where a column is there twice.
    """
    kept = list(dropwhile(_is_note, lines))
    if kept and _SEPARATOR.fullmatch(kept[0].strip()):  # which Excel understands
        kept = list(dropwhile(_is_note, kept[1:]))
    separator = separator_of(kept[0]) if kept else ","
    reader = csv.reader(kept, delimiter=separator, strict=True)
    names = next(reader, [])
    counts = Counter(map(str.strip, names))
    if twice := [name for name, count in counts.items() if name and count > 1]:
        raise csv.Error(f"column {twice[0]} is there twice")
    before = len(lines) - len(kept)
    rows = [(before + reader.line_num, cells) for cells in reader if cells]
    if separator != ",":
        rows = [(line, [_with_point(cell) for cell in cells]) for line, cells in rows]
    return TextTable(names, rows)


def shipped_table(package: str, file: str) -> TextTable:
    """A table that comes with a `package` of gaitval."""
    text = resources.files(package).joinpath(file).read_text("utf-8")
    return text_table(text.splitlines())


def with_unit(column: str, unit: str) -> str:
    """The name of a `column` that says its `unit`: "knee_angle_r_mean" in Nm/kg is
    "knee_angle_r_mean_nm_kg".
    """
    return f"{column}_{_ENDINGS[unit]}"


def without_unit(column: str) -> tuple[str, str]:
    """The name of a `column` without its unit, and the unit; "" where it says none, as the tables
    of earlier versions.
    """
    for unit, ending in sorted(_ENDINGS.items(), key=lambda each: -len(each[1])):
        if column.endswith(f"_{ending}"):
            return column.removesuffix(f"_{ending}"), unit
    return column, ""


def shown(text: str) -> str:
    """A `text` that may come from outside with U+FFFD for each of its `HIDDEN` characters."""
    return HIDDEN.sub("\ufffd", text)


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """CSV of `rows`, the first of which has the names of the columns, with an empty cell for None.
    Names in it may come from outside, so text is as `plain_cell` makes it.
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(map(plain_cell, row) for row in rows)
    return text.getvalue()


def plain_cell(value: object) -> object:
    """A cell's `value`: text as it is `shown`, with an apostrophe before what a spreadsheet would
    take for a formula; numbers are none, written as text either.
    """
    if not isinstance(value, str):
        return value
    text = shown(value)
    if not value.startswith(tuple("=+-@\t\r\n")):
        return text
    try:
        float(value)
    except ValueError:
        return f"'{text}"
    return text


def _is_note(line: str) -> bool:
    # a spreadsheet puts in quotes what has a separator in it
    return not line.strip() or line.lstrip('"').startswith("#")


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if _DECIMAL.fullmatch(cell) else cell
