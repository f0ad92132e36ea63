"""The command line: help that teaches, errors without a traceback, exit codes, progress."""

import ast
import errno
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from gaitval import __version__, cli
from gaitval._internal.io.artefacts import read_json, write_json, write_text
from gaitval.apps.regression import regression
from gaitval.cli import study
from gaitval.cli.study import STAGE_NAMES
from gaitval.cli.terminal import display
from gaitval.errors import ArtefactError
from gaitval.study.inputs import STORED_FILES
from gaitval.study.stage import BESIDE, RECORDS
from gaitval.subjects.subject_file import load_subject

HEAVY = {
    *("torch", "dartpy", "numba", "numpy", "pandas", "matplotlib", "scipy", "ezc3d", "cma"),
    *("gymnasium", "stable_baselines3", "jsonschema", "pydantic", "jinja2", "weasyprint"),
}
"""Libraries that take longer to load than the help to read."""


@pytest.fixture(autouse=True)
def plain_messages(monkeypatch: pytest.MonkeyPatch) -> Iterator[io.StringIO]:
    """Messages as text without colours, in one place."""
    text = io.StringIO()
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setattr(display, "messages", display.Terminal(file=text, width=200))
    # Where GITHUB_ACTIONS is set, typer colours its help for a terminal, though there is none.
    monkeypatch.setattr("typer.rich_utils.FORCE_TERMINAL", None)
    return text  # type: ignore[return-value]


def gaitval(*arguments: str) -> Any:
    return CliRunner().invoke(cli.app, arguments)


def test_a_name_from_a_file_is_no_command_to_the_terminal(
    tmp_path: Path, plain_messages: io.StringIO
) -> None:
    """An OSC code would set the window's title; a carriage return would write over the line."""
    path = tmp_path / "subject.toml"
    path.write_text('"\\u001b]0;title\\u0007\\r\\u202ekey" = 1\n', encoding="utf-8")
    assert gaitval("stage", "scale", str(path), "-o", str(tmp_path / "run")).exit_code == 2
    assert "title" in plain_messages.getvalue()
    assert not set("\x1b\x07\r\u202e") & set(plain_messages.getvalue())


def test_a_folder_may_be_called_as_markup_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = io.StringIO()
    monkeypatch.setattr(display, "output", display.Terminal(file=text, width=400))
    folder = tmp_path / "[/red] [bold]a :smile:"
    assert gaitval("stage", "scale", "5", "-o", str(folder)).exit_code == 0
    assert f"Body model in {folder / 'model.urdf'}" in text.getvalue()


def test_data_lists_what_can_be_fetched_and_what_is_here(tmp_path: Path) -> None:
    for command in ("list", "fetch"):
        assert f"gaitval data {command}" in gaitval("data", command, "--help").output
    result = gaitval("data", "list", "--folder", str(tmp_path))
    assert result.exit_code == 0
    assert "10.6084/m9.figshare.5722711" in result.output
    assert "missing: WBDSascii.zip, WBDSc3d.zip" in result.output


def test_an_unknown_data_set_is_refused(tmp_path: Path, plain_messages: io.StringIO) -> None:
    result = gaitval("data", "fetch", "wbsd", "--folder", str(tmp_path))
    assert result.exit_code == 2
    assert "no such data set. Available are: wbds" in plain_messages.getvalue()
    assert not list(tmp_path.iterdir())


def test_version() -> None:
    assert gaitval("--version").output == f"gaitval {__version__}\n"


def test_help_does_not_wait_for_heavy_libraries() -> None:
    code = """
import sys
from gaitval.cli import main
sys.argv = ["gaitval", "--help"]
try:
    main()
except SystemExit as end:
    assert not end.code
print(sorted(name for name in sys.modules if "." not in name))
"""
    output = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True
    ).stdout
    assert "Start with" in output
    loaded = set(ast.literal_eval(output.splitlines()[-1]))
    assert {"typer", "rich"} <= loaded
    assert not loaded & HEAVY


