"""What a long stage has found so far, one result per line, so that it continues after a kill."""

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import growing, writing
from gaitval.errors import ArtefactError

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


class Journal:
    """Results in the order in which they were found; a later run reads them in that order.

    It is for work that is the same every time, such as a search whose next points follow from the
    results before. Whoever owns the file removes it when inputs or code have changed. Numbers come
    back bit for bit.

    Parameters
    ----------
    path : of the file; None keeps nothing.
    """

    def __init__(self, path: Path | None = None) -> None:
        self._path = path
        self._stored: list[Any] = []
        if path is None or not path.exists():
            return
        # Bytes of the lines that are complete. What follows them is cut off, or the next result
        # would be appended to half a line.
        whole = 0
        file_gate.passed(path, ArtefactError, largest=file_gate.SIZES.binary)
        with writing(path), growing(path, "change") as file:
            for line in file:
                try:
                    self._stored.append(json.loads(line))
                except (ValueError, RecursionError):
                    break  # the process was killed while it wrote this line
                # A number may have been cut short and still be JSON, such as 12 of 123.
                if not line.endswith(b"\n"):
                    self._stored.pop()
                    break
                whole += len(line)
            file.truncate(whole)

    def results(
        self,
        work: Callable[[Sequence[_Item]], Iterable[_Result]],
        items: Sequence[_Item],
        *,
        write: Callable[[_Result], Any],
        read: Callable[[Any], _Result],
    ) -> list[_Result]:
        """A result of each of `items`: those that are in the file, then those of `work` for the
        rest, which gives them in order, one after the other. `write` makes JSON of a result, and
        `read` a result of it.
        """
        known, self._stored = self._stored[: len(items)], self._stored[len(items) :]
        found = [read(each) for each in known]
        left = items[len(found) :]
        if not left:
            return found
        for result in work(left):
            self._add(write(result))
            found.append(result)
        return found

    def _add(self, value: Any) -> None:
        if self._path is None:
            return
        # Opened and closed for each result: a kill loses at most the line that is being written.
        with writing(self._path), growing(self._path, "append") as file:
            file.write(json.dumps(value).encode() + b"\n")
