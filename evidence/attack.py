"""What becomes of gaitval when somebody else attacks it, as rows of `reports/evidence/attack.csv`.

Readers of files are found in the sources: every call by which Python or a library reads a file.
Ways to run a program through a cohort are tests (`tests/cohort/test_attack.py`); malformed files
are those of `tests/robustness/fuzz.py`, with seeds of their own.
"""

import ast
import json
import os
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
MEASURES = {
    "code run by another user, or by a forged result": {
        "code": ("extras/gaitval_cohort/*.py", "gaitval/file_gate.py", "evidence/attack.py:cohort"),
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
            "extras/gaitval_judge/opensim/*.py",
            "tests/robustness/fuzz.py:run_case,_outcome,_work,turns,all_kinds",
            "tests/robustness/fuzz_cases.py",
            "tests/robustness/fuzz_commands.py",
            "tests/robustness/fuzz_mutators.py",
            "evidence/attack.py:malformed",
        ),
        "allowed": 40,
        "why": "a part of it runs in every run of the suite (tests/workflows/test_fuzz.py)",
    },
}
"""What the rows depend on; see evidence/stale.py."""
CASES_OPTION: Final = option("--cases", type=int, default=8000, help="of all kinds together")
SEED: Final = option("--seed", type=int, default=43_000_000, help="of the first case of a kind")
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
    "extras/gaitval_cohort/store.py:read": "object storage, of which it reads so many bytes",
    "extras/gaitval_cohort/process.py:peak_memory": "the system's own file on this process",
    "extras/gaitval_curves/download.py:_attempt": "continues what it has written itself",
    "extras/gaitval_curves/registry.py:registry": "registry.toml of the package",
    "extras/gaitval_export/mujoco_folder.py:write_mujoco": "a script of the package",
    "extras/gaitval_export/training_folder.py:write_training": "a script of the package",
    "extras/gaitval_export/walk.py:__init__": "runs without gaitval, on the folder beside it",
    "extras/gaitval_gate/history.py:this_machine": "the system's own file on the processor",
    "extras/gaitval_markers/body.py:_table": "sites.toml of the package",
    "extras/gaitval_markers/names.py:_meanings": "names.toml of the package",
    "gaitval/artefacts.py:_check_headers": "members of a file that `read_arrays` has looked at",
    "gaitval/artefacts.py:parse_toml": "the reader of TOML",
    "gaitval/compiled.py:_cache_folder": "the package's own sources",
    "gaitval/datasets/subject_file.py:_read_builtin": "the package's own subjects",
    "gaitval/metrics/tolerances.py:load_registry": "tolerances.toml of the package",
    "gaitval/mocap/c3d_contents.py:read_contents": "what the reader's own process has written",
    "gaitval/mocap/c3d_process.py:main": "a process of its own, after `check_size`",
    "gaitval/mocap/c3d_writing.py:write_c3d": "makes an empty one",
    "gaitval/reporting/checklist.py:checklist": "checklist.toml of the package",
    "gaitval/reporting/credibility.py:project_rows": "evidence.toml of the package",
    "gaitval/reporting/page.py:_font_faces": "fonts of the package",
    "gaitval/reporting/translated.py:_catalogue": "catalogues of the package",
    "gaitval/scaling/marker_sets.py:_builtin": "marker sets of the package",
    "gaitval/study/sources.py:_code": "the package's own data",
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
    if base == GATE or called == "read_json":  # of `gaitval.artefacts`, behind the gate itself
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


@evidence.measurement(CASES_OPTION, SEED, LOG)
def malformed(given: Namespace) -> list[evidence.Row]:
    """Damaged files of every kind, most of them through whole commands."""
    with tempfile.TemporaryDirectory() as folder:
        log = (given.log or Path(folder) / "cases.jsonl").resolve()
        numbers = ("--cases", str(given.cases), "--seed", str(given.seed))
        script = str(ROOT / "tests" / "robustness" / "fuzz.py")
        paths = os.pathsep.join(map(str, [ROOT, ROOT / "extras"]))
        subprocess.run(
            [sys.executable, script, *numbers, "--log", str(log)],
            cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": paths}, check=False,
        )  # fmt: skip
        cases = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    bad = sum(each["outcome"] in ("silent", "fault") for each in cases)
    kinds = len({each["kind"] for each in cases})
    return [
        evidence.none_may(MALFORMED, bad, "cases", len(cases)),
        evidence.Row(CASES, len(cases), "cases", ">=", 20_000, 8_000, len(cases)),
        evidence.Row(KINDS, kinds, "kinds", ">=", 18, 18, len(cases)),
    ]
