"""`gaitval predict` from end to end, too short to walk well, and what its results say."""

import io
from pathlib import Path

import numpy as np
import pytest
from quick_settings import QUICK
from typer.testing import CliRunner

from gaitval import cli
from gaitval._internal.io.artefacts import read_json
from gaitval.cli.terminal import display
from gaitval.interface.walks import load_policy, rollout
from gaitval.metrics.baselines import GROUPS, group_rows
from gaitval.metrics.results import metrics_from
from gaitval.walk.simulation.rollout import Rollout

SETTINGS = list(QUICK)


def predict(out: Path, *arguments: str) -> str:
    """What the command prints."""
    settings = [part for each in SETTINGS for part in ("--set", each)]
    done = CliRunner().invoke(cli.app, ["predict", "5", *arguments, "--out", str(out), *settings])
    assert done.exit_code == 0, done.output
    return done.output


@pytest.fixture(autouse=True)
def plain(monkeypatch):
    monkeypatch.setattr("gaitval.study.predicted_tasks.SPEEDS", 2)
    monkeypatch.setattr(display, "messages", display.Terminal(file=io.StringIO(), width=200))


@pytest.mark.slow  # its verdicts are tested in test_nothing_judges_itself.py
def test_a_held_out_trial_and_then_a_speed(tmp_path):
    """The second prediction takes the policy of the first."""
    predict(tmp_path, "--holdout", "T03")
    metrics = read_json(tmp_path / "at-0.78" / "metrics.json")
    assert metrics["subject"]["source"] == "WBDS14 T03"
    assert metrics["record"]["spatiotemporal"]["walking_speed"] == 0.78
    assert not any(metrics["known"].values())
    compared = {row["comparison"] for row in metrics["measures"]}
    assert compared <= {"predicted", "not compared"}
    names = [prediction["name"] for prediction in metrics["predictions"]]
    assert names == [
        "line through others",
        "expected of anybody",
        "nearest trial copied",
        "line through two trials",
        "other people's change added",
    ]
    assert metrics["predictions"][2]["known"] == "the person's T05 at 1.12 m/s"
    assert [row.status for row in group_rows(metrics_from(metrics, "here"))] == ["predicted"] * len(
        GROUPS
    )
    page = (tmp_path / "at-0.78" / "report.html").read_text(encoding="utf-8")
    assert "predicted from other trials" in page
    assert "and of this one only the speed" in page
    policy = (tmp_path / "policy" / "policy.safetensors").read_bytes()
    assert (tmp_path / "at-0.78" / "policy" / "policy.safetensors").read_bytes() == policy


@pytest.mark.slow  # what it says is tested in test_nothing_judges_itself.py, and always
def test_a_speed_that_nobody_recorded_is_not_called_a_comparison(tmp_path):
    printed = predict(tmp_path, "--speed", "0.95")
    assert "Nothing was recorded at 0.95 m/s: accuracy is not judged" in printed
    assert "distance from the prediction" in printed
    metrics = read_json(tmp_path / "at-0.95" / "metrics.json")
    assert metrics["subject"]["source"] == "WBDS14 predicted"
    assert metrics["record"]["spatiotemporal"]["walking_speed"] == 0.95
    assert metrics["predictions"] == metrics["unseen"] == metrics["recorded"] == []
    assert {row["origin"] for row in metrics["measures"]} == {"predicted", None}
    assert metrics["prediction_errors"]["trials"] == 3
    page = (tmp_path / "at-0.95" / "report.html").read_text(encoding="utf-8")
    assert "accuracy is not judged" in page
    # and what walks a run walks it, too
    walked = Rollout.load(tmp_path / "at-0.95" / "rollouts" / "nominal.npz")
    again = rollout(load_policy(tmp_path / "at-0.95"), cycles=1.0)
    assert walked.start_phase == again.start_phase
    assert np.abs(again.positions[:250] - walked.positions[:250]).max() < 1e-4


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--speed", "1.12"], "--speed 1.12: S05 was recorded at 1.12 m/s (trial T05)"),
        (["--speed", "0.782"], "--holdout T03"),
        (["--speed", "0.9", "--set", "record.holdout=T03"], "holdout T03 and speed 0.9 m/s"),
        (["--holdout", "T03", "--set", "record.speed=0.9"], "holdout T03 and speed 0.9 m/s"),
    ],
)
def test_what_is_no_prediction_or_judged_at_another_speed_is_refused(tmp_path, words, message):
    done = CliRunner().invoke(cli.app, ["predict", "5", *words, "--out", str(tmp_path / "o")])
    assert done.exit_code == 2
    assert isinstance(display.messages.file, io.StringIO)
    assert message in " ".join(display.messages.file.getvalue().split())
    assert not (tmp_path / "o").exists()
