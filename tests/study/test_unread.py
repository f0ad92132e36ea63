"""A setting that was given and has no effect is named."""

from pathlib import Path

import pytest

from gaitval.configuration import SAMPLES_FROM, load_configuration
from gaitval.study.run import plan
from gaitval.study.scaling_stages import scale_stage
from gaitval.study.stage import Observer, Run
from gaitval.study.unread import given, unread
from gaitval.subjects.subject_file import load_subject


def run_with(tmp_path: Path, *settings: str) -> Run:
    return Run(tmp_path, load_subject("5"), load_configuration(settings=settings), Observer())


def message(tmp_path: Path, *settings: str, start: str = "general") -> list[str]:
    run = run_with(tmp_path, *settings)
    return list(unread(run.configuration, plan(run, 1), start))


@pytest.mark.parametrize(
    "setting",
    [
        "training.samples=20000",
        "training.workers=1",
        "seed=3",
        "environment.push_force=100",
        "pushes.required_directions=9",
        "validation.cycles=12",
        "identification.rounds=1",
        "noise.angle=0.02",
        "record.use=kinematics",
        "report.paper=letter",
        "correction.steps=0",
        "servo.feed_forward=0",
    ],
)
def test_what_the_main_job_reads_is_not_named(tmp_path: Path, setting: str) -> None:
    assert message(tmp_path, setting) == []


@pytest.mark.parametrize(
    ("setting", "start", "reason"),
    [
        ("training.difficulty_ramp=[0.1, 0.5]", "general", "only a training from nothing"),
        ("training.initial_log_std=-2", "policy", "only a training from nothing"),
        ("training.warm_learning_rate_factor=0.5", "scratch", "starts from a policy"),
        ("processing.marker_cutoff_hz=6", "general", "other commands"),
    ],
)
def test_what_it_does_not_read_is_named_with_the_reason(
    tmp_path: Path, setting: str, start: str, reason: str
) -> None:
    [line] = message(tmp_path, setting, start=start)
    assert line.startswith(setting.partition("=")[0])
    assert reason in line


def test_what_only_a_training_from_nothing_reads_is_read_by_one(tmp_path: Path) -> None:
    assert message(tmp_path, "training.difficulty_ramp=[0.1, 0.5]", start="scratch") == []


def test_a_stage_alone_reads_less(tmp_path: Path) -> None:
    run = run_with(tmp_path, "training.samples=20000")
    [line] = unread(run.configuration, [scale_stage(run)], "general")
    assert "training.samples" in line


def test_a_setting_that_is_given_as_it_is_by_default_changes_nothing(tmp_path: Path) -> None:
    assert given(load_configuration(settings=["training.workers=2", "seed=4"])) == []


@pytest.mark.parametrize("start", ["scratch", "general", "policy", "range"])
def test_one_setting_is_the_number_of_samples_whatever_the_start(start: str) -> None:
    assert load_configuration().training.samples_from(start) == SAMPLES_FROM[start]
    chosen = load_configuration(settings=["training.samples=4321"]).training
    assert chosen.samples_from(start) == 4321
