"""What the project has measured, as every report cites it."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
from newton_walk import newton_walk

from gaitval.artefacts import write_json
from gaitval.metrics.results import read_metrics
from gaitval.reporting import credibility
from gaitval.reporting.facts import at
from gaitval.reporting.figure_data import _push_velocity

ROOT = Path(__file__).parents[2]
STORED = ROOT / "reports" / "S05" / "baseline" / "metrics.json"


def test_every_figure_is_in_the_file_at_the_place_that_it_names() -> None:
    values = tomllib.loads(credibility.evidence_text())
    rows = [row for part in credibility.project_rows().values() for row in part]
    assert len(rows) == len(values["figure"])
    for row in rows:
        assert row.text.split()[0] == f"{at(values, row.pointer):.4g}"


def test_momentum_and_seed_are_read_beside_the_metrics(tmp_path: Path) -> None:
    metrics = read_metrics(STORED)
    assert credibility.beside_metrics(tmp_path, metrics) == {"momentum": "", "seed": ""}
    newton_walk(np.zeros(3)).save(tmp_path / "rollouts" / f"{metrics.final}.npz")
    write_json(tmp_path / "provenance.json", {"seed": 7, "stages": {"train": {"seconds": 1800.5}}})
    found = credibility.beside_metrics(tmp_path, metrics)
    assert found["seed"] == "7"
    assert float(found["momentum"].split()[0]) < 100.0  # of another body: only that it is there


def test_the_copy_of_the_projects_figures_is_that_of_the_tree():
    done = subprocess.run(
        [sys.executable, "docs/build/credibility_figures.py", "--check"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_every_figure_of_the_project_names_a_command_and_a_file_of_the_tree():
    figures = tomllib.loads(credibility.evidence_text())["figure"]
    assert {each["part"] for each in figures.values()} == {
        "verification", "validation", "uncertainty", "sensitivity", "history",
    }  # fmt: skip
    for each in figures.values():
        assert (ROOT / each["source"]).is_file()
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", each["date"])
        assert each["command"].startswith("python")
        assert len(each["sha256"]) == 64


def test_the_pushes_of_a_walker_that_fell_are_a_table_without_rows():
    head, *rows = _push_velocity([]).splitlines()
    assert head.startswith("phase,direction_deg")
    assert rows == []
