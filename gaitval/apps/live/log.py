"""What was done to a walk and when, as a file from which it can be walked again.

A line of JSON for each doing, with the number of the action before which it was done. From time to
time, and at the end, a line has the hash of all states up to there, so that a walk from the file
can be told equal, bit for bit, or where it began to differ.
"""

import io
import json
import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, TextIO

from gaitval import __version__, file_gate
from gaitval.apps.live.doing import Clock, Doing, doing_of, values_of
from gaitval.apps.live.person import LivePerson
from gaitval.apps.live.walk import LiveWalk
from gaitval.artefacts import growing
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import parse_subject
from gaitval.errors import ArtefactError, RecordError

FORMAT: Final = "gaitval live 1"
LARGEST: Final = 64_000_000
"""Bytes of a log; a day of pushing has less."""
EVERY: Final = 1000
"""Actions between two hashes."""
LONGEST: Final = 100_000_000
"""Actions of a log: a week."""


@dataclass(frozen=True)
class Line:
    """What was done before the action `step` was made; None for a hash alone."""

    step: int
    doing: Doing | None
    digest: str | None


@dataclass(frozen=True)
class Log:
    """A log that was read.

    Attributes
    ----------
    subject : who walked.
    policy, references : hashes of what walked, and of what it followed.
    speed : m/s, at the start.
    devices : whole tables of what could be worn.
    lines : in the order of their steps.
    """

    subject: Subject
    policy: str
    references: tuple[str, ...]
    speed: float
    devices: tuple[dict[str, Any], ...]
    lines: tuple[Line, ...]

    @property
    def steps(self) -> int:
        """Actions in all."""
        return self.lines[-1].step if self.lines else 0


class LogWriter:
    """Writes the log of a `person` and their `walk`, of which nothing was walked yet, into a new
    file `path` while the walk goes on; a process that is killed leaves all but the last lines.
    """

    def __init__(self, path: Path, person: LivePerson, walk: LiveWalk) -> None:
        self.path = path
        self._file: TextIO = io.TextIOWrapper(growing(path, "new"), encoding="utf-8", newline="\n")
        self._write(
            {
                "format": FORMAT,
                "gaitval": __version__,
                "subject": person.subject.to_toml(),
                "policy": person.policy.key,
                "references": list(person.references),
                "speed": walk.speed,
                "devices": list(walk.devices),
            }
        )

    def did(self, step: int, doing: Doing) -> None:
        """`doing` was done before the action of this number, counted from 0."""
        self._write({"step": step, **values_of(doing)})

    def at(self, walk: LiveWalk) -> None:
        """The walk is here."""
        self._write({"step": walk.step, "digest": walk.digest})

    def _write(self, values: dict[str, Any]) -> None:
        try:
            self._file.write(json.dumps(values) + "\n")
            self._file.flush()
        except OSError as error:
            raise ArtefactError(
                f"{self.path}: cannot be written ({error.strerror}), so the walk has ended. What "
                "was done before is in it. Make space, and walk again."
            ) from None

    def close(self) -> None:
        """Nothing more is written."""
        with suppress(OSError):  # what could not be written was said
            self._file.close()


def read_log(path: Path) -> Log:
    """Read what a `LogWriter` wrote; its last line may be cut off. Raises RecordError."""
    text = file_gate.read_text(path, RecordError, largest=LARGEST)
    rows = text.split("\n")
    values = [_values(row, f"{path}, line {i}") for i, row in enumerate(rows[:-1], 1)]
    first = values[0] if values else {}
    if first.get("format") != FORMAT:
        raise RecordError(
            f"{path}: not the log of a live walk, whose first line says {FORMAT!r}. Give a file "
            "that `gaitval live` wrote, such as reports/S05-live/walks/*.jsonl."
        )
    kinds = {"subject": str, "policy": str, "references": list, "speed": float}
    for name, kind in kinds.items():
        if not isinstance(first.get(name), kind):
            raise RecordError(f"{path}, line 1: {name} is missing or no {kind.__name__}.")
    if not 0.0 < first["speed"] < math.inf:
        raise RecordError(f"{path}, line 1: speed is {first['speed']:g}; give one above 0 m/s.")
    devices = first.get("devices", [])  # logs of before have none
    if not isinstance(devices, list) or not all(isinstance(each, dict) for each in devices):
        raise RecordError(f"{path}, line 1: devices is no list of tables.")
    lines = [_line(each, f"{path}, line {i}") for i, each in enumerate(values[1:], 2)]
    for i, (before, after) in enumerate(pairwise(lines), 3):
        if after.step < before.step:
            raise RecordError(f"{path}, line {i}: step {after.step} comes after {before.step}.")
    return Log(
        subject=parse_subject(first["subject"], f"{path}, line 1"),
        policy=first["policy"],
        references=tuple(map(str, first["references"])),
        speed=first["speed"],
        devices=tuple(devices),
        lines=tuple(lines),
    )


def _values(row: str, where: str) -> dict[str, Any]:
    try:
        values = json.loads(row)
    except (ValueError, RecursionError):
        values = None
    if not isinstance(values, dict):
        raise RecordError(f"{where}: is no JSON object. The file was changed; give the original.")
    return values


def _line(values: dict[str, Any], where: str) -> Line:
    step = values.pop("step", None)
    if isinstance(step, bool) or not isinstance(step, int) or not 0 <= step <= LONGEST:
        raise RecordError(f"{where}: step is {step!r}; give a whole number, 0 to {LONGEST}.")
    digest = values.pop("digest", None)
    if digest is None:
        return Line(step, doing_of(values, where), None)
    if not isinstance(digest, str) or values:
        raise RecordError(f"{where}: a digest stands alone, as a text.")
    return Line(step, None, digest)


def check_person(log: Log, person: LivePerson, path: Path) -> None:
    """Refuse a person who is not the one of the log at `path`. Raises RecordError."""
    different = []
    if person.policy.key != log.policy:
        different.append("the policy")
    if person.references != log.references:
        different.append("the reference motions")
    if different:
        raise RecordError(
            f"{path}: was walked with other inputs: {' and '.join(different)} differ, so it cannot "
            "be walked again bit for bit. Use the gaitval and the machine that wrote it, and the "
            "same --policy."
        )


class Replay:
    """A log, done again action by action.

    Parameters
    ----------
    log : to walk again.
    walk : of the same person, of which nothing was walked yet.

    Attributes
    ----------
    checked : hashes of the log that were reached and equal.
    equal : step of the last of them; of what follows nothing is known.
    differs : step of the first hash that was not; None so far.
    """

    def __init__(self, log: Log, walk: LiveWalk) -> None:
        self._lines = list(reversed(log.lines))
        self._walk = walk
        self.checked, self.equal = 0, 0
        self.differs: int | None = None

    @property
    def over(self) -> bool:
        """Whether all of the log was done."""
        return not self._lines

    def due(self) -> Iterator[Doing]:
        """What is done before the next action; the clock is the caller's to set."""
        walk = self._walk
        while self._lines and self._lines[-1].step <= walk.step:
            line = self._lines.pop()
            if line.digest is None:
                assert line.doing is not None
                yield line.doing
            elif line.digest == walk.digest:
                self.checked += 1
                self.equal = line.step
            elif self.differs is None:
                self.differs = line.step


def walk_again(log: Log, walk: LiveWalk) -> Replay:
    """Walk all of a log as fast as possible; what is equal and what is not."""
    replay = Replay(log, walk)
    while True:
        for doing in replay.due():
            if not isinstance(doing, Clock):
                walk.do(doing)
        if replay.over:
            return replay
        walk.act()
