"""Kills an import, a study, a report and a check at random moments, and starts each again.

    python tests/robustness/kills.py --kills 50 --seed 0            # goes on where it was stopped
    python tests/robustness/kills.py --kills 12 --jobs import study # some of them
    python tests/robustness/kills.py twice                          # two of each in one folder

Each is killed (SIGKILL, its own process only, as when memory runs out) after a random part of the
processor time that it takes without a kill, and started again by the same command. In every
second case all its files are dated a day ahead before that, as if the clock had gone back. Then
every file must be equal, byte for byte, to that without a kill, but for times (in
`provenance.json`; `wall_seconds` in `training.csv`, and so its hash in `stages.json`) and
TensorBoard's logs, which are named after time and process; and no process, shared memory or
temporary file may be left beyond those that a run without a kill leaves (torch keeps an empty
folder for its compiler).
"""

import argparse
import csv
import json
import os
import random
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

import evidence
from gaitval.artefacts import read_json, versions, write_json

ROOT: Final = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from made_up_session import made_up_session  # noqa: E402
from quick_settings import QUICK  # noqa: E402

STORE: Final = ROOT / "reports" / "robustness" / "kills.json"
COMMAND: Final = "python tests/robustness/kills.py"
NOISE: Final = 0.001
"""m, of the markers of the session that is imported."""
SECONDS: Final = 1800.0
DAY: Final = 86400.0
TIMES: Final = ("started", "finished", "seconds")
"""Of each stage in `provenance.json`."""
TRAINING: Final = "training.csv"
CLOCK: Final = "wall_seconds"
"""Its column with times."""
BARE: Final = (".lock", "events.out.tfevents")
"""How the names of files begin whose contents are nobody's."""
ENDING_SECONDS: Final = 300.0
"""s in which what a killed process started has to end: a worker that is only just starting takes
some seconds of a processor, which may be busy."""
JOBS: Final = ("import", "study", "report", "check")
Json = dict[str, Any]

SEVERAL: Final = """
import json, sys
from gaitval.cli import main

for command in json.loads(sys.argv[1]):
    sys.argv = ["gaitval", *command]
    try:
        main()
    except SystemExit as end:
        if end.code:
            raise
"""
MEASURES = {
    "*": {
        "code": (
            "gaitval/artefacts.py",
            "gaitval/folder_lock.py",
            "gaitval/journal.py",
            "gaitval/study/run.py",
            "gaitval/study/stage.py",
            "gaitval/policy/learner.py",
            "gaitval/policy/processes.py",
            "gaitval/policy/storage.py",
            "gaitval/policy/training.py",
            "gaitval/session/importing.py",
            "gaitval/session/write.py",
            "gaitval/reporting/page.py",
            "gaitval/reporting/report.py",
        ),
    },
}
"""What the rows depend on; see evidence/stale.py."""


