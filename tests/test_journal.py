"""What a killed stage has found is taken up again, bit for bit, and half a line is not."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

from gaitval._internal.io.journal import Journal


class Stopped(Exception):
    """In the place of a kill."""


def squares(done: list[float], stop: int | None = None) -> Callable[[Sequence[float]], Iterator]:
    """Work that keeps what it was asked for, and stops after `stop` results in all."""

    def work(items: Sequence[float]) -> Iterator[float]:
        for item in items:
            if stop is not None and len(done) == stop:
                raise Stopped
            done.append(item)
            yield item**2 / 3.0

    return work


def search(journal: Journal, work: Callable[[Sequence[float]], Iterator]) -> list[float]:
    """Two calls, the second of which follows from the first."""
    first = journal.results(work, [0.1, 0.2, 0.3], write=float, read=float)
    return first + journal.results(work, first, write=float, read=float)


@pytest.mark.parametrize("stop", range(6))
def test_a_search_that_was_stopped_goes_on_to_the_same_result(tmp_path: Path, stop: int) -> None:
    path = tmp_path / "unfinished" / "walks.jsonl"
    expected = search(Journal(), squares([]))
    with pytest.raises(Stopped):
        search(Journal(path), squares([], stop))
    left: list[float] = []
    assert search(Journal(path), squares(left)) == expected
    assert len(left) == 6 - stop


@pytest.mark.parametrize("cut", [1, 5])
def test_a_line_that_was_cut_short_is_found_again(tmp_path: Path, cut: int) -> None:
    """Also one that lacks only its end: 12 may be the beginning of 123."""
    path = tmp_path / "walks.jsonl"
    expected = search(Journal(path), squares([]))
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    left: list[float] = []
    assert search(Journal(path), squares(left)) == expected
    assert len(left) == 1
    assert path.read_bytes() == whole


def test_nothing_is_kept_without_a_file() -> None:
    done: list[float] = []
    journal = Journal()
    search(journal, squares(done))
    search(journal, squares(done))
    assert len(done) == 12
