"""What a study compiles is compiled before it begins, by a process that ends."""

import os
import subprocess
import sys

import pytest
from quick_settings import QUICK

from gaitval import compiled
from gaitval.study import compile_ahead


@pytest.mark.parametrize("empty", [True, False])
def test_it_compiles_where_nothing_was_compiled_before(monkeypatch, empty):
    ran = []
    monkeypatch.setattr(compile_ahead, "is_empty", lambda: empty)
    monkeypatch.setattr(subprocess, "run", lambda command, **_: ran.append(command))
    compile_ahead.compile_ahead()
    assert [command[-1] for command in ran] == ["gaitval.study.compile_ahead"] * empty


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError, OSError])
def test_what_goes_wrong_there_is_left_to_the_study(monkeypatch, error):
    def fails():
        raise error

    monkeypatch.setattr(compile_ahead, "walk", fails)
    compile_ahead.main()


def test_a_folder_with_files_is_not_empty(tmp_path):
    assert compiled.is_empty(tmp_path)
    assert compiled.is_empty(tmp_path / "none")
    (tmp_path / "one.nbi").touch()
    assert not compiled.is_empty(tmp_path)


METHODS = ("training.samples", "identification.", "correction.")
"""How settings begin that leave out a method: a study that compiles all has the usual ones."""


@pytest.mark.slow  # it compiles everything
def test_a_study_after_it_compiles_nothing(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def run(*words: str) -> str:
        done = subprocess.run(
            [sys.executable, "-m", *words],
            env=environment, cwd=tmp_path, check=True, capture_output=True, text=True,
        )  # fmt: skip
        return done.stderr

    run("gaitval.study.compile_ahead")
    files = sorted((tmp_path / "cache").rglob("*.nbc"))
    sizes = [each for each in QUICK if not each.startswith(METHODS)]
    settings = [word for each in sizes for word in ("--set", each)]
    run("gaitval", "subject", "5", "--out", "S05", *settings)
    later = sorted({*(tmp_path / "cache").rglob("*.nbc")} - {*files})
    assert not later, [each.name for each in later]
