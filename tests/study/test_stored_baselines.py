"""A stored baseline is found by its folder, a file in it, a run, or its subject."""

import shutil
from pathlib import Path

import pytest

from gaitval.apps.regression import stored_baselines
from gaitval.apps.regression.stored_baselines import (
    find_baseline,
    installed_baselines,
)
from gaitval.errors import ArtefactError

REPORTS = Path(__file__).resolve().parents[2] / "reports"


@pytest.fixture
def wheel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed package with two baselines, away from any checkout; the current folder is
    another."""
    package = tmp_path / "site" / "gaitval"
    for name in ("S05", "S07"):
        (package / "baselines" / name).mkdir(parents=True)
        (package / "baselines" / name / "metrics.json").write_text("{}")
    monkeypatch.setattr(stored_baselines, "_PACKAGE", package)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return package / "baselines"


@pytest.mark.parametrize("wanted", ["S05", "s05", "5", "WBDS14"])
def test_a_wheel_has_those_of_the_built_in_subjects(wheel: Path, wanted: str) -> None:
    assert find_baseline(wanted) == wheel / "S05"


def test_the_users_own_comes_first(wheel: Path) -> None:
    own = Path("reports/S05/baseline")
    own.mkdir(parents=True)
    (own / "metrics.json").write_text("{}")
    for wanted in ("S05", "reports/S05", "reports/S05/baseline", own / "metrics.json"):
        assert find_baseline(wanted) == own
    (own.parent / "metrics.json").write_text("{}")  # a run and its baseline
    assert find_baseline("reports/S05") == own
    assert find_baseline("S05", wheel.parent) == wheel / "S05"


@pytest.mark.parametrize("wanted", ["reports/S05/baseline", "reports/S05/baseline/metrics.json"])
def test_a_path_is_no_other_baseline(wheel: Path, wanted: str) -> None:
    """A project that forgot to commit its own must not pass by that of gaitval."""
    with pytest.raises(ArtefactError, match="no stored baseline") as refused:
        find_baseline(wanted)
    assert "by their subject, such as --baseline S05" in str(refused.value)
    assert str(wheel) in str(refused.value)


@pytest.mark.parametrize("wanted", ["nowhere", "S08", "reports/S08/baseline", "44"])
def test_a_missing_one_says_where_and_what_there_is(wheel: Path, wanted: str) -> None:
    with pytest.raises(ArtefactError) as refused:
        find_baseline(wanted)
    text = str(refused.value)
    assert text.startswith(f"{wanted}: no stored baseline. Looked for metrics.json in {wanted}")
    assert "`gaitval baseline SUBJECT` makes one" in text
    assert f"S05, S07 in {wheel}" in text
    if wanted == "S08":
        assert str(wheel / "S08") in text


def test_a_checkout_has_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert find_baseline("S03") == REPORTS / "S03" / "baseline"
    assert list(installed_baselines()) == [f"S{number:02d}" for number in range(1, 11)]
    with pytest.raises(ArtefactError, match=r"S09, S10 in .*reports"):
        find_baseline("nowhere")
    shutil.copytree(REPORTS / "S03" / "baseline", tmp_path / "mine")
    assert find_baseline("mine") == Path("mine")
