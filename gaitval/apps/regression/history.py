"""The figures of every check in one file, so that the commit can be found at which one changed.

The file is a SQLite database with two tables, `checks` and `figures`. Several processes may add to
it at the same time: each adds a check with all its figures, or nothing. A file that is not such a
database, or has other tables, triggers or values in it, is refused.
"""

import math
import os
import platform
import re
import sqlite3
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import Field

from gaitval import file_gate
from gaitval.apps.regression.regression import Row
from gaitval.artefacts import read_json, writing
from gaitval.build_info import git
from gaitval.errors import ArtefactError
from gaitval.metrics.tolerances import load_registry
from gaitval.metrics.typed import Count, OpenResult, Size

_CheckKind = Literal["check", "benchmark"]

APPLICATION: Final = 0x67614974
"""Of the file, so that it is known whose it is ("gaIt"; PRAGMA application_id)."""
VERSION: Final = 1
WAIT: Final = 60.0
"""s that a process waits for another one to finish its check."""
BENCHMARK: Final = "benchmark"
"""The measure of all times of pytest-benchmark; their targets are the tests."""

OUTPUTS: Final = (".html", ".pdf", ".csv")
"""Endings of what `gaitval history` writes beside the file, by its name."""

_COMMIT: Final = re.compile(r"(?P<revision>[0-9a-f]{40,64}) (?P<seconds>-?\d{1,20})")

_TABLES: Final = {
    "checks": """CREATE TABLE checks (
    id INTEGER PRIMARY KEY,
    kind TEXT NOT NULL,
    revision TEXT NOT NULL,
    revised TEXT,
    time TEXT NOT NULL,
    machine TEXT NOT NULL,
    subject TEXT NOT NULL,
    UNIQUE (kind, revision, time, machine, subject)
) STRICT""",
    "figures": """CREATE TABLE figures (
    check_id INTEGER NOT NULL REFERENCES checks (id),
    measure TEXT NOT NULL,
    target TEXT NOT NULL,
    unit TEXT NOT NULL,
    value REAL,
    stored REAL,
    margin REAL,
    better TEXT NOT NULL,
    UNIQUE (check_id, measure, target)
) STRICT""",
}


@dataclass(frozen=True)
class CheckedFigure:
    """One figure of a check.

    Attributes
    ----------
    measure, target, unit : as in `tolerances.Measure`; of a benchmark `BENCHMARK`, the test, "s".
    value : None where it could not be measured.
    stored : of the baseline; None without one.
    margin : how much worse it may be; None of a benchmark.
    better : "lower" or "higher".
    """

    measure: str
    target: str
    unit: str
    value: float | None
    stored: float | None
    margin: float | None
    better: str


@dataclass(frozen=True)
class Check:
    """What was checked when and where, with its figures.

    Attributes
    ----------
    revision : the commit, with `+` where the tree had changes; "unknown" without one.
    revised : when that commit was made, ISO 8601 in UTC; None if that is not known.
    time : of the check, ISO 8601 in UTC.
    machine : what it ran on.
    subject : whose walk; of benchmarks nothing.
    """

    kind: _CheckKind
    revision: str
    revised: str | None
    time: str
    machine: str
    subject: str
    figures: tuple[CheckedFigure, ...]


UNKNOWN: Final = "unknown"
"""`Check.revision` outside a git repository."""
Commit = tuple[str, str | None]
"""`Check.revision` and `Check.revised`."""


def of_rows(rows: Sequence[Row], subject: str, commit: Commit | None = None) -> Check:
    """A check of `subject` at this moment, on this machine, of a `commit` (by default that which is
    checked out here), with the `rows` of `regression.compare`.
    """
    better = {margin.measure: margin.better for margin in load_registry().margin}
    revision, revised = commit or current_commit()
    return Check(
        kind="check",
        revision=revision,
        revised=revised,
        time=datetime.now(UTC).isoformat(timespec="microseconds"),
        machine=this_machine(),
        subject=subject,
        figures=tuple(
            CheckedFigure(
                measure=row.measure,
                target=row.target,
                unit=row.unit,
                value=row.current,
                stored=row.baseline,
                margin=row.margin,
                better=better[row.measure],
            )
            for row in rows
        ),
    )


