"""What becomes of gaitval when somebody else attacks it, as rows of `reports/evidence/attack.csv`.

Readers of files are found in the sources: every call by which Python or a library reads a file.
Ways to run a program through a cohort are tests (`tests/cohort/test_attack.py`); malformed files
are those of `tests/robustness/fuzz.py`, with seeds of their own. The seconds of a check are those
of the processor, all its processes together, so that a busy machine counts as an idle one. Kills,
mutants, planted faults and ways to the same bits are those of `kills.py`, `mutants.py` and
`same_bits.py` in `tests/robustness`. A log lets a measurement go on where it was stopped, on the
same commit.
"""

import ast
import csv
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

import evidence
from evidence import ROOT, option

WAYS: Final = "code run by another user, or by a forged result"
OUTSIDE: Final = "readers not behind the gate"
MALFORMED: Final = "malformed files: exit 70, hang, > 2 GB, silent nonsense"
KINDS: Final = "malformed files: kinds"
CASES: Final = "malformed files: cases"
KILLED: Final = "kills over all commands that write, not equal after the next start"
LEFT: Final = "kills over all commands that write: processes, shared memory and files left"
KILLS: Final = "kills over all commands that write: number"
COMMANDS: Final = "kills over all commands that write: commands"
DISK: Final = "disk that fails at one operation of a command: no message, or not equal after"
FAULTY: Final = "disk that fails at one operation of a command: number"
STOPPED: Final = "commands that are stopped for minutes, not equal"
SAME: Final = "same bits over workers, threads, kills, commands: comparisons that differ"
ELSEWHERE: Final = "other instructions of NumPy and OpenBLAS: largest change of a measure, margins"
MUTANTS: Final = "mutants killed by the tests of their module, equivalent ones aside"
TRIED: Final = "mutants of metrics, gait, inverse and reference: number"
TABLE: Final = ROOT / "reports" / "robustness" / "mutants.csv"
"""The mutants of the row, with what is known of those that survive."""
PLANTED: Final = "faults planted as by an outsider, caught by tests"
CHECK: Final = "check --quick, processor time, caches compiled"
MEASURES = {
    "code run by another user, or by a forged result": {
        "code": ("gaitval/apps/cohort/*.py", "gaitval/file_gate.py", "evidence/attack.py:cohort"),
        "data": ("tests/cohort/test_attack.py", "tests/support/cohort_attacker.py"),
        "allowed": 40,
        "why": "the tests of the ways run in every run of the suite",
    },
    "readers not behind the gate": {
        "code": ("gaitval/*.py", "extras/*.py", "evidence/attack.py"),
        "allowed": 400,
        "why": "tests/test_readers.py finds every reader in every run of the suite",
    },
    "malformed files: *": {
        "code": (
            "@read",
            "gaitval/artefacts.py",
            "gaitval/file_gate.py",
            "gaitval/apps/judge/opensim/*.py",
            "tests/robustness/fuzz.py:run_case,_outcome,_work,turns,all_kinds",
            "tests/robustness/fuzz_cases.py",
            "tests/robustness/fuzz_commands.py",
            "tests/robustness/fuzz_mutators.py",
            "evidence/attack.py:malformed",
        ),
        "allowed": 40,
        "why": "a part of it runs in every run of the suite (tests/workflows/test_fuzz.py)",
    },
    "kills over *": {
        "code": (
            "gaitval/artefacts.py",
            "gaitval/partial_files.py",
            "gaitval/folder_lock.py",
            "gaitval/journal.py",
            "gaitval/study/run.py",
            "gaitval/study/stage.py",
            "gaitval/importing/write.py",
            "gaitval/importing/batch_person.py",
            "gaitval/importing/batch_imports.py",
            "gaitval/reporting/page.py",
            "gaitval/apps/regression/stored.py",
            "gaitval/apps/regression/baseline.py",
            "gaitval/apps/cohort/store.py",
            "gaitval/apps/cohort/process.py",
            "tests/robustness/kills.py:killed,further_jobs,contents,left,survived",
            "evidence/attack.py:kills",
        ),
        "allowed": 20,
        "why": "tests/test_partial_files.py and tests/workflows/test_kills.py kill in every run",
    },
    "disk that fails *": {
        "code": (
            "gaitval/artefacts.py",
            "gaitval/disk_errors.py",
            "gaitval/partial_files.py",
            "gaitval/folder_lock.py",
            "gaitval/journal.py",
            "gaitval/study/stage.py",
            "gaitval/importing/write.py",
            "tests/robustness/bad_disk.py",
            "evidence/attack.py:disk",
        ),
        "data": ("tests/robustness/bad_disk.c",),
        "allowed": 20,
        "why": "tests/workflows/test_bad_disk.py runs a part of it in every run of the suite",
    },
    "commands that are stopped *": {
        "code": (
            "gaitval/folder_lock.py",
            "gaitval/policy/processes.py",
            "gaitval/apps/cohort/task.py",
            "tests/robustness/bad_disk.py:Trial",
            "evidence/attack.py:disk",
        ),
        "allowed": 20,
        "why": "nothing else waits for another process by the clock",
    },
    "same bits *": {
        "code": ("@study", "gaitval/apps/cohort/task.py", "tests/robustness/same_bits.py"),
        "allowed": 60,
        "why": "one in a hundred of the statements of a study",
    },
    "other instructions *": {
        "code": ("@study", "tests/robustness/same_bits.py"),
        "allowed": 60,
        "why": "one in a hundred of the statements of a study",
    },
    "mutants *": {
        "code": (
            "gaitval/metrics/*.py",
            "gaitval/gait/*.py",
            "gaitval/inverse/*.py",
            "gaitval/reference/*.py",
            "tests/robustness/mutants.py",
            "evidence/attack.py:mutants",
        ),
        "allowed": 200,
        "why": "a sample: what changes is one in a hundred of what it is drawn from",
    },
    "faults planted *": {
        "code": ("tests/robustness/mutants.py", "evidence/attack.py:planted"),
        "data": ("tests/robustness/planted.toml",),
        "allowed": 20,
        "why": "tests/workflows/test_mutants.py plants each text in every run of the suite",
    },
    "check --quick, processor time, caches compiled": {
        "code": ("@walk", "@accepted", "@checked", "evidence/attack.py:check,_processor"),
        "allowed": 60,
        "why": "one in a hundred of the statements of a walk and its validation",
    },
}
"""What the rows depend on; see evidence/stale.py."""
CASES_OPTION: Final = option("--cases", type=int, default=8000, help="of all kinds together")
SEED: Final = option("--seed", type=int, default=43_000_000, help="of the first case of a kind")
SAMPLE: Final = option("--mutants", type=int, default=400, help="of the four folders together")
FAULTS: Final = option("--faults", type=int, default=100, help="of the disk")
STOPS: Final = option("--stops", type=int, default=13, help="of a command, for three minutes")
NUMBER: Final = option("--kills", type=int, default=120, help="of all commands together")
LOG: Final = option("--log", type=Path, help="a line for each case; goes on from it")
CONTROLS: Final = 2
"""Tests among the ways that show that an attack would be seen."""
READING: Final = frozenset(
    (
        *("open", "fdopen", "read_text", "read_bytes", "load", "load_file", "safe_open", "loadtxt"),
        *("genfromtxt", "fromfile", "memmap", "parse", "iterparse", "ZipFile", "TarFile", "c3d"),
        *("connect", "copyfile", "copy2", "copytree", "cat_file", "get_file", "from_xml_path"),
        *("safe_load", "run_path", "getlines", "read_metadata", "read_csv"),
        *("read_parquet", "read_excel", "read_json", "read_pickle", "read_hdf", "ParquetFile"),
        *("imread", "loadmat", "unpack_archive", "GzipFile", "BZ2File", "LZMAFile", "mmap"),
    )
)
"""Last names of calls that read a file, of Python and of libraries."""
LIBRARIES: Final = frozenset(
    (
        *("np", "numpy", "json", "tomllib", "pickle", "marshal", "joblib", "yaml", "torch"),
        *("yourdfpy.URDF", "ElementTree", "ET", "minidom", "expatbuilder", "configparser"),
    )
)
"""Whose `load` and `parse` read a file; other things are loaded as well."""
PARSING: Final = frozenset(("tomllib.loads", "pickle.loads", "marshal.loads", "ET.fromstring"))
"""Calls that no reader but the package's own (`OWN`) may use on a text, wherever it is from."""
GATE: Final = "file_gate"
OWN: Final = {
    "gaitval/apps/cohort/store.py:read": "object storage, of which it reads so many bytes",
    "gaitval/apps/cohort/process.py:peak_memory": "the system's own file on this process",
    "gaitval/datasets/download.py:_attempt": "continues what it has written itself",
    "gaitval/datasets/registry.py:registry": "registry.toml of the package",
    "gaitval/apps/export/mujoco_folder.py:write_mujoco": "a script of the package",
    "gaitval/apps/export/training_folder.py:write_training": "a script of the package",
    "gaitval/apps/export/walk.py:__init__": "runs without gaitval, on the folder beside it",
    "gaitval/apps/regression/history.py:this_machine": "the system's own file on the processor",
    "gaitval/scaling/markers/body.py:_table": "sites.toml of the package",
    "gaitval/scaling/markers/names.py:_meanings": "names.toml of the package",
    "gaitval/artefacts.py:_check_headers": "members of a file that `read_arrays` has looked at",
    "gaitval/artefacts.py:parse_toml": "the reader of TOML",
    "gaitval/compiled.py:_cache_folder": "the package's own sources",
    "gaitval/datasets/subject_file.py:_read_builtin": "the package's own subjects",
    "gaitval/learning_control/slopes.py:_stored": "shared_slopes.safetensors of the package",
    "gaitval/metrics/tolerances.py:load_registry": "tolerances.toml of the package",
    "gaitval/mocap/c3d_contents.py:read_contents": "what the reader's own process has written",
    "gaitval/mocap/c3d_process.py:opened": "in a process of its own, after `check_size`",
    "gaitval/mocap/c3d_writing.py:write_c3d": "makes an empty one",
    "gaitval/partial_files.py:own_folder": "locks a folder that it has made",
    "gaitval/partial_files.py:remove_abandoned": "locks a file, and reads nothing",
    "gaitval/reporting/checklist.py:checklist": "checklist.toml of the package",
    "gaitval/reporting/credibility.py:project_rows": "evidence.toml of the package",
    "gaitval/reporting/page.py:_font_faces": "fonts of the package",
    "gaitval/reporting/translated.py:_catalogue": "catalogues of the package",
    "gaitval/study/stage.py:_undone": "a run's own files, which are put back as they were",
    "gaitval/scaling/marker_sets.py:_builtin": "marker sets of the package",
    "gaitval/study/sources.py:_kept_at": "the package's own files",
    "gaitval/study/sources.py:_read_code": "the package's own data",
    "gaitval/study/sources.py:_tree": "the package's own sources",
}
"""Readers, by module and function, of what is the package's own or the gate has looked at before,
with the reason."""


