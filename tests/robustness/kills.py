"""Kills commands at random moments, and starts each again.

    python tests/robustness/kills.py --kills 50 --seed 0            # goes on where it was stopped
    python tests/robustness/kills.py --kills 12 --jobs import study # some of them
    python tests/robustness/kills.py twice                          # two of each in one folder
    python tests/robustness/kills.py --kills 120 --log FILE         # every command that writes

Without --log, an import, a study, a report and a check; with it, all commands of `WRITING` in turn,
the cheap ones more often, and a line of JSON for each kill, from which it goes on.

Each is killed (SIGKILL, its own process only, as when memory runs out) after a random part of the
processor time that it takes without a kill, and started again by the same command. In every
second case all its files are dated a day ahead before that, as if the clock had gone back. Then
every file must be equal, byte for byte, to that without a kill, but for times (in
`provenance.json`; `wall_seconds` of learning; dates and durations in both pages of a report; of a
cohort also where and how long its studies ran), the hashes of files with times, `report.pdf`, which
is the compressed `report.html`, and TensorBoard's logs, which are named after time and process; and
no process, shared memory, temporary or partial file may be left beyond those that a
run without a kill leaves (torch keeps an empty folder for its compiler).
"""

import argparse
import csv
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from claims import commit
from gaitval.artefacts import read_json, versions, write_json
from gaitval.partial_files import PARTIAL

ROOT: Final = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from made_up_session import made_up_session  # noqa: E402
from quick_settings import QUICK  # noqa: E402

STORE: Final = ROOT / "reports" / "robustness" / "kills.json"
NOISE: Final = 0.001
"""m, of the markers of the session that is imported."""
SECONDS: Final = 1800.0
DAY: Final = 86400.0
TIMES: Final = ("started", "finished", "seconds")
"""Of each stage in `provenance.json`."""
LEARNING: Final = ("training.csv", "learning.csv")
CLOCK: Final = "wall_seconds"
"""Their column with times."""
CLOCKED: Final = (*LEARNING, "report.html", "report-details.html", "report.pdf")
"""Files with times."""
TIME: Final = re.compile(
    rb"( \xe2\x80\x93 )?\d{4}-\d\d-\d\d \d\d:\d\d UTC|>[\d.,]+ (s|min|h)</td>"
    rb"| in [\d.,]+ (seconds|minutes|hours)\."
    rb"|data:text/csv[^\"]*"
)
"""Dates and durations on a page, and the tables of its figures, which are files beside it too."""
BARE: Final = (".lock", "log.txt", "study.log", "events.out.tfevents")
"""How the names of files begin whose contents are nobody's."""
ENDING_SECONDS: Final = 300.0
"""s in which what a killed process started has to end: a worker that is only just starting takes
some seconds of a processor, which may be busy."""
JOBS: Final = ("import", "study", "report", "check")
WRITING: Final = {
    **{"baseline": 8, "compare": 5, "judge": 5, "sessions": 4, "import": 3},
    **{"export": 3, "report": 1, "virtual": 1, "subject": 1, "predict": 1, "screen": 1},
    "cohort": 1,
}
"""Commands that write, and how often each is killed in a turn: fewer times where it takes long."""
TIMED: Final = ("cohort.html", "studies.csv")
"""Files of a cohort that say how long and where its studies ran."""
Json = dict[str, Any]

SEVERAL: Final = """
import json, sys
from gaitval.cli import main

commands, setting, verdict = sys.argv[1:]
exec(setting)
for command in json.loads(commands):
    sys.argv = ["gaitval", *command]
    try:
        main()
    except SystemExit as end:
        if end.code not in (None, 0, int(verdict)):
            raise
"""


