"""Whether what gaitval says is true, as rows of `reports/evidence/first.csv`.

`verdicts` reads run folders of `make subject`, by whichever Python and number of workers. It counts
the verdicts that are not as in the subject's stored baseline, of which reports/README.md is made,
and says which `metrics.json` have the same bytes. `comparisons` and `mirrored` hold the walks of a
run folder against what was not recorded (`unrecorded_verdicts`); `outputs` imports a session and
reads every output of it (`one_number`). `defects` reads reports/first/defects.csv. `suite`
clones the checkout, sets it up, and takes the time of `make test` with nothing compiled yet; --log
reads what such a run printed. It says something only on an otherwise idle machine. `wheel`
builds the wheel, unpacks it into a folder of its own, and runs what README.md shows of
`gaitval check` and of the pytest plug-in in another, with nothing of the checkout.
"""

import argparse
import ast
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import evidence
from evidence import ROOT, option
from evidence import stale as stale_evidence
from evidence.report.plugin import example

DEFECTS: Final = ROOT / "reports" / "first" / "defects.csv"
COUNTED: Final = (
    *(f"report {number}" for number in range(1, 14)),
    *(f"newcomer {number}" for number in range(1, 15)),
)
"""Defects that must be fixed; the others of the table are printed beside them."""
Json = dict[str, Any]
RUNS: Final = option("--runs", nargs="+", type=Path, help="finished run folders")
DATA: Final = option("--data", type=Path, help="the folder of the raw data, to read more of it")
LOG: Final = option("--log", type=Path, help="what `make test` printed")

MEASURES = {
    "verdicts of *": {
        "code": ("@study", "evidence/first.py:verdicts,verdicts_of"),
        "data": ("reports/S??/baseline/metrics.json",),
    },
    "comparisons *": {
        "code": ("gaitval/metrics/*.py", "gaitval/reporting/*.py", "gaitval/apps/cohort/study.py",
                 "gaitval/terminal/display.py", "evidence/first.py:comparisons,unrecorded"),
        "allowed": 60,
        "why": "a test finds the same at every change, with walks that are made up",
    },
    "mirrored *": {
        "code": ("gaitval/metrics/*.py", "gaitval/reporting/*.py", "gaitval/apps/cohort/study.py",
                 "gaitval/terminal/display.py", "evidence/first.py:mirrored,unrecorded"),
        "allowed": 60,
        "why": "a test finds the same at every change, with walks that are made up",
    },
    "outputs *": {
        "code": ("@judged", "gaitval/importing/summary.py", "gaitval/reporting/recording_report.py",
                 "gaitval/cli/recording.py", "evidence/first.py:outputs"),
        "allowed": 60,
        "why": "a test finds the same at every change, with a recording that is made up",
    },
    "defects *": {
        "code": ("evidence/first.py:defects,missing_tests,COUNTED",),
        "data": ("reports/first/defects.csv",),
    },
    "README.md, *": {"code": ("evidence/first.py:readme",), "data": ("README.md",)},
    "make test, *": {
        "code": ("gaitval/*.py", "tests/*.py", "evidence/first.py:suite"),
        "data": ("Makefile",),
        "allowed": 400,
        "why": "one in a hundred of the package's and the tests' statements: 3 s of 5 min",
    },
    "stale rows *": {
        "code": ("evidence/stale.py", "evidence/sources.py", "evidence/first.py:stale"),
        "allowed": 5,
        "why": "tests/test_evidence_fresh.py counts them in every run",
    },
    "wheel in an empty folder: *": {
        "code": ("@checked", "gaitval/apps/regression/plugin.py", "hatch_build.py",
                 "evidence/first.py:wheel,lines_of,unpacked"),
        "data": ("README.md",),
    },
}  # fmt: skip
"""What the rows depend on; see evidence/stale.py."""


@evidence.measurement(RUNS)
def verdicts(arguments: argparse.Namespace) -> evidence.Row:
    """Verdicts of runs that are not those of the stored baselines."""
    if not arguments.runs:
        raise SystemExit("verdicts: give finished run folders by --runs")
    unequal = cases = equal_bytes = 0
    for folder in arguments.runs:
        content = (folder / "metrics.json").read_bytes()
        ran = json.loads(content)
        name = ran["subject"]["identifier"]
        stored = ROOT / "reports" / name / "baseline" / "metrics.json"
        found, wanted = verdicts_of(ran), verdicts_of(json.loads(stored.read_text("utf-8")))
        other = sorted(key for key in {*found, *wanted} if found.get(key) != wanted.get(key))
        same = content == stored.read_bytes()
        unequal, cases, equal_bytes = unequal + len(other), cases + len(wanted), equal_bytes + same
        print(f"{folder} ({name}): {len(other)} of {len(wanted)} verdicts are not as stored, "
              f"metrics.json {'the same bytes' if same else 'other bytes'}")  # fmt: skip
        for key in other:
            print(f"    {' '.join(key)}: {told(found.get(key))}, stored: {told(wanted.get(key))}")
    print(f"metrics.json of {equal_bytes} of {len(arguments.runs)} runs are the stored bytes.")
    what = f"verdicts of make subject that are not as in reports/, over {len(arguments.runs)} runs"
    return evidence.none_may(what, unequal, "verdicts", cases)


