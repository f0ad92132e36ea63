"""Wrong forces that are refused or told, as rows of evidence.

    GAITVAL_DATA=FOLDER python scripts/robustness_evidence.py

Runs the tests that plant each fault in a recording, through the whole import, and counts those that
are caught. Writes rows of `reports/evidence/robustness.csv`.
"""

import os
import subprocess
import sys
from pathlib import Path

import evidence

ROOT = Path(__file__).resolve().parent.parent
COMMAND = "python scripts/robustness_evidence.py"
PLANTED = {
    "wrong forces, markers and clocks: refused or told at the top, with raw data": (
        "tests/workflows/test_import_doubts.py",
        "refused or doubted or wrong_frame_rate or marker_50_mm or dead_moment",
    ),
    "clean recordings: without a doubt": (
        "tests/workflows/test_import_doubts.py",
        "no_doubt",
    ),
}
"""What is counted: the file of the tests, and the expression that selects them."""
MEASURES = {
    "*": {"code": ("@warnings",), "data": ("tests/workflows/test_import_doubts.py",)},
}
"""What the rows depend on; see scripts/stale_evidence.py."""


def counted(file: str, chosen: str) -> tuple[int, int]:
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
        env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    last = done.stdout.splitlines()[-1]
    print(f"{file}: {last}", flush=True)
    return evidence.pytest_counts(last)


def main() -> None:
    """Write the rows; exit 1 if a planted fault goes through."""
    rows = []
    for what, (file, chosen) in PLANTED.items():
        failed, passed = counted(file, chosen)
        share = 100 * passed / max(1, failed + passed)
        rows.append(evidence.Row(what, share, "%", ">=", 100, 100, failed + passed, COMMAND))
    print(evidence.write("robustness", rows))
    sys.exit(0 if all(row.value == 100 for row in rows) else 1)


if __name__ == "__main__":
    main()
