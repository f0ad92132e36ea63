"""Stored baselines that are damaged, or mended by hand, are refused before anything is walked."""

import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gaitval.errors import ArtefactError
from gaitval.study.baseline import stored_metrics

ROOT = Path(__file__).parents[2]
BASELINES = sorted((ROOT / "reports").glob("S*/baseline"))
Json = dict[str, Any]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROOT / "reports/S05/baseline", tmp_path / "baseline"))


def _refusal(folder: Path, change: Callable[[Json], object]) -> str:
    file = folder / "metrics.json"
    metrics = json.loads(file.read_text(encoding="utf-8"))
    change(metrics)
    file.write_text(json.dumps(metrics), encoding="utf-8")
    with pytest.raises(ArtefactError) as refused:
        stored_metrics(file)
    return str(refused.value)


def _rows(metrics: Json, measure: str, target: str) -> list[Json]:
    return [
        row
        for row in (*metrics["measures"], *metrics["tolerances"])
        if (row["measure"], row["target"]) == (measure, target)
    ]


def _set(measure: str, target: str, value: float | None) -> Callable[[Json], object]:
    return lambda metrics: [row.update(value=value) for row in _rows(metrics, measure, target)]


@pytest.mark.parametrize("baseline", BASELINES, ids=lambda path: path.parent.name)
def test_the_stored_ones_can_be_believed(baseline: Path) -> None:
    assert stored_metrics(baseline / "metrics.json")["measures"]


def _worse(metrics: Json) -> None:
    """Every error twice as large, wherever it is told as a measure."""
    for row in (*metrics["measures"], *metrics["tolerances"]):
        if row["measure"].endswith("_rmse"):
            row["value"] *= 2.0


def _worse_in_errors_too(metrics: Json) -> None:
    _worse(metrics)
    for errors in metrics["walks"]["identified"]["errors"].values():
        for error in errors.values():
            error["rmse"] *= 2.0


DAMAGES: dict[str, tuple[Callable[[Json], object], str]] = {
    "no measures": (lambda m: m.update(measures=[]), "is missing from the measures"),
    "half of them": (
        lambda m: m.update(measures=m["measures"][: len(m["measures"]) // 2]),
        "is missing from the measures",
    ),
    "null": (_set("angle_rmse", "knee_angle_r", None), "angle_rmse of knee_angle_r has no value"),
    "not a number": (_set("epsilon", "walk", math.nan), "finite number"),
    "all null": (
        lambda m: [row.update(value=None) for row in (*m["measures"], *m["tolerances"])],
        "has no value",
    ),
    "another unit": (
        lambda m: [row.update(unit="rad") for row in _rows(m, "angle_rmse", "knee_angle_r")],
        "is in rad",
    ),
    "twice as bad": (_worse, "follows from the curves and counts in the same file"),
    "twice as bad in the errors too": (_worse_in_errors_too, "that of the curves in the same file"),
    "one measure and not its verdict": (
        lambda m: m["measures"][0].update(value=9.0),
        "was judged by its limit",
    ),
    "arms without a value": (_set("arm_work_share", "walk", None), "arm_work_share of walk has no"),
    "one twice": (lambda m: m["measures"].append(m["measures"][0]), "is there twice"),
    "one too many": (
        lambda m: m["measures"].append({**m["measures"][0], "target": "elbow_r"}),
        "nothing in the file says that it was measured",
    ),
    "fewer cycles": (
        _set("consecutive_cycles", "start phase 0", 10.0),
        "consecutive_cycles of start phase 0 is 10",
    ),
    "pushes": (_set("push_survival", "phase 0", 10.0), "push_survival of phase 0 is 10"),
    "speed": (_set("speed_error", "walk", 4.0), "speed_error of walk is 4"),
    "another record": (
        lambda m: m["record"]["spatiotemporal"].update(cadence=99.0),
        "the record in it is not that of the walk that was measured",
    ),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_damage_is_refused_with_the_place(folder: Path, name: str) -> None:
    change, told = DAMAGES[name]
    message = _refusal(folder, change)
    assert told in message
    assert str(folder / "metrics.json") in message


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        ("configuration.toml", "filter_frequency = ", "filter_frequency = 1", "other settings"),
        ("configuration.toml", "cycles = ", "cycles = 1", "other settings"),
        ("subject.toml", "mass_kg = ", "mass_kg = 1.0 # ", "subject.toml"),
    ],
)
def test_what_lies_beside_it_is_that_of_the_walk(
    folder: Path, file: str, old: str, new: str, told: str
) -> None:
    path = folder / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(Exception, match=told):
        stored_metrics(folder / "metrics.json")


def test_a_part_that_is_missing_is_named(folder: Path) -> None:
    (folder / "correction.json").unlink()
    with pytest.raises(ArtefactError, match=r"correction\.json missing"):
        stored_metrics(folder / "metrics.json")
