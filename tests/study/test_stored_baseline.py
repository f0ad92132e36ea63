"""Stored baselines that are damaged, or edited by hand, are refused before anything is walked."""

import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from safetensors.numpy import load_file, save_file

from gaitval.apps.regression.baseline import seal_again, stored_metrics
from gaitval.apps.regression.seal import (
    SEAL,
    UNKNOWN_VERSIONS,
    changes,
    read_seal,
    seal,
)
from gaitval.errors import ArtefactError
from gaitval.metrics.results import read_metrics
from gaitval.metrics.tolerances import load_registry

ROOT = Path(__file__).parents[2]
BASELINES = sorted((ROOT / "reports").glob("S*/baseline"))
Json = dict[str, Any]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROOT / "reports/S05/baseline", tmp_path / "baseline"))


@pytest.mark.parametrize("baseline", BASELINES, ids=lambda path: path.parent.name)
def test_the_stored_ones_can_be_believed(baseline: Path) -> None:
    assert stored_metrics(baseline / "metrics.json").measures


def test_no_number_is_refused_with_the_place(folder: Path) -> None:
    _edit("metrics.json", lambda m: m["measures"][0].update(value=math.nan))(folder)
    with pytest.raises(ArtefactError, match="NaN is no number") as refused:
        stored_metrics(folder / "metrics.json")
    assert str(folder / "metrics.json") in str(refused.value)


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("configuration.toml", "filter_frequency = ", "filter_frequency = 1", "other settings"),
        ("configuration.toml", "\ncycles = 24", "\ncycles = 25", "other settings"),
        ("subject.toml", "mass_kg = ", "mass_kg = 1.0 # ", "subject.toml"),
    ],
)
def test_what_lies_beside_it_is_that_of_the_walk(
    folder: Path, file: str, old: str, new: str, message: str
) -> None:
    path = folder / file
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(Exception, match=message):
        stored_metrics(folder / "metrics.json")


Change = Callable[[Path], object]


def _edit(name: str, change: Callable[[Json], object]) -> Change:
    def edit(folder: Path) -> None:
        values = json.loads((folder / name).read_text(encoding="utf-8"))
        change(values)
        (folder / name).write_text(json.dumps(values), encoding="utf-8")

    return edit


def _weights(folder: Path) -> None:
    path = folder / "policy" / "policy.safetensors"
    tensors = load_file(path)
    tensors["action_net.bias"] *= 1.01
    save_file(tensors, path)


def _without_pushes(metrics: Json) -> None:
    for name in ("measures", "tolerances"):
        metrics[name] = [row for row in metrics[name] if row["measure"] != "push_survival"]
    metrics["push_recovery"] = None


def _longer(values: Json) -> None:
    values["identified"][4] = 1.01


EDITS: dict[str, tuple[Change, str]] = {
    "weights": (_weights, "changed since it was stored: policy."),
    "policy": (_edit("policy/policy.json", lambda v: v.update(seed=7)), "stored: policy."),
    "mu": (_edit("identification.json", _longer), "stored: mu."),
    "correction": (_edit("correction.json", lambda v: v.update(height=0.01)), "stored: correction"),
    "no pushes": (_edit("metrics.json", _without_pushes), "measures, rest of metrics.json"),
    "limits": (
        _edit("metrics.json", lambda m: [row.update(tolerance=99.0) for row in m["tolerances"]]),
        "stored: measures",
    ),
    "margins in the seal": (
        _edit(SEAL, lambda s: s["margins"]["angle_rmse"].update(value=3.0)),
        "seal.json: was edited",
    ),
    "no seal": (lambda folder: (folder / SEAL).unlink(), "seal.json: no such file"),
    "half a seal": (_edit(SEAL, lambda s: s.pop("parts")), "does not match the schema of seal"),
}


@pytest.mark.parametrize("name", EDITS)
def test_an_edit_that_contradicts_nothing_is_refused_until_it_is_sealed(
    folder: Path, name: str
) -> None:
    change, message = EDITS[name]
    change(folder)
    with pytest.raises(ArtefactError) as refused:
        stored_metrics(folder / "metrics.json")
    assert message in str(refused.value)
    assert f"gaitval baseline SUBJECT --to {folder} --seal" in str(refused.value)
    seal_again(folder)
    assert stored_metrics(folder / "metrics.json")


def test_the_layout_of_a_file_does_not_matter(folder: Path) -> None:
    """A formatter may have been over them, or git on Windows."""
    for path in (*folder.glob("*.json"), folder / "policy" / "policy.json"):
        path.write_text(json.dumps(json.loads(path.read_text()), indent=4), encoding="utf-8")
    path = folder / "configuration.toml"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert stored_metrics(folder / "metrics.json")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"value": 3.0}, "angle_rmse 0.3 deg (lower is better), now 3 deg (lower is better)"),
        ({"better": "higher"}, "now 0.3 deg (higher is better)"),
    ],
)
def test_other_margins_than_it_was_stored_with_are_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, change: Json, message: str
) -> None:
    """With margins ten times as wide every walk passes."""
    whole = load_registry()
    margins = [
        margin.model_copy(update=change) if margin.measure == "angle_rmse" else margin
        for margin in whole.margin
    ]
    other = whole.model_copy(update={"margin": tuple(margins)})
    monkeypatch.setattr("gaitval.apps.regression.seal.load_registry", lambda: other)
    with pytest.raises(ArtefactError, match="the margins of this gaitval are not those") as refused:
        stored_metrics(folder / "metrics.json")
    assert message in str(refused.value)


def test_what_has_changed_since_is_told(folder: Path) -> None:
    before = read_metrics(folder)
    versions = {"simulate": 3, "validate": 5}
    seal(folder, versions=versions, commit=None)
    found = read_seal(folder)
    assert changes(found, before, before, versions) == []
    numpy = before.provenance.versions["numpy"]
    other = {"versions": {**before.provenance.versions, "numpy": "99.0"}, "record": "2" * 64}
    now = before.model_copy(update={"provenance": before.provenance.model_copy(update=other)})
    assert changes(found, before, now, versions | {"simulate": 4, "push": 1}) == [
        f"numpy {numpy}, now 99.0",
        "the record as it is read now",
        "stage simulate at version 3, now 4",
        "stage push at version none, now 1",
    ]
    seal(folder, versions=None, commit=None)
    assert changes(read_seal(folder), before, before, versions) == [UNKNOWN_VERSIONS]


def test_a_part_that_is_missing_is_named(folder: Path) -> None:
    (folder / "correction.json").unlink()
    with pytest.raises(ArtefactError, match=r"correction\.json missing"):
        stored_metrics(folder / "metrics.json")
