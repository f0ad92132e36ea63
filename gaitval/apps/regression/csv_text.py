"""Rows as CSV text."""

import csv
import io
from collections.abc import Iterable, Sequence


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """CSV of `rows` with an empty cell for None. Text that a spreadsheet would take for a formula
    starts with an apostrophe, because names in it may come from outside.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for row in rows:
        writer.writerow([_cell(each) for each in row])
    return text.getvalue()


def _cell(value: object) -> object:
    if value is None:
        return ""
    return (
        f"'{value}" if isinstance(value, str) and value.startswith(tuple("=+-@\t\r\n")) else value
    )
