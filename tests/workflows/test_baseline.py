"""The committed policies still walk as well as their stored metrics say."""

import json
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BASELINES = sorted((ROOT / "reports").glob("S*/baseline"))


def _check(baseline, *options):
    command = [sys.executable, "-m", "gaitval", "check"]
    return subprocess.run(
        [*command, "--baseline", baseline / "metrics.json", *options],
        capture_output=True,
        text=True,
    )


def test_subject_5_has_a_baseline():
    assert "S05" in [path.parent.name for path in BASELINES]


@pytest.mark.parametrize("baseline", BASELINES, ids=lambda path: path.parent.name)
def test_stored_policy_keeps_its_accuracy(baseline, tmp_path):
    junit = tmp_path / "accuracy.xml"
    done = _check(baseline, "--quick", "--junit", junit)
    assert done.returncode == 0, done.stdout + done.stderr
    suite = ElementTree.parse(junit).getroot()
    assert len(list(suite.iter("testcase"))) > 30
    assert not list(suite.iter("failure"))


@pytest.mark.slow
def test_a_stored_policy_walks_as_far_and_stands_the_same_pushes(tmp_path):
    """The long check, of one subject: a hundred cycles from every start, and all pushes."""
    junit = tmp_path / "accuracy.xml"
    done = _check(ROOT / "reports" / "S05" / "baseline", "--junit", junit)
    assert done.returncode == 0, done.stdout + done.stderr
    measures = {case.get("classname") for case in ElementTree.parse(junit).iter("testcase")}
    assert {"gaitval.consecutive_cycles", "gaitval.push_survival"} <= measures


def test_lost_accuracy_fails_the_check(tmp_path):
    """The same policy against a baseline whose knee follows the record five times as closely."""
    baseline, copy = ROOT / "reports" / "S05" / "baseline", tmp_path / "baseline"
    for path in baseline.rglob("*"):
        if path.is_file():
            (copy / path.relative_to(baseline)).parent.mkdir(parents=True, exist_ok=True)
            (copy / path.relative_to(baseline)).write_bytes(path.read_bytes())
    metrics = json.loads((copy / "metrics.json").read_text())
    walk, knee = metrics["walks"][metrics["final"]], "knee_angle_r"
    curve, error = walk["curves"]["angles"][knee], walk["errors"]["angles"][knee]
    recorded = metrics["record"]["curves"]["angles"][knee]
    curve["mean"] = [r + 0.2 * (s - r) for s, r in zip(curve["mean"], recorded, strict=True)]
    error["rmse"] *= 0.2
    guess = metrics["predictions"][0]["rmse"]["angles"][knee]
    claims = {"angle_rmse": error["rmse"], "angle_skill": 1.0 - error["rmse"] / guess}
    for row in (*metrics["measures"], *metrics["tolerances"]):
        if row["target"] == knee and row["measure"] in claims:
            row["value"] = claims[row["measure"]]
    (copy / "metrics.json").write_text(json.dumps(metrics))
    done = _check(copy, "--quick")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "knee_angle_r" in done.stdout


@pytest.mark.parametrize(
    "command",
    [
        ["scripts/accuracy_tables.py", "--check"],
        ["scripts/ablation.py", "table", "--check"],
        ["scripts/paper_recipe.py", "--check"],
    ],
)
def test_tables_say_what_the_stored_figures_say(command):
    done = subprocess.run(
        [sys.executable, *command],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