def current_commit() -> Commit:
    """The commit that is checked out in the current folder, and its time, None if that cannot be
    read; "unknown" outside a git repository, except where a CI server says it (GITHUB_SHA,
    CI_COMMIT_SHA).
    """
    commit = os.environ.get("GITHUB_SHA") or os.environ.get("CI_COMMIT_SHA")
    # a user's settings may show signatures, whose check prints lines of its own
    found = _git("show", "--no-show-signature", "-s", "--format=%H %ct", "HEAD")
    answer = _COMMIT.fullmatch(found.splitlines()[-1]) if found else None
    if answer is None:
        return commit or UNKNOWN, None
    changed = (
        "+"
        if _git("status", "--porcelain", "--untracked-files=no", "--ignore-submodules=all")
        else ""
    )
    revised = None
    with suppress(ValueError, OverflowError, OSError):  # beyond the year 9999
        revised = datetime.fromtimestamp(int(answer["seconds"]), UTC).isoformat()
    return f"{answer['revision']}{changed}", revised


def _git(*arguments: str) -> str | None:
    """What git prints; None where it fails or is missing."""
    with suppress(OSError, subprocess.SubprocessError):
        return git(None, *arguments)
    return None


def this_machine() -> str:
    """System, processor and number of processors: what rounding and times depend on."""
    name = platform.processor() or platform.machine()
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                name = line.partition(":")[2].strip()
                break
    return f"{platform.system()} {platform.machine()}, {name} x {os.cpu_count() or 1}"


class _Commit(OpenResult):
    """`commit_info` of pytest-benchmark."""

    id: str | None = None
    time: str | None = None
    dirty: bool | None = None


class _Times(OpenResult):
    """Statistics of one benchmark, s."""

    median: Size
    rounds: Count


class _Benchmark(OpenResult):
    """One benchmark."""

    fullname: str = Field(min_length=1)
    stats: _Times


class _Machine(OpenResult):
    """`machine_info`; only what names it."""

    system: str = ""
    machine: str = ""
    node: str = ""
    cpu: dict[str, Any] = Field(default_factory=dict)


class _Benchmarks(OpenResult):
    """The file that `pytest --benchmark-json` writes."""

    machine_info: _Machine
    commit_info: _Commit
    benchmarks: list[_Benchmark]
    datetime: str


def read_benchmarks(path: Path) -> Check:
    """The median times of a JSON file of pytest-benchmark, `path`. Raises ArtefactError if it is
    missing, damaged or of another kind.
    """
    fix = "give the file that `pytest --benchmark-json FILE` wrote"
    found = _Benchmarks.read(
        read_json(path, fix[0].upper() + fix[1:]), str(path), file="pytest-benchmark", fix=fix
    )
    commit, about = found.commit_info, found.machine_info
    brand = about.cpu.get("brand_raw") or about.cpu.get("brand") or ""
    cores = about.cpu.get("count") or "?"
    names = [each.fullname for each in found.benchmarks]
    if not names or len(names) != len(set(names)):
        raise ArtefactError(
            f"{path}: {'has no benchmark' if not names else 'has one benchmark twice'}, so there "
            f"is nothing to keep. Run pytest with --benchmark-enable and {fix}."
        )
    return Check(
        kind="benchmark",
        revision=f"{commit.id or UNKNOWN}{'+' if commit.dirty else ''}",
        revised=_utc(commit.time, path) if commit.time else None,
        time=_utc(found.datetime, path),
        machine=f"{about.system} {about.machine}, {brand} x {cores}",
        subject="",
        figures=tuple(
            CheckedFigure(BENCHMARK, each.fullname, "s", each.stats.median, None, None, "lower")
            for each in found.benchmarks
        ),
    )


def _utc(text: str, path: Path) -> str:
    moment = _moment(text)
    if moment is None:
        raise ArtefactError(
            f"{path}: {text!r:.60} is not a time (ISO 8601), so the order of its figures is not "
            "known. Write the file again with `pytest --benchmark-json FILE`."
        )
    return moment.isoformat()