def test_subjects_lists_the_ten() -> None:
    output = gaitval("subjects").output
    assert all(f"S{number:02d}" in output for number in range(1, 11))
    assert "WBDS14 T05" in output
    assert "64.95" in output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["5"], "give one of --speed"),
        (["5", "--speed", "1", "--holdout", "T03"], "give one of --speed"),
        (["5", "--speed", "-1"], "--speed -1: not a walking speed"),
        (["5", "--speed", "nan"], "--speed nan: not a walking speed"),
        (["5", "--speed", "2.4"], "86 % from the nearest speed that was walked"),
        (["5", "--holdout", " "], "--holdout: empty"),
        (["5", "--holdout", "T09"], "no trial 'T09'. It has T05, T03, T06"),
        (["2", "--holdout", "T06"], "T06 is the only trial"),
        (["5", "--slope", "25"], "14.0 degrees, and how people's angles change"),
        (["5", "--slope", "10", "--set", "contact.dynamic_to_static=0.6"], "it is 0.48"),
        (["5", "--load", "60"], "is given in % of body mass"),
        (["5", "--load", "-5"], "--load -5"),
        (["5", "--slope", "5", "--holdout", "T03"], "T03 with --slope"),
        (["5", "--slope", "5", "--speed", "2.4"], "86 % from the nearest speed"),
        (["5", "--holdout", "none.toml"], "none.toml: no such file"),
        (["5", "--holdout", "T03", "--use", "some"], "'all' or 'kinematics', but it is 'some'"),
    ],
)
def test_what_cannot_be_predicted_is_refused(
    tmp_path: Path, plain_messages: io.StringIO, arguments: list[str], message: str
) -> None:
    done = CliRunner().invoke(cli.app, ["predict", *arguments, "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert message in plain_messages.getvalue().replace("\n", " ")
    assert not (tmp_path / "out").exists()


def test_a_trial_of_another_person_or_one_that_is_told_cannot_be_held_out(
    tmp_path: Path, plain_messages: io.StringIO
) -> None:
    for identifier, message in (
        ("S01", "a trial of another person than S05"),
        ("S05", "A trial cannot be both used and held out"),
    ):
        other = tmp_path / f"{identifier}.toml"
        write_text(other, load_subject(identifier).to_toml())
        done = CliRunner().invoke(cli.app, ["predict", "5", "--holdout", str(other)])
        assert done.exit_code == 2
        assert message in plain_messages.getvalue().replace("\n", " ")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "give one of --out"),
        (["--out", "m.toml"], "a new subject needs --mass, --height, --leg-length, --sex too"),
        (["--out", "m.toml", "--angle-unit", "grad"], "needs --mass"),
    ],
)
def test_curves_say_what_is_missing(
    tmp_path: Path, plain_messages: io.StringIO, options: list[str], message: str
) -> None:
    table = tmp_path / "curves.csv"
    table.write_text("angle_knee_angle_r\n1\n")
    messages = ["curves", str(table), "--speed", "1", "--stride-time", "1", *options]
    done = CliRunner().invoke(cli.app, messages)
    assert done.exit_code == 2
    assert message in plain_messages.getvalue().replace("\n", " ")


@pytest.mark.parametrize("name", STAGE_NAMES[1:])
def test_a_stage_without_the_earlier_ones_says_what_to_run(
    name: str, tmp_path: Path, plain_messages: io.StringIO
) -> None:
    folder = tmp_path / "run"
    result = gaitval("stage", name, "5", "--out", str(folder))
    assert result.exit_code == 2
    assert f"`gaitval stage scale S05 --out {folder}`" in plain_messages.getvalue()


