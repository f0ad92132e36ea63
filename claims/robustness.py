"""What becomes of gaitval under damaged files, kills and bad disks.

Malformed files, kills, disks and ways to the same bits are those of `tests/robustness`; their logs
stay below `work`, by commit, so that a measurement that was stopped goes on. Ways to run a program
through a cohort are tests (`tests/cohort/test_attack.py`).
"""

import json
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

import claims
from claims import ROOT, Claim
from claims.rows import STARTED

SEED: Final = 43_000_000
"""Of the first case of a kind; no other run of the fuzzer uses seeds from here on."""
CASES: Final = 8000
FAULTS: Final = 60
"""Operations on a disk that fail, of all commands together."""
STOPS: Final = 13
KILLS: Final = 120
WORKERS_KILLED: Final = 10
STUDIES: Final = 24


@claims.measured()
def malformed(given: claims.Given) -> list[Claim]:
    """Damaged files of every kind, most of them through whole commands."""
    cases = _cases("fuzz.py", given, "--cases", CASES, "--seed", SEED)
    bad = sum(each["outcome"] in ("silent", "fault") for each in cases)
    kinds = len({each["kind"] for each in cases})
    what = "malformed files: exit 70, hang, > 2 GB, silent nonsense"
    return [
        Claim(what, bad, "cases", len(cases)),
        Claim("malformed files: kinds", kinds, "kinds", len(cases)),
    ]


@claims.measured()
def kills(given: claims.Given) -> list[Claim]:
    """Every command that writes, killed at random moments and started again."""
    done = _cases("kills.py", given, "--kills", KILLS, "--seed", SEED)
    other = sum(bool(each["returned"] or each["differ"]) for each in done)
    left = sum(len(each[what]) for each in done for what in ("processes", "blocks", "files"))
    what = "kills over all commands that write"
    return [
        Claim(f"{what}, not equal after the next start", other, "kills", len(done)),
        Claim(f"{what}: processes, shared memory and files left", left, "1", len(done)),
    ]


@claims.measured()
def disk(given: claims.Given) -> list[Claim]:
    """Every command that writes, on a disk that fails, and stopped for three minutes."""
    done = _cases("bad_disk.py", given, "--cases", FAULTS, "--stops", STOPS, "--seed", SEED)
    stopped = [not each["survived"] for each in done if each["fault"] == "stopped"]
    faults = [not each["survived"] for each in done if each["fault"] != "stopped"]
    what = "disk that fails at one operation of a command: no message, or not equal after"
    return [
        Claim(what, sum(faults), "cases", len(faults)),
        Claim("commands that are stopped for minutes, not equal", sum(stopped), "commands",
              len(stopped)),
    ]  # fmt: skip


@claims.measured()
def bits(given: claims.Given) -> list[Claim]:
    """Quick studies by other workers, threads, commands, after a kill, on other instructions."""
    done = _cases("same_bits.py", given)
    ours = [each for each in done if each["ours"]]
    others = [each for each in done if not each["ours"]]
    differ = sum(bool(each["differ"]) for each in ours)
    what = "same bits over workers, threads, kills, commands: comparisons that differ"
    rows = [Claim(what, differ, "comparisons", len(ours))]
    if others:
        what = "other instructions of NumPy and OpenBLAS: largest change of a measure, margins"
        rows.append(Claim(what, max(each["margins"] for each in others), "1", len(others)))
    return rows


@claims.measured()
def cohort(given: claims.Given) -> list[Claim]:
    """A cohort of quick studies whose workers and scheduler are killed, against one that is not."""
    sys.path.insert(0, str(ROOT / "tests" / "support"))
    from killed_cohort import killed, quick, results

    work = given.work / "cohort"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    os.environ["PYTHONPATH"] = _environment()["PYTHONPATH"]
    names = [f"study{number}_sleep4" for number in range(STUDIES)]
    found = killed(quick(work / "broken", "2", names), work / "broken", kills=WORKERS_KILLED,
                   seed=0, pause=4.0, limit=36_000.0)  # fmt: skip
    now = {name: json.loads(text) for name, text in results(work / "broken").items()}
    with ThreadPoolExecutor(len(names)) as pool:
        wanted = dict(zip(names, pool.map(lambda name: _alone(work, name), names), strict=True))
    if found["kills"] != WORKERS_KILLED or not found["halfway"]:
        raise RuntimeError(f"the run says nothing: {found}")
    equal = [name for name in names if now.get(name) == wanted[name]]
    what = (
        f"studies complete with equal results after {WORKERS_KILLED} kills of workers and one of "
    )
    return [
        Claim(f"{what}the scheduler (studies of 4 s)", 100.0 * len(equal) / len(names), "%",
              len(names)),
        Claim("processes of studies left by the scheduler's end (studies of 4 s)", found["left"],
              "1", 1),
    ]  # fmt: skip


def _alone(work: Path, name: str) -> dict[str, Any]:
    """The summary of a quick study that nothing happens to."""
    import quick_study

    from gaitval.study.stage import Observer

    folder = work / "alone" / name
    folder.mkdir(parents=True)
    found = quick_study.work(SimpleNamespace(name=name), folder, 1, Observer())
    return dict(json.loads(json.dumps(found)))


def _cases(script: str, given: claims.Given, *arguments: object) -> list[dict[str, Any]]:
    """Run a script of tests/robustness and read the log in which each case has a line. `fuzz.py`
    ends with 1 if it has found something; others must end with 0.
    """
    log = given.work / f"{script}-{STARTED}.jsonl"
    words = [str(ROOT / "tests" / "robustness" / script), *map(str, arguments), "--log", str(log)]
    done = subprocess.run([sys.executable, *words], cwd=ROOT, env=_environment(), check=False)
    if done.returncode not in ((0, 1) if script == "fuzz.py" else (0,)):
        raise RuntimeError(f"{script} ended with {done.returncode}")
    return [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]


def _environment() -> dict[str, str]:
    paths = map(str, [ROOT, ROOT / "tests" / "support"])
    return {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(paths)}
