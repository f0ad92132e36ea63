"""How many lines a foreign project needs for an accuracy test: a row of report.csv.

Builds a project that has nothing of this one but a stored baseline: an empty folder, and in it the
test file that README.md shows, taken from its text. Counts the lines that are not blank, runs
pytest there with the installed plug-in: the walk must keep its accuracy. That a weaker one fails is
tested in `tests/workflows/test_pytest_plugin.py`.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from argparse import Namespace
from pathlib import Path

import evidence
from evidence import ROOT

BASELINE = "reports/S05/baseline"
GOAL, MUST = 5, 10
MEASURES = {
    "*": {"code": ("gaitval/apps/regression/plugin.py", "@checked", "evidence/report/plugin.py")},
}
"""What the rows depend on; see evidence/stale.py."""


@evidence.measurement()
def plugin(_: Namespace) -> evidence.Row:
    """Lines that a foreign project needs for an accuracy test."""
    text = example((ROOT / "README.md").read_text(encoding="utf-8"))
    lines = sum(1 for line in text.splitlines() if line.strip())
    with tempfile.TemporaryDirectory() as temporary:
        project = Path(temporary)
        shutil.copytree(ROOT / BASELINE, project / BASELINE)
        (project / "test_walk.py").write_text(text, encoding="utf-8")
        code = run(project)
    if code != 0:
        raise SystemExit(
            "plugin_evidence: the example of README.md does not pass in an empty project"
        )
    return evidence.Row(
        "plug-in: lines a foreign project needs", lines, "lines", "<=", GOAL, MUST, 1
    )


def example(readme: str) -> str:
    """The indented block of README.md that has a test with the fixture."""
    blocks = re.findall(r"(?:^ {4}.*\n|^\n(?= {4}))+", readme, re.MULTILINE)
    found = [block for block in blocks if "def test_" in block and "gaitval_check" in block]
    if len(found) != 1:
        raise SystemExit(f"plugin_evidence: {len(found)} examples of the plug-in in README.md")
    return re.sub(r"^ {4}", "", found[0], flags=re.MULTILINE).strip() + "\n"


def run(project: Path) -> int:
    """Exit code of pytest in the project."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "gaitval.apps.regression.plugin"],
        cwd=project,
        # The plug-in of this checkout, whichever gaitval is installed, and no other.
        env={**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    print(done.stdout)
    return done.returncode
