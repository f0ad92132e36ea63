"""A folder such as an archive of recordings might unpack to: whatever programs look for in the
folder that they are started in is there, and makes a file in another folder if it runs."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

MODULES = (
    *("sitecustomize", "usercustomize", "evil", "conftest", "numpy", "numba", "scipy", "typer"),
    *("matplotlib", "yaml", "dask", "torch", "setup", "gaitval_plugin", "cuda", "filelock"),
    *sorted(sys.stdlib_module_names),
)
SETTINGS = {
    ".numba_config.yaml": "cache_dir: .cache\ncache_locator_classes: evil.Locator\ndisable_jit: 1\n"
    "opt: '1'\nboundscheck: 1\n",
    "matplotlibrc": "text.usetex: True\nbackend: module://evil\naxes.labelsize: 0.1\n",
    "evil.pth": "import evil\n",
    "python311._pth": "import evil\n",
    "pyvenv.cfg": "home = .\n",
    "pytest.ini": "[pytest]\naddopts = -p evil\n",
    "tox.ini": "[pytest]\naddopts = -p evil\n",
    "setup.cfg": "[tool:pytest]\naddopts = -p evil\n",
    "pyproject.toml": '[tool.pytest.ini_options]\naddopts = "-p evil"\n',
    ".netrc": "default login a password b\n",
    ".env": "PYTHONSTARTUP=evil.py\nMPLBACKEND=module://evil\n",
    "dask.yaml": "distributed: {worker: {preload: [evil]}}\n",
    "distributed.yaml": "distributed: {worker: {preload: [evil]}}\n",
    "jobqueue.yaml": "jobqueue: {slurm: {job-script-prologue: [evil]}}\n",
    ".config/dask/dask.yaml": "distributed: {scheduler: {preload: [evil]}}\n",
    ".config/fsspec/conf.json": '{"file": {"protocol": "evil"}}\n',
    ".config/matplotlib/matplotlibrc": "text.usetex: True\n",
    ".aws/config": "[default]\ncredential_process = ./run\n",
    ".boto": "[Plugin]\nplugin_directory = .\n",
    ".coveragerc": "[run]\nplugins = evil\n",
    ".pdbrc": "import evil\n",
    ".condarc": "a: b\n",
    "fonts.conf": "<fontconfig><dir>.</dir></fontconfig>\n",
    "mypy.ini": "[mypy]\nplugins = evil\n",
    "gaitval.toml": "[contact]\nlaw = 'none'\n",
    "evil-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n",
    "evil-1.0.dist-info/entry_points.txt": "[gaitval.commands]\nevil = evil:command\n"
    "[gaitval.recordings]\nc3d = evil:read\n[pytest11]\nevil = evil\n",
    # what GNU ld opens here when it is asked for a library, and what it then says is one
    "libgcc_s.so.1": "INPUT(./libpango-1.0-0.so ./libgobject-2.0-0.so ./libharfbuzz-vector.so)\n",
}
PROGRAMS = ("run", "git", "gcc", "cc", "ld", "latex", "dvipng", "ldconfig", "objdump", "sbatch")
LIBRARIES = (
    *("libpango-1.0-0.so", "libgobject-2.0-0.so", "libharfbuzz-vector.so", "libezc3d.so"),
    *("libgomp.so.1", "libGL.so.1"),
)


def made(folder: Path, marks: Path) -> Path:
    """The folder, made; `marks` is where whatever runs leaves a file."""
    folder.mkdir(parents=True)
    marks.mkdir()
    for name in MODULES:
        (folder / f"{name}.py").write_text(
            f"open({str(marks / f'{name}.py')!r}, 'w').close()\nimport sys\n"
        )
    for name, text in SETTINGS.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    for name in PROGRAMS:
        _program(folder / name, marks / name)
    _libraries(folder, marks)
    if shutil.which("git"):
        _repository(folder, marks)
    return folder


def _program(path: Path, mark: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n: > '{mark}'\ncat\n")
    path.chmod(0o755)


def _libraries(folder: Path, marks: Path) -> None:
    """Libraries that make a file when they are loaded, and say that they are in this folder; empty
    files where there is no compiler.
    """
    compiler = shutil.which("gcc")
    for name in LIBRARIES:
        if compiler is None:
            (folder / name).touch()
            continue
        code = (
            "#include <fcntl.h>\n__attribute__((constructor)) static void run(void)\n"
            f'{{ open("{marks / name}", O_CREAT | O_WRONLY, 0600); }}\n'
        )
        subprocess.run(
            [compiler, "-shared", "-fPIC", "-x", "c", "-", f"-Wl,-soname,./{name}", "-o",
             str(folder / name)],
            input=code, text=True, cwd=marks, check=True,
        )  # fmt: skip


def _repository(folder: Path, marks: Path) -> None:
    """A repository whose settings run programs: what watches, filters, and hooks."""

    def git(*words: str) -> None:
        own = {"GIT_CONFIG_GLOBAL": os.devnull, "PATH": os.environ["PATH"]}
        subprocess.run(["git", *words], cwd=folder, check=True, env=own, capture_output=True)

    git("init", "-q")
    (folder / "walk.csv").write_text("a\n")
    (folder / "walk.txt").write_text("a\n")
    git("add", "walk.csv", "walk.txt")
    git("-c", "user.name=a", "-c", "user.email=a", "commit", "-qm", "a")
    (folder / ".gitattributes").write_text("*.csv filter=evil\n*.txt filter=a=b\n")
    for name in ("walk.csv", "walk.txt"):
        (folder / name).write_text("b\n")
    programs = {
        name: marks / f"git-{name}"
        for name in ("fsmonitor", "clean", "process", "hook", "pager", "gpg", "ssh", "equals")
    }
    for name, mark in programs.items():
        _program(folder / ".git" / "run" / name, mark)
    run = folder / ".git" / "run"
    hooks = folder / ".git" / "hooks"
    shutil.rmtree(hooks, ignore_errors=True)
    for name in ("post-index-change", "fsmonitor-watchman", "pre-commit"):
        _program(hooks / name, programs["hook"])
    for name, value in {
        "core.fsmonitor": run / "fsmonitor",
        "filter.evil.clean": run / "clean",
        "filter.evil.process": run / "process",
        "filter.evil.required": "true",
        "filter.a=b.clean": run / "equals",
        "core.pager": run / "pager",
        "gpg.program": run / "gpg",
        "log.showSignature": "true",
        "core.sshCommand": run / "ssh",
        "core.hooksPath": hooks,
    }.items():
        git("config", name, str(value))


if __name__ == "__main__":
    made(Path(sys.argv[1]), Path(sys.argv[2]))
