"""One stage of a run by itself, as `gaitval stage` runs it."""

import shlex
from itertools import takewhile

from gaitval.errors import ArtefactError
from gaitval.study.identification_stages import identify_stage, walks_to_identify
from gaitval.study.learning_stages import need_stage, train_stage
from gaitval.study.run import choose_start, plan
from gaitval.study.stage import SHORT, Run, Stage, run_stage, why_run


def finished_rounds(run: Run) -> int:
    """Number of rounds of `run` whose training and identification are up to date."""
    count = 0
    while (run.folder / f"rounds/{count + 1}").exists() and not any(
        why_run(stage(run, count + 1), run.folder) for stage in (train_stage, identify_stage)
    ):
        count += 1
    return count


def run_one(
    run: Run, name: str, *, round_number: int = 1, scratch: bool = False, force: bool = False
) -> None:
    """Run one stage of `run`; those before it must be up to date.

    Parameters
    ----------
    name : `scale`, `reference`, `train`, `identify`, `correct`, `simulate`, `push`, `validate`
        or `report`.
    round_number : round of Algorithm 1, for `train` and `identify`.
    scratch : for `train`: start from nothing, and not from the general policy.
    force : run it even if it is up to date.

    Raises
    ------
    ArtefactError : an earlier stage has not run, or ran with other inputs or settings.
    """
    repeated = name in ("train", "identify")
    wanted = f"{name}-{round_number}" if repeated else name
    reached = False
    # stages before the wanted one must be up to date; after it, only its short followers run
    stages = plan(run, round_number if repeated else max(finished_rounds(run), 1))
    alone = wanted == "identify-1" and not walks_to_identify(run.configuration)
    if alone and why_run(train_stage(run, 1), run.folder):
        stages = (*stages[:2], identify_stage(run, 1))  # it uses no policy
    # First all that can be refused now: whoever is refused finds everything as it was. What a short
    # stage has yet to write is looked at after it.
    for stage in takewhile(lambda each: each.name != wanted, stages):
        there = all((run.folder / each).exists() for each in stage.inputs)
        if there and stage.name.partition("-")[0] not in SHORT:
            _require(run, stage, name)
    for stage in stages:
        if stage.name == "need-1" and wanted == "train-1":
            choose_start(run, train_stage(run, 1), scratch=scratch)
            # the inputs of this stage and the next depend on whether there is a start now
            run_stage(need_stage(run, 1), run.folder, observer=run.observer)
        elif stage.name == wanted:
            stage = train_stage(run, 1) if wanted == "train-1" else stage
            run_stage(stage, run.folder, force=force, observer=run.observer)
            reached = True
        elif stage.name.partition("-")[0] in SHORT:
            run_stage(stage, run.folder, observer=run.observer)
        elif reached:
            return
        else:
            _require(run, stage, name)


def _require(run: Run, stage: Stage, name: str) -> None:
    """Raise ArtefactError unless `stage`, which `name` depends on, is up to date."""
    reason = why_run(stage, run.folder)
    if reason is not None:
        whole = shlex.join(["gaitval", "subject", *run.named])
        raise ArtefactError(
            f"{run.folder}: {name} depends on {stage.name}, which is not up to date: {reason}. "
            f"First run `{stage.command(run)}` with the same settings, or `{whole}`, which runs "
            "all stages."
        )
