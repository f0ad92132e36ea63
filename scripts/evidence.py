"""Rows of `reports/evidence/TOPIC.csv`: what was required of the project, and what was measured.

Each row is written by the command that it names. A row with the same `what` is replaced, so any
command can be run again on its own.
"""

import csv
import io
import os
import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

FOLDER = Path(__file__).resolve().parent.parent / "reports" / "evidence"


@dataclass(frozen=True)
class Row:
    """One figure.

    Attributes
    ----------
    what : the thing measured, unique in its file.
    value : in `unit`.
    relation : how the value is compared with `goal` (wanted) and `must` (required).
    n : number of cases that the value was measured on.
    command : the line that wrote this row.
    """

    what: str
    value: float
    unit: str
    relation: Literal["<=", ">="]
    goal: float
    must: float
    n: int
    command: str


def none_may(what: str, value: float, unit: str, n: int, command: str) -> Row:
    """A row of things of which there may be none."""
    return Row(what, value, unit, "<=", 0, 0, n, command)


def pytest_counts(line: str) -> tuple[int, int]:
    """Failures (errors among them) and passes in the last line that pytest printed."""
    counts = {word: int(count) for count, word in re.findall(r"(\d+) (\w+)", line)}
    failed = counts.get("failed", 0) + counts.get("error", 0) + counts.get("errors", 0)
    return failed, counts.get("passed", 0)


def write(topic: str, rows: list[Row]) -> Path:
    """Add rows to a topic's file, or replace those of the same `what`."""
    path = FOLDER / f"{topic}.csv"
    names = [field.name for field in fields(Row)]
    kept: dict[str, dict[str, str]] = {}
    if path.is_file():
        with path.open(newline="") as file:
            kept = {row["what"]: row for row in csv.DictReader(file)}
    for row in rows:
        kept[row.what] = {
            name: f"{value:.6g}" if isinstance(value := getattr(row, name), float) else str(value)
            for name in names
        }
    text = io.StringIO()
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(kept.values())
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    unfinished.write_text(text.getvalue())
    unfinished.replace(path)
    return path