def _moment(text: str) -> datetime | None:
    """A time as it is written in ISO 8601, in UTC unless it says otherwise; None if it is none."""
    try:
        found = datetime.fromisoformat(text)
        return (found if found.tzinfo else found.replace(tzinfo=UTC)).astimezone(UTC)
    except (ValueError, OverflowError):
        return None


def add(path: Path, check: Check) -> bool:
    """Add a `check` to the history `path`, which is made if it is not there; False if the same
    check is in it already.

    Raises ArtefactError if it is no history, damaged, or cannot be written.
    """
    with _opened(path, write=True) as database:
        found = database.execute(
            "INSERT OR IGNORE INTO checks (kind, revision, revised, time, machine, subject) "
            "VALUES (?, ?, ?, ?, ?, ?)",
            (
                *(check.kind, check.revision, check.revised),
                *(check.time, check.machine, check.subject),
            ),
        )
        if found.rowcount == 0:
            return False
        database.executemany(
            "INSERT INTO figures VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            [
                (
                    *(found.lastrowid, each.measure, each.target, each.unit),
                    *(each.value, each.stored, each.margin, each.better),
                )
                for each in check.figures
            ],
        )
    return True


def prepare(path: Path) -> None:
    """Refuse a file `path` that no check can be added to; make it if it is not there."""
    if path.suffix.lower() in OUTPUTS:
        raise ArtefactError(
            f"{path}: `gaitval history` would write its page over a history that ends in "
            f"{path.suffix}. Name it accuracy.db."
        )
    with _opened(path, write=True):
        pass


def check_outputs(path: Path, folder: Path) -> None:
    """Refuse to write the page of the history `path` into `folder` over the history itself. Raises
    ArtefactError.
    """
    for ending in OUTPUTS:
        output = folder / f"{path.stem}{ending}"
        same = path.exists() and output.exists() and path.samefile(output)
        # neither file nor folder need be there yet
        if same or path.resolve() == output.resolve():
            raise ArtefactError(
                f"{path}: the page would be written over the history itself, as {output}. Rename "
                "the file to accuracy.db, or give another folder with --out."
            )


def keep(path: Path, rows: Sequence[Row], subject: str, *, commit: Commit | None = None) -> None:
    """Add a check of `subject` at this moment to the history `path`, as `gaitval check --history`
    does, with the `rows` of `regression.compare` and the `commit` (`of_rows`). Raises ArtefactError
    as `add` does.
    """
    add(path, of_rows(rows, subject, commit))


def read(path: Path) -> list[Check]:
    """The checks of the history `path`, in the order of their commits; those of one commit, and
    those whose commit's time is not known, in the order in which they were made.

    Raises ArtefactError if there is no such file, it is no history, or it is damaged.
    """
    if not path.is_file():
        raise ArtefactError(
            f"{path}: {'is not a file' if path.exists() else 'no such file'}, so there is no "
            f"history to show. `gaitval check --history {path}` begins one."
        )
    with _opened(path, write=False) as database:
        figures: dict[int, list[CheckedFigure]] = {}
        for number, *values in database.execute("SELECT * FROM figures ORDER BY rowid"):
            figures.setdefault(number, []).append(_figure(values, path))
        checks = [
            _check(values, tuple(figures.pop(number, ())), path)
            for number, *values in database.execute("SELECT * FROM checks ORDER BY id")
        ]
    if figures:
        raise ArtefactError(f"{path}: has figures of no check. {_FIX}")
    return sorted(checks, key=lambda each: (_moment(each.revised or each.time), each.time))


_FIX: Final = (
    "Restore it from a copy, or move it away: the next `gaitval check --history` begins a new one."
)


