"""What a study compiles is compiled before it begins, by a process that ends."""

import os
import shutil
import subprocess
import sys

import asked_of_cache
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


@pytest.mark.slow  # a study
def test_a_study_after_it_compiles_nothing(tmp_path):
    """It asks for no function that was not asked for before; whether one must be compiled for that
    takes minutes to see, and hangs on what was compiled here before.
    """
    shutil.copy(asked_of_cache.__file__, tmp_path / "sitecustomize.py")

    def asked(*words: str) -> set[str]:
        log = tmp_path / f"{len(words)}.log"
        environment = {**os.environ, "CACHE_LOG": str(log), "PYTHONPATH": str(tmp_path)}
        subprocess.run(
            [sys.executable, "-P", "-m", *words], env=environment, cwd=tmp_path, check=True,
            capture_output=True,
        )  # fmt: skip
        return set(log.read_text().splitlines())

    before = asked("gaitval.study.compile_ahead")
    assert len(before) > 15
    sizes = [each for each in QUICK if not each.startswith(METHODS)]
    settings = [word for each in sizes for word in ("--set", each)]
    assert not asked("gaitval", "subject", "5", "--out", "S05", *settings) - before
