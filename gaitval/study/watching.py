"""A stage that another process works on beside others, and its progress."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext

from gaitval.policy.beside import beside
from gaitval.policy.processes import kept_workers
from gaitval.study.stage import (
    BESIDE,
    Run,
    Stage,
    begin_stage,
    end_stage,
    perform,
    run_stage,
)


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
