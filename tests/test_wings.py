"""The core does without the wings of extras/, and without the libraries that only they need."""

import ast
import re
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
from quick_settings import QUICK
from typer.main import get_command

from gaitval import wings
from gaitval.configuration import ContactSettings
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ConfigurationError
from gaitval.opensim.osim import write_osim
from gaitval.scaling.scaling import scale_subject
from gaitval.terminal.app import app

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
WINGS = {path.parent.name for path in (ROOT / "extras").glob("*/__init__.py")}
EXTRAS = PROJECT["optional-dependencies"]


def libraries(extra: str) -> set[str]:
    """First names of what an extra installs, with the extras that it asks for."""
    found: set[str] = set()
    for line in EXTRAS[extra]:
        other = re.fullmatch(r"gaitval\[(\w+)\]", line)
        found |= libraries(other[1]) if other else {re.split(r"[<>=]", line)[0].replace("-", "_")}
    return found


HIDDEN = {name for extra in EXTRAS if extra not in ("all", "dev", "test", "docs", "audit")
          for name in libraries(extra)} | {"s3fs", "dask_jobqueue"}  # fmt: skip
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
from gaitval.cli import main
main()
"""


def imported(path: Path) -> set[str]:
    """First names of all that a file imports, also inside functions and for type checkers."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module.partition(".")[0])
    return found


@pytest.mark.parametrize("folder", ["gaitval", *sorted(f"extras/{wing}" for wing in WINGS)])
def test_no_wing_is_imported_but_by_itself(folder: str) -> None:
    for path in (ROOT / folder).rglob("*.py"):
        assert not imported(path) & (WINGS - {Path(folder).name}), path


def test_the_core_names_no_wing() -> None:
    """Not in a text either, by which it could be imported."""
    for path in (ROOT / "gaitval").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                assert node.value.partition(".")[0].partition(":")[0] not in WINGS, path


def test_every_wing_is_in_the_wheel_and_has_an_extra() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    packages = tomllib.loads(text)["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    assert set(packages) == {"gaitval", *(f"extras/{wing}" for wing in WINGS)}
    (everything,) = EXTRAS["all"]
    names = sorted(wing.removeprefix("gaitval_") for wing in WINGS)
    assert everything == f"gaitval[{','.join(names)}]"
    assert set(names) <= set(EXTRAS)


@pytest.mark.parametrize(
    "group",
    [wings.COMMANDS, wings.PARTS, wings.RECORDINGS, wings.FORCES, wings.SESSIONS, "pytest11"],
)
def test_what_is_registered_is_there(group: str) -> None:
    for name, target in PROJECT["entry-points"][group].items():
        module, _, attribute = target.partition(":")
        assert module.partition(".")[0] in WINGS
        found = import_module(module)
        assert not attribute or getattr(found, attribute), name


def test_a_wing_that_is_not_installed_is_named_with_what_to_do() -> None:
    with pytest.raises(ConfigurationError, match=r"nothing: .* 'gaitval\[all\]'"):
        wings.load(wings.COMMANDS, "nothing")


def test_a_wing_that_cannot_be_imported_breaks_no_other_command(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "gaitval.apps.judge.command", None)
    root = get_command(app)
    assert "judge" not in root.commands
    assert {"subject", "compare"} <= set(root.commands)
    with pytest.raises(ConfigurationError, match=r"judge: .* cannot be loaded"):
        root.get_command(None, "judge")


def test_a_command_of_the_core_loads_no_wing() -> None:
    root = get_command(app)
    assert root.get_command(None, "subject").name == "subject"
    assert not WINGS & {name.removesuffix("_command") for name in root._after}


def without(
    folder: Path, *arguments: str, extra: str | None = None
) -> subprocess.CompletedProcess[str]:
    """Run the command as on a machine with the libraries of the core and of one extra."""
    hidden = HIDDEN - (libraries(extra) if extra else set())
    return subprocess.run(
        [sys.executable, "-c", f"HIDDEN = {hidden!r}\n{WITHOUT}", *arguments],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.parametrize("command", sorted(PROJECT["entry-points"][wings.COMMANDS]))
def test_help_needs_no_library_of_a_wing(tmp_path: Path, command: str) -> None:
    done = without(tmp_path, command, "--help")
    assert done.returncode == 0, done.stderr
    assert re.search(rf"Usage: .* {command} ", done.stdout)


def test_a_cohort_without_its_libraries_says_which_extra_it_needs(tmp_path: Path) -> None:
    done = without(tmp_path, "cohort", "table.csv")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "a cohort needs cryptography, dask, distributed" in done.stderr
    assert "[cohort]'" in done.stderr


def test_a_study_without_its_libraries_says_so_before_any_work(tmp_path: Path) -> None:
    done = without(tmp_path, "subject", "5")
    assert done.returncode == 2
    assert "pip install 'gaitval[study]'" in done.stderr
    assert not (tmp_path / "reports" / "S05" / "model.urdf").exists()


def test_a_judgement_needs_no_library_of_an_extra_and_has_no_page_then(tmp_path: Path) -> None:
    body = scale_subject(load_subject("S05")).model
    write_osim(tmp_path / "model.osim", body, (), ContactSettings(), 0.8)
    done = without(tmp_path, "judge", "model.osim")
    assert done.returncode in (0, 1), done.stderr
    assert "No page: " in done.stdout
    assert "pip install 'gaitval[pages]'" in done.stdout.replace("\n", " ")
    assert [path.name for path in (tmp_path / "judged").iterdir()] == ["judge.json"]


@pytest.mark.slow  # a minute of walking
def test_a_stored_walk_is_checked_without_any_extra(tmp_path: Path) -> None:
    done = without(tmp_path, "check", "--baseline", "S05", "--quick")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow  # that nothing of a wing is imported is tested always
def test_an_import_runs_with_the_pages_alone(tmp_path: Path) -> None:
    assert without(tmp_path, "data", "sample", extra="curves").returncode == 0
    done = without(
        tmp_path,
        *("import", "--static", "sample/standing.c3d", "--trial", "sample/walking.c3d"),
        *("--mass", "64.95", "--height", "1.53", "--sex", "F", "--out", "mine"),
        extra="pages",
    )
    assert (tmp_path / "mine" / "subject.toml").is_file(), done.stderr


@pytest.mark.slow
def test_the_main_job_runs_with_the_study_alone(tmp_path: Path) -> None:
    settings = [argument for setting in QUICK for argument in ("--set", setting)]
    done = without(tmp_path, "subject", "5", *settings, extra="study")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "reports" / "S05" / "report.html").is_file()
