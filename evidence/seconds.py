"""How long a study takes, alone, from nothing and in a cohort, and how much memory it needs, which
speeds and which strangers are walked without own training, how quick physics and the live page are,
as rows of `reports/evidence/seconds.csv`.

Wall time says something on an idle machine only. So a run during which other programs took more
than `OTHERS` of the processors does not count; if none counts, no row is written.
"""

import contextlib
import csv
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import evidence
from evidence import ROOT, option
from evidence.cohort.speed import memory_of

if TYPE_CHECKING:
    from numpy.random import Generator

    from gaitval.arrays import Array
    from gaitval.datasets.subject import Subject
    from gaitval.policy.storage import Policy
    from gaitval.simulation.walker import WalkingTask

REPEATS = option("--repeats", type=int, default=3, help="runs, of which the fastest counts")
OTHERS: Final = 0.1
"""Share of the processors that other programs may take."""
EVERY: Final = 0.1
"""s between two looks at the processes. To look at their memory makes them wait, by a tenth of a
study's time, so a run is timed or its memory is looked at."""
SELDOM: Final = 1.0
"""The same of a run that is timed: ten looks a second took 2 % of the processors."""
PEOPLE: Final = tuple(f"S{number:02d}" for number in range(1, 11))
SPEEDS: Final = (0.3, 0.4, 0.6, 0.9, 1.25, 1.6, 1.8)
"""m/s: the ends that are asked for and those that must be, and steps of up to a half between."""
CYCLES: Final = 100
STARTS: Final = 8
WALKS: Final = 0.95
"""Share of people and starts that must walk at a speed."""
PUSHES: Final = 12
LOOKS: Final = 8.0
"""s, of one count of pictures."""
SETTLES: Final = 6.0
"""s in which the page finds how many pixels the machine has time for."""
WINDOW = {"width": 1280, "height": 800}
ANYWAY = option("--anyway", action="store_true", help="measure on a busy machine, before others")
TABLES: Final = {"F": "ANSUR_II_FEMALE_Public.csv", "M": "ANSUR_II_MALE_Public.csv"}
SLOWEST, FASTEST = 0.4, 1.6
"""m/s, of the strangers' speeds."""
STRANGERS: Final = ROOT / "reports" / "general" / "strangers.json"
IMPORTS: Final = STRANGERS.with_name("imports.json")
CHILDREN: Final = 5
"""Every so many strangers is a child."""
GROWTH: Final = {
    "F": (
        (6, 115.1244, 0.04447, -1.0794, 15.2697, 0.10195),
        (8, 126.5558, 0.04581, -1.3880, 15.6810, 0.11291),
        (10, 138.6363, 0.04614, -1.4864, 16.6133, 0.12307),
        (12, 151.2327, 0.04523, -1.4006, 17.9966, 0.13129),
        (14, 159.7890, 0.04345, -1.2266, 19.5647, 0.13700),
        (16, 162.5156, 0.04176, -1.0368, 20.7008, 0.14070),
    ),
    "M": (
        (6, 115.9509, 0.04249, -0.9921, 15.3062, 0.08682),
        (8, 127.2651, 0.04438, -1.4629, 15.7368, 0.09526),
        (10, 137.7795, 0.04626, -1.7407, 16.4433, 0.10566),
        (12, 149.0807, 0.04753, -1.7751, 17.5334, 0.11522),
        (14, 163.1816, 0.04714, -1.6211, 19.0050, 0.12191),
        (16, 172.8967, 0.04495, -1.3529, 20.4951, 0.12579),
    ),
}
"""Growth reference of the WHO (de Onis et al. 2007, Bull World Health Organ 85:660) by sex: age in
years; median of stature, cm, and coefficient of variation; L, M and S of body mass index, kg/m²."""
MEASURES = {
    "people an hour *": {
        "code": ("@study", "@page", "@cohort", "evidence/seconds.py:cohort,_ran,_idle"),
        "allowed": 60,
        "why": "one in a hundred of the statements of a study",
    },
    "from nothing *": {
        "code": ("@study", "@page", "evidence/seconds.py:scratch,_ran,_idle"),
        "allowed": 60,
        "why": "one in a hundred of the statements of a study",
    },
    "physics, *": {"code": ("@physics", "evidence/seconds.py:physics")},
    "strangers, adults of ANSUR II * and, one in*": {
        "code": (
            "@walk",
            "evidence/seconds.py:strangers,adults,drawn_stranger,_stranger,_child,task_of,_fell",
            "gaitval/apps/virtual/person.py:on_legs",
        ),
        "data": ("reports/general/policy.safetensors",),
        "results": ("reports/general/strangers.json",),
        "allowed": 100,
        "why": "one in sixty of the statements of a walk",
    },
    "speeds walked*": {
        "code": (
            "@walk",
            "gaitval/prediction/speed.py",
            "gaitval/prediction/normal_form.py",
            "evidence/seconds.py:speeds,task_of,_fell,_widest",
        ),
        "data": ("reports/general/policy.safetensors",),
        "allowed": 100,
        "why": "one in sixty of the statements of a walk",
    },
    "strangers*": {
        "code": ("@walk", "evidence/seconds.py:imports,task_of,_fell"),
        "data": ("reports/general/policy.safetensors",),
        "results": ("reports/general/imports.json",),
        "allowed": 100,
        "why": "one in sixty of the statements of a walk",
    },
    "live page*": {
        "code": (
            "gaitval/apps/live/*.py",
            "evidence/seconds.py:live,_looked_at,_pictures,_pushed",
        ),
        "data": ("gaitval/apps/live/live.*", "gaitval/reporting/vendor/*"),
        "allowed": 60,
        "why": "tests/live/test_page.py looks at the page in a browser when slow tests run",
    },
    "*": {
        "code": ("@study", "@page", "evidence/seconds.py"),
        "allowed": 60,
        "why": "one in a hundred of the statements of a study",
    },
}
"""What the rows depend on; see evidence/stale.py."""


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
        raise SystemExit(f"{' '.join(command)}: exit code {study.returncode}")
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
        raise SystemExit("Other programs were busy during every run. Run this on an idle machine.")
    return counted


