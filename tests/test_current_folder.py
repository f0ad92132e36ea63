"""The folder that a command is started in decides nothing: nothing of it runs, nothing is read."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import hostile_folder
import pytest
import seen_of_folder
from typer.main import get_command

import gaitval.cli
from gaitval import cli

ROOT: Any = get_command(cli.app)
SAMPLES = Path(gaitval.__file__).parent / "samples"
RECORDED = [
    *("--static", str(SAMPLES / "standing.c3d"), "--trial", str(SAMPLES / "walking.c3d")),
    *("--mass", "64.95", "--height", "1.53", "--sex", "F", "--belt", "1.1473"),
]
RUNS: dict[str, list[str]] = {
    "subjects": ["subjects"],
    "data": ["data", "list"],
    "curves": ["curves", "--template", "out/own.csv"],
    "markers": ["markers", str(SAMPLES / "walking.c3d"), "--out", "out/set.toml"],
    "stage": ["stage", "scale", "5", "--out", "out/S05"],
    "judge": ["judge", "out/none.osim", "--out", "out/judged"],
    "check": ["check", "--quick", "--baseline", "S05", "--json", "out/check.json"],
    "import": ["import", *RECORDED, "--out", "out/sample"],
}
"""A run of a command, where one is cheap; of the others, the help and all that they import."""
SLOW = {"check", "import", "markers", "judge", "stage"}
EVERYTHING = """
import importlib, pkgutil, sys
from typer.testing import CliRunner
import gaitval
import gaitval.cli
for each in pkgutil.walk_packages(gaitval.__path__, "gaitval."):
    if not each.name.endswith(("__main__", "c3d_process")):
        importlib.import_module(each.name)
for name in sys.argv[1:]:
    done = CliRunner().invoke(gaitval.cli.app, [name, "--help"])
    assert done.exit_code == 0, (name, done.output)
    print("helped", name)
