"""Help that is true: its order, its flags, and every example in it."""

import io
import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from rich.emoji import Emoji
from typer.main import get_command
from typer.testing import CliRunner

from gaitval import cli
from gaitval.apps.regression.stored_baselines import find_baseline
from gaitval.cli.commands import TABLE
from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import PANELS
from gaitval.configuration import load_configuration
from gaitval.subjects.sample import SAMPLE
from gaitval.subjects.subject_file import load_subject

ROOT: Any = get_command(cli.app)


def _commands() -> dict[str, Any]:
    """Every command by its words, those of `data` too."""
    found: dict[str, Any] = {}
    for name, command in ROOT.commands.items():
        inner = getattr(command, "commands", None)
        found |= {f"{name} {word}": each for word, each in inner.items()} if inner else {}
        if inner is None:
            found[name] = command
    return found


COMMANDS = _commands()
EXAMPLES = [
    (name, line.partition(" # ")[0].strip())
    for name, command in COMMANDS.items()
    for line in command.help.partition("Examples:\n")[2].splitlines()
    if line.strip().startswith("gaitval ")
]


@pytest.fixture(autouse=True)
def messages(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    text = io.StringIO()
    monkeypatch.setattr(display, "messages", display.Terminal(file=text, width=200))
    monkeypatch.setattr("typer.rich_utils.FORCE_TERMINAL", None)
    return text


def test_every_command_has_an_example() -> None:
    assert {name for name, _ in EXAMPLES} == set(COMMANDS)
    assert len(EXAMPLES) > 45


@pytest.mark.parametrize("name", COMMANDS)
def test_no_word_between_colons_is_shown_as_an_emoji(name: str) -> None:
    """`50:100:150` is: rich reads `:100:` as a name."""
    command = COMMANDS[name]
    for text in (command.help, *(getattr(each, "help", None) for each in command.params)):
        assert text is None or Emoji.replace(text) == text


@pytest.mark.parametrize(("name", "line"), EXAMPLES, ids=[line for _, line in EXAMPLES])
def test_every_example_is_understood(name: str, line: str) -> None:
    """Its options exist and take these values; its settings, subjects and baselines are there."""
    words = shlex.split(line)[1:]
    used = next(known for known in COMMANDS if words[: len(known.split())] == known.split())
    with COMMANDS[used].make_context(used, words[len(used.split()) :]) as context:
        values = context.params
    config = values.get("config")
    load_configuration(config, settings=values.get("settings") or ())
    subject = values.get("subject")
    if isinstance(subject, str) and not subject.endswith(".toml"):
        load_subject(subject)
    made_before = ("reports/pat", "reports/S05-hip_exo")  # of a patient, and of a device
    if (baseline := values.get("baseline")) is not None and not baseline.startswith(made_before):
        find_baseline(baseline)
    assert values.get("by", "markers") in ("markers", "stature")


@pytest.mark.parametrize(
    "line",
    ["gaitval subjects", "gaitval data list", "gaitval data sample", "gaitval curves --template"],
)
def test_the_cheap_ones_run(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert line in [example for _, example in EXAMPLES]
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli.app, shlex.split(line)[1:])
    assert done.exit_code == 0, done.output
    if "sample" in line:
        assert {path.name for path in Path("sample").iterdir()} == set(SAMPLE)
        assert "Import it: gaitval import --static sample/standing.c3d" in done.output
        (shown,) = re.findall(r"Import it: gaitval import (.+)", done.output)
        with COMMANDS["import"].make_context("import", shlex.split(shown)) as context:
            assert all(path.is_file() for path in context.params["trials"])
        (shown,) = re.findall(r"gaitval patients (.+)", done.output)
        with COMMANDS["patients"].make_context("patients", shlex.split(shown)) as context:
            given = context.params["strides"], *context.params["people"]
            assert all(path.is_file() for path in given)


def test_the_template_makes_a_subject(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the very line that is printed; a second template does not overwrite it."""
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(cli.app, ["curves", "--template", "own.csv"])
    (line,) = re.findall(r"then: gaitval (curves .+)", done.output)
    made = CliRunner().invoke(cli.app, shlex.split(line))
    assert made.exit_code == 0, made.output
    assert "Read own.csv: right and left" in made.output
    assert load_subject("mine.toml").sex == load_subject("S05").sex
    assert CliRunner().invoke(cli.app, ["curves", "--template", "own.csv"]).exit_code == 2
    assert CliRunner().invoke(cli.app, ["curves", "--template", "own.xlsx"]).exit_code == 2


def test_main_jobs_come_first() -> None:
    assert list(ROOT.commands)[:8] == [
        *("subject", "import", "predict", "report", "change", "check", "compare", "device")
    ]
    core = {name for names in PANELS.values() for name in names}
    assert set(ROOT.commands) == core | set(TABLE)
    shown = CliRunner().invoke(cli.app, ["--help"]).output
    places = [shown.index(panel) for panel in PANELS]
    assert places == sorted(places)


@pytest.mark.parametrize("words", [[], ["data"], *[name.split() for name in COMMANDS]])
def test_flags_look_like_flags(words: list[str]) -> None:
    assert "<bool>" not in CliRunner().invoke(cli.app, [*words, "--help"]).output


@pytest.mark.parametrize(
    "words",
    [
        ["stage", "scale", "5", "--out", "/proc/x"],
        ["compare", "reports/S05", "--out", "/proc/x"],
        ["curves", "--template", "/proc/x/means.csv"],
        ["data", "sample", "/proc/x"],
    ],
    ids=lambda words: words[0],
)
def test_a_folder_that_cannot_be_made_is_refused(
    words: list[str], messages: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(__file__).parents[2])
    assert CliRunner().invoke(cli.app, words).exit_code == 2
    assert "/proc/x: cannot be made (" in messages.getvalue()


@pytest.mark.parametrize("person", [[], ["--mass", "70", "--height", "1.7"]], ids=len)
def test_an_import_of_missing_files_names_all_and_leaves_nothing(
    person: list[str], tmp_path: Path, messages: io.StringIO
) -> None:
    """Also where it would have read mass and stature from them."""
    out = tmp_path / "mine"
    words = ["--static", "stand.c3d", "--trial", "walk.c3d", *person]
    done = CliRunner().invoke(cli.app, ["import", *words, "--sex", "M", "--out", str(out)])
    assert done.exit_code == 2
    assert "stand.c3d, walk.c3d: no such files. Check the paths." in messages.getvalue()
    assert not out.exists()
