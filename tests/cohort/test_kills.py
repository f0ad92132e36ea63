"""A cohort whose workers and scheduler are killed ends complete, with equal results."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest
import quick_study
from killed_cohort import environment, killed, quick, results, started, studies_of

from gaitval.study.stage import Observer

NAMES = [f"study{number}_sleep0_8" for number in range(5)]


def alone(name, folder):
    """The summary of a study that nothing happens to."""
    folder.mkdir(parents=True)
    return quick_study.work(SimpleNamespace(name=name), folder, 1, Observer())


@pytest.mark.slow
def test_killed_at_random_and_resumed(tmp_path):
    folder = tmp_path / "killed"
    found = killed(quick(folder, "2", NAMES), folder, kills=2, seed=1, pause=0.5, limit=400.0)
    assert found["returned"] == 0, found["told"]
    assert found["kills"] == 2
    assert found["halfway"] is not None, "the scheduler was never killed"
    assert found["left"] == 0, "processes of studies outlived the cohort"
    assert found["told"].split("\n")[-2].split() == ["finished"] * len(NAMES)
    made = {name: json.loads(text) for name, text in results(folder).items()}
    assert made == {name: alone(name, tmp_path / "alone" / name) for name in NAMES}


def _of(folder):
    """Processes whose temporary files go to a folder."""
    found = []
    for each in psutil.process_iter():
        with suppress(psutil.Error):
            if each.environ().get("TMPDIR") == str(folder) and each.status() != "zombie":
                found.append(each)
    return found


LINUX = pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere the next start removes what is left"
)
KILLS = pytest.mark.parametrize("kill", [os.kill, os.killpg], ids=["alone", "its group"])


@contextmanager
def _gone_within(seconds, left):
    """After the block nothing is `left` (), in so many seconds."""
    started_at = time.monotonic()
    yield
    while left() and time.monotonic() - started_at < seconds:
        time.sleep(0.05)
    print(f"nothing is left after {time.monotonic() - started_at:.2f} s", left())
    assert left() == []


@pytest.mark.slow
@LINUX
@KILLS
def test_nothing_is_left_of_a_cohort_that_is_killed_while_a_study_loads(
    tmp_path, monkeypatch, kill
):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setenv("QUICK_FUNCTION", "slow_to_load:work")
    cohort = started(quick(tmp_path / "cohort", "2", ["a", "b"]))
    try:
        end = time.monotonic() + 120.0
        while len(list((tmp_path / "cohort").glob("*/study.log"))) < 2:  # then they load
            assert cohort.poll() is None, cohort.communicate()[0]
            assert time.monotonic() < end
            time.sleep(0.1)
        assert len(studies_of(cohort)) == 2
        assert list(temporary.iterdir())
        with _gone_within(15.0, lambda: [*_of(temporary), *temporary.iterdir()]):
            kill(cohort.pid, signal.SIGKILL)
            cohort.wait()
    finally:
        for each in _of(temporary):
            each.kill()
        cohort.communicate()


SWEPT = """
import multiprocessing, pathlib, sys, time
from gaitval.apps.cohort.lifeline import swept
folder = pathlib.Path(sys.argv[1])
(folder / "inside").mkdir(parents=True)
with swept(folder):
    lock = multiprocessing.get_context("spawn").Lock()
    print(lock._semlock.name, flush=True)
    time.sleep(600.0)
"""


@LINUX
@KILLS
def test_a_folder_and_semaphores_of_a_killed_process_are_removed(tmp_path, kill):
    folder = tmp_path / "of_dask"
    process = started([sys.executable, "-c", SWEPT, str(folder)])
    semaphore = Path(f"/dev/shm/sem.{process.stdout.readline().strip().lstrip('/')}")
    assert semaphore.exists()
    assert folder.exists()
    with _gone_within(5.0, lambda: [each for each in (folder, semaphore) if each.exists()]):
        kill(process.pid, signal.SIGKILL)
        process.communicate()


@LINUX
def test_a_line_that_was_cut_before_it_was_held_ends_the_process_too(tmp_path):
    begin = "import sys; from gaitval.apps.cohort.lifeline import hold; hold(int(sys.argv[1]))"
    reads, writes = os.pipe()
    os.close(writes)
    process = subprocess.Popen(
        [sys.executable, "-c", begin, str(reads)], env=environment(), pass_fds=(reads,),
        start_new_session=True,
    )  # fmt: skip
    os.close(reads)
    assert process.wait(60.0) == -signal.SIGKILL
