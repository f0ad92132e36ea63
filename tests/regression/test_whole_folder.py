"""Files of one folder are written all or none."""

import errno
from pathlib import Path

import pytest

from gaitval._internal.io.artefacts import write_text
from gaitval.apps.regression.whole_folder import writing_whole
from gaitval.errors import ArtefactError

FILES = ("a.txt", "sub/b.txt", "z.txt")


def contents(folder: Path) -> dict[str, str]:
    return {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in folder.rglob("*")
        if path.is_file()
    }


def fill(folder: Path, text: str, *names: str) -> dict[str, str]:
    for name in names:
        write_text(folder / name, text)
    return dict.fromkeys(names, text)


def test_all_files_come_and_what_else_is_there_stays(tmp_path: Path) -> None:
    target = tmp_path / "new" / "target"
    with writing_whole(target) as folder:
        found = fill(folder, "1", *FILES)
        assert contents(target) != found
    assert contents(target) == found
    kept = fill(target, "ours", "sub/README.md")
    with writing_whole(target) as folder:
        assert contents(folder) == {}
        found |= fill(folder, "2", *FILES[1:])
    assert contents(target) == found | kept
    assert sorted(path.name for path in target.iterdir()) == ["a.txt", "sub", "z.txt"]


@pytest.mark.parametrize("error", [KeyboardInterrupt(), ValueError("a bug")])
def test_an_error_before_the_end_changes_nothing(tmp_path: Path, error: BaseException) -> None:
    before = fill(tmp_path, "1", *FILES)

    def fail() -> None:
        with writing_whole(tmp_path) as folder:
            fill(folder, "2", *FILES)
            raise error

    with pytest.raises(type(error)):
        fail()
    assert contents(tmp_path) == before


@pytest.mark.parametrize("at", range(5))
def test_a_file_that_cannot_be_moved_sends_the_others_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: int
) -> None:
    """Two are there already, each of which is moved away first: five moves."""
    before = fill(tmp_path, "1", *FILES[1:])
    moved: list[Path] = []
    move = Path.replace

    def failing(path: Path, to: Path) -> Path:
        if "new" in path.parts or "replaced" in Path(to).parts:  # not in writing a file
            moved.append(path)
            if len(moved) == at + 1:
                raise OSError(errno.EACCES, "Permission denied", str(path))
        return move(path, to)

    def write() -> None:
        with writing_whole(tmp_path) as folder:
            fill(folder, "2", *FILES)
            monkeypatch.setattr(Path, "replace", failing)

    with pytest.raises(ArtefactError, match="may not be written to") as refused:
        write()
    assert str(refused.value).startswith(f"{tmp_path}: cannot be written")
    assert contents(tmp_path) == before