def verdicts_of(metrics: Json) -> dict[tuple[str, str], bool | None]:
    """Whether each limit is kept, by its name and what it is put to."""
    return {(row["id"], row["target"]): row["passed"] for row in metrics["tolerances"]}


def told(passed: bool | None) -> str:
    """A verdict in a word."""
    return {True: "passed", False: "failed", None: "none"}[passed]


@evidence.measurement(RUNS)
def comparisons(arguments: argparse.Namespace) -> evidence.Row:
    """Verdicts, goals and skills on what was predicted or expected, in every output."""
    what = "comparisons whose other side was not recorded, with a verdict, goal or skill"
    return unrecorded(arguments, ("predicted", "expected"), what)


@evidence.measurement(RUNS)
def mirrored(arguments: argparse.Namespace) -> evidence.Row:
    """The same on a side that is the other one's, mirrored."""
    return unrecorded(arguments, ("mirrored",), "mirrored sides in a verdict")


def unrecorded(arguments: argparse.Namespace, cases: Sequence[str], what: str) -> evidence.Row:
    """What `unrecorded_verdicts` finds of some of its cases, over every output."""
    from evidence.unrecorded_verdicts import count

    if not arguments.runs:
        raise SystemExit(f"{arguments.row}: give a finished run folder by --runs")
    found = {
        (folder, *key): problems
        for folder in arguments.runs
        for key, problems in count(folder).items()
        if key[0] in cases
    }
    if not found:
        raise SystemExit(f"{arguments.row}: unrecorded_verdicts knows no case {', '.join(cases)}.")
    for (folder, case, output), problems in found.items():
        print(f"{folder}, {case}, {output}: {len(problems)}", *problems[:5], sep="\n    ")
    total = sum(map(len, found.values()))
    return evidence.none_may(what, total, "comparisons", len(found))


@evidence.measurement(DATA)
def outputs(arguments: argparse.Namespace) -> evidence.Row:
    """Limits of recordings of which two outputs say different things."""
    from evidence.one_number import compared

    with tempfile.TemporaryDirectory() as folder:
        found = compared(Path(folder), arguments.data)
    print("\n".join(found.differences))
    print(f"{found.numbers} limits, {found.failed} failed, in {', '.join(found.outputs)}")
    what = "outputs that judge one number differently"
    return evidence.none_may(what, len(found.differences), "numbers", found.numbers)


@evidence.measurement()
def defects(_: argparse.Namespace) -> evidence.Row:
    """Defects of the audits that are fixed, by a test that is there."""
    rows = {row["defect"]: row for row in evidence.read(DEFECTS)}
    if lacking := [name for name in COUNTED if name not in rows]:
        raise SystemExit(f"{DEFECTS}: has no {', '.join(lacking)}.")
    for name, row in rows.items():
        if row["status"] not in ("open", "fixed", "not fixed"):
            raise SystemExit(f"{DEFECTS}, {name}: status {row['status']!r}.")
        if row["status"] == "fixed" and (gone := missing_tests(row["test"])):
            raise SystemExit(f"{DEFECTS}, {name}: no such test: {', '.join(gone)}.")
        if row["status"] == "not fixed" and not row["why_not"]:
            raise SystemExit(f"{DEFECTS}, {name}: say why not.")
        if row["status"] != "fixed":
            print(f"{name}: {row['status']}: {row['what_was_wrong']} {row['why_not']}")
    fixed = sum(rows[name]["status"] == "fixed" for name in COUNTED)
    count = len(COUNTED)
    what = "defects of the audits of the first run and of the report that are fixed"
    return evidence.Row(what, fixed, "defects", ">=", count, 25, count)


def missing_tests(named: str) -> list[str]:
    """Of tests named as pytest names them, split by spaces, those that are not there;
    and the lack of any.
    """
    missing = [] if named.split() else ["none is named"]
    for each in named.split():
        path, _, function = each.partition("::")
        file = ROOT / path
        tree = ast.parse(file.read_text(encoding="utf-8")) if file.is_file() else ast.Module([], [])
        known = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
        if not function.startswith("test_") or function not in known:
            missing.append(each)
    return missing


