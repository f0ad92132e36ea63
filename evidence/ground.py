"""Figures about the test suite, as rows of `reports/evidence/ground.csv`.

How long the suite takes is in the evidence of `evidence/first.py`; bare systems write rows of this
file too (`tests/robustness/bare_systems.py`).
"""

import os
import subprocess
import sys
import tempfile
from argparse import Namespace

import evidence
from evidence import DATA, ROOT, option

SEEDS = option("--seeds", nargs="+", required=True, help="of the orders")
PYTHON = option("--python", required=True, help="the other Python")
PYTEST = (
    *("-m", "pytest", "-q", "-n", "auto", "--maxprocesses", "4"),
    *("--dist", "loadfile", "--no-loadscope-reorder"),
)
MEASURES = {
    "rows of the limits table *": {
        "code": ("evidence/ground.py:limits,_suite", "gaitval/metrics/tolerances.py"),
        "data": ("gaitval/metrics/tolerances.toml", "tests/workflows/test_limits_can_fail.py"),
    },
    "*": {
        "code": ("gaitval/*.py", "tests/*.py", "evidence/ground.py:orders,python,_suite"),
        "allowed": 400,
        "why": "one in a hundred of the package's and the tests' statements",
    },
}
"""What the rows depend on; see evidence/stale.py."""


def _suite(python: str, *arguments: str, **environment: str) -> tuple[int, int]:
    """Failures (including errors) and passes of a run of the suite from the checkout."""
    done = subprocess.run(
        [python, *PYTEST, *arguments],
        cwd=ROOT,
        env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT), **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    lines = done.stdout.splitlines()
    print("\n".join(lines[-8:]), flush=True)
    failed, passed = evidence.pytest_counts(lines[-1])
    if done.returncode and not failed:
        raise SystemExit(f"pytest did not run: exit code {done.returncode}")
    return failed, passed


def _none_may_fail(what: str, failed: int, passed: int) -> evidence.Row:
    return evidence.none_may(what, failed, "tests", passed + failed)


@evidence.measurement()
def limits(_: Namespace) -> evidence.Row:
    """Rows of the limits table with a mutation that fails them."""
    file = ROOT / "tests/workflows/test_limits_can_fail.py"
    sys.path[:0] = [str(file.parent), str(ROOT / "tests/support")]
    from test_limits_can_fail import rows_with_mutation

    failed, _ = _suite(sys.executable, str(file))
    mutated, rows = rows_with_mutation()
    return evidence.Row(
        what="rows of the limits table with a mutation that fails them",
        value=100.0 * (mutated - failed) / rows,
        unit="%",
        relation=">=",
        goal=100,
        must=100,
        n=rows,
    )


@evidence.measurement(SEEDS)
def orders(arguments: Namespace) -> evidence.Row:
    """Failures in random orders of the suite, without data."""
    seeds = arguments.seeds
    failures = passes = 0
    with tempfile.TemporaryDirectory() as empty:
        for seed in seeds:
            print(f"order of seed {seed}, without data", flush=True)
            failed, passed = _suite(
                sys.executable, f"--randomly-seed={seed}", CI="true", GAITVAL_DATA=empty
            )
            failures += failed
            passes += passed
    what = f"failures in {len(seeds)} random orders of the suite, without data, CI=true"
    return _none_may_fail(what, failures, passes)


@evidence.measurement(PYTHON, DATA)
def python(arguments: Namespace) -> evidence.Row:
    """Failures of the suite in the environment of another Python."""
    python = arguments.python
    failed, passed = _suite(python, GAITVAL_DATA=str(arguments.data))
    version = subprocess.run(
        [python, "-c", "import platform; print(platform.python_version())"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.strip()
    return _none_may_fail(f"failures of the suite on Python {version}", failed, passed)
