"""The cache of compiled functions sees every source that goes into them."""

import os
import subprocess
import sys
from pathlib import Path

import gaitval
from gaitval._internal.numba.compiled import SOURCES

PACKAGE = Path(gaitval.__file__).parent


def test_every_file_with_compiled_functions_names_the_cache():
    compiled = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if "\n@njit" in path.read_text(encoding="utf-8")
    }
    assert compiled
    assert compiled <= set(SOURCES)


def test_all_sources_exist():
    assert all((PACKAGE / name).is_file() for name in SOURCES)


FIRST = """
import numpy as np
from gaitval._internal.numba.compiled import njit

@njit
def double(x):
    return 2.0 * x

assert double(3.0) == 6.0
"""


def test_the_first_compilation_is_said_once_and_a_warm_cache_says_nothing(tmp_path):
    (tmp_path / "first.py").write_text(FIRST)
    messages = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "first.py"],
            cwd=tmp_path,
            env={
                **os.environ,
                "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
                "PYTHONPATH": str(Path(__file__).parents[1]),
            },
            capture_output=True,
            text=True,
            check=True,
        )
        messages.append(done.stderr)
    assert messages == ["gaitval: compiling for the first time, once, about a minute ...\n", ""]
