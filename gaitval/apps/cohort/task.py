"""What a worker does for a study: start its process, watch its memory, say what became of it.

A study has a process of its own, so that its memory is given back and measured, its threads are
set before any library starts them, and a crash in it ends nothing else. It is forked from one that
has loaded what studies need (`process`), of which a worker has one.
"""

import atexit
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, Final

from gaitval.apps.cohort.store import LOG, Store
from gaitval.errors import ArtefactError

THREADS: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""Variables that say how many threads BLAS, torch (OMP, MKL) and numba may use."""
SAFE: Final = "PYTHONSAFEPATH"
"""Variable that keeps a Python from modules in the folder that it is started in, whose others may
be: a module `pickle` there would run."""
TRIM: Final = "MALLOC_TRIM_THRESHOLD_"
"""Variable by which Dask lets its workers give back memory in small pieces; it would cost a study
two seconds of the system's time."""
BEGIN: Final = (
    "import sys; from gaitval.apps.cohort.lifeline import hold; hold(int(sys.argv[1])); "
    "from gaitval.apps.cohort.process import main; main()"
)
"""What starts a process for studies: it can end before it has loaded anything."""
OF_CLUSTER: Final = "gaitval-dask-"
"""First letters of the temporary folder of Dask."""
SAMPLING: Final = 0.5
"""s between two looks at the memory of a study's processes."""
COUNTING: Final = 10.0
"""s after which shared memory is counted again, however much they hold."""

_Json = dict[str, Any]


def order_of(
    study: Mapping[str, Any], fingerprint: str, store: str, *, function: str, threads: int
) -> _Json:
    """What a worker is sent for a `study` with its `fingerprint`: where to `store` it, which
    `function` does it and with how many `threads`. JSON, below a kilobyte without many settings.
    """
    return {
        "study": dict(study),
        "fingerprint": fingerprint,
        "store": store,
        "function": function,
        "threads": threads,
    }


def answer(order: _Json) -> str:
    """What a worker sends of an `order`: its outcome as JSON, for nothing of it is unpickled."""
    return json.dumps(run_order(order))


def run_order(order: _Json) -> _Json:
    """Do the study of an `order`, unless another worker has finished it; what became of it: `name`;
    `status`: finished, refused (by the input), fault (of gaitval), or lost (its process was
    killed); `reason`; `seconds` of the wall; `peak_memory` bytes of its processes together;
    `worker`: machine and process.
    """
    name = order["study"]["name"]
    store = Store(order["store"])
    known = store.finished(name)
    if known is not None and known.get("fingerprint") == order["fingerprint"]:
        return dict(known)
    began = time.monotonic()
    try:
        folder = store.folder(name)
    except ArtefactError as error:
        found: _Json = {"status": "refused", "reason": str(error)}
        return _outcome(order, found, began, 0)
    # What is there is of other inputs.
    store.forget(name)
    folder.mkdir(parents=True, exist_ok=True)
    found, peak = _watched(order, folder)
    outcome = _outcome(order, found, began, peak)
    if outcome["status"] == "finished":
        store.finish(name, outcome)
    else:
        store.keep(name, folder)  # its log says why
    store.clear(folder)
    return outcome


def _outcome(order: _Json, found: _Json, began: float, peak: int) -> _Json:
    """What became of an order, from what its process `found`."""
    return {
        "name": order["study"]["name"],
        "fingerprint": order["fingerprint"],
        "status": found["status"],
        "reason": found["reason"],
        "seconds": round(time.monotonic() - began, 2),
        "peak_memory": max(peak, found.get("peak_memory", 0)),
        "worker": f"{os.uname().nodename if hasattr(os, 'uname') else 'here'}:{os.getpid()}",
    }


def pinned(threads: int) -> dict[str, str]:
    """The environment of a study's process, with so many `threads`."""
    own = {SAFE: "1", "PYTHONUNBUFFERED": "1"}
    given = {name: value for name, value in os.environ.items() if name != TRIM}
    return {**given, **dict.fromkeys(THREADS, str(threads)), **own}