@evidence.measurement(REPEATS)
def subject(arguments: Namespace) -> list[evidence.Row]:
    """Seconds from the start of `gaitval subject 5` to its report, and its memory; apart, that of
    the first study on a machine, in which all code is compiled.
    """
    with tempfile.TemporaryDirectory() as folder:
        cache = f"{folder}/cache"
        first = _ran("subject", "5", "--out", f"{folder}/first", memory=True, NUMBA_CACHE_DIR=cache)
        # Its time does not count: it may compile into the user's cache.
        _ran("subject", "5", "--out", f"{folder}/before")
        numbers = range(arguments.repeats)
        looked = [
            _ran("subject", "5", "--out", f"{folder}/looked-{each}", memory=True)
            for each in numbers
        ]
        counted = _idle([_ran("subject", "5", "--out", f"{folder}/{each}") for each in numbers])
    most = max(ran.memory for ran in looked)
    what = "memory of a study, all its processes"
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
        evidence.Row(f"{what}, caches compiled", most, "GB", "<=", 0.7, 1.0, len(looked)),
        evidence.Row(f"{what}, the first on a machine", first.memory, "GB", "<=", 0.7, 1.0, 1),
    ]


@evidence.measurement()
def scratch(_: Namespace) -> evidence.Row:
    """Minutes from the start of `gaitval subject 5 --scratch` to its report: own training from
    nothing, by as many samples as such a study has by default.
    """
    with tempfile.TemporaryDirectory() as folder:
        (ran,) = _idle([_ran("subject", "5", "--scratch", "--out", f"{folder}/S05")])
    what = "from nothing (own training, no general policy), start to report"
    return evidence.Row(what, ran.seconds / 60, "min", "<=", 2, 3, 1)


@evidence.measurement()
def cohort(_: Namespace) -> evidence.Row:
    """People an hour of `gaitval cohort`, over the ten; each study is the whole of `gaitval
    subject` with its report, one thread each, as many beside each other as there are processors.
    The start of the cluster and the report of all count.
    """
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "people.csv"
        table.write_text("\n".join(["subject", *PEOPLE]) + "\n", encoding="utf-8")
        (ran,) = _idle([_ran("cohort", str(table), "--out", f"{folder}/cohort")])
    return evidence.Row(
        "people an hour as a cohort, the ten, every stage of a study and its report",
        3600.0 * len(PEOPLE) / ran.seconds,
        *("1/h", ">=", 500, 250, len(PEOPLE)),
    )