class Reader(NamedTuple):
    """A call that reads a file: where it is, its name, and whether it is behind the gate."""

    place: str
    line: int
    call: str
    gated: bool


def readers() -> list[Reader]:
    """Every call of gaitval/ and extras/ that reads a file."""
    files = (*(ROOT / "gaitval").rglob("*.py"), *(ROOT / "extras").rglob("*.py"))
    return [
        each
        for path in sorted(files)
        for each in readers_in(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())
    ]


def readers_in(text: str, name: str) -> Iterator[Reader]:
    """Those of a module `name` by its `text`. A call is behind the gate if one of the gate's is
    in it, or was given the same file before it in the same function, or gave it what it reads.
    """
    tree = ast.parse(text)
    within: dict[ast.AST, ast.AST] = {}
    for node in ast.walk(tree):  # outer functions first
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            within |= dict.fromkeys(ast.walk(node), node)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and _reads(node):
            function = within.get(node, tree)
            place = f"{name}:{getattr(function, 'name', '')}"
            own = place in OWN or name == f"gaitval/{GATE}.py"
            gated = own or "resources.files" in ast.unparse(node) or _gated(node, function)
            yield Reader(place, node.lineno, ast.unparse(node.func), gated)


def _reads(node: ast.Call) -> bool:
    called = ast.unparse(node.func)
    base, _, last = called.rpartition(".")
    if base in (GATE, "webbrowser") or called == "read_json":  # behind the gate itself; a page
        return False
    if last in ("load", "parse") and base and base not in LIBRARIES:
        return False
    if called == "os.open":
        return "O_WRONLY" not in ast.unparse(node)
    if last in ("open", "fdopen"):
        given = node.args[1:2] if last == "fdopen" or not base else node.args[:1]
        modes = [*given, *(each.value for each in node.keywords if each.arg == "mode")]
        for mode in modes:
            if isinstance(mode, ast.Constant) and isinstance(mode.value, str):
                return mode.value[:1] not in "wax" or "+" in mode.value
    return last in READING or called in PARSING


