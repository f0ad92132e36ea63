"""The commit and the date that stand on a page."""

import subprocess
from pathlib import Path

import pytest

from gaitval._internal.io.build_info import INSTALLED, UNREADABLE, minute_of, now, source_commit


def git(folder: Path, *arguments: str) -> str:
    line = ["git", "-C", str(folder), "-c", "user.name=a", "-c", "user.email=a@b", *arguments]
    return subprocess.run(line, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A package in a repository with one commit."""
    source_commit.cache_clear()
    (tmp_path / "gaitval").mkdir()
    (tmp_path / "gaitval" / "a.py").write_text("", encoding="utf-8")
    git(tmp_path, "init", "-q", "-b", "main")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "a")
    return tmp_path


def head(folder: Path) -> str:
    return git(folder, "rev-parse", "HEAD")


def test_the_commit_is_that_of_the_checkout(checkout: Path) -> None:
    assert source_commit(checkout) == head(checkout)


def test_the_commit_is_found_however_git_keeps_it(checkout: Path) -> None:
    first = head(checkout)
    git(checkout, "pack-refs", "--all")
    assert not (checkout / ".git/refs/heads/main").exists()
    assert source_commit(checkout) == first
    second = checkout / "second"
    git(checkout, "worktree", "add", "-q", "-b", "other", str(second))
    git(second, "commit", "-q", "--allow-empty", "-m", "b")
    assert head(second) != first
    assert source_commit(second) == head(second)
    git(checkout, "checkout", "-q", "--detach")
    source_commit.cache_clear()
    assert source_commit(checkout) == first


@pytest.mark.parametrize("text", ["ref: refs/heads/none", "ref: ../../a.py", "", "\xff"])
def test_a_head_that_names_no_commit_is_told(checkout: Path, text: str) -> None:
    (checkout / ".git/HEAD").write_text(text, encoding="latin-1")
    assert source_commit(checkout) == UNREADABLE


def test_no_package_is_no_checkout(tmp_path: Path) -> None:
    source_commit.cache_clear()
    assert source_commit(tmp_path) == INSTALLED


def test_no_program_of_the_repository_is_run(checkout: Path) -> None:
    """Git takes a filter named a=b for one of another name, so no list of settings stops it."""
    ran = checkout / "ran"
    config = checkout / ".git" / "config"
    config.write_text(
        f'{config.read_text()}[filter "a=b"]\n\tclean = "touch {ran}; cat"\n'
        f'[core]\n\tfsmonitor = "touch {ran}; false"\n',
        encoding="utf-8",
    )
    (checkout / ".gitattributes").write_text("* filter=a=b\n", encoding="utf-8")
    (checkout / "gaitval" / "a.py").write_text("1", encoding="utf-8")
    assert source_commit(checkout) == head(checkout)
    assert not ran.exists()
    git(checkout, "status", "--porcelain")
    assert ran.exists(), "else this test proves nothing"


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
