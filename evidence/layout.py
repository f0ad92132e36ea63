"""What the layout promises, as rows of `reports/evidence/layout.csv`.

`times` says something only on a machine that does nothing else.
"""

import ast
import doctest
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

import evidence
from evidence import ROOT

LONGEST_FILE = 500
LONGEST_FUNCTION = 80
REASON = re.compile(r"\bIt is (?:this )?long because\b")
"""How a docstring says why its file or function is longer."""
IMPORT_S, HELP_S = 0.3, 0.6
RUNS = 5
MEASURES = {
    "import gaitval, *": {"code": ("gaitval/__init__.py", "evidence/layout.py:_seconds")},
    "gaitval --help, *": {
        "code": ("gaitval/__init__.py", "gaitval/cli/*.py", "evidence/layout.py:_seconds"),
        "allowed": 60,
        "why": "a statement that defines a command or an option takes under 1 ms",
    },
    "files of gaitval/ *": {
        # How many there are is counted anew by tests/test_sizes.py at every change.
        "code": ("evidence/layout.py:LONGEST_FILE,long_files,has_reason,sources,REASON",),
    },
    "functions of gaitval/ *": {
        "code": (
            "evidence/layout.py:"
            "LONGEST_FUNCTION,long_functions,_functions,_length,has_reason,sources,REASON",
        ),
    },
    "public functions with an example that runs": {
        "code": (
            "evidence/layout.py:examples,_example_runs",
            "gaitval/__init__.py",
            "gaitval/interface/*.py",
        ),
        "data": ("gaitval/__init__.pyi",),
    },
}
"""What the rows depend on; see evidence/stale.py."""


def _at_most(what: str, value: float, unit: str, goal: float, n: int) -> evidence.Row:
    return evidence.Row(what, value, unit, "<=", goal, goal, n)


def sources() -> list[Path]:
    """All modules of the package."""
    return sorted((ROOT / "gaitval").rglob("*.py"))


def long_files() -> list[str]:
    """Files over `LONGEST_FILE` lines whose docstring gives no reason, with their lengths."""
    found = []
    for path in sources():
        text = path.read_text(encoding="utf-8")
        length = len(text.splitlines())
        if length > LONGEST_FILE and not has_reason(ast.parse(text)):
            found.append(f"{path.relative_to(ROOT)}: {length} lines")
    return found


def long_functions() -> list[str]:
    """Functions over `LONGEST_FUNCTION` lines whose docstring gives no reason, with theirs."""
    return [
        f"{path.relative_to(ROOT)}: {function.name}, {length} lines"
        for path, function in _functions()
        if (length := _length(function)) > LONGEST_FUNCTION and not has_reason(function)
    ]


def _functions() -> Iterator[tuple[Path, ast.FunctionDef]]:
    for path in sources():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                yield path, node


def _length(function: ast.FunctionDef) -> int:
    """Lines from the first decorator to the end, docstring and all."""
    first = min([function.lineno, *(each.lineno for each in function.decorator_list)])
    assert function.end_lineno is not None
    return function.end_lineno - first + 1


def has_reason(node: ast.Module | ast.FunctionDef) -> bool:
    """Whether its docstring says why it is long."""
    return REASON.search(" ".join((ast.get_docstring(node) or "").split())) is not None


@evidence.measurement()
def sizes(_: Namespace) -> list[evidence.Row]:
    """Files and functions that are too long without a reason."""
    files, functions = long_files(), long_functions()
    print("\n".join([*files, *functions]))
    return [
        _at_most(
            f"files of gaitval/ over {LONGEST_FILE} lines without a written reason",
            len(files),
            "files",
            0,
            len(sources()),
        ),
        _at_most(
            f"functions of gaitval/ over {LONGEST_FUNCTION} lines without a written reason",
            len(functions),
            "functions",
            0,
            sum(1 for _ in _functions()),
        ),
    ]


@evidence.measurement()
def times(_: Namespace) -> list[evidence.Row]:
    """Seconds of `import gaitval` and `gaitval --help`."""
    limits = {"import gaitval": (["-c", "import gaitval"], IMPORT_S)}
    limits["gaitval --help"] = (["-m", "gaitval", "--help"], HELP_S)
    return [
        _at_most(f"{what}, new process, median", _seconds(arguments), "s", limit, RUNS)
        for what, (arguments, limit) in limits.items()
    ]


def _seconds(arguments: list[str]) -> float:
    """Median wall time of new processes after one that warms the files' cache up."""
    found = []
    for _ in range(1 + RUNS):
        started = time.perf_counter()
        subprocess.run(
            [sys.executable, *arguments],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
            check=True,
        )
        found.append(time.perf_counter() - started)
    return statistics.median(found[1:])


@evidence.measurement()
def examples(_: Namespace) -> list[evidence.Row]:
    """Public functions with an example that runs."""
    import gaitval

    public: list[str] = gaitval.__all__  # type: ignore[attr-defined]
    running = [name for name in public if _example_runs(name, getattr(gaitval, name))]
    print(f"without: {', '.join(sorted(set(public) - set(running))) or 'none'}")
    count = len(public)
    what = "public functions with an example that runs"
    return [evidence.Row(what, 100.0 * len(running) / count, "%", ">=", 100, 100, count)]


def _example_runs(name: str, function: object) -> bool:
    tests = doctest.DocTestFinder(recurse=False).find(function, name, globs={})
    examples = [test for test in tests if test.examples]
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)  # examples may write files
        try:
            runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
            failed = sum(runner.run(test).failed for test in examples)
        finally:
            os.chdir(before)
    return bool(examples) and not failed
