"""The commit and the date that stand on a page."""

import subprocess
from pathlib import Path

import pytest

from gaitval.build_info import INSTALLED, UNREADABLE, minute_of, now, source_commit


def git(folder: Path, *arguments: str) -> str:
    line = ["git", "-C", str(folder), "-c", "user.name=a", "-c", "user.email=a@b", *arguments]
    return subprocess.run(line, check=True, capture_output=True, text=True).stdout.strip()


def test_the_commit_is_that_of_the_package_and_says_if_it_was_changed(tmp_path: Path) -> None:
    package = tmp_path / "gaitval"
    package.mkdir()
    (package / "a.py").write_text("", encoding="utf-8")
    source_commit.cache_clear()
    assert source_commit(tmp_path) == INSTALLED
    git(tmp_path, "init", "-q")
    source_commit.cache_clear()
    assert source_commit(tmp_path) == UNREADABLE  # nothing was committed
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "a")
    source_commit.cache_clear()
    head = git(tmp_path, "rev-parse", "HEAD")
    assert source_commit(tmp_path) == head
    (tmp_path / "notes.txt").write_text("", encoding="utf-8")
    source_commit.cache_clear()
    assert source_commit(tmp_path) == head
    (package / "a.py").write_text("1", encoding="utf-8")
    source_commit.cache_clear()
    assert source_commit(tmp_path) == f"{head}+"


def test_a_repository_around_an_environment_is_not_ours(tmp_path: Path) -> None:
    git(tmp_path, "init", "-q")
    site = tmp_path / "venv" / "site-packages"
    (site / "gaitval").mkdir(parents=True)
    assert source_commit(site) == INSTALLED


def test_the_date_is_that_of_the_build_where_one_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    assert now() == "1970-01-02 00:00 UTC"
    for useless in ("tomorrow", "9" * 40):
        monkeypatch.setenv("SOURCE_DATE_EPOCH", useless)
        assert now().startswith("20")
    assert minute_of("2026-11-23T03:14:05+01:00") == "2026-11-23 02:14 UTC"
    assert minute_of("yesterday") == ""
