"""A run folder is finished if its records say that its figures are those of its other files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gaitval._internal.io.artefacts import file_hash, read_json, write_json, write_text
from gaitval.apps.regression.finished import (
    IN_ROUNDS,
    LAST,
    ONCE,
    check_finished,
    read_records,
    why_unfinished,
)
from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError
from gaitval.study.run import plan
from gaitval.study.stage import Run
from gaitval.subjects.subject_file import load_subject

MakeRun = Callable[..., Path]


@pytest.fixture
def run(make_run: MakeRun, tmp_path: Path) -> Path:
    return make_run(tmp_path / "run")


def edited(folder: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    records = read_json(folder / "stages.json")
    change(records)
    write_json(folder / "stages.json", records)
    return folder


def test_a_finished_run_is_one_whatever_versions_made_it(run: Path) -> None:
    assert why_unfinished(run) is None
    check_finished(run)
    edited(run, lambda records: [record.update(version=99) for record in records.values()])
    assert why_unfinished(run) is None
    edited(run, lambda records: [record.pop("version") for record in records.values()])
    assert why_unfinished(run) is None


def test_every_stage_up_to_the_figures_counts(tmp_path: Path) -> None:
    """Those of `gaitval subject`, so that a new one is not forgotten here."""
    whole = plan(Run(tmp_path, load_subject("5"), load_configuration()), 1)
    names = [stage.name for stage in whole]
    before = names[: names.index(LAST) + 1]
    assert {name for name in before if "-" not in name} <= {*ONCE}
    assert {name.removesuffix("-1") for name in before if "-" in name} == {*IN_ROUNDS}


@pytest.mark.parametrize("stage", ["scale", "train-1", "identify-1", "correct", "validate"])
def test_a_stage_that_was_interrupted_is_named(run: Path, stage: str) -> None:
    edited(run, lambda records: records[stage].update(outputs=None))
    assert why_unfinished(run) == f"{stage} has begun and not ended"
    with pytest.raises(ArtefactError, match=r"not a finished run: .* has begun") as refused:
        check_finished(run)
    assert f"`gaitval subject SUBJECT --out {run}`" in str(refused.value)


def test_what_comes_after_the_figures_or_was_left_by_a_run_of_more_rounds_does_not_count(
    run: Path,
) -> None:
    def left(records: dict[str, Any]) -> None:
        records["report"]["outputs"] = None
        records["train-2"] = {"inputs": {"model.urdf": "0" * 64}, "outputs": None, "version": 1}

    assert why_unfinished(edited(run, left)) is None


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("metrics.json", "metrics.json is not as validate wrote it"),
        ("rollouts/identified.npz", "rollouts/identified.npz is not as validate read it"),
        ("rounds/1/trained/policy.json", "rounds/1/trained/policy.json is not as keep-1 read it"),
        ("start/policy.json", "start/policy.json is not as train-1 read it"),
    ],
)
def test_a_file_that_changed_since_is_named_however_far_before(
    run: Path, name: str, message: str
) -> None:
    write_text(run / name, '{"another": 1}')
    assert why_unfinished(run) == message
    (run / name).unlink()
    assert why_unfinished(run) == message


def test_an_early_stage_that_ran_again_makes_the_figures_old(run: Path) -> None:
    """As after `stage identify` with another method: each record is whole, and they differ."""
    write_text(run / "identification.json", '{"another": 1}')
    edited(
        run,
        lambda records: records["choose"]["outputs"].update(
            {"identification.json": file_hash(run / "identification.json")}
        ),
    )
    assert why_unfinished(run) == "identification.json is not as validate read it"


def test_a_file_that_no_stage_wrote_as_it_was_read_is_named(run: Path) -> None:
    edited(run, lambda r: r["scale"]["outputs"].update({"model.urdf": "0" * 64}))
    assert why_unfinished(run) == "model.urdf is not as scale wrote it"


def test_a_run_without_figures_is_not_finished(run: Path) -> None:
    edited(run, lambda records: records.pop("validate"))
    assert why_unfinished(run) == "validate has not run"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("[]", "not the records of a run folder"),
        ('{"scale": null}', "scale: does not match the schema of stages.json"),
        ('{"scale": {}}', "at inputs, Field required"),
        ('{"scale": {"inputs": {}, "outputs": 3}}', "at outputs"),
        ('{"scale": {"inputs": {"seed": 1}, "outputs": {}}}', "at inputs/seed"),
        ('{"scale": ', "cannot be read as JSON"),
    ],
)
def test_records_that_were_edited_are_refused(tmp_path: Path, content: str, message: str) -> None:
    write_text(tmp_path / "stages.json", content)
    with pytest.raises(ArtefactError, match=message) as refused:
        read_records(tmp_path)
    assert str(tmp_path / "stages.json") in str(refused.value)
    assert "elete it" in str(refused.value)