def _gated(node: ast.Call, function: ast.AST) -> bool:
    """Whether what a call reads has gone through the gate in its function."""
    looked: set[str] = set()
    for each in ast.walk(function):
        if getattr(each, "lineno", 0) > (node.end_lineno or node.lineno):
            continue
        if isinstance(each, ast.Call) and _is_gate(each):
            looked.add(ast.unparse(each.args[0]))
        elif isinstance(each, ast.Assign) and any(map(_is_gate, ast.walk(each.value))):
            looked |= {ast.unparse(target) for target in each.targets}
    parts = {ast.unparse(each) for each in ast.walk(node) if isinstance(each, ast.expr)}
    return any(map(_is_gate, ast.walk(node))) or bool(looked & parts)


def _is_gate(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and ast.unparse(node.func).startswith(f"{GATE}.")


@evidence.measurement()
def cohort(_: Namespace) -> evidence.Row:
    """Ways to run a program as whoever runs a cohort, or to be believed by it."""
    paths = os.pathsep.join(map(str, [ROOT, ROOT / "extras", ROOT / "tests" / "support"]))
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n", "0", "tests/cohort/test_attack.py"],
        cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": paths},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    last = done.stdout.splitlines()[-1]
    print(last, flush=True)
    failed, passed = evidence.pytest_counts(last)
    if done.returncode and not failed:
        raise SystemExit(f"pytest did not run: exit code {done.returncode}")
    return evidence.none_may(WAYS, failed, "ways", failed + passed - CONTROLS)


@evidence.measurement()
def gate(_: Namespace) -> evidence.Row:
    """Calls of the sources that read a file which the gate has not seen."""
    found = readers()
    outside = [each for each in found if not each.gated]
    print("\n".join(map(str, outside)))
    return evidence.none_may(OUTSIDE, len(outside), "readers", len(found))


@evidence.measurement(option("--repeats", type=int, default=3, help="checks, of the median"))
def check(given: Namespace) -> evidence.Row:
    """Seconds of the processor that a quick check of a stored baseline takes."""
    seconds = [
        _processor("check", "--baseline", "S05", "--quick") for _ in range(given.repeats + 1)
    ]
    print(" ".join(f"{each:.2f} s" for each in seconds), "(the first compiles)", flush=True)
    return evidence.Row(CHECK, statistics.median(seconds[1:]), "s", "<=", 15, 25, given.repeats)


def _processor(*arguments: str) -> float:
    """Processor time of `gaitval` with these arguments and of all processes that it waits for, s,
    with as many threads as it takes by itself.
    """
    environment = {name: value for name, value in os.environ.items() if "_NUM_THREADS" not in name}
    paths = os.pathsep.join(map(str, [ROOT, ROOT / "extras"]))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "gaitval", *arguments],
        cwd=ROOT, env={**environment, "PYTHONPATH": paths}, stdout=subprocess.DEVNULL, check=True,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


