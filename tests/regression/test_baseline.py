"""A baseline is stored whole, of a finished run of the right person, or the old one stays; damage
of one that is stored is in `tests/study/test_stored_baseline.py`."""

import errno
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from quick_settings import QUICK

import gaitval as gv
from gaitval._internal.io import artefacts
from gaitval._internal.io.artefacts import read_json, write_json, write_text
from gaitval.apps.regression.baseline import (
    store_baseline,
    stored_metrics,
    walk_again,
)
from gaitval.apps.regression.seal import SEAL, read_seal
from gaitval.errors import ArtefactError
from gaitval.study.inputs import STORED_FILES
from gaitval.study.stage import Observer

REPORTS = Path(__file__).parents[2] / "reports"

MakeRun = Callable[..., Path]


@pytest.fixture
def run(make_run: MakeRun, tmp_path: Path) -> Path:
    return make_run(tmp_path / "run")


@pytest.fixture
def target(run: Path, tmp_path: Path) -> Path:
    """A stored baseline with something of the user's in its folder."""
    store_baseline(run, tmp_path / "baseline")
    write_text(tmp_path / "baseline" / "README.md", "ours")
    return tmp_path / "baseline"


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def edited(path: Path, change: Callable[[Any], object]) -> None:
    values = read_json(path)
    change(values)
    write_json(path, values)


def test_what_is_stored_can_be_checked(run: Path, target: Path) -> None:
    assert {*contents(target)} == {*STORED_FILES, SEAL, "README.md"}
    assert stored_metrics(target / "metrics.json").subject.identifier == "S05"
    seal = read_seal(target)
    assert seal.versions == {"scale": 1, "simulate": 1, "validate": 1}
    assert seal.commit == "a" * 40


def test_a_run_of_a_gaitval_without_versions_is_stored_as_one(run: Path, tmp_path: Path) -> None:
    edited(run / "stages.json", lambda records: records["scale"].pop("version"))
    store_baseline(run, tmp_path / "baseline")
    assert read_seal(tmp_path / "baseline").versions is None


def test_a_run_that_is_redone_half_is_refused_and_the_old_baseline_stays(
    run: Path, target: Path
) -> None:
    """As after `gaitval subject --start OTHER` was killed: a policy of the one, metrics of the
    other."""
    before = contents(target)
    edited(run / "stages.json", lambda records: records["simulate"].update(outputs=None))
    with pytest.raises(ArtefactError, match="not a finished run: simulate has begun"):
        store_baseline(run, target)
    assert contents(target) == before


@pytest.mark.parametrize("name", ["metrics.json", "identification.json", "policy/policy.json"])
def test_a_file_that_is_not_as_the_run_wrote_it_is_no_baseline(
    run: Path, tmp_path: Path, name: str
) -> None:
    write_text(run / name, "{}")
    with pytest.raises(ArtefactError, match=rf"{name}: not as the run wrote it"):
        store_baseline(run, tmp_path / "baseline")
    (run / name).unlink()
    with pytest.raises(ArtefactError, match=rf"{name} missing.*not a finished run"):
        store_baseline(run, tmp_path / "baseline")


def test_a_run_that_every_check_would_refuse_is_refused_with_a_way_on(
    run: Path, tmp_path: Path
) -> None:
    """Not: store the baseline again."""
    path = run / "configuration.toml"
    path.write_text(path.read_text().replace("\ncycles = 24", "\ncycles = 25", 1))
    with pytest.raises(ArtefactError, match="has other settings than the walk") as refused:
        store_baseline(run, tmp_path / "baseline")
    assert "gaitval baseline" not in str(refused.value)
    assert f"`gaitval stage validate SUBJECT --out {run} --force`" in str(refused.value)
    assert not (tmp_path / "baseline").exists()


def test_a_run_of_another_person_is_refused(run: Path, tmp_path: Path) -> None:
    with pytest.raises(ArtefactError, match="is of subject S05, but a baseline of S06") as refused:
        store_baseline(run, tmp_path / "baseline", "S06")
    assert str(run / "subject.toml") in str(refused.value)
    assert not (tmp_path / "baseline").exists()
    store_baseline(run, tmp_path / "baseline", "S05")


def test_records_that_were_edited_are_refused_before_anything_is_written(
    run: Path, target: Path
) -> None:
    before = contents(target)
    edited(run / "stages.json", lambda v: v.update(scale=None))
    with pytest.raises(ArtefactError, match="scale: does not match the schema") as refused:
        store_baseline(run, target)
    assert str(run / "stages.json") in str(refused.value)
    assert contents(target) == before


@pytest.mark.parametrize("name", ["policy.json", "metrics.json", SEAL])
def test_what_a_full_disk_cut_off_is_refused_until_it_is_stored_again(
    run: Path, target: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    whole = artefacts.replacing
    edited(target / SEAL, lambda values: values.update(seal="0" * 64))

    def full(path: Path) -> Any:
        if Path(path).name == name:
            with artefacts.writing(path):
                raise OSError(errno.ENOSPC, "No space left on device")
        return whole(path)

    with monkeypatch.context() as patch:
        patch.setattr(artefacts, "replacing", full)
        with pytest.raises(ArtefactError, match="no space left"):
            store_baseline(run, target)
    with pytest.raises(ArtefactError, match="was edited"):
        stored_metrics(target / "metrics.json")
    store_baseline(run, target)
    assert stored_metrics(target / "metrics.json")


def test_what_is_wrong_with_a_baseline_is_still_said_of_the_baseline(tmp_path: Path) -> None:
    """A check copies it into its temporary folder, of which nobody knows."""
    from shutil import copytree

    copytree(REPORTS / "S05" / "baseline", tmp_path / "baseline")
    write_text(tmp_path / "baseline" / "identification.json", "{}")
    with pytest.raises(ArtefactError) as refused:
        walk_again(tmp_path / "baseline", Observer(), quick=True)
    assert str(tmp_path / "baseline" / "identification.json") in str(refused.value)


@pytest.mark.slow  # a study
def test_a_run_that_holds_a_trial_out_is_stored(tmp_path):
    """Its walk is compared with that trial, whose values are not the own ones of subject.toml."""
    run = tmp_path / "S05"
    gv.run_study(5, out=run, settings=[*QUICK, 'record.holdout="T03"'])
    store_baseline(run, tmp_path / "baseline", "S05")
    assert stored_metrics(tmp_path / "baseline" / "metrics.json").unseen == []