"""


def started(place: SimpleNamespace, *command: str) -> SimpleNamespace:
    """A program of this Python, started in the hostile folder, and what it had of it."""
    place.log.write_text("")
    own = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    own |= {
        "PYTHONPATH": str(place.watcher),
        "FOLDER_WATCHED": str(place.folder),
        "FOLDER_LOG": str(place.log),
    }
    done = subprocess.run(
        [*command], cwd=place.folder, env=own, capture_output=True, text=True, check=False
    )
    lines = set(place.log.read_text().splitlines())
    ran = {path.name for path in place.marks.iterdir()}
    for path in place.marks.iterdir():
        path.unlink()
    ours = {line for line in lines if line.split(" ", 1)[1].split("/")[0] in ("out", ".")}
    return SimpleNamespace(done=done, ran=ran, read=lines - ours)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    base = tmp_path_factory.mktemp("hostile")
    watcher = base / "watcher"
    watcher.mkdir()
    shutil.copy(seen_of_folder.__file__, watcher / "sitecustomize.py")
    folder = hostile_folder.made(base / "folder", base / "marks")
    (folder / "out").mkdir()
    return SimpleNamespace(
        folder=folder, marks=base / "marks", watcher=watcher, log=base / "log.txt"
    )


GAITVAL = str(Path(sys.executable).with_name("gaitval"))


def test_the_folder_is_hostile(place):
    """Programs that do not take care run and read what is in it: else the tests prove nothing."""
    bare = started(place, sys.executable, "-c", "import evil")
    assert "evil.py" in bare.ran
    assert "exec evil.py" in bare.read
    figures = started(place, sys.executable, "-P", "-c", "import matplotlib")
    assert "open matplotlibrc" in figures.read
    call = "import socket; socket.getaddrinfo('no.invalid', 80)"
    assert started(place, sys.executable, "-P", "-c", call).read == {
        "socket.getaddrinfo no.invalid"
    }
    numba = started(
        place, sys.executable, "-P", "-c", "import numba.core.config as c; print(int(c.OPT))"
    )
    assert numba.done.stdout == "1\n"
    assert "open .numba_config.yaml" in numba.read
    if shutil.which("git"):
        started_git = "import subprocess; subprocess.run(['git', 'status'])"
        ran = started(place, sys.executable, "-P", "-c", started_git).ran
        assert {"git-fsmonitor", "git-process"} & ran


def test_a_python_that_a_library_starts_takes_nothing_from_it(place):
    """glfw asks one for the versions of its libraries."""
    bare = started(place, sys.executable, "-P", "-c", "import glfw")
    assert "ctypes.py" in bare.ran
    ours = started(place, sys.executable, "-P", "-c", "import gaitval.apps.export.formats")
    assert ours.done.returncode == 0, ours.done.stderr
    assert not ours.ran


@pytest.fixture(scope="module")
def everything(place):
    """All modules of gaitval imported, and the help of each command, in one process."""
    return started(place, sys.executable, "-P", "-c", EVERYTHING, *ROOT.commands)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(ROOT.commands))
def test_no_command_runs_or_reads_what_is_in_the_folder_that_it_is_started_in(
    place, everything, name
):
    assert f"helped {name}\n" in everything.done.stdout, everything.done.stderr
    assert not everything.ran
    assert not everything.read


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in SLOW else []) for n in RUNS]
)
def test_nor_does_a_run(place, name):
    found = started(place, GAITVAL, *RUNS[name])
    assert found.done.returncode in (0, 1, 2), found.done.stderr
    assert "Traceback" not in found.done.stderr
    assert not found.ran
    assert not found.read


def test_python_p_m_gaitval_takes_nothing_from_it(place):
    found = started(place, sys.executable, "-P", "-m", "gaitval", "subjects")
    assert found.done.returncode == 0, found.done.stderr
    assert not found.ran
    assert not found.read


@pytest.mark.parametrize("module", ["gaitval", "gaitval.study.run"])
def test_python_m_gaitval_is_refused_before_gaitval_loads_anything(place, module):
    """Without -P Python itself takes from the folder what it needs to find a module."""
    (place.watcher / "empty_module.py").write_text("import sys; print(*sys.modules)\n")
    needed = started(place, sys.executable, "-P", "-m", "empty_module").done.stdout.split()
    aside = [path for name in needed if (path := place.folder / f"{name}.py").exists()]
    for path in aside:
        path.rename(path.with_suffix(".aside"))
    try:
        found = started(place, sys.executable, "-m", module, "subjects")
    finally:
        for path in aside:
            path.with_suffix(".aside").rename(path)
    assert found.done.returncode == 2
    assert "Use the command gaitval, or python -P -m gaitval." in found.done.stderr
    assert not found.ran
    assert not found.done.stdout


WORKING = """
import math
from gaitval.policy.processes import keeping_workers, side_by_side
if __name__ == "__main__":
    with keeping_workers(2):
        print(*side_by_side(math.sqrt, [9.0, 16.0]))
"""


@pytest.mark.parametrize("way", ["forkserver", "spawn"])
def test_workers_of_a_script_take_nothing_from_it(place, way, monkeypatch):
    """Python starts them by `-c`, for which it looks in the current folder first."""
    script = place.watcher / "working.py"
    script.write_text(WORKING)
    if way == "spawn":  # where a server has no place for its socket
        long = place.watcher / ("d" * 120)
        long.mkdir(exist_ok=True)
        monkeypatch.setenv("TMPDIR", str(long))
    found = started(place, sys.executable, str(script))
    assert found.done.stdout == "3.0 4.0\n", found.done.stderr
    assert not found.ran
    assert not found.read


def test_numba_that_was_there_before_forgets_what_it_read_here(place):
    code = (
        "import numba; from numba.core import config; assert config.OPT == 1; "
        "import gaitval._internal.numba.compiled; "
        "print(int(config.OPT), repr(config.CACHE_DIR), config.DISABLE_JIT)"
    )
    found = started(place, sys.executable, "-P", "-c", code)
    assert found.done.stdout == "3 '' 0\n", found.done.stderr
