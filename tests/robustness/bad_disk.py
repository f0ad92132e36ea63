"""Every command that writes, on a disk that fails at its n-th operation; and stopped for minutes.

    python tests/robustness/bad_disk.py --cases 100 --seed 0 --log FILE      # goes on from its log
    python tests/robustness/bad_disk.py --stops 13 --minutes 3 --log FILE    # as a suspended laptop

The jobs are those of `kills.py`. A library that is loaded before the program (`bad_disk.c`, built
by the C compiler `cc`) lets one operation below the job's folders fail, of all that it makes: the
disk is full or has become read-only from then on, or one write, one read or the closing of a file
ends with an input/output error or a stale handle. The command must then end with exit code 2 and a
message (or go on, where it can do without), never with a traceback; what is in the folder must be
of use to the same command, started again on a good disk: every file must then be equal to that of
a run without a fault, and nothing partial may be left.

A stop halts all processes of a command (SIGSTOP) at a random part of its processor time, as when a
lid is closed, and lets them go on some minutes later.
"""

import argparse
import errno
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Final

import kills

SOURCE: Final = Path(__file__).with_suffix(".c")
FAULTS: Final = {
    "full": (errno.ENOSPC, "w", True),
    "read-only": (errno.EROFS, "wd", True),
    "write error": (errno.EIO, "w", False),
    "read error": (errno.EIO, "r", False),
    "stale handle": (errno.ESTALE, "wr", False),
}
"""Error number, kinds of operations (see `bad_disk.c`), and whether the fault lasts."""
WEIGHTS: Final = {**kills.WRITING, "subject": 2}
"""How often each command is tried in a turn."""
PAUSE: Final = 2.0
"""s until the next start: what is younger than one may still be somebody's, and is not removed."""
Json = dict[str, Any]


class Disk:
    """A disk that fails.

    Parameters
    ----------
    library : `bad_disk.c`, built by `built`.
    folder : below which it fails.
    counter : file with the number of operations.
    """

    def __init__(self, library: Path, folder: Path, counter: Path) -> None:
        self._counter = counter
        self._always = {
            "LD_PRELOAD": str(library),
            "BAD_DISK_FOLDER": str(folder.resolve()),
            "BAD_DISK_COUNT": str(counter),
        }

    def environment(self, fault: str, number: int) -> dict[str, str]:
        """Of a program whose operation of this `number` fails; none does if it is 0."""
        self._counter.write_bytes(bytes(4))
        code, kinds, lasts = FAULTS[fault]
        messages = {"KINDS": kinds, "AT": number, "ERROR": code, "LASTS": int(lasts)}
        return self._always | {f"BAD_DISK_{key}": str(value) for key, value in messages.items()}

    def operations(self) -> int:
        """Of the program that was started last."""
        return int.from_bytes(self._counter.read_bytes(), sys.byteorder)


def built(folder: Path) -> Path:
    """The library, built in `folder`."""
    library = folder / "bad_disk.so"
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-O1", "-o", str(library), str(SOURCE), "-ldl"], check=True
    )
    return library


def failed(job: kills.Job, disk: Disk, fault: str, number: int, temporary: Path) -> Json:
    """What becomes of a job whose operation of this number fails, and of the next start."""
    job.prepared()
    process = job.start(temporary, disk.environment(fault, number))
    message, _ = process.communicate(timeout=kills.SECONDS)
    left = kills.still_there(process.pid)
    time.sleep(PAUSE)
    again = job.start(temporary)
    second, _ = again.communicate(timeout=kills.SECONDS)
    fine = (0, job.verdict)
    return {
        "returned": process.returncode,
        "traceback": "Traceback (most recent call last)" in message,
        "told": kills.masked(message, temporary)[-600:] if process.returncode not in fine else "",
        "again": again.returncode,
        "told_again": kills.masked(second, temporary)[-500:] if again.returncode else "",
        "processes": [*left, *kills.still_there(again.pid)],
    }


def survived(case: Json) -> bool:
    """Whether a command said what was wrong, and its next start ended with the same files."""
    message = case["returned"] in (0, 2) and not case["traceback"]
    return message and case["again"] == 0 and not (case["differ"] or case["processes"])