@evidence.measurement(NUMBER, SEED, LOG)
def kills(given: Namespace) -> list[evidence.Row]:
    """Every command that writes, killed at random moments and started again."""
    with tempfile.TemporaryDirectory() as folder:
        log = (given.log or Path(folder) / "kills.jsonl").resolve()
        _robustness("kills.py", log, "--kills", str(given.kills), "--seed", str(given.seed))
        done = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    other = sum(bool(each["returned"] or each["differ"]) for each in done)
    left = sum(len(each[what]) for each in done for what in ("processes", "blocks", "files"))
    commands = len({each["job"] for each in done})
    return [
        evidence.none_may(KILLED, other, "kills", len(done)),
        evidence.none_may(LEFT, left, "1", len(done)),
        evidence.Row(KILLS, len(done), "kills", ">=", 120, 120, len(done)),
        evidence.Row(COMMANDS, commands, "commands", ">=", 13, 13, len(done)),
    ]


@evidence.measurement(FAULTS, STOPS, SEED, LOG)
def disk(given: Namespace) -> list[evidence.Row]:
    """Every command that writes, on a disk that fails, and stopped for three minutes."""
    with tempfile.TemporaryDirectory() as folder:
        log = (given.log or Path(folder) / "disk.jsonl").resolve()
        numbers = ("--cases", given.faults, "--stops", given.stops, "--seed", given.seed)
        _robustness("bad_disk.py", log, *map(str, numbers))
        done = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    stopped = [not each["survived"] for each in done if each["fault"] == "stopped"]
    faults = [not each["survived"] for each in done if each["fault"] != "stopped"]
    return [
        evidence.none_may(DISK, sum(faults), "cases", len(faults)),
        evidence.Row(FAULTY, len(faults), "cases", ">=", 100, 60, len(faults)),
        evidence.none_may(STOPPED, sum(stopped), "commands", len(stopped)),
    ]