@evidence.measurement()
def physics(_: Namespace) -> list[evidence.Row]:
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
        evidence.Row(
            "physics, one core, against MuJoCo's C step in the same run",
            float(goal["extra_info"]["times_mujoco"]),
            "times",
            ">=",
            25,
            17,
            50,
        )
    ]


@evidence.measurement(
    option("--people", nargs="+", default=PEOPLE, help="of the ten"),
    option("--speeds", nargs="+", type=float, default=SPEEDS, help="m/s"),
)
def speeds(arguments: Namespace) -> list[evidence.Row]:
    """Speeds at which the ten walk with the general policy, from every start."""
    from gaitval.datasets.subject_file import load_subject

    shares = []
    for speed in arguments.speeds:
        fell = {who: _fell(load_subject(who), speed) for who in arguments.people}
        shares.append(1.0 - sum(fell.values()) / (STARTS * len(fell)))
        who = ", ".join(f"{name} {count} of {STARTS}" for name, count in fell.items() if count)
        print(f"{speed:g} m/s: {shares[-1]:.1%} walk{', fell: ' + who if who else ''}", flush=True)
    slowest, fastest = _widest(arguments.speeds, shares)
    what = f"speeds walked without own training, by {WALKS:.0%} of the ten from {STARTS} starts"
    count = STARTS * len(arguments.people) * len(shares)
    return [
        evidence.Row(f"{what}: slowest", slowest, "m/s", "<=", 0.3, 0.4, count),
        evidence.Row(f"{what}: fastest", fastest, "m/s", ">=", 1.8, 1.6, count),
    ]


def _widest(speeds: list[float], shares: list[float]) -> tuple[float, float]:
    """The ends, m/s, of the widest row of neighbouring speeds at which enough walk."""
    found, begin = (float("inf"), 0.0), None
    for speed, share in zip(speeds, shares, strict=True):
        begin = (speed if begin is None else begin) if share >= WALKS else None
        if begin is not None and speed - begin >= max(found[1] - found[0], 0.0):
            found = begin, speed
    return found


@evidence.measurement(
    evidence.DATA,
    option("--people", type=int, default=200),
    option("--seed", type=int, default=20261124),
)
def strangers(arguments: Namespace) -> evidence.Row:
    """Adults of ANSUR II and children of the WHO's growth reference, each with the gait of one of
    the ten, walked at some speed without own training: how many walk from every start. Who has
    walked is kept in `STRANGERS`, so that the same command goes on.
    """
    from gaitval.artefacts import read_json, write_json

    table = adults(arguments.data)
    stored = read_json(STRANGERS) if STRANGERS.is_file() else {}
    known = stored["people"] if stored.get("seed") == arguments.seed else []
    for number in range(len(known), arguments.people):
        person, gait, speed = drawn_stranger(table, arguments.seed, number, (SLOWEST, FASTEST))
        about = {
            "laboratory": person.laboratory,
            "sex": person.sex,
            "height_m": round(person.height_m, 3),
            "mass_kg": round(person.mass_kg, 1),
            "gait": gait,
            "speed": round(speed, 3),
            "fell": _fell(person, speed),
        }
        known.append(about)
        write_json(STRANGERS, {"seed": arguments.seed, "people": known})
        print(f"{number + 1}: {about}", flush=True)
    walk = sum(not each["fell"] for each in known)
    return evidence.Row(
        f"strangers, adults of ANSUR II at {SLOWEST} to {FASTEST} m/s and, one in {CHILDREN}, "
        "children of 6 to 16 (WHO) at the same dimensionless speeds, without own training: share "
        f"that walk {CYCLES} cycles from {STARTS} starts",
        100.0 * walk / len(known),
        *("%", ">=", 99, 95, len(known)),
    )


def adults(data: Path) -> list[dict[str, str]]:
    """The rows of ANSUR II, women first, each with a `sex`."""
    table = []
    for sex, name in TABLES.items():
        path = data / "anthropometry" / name
        with path.open(encoding="latin-1", newline="") as file:
            table += [{**row, "sex": sex} for row in csv.DictReader(file)]
    return table


