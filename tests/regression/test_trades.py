"""No error pays for another unseen: a planted change of a mean error is named, by `gaitval check`
for one person, and by the test of the tables for the ten.
"""

import json
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from gaitval.apps.regression import baseline
from gaitval.cli import app
from gaitval.metrics.results import ComparedMeasure, Metrics, metrics_from, read_metrics

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs" / "build"))

import accuracy_tables  # noqa: E402

STORED = "reports/S05/baseline/metrics.json"
Plant = Mapping[tuple[str, str], float]
"""Factors by measure and target."""

WORSE: Plant = {
    **{("angle_rmse", f"hip_rotation_{side}"): 1.10 for side in "rl"},
    **{("force_rmse", f"vertical_{side}"): 1.05 for side in "rl"},
}
BETTER: Plant = {key: 1.0 / factor for key, factor in WORSE.items()}
LEFT: Plant = {("angle_rmse", "hip_rotation_l"): 1.10, ("force_rmse", "vertical_l"): 1.10}
RIGHT: Plant = {("angle_rmse", "hip_rotation_r"): 1.10, ("force_rmse", "vertical_r"): 1.10}
UNCORRECTED: Plant = {
    ("moment_rmse_as_measured", "knee_angle_r"): 1.2,
    ("moment_rmse_own_hips", "hip_flexion_l"): 1.2,
    ("epsilon", "walk"): 1.05,
}
PLANTS = {
    "worse": (WORSE, ("hip rotation", "vertical force")),
    "better": (BETTER, ("hip rotation", "vertical force")),
    "left": (LEFT, ("hip rotation", "vertical force")),
    "right": (RIGHT, ("hip rotation", "vertical force")),
    "uncorrected": (
        UNCORRECTED,
        ("knee moment as measured", "hip moment about own hips", "epsilon"),
    ),
    "nothing": ({}, ()),
}


def planted(file: Path, plant: Plant) -> dict[str, Any]:
    values: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    for row in values["measures"]:
        row["value"] *= plant.get((row["measure"], row["target"]), 1.0)
    return values


@pytest.fixture(params=PLANTS)
def case(request: pytest.FixtureRequest) -> tuple[Plant, tuple[str, ...]]:
    return PLANTS[request.param]


def test_check_names_what_changed_for_the_worse_and_the_better(
    case: tuple[Plant, tuple[str, ...]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    plant, names = case

    def walk(*_: object, **__: object) -> Metrics:
        return metrics_from(planted(ROOT / STORED, plant), "the walk")

    monkeypatch.setattr(baseline, "walk_again", walk)
    path = tmp_path / "check.json"
    options = ["--baseline", str(ROOT / STORED), "--quick", "--json", str(path)]
    text = CliRunner().invoke(app, ["check", *options]).output
    found = json.loads(path.read_text(encoding="utf-8"))["changed_errors"]
    assert {row["error"] for row in found} == {*names}
    assert ("Mean errors of both sides that changed by more than 3 %" in text) == bool(names)
    for name in names:
        assert f"  {name} " in text


def test_a_change_in_words_has_both_numbers_and_the_share(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def walk(*_: object, **__: object) -> Metrics:
        return metrics_from(planted(ROOT / STORED, WORSE), "the walk")

    before = [
        row.value or 0.0
        for row in read_metrics(ROOT / STORED).measures
        if row.measure == "angle_rmse" and row.target.startswith("hip_rotation")
    ]
    mean = sum(before) / 2
    monkeypatch.setattr(baseline, "walk_again", walk)
    options = ["--baseline", str(ROOT / STORED), "--quick"]
    text = CliRunner().invoke(app, ["check", *options]).output
    assert f"hip rotation {mean:.2f} -> {1.1 * mean:.2f} deg, +10 %" in text


@pytest.fixture(scope="module")
def people() -> list[Metrics]:
    """The ten stored baselines."""
    return accuracy_tables.load(ROOT)


def test_a_trade_across_the_ten_is_named(
    case: tuple[Plant, tuple[str, ...]], people: list[Metrics]
) -> None:
    plant, names = case

    def grown(row: ComparedMeasure) -> ComparedMeasure:
        factor = plant.get((row.measure, row.target), 1.0)
        return row.model_copy(update={"value": None if row.value is None else factor * row.value})

    traded = [
        each.model_copy(update={"measures": [grown(row) for row in each.measures]})
        for each in people
    ]
    errors = accuracy_tables.errors_now
    changed = accuracy_tables.changes(errors(people), errors(traded))
    assert len(changed) == len(names)
    for name in names:
        assert [each for each in changed if each.startswith(f"{name} ")] != []


def test_tables_fail_until_the_changelog_names_a_trade_with_its_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("README.md", "CHANGELOG.md", "reports/README.md", "reports/errors.csv"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    for file in ROOT.glob("reports/S*/baseline/metrics.json"):
        copy = tmp_path / file.relative_to(ROOT)
        copy.parent.mkdir(parents=True)
        copy.write_text(json.dumps(planted(file, WORSE)), encoding="utf-8")
    assert accuracy_tables.main(["--check"], tmp_path) == 1
    assert "errors.csv: does not match" in capsys.readouterr().err
    accuracy_tables.main([], tmp_path)
    changed = [line.partition(": ")[2] for line in capsys.readouterr().out.splitlines()]
    assert [each for each in changed if each.startswith("hip rotation ")] != []
    assert [each for each in changed if each.startswith("vertical force ")] != []
    assert accuracy_tables.main(["--check"], tmp_path) == 1
    error = capsys.readouterr().err
    assert all(f"does not name with its reason: {each}" in error for each in changed)
    changelog = tmp_path / "CHANGELOG.md"
    line = "; ".join(f"{each} (asked for by nobody)" for each in changed)
    text = changelog.read_text(encoding="utf-8")
    changelog.write_text(
        text.replace("## Unreleased\n", f"## Unreleased\n\n* Errors: {line}.\n", 1),
        encoding="utf-8",
    )
    assert accuracy_tables.main(["--check"], tmp_path) == 0


def test_an_older_section_of_the_changelog_names_nothing() -> None:
    change = "hip rotation 2.60 -> 2.86 deg, +10 %"
    named = f"* Errors: {change} (step width).\n"
    new, old = f"\n## Unreleased\n\n{named}", f"\n## Unreleased\n\n## 0.10.0\n\n{named}"
    assert accuracy_tables.unnamed([change], new) == []
    assert accuracy_tables.unnamed([change], old) == [change]
    assert accuracy_tables.unnamed([change], new.replace(" (step width)", "")) == [change]


def test_the_table_of_errors_is_that_of_the_walks(people: list[Metrics]) -> None:
    """The measures that it is made of are the errors that each page shows."""
    now = {error.name: value for error, value in accuracy_tables.errors_now(people).items()}
    for column, words in (("corrected", ""), ("as_measured", " as measured")):
        for rows in zip(*(each.summary.errors for each in people), strict=True):
            if column == "corrected" or rows[0].kind != "angles":
                name = accuracy_tables._name(rows[0]) + words
                mean = sum(getattr(row, column) for row in rows) / len(rows)
                assert now[name] == pytest.approx(mean, rel=1e-3)
