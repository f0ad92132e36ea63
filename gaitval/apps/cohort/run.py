"""Run the studies of a cohort on Dask: each is `gaitval subject` in a process of its own.

So a study's memory is given back and measured, its threads are set before any library starts them,
and a crash in it ends nothing else. What is finished already is found by the study itself, which
skips the stages that are up to date: the same command resumes a cohort.
"""

import os
import subprocess
import sys
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import make_folder, write_text
from gaitval._internal.text.missing_extras import need
from gaitval.apps.cohort.table import Study
from gaitval.errors import ArtefactError, ConfigurationError, GaitvalError
from gaitval.subjects.subject_file import load_subject

if TYPE_CHECKING:
    from distributed import Client

LOG: Final = "study.log"
THREADS: Final = (
    *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS"),
    *("VECLIB_MAXIMUM_THREADS", "NUMEXPR_NUM_THREADS", "NUMBA_NUM_THREADS"),
)
"""Variables that say how many threads BLAS, torch (OMP, MKL) and numba may use."""
BEGIN: Final = """
import ctypes, signal, sys, traceback
if sys.platform == "linux":
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)
try:
    from gaitval.cli import main
except Exception:
    traceback.print_exc()
    sys.exit(70)
main()
"""
"""Starts `gaitval`, which Linux ends when whoever waits for it has ended (PR_SET_PDEATHSIG). If it
cannot be loaded, that is a fault, not Python's exit code 1, which is a verdict here."""
LAST: Final = 2_000
"""Characters at the end of a log in which the reason of a failure is looked for."""
WAIT: Final = 60.0
"""s for a scheduler to answer."""
STATUS: Final = {0: "finished", 1: "finished", 2: "refused"}
"""What a study's exit code says; any other is a fault, or the signal by which it was killed."""


@dataclass(frozen=True)
class Order:
    """What a worker does: the arguments of `gaitval`, the folder of the study, and its threads."""

    name: str
    arguments: tuple[str, ...]
    folder: str
    threads: int


@dataclass(frozen=True)
class Outcome:
    """What became of a study.

    Attributes
    ----------
    status : "finished"; "refused", its input cannot be used; "fault", of gaitval; "lost", killed.
    reason : the last words of its log; empty if it is finished.
    seconds, peak_memory : s, and bytes of its largest process.
    """

    name: str
    status: str
    reason: str = ""
    seconds: float = 0.0
    peak_memory: int = 0


def order_of(study: Study, out: Path, config: Path | None, threads: int) -> Order:
    """What is to be done for a `study` in `out`/studies. Raises GaitvalError if there is no such
    subject or trial.
    """
    subject = load_subject(study.subject)
    about = study.subject
    if study.trial:
        path = out / "subjects" / f"{study.name}.toml"
        write_text(path, subject.on_trial(study.trial).to_toml())
        about = str(path.resolve())
    folder = out.resolve() / "studies" / study.name
    words = ["subject", about, "--out", str(folder), "--set", f"training.workers={threads}"]
    if study.start == "scratch":
        words.append("--scratch")
    if config is not None:
        words += ["--config", str(config)]
    for setting in study.settings:
        words += ["--set", setting]
    return Order(study.name, tuple(words), str(folder), threads)


def work(order: Order) -> dict[str, Any]:
    """What a worker does for an `order`: its `Outcome`, as a dict."""
    began, folder = time.monotonic(), Path(order.folder)
    make_folder(folder)
    variables = dict.fromkeys(THREADS, str(order.threads)) | {"PYTHONSAFEPATH": "1"}
    with (folder / LOG).open("wb") as log:
        study = subprocess.Popen(
            [sys.executable, "-P", "-c", BEGIN, *order.arguments],
            env=os.environ | variables, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
        )  # fmt: skip
        code, memory = _waited(study)
    status = "lost" if code < 0 else STATUS.get(code, "fault")
    reason = "" if status == "finished" else _last_words(folder / LOG)
    if status == "lost":
        reason = f"killed by signal {-code}, as for want of memory; the same command resumes it"
    return asdict(Outcome(order.name, status, reason, time.monotonic() - began, memory))


def _waited(study: "subprocess.Popen[bytes]") -> tuple[int, int]:
    """The exit code of a process, and bytes of its largest; 0 where this system does not say."""
    if not hasattr(os, "wait4"):
        return study.wait(), 0
    _, status, usage = os.wait4(study.pid, 0)
    study.returncode = os.waitstatus_to_exitcode(status)
    return study.returncode, usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def _last_words(log: Path) -> str:
    text = file_gate.read_bytes(log, ArtefactError, largest=file_gate.SIZES.table)
    words = text.decode("utf-8", "replace")[-LAST:]
    paragraphs = [" ".join(each.split()) for each in words.strip().split("\n\n")]
    return paragraphs[-1] if paragraphs else ""


def run_cohort(
    studies: Sequence[Study],
    out: Path,
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    threads: int = 1,
    config: Path | None = None,
) -> Iterator[Outcome]:
    """Run every study, and yield what becomes of each as it is done; one that fails stops no other.

    Parameters
    ----------
    out : folder of the studies, which every worker sees under this path.
    scheduler : address of a running Dask cluster, whose security is that of Dask's own
        configuration; without one, `workers` studies at once run on this machine, by default one
        for each processor.
    threads : of each study.
    config : file of settings, or the name of a built-in one.

    Raises
    ------
    ConfigurationError : Dask is not installed, or the scheduler does not answer.
    """
    need("distributed")
    orders: deque[Order] = deque()
    for study in studies:
        try:
            orders.append(order_of(study, out, config, threads))
        except GaitvalError as error:
            yield Outcome(study.name, "refused", " ".join(str(error).split()))
    if orders:
        with _client(scheduler, workers or os.cpu_count() or 1) as client:
            yield from _outcomes(client, orders)


def _outcomes(client: "Client", orders: "deque[Order]") -> Iterator[Outcome]:
    """What becomes of `orders`. No more are given at once than there are threads: Dask would give a
    worker several, and takes few of them back.
    """
    from distributed import as_completed

    names: dict[Any, str] = {}
    done = as_completed()

    def give() -> None:
        busy = len(names)
        room = max(sum(client.nthreads().values()), 1)
        for _ in range(min(room - busy, len(orders))):
            order = orders.popleft()
            future = client.submit(work, order, key=f"{order.name}-{time.time_ns()}", pure=False)
            names[future] = order.name
            done.add(future)

    give()
    for future in done:
        name = names.pop(future)
        if future.status == "finished":
            yield Outcome(**future.result())
        elif future.status == "cancelled":
            raise ArtefactError(
                "the Dask scheduler has gone. Finished studies are kept: the same command "
                "continues with the others."
            )
        else:
            error = future.exception()
            lost = type(error).__name__ == "KilledWorker"
            yield Outcome(name, "lost" if lost else "fault", f"{type(error).__name__}: {error}")
        give()


@contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator["Client"]:
    """A client of the cluster at `scheduler`; without one, of threads of this process, which reach
    each other without any port that others could find.
    """
    from distributed import Client, LocalCluster

    if scheduler is None:
        with (
            LocalCluster(
                n_workers=1, threads_per_worker=workers, processes=False, dashboard_address=None
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = Client(scheduler, timeout=WAIT)
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        raise ConfigurationError(
            f"--scheduler {scheduler}: does not answer ({error}). Give the address that `dask "
            "scheduler` prints, and put the certificates of a tls:// cluster into Dask's "
            "configuration."
        ) from None
    with client:
        yield client