@evidence.measurement(LOG)
def bits(given: Namespace) -> list[evidence.Row]:
    """Quick studies by other workers, threads, commands, after a kill, on other instructions."""
    with tempfile.TemporaryDirectory() as folder:
        log = (given.log or Path(folder) / "bits.jsonl").resolve()
        _robustness("same_bits.py", log)
        done = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    ours = [each for each in done if each["ours"]]
    others = [each for each in done if not each["ours"]]
    differ = sum(bool(each["differ"]) for each in ours)
    rows = [evidence.none_may(SAME, differ, "comparisons", len(ours))]
    if others:
        largest = max(each["margins"] for each in others)
        rows.append(evidence.Row(ELSEWHERE, largest, "1", "<=", 1, 1, len(others)))
    return rows


@evidence.measurement(SAMPLE, SEED, LOG)
def mutants(given: Namespace) -> list[evidence.Row]:
    """Small faults in `metrics`, `gait`, `inverse` and `reference`, against the module's tests."""
    with tempfile.TemporaryDirectory() as folder:
        log = (given.log or Path(folder) / "mutants.jsonl").resolve()
        _robustness("mutants.py", log, "--mutants", str(given.mutants), "--seed", str(given.seed))
        done = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    key = ("module", "line", "before", "after")
    known = {}
    if TABLE.is_file():
        with TABLE.open(newline="", encoding="utf-8") as file:
            known = {
                tuple(row[each] for each in key): row["equivalent"] for row in csv.DictReader(file)
            }
    for each in done:
        each["equivalent"] = known.get(tuple(str(each[name]) for name in key), "")
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        names = (*key, "killed", "equivalent")
        table = csv.DictWriter(file, names, extrasaction="ignore", lineterminator="\n")
        table.writeheader()
        table.writerows(sorted(done, key=lambda each: (each["module"], each["offset"])))
    counted = [each for each in done if each["killed"] or not each["equivalent"]]
    share = 100.0 * sum(each["killed"] for each in counted) / len(counted)
    return [
        evidence.Row(MUTANTS, share, "%", ">=", 90, 80, len(counted)),
        evidence.Row(TRIED, len(done), "mutants", ">=", 400, 400, len(done)),
    ]


@evidence.measurement(LOG)
def planted(given: Namespace) -> evidence.Row:
    """Faults of `tests/robustness/planted.toml`, against the tests that import their modules."""
    with tempfile.TemporaryDirectory() as folder:
        log = (given.log or Path(folder) / "planted.jsonl").resolve()
        _robustness("mutants.py", log, "--planted")
        done = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    missed = [each for each in done if not each["killed"]]
    print("\n".join(f"{each['module']}:{each['line']}: {each['after']}" for each in missed))
    share = 100.0 * (1.0 - len(missed) / len(done))
    return evidence.Row(PLANTED, share, "%", ">=", 100, 95, len(done))


def _robustness(script: str, log: Path, *arguments: str) -> None:
    """Run a script of tests/robustness, which writes a line into a log for each case. Raises
    SystemExit if it did not come to its end; `fuzz.py` ends with 1 if it has found something.
    """
    paths = os.pathsep.join(map(str, [ROOT, ROOT / "extras"]))
    done = subprocess.run(
        [sys.executable, str(ROOT / "tests" / "robustness" / script), *arguments, "--log", log],
        cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": paths}, check=False,
    )  # fmt: skip
    if done.returncode not in ((0, 1) if script == "fuzz.py" else (0,)):
        raise SystemExit(f"{script} ended with {done.returncode}")


@evidence.measurement(CASES_OPTION, SEED, LOG)
def malformed(given: Namespace) -> list[evidence.Row]:
    """Damaged files of every kind, most of them through whole commands."""
    with tempfile.TemporaryDirectory() as folder:
        log = (given.log or Path(folder) / "cases.jsonl").resolve()
        _robustness("fuzz.py", log, "--cases", str(given.cases), "--seed", str(given.seed))
        cases = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    bad = sum(each["outcome"] in ("silent", "fault") for each in cases)
    kinds = len({each["kind"] for each in cases})
    return [
        evidence.none_may(MALFORMED, bad, "cases", len(cases)),
        evidence.Row(CASES, len(cases), "cases", ">=", 20_000, 8_000, len(cases)),
        evidence.Row(KINDS, kinds, "kinds", ">=", 18, 18, len(cases)),
    ]
