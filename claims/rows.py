"""Rows of `reports/claims/VERSION.csv`: what was measured, of which version, when and where."""

import csv
import datetime
import os
import platform
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import gaitval
from gaitval.text_tables import csv_text

from .given import ROOT

FOLDER: Final = ROOT / "reports" / "claims"
COLUMNS: Final = ("what", "value", "unit", "n", "version", "commit", "date", "machine", "by")
"""`by` is the measurement, TOPIC.NAME, that writes the row: what a run skips is known from it."""
MEASURED: Final = ("gaitval", "models", "claims", "experiments", "tests")
UNCOMMITTED: Final = "+"
"""After a commit: what was measured was not, or not only, what that commit holds."""


@dataclass(frozen=True)
class Claim:
    """One figure.

    Attributes
    ----------
    what : the thing measured; no other claim is called so.
    value : in `unit`; "1" is a ratio.
    n : the number of cases that it was measured on.
    """

    what: str
    value: float
    unit: str
    n: int


def git(*arguments: str) -> str:
    """What git prints in the project's folder, without the last line's end; "" if it fails."""
    done = subprocess.run(
        ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )  # fmt: skip
    return done.stdout.rstrip("\n") if done.returncode == 0 else ""


STARTED: Final = git("rev-parse", "--short=9", "HEAD")
"""The commit at which this process started: what a run of hours has measured, whatever is committed
before it ends."""


class Source(NamedTuple):
    """Of which commit, of which day and where a claim is."""

    commit: str
    date: str
    machine: str


def source_of(stored: Sequence[str] = ()) -> Source:
    """The commit whose code is measured, now and here; of claims that are read from stored results
    (git's path patterns), the oldest of the commits that last changed one of them, and its day:
    where these were made is not known.
    """
    if not STARTED:
        raise SystemExit("A claim names the commit that it measured: this folder is not git's.")
    if not stored:
        changed = git("status", "--porcelain", "--", *MEASURED)
        today = datetime.datetime.now(datetime.UTC).date().isoformat()
        return Source(STARTED + (UNCOMMITTED if changed else ""), today, machine())
    files = git("ls-files", "--", *stored).splitlines()
    if not files:
        raise SystemExit(f"No file of the project is {', '.join(stored)}.")
    last = [git("log", "-1", "--format=%ct %h %cs", "--abbrev=9", "--", each) for each in files]
    _, commit, day = min(last, key=lambda line: int(line.split()[0])).split()
    changed = git("status", "--porcelain", "--", *stored)
    return Source(commit + (UNCOMMITTED if changed else ""), day, "")


def machine() -> str:
    """The machine of this process in words: system, processor, cores that may be used, Python."""
    name = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        name = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{platform.system()}, {name}, {cores} cores, Python {platform.python_version()}"


def path_of(version: str = gaitval.__version__) -> Path:
    """The file of a version."""
    return FOLDER / f"{version}.csv"


def read(path: Path) -> list[dict[str, str]]:
    """The rows of a file; none if it is not there."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write(by: str, made: Iterable[Claim], source: Source, path: Path) -> None:
    """Put what a measurement found into a file, in the place of what it had found before."""
    new = {
        each.what: {
            "what": each.what,
            "value": f"{each.value:.6g}",
            "unit": each.unit,
            "n": str(each.n),
            "version": path.stem,
            **source._asdict(),
            "by": by,
        }
        for each in made
    }
    kept = {row["what"]: row for row in read(path) if row["by"] != by or row["what"] in new}
    save(path, list((kept | new).values()))


def as_csv(rows: Sequence[dict[str, str]]) -> str:
    """The text of a file of rows."""
    return csv_text([COLUMNS, *([row[name] for name in COLUMNS] for row in rows)])


def save(path: Path, rows: Sequence[dict[str, str]]) -> None:
    """Write a file of rows, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}")
    part.write_text(as_csv(rows), encoding="utf-8")
    part.replace(path)