@contextmanager
def _opened(path: Path, *, write: bool) -> Iterator[sqlite3.Connection]:
    """A history that has been looked over; what is written is written whole or not at all."""
    if path.exists():
        file_gate.passed(path, ArtefactError, largest=file_gate.BINARY)
    try:
        with writing(path):
            if write:
                path.parent.mkdir(parents=True, exist_ok=True)
            mode = "rwc" if write else "ro"
            connection = sqlite3.connect(
                f"{path.resolve().as_uri()}?mode={mode}",
                uri=True, timeout=WAIT, isolation_level=None,
            )  # fmt: skip
            with closing(connection) as database:
                # The file may come from outside: its schema may call no unsafe function.
                database.execute("PRAGMA trusted_schema = OFF")
                # The lock for writing at once: two that read first and then write would block each
                # other.
                database.execute("BEGIN IMMEDIATE" if write else "BEGIN")
                _look_over(database, path, write=write)
                yield database
                database.execute("COMMIT")
    except sqlite3.OperationalError as error:
        raise ArtefactError(
            f"{path}: cannot be used ({error}). Another process may hold it for longer than "
            f"{WAIT:g} s, or the disk or its permissions are against it: try again, or give "
            "another file."
        ) from None
    except (sqlite3.Error, UnicodeDecodeError) as error:
        raise ArtefactError(f"{path}: is no history, or is damaged ({error}). {_FIX}") from None


def _look_over(database: sqlite3.Connection, path: Path, *, write: bool) -> None:
    """Refuse a database that is not ours and whole; make the tables of a new one."""
    known = {
        name: sql for name, sql in database.execute("SELECT name, sql FROM sqlite_master") if sql
    }
    if not known and write and database.execute("PRAGMA page_count").fetchone()[0] <= 1:
        for sql in _TABLES.values():
            database.execute(sql)
        database.execute(f"PRAGMA application_id = {APPLICATION}")
        database.execute(f"PRAGMA user_version = {VERSION}")
        return
    whose, version = (
        database.execute(f"PRAGMA {name}").fetchone()[0]
        for name in ("application_id", "user_version")
    )
    if whose != APPLICATION or (version == VERSION and known != _TABLES):
        raise ArtefactError(
            f"{path}: is a database of another program, or its tables were changed. {_FIX}"
        )
    if version != VERSION:
        raise ArtefactError(
            f"{path}: is a history of version {version}, but this gaitval reads version {VERSION}. "
            "Use the gaitval that wrote it, or begin another file."
        )
    answer = database.execute("PRAGMA quick_check(1)").fetchone()[0]
    if answer != "ok":
        raise ArtefactError(f"{path}: is damaged ({str(answer)[:80]}). {_FIX}")


def _figure(values: Sequence[Any], path: Path) -> CheckedFigure:
    found = CheckedFigure(*values)
    texts = (found.measure, found.target, found.unit)
    numbers = (found.value, found.stored, found.margin)
    if (
        found.better not in ("lower", "higher")
        or not all(isinstance(each, str) for each in texts)
        or not all(each is None or _finite(each) for each in numbers)
    ):
        raise ArtefactError(
            f"{path}: {found.measure!r:.40} of {found.target!r:.60} is not a figure. {_FIX}"
        )
    return found


def _finite(value: object) -> bool:
    return isinstance(value, float) and math.isfinite(value)


def _check(values: Sequence[Any], figures: tuple[CheckedFigure, ...], path: Path) -> Check:
    kind, revision, revised, time, machine, subject = values
    found = Check(kind, revision, revised, time, machine, subject, figures)
    texts = (found.kind, found.revision, found.time, found.machine, found.subject)
    times = (found.time, *(() if found.revised is None else (found.revised,)))
    if (
        found.kind not in ("check", "benchmark")
        or not all(isinstance(each, str) for each in (*texts, *times))
        or any(_moment(each) is None for each in times)
    ):
        raise ArtefactError(
            f"{path}: its check of {found.revision!r:.60} at {found.time!r:.40} is none. {_FIX}"
        )
    return found


Key = tuple[str, str, str, str]
"""Subject, measure, target and machine of a series."""


def series_of(checks: Sequence[Check]) -> Mapping[Key, list[tuple[Check, CheckedFigure]]]:
    """The figures by subject, measure, target and machine, in the order of `checks`.

    Of accuracy the machine is empty: figures of all machines belong together, because margins are
    made for different rounding. Times of different machines cannot be compared.
    """
    found: dict[Key, list[tuple[Check, CheckedFigure]]] = {}
    for check in checks:
        machine = check.machine if check.kind == "benchmark" else ""
        for figure in check.figures:
            key = (check.subject, figure.measure, figure.target, machine)
            found.setdefault(key, []).append((check, figure))
    return found
