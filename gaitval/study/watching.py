"""Progress of a stage that another process works on."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from gaitval.artefacts import read_json
from gaitval.errors import ArtefactError
from gaitval.study.stage import Observer

EVERY: Final = 2.0
"""s between two looks."""


@contextmanager
def generations_shown(
    observer: Observer, state: Path, total: int, every: float = EVERY
) -> Iterator[None]:
    """Within the block, report the generations of an identification in another process to
    `observer`: those in its `state` file, of at most `total`, looked up `every` so many seconds.
    """
    ended = threading.Event()

    def watch() -> None:
        seen = 0
        while not ended.wait(every):
            try:
                values = read_json(state)["values"]
            except (ArtefactError, LookupError, TypeError):
                continue  # not started yet, or ended, which removes the file
            if len(values) > seen:
                seen = len(values)
                done = {"generation": seen, "total": total, "value": float(min(values[-1]))}
                observer.progress(done)

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        ended.set()
        watcher.join()
