"""A stage that another process works on beside others, and its progress."""

import threading
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Final

from gaitval.artefacts import read_json
from gaitval.errors import ArtefactError
from gaitval.policy.beside import beside
from gaitval.policy.processes import kept_workers
from gaitval.study.stage import (
    BESIDE,
    Observer,
    Run,
    Stage,
    begin_stage,
    end_stage,
    perform,
    run_stage,
)

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


def run_beside(
    run: Run,
    stages: Sequence[Stage],
    other: Stage,
    shown: AbstractContextManager[None] | None = None,
    *,
    force: bool,
) -> None:
    """The `stages` of `run` one after another, and beside them an `other` one that needs none of
    their files; `shown` while only that one still runs. With `force` also those that are up to
    date.
    """
    started = begin_stage(other, run.folder, force=force)
    assert started is not None
    kept_workers()  # started now: two threads that ask for them at once would start twice as many
    with beside(perform, other) as ended:
        run.observer.say(f"{other.name}: runs beside {stages[0].name} ({started.reason})")
        for stage in stages:
            run_stage(stage, run.folder, force=force, observer=run.observer)
        run.observer.started(other.name, BESIDE)
        with shown or nullcontext():
            seconds = ended()
    end_stage(started, seconds)
    run.observer.finished(other.name, seconds)
