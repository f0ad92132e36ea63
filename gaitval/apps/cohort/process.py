"""Studies, each in a process of its own, for `task`, which starts this one by `task.BEGIN`.

It reads orders from its standard input, a line each, and forks for each a process that does the
study, says what it has to say in the study's log, and writes what became of it to the standard
output, as a line of JSON. When that process has ended, a line `=` and its exit code follows. All
that studies load and compile is loaded before the first fork, which saves each a tenth of its time.

Where a process must not fork, it does one study itself, and ends. All end as soon as the worker has
gone: by `lifeline`, and elsewhere than on Linux when the standard input ends.
"""

import contextlib
import gc
import importlib
import json
import os
import sys
import threading
import traceback
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NoReturn

from gaitval.apps.cohort.answers import StudySummary
from gaitval.apps.cohort.identity import function_of
from gaitval.apps.cohort.store import SUMMARY, Store, alone
from gaitval.apps.cohort.table import Study
from gaitval.artefacts import growing, write_json
from gaitval.errors import GaitvalError
from gaitval.memory import give_back_now, seldom_search, share_heap
from gaitval.study.stage import Observer

FORKS: Final = sys.platform == "linux"
"""Elsewhere libraries of the system may have threads, or there is no fork."""
PROGRESS_SECONDS: Final = 30.0
"""Between two lines of progress in a log."""


class StudyLog(Observer):
    """Prints what a study says, a line with its time."""

    def __init__(self) -> None:
        self._stage, self._last = "", datetime.min.replace(tzinfo=UTC)

    def say(self, message: str) -> None:
        """A line of the log."""
        now = datetime.now(UTC).isoformat(timespec="seconds")
        print(f"{now} {message}", flush=True)

    def skipped(self, stage: str) -> None:
        """The stage is up to date."""
        self.say(f"{stage}: up to date")

    def started(self, stage: str, reason: str) -> None:
        """The stage begins."""
        self._stage = stage
        self.say(f"{stage}: starts ({reason})")

    def progress(self, values: Mapping[str, float]) -> None:
        """A line now and then."""
        now = datetime.now(UTC)
        if (now - self._last).total_seconds() >= PROGRESS_SECONDS:
            self._last = now
            message = ", ".join(f"{name} {value:g}" for name, value in values.items())
            self.say(f"{self._stage}: {message}")

    def finished(self, stage: str, seconds: float) -> None:
        """The stage is done."""
        self.say(f"{stage}: done in {seconds:.1f} s")


def end_with_worker() -> None:
    """End this process when its standard input ends, which the worker holds open, and in which it
    writes nothing while a study runs.
    """

    def watch() -> None:
        while os.read(sys.stdin.fileno(), 1024):
            pass
        # `sys.exit` would end this thread only.
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def perform(order: Mapping[str, Any], log: StudyLog) -> dict[str, Any]:
    """Do an `order` and write to its `log`; what became of it: `status` finished, refused or fault,
    and the `reason`.
    """
    store, study = Store(order["store"]), Study.model_validate(order["study"])
    folder = Path(order["folder"])
    try:
        with alone(folder):
            summary = function_of(order["function"])(study, folder, order["threads"], log)
            StudySummary.model_validate(summary)  # or the tables could not take it
            write_json(folder / SUMMARY, summary)
            store.keep(study.name, folder)
    except GaitvalError as error:
        log.say(f"refused: {error}")
        return {"status": "refused", "reason": " ".join(str(error).split())}
    except Exception as error:
        traceback.print_exc()
        return {"status": "fault", "reason": f"{type(error).__name__}: {error}"}
    return {"status": "finished", "reason": ""}


def peak_memory() -> int:
    """Bytes of this process at its largest; 0 where the system does not say.

    On Linux not from `getrusage`, whose figure starts with that of the process that started this
    one.
    """
    if sys.platform == "linux":
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    if sys.platform == "darwin":
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return 0


def main() -> None:
    """Entry point."""
    share_heap()
    seldom_search()
    answers = os.dup(1)
    while order := _line():
        _write_to(Path(order["log"]))
        make_ready(order["function"])
        child = os.fork() if FORKS else 0
        if not child:
            _do(order, answers)
        _, status = os.waitpid(child, 0)
        with contextlib.suppress(BrokenPipeError):  # the worker has gone
            os.write(answers, b"\n=%d\n" % os.waitstatus_to_exitcode(status))


def make_ready(function: str) -> None:
    """Load what studies by a `function` need, which its module's `ready` knows, if it has one."""
    ready = getattr(importlib.import_module(function.partition(":")[0]), "ready", None)
    if ready is not None:
        ready()
    gc.collect()
    give_back_now()  # or each study would write into what is free here, and hold it once more
    # A search would write to every page that is shared with this process.
    gc.freeze()


def _do(order: Mapping[str, Any], answers: int) -> NoReturn:
    """Do a study, say what became of it in `answers`, and end this process."""
    end_with_worker()
    found = perform(order, StudyLog())
    with contextlib.suppress(BrokenPipeError):
        os.write(answers, json.dumps({**found, "peak_memory": peak_memory()}).encode() + b"\n")
    # Threads of libraries are not waited for: what the study wrote is written.
    sys.stdout.flush()
    os._exit(0)


def _write_to(log: Path) -> None:
    """Append what is written from now on to a study's log."""
    sys.stdout.flush()
    with growing(log, "append") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)


def _line() -> dict[str, Any]:
    """The next order of the standard input, without reading on; empty if there is none."""
    found = b""
    while not found.endswith(b"\n"):
        # Byte by byte: a buffer would take what `end_with_worker` waits for.
        part = os.read(sys.stdin.fileno(), 1)
        if not part:
            return {}
        found += part
    return dict(json.loads(found))