def drawn_stranger(
    table: list[dict[str, str]], seed: int, number: int, speeds: tuple[float, float]
) -> tuple["Subject", str, float]:
    """A person of a `seed`, the name of whose gait it is, and a speed, m/s: between those two for
    an adult of mean leg length.
    """
    import numpy as np

    leg = statistics.mean(float(row["trochanterionheight"]) for row in table) / 1000.0
    random = np.random.default_rng((seed, number))
    row, gait = table[random.integers(len(table))], PEOPLE[random.integers(len(PEOPLE))]
    speed = float(random.uniform(*speeds))
    person = _stranger(row, gait)
    if number % CHILDREN == CHILDREN - 1:
        person = _child(person, random)
        speed *= (person.leg_length_m / leg) ** 0.5
    return person, gait, speed


def _child(person: "Subject", random: "Generator") -> "Subject":
    """A child of a drawn age and size who walks as the `person` does at the same dimensionless
    speed, with the same share of leg in stature.
    """
    from gaitval.apps.virtual.person import on_legs

    years, median, spread, skew, index, scatter = GROWTH[person.sex][random.integers(6)]
    height = 0.01 * median * (1.0 + spread * random.standard_normal())
    mass = height**2 * index * (1.0 + skew * scatter * random.standard_normal()) ** (1.0 / skew)
    leg = person.leg_length_m * height / person.height_m
    return on_legs(person, leg, leg / person.leg_length_m).model_copy(
        update={
            "person": f"{person.person}-child",
            "laboratory": "WHO",
            "age_years": float(years),
            "mass_kg": float(mass),
            "height_m": float(height),
        }
    )


@evidence.measurement(
    option("--from", dest="clones", type=Path, required=True, help="folder of the clones")
)
def imports(arguments: Namespace) -> evidence.Row:
    """Public recordings that become subjects, each walked as recorded without own training: how
    many walk from every start. Who has walked is kept in `IMPORTS`, so that the same command goes
    on, and one that becomes no subject is named there.
    """
    from experiments.measurement_constants import of_basel
    from experiments.own_training import imported, strangers_listed
    from gaitval.artefacts import read_json, write_json
    from gaitval.datasets.subject_file import load_subject
    from gaitval.errors import GaitvalError

    known = read_json(IMPORTS) if IMPORTS.is_file() else {}
    with tempfile.TemporaryDirectory() as folder:
        for recording in (*strangers_listed(), *of_basel(arguments.clones)):
            name = f"{recording['laboratory']}: {recording['name']}"
            if name in known:
                continue
            try:
                person = load_subject(imported(recording, arguments.clones, Path(folder)))
            except GaitvalError as error:
                known[name] = {"refused": str(error).split("\n")[0]}
            else:
                speed = round(person.walking_speed_m_s, 2)
                known[name] = {"speed": speed, "fell": _fell(person)}
            write_json(IMPORTS, known)
            print(f"{name}: {known[name]}", flush=True)
    walked = [each["fell"] == 0 for each in known.values() if "fell" in each]
    return evidence.Row(
        "strangers, public recordings that become subjects, without own training: share that walk "
        f"{CYCLES} cycles from {STARTS} starts",
        100.0 * sum(walked) / len(walked),
        *("%", ">=", 99, 95, len(walked)),
    )


def _stranger(row: Mapping[str, str], gait: str) -> "Subject":
    """Somebody of the body of a `row` of ANSUR II (mm, hectograms) who walks as one of the ten does
    at the same dimensionless speed; only stature, leg and mass are known of the body.
    """
    from gaitval.apps.virtual.person import on_legs
    from gaitval.datasets.subject_file import load_subject

    leg, person = float(row["trochanterionheight"]) / 1000.0, load_subject(gait).by_stature()
    return on_legs(person, leg, leg / person.leg_length_m).model_copy(
        update={
            "person": f"ANSUR-{row.get('SubjectId') or row.get('subjectid')}",
            "laboratory": "ANSUR II",
            "sex": row["sex"],
            "mass_kg": float(row["weightkg"]) / 10.0,
            "height_m": float(row["stature"]) / 1000.0,
            "trials": (),
        }
    )


