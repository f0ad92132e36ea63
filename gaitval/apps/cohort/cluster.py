"""The workers of a cohort: processes of this machine, a running Dask cluster, or jobs of a batch
system.

Imported only by `engine`, after it has seen that Dask is installed.
"""

import os
import signal
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.resource_tracker import ensure_running
from pathlib import Path
from typing import Any, Final

import dask
from distributed import Client, LocalCluster
from distributed.security import Security

from gaitval.apps.cohort.lifeline import swept
from gaitval.apps.cohort.task import OF_CLUSTER, SAFE
from gaitval.artefacts import growing
from gaitval.errors import ConfigurationError, GaitvalError
from gaitval.partial_files import own_folder

LOOPBACK: Final = "127.0.0.1"
"""The only address at which a local cluster listens. Other users of the machine reach it too: who
has not the cohort's certificate is turned away (TLS, in both directions)."""
SCHEDULER: Final = {"dashboard": False, "dashboard_address": f"{LOOPBACK}:0"}
"""Dask listens for pages even without a dashboard, at every address if it is given none."""
PLAIN: Final = ("msgpack", "dask", "error")
"""What a client of ours reads of workers: values. What would have to be unpickled is refused."""
ANSWER: Final = 10.0
"""s, for a scheduler to answer."""
BATCH: Final = {"slurm": "SLURMCluster", "pbs": "PBSCluster"}
"""Batch systems, by the class of dask-jobqueue."""
JOB: Final = {"cores": 1, "processes": 1, "memory": "2GB"}
"""What a job asks for where `jobqueue.yaml` does not say: a study took less than 1.5 GB."""

QUIET: Final = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.admin.system-monitor.gil.enabled": False,
}
"""Dask watches itself a hundred times a second. With two workers that took 11 % of a processor from
the studies, and takes 2 % so; a study's own process is not watched by it anyway.
"""


class ClusterError(GaitvalError):
    """The workers of a cohort cannot be reached."""


def processors() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def client_of(
    scheduler: str | None,
    workers: int | None,
    threads: int,
    retries: int,
    *,
    without_tls: bool = False,
    shared: Path | None = None,
) -> Iterator[Client]:
    """A client of the workers, which are ended after the block if they were started for it.

    Parameters
    ----------
    scheduler : None for processes of this machine, "tls://…" of a running one, or a batch system.
    workers : processes or jobs; for processes, as many as the processors are good for if None.
    threads : of a study.
    retries : how many lost workers a study may have, for clusters that are started here.
    without_tls : a running one may be "tcp://…", which runs programs of whoever reaches it.
    shared : folder that jobs see, for their key; the home folder if None.

    Raises
    ------
    ClusterError : the scheduler does not answer.
    ConfigurationError : no such scheduler, one without TLS, or dask-jobqueue is not installed.
    """
    ours = {
        "distributed.scheduler.allowed-failures": retries,
        **QUIET,
        # What listens for pages has none: they have no password, and show what runs.
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
        # A study is a process of its own: what a worker itself holds says nothing about it.
        "distributed.worker.memory.terminate": False,
        "distributed.worker.memory.pause": False,
        "distributed.worker.memory.spill": False,
        "distributed.worker.memory.target": False,
    }
    if scheduler is None:
        count, security = workers or max(processors() // threads, 1), Security.temporary()
        with (
            _environment_kept(),
            own_folder(Path(tempfile.gettempdir()), OF_CLUSTER) as own,
            swept(own),
            # Dask's own folder has a name that anybody can know, and plant a link of
            dask.config.set({**ours, "temporary-directory": str(own)}),
            _started_deaf(count, security) as cluster,
            _client(cluster, security=security) as client,
        ):
            yield client
    elif (system := scheduler.lower()) in BATCH:
        security = Security.temporary()
        with (
            tempfile.TemporaryDirectory(
                prefix=".gaitval-key-", dir=shared or Path.home()
            ) as folder,
            dask.config.set({**ours, "temporary-directory": folder}),
            _jobs(system, workers, _in_files(security, Path(folder))) as cluster,
            _client(cluster, security=security) as client,
        ):
            yield client
    elif "://" in scheduler:
        if workers is not None:
            raise ConfigurationError(
                f"--workers {workers}: the cluster at {scheduler} has its own. Leave it out."
            )
        if not (scheduler.startswith("tls://") or without_tls):
            raise ConfigurationError(
                f"--scheduler {scheduler}: without TLS, whoever reaches it can run programs as "
                "you. Start it with certificates and give tls://… (docs/how-to/cohort.md); or give "
                "--without-tls as well, in a network that you share with nobody."
            )
        with _running(scheduler) as client:
            yield client
    else:
        raise ConfigurationError(
            f"--scheduler {scheduler}: give the address of a running one, such as "
            f"tls://10.0.0.5:8786, or {' or '.join(BATCH)}."
        )


@contextmanager
def _environment_kept() -> Iterator[None]:
    """Undo what Dask does to this process's environment.

    It sets the variables that its workers shall have (`OMP_NUM_THREADS`, `MALLOC_TRIM_THRESHOLD_`,
    `PYTHONHASHSEED`) here, and leaves them: all that is started later would have them too. Neither
    do its workers take modules from the folder that the command is run in.
    """
    before = dict(os.environ)
    os.environ[SAFE] = "1"
    try:
        yield
    finally:
        for name in os.environ.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)


