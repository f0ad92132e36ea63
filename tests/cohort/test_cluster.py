"""Workers that are not of this command: a running cluster, and jobs of a batch system."""

import os
import signal
import socket
import stat
import subprocess
import sys
import time
from contextlib import contextmanager

import dask
import psutil
import pytest
from killed_cohort import environment, finished, quick, started

from gaitval.apps.cohort.cluster import client_of
from gaitval.apps.cohort.engine import run_cohort
from gaitval.apps.cohort.table import Study


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def running_cluster():
    """A scheduler and a worker, as a system's administrators would start them."""
    address = f"tcp://127.0.0.1:{free_port()}"
    dask = [sys.executable, "-m", "dask"]
    scheduler = subprocess.Popen(
        [*dask, "scheduler", "--host", address, "--no-dashboard"], env=environment(),
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    worker = subprocess.Popen(
        [*dask, "worker", address, "--nthreads", "1", "--memory-limit", "0", "--no-dashboard",
         "--host", "127.0.0.1", "--death-timeout", "60"],
        env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        yield address, scheduler
    finally:
        for process in (worker, scheduler):
            end_family(process.pid)
            process.wait()


def end_family(number):
    try:
        process = psutil.Process(number)
    except psutil.NoSuchProcess:
        return
    for each in (*process.children(recursive=True), process):
        try:
            each.kill()
        except psutil.NoSuchProcess:
            continue


def test_workers_of_this_machine_do_not_watch_themselves():
    with client_of(None, 1, 1, 0) as client:
        client.wait_for_workers(1)
        (seen,) = client.run(dask.config.get, "distributed.worker.profile.enabled").values()
    assert seen is False
    assert dask.config.get("distributed.worker.profile.enabled") is True  # ours alone


@pytest.mark.skipif(os.name != "posix", reason="Windows blocks no signals")
def test_the_ctrl_c_of_a_terminal_is_not_for_the_workers():
    """It goes to all processes of the group: a worker would end with Dask's traceback."""
    with client_of(None, 1, 1, 0) as client:
        client.wait_for_workers(1)
        (worker,) = client.run(os.getpid).values()
        os.kill(worker, signal.SIGINT)
        time.sleep(0.5)
        assert list(client.run(os.getpid).values()) == [worker]
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_a_cohort_leaves_the_environment_as_it_was(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("MALLOC_TRIM_THRESHOLD_", raising=False)
    before = dict(os.environ)
    with client_of(None, 1, 1, 0) as client:
        client.wait_for_workers(1)
        assert os.environ["MALLOC_TRIM_THRESHOLD_"]  # Dask's way to tell its workers
    assert dict(os.environ) == before


@pytest.mark.slow
def test_a_running_cluster_and_the_end_of_its_scheduler(tmp_path):
    """The command says that the scheduler has gone; with another it goes on where it was."""
    names = ["one_sleep0_1", "two_sleep30"]
    with running_cluster() as (address, scheduler):
        cohort = started(quick(tmp_path, address, names))
        end = time.monotonic() + 120
        second = tmp_path / names[1]
        while not (finished(tmp_path) and second.exists()) and time.monotonic() < end:
            time.sleep(0.1)
        assert finished(tmp_path) == 1
        assert second.exists()
        scheduler.send_signal(signal.SIGKILL)
        message, _ = cohort.communicate(timeout=120)
    assert cohort.returncode != 0
    assert "the Dask scheduler has gone" in message
    for step in range(10):  # what is left of the long one takes no time now
        (tmp_path / "two_sleep30" / f"step{step}.txt").write_text(f"{step}")
    again = started(quick(tmp_path, "1", names))
    message, _ = again.communicate(timeout=120)
    assert message.split("\n")[0] == "1 0", "one of them was found"
    assert message.split("\n")[-2] == "finished finished"


SBATCH = """#!/bin/sh
# Runs the script in the background, as if a node had been free at once.
cp "$1" "$FAKE_SLURM/script.sh"
sh "$FAKE_SLURM/script.sh" >"$FAKE_SLURM/job.log" 2>&1 & # the copy: "$1" is removed at once
echo "$!" >>"$FAKE_SLURM/jobs"
echo "Submitted batch job $!"
"""
SCANCEL = """#!/bin/sh
echo "$@" >>"$FAKE_SLURM/cancelled"
kill "$@"
"""


@pytest.fixture
def fake_slurm(tmp_path, monkeypatch):
    """`sbatch` and `scancel` that start and end processes of this machine."""
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        path = tmp_path / "bin" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("FAKE_SLURM", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", environment()["PYTHONPATH"])
    yield tmp_path
    if (tmp_path / "jobs").exists():
        for number in (tmp_path / "jobs").read_text().split():
            end_family(int(number))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sbatch is a shell script here")
def test_jobs_of_slurm(fake_slurm, monkeypatch):
    import dask

    here = {"jobqueue.slurm.interface": "lo", "jobqueue.slurm.walltime": "00:45:00"}
    with dask.config.set(here):
        outcomes = run_cohort(
            [Study(name=name, subject="5") for name in ("a_sleep0_1", "b_sleep0_1")],
            str(fake_slurm / "studies"),
            scheduler="slurm",
            workers=1,
            function="quick_study:work",
        )
    assert [each["status"] for each in outcomes] == ["finished", "finished"]
    script = (fake_slurm / "script.sh").read_text()
    assert "#SBATCH -t 00:45:00" in script, "jobqueue.yaml counts"
    assert "#SBATCH --mem=2G" in script
    assert (fake_slurm / "cancelled").exists(), "jobs end with the cohort"