@pytest.mark.parametrize(
    ("name", "option", "of"),
    [
        ("scale", ("--round", "2"), "train and identify"),
        ("identify", ("--scratch",), "train"),
        ("push", ("--all",), "validate"),
    ],
)
def test_an_option_of_another_stage_is_refused(
    name: str, option: tuple[str, ...], of: str, tmp_path: Path, plain_messages: io.StringIO
) -> None:
    result = gaitval("stage", name, "5", "--out", str(tmp_path / "run"), *option)
    assert result.exit_code == 2
    assert f"{option[0]} is for {of}, and changes nothing about {name}" in plain_messages.getvalue()
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("run", "message"),
    [
        ("nowhere", "nowhere: no such folder, and no subject. Give a run folder, such as"),
        (".", ".: no walk is in this folder, so there is nothing to report. Run `gaitval subject`"),
        ("5", "reports/S05: no walk is in this folder, so there is nothing to report"),
    ],
)
def test_a_report_of_what_is_no_run_is_refused(
    run: str,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    plain_messages: io.StringIO,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert gaitval("report", run).exit_code == 2
    assert message in plain_messages.getvalue()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("run", ["reports/S05", "5", "S05"])
def test_a_report_is_of_the_folder_or_of_the_run_of_a_subject(
    run: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    subject = load_subject("5").to_toml()
    write_text(tmp_path / "reports" / "S05" / "subject.toml", subject)
    write_text(tmp_path / "reports" / "S05" / RECORDS, "{}")
    asked: list[tuple[Any, ...]] = []
    monkeypatch.setattr(
        "gaitval.study.one_stage.run_one",
        lambda run, name, **options: asked.append((str(run.folder), name, options)),
    )
    monkeypatch.setattr(study, "_judged", lambda *_: None)
    monkeypatch.setattr("gaitval.metrics.results.read_metrics", lambda folder: None)
    assert gaitval("report", run, "--force").exit_code == 0
    assert asked == [("reports/S05", "report", {"force": True})]


def test_wrong_usage_has_exit_code_2() -> None:
    assert gaitval("stage", "scale").exit_code == 2
    assert gaitval("walk", "5").exit_code == 2
    assert gaitval("stage", "train", "5", "--round", "0").exit_code == 2
    assert gaitval("check").exit_code == 2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("predict", "5", "--speed", "1,3"), "'1,3' is no number. Write digits, with a point"),
        (("import", "--mass", "70kg"), "'70kg' is no number. Write digits, with a point"),
        (("stage", "train", "5", "--round", "one"), "'one' is no whole number. Write digits"),
    ],
)
def test_what_is_no_number_is_shown(words: tuple[str, ...], message: str) -> None:
    result = gaitval(*words)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.replace("│", "").split())


@pytest.mark.parametrize(
    ("words", "remedy"),
    [
        (("--trial", "a.c3d", "b.c3d"), "write --trial a.c3d --trial b.c3d"),  # --trial *.c3d
        (("a.c3d", "--mass", "70"), "write --trial a.c3d, else --static or --forces"),
        (("--trial=", "--mass", "70"), "--trial is empty"),
    ],
)
def test_a_file_without_an_option_is_told_which(
    words: tuple[str, ...], remedy: str, plain_messages: io.StringIO
) -> None:
    result = gaitval("import", *words, "--out", "out")
    assert result.exit_code == 2
    said = result.stderr.replace("│", "") + plain_messages.getvalue()
    assert remedy in " ".join(said.split())


def test_what_is_said_of_insoles_that_are_not_given_is_refused(plain_messages: io.StringIO) -> None:
    assert gaitval("estimate", "nowhere", "--insole-error", "8").exit_code == 2
    assert "with --insoles" in " ".join(plain_messages.getvalue().split())


