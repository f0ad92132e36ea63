"""How long a study, a report, an import and a quick check take, and how much memory; how quick
physics and the live page are.

Wall time says something on an idle machine only. So a run during which other programs took more
than `OTHERS` of the processors does not count; if none counts, no row is written. Seconds of the
processor are those of all processes of a command together.
"""

import contextlib
import json
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final, NamedTuple

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
PUSHES: Final = 12
LOOKS: Final = 8.0
"""s, of one count of pictures."""
SETTLES: Final = 6.0
"""s in which the page finds how many pixels the machine has time for."""
WINDOW = {"width": 1280, "height": 800}
IDLE: Final = 0.8
"""Share of the processors that has to be idle for pictures to be counted."""


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
    command = [sys.executable, "-m", "gaitval", *words]
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


def _idle_share() -> float:
    """Fraction of this machine's processor time that nobody uses."""
    busy, seconds = _busy(), 2.0
    time.sleep(seconds)
    spent = (_busy() - busy) / os.sysconf("SC_CLK_TCK")
    return 1.0 - spent / (seconds * (os.cpu_count() or 1))


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
def scratch(_: claims.Given) -> Claim:
    """Minutes from the start of `gaitval subject 5 --scratch` to its report: own training from
    nothing, by as many samples as such a study has by default.
    """
    with tempfile.TemporaryDirectory() as folder:
        (ran,) = _idle([_ran("subject", "5", "--scratch", "--out", f"{folder}/S05")])
    what = "from nothing (own training, no general policy), start to report"
    return Claim(what, ran.seconds / 60, "min", 1)


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
def live(_: claims.Given) -> list[Claim]:
    """Pictures a second of `gaitval live 5` in Chromium, and how late a push is seen."""
    from claims.browser import LACKING, program

    browser, idle = program(), _idle_share()
    print(f"{idle:.0%} of this machine is idle")
    if browser is None:
        raise RuntimeError(LACKING)
    if idle < IDLE:
        raise RuntimeError("It is busy with other work, so it would measure that.")
    with tempfile.TemporaryDirectory() as temporary:
        command = [sys.executable, "-m", "gaitval", "live", "5", "--no-browser"]
        command += ["--out", temporary]
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as walk:
            try:
                rate, delays = _looked_at(walk, browser)
            finally:
                walk.terminate()
    print(f"{rate:.1f} pictures/s; a push was seen after {sorted(delays)} ms")
    where = "in Chromium, software graphics"
    middle = statistics.median(delays)
    return [
        Claim(f"live page: pictures a second {where}", rate, "1/s", 1),
        Claim(
            f"live page: from the end of a drag to the picture with the push {where}, median",
            middle,
            "ms",
            len(delays),
        ),
    ]


def _looked_at(walk: Any, browser: str) -> tuple[float, list[float]]:
    """Pictures a second, and ms of each push, of the page whose address the process says."""
    from playwright.sync_api import sync_playwright

    from claims.browser import FLAGS

    line = walk.stdout.readline()
    address = next((word for word in line.split() if "://" in word), None)
    if address is None:
        raise RuntimeError(f"gaitval live said no address, but {line!r}")
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=browser, args=list(FLAGS))
        page = opened.new_context(viewport=WINDOW).new_page()
        page.set_default_timeout(120_000)
        page.goto(address)
        page.wait_for_selector("#live[data-frames]")
        page.wait_for_timeout(1000.0 * SETTLES)
        return _pictures(page), _pushed(page)


def _pictures(page: Any) -> float:
    """A second, each of another moment of the walk."""
    count = "[+document.getElementById('live').dataset.frames, performance.now()]"
    before, began = page.evaluate(count)
    page.wait_for_timeout(1000.0 * LOOKS)
    after, ended = page.evaluate(count)
    return float(1000.0 * (after - before) / (ended - began))


def _pushed(page: Any) -> list[float]:
    """ms from the end of each drag on the body until the picture with its push is drawn."""
    box = page.locator("canvas").bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    for number in range(PUSHES):
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + (50 if number % 2 else -50), y, steps=3)  # 125 N
        page.mouse.up()
        page.wait_for_timeout(1500.0)
    found = page.evaluate("document.getElementById('live').dataset.delays").split()
    return [float(each) for each in found]


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
        [sys.executable, "-m", "gaitval", *arguments],
        cwd=ROOT,
        env={**environment, "PYTHONPATH": paths},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


