"""What `gaitval check` refuses before it walks, and what it keeps where something goes wrong."""

import io
import shutil
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from gaitval.apps.devices import results
from gaitval.apps.regression import baseline, history
from gaitval.apps.regression.regression import LONG_MEASURES
from gaitval.apps.regression.seal import parts_of
from gaitval.artefacts import read_json, value_hash, write_json
from gaitval.cli import app
from gaitval.errors import ArtefactError
from gaitval.metrics.results import read_metrics
from gaitval.terminal import display

STORED = Path(__file__).parents[2] / "reports" / "S05" / "baseline"


@pytest.fixture
def message(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    text = io.StringIO()
    monkeypatch.setattr(display, "messages", display.Terminal(file=text, width=400))
    return text


@pytest.fixture
def walks(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The walks that were made, each of which gives the stored figures again."""
    found: list[str] = []

    def walk(*_: object, **__: object) -> Any:
        found.append("walked")
        return read_metrics(STORED)

    monkeypatch.setattr(baseline, "walk_again", walk)
    monkeypatch.delenv("GAITVAL_HISTORY", raising=False)
    return found


def check(*options: str, folder: Path = STORED) -> Any:
    return CliRunner().invoke(app, ["check", "--baseline", str(folder), "--quick", *options])


def test_a_measure_that_is_newer_than_the_baseline_is_named_and_fails_nothing(
    walks: list[str], tmp_path: Path
) -> None:
    folder = tmp_path / "baseline"
    shutil.copytree(STORED, folder)
    values, sealed = read_json(folder / "metrics.json"), read_json(folder / "seal.json")
    for name in ("measures", "tolerances"):
        values[name] = [row for row in values[name] if row["measure"] != "pressure_arm_rmse"]
    write_json(folder / "metrics.json", values)
    # as it was sealed before gaitval knew the measure
    sealed["margins"].pop("pressure_arm_rmse")
    sealed["parts"] = parts_of(folder)
    rest = {name: each for name, each in sealed.items() if name != "seal"}
    write_json(folder / "seal.json", {**rest, "seal": value_hash(rest)})
    junit = tmp_path / "accuracy.xml"
    result = check("--junit", str(junit), folder=folder)
    assert result.exit_code == 0, result.output
    text = " ".join(result.output.split())
    assert "New: 2 measures" in text
    assert "(pressure_arm_rmse)" in text
    assert "gaitval baseline" in text
    rows = len(read_metrics(STORED).measures) - sum(
        row.measure in LONG_MEASURES for row in read_metrics(STORED).measures
    )
    assert f"{rows - 2} of {rows - 2} measures within their margins" in text
    assert junit.read_text(encoding="utf-8").count("new: not measured") == 2
    # one that the gaitval that stored it knew is not new: it was taken out
    sealed["margins"] = read_json(STORED / "seal.json")["margins"]
    rest = {name: each for name, each in sealed.items() if name != "seal"}
    write_json(folder / "seal.json", {**rest, "seal": value_hash(rest)})
    assert check(folder=folder).exit_code == 2


@pytest.mark.parametrize("place", ["below a file", "a folder"])
@pytest.mark.parametrize("of", ["a walk", "a device"])
def test_a_junit_file_that_cannot_be_written_ends_a_check_before_it_walks(
    walks: list[str], message: io.StringIO, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    place: str, of: str,
) -> None:  # fmt: skip
    (tmp_path / "file").write_text("")
    junit = tmp_path / "file" / "accuracy.xml" if place == "below a file" else tmp_path
    monkeypatch.setattr(results, "walk_again", lambda *_: pytest.fail("walks"))
    options = ["--junit", str(junit)]
    if of == "a device":
        (tmp_path / "S05-hip_exo").mkdir()
        (tmp_path / "S05-hip_exo" / "device.json").write_text("{}")
        options += ["--baseline", str(tmp_path / "S05-hip_exo")]
    assert check(*options).exit_code == 2
    text = message.getvalue()
    assert f"--junit {junit}: " in text
    assert "--out" not in text
    assert walks == []


def test_a_junit_file_goes_into_a_new_folder_and_stays_whole_where_the_walk_fails(
    walks: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    junit = tmp_path / "new" / "accuracy.xml"
    assert check("--junit", str(junit)).exit_code == 0
    before = junit.read_bytes()

    def fail(*_: object, **__: object) -> None:
        raise ArtefactError("the walk has no cycle")

    monkeypatch.setattr(baseline, "walk_again", fail)
    assert check("--junit", str(junit)).exit_code == 2
    assert junit.read_bytes() == before
    assert [path.name for path in junit.parent.iterdir()] == ["accuracy.xml"]


@pytest.mark.parametrize("ending", ["csv", "html", "pdf"])
def test_a_history_that_its_page_would_overwrite_ends_a_check_before_it_walks(
    walks: list[str], message: io.StringIO, tmp_path: Path, ending: str
) -> None:
    assert check("--history", str(tmp_path / f"hist.{ending}")).exit_code == 2
    assert "Name it accuracy.db" in message.getvalue()
    assert walks == []
    assert list(tmp_path.iterdir()) == []


def test_the_commit_is_that_before_the_walk(
    walks: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody may commit, or check out another one, while it walks for minutes."""
    monkeypatch.setattr(history, "current_commit", lambda: ("walked" if walks else "began", None))
    file = tmp_path / "accuracy.db"
    assert check("--history", str(file)).exit_code == 0
    assert [kept.revision for kept in history.read(file)] == ["began"]


def test_a_history_that_fails_in_the_end_leaves_the_junit_file(
    walks: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise ArtefactError("accuracy.db: the disk is full")

    monkeypatch.setattr(history, "keep", full)
    junit, file = tmp_path / "accuracy.xml", tmp_path / "accuracy.db"
    assert check("--history", str(file), "--junit", str(junit)).exit_code == 2
    assert "<testsuite" in junit.read_text(encoding="utf-8")
