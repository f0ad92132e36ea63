"""The library does without the libraries of the extras, and says which extra has one."""

import os
import re
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
from quick_settings import QUICK, WITH_WORDS
from typer.main import get_command

from gaitval import plugins
from gaitval.cli.commands import TABLE
from gaitval.cli.terminal.app import app
from gaitval.errors import ConfigurationError

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]


def libraries(extra: str) -> set[str]:
    """First names of what an extra installs, with the extras that it asks for."""
    found: set[str] = set()
    for line in EXTRAS[extra]:
        if other := re.fullmatch(r"gaitval\[([\w,]+)\]", line):
            found = found.union(*map(libraries, other[1].split(",")))
        else:
            found.add(re.split(r"[<>=]", line)[0].replace("-", "_"))
    return found


HIDDEN = libraries("all")
"""What `pip install gaitval` does not install."""
WITHOUT = """
import sys
from importlib.machinery import PathFinder

class Without(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        if name.partition(".")[0] in HIDDEN:
            return None
        return super().find_spec(name, path, target)

sys.meta_path[sys.meta_path.index(PathFinder)] = Without
"""
RUN = """
from gaitval.cli import main
main()
"""


def test_what_is_registered_for_pytest_is_there() -> None:
    assert import_module(PROJECT["entry-points"]["pytest11"]["gaitval"])
    assert set(PROJECT["entry-points"]) == {"pytest11"}  # the rest is for other distributions


def test_a_command_that_nobody_registers_is_named() -> None:
    with pytest.raises(ConfigurationError, match="nothing"):
        plugins.load(plugins.COMMANDS, "nothing")


@pytest.mark.slow
def test_another_distribution_adds_a_command_and_a_reader(tmp_path: Path) -> None:
    """Installed beside gaitval, in a folder of its own; one that cannot be loaded says whose it
    is."""
    about = tmp_path / "other-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 1\n")
    (about / "entry_points.txt").write_text(
        "[gaitval.commands]\nhello = other:hello\n[gaitval.recordings]\nxyz = other:read\n"
        "abc = other:nothing\n"
    )
    (tmp_path / "other.py").write_text(
        "from gaitval.errors import RecordError\n"
        "from gaitval.cli.terminal.app import added_command\n"
        "@added_command('gaitval hello', after='report')\n"
        "def hello() -> None:\n    'Say hello.'\n    print('hello of another')\n"
        "def read(path):\n    raise RecordError(f'{path}: read by another')\n"
    )
    for name in ("a.xyz", "a.abc"):
        (tmp_path / name).touch()

    def gaitval(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-P", "-m", "gaitval", *arguments],
            cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(tmp_path)},
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    message = gaitval("hello")
    assert (message.returncode, message.stdout) == (0, "hello of another\n"), message.stderr
    assert "hello" in gaitval("--help").stdout
    read = gaitval("markers", "a.xyz")
    assert read.returncode == 2
    assert "read by another" in read.stderr
    failed = gaitval("markers", "a.abc")
    assert failed.returncode == 2
    assert "pip uninstall other" in failed.stderr.replace("\n", " ")


def test_a_command_whose_libraries_are_missing_breaks_no_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "gaitval.cli.judge", None)
    root = get_command(app)
    assert {"subject", "compare"} <= set(root.commands)


def without(
    folder: Path, *arguments: str, extra: str | None = None
) -> subprocess.CompletedProcess[str]:
    """Run the command as on a machine with the libraries of the core and of one extra."""
    hidden = HIDDEN - (libraries(extra) if extra else set())
    return subprocess.run(
        [sys.executable, "-c", f"HIDDEN = {hidden!r}\n{WITHOUT}{RUN}", *arguments],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip


HELP = """
from typer.testing import CliRunner
from gaitval.cli import app
for name in sys.argv[1:]:
    done = CliRunner().invoke(app, [name, "--help"])
    print(f"{name}: {done.exit_code} {done.exception!r}", done.output)
"""


@pytest.fixture(scope="module")
def helped() -> str:
    """The help of each command, all in one process without the libraries of the extras."""
    code = f"HIDDEN = {HIDDEN!r}\n{WITHOUT}{HELP}"
    done = subprocess.run(
        [sys.executable, "-c", code, *sorted(TABLE)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("command", sorted(TABLE))
def test_help_needs_no_library_of_an_extra(helped: str, command: str) -> None:
    assert re.search(rf"^{command}: 0 None\s+Usage: .* {command} ", helped, re.MULTILINE), helped


def test_a_cohort_without_its_libraries_says_which_extra_it_needs(tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_text("name,subject\na,S05\n")
    done = without(tmp_path, "cohort", "table.csv", "--out", "out")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "pip install 'gaitval[cohort]'" in " ".join(done.stderr.split())


def test_a_training_without_its_libraries_says_so_before_any_work(tmp_path: Path) -> None:
    done = without(tmp_path, "subject", "5", "--train")
    assert done.returncode == 2
    assert "pip install 'gaitval[study]'" in done.stderr
    assert not (tmp_path / "reports" / "S05" / "model.urdf").exists()


@pytest.mark.slow
def test_an_import_runs_without_any_extra(tmp_path: Path) -> None:
    assert without(tmp_path, "data", "sample").returncode == 0
    done = without(
        tmp_path,
        *("import", "--static", "sample/standing.c3d", "--trial", "sample/walking.c3d"),
        *("--mass", "64.95", "--height", "1.53", "--sex", "F", "--out", "mine", *WITH_WORDS),
    )
    assert (tmp_path / "mine" / "subject.toml").is_file(), done.stderr


@pytest.mark.slow
def test_the_main_job_runs_with_the_study_alone(tmp_path: Path) -> None:
    settings = [argument for setting in QUICK for argument in ("--set", setting)]
    untrained = [*settings, "--set", "training.samples=auto"]
    done = without(tmp_path, "subject", "5", *untrained)  # no torch
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "reports" / "S05" / "report.html").is_file()
    refused = without(tmp_path, "subject", "5", *settings)
    assert refused.returncode == 2
    assert "gaitval[study]" in refused.stderr
    done = without(tmp_path, "subject", "5", *settings, extra="study")
    assert done.returncode == 0, done.stderr