@pytest.mark.parametrize("words", [("--out", ""), ("--out=",), ("-o", "")])
def test_an_empty_folder_is_not_the_current_one(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = gaitval("stage", "scale", "5", *words)
    assert result.exit_code == 2
    assert "is empty" in result.stderr
    assert not list(tmp_path.iterdir())


def test_ctrl_c_says_that_the_same_command_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, plain_messages: io.StringIO
) -> None:
    def stop(*arguments: Any, **options: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("gaitval.study.run.run_subject", stop)
    result = gaitval("subject", "5", "--out", str(tmp_path / "run"))
    assert result.exit_code == 130
    assert "interrupted; the same command resumes" in plain_messages.getvalue()


def test_a_fault_of_ours_shows_no_traceback(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    plain_messages: io.StringIO,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*arguments: Any, **options: Any) -> None:
        raise ZeroDivisionError("in the middle")

    monkeypatch.setattr("gaitval.study.run.run_subject", fail)
    monkeypatch.setattr(sys, "argv", ["gaitval", "subject", "5", "--out", str(tmp_path / "run")])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 70
    assert "ZeroDivisionError: in the middle" in plain_messages.getvalue()
    assert "This is a fault of gaitval" in plain_messages.getvalue()
    captured = capsys.readouterr()
    assert "Traceback" not in captured.out + captured.err


@pytest.mark.parametrize(
    ("number", "message"),
    [
        (errno.ENOSPC, "cannot be written: there is no space left"),
        (errno.EIO, "cannot be read or written: its disk or network share reports an error"),
        (errno.ESTALE, "cannot be read or written: its disk or network share reports an error"),
    ],
)
def test_a_full_or_broken_disk_is_no_fault_of_ours(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    plain_messages: io.StringIO,
    number: int,
    message: str,
) -> None:
    """Where a library writes its own files, and says only what the system said."""

    def fail(*arguments: Any, **options: Any) -> None:
        raise OSError(number, os.strerror(number), str(tmp_path / "events"))

    monkeypatch.setattr("gaitval.study.run.run_subject", fail)
    result = gaitval("subject", "5", "--out", str(tmp_path / "run"))
    assert result.exit_code == 2
    assert f"{tmp_path / 'events'}: {message}" in plain_messages.getvalue()


def test_a_stage_alone_keeps_the_settings_of_its_run_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seeds = []
    monkeypatch.setattr(
        "gaitval.study.run.run_subject", lambda run, **options: seeds.append(run.configuration.seed)
    )
    monkeypatch.setattr(
        "gaitval.study.one_stage.run_one",
        lambda run, name, **options: seeds.append(run.configuration.seed),
    )
    monkeypatch.setattr(display, "print_verdict", lambda metrics: None)
    folder = tmp_path / "run"
    out = ("--out", str(folder))
    gaitval("stage", "train", "5", *out, "--set", "seed=3")
    gaitval("stage", "identify", "5", *out)
    gaitval("stage", "identify", "5", *out, "--set", "seed=4")
    write_json(folder / "metrics.json", {})
    gaitval("subject", "5", *out)
    assert seeds == [3, 3, 4, 0]


# --- check -------------------------------------------------------------------------------


def row(change: regression.MeasureOutcome, current: float | None) -> regression.Row:
    return regression.Row("angle_rmse", "knee_angle_r", "deg", 4.0, current, 0.5, change)


WALKED = SimpleNamespace(subject=SimpleNamespace(identifier="S05"))


@pytest.fixture
def stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(
        "gaitval.apps.regression.baseline.stored_metrics", lambda file: read_json(file)
    )
    monkeypatch.setattr("gaitval.apps.regression.baseline.changed_inputs", lambda *_: [])
    for name in STORED_FILES:
        write_json(tmp_path / "baseline" / name, {})
    return tmp_path / "baseline" / "metrics.json"


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("folder", [False, True])
def test_check_passes_where_nothing_was_lost(
    stored: Path, monkeypatch: pytest.MonkeyPatch, quick: bool, folder: bool
) -> None:
    """A quick check does not ask for what a short walk does not show. The folder will do."""

    def compare(*_: object, leave_out: tuple[str, ...]) -> list[regression.Row]:
        assert leave_out == (regression.LONG_MEASURES if quick else ())
        return [row("kept", 4.1)]

    monkeypatch.setattr(
        "gaitval.apps.regression.baseline.walk_again",
        lambda *_, **options: asserted(options, quick=quick),
    )
    monkeypatch.setattr(regression, "compare", compare)
    given = stored.parent if folder else stored
    result = gaitval("check", "--baseline", str(given), *(["--quick"] if quick else []))
    assert result.exit_code == 0
    assert "1 of 1 measures within their margins" in result.output.replace("\n", " ")


def asserted(options: dict[str, object], **expected: object) -> SimpleNamespace:
    assert options == expected
    return WALKED


def test_check_has_a_verdict_on_the_inputs_and_one_on_the_figures(
    stored: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """What was changed is reported, and fails nothing: the figures say whether it matters."""
    changed = ["numpy 2.1.0, now 2.2.0", "the code in gaitval/policy"]
    monkeypatch.setattr("gaitval.apps.regression.baseline.walk_again", lambda *_, **__: WALKED)
    monkeypatch.setattr("gaitval.apps.regression.baseline.changed_inputs", lambda *_: changed)
    monkeypatch.setattr(regression, "compare", lambda *_, **__: [row("kept", 4.1)])
    junit = tmp_path / "accuracy.xml"
    result = gaitval("check", "--baseline", str(stored), "--junit", str(junit))
    assert result.exit_code == 0
    output = " ".join(result.output.split())
    assert "Inputs: changed: numpy 2.1.0, now 2.2.0; the code in gaitval/policy" in output
    assert "Figures: 1 of 1 measures within their margins" in output
    assert output.index("Figures:") < output.index("Inputs:")
    assert "numpy 2.1.0, now 2.2.0" in junit.read_text()


def test_check_fails_with_a_table_and_junit_where_accuracy_was_lost(
    stored: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, plain_messages: io.StringIO
) -> None:
    monkeypatch.setattr("gaitval.apps.regression.baseline.walk_again", lambda *_, **__: WALKED)
    rows = [row("kept", 4.1), row("lost", 5.25), row("lost", None)]
    monkeypatch.setattr(regression, "compare", lambda *_, **__: rows)
    junit = tmp_path / "accuracy.xml"
    result = gaitval("check", "--baseline", str(stored), "--junit", str(junit))
    assert result.exit_code == 1
    assert "5.25" in result.output
    assert "4.1" not in result.output
    assert "2 of 3 measures are worse" in plain_messages.getvalue()
    assert junit.read_text().count("<failure") == 2


REPORTS = Path(__file__).parents[2] / "reports"


def _compared(monkeypatch: pytest.MonkeyPatch, worse: float, tmp_path: Path) -> tuple[str, ...]:
    """Arguments of `compare` with a run whose epsilon is worse than the stored one; without the
    page, which has tests of its own."""
    monkeypatch.setattr(
        "gaitval.apps.regression.comparison_page.write_comparison", lambda *_, **__: None
    )
    stored = REPORTS / "S05" / "baseline"
    metrics = read_json(stored / "metrics.json")
    for each in metrics["measures"]:
        each["value"] += worse * (each["measure"] == "epsilon")
    write_json(tmp_path / "run" / "metrics.json", metrics)
    return "compare", str(tmp_path / "run"), "--before", str(stored)


@pytest.mark.parametrize(
    ("worse", "options", "code"),
    [(0.5, (), 0), (0.5, ("--strict",), 1), (0.005, ("--strict",), 0), (-0.5, ("--strict",), 0)],
)
def test_a_comparison_fails_only_if_it_is_strict_and_something_got_worse(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, plain_messages: io.StringIO,
    worse: float, options: tuple[str, ...], code: int,
) -> None:  # fmt: skip
    result = gaitval(*_compared(monkeypatch, worse, tmp_path), *options)
    assert result.exit_code == code
    message = result.output + plain_messages.getvalue()
    assert re.search(rf"{int(worse > 0.01)} of \d+ measures got worse", message)


def test_a_strict_comparison_misses_a_subject_and_needs_an_earlier_version(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, plain_messages: io.StringIO
) -> None:
    arguments = (*_compared(monkeypatch, 0.0, tmp_path), "--before", str(REPORTS / "S02"))
    assert gaitval(*arguments).exit_code == 0
    assert gaitval(*arguments, "--strict").exit_code == 1
    assert "no walk now of S02" in plain_messages.getvalue()
    assert gaitval("compare", str(tmp_path / "run"), "--strict").exit_code == 2
    assert gaitval("compare", str(tmp_path / "none")).exit_code == 2


def test_check_refuses_an_incomplete_baseline(stored: Path, plain_messages: io.StringIO) -> None:
    (stored.parent / "identification.json").unlink()
    assert gaitval("check", "--baseline", str(stored)).exit_code == 2
    assert "identification.json missing" in plain_messages.getvalue()


def test_who_closes_a_pipe_ends_neither_the_work_nor_the_verdict() -> None:
    """`gaitval check … | head -1` ended with 1, which says that accuracy was lost."""
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as file:
        terminal = display.Terminal(file=file)
        terminal.print("read by nobody")  # `Console` raises SystemExit(1)
        terminal.print("and this neither")


# --- progress ----------------------------------------------------------------------------


def observed(*, terminal: bool) -> tuple[Any, io.StringIO]:
    text = io.StringIO()
    return display.Live(display.Terminal(file=text, force_terminal=terminal, width=160)), text


def test_a_stage_that_does_not_say_how_far_it_is_shows_its_time() -> None:
    live, text = observed(terminal=True)
    live.started("reference", "not run yet")
    live.close()
    assert "reference: starts (not run yet)" in text.getvalue()
    assert "0:00:00" in text.getvalue()
    quiet, lines = observed(terminal=False)
    quiet.started("reference", "not run yet")
    assert lines.getvalue() == "reference: starts (not run yet)\n"


@pytest.mark.parametrize(
    ("stage", "reason", "said"),
    [
        ("need-1", "not run yet", "need-1 (whether the person needs training): starts (not run"),
        ("identify-1", BESIDE, "identify-1: continues (started beside another)"),
    ],
)
def test_a_stage_says_how_it_begins(stage: str, reason: str, said: str) -> None:
    live, text = observed(terminal=False)
    live.started(stage, reason)
    assert text.getvalue().startswith(said)


def test_progress_on_a_terminal_is_a_bar_with_what_matters() -> None:
    live, text = observed(terminal=True)
    live.started("train-1", "not run yet")
    live.progress({"samples": 0, "total": 3_000_000, "reward": 0.1, "cycles": 0.4})
    live.progress({"samples": 1_500_000, "total": 3_000_000, "reward": 7.25, "cycles": 2.5})
    live.finished("train-1", 61.0)
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text.getvalue())
    assert "1,500,000 of 3,000,000 samples" in shown
    assert "reward 7.25" in shown
    assert "cycles walked 2.5" in shown
    assert "train-1: done in 1 min 01 s" in shown


def test_progress_elsewhere_is_a_line_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(display, "monotonic", lambda: now[0])
    live, text = observed(terminal=False)
    live.started("train-1", "was interrupted")
    for second in range(0, 100, 5):
        now[0] = float(second)
        live.progress({"samples": 1000 * second, "total": 200_000, "reward": 1.0})
    lines = text.getvalue().splitlines()
    assert lines[0] == "train-1: resumes (was interrupted)"
    assert len(lines) == 4
    assert lines[1] == "train-1: 30,000 of 200,000 samples  reward 1"


def test_output_that_is_not_a_terminal_has_no_control_characters(tmp_path: Path) -> None:
    ended = subprocess.run(
        [sys.executable, "-P", "-m", "gaitval", "--version"], capture_output=True, check=False
    )
    assert b"\x1b" not in ended.stdout + ended.stderr


def test_push_table_names_phases_and_directions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(display, "output", display.Terminal(width=200))
    with display.output.capture() as captured:
        display.print_pushes(
            SimpleNamespace(
                phases=[0.0, 0.25], directions=[0.0, -90.0], largest=[[625, 200], [50, 475]]
            )
        )
    rows = [line.split("│") for line in captured.get().splitlines() if "│" in line]
    assert [[cell.strip() for cell in row[1:-1]] for row in rows] == [
        ["0", "625", "200"],
        ["0.25", "50", "475"],
    ]


def test_error_types_have_the_documented_exit_codes() -> None:
    from gaitval import errors

    for error in vars(errors).values():
        if isinstance(error, type) and issubclass(error, errors.GaitvalError):
            # of a trial without a cycle, what there is was written
            known = {errors.ToleranceError: 1, errors.TrialOnlyError: 0}
            assert error.exit_code == known.get(error, 2)
    assert ArtefactError.exit_code == 2