@evidence.measurement()
def readme(_: argparse.Namespace) -> evidence.Row:
    """Words of README.md, as `wc -w` counts them."""
    words = len((ROOT / "README.md").read_text(encoding="utf-8").split())
    return evidence.Row("README.md, words", words, "words", "<=", 1200, 1500, 1)


@evidence.measurement(LOG)
def suite(arguments: argparse.Namespace) -> evidence.Row:
    """Minutes of `make test` in a fresh clone, with nothing compiled, without the set-up."""
    if arguments.log:
        text = arguments.log.read_text(encoding="utf-8")
    else:
        with tempfile.TemporaryDirectory() as folder:
            clone = Path(folder) / "gaitval"
            subprocess.run(["git", "clone", "--quiet", str(ROOT), str(clone)], check=True)
            subprocess.run(["make", "setup"], cwd=clone, check=True, stdout=subprocess.DEVNULL)
            began = time.monotonic()
            done = subprocess.run(
                ["make", "test"], cwd=clone, stdout=subprocess.PIPE, text=True, check=False,
                env={**os.environ, "NUMBA_CACHE_DIR": str(Path(folder) / "compiled")},
            )  # fmt: skip
            print(f"make test: {time.monotonic() - began:.0f} s in all")
        text = done.stdout
    last = next(line for line in reversed(text.splitlines()) if re.search(r" in [\d.]+s", line))
    print(last)
    failed, passed = evidence.pytest_counts(last)
    if failed:
        raise SystemExit("make test fails: its time says nothing.")
    seconds = float(re.findall(r" in ([\d.]+)s", last)[-1])
    what = "make test, idle, fresh clone"
    return evidence.Row(what, seconds / 60, "min", "<=", 5, 6, passed)


@evidence.measurement()
def stale(_: argparse.Namespace) -> evidence.Row:
    """Rows of evidence whose code has changed."""
    found = stale_evidence.stale()
    for each in found:
        print(f"{each.topic}: {each.what}: {each.reason}")
    count = sum(len(evidence.read(path)) for path in evidence.FOLDER.glob("*.csv"))
    return evidence.none_may("stale rows of evidence", len(found), "rows", count)


@evidence.measurement()
def wheel(_: argparse.Namespace) -> evidence.Row:
    """README's lines for `check` and the plug-in that fail where only the wheel is."""
    lines, test = lines_of((ROOT / "README.md").read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        site, empty = unpacked(Path(folder)), Path(folder) / "empty"
        empty.mkdir()
        environment = {
            **{name: value for name, value in os.environ.items() if name != "GAITVAL_DATA"},
            "PYTHONPATH": str(site),
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        }

        def ended(command: Sequence[str]) -> int:
            done = subprocess.run(
                [sys.executable, *command], cwd=empty, env=environment, stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT, text=True, check=False,
            )  # fmt: skip
            print(f"{shlex.join(command)}: exit code {done.returncode}\n{done.stdout[-2000:]}")
            return done.returncode

        where = "import gaitval, sys; sys.exit(not gaitval.__file__.startswith(sys.argv[1]))"
        if ended(["-c", where, str(site)]):
            raise SystemExit("wheel: Python takes another gaitval than the wheel's.")
        failed = sum(ended(["-m", "gaitval", *line[1:]]) != 0 for line in lines)
        (empty / "test_walk.py").write_text(test, encoding="utf-8")
        failed += ended(["-m", "pytest", "-q", "-p", "gaitval.apps.regression.plugin"]) != 0
    what = "wheel in an empty folder: README's lines for check and plug-in that fail"
    return evidence.none_may(what, failed, "lines", len(lines) + 1)


def lines_of(text: str) -> tuple[list[list[str]], str]:
    """README's lines of `gaitval check`, split into words, and its test of the plug-in."""
    found = re.findall(r"^ {4}(gaitval check\b.*)$", text, re.MULTILINE)
    if not found:
        raise SystemExit("wheel: README.md shows no line of `gaitval check`.")
    return [shlex.split(line, comments=True) for line in found], example(text)


def unpacked(folder: Path) -> Path:
    """Folder with the content of the checkout's wheel."""
    command = ["-m", "build", "--wheel", "--no-isolation", f"--outdir={folder / 'dist'}", str(ROOT)]
    subprocess.run([sys.executable, *command], check=True, stdout=subprocess.DEVNULL)
    (made,) = (folder / "dist").glob("*.whl")
    with zipfile.ZipFile(made) as archive:
        archive.extractall(folder / "site")
    return folder / "site"
