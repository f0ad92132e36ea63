"""The committed policies still walk as well as their stored metrics say."""

import json
import os
import signal
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitval import cli
from gaitval._internal.io.artefacts import value_hash, versions
from gaitval._internal.numba.one_thread import one_thread
from gaitval.apps.regression.baseline import installed_versions, walk_again
from gaitval.apps.regression.regression import LONG_MEASURES, compare
from gaitval.metrics.results import read_metrics
from gaitval.study.stage import Observer

ROOT = Path(__file__).parents[2]
BASELINES = sorted((ROOT / "reports").glob("S*/baseline"))
WALKED = ("S05",)
"""Subjects whose stored policies walk in every run of the tests."""
OFTEN = (*WALKED, "S08", "S10")
"""Those that walk in CI, and so does who was stored by other versions than the first of them."""


def _versions(baseline):
    return json.loads((baseline / "seal.json").read_text(encoding="utf-8"))["versions"]


TRIED = [
    baseline
    for baseline in BASELINES
    if baseline.parent.name in OFTEN
    or _versions(baseline) != _versions(ROOT / "reports/S05/baseline")
]


def _run(*command):
    """A command in this process, which imports everything once; other tests start their own."""
    return CliRunner().invoke(cli.app, [str(each) for each in command])


def _check(baseline, *options):
    return _run("check", "--baseline", baseline / "metrics.json", *options)


def test_subject_5_has_a_baseline():
    assert "S05" in [path.parent.name for path in BASELINES]


@pytest.mark.parametrize(
    "baseline",
    [
        pytest.param(path, marks=() if path.parent.name in WALKED else pytest.mark.slow)
        for path in TRIED
    ],
    ids=lambda path: path.parent.name,
)
def test_stored_policy_keeps_its_accuracy(baseline, tmp_path):
    junit = tmp_path / "accuracy.xml"
    done = _run("check", "--baseline", baseline, "--quick", "--junit", junit)
    assert done.exit_code == 0, done.output
    suite = ElementTree.parse(junit).getroot()
    assert len(list(suite.iter("testcase"))) > 30
    assert not list(suite.iter("failure"))


COMPUTING = ("python", "dartpy", "numba", "numpy", "scipy")
"""Libraries that a walk is computed with."""
ROUNDING = "18a40b18f80b3b9a1cb20a5a7e9315071db665d44c20e2a36153bb2db20518cb"
"""`_rounding` where the baselines were stored: Intel Xeon, glibc 2.36."""


def _rounding():
    """Hash of some results of the C library, NumPy and BLAS: another processor or another C library
    rounds differently, and a walk of it differs in the third digit."""
    values = np.linspace(0.1, 3.0, 1000)
    found = [function(values) for function in (np.sin, np.tan, np.exp, np.log, np.arctan)]
    with one_thread():  # as a stage runs
        found.append(np.vander(values, 50).T @ np.vander(values, 50))
    return value_hash([each.tolist() for each in found])


def test_figures_move_only_with_the_version_of_a_stage():
    """A stored result counts as that of the installed code while the versions of its stages are the
    installed ones. So if this fails, either the change was not to move a figure, or the stages that
    it changes need another number in `gaitval/study/stage_versions.py`, and S05 a new baseline.
    """
    baseline = ROOT / "reports" / "S05" / "baseline"
    stored = read_metrics(baseline)
    then, here = stored.provenance.versions, versions()
    if _rounding() != ROUNDING or any(then[name] != here[name] for name in COMPUTING):
        pytest.skip("S05 was stored with other libraries, or on a processor that rounds otherwise")
    now = walk_again(baseline, Observer(), quick=True)
    moved = [
        f"{row.measure} of {row.target}: {row.baseline} before, {row.current} now"
        for row in compare(stored, now, leave_out=LONG_MEASURES)
        if row.baseline is not None and row.current != row.baseline
    ]
    before = _versions(baseline)
    raised = [name for name, found in installed_versions().items() if found > before.get(name, 0)]
    assert raised or not moved


@pytest.mark.slow
def test_a_stored_policy_walks_as_far_and_stands_the_same_pushes(tmp_path):
    """The long check, of one subject: a hundred cycles from every start, and all pushes."""
    junit = tmp_path / "accuracy.xml"
    done = _check(ROOT / "reports" / "S05" / "baseline", "--junit", junit)
    assert done.exit_code == 0, done.output
    measures = {case.get("classname") for case in ElementTree.parse(junit).iter("testcase")}
    assert {"gaitval.consecutive_cycles", "gaitval.push_survival"} <= measures


@pytest.mark.slow  # the verdicts are tested in tests/study/test_stored_baseline.py
def test_lost_accuracy_fails_the_check(tmp_path):
    """The same policy against a baseline whose knee follows the record five times as closely. The
    file agrees with itself, but it was edited, so it must be sealed again to be used at all."""
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
    assert done.exit_code == 2, done.output
    assert "changed since it was stored: measures, rest of metrics.json" in done.stderr
    assert _run("baseline", "5", "--to", copy, "--seal").exit_code == 0
    done = _check(copy, "--quick")
    assert done.exit_code == 1, done.output
    assert "knee_angle_r" in done.stdout


@pytest.mark.skipif(sys.platform == "win32", reason="Windows ends a process without a signal")
@pytest.mark.slow  # the verdicts are tested in tests/study/test_stored_baseline.py
def test_a_check_that_is_ended_leaves_nothing(tmp_path):
    """SIGTERM while it walks, as a CI server sends it."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "gaitval", "check", "--baseline", BASELINES[0], "--quick"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    assert process.stderr is not None
    while "reference: starts" not in process.stderr.readline():
        assert process.poll() is None
    assert list(tmp_path.glob("gaitval-check-*"))
    process.terminate()
    _, message = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    assert "ended from outside" in message
    assert not list(tmp_path.glob("gaitval-check-*"))


@pytest.mark.parametrize(
    "command",
    [
        ["docs/build/accuracy_tables.py", "--check"],
        pytest.param(["-m", "experiments.margins", "table", "--check"], marks=pytest.mark.slow),
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
