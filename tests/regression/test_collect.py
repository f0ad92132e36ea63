"""Walks are found in runs, baselines and folders of them; what cannot be compared is refused."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.apps.regression.collect import collect, collect_versions
from gaitval.apps.regression.regression import compare
from gaitval.apps.regression.seal import SealedMargin, seal
from gaitval.apps.regression.versions import in_margins, matched
from gaitval.errors import ArtefactError
from gaitval.metrics.results import read_metrics
from gaitval.metrics.tolerances import load_registry

REPORTS = Path(__file__).parents[2] / "reports"


def stored(name: str = "S05") -> Path:
    return REPORTS / name / "baseline"


def run_of(folder: Path, name: str = "S05", **changed: float) -> Path:
    """A run folder as far as it is compared: the stored metrics with the values of some measures
    changed by an amount."""
    metrics = read_json(stored(name) / "metrics.json")
    for row in metrics["measures"]:
        row["value"] += changed.get(row["measure"], 0.0)
    write_json(folder / "metrics.json", metrics)
    return folder


def test_each_place_is_read_once_in_its_order(tmp_path: Path) -> None:
    run = run_of(tmp_path / "runs" / "mine")
    shutil.copytree(stored("S02"), tmp_path / "runs" / "other" / "baseline")
    (tmp_path / "runs" / "empty").mkdir()
    found = collect([stored("S03"), tmp_path / "runs", run, stored("S03") / "metrics.json"])
    assert [walk.subject for walk in found] == ["S03", "S05", "S02"]
    assert [walk.margins is None for walk in found] == [False, True, False]
    assert found[1].folder == run


def test_of_a_run_with_a_baseline_in_it_the_run_counts(tmp_path: Path) -> None:
    shutil.copytree(stored(), tmp_path / "S05" / "baseline")
    assert collect([tmp_path / "S05"])[0].folder == tmp_path / "S05" / "baseline"
    run_of(tmp_path / "S05")
    assert collect([tmp_path])[0].folder == tmp_path / "S05"


def test_a_run_that_is_redone_half_does_not_count(
    make_run: Callable[..., Path], tmp_path: Path
) -> None:
    """Its figures are those of an earlier walk: the baseline in it counts, or nothing."""
    run = make_run(tmp_path / "S05")
    shutil.copytree(stored(), run / "baseline")
    assert collect([run])[0].folder == run
    records = read_json(run / "stages.json")
    records["simulate"]["outputs"] = None
    write_json(run / "stages.json", records)
    for place in (run, tmp_path):
        assert collect([place])[0].folder == run / "baseline"
    shutil.rmtree(run / "baseline")
    for place in (run, tmp_path, run / "metrics.json"):
        with pytest.raises(ArtefactError, match="not a finished run: simulate has begun"):
            collect([place])


def test_what_is_no_walk_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match="no such folder"):
        collect([tmp_path / "none"])
    with pytest.raises(ArtefactError, match="nor a folder in it has a"):
        collect([tmp_path])
    (tmp_path / "metrics.json").write_text('{"schema_version": 14, "subject": "<b>"}')
    with pytest.raises(ArtefactError, match="does not match the schema"):
        collect([tmp_path])


@pytest.mark.parametrize("part", ["metrics.json", "policy/policy.safetensors", "seal.json"])
def test_a_baseline_that_was_edited_or_is_incomplete_is_refused(tmp_path: Path, part: str) -> None:
    shutil.copytree(stored(), tmp_path / "baseline")
    file = tmp_path / "baseline" / part
    if part == "metrics.json":
        metrics = read_json(file)
        metrics["measures"][0]["value"] *= 0.5
        write_json(file, metrics)
    elif part == "seal.json":
        values = read_json(file)
        values["margins"]["angle_rmse"]["value"] = 30.0
        write_json(file, values)
    else:
        file.unlink()
    with pytest.raises(ArtefactError, match=r"changed since|missing|was edited"):
        collect([tmp_path / "baseline"])


def test_versions_are_matched_by_subject(tmp_path: Path) -> None:
    now = collect([run_of(tmp_path / "a"), run_of(tmp_path / "b", "S02")])
    before, now_again = collect_versions([stored(), stored("S03")], now)
    found = matched(before, now_again)
    assert [pair.now.subject for pair in found.pairs] == ["S05"]
    assert (found.only_before, found.only_now) == (("S03",), ("S02",))
    assert found.pairs[0].same_record
    assert found.lost() == found.improved() == []


def test_a_subject_twice_or_none_in_common_is_refused(tmp_path: Path) -> None:
    now = collect([run_of(tmp_path / "a")])
    with pytest.raises(ArtefactError, match=r"all of subject S05.*Give one of them with --before"):
        collect_versions([stored(), run_of(tmp_path / "b")], now)
    with pytest.raises(ArtefactError, match=r"with RUN"):
        collect_versions([stored()], collect([tmp_path / "a", tmp_path / "b"]))
    with pytest.raises(ArtefactError, match="no subject is in both"):
        collect_versions([stored("S02")], now)


@pytest.mark.parametrize(("share", "lost"), [(0.9, 0), (1.1, 18)])
def test_only_a_change_beyond_the_margin_counts(tmp_path: Path, share: float, lost: int) -> None:
    """All 18 curves of the angles get worse by a part of their margin."""
    margin = next(each.value for each in load_registry().margin if each.measure == "angle_rmse")
    now = collect([run_of(tmp_path / "a", angle_rmse=share * margin)])
    found = matched(*collect_versions([stored()], now))
    assert len(found.lost()) == lost
    assert found.improved() == []
    back = matched(now, collect([stored()]))
    assert (len(back.lost()), len(back.improved())) == (0, lost)


def test_the_margins_are_those_that_the_baseline_was_stored_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A baseline sealed with margins three times as wide lets twice a margin pass."""
    margins = {each.measure: each for each in load_registry().margin}
    wide = {
        name: SealedMargin(value=3.0 * each.value, unit=each.unit, better=each.better)
        for name, each in margins.items()
    }
    shutil.copytree(stored(), tmp_path / "baseline")
    monkeypatch.setattr("gaitval.apps.regression.seal.installed_margins", lambda: wide)
    seal(tmp_path / "baseline", versions=None, commit=None)
    monkeypatch.undo()
    now = collect([run_of(tmp_path / "a", angle_rmse=2.0 * margins["angle_rmse"].value)])
    wider = matched(*collect_versions([tmp_path / "baseline"], now))
    assert wider.lost() == []
    assert wider.pairs[0].rows[0].margin == 3.0 * margins["angle_rmse"].value
    assert len(matched(*collect_versions([stored()], now)).lost()) == 18


def test_margins_that_are_given_replace_those_of_the_same_measure_only() -> None:
    metrics = read_metrics(stored())
    given = {"epsilon": SealedMargin(value=7.0, unit="1", better="lower")}
    rows = {row.measure: row.margin for row in compare(metrics, metrics, margins=given)}
    installed = {each.measure: each.value for each in load_registry().margin}
    assert rows == {name: installed[name] for name in rows} | {"epsilon": 7.0}


def test_changes_are_told_in_margins(tmp_path: Path) -> None:
    now = collect([run_of(tmp_path / "a", epsilon=0.025, falls=1.0)])
    (pair,) = matched(*collect_versions([stored()], now)).pairs
    rows = {row.measure: row for row in pair.rows}
    assert in_margins(rows["epsilon"]) == pytest.approx(0.025 / rows["epsilon"].margin, rel=1e-6)
    assert in_margins(rows["falls"]) == float("inf")
    assert in_margins(rows["push_survival"]) == 0.0