def task_of(person: "Subject", speed: float | None = None) -> "WalkingTask":
    """What a person is to walk at a speed, m/s, or as recorded, with the default settings."""
    from gaitval.configuration import Configuration
    from gaitval.datasets.subject_file import builtin_subjects
    from gaitval.prediction.known import told
    from gaitval.scaling.scaling import scale_subject
    from gaitval.simulation.walker import WalkingTask

    configuration = Configuration()
    known = told(person, configuration.record, builtin_subjects(), speed=speed, forced=True)
    body = scale_subject(person, symmetric=configuration.scaling.symmetric).model
    return WalkingTask.of(body, known.record, configuration, known.accuracy)


def _fell(person: "Subject", speed: float | None = None) -> int:
    """Of the starts of a person at a speed, m/s, or as recorded: walks of `CYCLES` that end in a
    fall.
    """
    from gaitval.model.parameters import nominal_parameters
    from gaitval.study.stored_policy import general_walker

    task = task_of(person, speed)
    policy = general_walker(task.configuration.environment, task.record, person.leg_length_m)
    return falls(task, policy, nominal_parameters(), CYCLES)


def falls(task: "WalkingTask", policy: "Policy", mu: "Array", cycles: float) -> int:
    """Of `STARTS` of a task with the parameters mu (14,), by a policy: walks of so many gait cycles
    that end in a fall.
    """
    import numpy as np

    from gaitval.policy.rollouts import walks_together
    from gaitval.policy.walking_group import WalkingGroup

    fell = np.zeros(STARTS, dtype=bool)
    starts = [{"phase": start / STARTS} for start in range(STARTS)]
    group = WalkingGroup([task] * STARTS)
    for walking, fallen in walks_together(group, policy, mu, starts, cycles):
        fell |= walking & fallen
    return int(fell.sum())


@evidence.measurement(
    ANYWAY, option("--out", type=Path, help="folder with the references, kept (default: none yet)")
)
def live(arguments: Namespace) -> list[evidence.Row]:
    """Pictures a second of `gaitval live 5` in Chromium, and how late a push is seen."""
    from evidence.browser import LACKING, program
    from evidence.report.replay import IDLE, idle_share

    browser, idle = program(), idle_share()
    print(f"{idle:.0%} of this machine is idle")
    if browser is None:
        raise SystemExit(LACKING)
    if idle < IDLE and not arguments.anyway:
        raise SystemExit("It is busy with other work, so it would measure that; or give --anyway.")
    with tempfile.TemporaryDirectory() as temporary:
        folder = str(arguments.out or temporary)
        command = [sys.executable, "-m", "gaitval", "live", "5", "--no-browser", "--out", folder]
        with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as walk:
            try:
                rate, delays = _looked_at(walk, browser, arguments.anyway)
            finally:
                walk.terminate()
    print(f"{rate:.1f} pictures/s; a push was seen after {sorted(delays)} ms")
    where = "in Chromium, software graphics"
    middle = statistics.median(delays)
    return [
        evidence.Row(f"live page: pictures a second {where}", rate, "1/s", ">=", 30, 20, 1),
        evidence.Row(
            f"live page: from the end of a drag to the picture with the push {where}, median",
            *(middle, "ms", "<=", 100, 250, len(delays)),
        ),
    ]


def _looked_at(walk: Any, browser: str, first: bool) -> tuple[float, list[float]]:
    """Pictures a second, and ms of each push, of the page whose address the process says."""
    from playwright.sync_api import sync_playwright

    from evidence.browser import FLAGS
    from evidence.report.replay import go_before_others

    line = walk.stdout.readline()
    address = next((word for word in line.split() if "://" in word), None)
    if address is None:
        raise SystemExit(f"gaitval live said no address, but {line!r}")
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=browser, args=list(FLAGS))
        page = opened.new_context(viewport=WINDOW).new_page()
        page.set_default_timeout(120_000)
        if first:
            go_before_others()
        page.goto(address)
        page.wait_for_selector("#live[data-frames]")
        page.wait_for_timeout(1000.0 * SETTLES)
        if first:
            go_before_others()
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