def _client(to: Any, **settings: Any) -> Client:
    return Client(to, serializers=PLAIN, deserializers=PLAIN, **settings)


def _started_deaf(workers: int, security: Security) -> LocalCluster:
    """As `_local`, with processes that a terminal's Ctrl-C, which goes to all of its group, does
    not end with a traceback: this process ends them. They have the signals that are blocked in the
    thread that starts them, which has those of this one.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        return _local(workers, security)
    ensure_running()  # its start in that thread would let through what is blocked there
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
    try:
        return _local(workers, security)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _local(workers: int, security: Security) -> LocalCluster:
    return LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        host=LOOPBACK,
        protocol="tls://",
        security=security,
        scheduler_kwargs=SCHEDULER,
        memory_limit=0,
        silence_logs=50,  # we report a killed worker ourselves
    )


def _running(address: str) -> Client:
    try:
        return _client(address, timeout=ANSWER)
    except (OSError, TimeoutError) as error:
        raise ClusterError(
            f"{address}: no Dask scheduler answers there ({error}). Start one with `dask scheduler`"
            " and workers with `dask worker ADDRESS --nthreads 1`, in an environment with gaitval."
        ) from None


def _in_files(security: Security, folder: Path) -> Security:
    """The same, in files that this user alone can read, for jobs on other machines."""
    made, names = security.get_tls_config_for_role("worker"), {}
    for name in ("ca_file", "key"):
        names[name] = str(folder / name)
        with growing(folder / name, "new", private=True) as file:
            file.write(made[name].encode())
    roles = {f"tls_{role}_key": names["key"] for role in ("client", "scheduler", "worker")}
    # of its own making, so the certificate is its authority as well
    certificates = {name.replace("key", "cert"): names["ca_file"] for name in roles}
    return Security(require_encryption=True, tls_ca_file=names["ca_file"], **roles, **certificates)


def _jobs(system: str, workers: int | None, security: Security) -> Any:
    """Workers that are jobs of a batch system, as `~/.config/dask/jobqueue.yaml` describes them."""
    try:
        import dask_jobqueue
    except ImportError:
        raise ConfigurationError(
            f"--scheduler {system}: dask-jobqueue is not installed here. Install it: "
            "python -m pip install 'dask-jobqueue>=0.9,<1'"
        ) from None
    known = {
        name: dask.config.get(f"jobqueue.{system}.{name}", None) or value
        for name, value in JOB.items()
    }
    prologue = dask.config.get(f"jobqueue.{system}.job-script-prologue", None) or []
    cluster = getattr(dask_jobqueue, BATCH[system])(
        **known,
        job_script_prologue=[*prologue, f"export {SAFE}=1"],
        protocol="tls://",
        security=security,
        scheduler_options={"dashboard": False},
        worker_extra_args=["--no-dashboard"],
    )
    cluster.scale(jobs=workers or 1)
    return cluster
