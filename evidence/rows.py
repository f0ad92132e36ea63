"""Rows of `reports/evidence/TOPIC.csv`: what was required of the project, and what was measured.

A row names the command that writes it. A row with the same `what` is replaced, so any command can
be run again on its own. A row carries the commit whose code was measured, and the day;
`evidence/stale.py` finds rows whose code has changed since.
"""

import csv
import datetime
import io
import os
import re
import subprocess
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, Literal

from .registry import source_of
from .sources import ROOT, dependence

FOLDER = ROOT / "reports" / "evidence"
MEASURED: Final = (
    *(
        "gaitval",
        "extras",
        "models",
        "evidence",
        "experiments",
        "tests/robustness",
        "docs/build",
        "scripts",
    ),
    ":!gaitval/reporting/evidence.toml",
)
"""Folders whose content is measured, but for the file that is made of evidence; a row is marked
where they are not as in its commit."""
UNCOMMITTED: Final = "+"
"""After a commit: the files measured were not, or not only, those of the commit."""
COLUMNS: Final = (
    *("what", "value", "unit", "relation", "goal", "must", "n", "command"),
    *("commit", "date"),
)


@dataclass(frozen=True)
class Row:
    """One figure.

    Attributes
    ----------
    what : the thing measured, unique in its file.
    value : in `unit`.
    relation : how the value is compared with `goal` (wanted) and `must` (required).
    n : number of cases that the value was measured on.
    """

    what: str
    value: float
    unit: str
    relation: Literal["<=", ">="]
    goal: float
    must: float
    n: int

    @property
    def kept(self) -> bool:
        """Whether the value is as it must be."""
        return self.value <= self.must if self.relation == "<=" else self.value >= self.must


def none_may(what: str, value: float, unit: str, n: int) -> Row:
    """A row of things of which there may be none."""
    return Row(what, value, unit, "<=", 0, 0, n)


def pytest_counts(line: str) -> tuple[int, int]:
    """Failures (errors among them) and passes in the last line that pytest printed."""
    counts = {word: int(count) for count, word in re.findall(r"(\d+) (\w+)", line)}
    failed = counts.get("failed", 0) + counts.get("error", 0) + counts.get("errors", 0)
    return failed, counts.get("passed", 0)


def git(*arguments: str) -> str:
    """What git prints in the project's folder, without the last line's end."""
    done = subprocess.run(
        ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True
    )  # fmt: skip
    return done.stdout.rstrip("\n")


def _started() -> str:
    """Commit of the checkout; "" where there is no git."""
    try:
        return git("rev-parse", "--short=9", "HEAD")
    except (OSError, subprocess.CalledProcessError):
        return ""


STARTED: Final = _started()
"""The commit at which this process started: what a measurement of hours has measured, whatever is
committed before it ends."""


def measured_commit(results: Sequence[str] = ()) -> tuple[str, str]:
    """Commit and day of a measurement that this process has made, or read from stored results.

    Parameters
    ----------
    results : files that hold what was measured, as git's path patterns; none if it was measured
        here.

    Returns
    -------
    The short hash, with `UNCOMMITTED` where the measured files are not those of the commit, and the
    day, as 2026-11-23. Of stored results, the oldest of the commits that last changed each of them.
    """
    if not STARTED:
        raise SystemExit("Evidence names the commit that it measured: this folder is not git's.")
    if results:
        files = git("ls-files", "--", *results).splitlines()
        if not files:
            raise SystemExit(f"No file of the project is {', '.join(results)}.")
        lines = [git("log", "-1", "--format=%ct %h %cs", "--abbrev=9", "--", f) for f in files]
        _, commit, day = min(lines, key=lambda line: int(line.split()[0])).split()
        changed = git("status", "--porcelain", "--", *results)
    else:
        commit, day = STARTED, datetime.datetime.now(datetime.UTC).date().isoformat()
        changed = git("diff", "--name-only", STARTED, "--", *MEASURED)
        changed += git("ls-files", "--others", "--exclude-standard", "--", *MEASURED)
    return commit + (UNCOMMITTED if changed else ""), day


def portable(command: str) -> str:
    """A command with PATH for each absolute path in it, which is only of the machine it ran on."""
    return re.sub(r"(?<=[\s=])/\S+", "PATH", command)


def read(path: Path) -> list[dict[str, str]]:
    """The rows of a file."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write(topic: str, rows: list[Row], command: str) -> Path:
    """Add rows to a topic's file, or replace those of the same `what`; see `measured_commit`.

    A row of the same name among those of the past (`evidence/stale.py`) goes. `command` is the line
    that made the rows.
    """
    path, past = FOLDER / f"{topic}.csv", FOLDER / "past" / f"{topic}.csv"
    kept = {row["what"]: row for row in read(path)} if path.is_file() else {}
    source = source_of(command)
    for row in rows:
        declared = dependence(source, row.what) if source else None
        if declared is None:
            raise SystemExit(
                f"{row.what!r}: say in MEASURES of the file that its command runs "
                f"({command}) what it depends on; see evidence/stale.py."
            )
        commit, day = measured_commit(declared.results)
        kept[row.what] = {
            **{
                name: f"{value:.6g}" if isinstance(value, float) else str(value)
                for name, value in asdict(row).items()
            },
            "command": portable(command),
            "commit": commit,
            "date": day,
        }
    if past.is_file():
        save(past, [each for each in read(past) if each["what"] not in kept])
    return save(path, list(kept.values()))


def save(path: Path, rows: list[dict[str, str]]) -> Path:
    """Write a file of rows; one without rows goes."""
    if not rows:
        path.unlink(missing_ok=True)
        return path
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    unfinished.write_text(text.getvalue(), encoding="utf-8")
    unfinished.replace(path)
    return path
