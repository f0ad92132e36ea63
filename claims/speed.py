"""How long a study, a cohort and a quick check take, how much memory, and how quick physics is.

Wall time says something on an idle machine only. So a run during which other programs took more
than `OTHERS` of the processors does not count; if none counts, no row is written. Seconds of the
processor are those of all processes of a command together.
"""

import contextlib
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Final, NamedTuple

import claims
from claims import ROOT, Claim

REPEATS: Final = 3
"""Runs, of which the fastest counts."""
OTHERS: Final = 0.1
"""Share of the processors that other programs may take."""
EVERY: Final = 0.1
"""s between two looks at the processes. To look at their memory makes them wait, by a tenth of a
study's time, so a run is timed or its memory is looked at."""
SELDOM: Final = 1.0
"""The same of a run that is timed: ten looks a second took 2 % of the processors."""
PEOPLE: Final = tuple(f"S{number:02d}" for number in range(1, 11))


class _Ran(NamedTuple):
    """A run: wall time, s; largest sum of its processes' memory, GB, if it was looked at; what
    others took.
    """

    seconds: float
    memory: float
    others: float


def _busy() -> int:
    """Ticks in which some processor worked, since the machine started."""
    times = [int(each) for each in Path("/proc/stat").read_text().split("\n")[0].split()[1:9]]
    return sum(times) - times[3] - times[4]  # idle, and waiting for a disk


def _ran(*words: str, memory: bool = False, **environment: str) -> _Ran:
    """A command of gaitval, with variables beside those of this process; its largest memory only if
    asked for.
    """
    busy, worked, began = _busy(), _children(), time.monotonic()
    command = [sys.executable, "-P", "-P", "-m", "gaitval", *words]
    most = 0.0
    ticks: dict[int, int] = {}
    variables = os.environ | environment
    with subprocess.Popen(command, cwd=ROOT, env=variables, stdout=subprocess.DEVNULL) as study:
        while study.poll() is None:
            ticks |= _processes(study.pid)
            if memory:
                most = max(most, memory_of(study.pid))
            with contextlib.suppress(subprocess.TimeoutExpired):
                study.wait(EVERY if memory else SELDOM)
    seconds = time.monotonic() - began
    if study.returncode:
        raise RuntimeError(f"{' '.join(command)}: exit code {study.returncode}")
    second = os.sysconf("SC_CLK_TCK")
    # of processes that nobody has waited for, only what was seen is known
    own = max(_children() - worked, sum(ticks.values()) / second)
    all_of_it = (_busy() - busy) / second
    others = max(0.0, all_of_it - own) / (seconds * (os.cpu_count() or 1))
    print(
        f"{seconds:.1f} s, {own:.0f} s of processor, {most:.2f} GB, others took {others:.0%}",
        flush=True,
    )
    return _Ran(seconds, most, others)


def memory_of(process: int) -> float:
    """GB of a process and all that descend from it (Linux), shared pages in equal shares."""
    total = 0.0
    try:
        for line in Path(f"/proc/{process}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                total = 1024.0 * float(line.split()[1]) / 1e9
        children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except (FileNotFoundError, ProcessLookupError):  # it has ended
        return total
    return total + sum(memory_of(int(child)) for child in children)


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


def _children() -> float:
    """Seconds of processor of all processes below this one that have ended."""
    of = resource.getrusage(resource.RUSAGE_CHILDREN)
    return of.ru_utime + of.ru_stime


def _idle(runs: Iterable[_Ran]) -> list[_Ran]:
    """Those during which the machine did little else."""
    counted = [ran for ran in runs if ran.others <= OTHERS]
    if not counted:
        raise RuntimeError(
            "Other programs were busy during every run. Run this on an idle machine."
        )
    return counted


@claims.measured()
def subject(_: claims.Given) -> list[Claim]:
    """Seconds from the start of `gaitval subject 5` to its report, and its memory; apart, that of
    the first study on a machine, in which all code is compiled.
    """
    with tempfile.TemporaryDirectory() as folder:
        cache = f"{folder}/cache"
        first = _ran("subject", "5", "--out", f"{folder}/first", memory=True, NUMBA_CACHE_DIR=cache)
        # Its time does not count: it may compile into the user's cache.
        _ran("subject", "5", "--out", f"{folder}/before")
        numbers = range(REPEATS)
        looked = [
            _ran("subject", "5", "--out", f"{folder}/looked-{each}", memory=True)
            for each in numbers
        ]
        counted = _idle([_ran("subject", "5", "--out", f"{folder}/{each}") for each in numbers])
    most = max(ran.memory for ran in looked)
    what = "memory of a study, all its processes"
    return [
        Claim(
            what="new subject and make subject S=5, start to report, caches compiled",
            value=min(ran.seconds for ran in counted),
            unit="s",
            n=len(counted),
        ),
        Claim(f"{what}, caches compiled", most, "GB", len(looked)),
        Claim(f"{what}, the first on a machine", first.memory, "GB", 1),
    ]


@claims.measured()
def cohort(_: claims.Given) -> Claim:
    """People an hour of `gaitval cohort`, over the ten; each study is the whole of `gaitval
    subject` with its report, one thread each, as many beside each other as there are processors.
    The start of the cluster and the report of all count.
    """
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "people.csv"
        table.write_text("\n".join(["subject", *PEOPLE]) + "\n", encoding="utf-8")
        (ran,) = _idle([_ran("cohort", str(table), "--out", f"{folder}/cohort")])
    return Claim(
        "people an hour as a cohort, the ten, every stage of a study and its report",
        3600.0 * len(PEOPLE) / ran.seconds,
        "1/h",
        len(PEOPLE),
    )


@claims.measured()
def physics(_: claims.Given) -> list[Claim]:
    """MuJoCo's C step over a step of one of eight walkers side by side, least times in the same run
    on one core (`benchmarks/test_physics_step.py`).
    """
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "physics_step.json"
        command = [sys.executable, "-m", "pytest", "benchmarks/test_physics_step.py", "-q"]
        command += ["-k", "the_goal", "--benchmark-enable", "--benchmark-only", "-n", "0"]
        subprocess.run([*command, f"--benchmark-json={results}"], cwd=ROOT, check=True)
        (goal,) = json.loads(results.read_text(encoding="utf-8"))["benchmarks"]
    return [
        Claim(
            "physics, one core, against MuJoCo's C step in the same run",
            float(goal["extra_info"]["times_mujoco"]),
            "times",
            50,
        )
    ]


@claims.measured()
def check(_: claims.Given) -> Claim:
    """Seconds of the processor that a quick check of a stored baseline takes."""
    seconds = [_processor("check", "--baseline", "S05", "--quick") for _ in range(REPEATS + 1)]
    print(" ".join(f"{each:.2f} s" for each in seconds), "(the first compiles)", flush=True)
    return Claim(
        "check --quick, processor time, caches compiled",
        statistics.median(seconds[1:]),
        "s",
        REPEATS,
    )


def _processor(*arguments: str) -> float:
    """Processor time of `gaitval` with these arguments and of all processes that it waits for, s,
    with as many threads as it takes by itself.
    """
    environment = {name: value for name, value in os.environ.items() if "_NUM_THREADS" not in name}
    paths = str(ROOT)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-P", "-P", "-m", "gaitval", *arguments],
        cwd=ROOT,
        env={**environment, "PYTHONPATH": paths},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
