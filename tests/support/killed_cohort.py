"""Kills workers of a cohort at random, and its scheduler once; for the test and for the script
`claims/robustness.py`, which takes longer.
"""

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import psutil

from gaitval.apps.cohort.store import FINISHED, SUMMARY

SUPPORT = Path(__file__).parent
ROOT = SUPPORT.parents[1]


def environment():
    """In which quick studies are found."""
    paths = os.pathsep.join(map(str, [ROOT, SUPPORT]))
    return {**os.environ, "PYTHONPATH": paths, "OMP_NUM_THREADS": "1"}


def started(command: Sequence[str]) -> "subprocess.Popen[str]":
    """A cohort that has been started, in a session of its own."""
    return subprocess.Popen(
        command, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True,
    )  # fmt: skip


def quick(folder: Path, workers: str, names: Sequence[str]) -> list[str]:
    """The command of a cohort of quick studies."""
    return [sys.executable, str(SUPPORT / "run_quick_cohort.py"), str(folder), workers, *names]


def workers_of(process: "subprocess.Popen[str]") -> list[psutil.Process]:
    """Dask's workers that a cohort has started: the parents of studies are among them."""
    found = []
    try:
        family = psutil.Process(process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []
    for each in family:
        try:
            line = " ".join(each.cmdline())
        except psutil.Error:
            continue
        if "spawn_main" in line and each.ppid() == process.pid:
            found.append(each)
    return found


def studies_of(process: "subprocess.Popen[str]") -> list[psutil.Process]:
    """Processes of studies that run, and those that they are forked from."""
    try:
        family = psutil.Process(process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []
    found = []
    for each in family:
        try:
            if "gaitval.apps.cohort.process" in " ".join(each.cmdline()):
                found.append(each)
        except psutil.Error:
            continue
    return found


def finished(folder: Path) -> int:
    """Studies of a folder that are finished."""
    return len(list(folder.glob(f"*/{FINISHED}")))


def results(folder: Path) -> dict[str, bytes]:
    """The summary of each study in a folder."""
    return {path.parent.name: path.read_bytes() for path in sorted(folder.glob(f"*/{SUMMARY}"))}


def killed(
    command: Sequence[str], folder: Path, *, kills: int, seed: int, pause: float, limit: float
) -> dict[str, Any]:
    """Run a cohort, kill workers of it at random times, and the cohort itself once, halfway.

    Parameters
    ----------
    folder : of its studies.
    kills : of workers.
    pause : s, mean time between kills.
    limit : s, for all of it.

    Returns
    -------
    dict
        How many workers were killed, how many of them while they ran a study, how many studies
        were finished when the cohort was killed, what the last start returned and printed, and how
        many processes of studies were left 5 s after the kill.
    """
    chance, end = random.Random(seed), time.monotonic() + limit
    done = busy = 0
    process, halfway, left = started(command), None, 0
    while process.poll() is None and time.monotonic() < end:
        time.sleep(chance.uniform(0.2, 1.8) * pause)
        if halfway is None and done >= kills // 2 and finished(folder) >= 1:
            halfway = finished(folder)
            orphans = studies_of(process)
            process.send_signal(signal.SIGKILL)
            process.communicate()
            _, alive = psutil.wait_procs(orphans, timeout=5.0)
            left = len(alive)
            process = started(command)
            continue
        running = studies_of(process)
        candidates = [each for each in workers_of(process) if each.children()]
        if done < kills and running and candidates:
            chosen = chance.choice(candidates)
            with contextlib.suppress(psutil.Error):
                # a worker's child starts studies, and a child of that is one
                starters = {each.pid for each in chosen.children()}
                busy += any(each.ppid() in starters for each in running)
            chosen.kill()
            done += 1
    if process.poll() is None:
        process.kill()
    message = process.communicate()[0]
    return {"kills": done, "busy": busy, "halfway": halfway, "left": left,
            "returned": process.returncode, "told": message}  # fmt: skip
