"""Wrong forces that are refused or flagged, as rows of evidence.

Runs the tests that plant each fault in a recording, through the whole import, and counts those that
are caught. Writes rows of `reports/evidence/robustness.csv`.
"""

import os
import subprocess
import sys
from argparse import Namespace
from pathlib import Path

import evidence
from evidence import ROOT

PLANTED = {
    "wrong forces, markers and clocks: refused or flagged at the top, with raw data": (
        "tests/workflows/test_import_flags.py",
        "refused or doubted or wrong_frame_rate or marker_50_mm or dead_moment",
    ),
    "clean recordings: without a warning": (
        "tests/workflows/test_import_flags.py",
        "no_doubt",
    ),
}
"""What is counted: the file of the tests, and the expression that selects them."""
MEASURES = {
    "*": {"code": ("@warnings",), "data": ("tests/workflows/test_import_flags.py",)},
}
"""What the rows depend on; see evidence/stale.py."""


def counted(file: str, chosen: str, data: Path) -> tuple[int, int]:
    """Tests that failed and that passed."""
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-n",
            "2",
            "--dist",
            "loadscope",
            file,
            "-k",
            chosen,
        ],
        cwd=ROOT,
        env={
            **os.environ,
            "OMP_NUM_THREADS": "1",
            "PYTHONPATH": str(ROOT),
            "GAITVAL_DATA": str(data),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    last = done.stdout.splitlines()[-1]
    print(f"{file}: {last}", flush=True)
    return evidence.pytest_counts(last)


@evidence.measurement(evidence.DATA)
def imports(arguments: Namespace) -> list[evidence.Row]:
    """Planted faults of recordings that an import refuses or names, and clean ones."""
    rows = []
    for what, (file, chosen) in PLANTED.items():
        failed, passed = counted(file, chosen, arguments.data)
        share = 100 * passed / max(1, failed + passed)
        rows.append(evidence.Row(what, share, "%", ">=", 100, 100, failed + passed))
    return rows