@dataclass(frozen=True)
class Job:
    """What is killed.

    Attributes
    ----------
    commands : of `gaitval`, one after the other in one process.
    folder : that it writes.
    before : what is in the folder before it starts; nothing if None.
    setting : Python that is run first, to make it shorter.
    verdict : exit code that is as good as 0: that of a model that fails a limit.
    """

    commands: list[list[str]]
    folder: Path
    before: Path | None = None
    setting: str = ""
    verdict: int = 0

    def prepared(self) -> None:
        """As before its first start."""
        shutil.rmtree(self.folder, ignore_errors=True)
        if self.before is not None:
            shutil.copytree(self.before, self.folder)

    def start(
        self, temporary: Path, environment: Mapping[str, str] | None = None
    ) -> "subprocess.Popen[str]":
        """Start it, in a session of its own, in which its workers can be found."""
        return subprocess.Popen(
            [
                sys.executable,
                "-c",
                SEVERAL,
                json.dumps(self.commands),
                self.setting,
                str(self.verdict),
            ],
            env={
                **os.environ,
                "TMPDIR": str(temporary),
                "OMP_NUM_THREADS": "1",
                "SOURCE_DATE_EPOCH": "0",  # the date on a page, else that of the clock
                **(environment or {}),
            },
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    def whole(self, temporary: Path) -> float:
        """Run it to its end; processor time that it takes, s."""
        process, used = self.start(temporary), 0.0
        while process.poll() is None:
            used = max(used, processor_time(process.pid))
            time.sleep(0.2)
        if process.returncode:
            text = process.stdout.read() if process.stdout else ""
            raise RuntimeError(f"{self.commands}: exit code {process.returncode}\n{text[-3000:]}")
        return used


def jobs(work: Path) -> dict[str, Job]:
    """All of them, in a folder of work; the files that they need are made."""
    (work / "session").mkdir()
    session = made_up_session(work / "session", noise=NOISE)
    request = session.request
    quick = [f"--set={each}" for each in QUICK]
    run = work / "run"
    measured = [f"--mass={request.mass_kg}", f"--height={request.height_m}", f"--sex={request.sex}"]
    files = [f"--static={session.standing}", f"--trial={session.walking}"]
    files.append(f"--forces={session.forces}")
    return {
        "import": Job([["import", *files, *measured, f"--out={work / 'P01'}"]], work / "P01"),
        "study": Job(
            [[name, "5", f"--out={run}", *quick] for name in ("scale", "reference", "train")], run
        ),
        "report": Job([["report", "5", f"--out={run}", "--force"]], run, work / "finished"),
        "check": Job(
            [
                [
                    *("check", f"--baseline={ROOT / 'reports' / 'S05' / 'baseline'}", "--quick"),
                    f"--junit={run / 'accuracy.xml'}",
                ]
            ],
            run,
            work / "empty",
        ),
    }


def further_jobs(work: Path) -> dict[str, Job]:
    """The other commands that write. What `baseline` stores is what `subject` has made."""
    import fuzz_commands

    made = work / "made"
    made.mkdir()
    fuzz_commands.write_judged(made)
    (made / "people.toml").write_text(
        f'[[people]]\nname = "P01"\nstatic = "{work}/session/stand.c3d"\n'
        f'trials = ["{work}/session/walk.trc"]\nforces = ["{work}/session/walk_forces.mot"]\n'
        'sex = "F"\nmass = 63.2\nheight = 1.66\n'
    )
    (made / "table.csv").write_text("name,subject\na,S05\nb,S08\n")
    stored = [str(ROOT / "reports" / name / "baseline") for name in ("S05", "S08")]
    judged = ("--ik", made / "ik.mot", "--id", made / "id.sto", "--markers", made / "judged.trc",
              "--grf", made / "grf.mot", "--external-loads", made / "loads.xml",
              "--mass", "60", "--height", "1.6")  # fmt: skip
    quick = [f"--set={each}" for each in QUICK]
    commands: dict[str, list[Any]] = {
        "baseline": ["5", "--out", work / "finished", "--to"],
        "compare": [*stored, "--out"],
        "judge": [made / "model.osim", *judged, "--out"],
        "sessions": [made / "people.toml", "--out"],
        "export": ["5", "--to", "c3d", "--out"],
        "virtual": ["--out"],
        "subject": ["5", *quick, "--out"],
        "predict": ["5", "--speed", "1.1", *quick, "--out"],
        "screen": ["5", "--out"],
        "cohort": [made / "table.csv", "--workers", "1", *quick, "--out"],
    }
    shorter = {
        "predict": "import gaitval.study.predicted_tasks as p; p.SPEEDS = 2",
        "screen": "import functools, gaitval.apps.virtual.screening as s; "
        "s.effects_of = functools.partial(s.effects_of, trajectories=1)",
    }
    made_by = {}
    for name, rest in commands.items():
        folder = work / f"{name}-out"
        out = folder / "table.csv" if name == "screen" else folder
        made_by[name] = Job(
            [["import" if name == "sessions" else name, *map(str, rest), str(out)]],
            folder,
            setting=shorter.get(name, ""),
            verdict=int(name == "judge"),
        )
    return made_by


def finished_study(work: Path, temporary: Path, known: Path | None) -> None:
    """A study to report, which `report` starts from; `known` is one that is finished already."""
    if known is not None and known.exists():
        shutil.copytree(known, work / "finished")
        return
    quick = [f"--set={each}" for each in QUICK]
    Job([["subject", "5", f"--out={work / 'run'}", *quick]], work / "run").whole(temporary)
    shutil.move(work / "run", work / "finished")
    if known is not None:
        shutil.copytree(work / "finished", known)


def contents(folder: Path) -> dict[str, bytes]:
    """All files of a folder, and what is partial, without what differs from run to run (see the top
    of this file).
    """
    return {
        path.relative_to(folder).as_posix(): _without_times(path) if path.is_file() else b""
        for path in sorted(folder.rglob("*"))
        if (path.is_file() or path.name.startswith(PARTIAL)) and not path.name.startswith(BARE)
    }


def _without_times(path: Path) -> bytes:
    if path.name in LEARNING:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [{**row, CLOCK: ""} for row in csv.DictReader(file)]
        return json.dumps(rows).encode()
    if path.name in TIMED:
        return b""
    if path.name in ("report.html", "report-details.html"):
        return TIME.sub(b"", path.read_bytes())
    if path.name == "report.pdf":
        return path.read_bytes()[:5]
    if path.name not in ("provenance.json", "stages.json"):
        return path.read_bytes()
    values = json.loads(path.read_text(encoding="utf-8"))
    stages = values.get("stages", {}) if path.name == "provenance.json" else values
    for stage in stages.values():
        for name in TIMES:
            stage.pop(name, None)
        for files in (stage.get("inputs"), stage.get("outputs")):
            # `policy` is the folder of another run, whose files are compared where they are
            for name in [n for n in files or () if n.endswith(CLOCKED) or n == "policy"]:
                files[name] = ""
    return json.dumps(values, sort_keys=True).encode()


def processes(session: int) -> list[int]:
    """Those that were started in a session, its first one among them, and live."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.append(int(stat.parent.name))
    return found


def processor_time(session: int) -> float:
    """Of the processes of a session and those that they have waited for, s. A busy machine takes
    longer for a run, but not more of it.
    """
    ticks = 0
    for process in processes(session):
        try:
            fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        ticks += sum(map(int, fields[11:15]))
    return float(ticks) / os.sysconf("SC_CLK_TCK")


def shared_memory(session: int) -> set[str]:
    """Blocks with a name that the processes of a session have mapped."""
    found = set()
    for process in processes(session):
        try:
            lines = Path(f"/proc/{process}/maps").read_text().splitlines()
        except OSError:
            continue
        found |= {line.split()[-1] for line in lines if "/dev/shm/" in line}
    return {name for name in found if not name.endswith("(deleted)") and Path(name).exists()}


def still_there(session: int) -> list[str]:
    """Commands of the processes of a session that do not end by themselves."""
    end = time.monotonic() + ENDING_SECONDS
    while (alive := processes(session)) and time.monotonic() < end:
        time.sleep(0.1)
    commands = []
    for process in alive:
        with suppress(OSError):
            words = Path(f"/proc/{process}/cmdline").read_text().replace("\0", " ")
            commands.append(words[:200])
    return commands


def killed(job: Job, after: float, temporary: Path, *, clock_back: bool) -> Json | None:
    """Kill a job after some processor time, s, and start it again; None if it ended before."""
    job.prepared()
    process = job.start(temporary)
    while process.poll() is None and processor_time(process.pid) < after:
        time.sleep(0.05)
    blocks = shared_memory(process.pid)
    process.kill()
    process.communicate()
    if process.returncode != -signal.SIGKILL:
        return None
    alive = still_there(process.pid)  # its workers notice that it has gone
    if clock_back:
        ahead = time.time() + DAY
        for path in (*job.folder.rglob("*"), *temporary.rglob("*")):
            os.utime(path, (ahead, ahead), follow_symlinks=False)
    else:  # what a killed check has left is removed when it is a minute old
        for path in temporary.iterdir():
            os.utime(path, (time.time() - DAY,) * 2, follow_symlinks=False)
    again = job.start(temporary)
    text, _ = again.communicate(timeout=SECONDS)
    alive += still_there(again.pid)
    return {
        "returned": again.returncode,
        "told": masked(text, temporary)[-500:] if again.returncode else "",
        "processes": alive,
        "blocks": sorted(name for name in blocks if Path(name).exists()),
        "files": sorted(path.name for path in temporary.iterdir()),
    }


@contextmanager
def workplace() -> Iterator[tuple[Path, Path, dict[str, Job]]]:
    """A folder to work in, one for temporary files, and the jobs."""
    with tempfile.TemporaryDirectory(prefix="gaitval-kills-") as folder:
        work, temporary = Path(folder) / "work", Path(folder) / "tmp"
        for path in (work, temporary, work / "empty"):
            path.mkdir()
        yield work, temporary, jobs(work)


class Killing:
    """Jobs that are killed one after the other.

    Attributes
    ----------
    jobs : by name.
    temporary : folder for their temporary files.
    """

    def __init__(self, made: Mapping[str, Job], temporary: Path) -> None:
        self.jobs, self.temporary = made, temporary
        self._usual: dict[str, tuple[float, dict[str, bytes], list[str]]] = {}

    def usual(self, name: str) -> tuple[float, dict[str, bytes], list[str]]:
        """Processor time, s, of a job that nobody kills, its files and temporary ones."""
        if name not in self._usual:
            job = self.jobs[name]
            job.prepared()
            seconds = job.whole(self.temporary)
            self._usual[name] = seconds, contents(job.folder), emptied(self.temporary)
        return self._usual[name]

    def kill(self, name: str, number: int, seed: int) -> Json:
        """What becomes of a job that is killed at a moment that follows from seed and number."""
        seconds, _, _ = self.usual(name)
        job, clock_back = self.jobs[name], number % 2 == 1
        share = random.Random(f"{seed} {number}").uniform(0.02, 1.0)
        found, tries = None, 0
        while found is None:  # it ended before
            after = share * seconds * 0.9**tries
            found = killed(job, after, self.temporary, clock_back=clock_back)
            tries += 1
        about = {"job": name, "share": round(share, 3), "clock_back": clock_back, "seed": seed}
        return found | about | self.spoilt(name)

    def spoilt(self, name: str) -> Json:
        """What a job has left in its folder that differs from a run that nobody disturbs, and the
        temporary files that such a run does not leave; these are removed.
        """
        _, wanted, always = self.usual(name)
        now = contents(self.jobs[name].folder)
        differ = sorted(file for file in {*now, *wanted} if now.get(file) != wanted.get(file))
        return {"differ": differ, "files": sorted({*emptied(self.temporary)} - {*always})}


def kills(count: int, seed: int, names: list[str], study: Path | None = None) -> None:
    """Kill each of the jobs in turn, until there are so many kills in the store."""
    with workplace() as (work, temporary, made):
        if "report" in names:
            finished_study(work, temporary, study)
            emptied(temporary)
        killing = Killing(made, temporary)
        while len(done := _stored().get("kills", [])) < count:
            number = len(done)
            found = killing.kill(names[number % len(names)], number, seed)
            _save(kills=[*done, found])
            print(json.dumps(found), flush=True)


def turn(often: Mapping[str, int] = WRITING) -> list[str]:
    """Commands as `often` as they are killed in a turn, the cheap ones between."""
    places = [((2 * i + 1) / (2 * n), name) for name, n in often.items() for i in range(n)]
    return [name for _, name in sorted(places, key=lambda place: place[0])]


def all_kills(count: int, seed: int, log: Path, study: Path | None, names: list[str]) -> None:
    """Kill every command that writes in turn, until there are so many kills in the log."""
    order = [name for name in turn() if name in names]
    with workplace() as (work, temporary, made):
        killing = Killing(made | further_jobs(work), temporary)
        if study is None:
            killing.usual("subject")
            study = killing.jobs["subject"].folder
        shutil.copytree(study, work / "finished")
        while (number := len(logged(log))) < count:
            found = killing.kill(order[number % len(order)], number, seed)
            with log.open("a", encoding="utf-8") as file:
                file.write(json.dumps(found) + "\n")
            print(json.dumps(found), flush=True)


def logged(log: Path) -> list[Json]:
    """The kills of a log."""
    lines = log.read_text(encoding="utf-8").splitlines() if log.exists() else []
    return [json.loads(line) for line in lines]


def emptied(folder: Path) -> list[str]:
    """The names of what is in a folder, which is empty afterwards."""
    names = sorted(path.name for path in folder.iterdir())
    shutil.rmtree(folder)
    folder.mkdir()
    return names


def twice(names: list[str]) -> None:
    """Two of each at once in one folder: one is refused or both end, and the files are the same."""
    found = {}
    with workplace() as (_, temporary, made):
        for name in names:
            job = made[name]
            job.prepared()
            job.whole(temporary)
            wanted = contents(job.folder)
            job.prepared()
            found[name] = at_once(job, wanted, temporary)
            print(json.dumps({name: found[name]}), flush=True)
            _save(twice={**_stored().get("twice", {}), name: found[name]})


def at_once(job: Job, wanted: Mapping[str, bytes], temporary: Path) -> Json:
    """Start a job that is `prepared` twice: the exit codes, and whether the files are those that
    are wanted.
    """
    both = [job.start(temporary) for _ in range(2)]
    messages = [process.communicate(timeout=SECONDS)[0] for process in both]
    codes = sorted(process.returncode for process in both)
    same = contents(job.folder) == wanted
    return {
        "codes": codes,
        "same": same,
        "told": [masked(text, temporary)[-300:] for text in messages],
    }


def masked(text: str, temporary: Path) -> str:
    """What a job said, with the folders of this machine left out."""
    return text.replace(f"{temporary.parent}/", "").replace(f"{ROOT}/", "")


def survived(kill: Json) -> bool:
    """Whether a job that was killed ended well with the same files."""
    return kill["returned"] == 0 and not kill["differ"]


def left(kill: Json) -> int:
    """Number of processes, blocks of shared memory and temporary files that a kill left."""
    return sum(len(kill[what]) for what in ("processes", "blocks", "files"))


def unspoilt(both: Json) -> bool:
    """Whether of two at once one was refused, or both ended well, and the files are right."""
    return both["same"] and both["codes"] in ([0, 0], [0, 2])


def message(stored: Json) -> list[str]:
    """What the store has shown, in sentences."""
    found = []
    if done := stored.get("kills", []):
        found.append(f"{sum(map(survived, done))} of {len(done)} kills survived bit-equal; they "
                     f"left {sum(map(left, done))} processes, blocks and files")  # fmt: skip
    if each := list(stored.get("twice", {}).values()):
        wrong = sum(not unspoilt(one) for one in each)
        found.append(f"{wrong} of {len(each)} pairs in one folder spoil each other")
    return found


def _stored() -> Json:
    """What is in the store, if it is of this commit."""
    found = dict(read_json(STORE)) if STORE.exists() else {}
    return found if found.get("commit") == commit() else {}


def _save(**parts: Any) -> None:
    STORE.parent.mkdir(parents=True, exist_ok=True)
    about = {"date": datetime.now(UTC).date().isoformat(), "versions": versions(),
             "commit": commit()}  # fmt: skip
    write_json(STORE, {**_stored(), **parts, **about})


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="?", default="kills", choices=["kills", "twice"])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--study", type=Path, metavar="FOLDER", help="the study to report, for a run in parts"
    )
    parser.add_argument("--jobs", nargs="+", choices=sorted({*JOBS, *WRITING}))
    parser.add_argument("--log", type=Path, help="kill all commands that write, and go on from it")
    arguments = parser.parse_args()
    if arguments.log is not None:
        names = arguments.jobs or list(WRITING)
        all_kills(arguments.kills, arguments.seed, arguments.log, arguments.study, names)
        return
    arguments.jobs = arguments.jobs or list(JOBS)
    if arguments.what == "kills":
        kills(arguments.kills, arguments.seed, arguments.jobs, arguments.study)
    elif arguments.what == "twice":
        twice([name for name in arguments.jobs if name in ("import", "study")])
    print("\n".join(message(_stored())))


if __name__ == "__main__":
    main()
