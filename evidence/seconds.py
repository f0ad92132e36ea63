"""How long a study takes and how much memory it needs, as rows of `reports/evidence/seconds.csv`.

Wall time says something on an idle machine only. So a run during which other programs took more
than `OTHERS` of the processors does not count; if none counts, no row is written.
"""

import os
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from pathlib import Path
from typing import Final, NamedTuple

import evidence
from evidence import ROOT, option
from evidence.cohort.speed import memory_of

REPEATS = option("--repeats", type=int, default=3, help="runs, of which the fastest counts")
OTHERS: Final = 0.1
"""Share of the processors that other programs may take."""
EVERY: Final = 0.1
"""s between two looks at the processes."""
MEASURES = {
    "*": {
        "code": ("@study", "@page", "evidence/seconds.py"),
        "allowed": 60,
        "why": "one in a hundred of the statements of a study",
    },
}
"""What the rows depend on; see evidence/stale.py."""


class _Ran(NamedTuple):
    """A run: wall time, s; largest sum of its processes' memory, GB; what others took."""

    seconds: float
    memory: float
    others: float


def _processes(first: int) -> dict[int, int]:
    """A process and all that come from it: their processor time so far, ticks."""
    parents, ticks = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended
        parents[int(folder.name)] = int(fields[1])
        ticks[int(folder.name)] = int(fields[11]) + int(fields[12])
    found = {first}
    while more := {each for each, of in parents.items() if of in found} - found:
        found |= more
    return {each: ticks.get(each, 0) for each in found}


def _busy() -> int:
    """Ticks in which some processor worked, since the machine started."""
    times = [int(each) for each in Path("/proc/stat").read_text().split("\n")[0].split()[1:9]]
    return sum(times) - times[3] - times[4]  # idle, and waiting for a disk


def _ran(subject: str, folder: str) -> _Ran:
    """A study of a subject in an empty folder."""
    before, began = _busy(), time.monotonic()
    command = [sys.executable, "-m", "gaitval", "subject", subject, "--out", folder]
    own: dict[int, int] = {}
    memory = 0.0
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL) as study:
        while study.poll() is None:
            own |= _processes(study.pid)
            memory = max(memory, memory_of(study.pid))
            time.sleep(EVERY)
    seconds = time.monotonic() - began
    if study.returncode:
        raise SystemExit(f"{' '.join(command)}: exit code {study.returncode}")
    ticks = os.sysconf("SC_CLK_TCK") * seconds * (os.cpu_count() or 1)
    return _Ran(seconds, memory, max(0.0, _busy() - before - sum(own.values())) / ticks)


@evidence.measurement(REPEATS)
def subject(arguments: Namespace) -> list[evidence.Row]:
    """Seconds from the start of `gaitval subject 5` to its report, and its memory."""
    counted = []
    for _ in range(arguments.repeats):
        with tempfile.TemporaryDirectory() as folder:
            ran = _ran("5", f"{folder}/S05")
        print(f"{ran.seconds:.1f} s, {ran.memory:.2f} GB, others took {ran.others:.0%}", flush=True)
        if ran.others <= OTHERS:
            counted.append(ran)
    if not counted:
        raise SystemExit("Other programs were busy during every run. Run this on an idle machine.")
    return [
        evidence.Row(
            what="new subject and make subject S=5, start to report, caches compiled",
            value=min(ran.seconds for ran in counted),
            unit="s",
            relation="<=",
            goal=15,
            must=25,
            n=len(counted),
        ),
        evidence.Row(
            what="memory of a study, all its processes",
            value=max(ran.memory for ran in counted),
            unit="GB",
            relation="<=",
            goal=0.7,
            must=1.0,
            n=len(counted),
        ),
    ]
