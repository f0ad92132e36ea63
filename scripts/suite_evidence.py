"""Figures about the test suite, as rows of `reports/evidence/ground.csv`.

    python scripts/suite_evidence.py limits           rows of the limits table with a mutation
    python scripts/suite_evidence.py orders 1 2 3     random orders of these seeds, without data
    python scripts/suite_evidence.py python FILE      the suite with another Python's environment

`python` reads the raw data from the folder named by `GAITVAL_DATA`. How long the suite takes is in
the evidence of `scripts/first_evidence.py`.
"""

import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import evidence

ROOT = Path(__file__).resolve().parent.parent
PYTEST = (
    *("-m", "pytest", "-q", "-n", "auto", "--maxprocesses", "4"),
    *("--dist", "loadfile", "--no-loadscope-reorder"),
)
MEASURES = {
    "rows of the limits table *": {
        "code": ("scripts/suite_evidence.py:_limits,_suite", "gaitval/metrics/tolerances.py"),
        "data": ("gaitval/metrics/tolerances.toml", "tests/workflows/test_limits_can_fail.py"),
    },
    "*": {
        "code": ("gaitval/*.py", "tests/*.py", "scripts/suite_evidence.py:_orders,_python,_suite"),
        "allowed": 400,
        "why": "one in a hundred of the package's and the tests' statements",
    },
}
"""What the rows depend on; see scripts/stale_evidence.py."""


def main() -> None:
    """Write the rows of one kind; exit 1 if a row misses its requirement."""
    kinds = {"limits": _limits, "orders": _orders, "python": _python}
    if len(sys.argv) < 2 or sys.argv[1] not in kinds:
        raise SystemExit(__doc__)
    row = kinds[sys.argv[1]](*sys.argv[2:])
    print(f"{row.what}: {row.value:g} {row.unit}, n {row.n}")
    print(evidence.write("ground", [row]))
    bad = row.value > row.must if row.relation == "<=" else row.value < row.must
    sys.exit(1 if bad else 0)


def _command() -> str:
    return shlex.join(["python", "scripts/suite_evidence.py", *sys.argv[1:]])


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
    return evidence.none_may(what, failed, "tests", passed + failed, _command())


def _limits() -> evidence.Row:
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
        command=_command(),
    )


def _orders(*seeds: str) -> evidence.Row:
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


def _python(python: str) -> evidence.Row:
    failed, passed = _suite(python)
    version = subprocess.run(
        [python, "-c", "import platform; print(platform.python_version())"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.strip()
    return _none_may_fail(f"failures of the suite on Python {version}", failed, passed)


if __name__ == "__main__":
    main()
