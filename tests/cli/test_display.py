"""What the terminal says of limits, and the exit code beside it."""

import io
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from report_run import build_run
from typer.testing import CliRunner

from gaitval._internal.io.artefacts import read_json, write_json, write_text
from gaitval.cli import app
from gaitval.cli.terminal import display
from gaitval.metrics.results import read_metrics
from gaitval.reporting.recording_report import GateRow
from gaitval.subjects.subject_file import load_subject

Change = Callable[[list[dict[str, Any]]], None]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    build_run(folder)
    return folder


@pytest.fixture
def message(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    text = io.StringIO()
    for name in ("output", "messages"):
        monkeypatch.setattr(display, name, display.Terminal(file=text, width=240))
    return text


@pytest.mark.parametrize("kept", [False, True])
def test_the_verdict_of_a_walk_and_its_exit_code(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, message: io.StringIO, kept: bool
) -> None:
    stored = read_json(run / "metrics.json")
    rows = stored["tolerances"]
    for row in rows:
        row["passed"] |= kept
    refused = [row for row in rows if row["role"] == "acceptance" and not row["passed"]]
    stored["summary"] |= {"refused": len(refused)}
    write_json(tmp_path / "metrics.json", stored)
    monkeypatch.setattr("gaitval.study.one_stage.run_one", lambda *_, **__: None)
    done = CliRunner().invoke(app, ["stage", "validate", "S05", "--out", str(tmp_path), "--all"])
    assert done.exit_code == (0 if kept else 1)
    lines = (done.output + message.getvalue()).splitlines()
    table = [
        [cell.strip() for cell in line.split("│")[1:-1]] for line in lines if line.startswith("│")
    ]
    expected = [
        "pass" if row["passed"] else "not shown" if row["state"] == "not shown" else "fail"
        for row in rows
    ]
    assert [cells[-1] for cells in table if cells[-1]] == expected
    message.truncate(0)
    display.print_verdict(read_metrics(tmp_path))
    shown = [
        line
        for line in message.getvalue().splitlines()
        if ", limit " in line and " narrow" not in line
    ]
    assert shown
    assert all((", passed" in line) is kept and (" failed. " in line) is not kept for line in shown)
    sentence = re.search(
        r"(?:All )?\d.* acceptance limits (\w+);.* context limits (\w+)", message.getvalue()
    )
    assert sentence
    assert set(sentence.groups()) == {"passed" if kept else "failed"}
    assert ("All " in sentence[0]) is kept


@pytest.mark.parametrize("lacking", ["moments", "forces", "angles", "one side", None])
@pytest.mark.parametrize("command", [("stage", "validate", "S05", "--out"), ("report",)])
def test_a_verdict_without_what_decides_is_none(
    run: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    lacking: str | None,
    command: tuple[str, ...],
) -> None:
    """All limits kept, but of a walk whose moments nobody recorded: not judged, no pass."""
    stored = read_json(run / "metrics.json")
    for row in stored["tolerances"]:
        row["passed"] = True
    stored["summary"] |= {"refused": 0}
    origins = {
        quantity: {"right": "recorded", "left": "recorded"}
        for quantity in ("angles", "timing", "moments", "forces", "stance")
    }
    if lacking == "one side":
        origins["moments"]["left"] = "expected"
    elif lacking is not None:
        origins[lacking] = {"right": "predicted", "left": "expected"}
    stored["record"]["origins"] = origins
    write_json(tmp_path / "metrics.json", stored)
    write_text(tmp_path / "subject.toml", load_subject("5").to_toml())
    write_text(tmp_path / "configuration.toml", "[report]\npdf = false\nfigures = false\n")
    monkeypatch.setattr("gaitval.study.one_stage.run_one", lambda *_, **__: None)
    done = CliRunner().invoke(app, [*command, str(tmp_path)])
    whole = lacking in (None, "one side")
    assert done.exit_code == (0 if whole else 1)
    if not whole:
        assert f"not recorded: {lacking} (predicted)" in " ".join(done.output.split())


@pytest.mark.parametrize(
    ("forces", "only", "code"), [(False, False, 1), (True, False, 0), (False, True, 0)]
)
def test_an_import_whose_forces_gave_no_moments_is_not_judged(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, forces: bool, only: bool, code: int
) -> None:
    found = SimpleNamespace(
        forces={"right": object()} if forces else {},
        request=SimpleNamespace(kinematics_only=only, aid=None),
    )
    made = SimpleNamespace(found=found)
    monkeypatch.setattr("gaitval.session.importing.importing.import_files", lambda *_, **__: made)
    monkeypatch.setattr("gaitval.cli.recording.say_what_was_made", lambda *_: None)
    words = "--static a.trc --trial b.trc --mass 70 --height 1.7 --sex F --out"
    done = CliRunner().invoke(app, ["import", *words.split(), str(tmp_path / "o")])
    assert done.exit_code == code, done.output
    assert ("Not judged: moments" in " ".join(done.output.split())) is (code == 1)


def test_the_verdict_of_an_import(monkeypatch: pytest.MonkeyPatch, message: io.StringIO) -> None:
    rows = [
        GateRow("kept one", 1.0, 2.0, "cm", True, ""),
        GateRow("kept two", 1.0, 2.0, "cm", True, ""),
        GateRow("broken", 3.0, 2.0, "cm", False, "", remedy="look there"),
        *[GateRow(f"open {n}", 3.0, 2.0, "N", False, "", applies=False) for n in range(3)],
    ]
    monkeypatch.setattr("gaitval.session.importing.summary.limit_rows", lambda found: rows)
    found: Any = SimpleNamespace(
        weight_ratio=None,
        request=SimpleNamespace(identifier="S", kinematics_only=True, aid=None),
        trials=(),
    )
    display.print_import_verdict(found)
    assert "Limits: 2 passed, 1 FAILED, 3 not judged" in message.getvalue()
    failed = [line for line in message.getvalue().splitlines() if line.startswith("FAILED")]
    assert failed == ["FAILED: broken: 3 cm, limit 2 cm: look there."]
    message.truncate(0)
    display.print_import(found)
    lines = message.getvalue().splitlines()
    for row in rows:
        (line,) = [each for each in lines if row.name in each]
        assert row.state in line