class Trial:
    """Jobs on a bad disk, one after the other.

    Parameters
    ----------
    made : the jobs, by name.
    temporary : folder for their temporary files, beside that of all that they read and write.
    own : folder for the library and the number of operations, on a good disk.
    """

    def __init__(self, made: dict[str, kills.Job], temporary: Path, own: Path) -> None:
        self._killing = kills.Killing(made, temporary)
        self._temporary = temporary
        self._disk = Disk(built(own), temporary.parent, own / "operations")
        self._operations: dict[tuple[str, str], int] = {}

    def case(self, name: str, number: int, seed: int) -> Json:
        """A fault at an operation that follows from seed and number."""
        job = self._killing.jobs[name]
        self._killing.usual(name)
        draw = random.Random(f"{seed} {number}")
        fault = draw.choice(list(FAULTS))
        if (name, fault) not in self._operations:
            job.prepared()
            process = job.start(self._temporary, self._disk.environment(fault, 0))
            process.communicate(timeout=kills.SECONDS)
            self._operations[name, fault] = self._disk.operations()
        operations = self._operations[name, fault]
        at = draw.randint(1, max(operations, 1))
        found = failed(job, self._disk, fault, at, self._temporary)
        about = {"job": name, "fault": fault, "operation": at, "of": operations, "seed": seed}
        return about | found | self._killing.spoilt(name)

    def stopped(self, name: str, number: int, seed: int, seconds: float) -> Json | None:
        """All processes of a job halted for `seconds` of the clock; None if it ended before."""
        job = self._killing.jobs[name]
        usual, _, _ = self._killing.usual(name)
        share = random.Random(f"stop {seed} {number}").uniform(0.1, 0.9)
        job.prepared()
        process = job.start(self._temporary)
        while process.poll() is None and kills.processor_time(process.pid) < share * usual:
            time.sleep(0.05)
        if process.poll() is not None:
            return None
        for sent in (signal.SIGSTOP, signal.SIGCONT):
            for each in kills.processes(process.pid):
                os.kill(each, sent)
            if sent == signal.SIGSTOP:
                time.sleep(seconds)
        message, _ = process.communicate(timeout=kills.SECONDS)
        fine = process.returncode in (0, job.verdict)
        return {
            "job": name,
            "fault": "stopped",
            "seconds": seconds,
            "share": round(share, 3),
            "seed": seed,
            "returned": 0 if fine else process.returncode,
            "traceback": "Traceback (most recent call last)" in message,
            "told": "" if fine else kills.masked(message, self._temporary)[-600:],
            "again": 0,
            "processes": kills.still_there(process.pid),
        } | self._killing.spoilt(name)


def all_cases(
    cases: int,
    stops: int,
    seconds: float,
    seed: int,
    log: Path,
    names: list[str],
    study: Path | None,
) -> None:
    """Faults, then stops, until there are so many of each in the log."""
    order = [name for name in kills.turn(WEIGHTS) if name in names]
    with kills.workplace() as (work, temporary, made), tempfile.TemporaryDirectory() as own:
        trial = Trial(made | kills.further_jobs(work), temporary, Path(own))
        kills.finished_study(work, temporary, study)
        kills.emptied(temporary)
        done = kills.logged(log)
        for number in range(sum(each["fault"] != "stopped" for each in done), cases):
            _add(log, trial.case(order[number % len(order)], number, seed))
        few = [*dict.fromkeys(order)]
        for number in range(sum(each["fault"] == "stopped" for each in done), stops):
            name, found, tries = few[number % len(few)], None, 0
            while found is None:
                found = trial.stopped(name, number + 1000 * tries, seed, seconds)
                tries += 1
            _add(log, found)


def _add(log: Path, found: Json) -> None:
    message = json.dumps(found | {"survived": survived(found)})
    with log.open("a", encoding="utf-8") as file:
        file.write(message + "\n")
    print(message, flush=True)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=0, help="faults of the disk")
    parser.add_argument("--stops", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=3.0, help="of each stop")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--log", type=Path, required=True, help="a line for each; goes on from it")
    parser.add_argument("--jobs", nargs="+", choices=sorted(WEIGHTS), default=list(WEIGHTS))
    parser.add_argument(
        "--study", type=Path, metavar="FOLDER", help="a finished quick study of S05"
    )
    given = parser.parse_args()
    all_cases(
        given.cases, given.stops, 60 * given.minutes, given.seed, given.log, given.jobs, given.study
    )


if __name__ == "__main__":
    main()
