"""The workers of a cohort: processes of this machine, a running Dask cluster, or jobs of a batch
system.

Imported only by `engine`, after it has seen that Dask is installed.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

import dask
from distributed import Client, LocalCluster

from gaitval.errors import ConfigurationError, GaitvalError

LOOPBACK: Final = "127.0.0.1"
"""The only address at which a local cluster listens: nobody else can send it work."""
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
    scheduler: str | None, workers: int | None, threads: int, retries: int
) -> Iterator[Client]:
    """A client of the workers, which are ended after the block if they were started for it.

    Parameters
    ----------
    scheduler : None for processes of this machine, "tcp://…" of a running one, or a batch system.
    workers : processes or jobs; for processes, as many as the processors are good for if None.
    threads : of a study.
    retries : how many lost workers a study may have, for clusters that are started here.

    Raises
    ------
    ClusterError : the scheduler does not answer.
    ConfigurationError : no such scheduler, or dask-jobqueue is not installed.
    """
    ours = {
        "distributed.scheduler.allowed-failures": retries,
        **QUIET,
        # A study is a process of its own: what a worker itself holds says nothing about it.
        "distributed.worker.memory.terminate": False,
        "distributed.worker.memory.pause": False,
        "distributed.worker.memory.spill": False,
        "distributed.worker.memory.target": False,
    }
    if scheduler is None:
        count = workers or max(processors() // threads, 1)
        with (
            _environment_kept(),
            dask.config.set(ours),
            _local(count) as cluster,
            Client(cluster) as client,
        ):
            yield client
    elif scheduler in BATCH:
        with dask.config.set(ours), _jobs(scheduler, workers) as cluster, Client(cluster) as client:
            yield client
    elif "://" in scheduler:
        if workers is not None:
            raise ConfigurationError(
                f"--workers {workers}: the cluster at {scheduler} has its own. Leave it out."
            )
        with _running(scheduler) as client:
            yield client
    else:
        raise ConfigurationError(
            f"--scheduler {scheduler}: give the address of a running one, such as "
            f"tcp://10.0.0.5:8786, or {' or '.join(BATCH)}."
        )


@contextmanager
def _environment_kept() -> Iterator[None]:
    """Undo what Dask does to this process's environment.

    It sets the variables that its workers shall have (`OMP_NUM_THREADS`, `MALLOC_TRIM_THRESHOLD_`,
    `PYTHONHASHSEED`) here, and leaves them: all that is started later would have them too.
    """
    before = dict(os.environ)
    try:
        yield
    finally:
        for name in os.environ.keys() - before.keys():
            del os.environ[name]
        os.environ.update(before)


def _local(workers: int) -> LocalCluster:
    return LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        host=LOOPBACK,
        dashboard_address=f"{LOOPBACK}:0",
        worker_dashboard_address=f"{LOOPBACK}:0",
        memory_limit=0,
        silence_logs=50,  # a killed worker is told by us
    )


def _running(address: str) -> Client:
    try:
        return Client(address, timeout=ANSWER)
    except (OSError, TimeoutError) as error:
        raise ClusterError(
            f"{address}: no Dask scheduler answers there ({error}). Start one with `dask scheduler`"
            " and workers with `dask worker ADDRESS --nthreads 1`, in an environment with gaitval."
        ) from None


def _jobs(system: str, workers: int | None) -> Any:
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
    cluster = getattr(dask_jobqueue, BATCH[system])(**known)
    cluster.scale(jobs=workers or 1)
    return cluster