@claims.measured()
def report(_: claims.Given) -> Claim:
    """Processor time of a report, page and PDF, in a process of its own."""
    sys.path.insert(0, str(claims.ROOT / "tests" / "support"))
    from report_run import build_run

    with tempfile.TemporaryDirectory() as name:
        build_run(Path(name))
        code = (
            "import sys, time; from pathlib import Path;"
            "from gaitval.reporting.report import write_report;"
            "write_report(Path(sys.argv[1])); print(time.process_time())"
        )
        done = subprocess.run(
            [sys.executable, "-c", code, name], capture_output=True, text=True, check=True
        )
    return Claim("report time, HTML and PDF, processor", float(done.stdout), "s", 1)


TRIALS = 20
"""Copies of the overground walk of Rajagopal et al. (2016), under other names."""
IMPORTS = 2
"""Imports, of which the fastest counts: other work only adds."""


def _import_seconds(arguments: list[str], out: Path) -> float:
    """Shortest time of the command, s."""
    found = []
    for number in range(IMPORTS):
        begin = time.perf_counter()
        subprocess.run(
            [
                sys.executable,
                "-m",
                "gaitval.cli",
                "import",
                *arguments,
                f"--out={out / str(number)}",
            ],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        found.append(time.perf_counter() - begin)
    return min(found)


@claims.measured("data")
def imports(given: claims.Given) -> list[Claim]:
    """Seconds of two imports by the command, pages and PDF included."""
    data = given.data
    raw, walk = data / "wbds" / "raw", data / "opensim_rajagopal" / "ExpData"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        treadmill = _import_seconds(
            [
                f"--static={raw / 'WBDS01static1.c3d'}",
                f"--trial={raw / 'WBDS01walkT01.c3d'}",
                "--mass=74.3",
                "--height=1.725",
                "--sex=M",
            ],
            folder / "treadmill",
        )
        given = [f"--static={walk / 'static_walk_1.trc'}"]
        given += ["--mass=85.07", "--height=1.829", "--sex=M"]
        for number in range(TRIALS):
            markers, forces = (folder / f"walk{number}{end}" for end in (".trc", ".mot"))
            shutil.copy(walk / "motion_capture_walk.trc", markers)
            shutil.copy(walk / "grf_walk.mot", forces)
            given += [f"--trial={markers}", f"--forces={forces}"]
        overground = _import_seconds(given, folder / "overground")
    return [
        Claim(
            f"import of a 30 s treadmill session, {os.cpu_count()} cores, whole command",
            treadmill,
            "s",
            IMPORTS,
        ),
        Claim(
            f"import of {TRIALS} overground trials, {os.cpu_count()} cores, whole command",
            overground,
            "s",
            IMPORTS,
        ),
    ]


@claims.measured()
def install(given: claims.Given) -> Claim:
    """Size of a new environment with gaitval and no extra, in which the stored walk of the test
    person is checked quickly (long walks and pushes need MuJoCo besides) and a model judged.
    """
    import gaitval
    from gaitval.configuration import ContactSettings
    from gaitval.datasets.subject_file import load_subject
    from gaitval.opensim.osim import write_osim
    from gaitval.scaling.scaling import scale_subject

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_osim(
            folder / "model.osim",
            scale_subject(load_subject("5")).model,
            (),
            ContactSettings(),
            0.8,
        )
        venv = folder / "venv"
        python = [venv / "bin" / "python", "-m", "pip", "--disable-pip-version-check", "install"]
        command = venv / "bin" / "gaitval"
        constraints = claims.ROOT / "constraints.txt"
        wheel = folder / f"gaitval-{gaitval.__version__}-py3-none-any.whl"
        build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder]
        size = 0
        for words in (
            [*build, claims.ROOT],
            [sys.executable, "-m", "venv", venv],
            [*python, "--quiet", "-c", constraints, wheel],
            [command, "check", "--quick", "--baseline", "S05"],
            [command, "judge", "model.osim"],
        ):
            if words[0] == command and not size:
                # before a first run writes bytecode of its own
                files = [each for each in venv.rglob("*") if not each.is_symlink()]
                size = sum(each.stat().st_size for each in files if each.is_file())
            texts = [str(each) for each in words]
            done = subprocess.run(texts, cwd=folder, capture_output=True, text=True, check=False)
            if done.returncode:
                raise RuntimeError(f"{' '.join(texts)}:\n{done.stdout}\n{done.stderr}")
            print(done.stdout[-300:])
    return Claim(
        "install for `check --quick` and `judge` alone: the whole environment", size / 1e6, "MB", 1
    )
