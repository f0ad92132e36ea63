"""What `gaitval check` refuses before it walks, and what it keeps where something goes wrong."""

import io
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from gaitval import __version__
from gaitval._internal.io.artefacts import read_json, value_hash, write_json
from gaitval.apps.regression import baseline
from gaitval.apps.regression.regression import LONG_MEASURES
from gaitval.apps.regression.seal import parts_of
from gaitval.cli import app
from gaitval.cli.terminal import display
from gaitval.errors import ArtefactError
from gaitval.metrics.results import read_metrics

ROOT = Path(__file__).parents[2]
STORED, DOCS = ROOT / "reports" / "S05" / "baseline", ROOT / "docs"


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


@pytest.mark.parametrize("place", ["below a file", "a folder"])
@pytest.mark.parametrize("option", ["--junit", "--json"])
def test_a_file_that_cannot_be_written_ends_a_check_before_it_walks(
    walks: list[str], message: io.StringIO, tmp_path: Path, place: str, option: str
) -> None:
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "accuracy.xml" if place == "below a file" else tmp_path
    assert check(option, str(path)).exit_code == 2
    text = message.getvalue()
    assert f"{option} {path}: " in text
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


def test_json_has_every_measure_and_what_it_was_measured_with(
    walks: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "new" / "accuracy.json"
    assert check("--json", str(path)).exit_code == 0
    found, stored = read_json(path), read_metrics(STORED)
    assert (found["subject"], found["gaitval"]) == ("S05", __version__)
    values = {(row["measure"], row["target"]): row["current"] for row in found["measures"]}
    assert values == {
        (row.measure, row.target): row.value
        for row in stored.measures
        if row.measure not in LONG_MEASURES
    }
    assert {row["change"] for row in found["measures"]} == {"kept"}


def test_the_script_of_the_documentation_plots_the_json_over_commits(
    walks: list[str], tmp_path: Path
) -> None:
    page = (DOCS / "how-to" / "baselines.md").read_text(encoding="utf-8")
    (script,) = re.findall(r"(?m)^    # accuracy\.py\n(?:    .*\n|\n(?=    ))*", page)
    (tmp_path / "accuracy.py").write_text(textwrap.dedent(script), encoding="utf-8")
    files = []
    for commit in ("a1b2c3d", "e4f5a6b"):
        files.append(f"{commit}.json")
        assert check("--json", str(tmp_path / files[-1])).exit_code == 0
    subprocess.run([sys.executable, "accuracy.py", *files], cwd=tmp_path, check=True)
    assert (tmp_path / "accuracy.png").read_bytes().startswith(b"\x89PNG")