@dataclass(frozen=True)
class Job:
    """What is killed.

    Attributes
    ----------
    commands : of `gaitval`, one after the other in one process.
    folder : that it writes.
    before : what is in the folder before it starts; nothing if None.
    """

    commands: list[list[str]]
    folder: Path
    before: Path | None = None

    def prepared(self) -> None:
        """As before its first start."""
        shutil.rmtree(self.folder, ignore_errors=True)
        if self.before is not None:
            shutil.copytree(self.before, self.folder)

    def start(self, temporary: Path) -> "subprocess.Popen[str]":
        """Start it, in a session of its own, in which its workers can be found."""
        return subprocess.Popen(
            [sys.executable, "-c", SEVERAL, json.dumps(self.commands)],
            env={
                **os.environ,
                "TMPDIR": str(temporary),
                "OMP_NUM_THREADS": "1",
                "SOURCE_DATE_EPOCH": "0",  # the date on a page, else that of the clock
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
            told = process.stdout.read() if process.stdout else ""
            raise RuntimeError(f"{self.commands}: exit code {process.returncode}\n{told[-3000:]}")
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
    """All files of a folder, without what differs from run to run (see the top of this file)."""
    return {
        path.relative_to(folder).as_posix(): _without_times(path)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not path.name.startswith(BARE)
    }


def _without_times(path: Path) -> bytes:
    if path.name == TRAINING:
        with path.open(newline="", encoding="utf-8") as file:
            rows = [{**row, CLOCK: ""} for row in csv.DictReader(file)]
        return json.dumps(rows).encode()
    if path.name not in ("provenance.json", "stages.json"):
        return path.read_bytes()
    values = json.loads(path.read_text(encoding="utf-8"))
    stages = values.get("stages", {}) if path.name == "provenance.json" else values
    for stage in stages.values():
        for name in TIMES:
            stage.pop(name, None)
        for files in (stage.get("inputs"), stage.get("outputs")):
            for name in [name for name in files or () if name.endswith(TRAINING)]:
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


def _still_there(session: int) -> list[str]:
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
    alive = _still_there(process.pid)  # its workers notice that it has gone
    if clock_back:
        ahead = time.time() + DAY
        for path in (*job.folder.rglob("*"), *temporary.rglob("*")):
            os.utime(path, (ahead, ahead), follow_symlinks=False)
    else:  # what a killed check has left is removed when it is a minute old
        for path in temporary.iterdir():
            os.utime(path, (time.time() - DAY,) * 2, follow_symlinks=False)
    again = job.start(temporary)
    told, _ = again.communicate(timeout=SECONDS)
    alive += _still_there(again.pid)
    return {
        "returned": again.returncode,
        "told": told[-500:] if again.returncode else "",
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


def kills(count: int, seed: int, names: list[str], study: Path | None = None) -> None:
    """Kill each of the jobs in turn, until there are so many kills in the store."""
    with workplace() as (work, temporary, made):
        if "report" in names:
            finished_study(work, temporary, study)
            emptied(temporary)
        usual: dict[str, tuple[float, dict[str, bytes], list[str]]] = {}
        while len(done := _stored().get("kills", [])) < count:
            number = len(done)
            name = names[number % len(names)]
            job = made[name]
            if name not in usual:
                job.prepared()
                usual[name] = job.whole(temporary), contents(job.folder), emptied(temporary)
            seconds, wanted, always = usual[name]
            share = random.Random(f"{seed} {number}").uniform(0.02, 1.0)
            found, tries = None, 0
            while found is None:  # it ended before
                found = killed(
                    job, share * seconds * 0.9**tries, temporary, clock_back=number % 2 == 1
                )
                tries += 1
            found["files"] = sorted({*found["files"]} - {*always})
            now = contents(job.folder)
            differ = sorted(file for file in {*now, *wanted} if now.get(file) != wanted.get(file))
            found |= {"job": name, "share": round(share, 3), "clock_back": number % 2 == 1}
            found |= {"differ": differ, "seed": seed}
            _save(kills=[*done, found])
            emptied(temporary)
            print(json.dumps(found), flush=True)


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
    told = [process.communicate(timeout=SECONDS)[0] for process in both]
    codes = sorted(process.returncode for process in both)
    same = contents(job.folder) == wanted
    return {"codes": codes, "same": same, "told": [text[-300:] for text in told]}


def survived(kill: Json) -> bool:
    """Whether a job that was killed ended well with the same files."""
    return kill["returned"] == 0 and not kill["differ"]


def left(kill: Json) -> int:
    """Number of processes, blocks of shared memory and temporary files that a kill left."""
    return sum(len(kill[what]) for what in ("processes", "blocks", "files"))


def unspoilt(both: Json) -> bool:
    """Whether of two at once one was refused, or both ended well, and the files are right."""
    return both["same"] and both["codes"] in ([0, 0], [0, 2])


def rows(stored: Json) -> dict[str, list[evidence.Row]]:
    """The evidence, by what makes it."""
    done = stored.get("kills", [])
    made = {}
    if done:
        n = len(done)
        share = 100.0 * sum(map(survived, done)) / n
        made["kills"] = [
            evidence.Row(
                "kills survived bit-equal (import, study, report, check)",
                share, "%", ">=", 100, 100, n,
            ),
            evidence.none_may(
                "shared memory, processes and temporary files left by kills",
                sum(map(left, done)), "1", n,
            ),
        ]  # fmt: skip
    if "twice" in stored:
        each = stored["twice"].values()
        wrong = sum(not unspoilt(one) for one in each)
        what = "two at once in one folder that spoil each other"
        made["twice"] = [evidence.none_may(what, wrong, "1", len(each))]
    return made


def _stored() -> Json:
    """What is in the store, if it is of this commit."""
    found = dict(read_json(STORE)) if STORE.exists() else {}
    return found if found.get("commit") == evidence.STARTED else {}


def _save(**parts: Any) -> None:
    STORE.parent.mkdir(parents=True, exist_ok=True)
    about = {"date": datetime.now(UTC).date().isoformat(), "versions": versions(),
             "commit": evidence.STARTED}  # fmt: skip
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
    parser.add_argument("--jobs", nargs="+", choices=JOBS, default=list(JOBS))
    arguments = parser.parse_args()
    if arguments.what == "kills":
        kills(arguments.kills, arguments.seed, arguments.jobs, arguments.study)
    elif arguments.what == "twice":
        twice([name for name in arguments.jobs if name in ("import", "study")])
    for what, found in rows(_stored()).items():
        print(evidence.write("robustness", found, f"{COMMAND} {what}"))


if __name__ == "__main__":
    main()