class Starter:
    """A process that studies are forked from (`process`); with an `environment`."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.environment = dict(environment)
        line, writes = os.pipe()
        self._line: int | None = writes
        self.process = subprocess.Popen(
            [sys.executable, "-c", BEGIN, str(line)],
            env=self.environment,
            pass_fds=(line,),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # A signal to the worker's group does not reach the study; its line ends it.
            start_new_session=True,
        )
        os.close(line)

    def end(self) -> None:
        """End the process, and the study that it has started."""
        if self.process.poll() is None:
            if hasattr(os, "killpg"):  # or there is only this process
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.kill()
        self.process.communicate()
        if self._line is not None:
            os.close(self._line)
            self._line = None

    def run(self, order: _Json) -> tuple[_Json | None, int, int]:
        """What a study's process told, None if nothing; its exit code; the most bytes that it and
        its children held.
        """
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        with suppress(BrokenPipeError):  # it has ended, which is seen below
            self.process.stdin.write(json.dumps(order).encode() + b"\n")
            self.process.stdin.flush()
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(self._answer, self.process.stdout)
            peak = _peak_until(answer, self.process.pid)
        reply, code = answer.result()
        return reply, self.process.wait() if code is None else code, peak

    @staticmethod
    def _answer(lines: IO[bytes]) -> tuple[_Json | None, int | None]:
        """The line that a study's process wrote, and its exit code; None without them."""
        reply: _Json | None = None
        for line in lines:
            if line.startswith(b"="):
                return reply, int(line[1:])
            with suppress(ValueError):  # half a line of a process that was killed
                reply = dict(json.loads(line))
        return reply, None


_waiting: list[Starter] = []
"""Of this worker, that do nothing now. Several threads may run studies; each takes one away."""


@contextmanager
def _starter(environment: Mapping[str, str]) -> Iterator[Starter]:
    """One that waits with this `environment`, or a new one. It waits again after an orderly end."""
    found = None
    while found is None:
        try:
            found = _waiting.pop()
        except IndexError:
            found = Starter(environment)
        if found.environment != environment or found.process.poll() is not None:
            found.end()
            found = None
    try:
        yield found
    except BaseException:
        found.end()
        raise
    _waiting.append(found)


@atexit.register
def _end_all() -> None:
    while _waiting:
        _waiting.pop().end()


def _watched(order: _Json, folder: Path) -> tuple[_Json, int]:
    """Run a study's process to its end; what it reported, and its largest memory, bytes."""
    with _starter(pinned(order["threads"])) as starter:
        places = {"folder": str(folder), "log": str(folder / LOG)}
        reply, code, peak = starter.run({**order, **places})
    return reply or {"status": "lost", "reason": _ended(code)}, peak


def _ended(code: int) -> str:
    if code < 0:
        name = signal.Signals(-code).name
        return f"its process was ended by {name}; did the machine run out of memory?"
    return f"its process ended with code {code} and reported nothing; its log may say why"


def _peak_until(answer: "Future[Any]", process: int) -> int:
    """Wait for what a process says at its end; the most bytes that it and its children held."""
    import psutil

    peak, shared, due = 0, 0, 0.0
    try:
        watched = psutil.Process(process)
    except psutil.NoSuchProcess:
        return peak
    while True:
        family = _family(watched)
        used_bytes = sum(_measured(each.memory_info, "rss") for each in family)
        # To count what is shared takes the system 25 ms, so it is asked where there may be more.
        if used_bytes - shared > peak or time.monotonic() >= due:
            now = _memory(family)
            peak, shared, due = max(peak, now), used_bytes - now, time.monotonic() + COUNTING
        if wait([answer], SAMPLING).done:
            return peak


def _family(process: Any) -> list[Any]:
    """A process and its children; none if it has ended."""
    import psutil

    try:
        return [process, *process.children(recursive=True)]
    except psutil.Error:
        return []


def _memory(family: list[Any]) -> int:
    """Bytes of processes now; memory that they share counts once where the system says so (PSS,
    Linux).
    """
    if sys.platform == "linux":
        return sum(_measured(each.memory_full_info, "pss") for each in family)
    return sum(_measured(each.memory_info, "rss") for each in family)


def _measured(about: Callable[[], Any], name: str) -> int:
    """A figure of a process's memory; 0 if it has ended."""
    import psutil

    try:
        return int(getattr(about(), name))
    except (psutil.Error, OSError):
        return 0


def summary_of(store: Store, name: str) -> _Json | None:
    """The summary in `store` of the finished study `name`."""
    return store.summary(name)
