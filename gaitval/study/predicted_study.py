"""A person at an unrecorded speed: a walk at each speed, and where needed one policy for the range.

Every prediction is a run folder inside that of the range. Where the general policy walks at the
speed without a fall and stands the pushes, it is used as it is. Else the range's folder gets a
policy that learned to walk at several speeds, whose references are predicted from the given trials;
other speeds that need one use it again.
"""

from dataclasses import replace
from pathlib import Path
from typing import Final

from gaitval._internal.io.artefacts import copy_files, read_json, write_json
from gaitval.study.inputs import (
    CENTRING,
    GAIN,
    METRICS,
    NEED,
    POLICY_FILES,
    REPEATS,
    ROLLOUTS,
    SIMULATION_SECTIONS,
    STARTS,
    WALKS,
    stored,
    stored_policy,
    walking_task,
)
from gaitval.study.learning_stages import (
    LEARNING_SECTIONS,
    hand_on_stage,
    learned,
    need_files,
    need_stage,
    train_stage,
)
from gaitval.study.predicted_tasks import predicted_task, range_stage, range_task, speeds_of
from gaitval.study.report_stages import metrics_of, page_files, report_stage, validate_stage
from gaitval.study.run import choose_start
from gaitval.study.scaling_stages import reference_stage, scale_stage
from gaitval.study.stage import Run, Stage, run_stage
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.study.unread import say_unread
from gaitval.study.walking_stages import repeat_stage, save_correction, simulate_stage

FIRST: Final = "rounds/1"
"""Folder of a prediction in which it is found whether the general policy needs training."""


def train_range_stage(run: Run) -> Stage:
    """References of the range of `run` → one policy for all of them, from the general policy."""
    speeds = speeds_of(run)
    folder = run.folder / "trained"
    start = "start" if (run.folder / "start").exists() else None

    def train() -> None:
        from gaitval.policy.storage import save_policy

        tasks = [range_task(run, name) for name in speeds]
        samples = run.configuration.training.samples_from("range" if start else "scratch")
        save_policy(learned(run, tasks, start, folder, samples), folder)

    return Stage(
        "train-range",
        train,
        version=STAGE_VERSIONS["train"],
        inputs=(
            "model.urdf",
            *speeds,
            *(f"{start}/{name}" for name in POLICY_FILES if start),
            *need_files(run, ""),
        ),
        outputs=tuple(f"trained/{name}" for name in (*POLICY_FILES, "training.csv")),
        values=run.sections(*LEARNING_SECTIONS, "training"),
        workspace="trained",
    )


def run_range(run: Run, *, force: bool = False) -> None:
    """Make the policy of the range of the person of `run`; with `force`, every stage runs again."""
    stages = (reference_stage(run), train_range_stage(run), predicted_correction_stage(run))
    walks = (predicted_walk_stage(run), compare_stage(run))
    say_unread(run, (*stages, *walks), "general")
    run_stage(scale_stage(run), run.folder, force=force, observer=run.observer)
    run_stage(range_stage(run), run.folder, force=force, observer=run.observer)
    # the stage is made again below, because its inputs depend on whether there is a start
    choose_start(run, train_range_stage(run))
    speeds = speeds_of(run)
    learning = need_stage(run, 1, speeds), train_range_stage(run), hand_on_stage(run, 1, speeds)
    for stage in learning:
        run_stage(stage, run.folder, force=force, observer=run.observer)


def adopt_stage(run: Run, source: Path) -> Stage:
    """The policy in the folder `source`, of a range or of a round, for a prediction `run`."""
    names = (*POLICY_FILES, GAIN)
    # a round keeps the log of its training where it trained
    log = source / ("trained" if source.parent.name == "rounds" else "policy")

    def adopt() -> None:
        copy_files(source / "policy", run.folder / "policy", names)
        copy_files(log, run.folder / "policy", ("training.csv",))

    from gaitval._internal.io.artefacts import file_hash

    return Stage(
        "adopt",
        adopt,
        version=STAGE_VERSIONS["adopt"],
        inputs=(),
        outputs=tuple(f"policy/{name}" for name in (*names, "training.csv")),
        # the files may be outside this run folder, so they count as values, not inputs
        values={
            "policy": [
                *(file_hash(source / "policy" / name) for name in names),
                file_hash(log / "training.csv"),
            ]
        },
    )


def predicted_correction_stage(run: Run) -> Stage:
    """Reference and policy of `run` → the share of the policy's action bias to remove, and the
    change of the reference with which the walk is nearest to the predicted curves. Neither reads a
    record at this speed.
    """

    def correct_walk() -> None:
        from gaitval.correction.centring import centred
        from gaitval.correction.correct import CORRECTION, correct
        from gaitval.correction.walked import PREDICTED
        from gaitval.model.parameters import nominal_parameters

        task, policy = walking_task(run), stored_policy(run, run.folder / "policy")
        mu = nominal_parameters()
        # a policy that has learned a range is more biased at some speeds than at others
        share = task.configuration.environment.centring
        if policy.about["samples"]:
            share = centred(task, policy, mu)
            run.observer.say(f"{share:g} of the policy's action bias is removed at this speed.")
        task = task.with_environment(centring=share)
        result = correct(
            task,
            policy,
            mu,
            target_record=task.record,
            to_record=CORRECTION.to_prediction,
            accuracies=PREDICTED,
            freedom=CORRECTION.towards_prediction,
            on_progress=run.observer.progress,
        )
        write_json(run.folder / CENTRING, {"centring": share})
        save_correction(run, result)

    return Stage(
        "correct",
        correct_walk,
        version=STAGE_VERSIONS["correct"],
        inputs=("model.urdf", "reference.npz", *(f"policy/{name}" for name in POLICY_FILES)),
        outputs=(CENTRING, "correction.json", STARTS),
        values=run.sections(*SIMULATION_SECTIONS, "correction", "validation"),
    )


def predicted_walk_stage(run: Run) -> Stage:
    """Reference, correction and policy of `run` → walks from every start phase."""

    def walk() -> None:
        from gaitval.metrics.cycles import find_cycles
        from gaitval.metrics.results import StoredStarts, StoredWalks
        from gaitval.metrics.rollouts import roll_out_from
        from gaitval.metrics.torque_shares import torque_shares
        from gaitval.policy.rollouts import RolloutPool

        task, mu = predicted_task(run)
        policy = stored_policy(run, run.folder / "policy")
        starts = stored(run, STARTS, StoredStarts).starts
        with RolloutPool(task, workers=1) as pool:
            walks = roll_out_from(pool, policy, mu, starts)
        walks.compared.save(run.folder / ROLLOUTS["nominal"])
        cycles = run.configuration.validation.cycles
        found = find_cycles(walks.compared, run.configuration).first(cycles)
        result = StoredWalks(
            centring=task.configuration.environment.centring,
            nominal=list(walks.starts),
            torque_shares=torque_shares(walks.compared, found, task),
        )
        write_json(run.folder / WALKS, result.as_dict())

    correction = predicted_correction_stage(run)
    return replace(
        simulate_stage(run),
        run=walk,
        inputs=(*correction.inputs, *correction.outputs),
        outputs=(ROLLOUTS["nominal"], WALKS),
    )


def compare_stage(run: Run) -> Stage:
    """Predicted walks of `run` against the held-out record → metrics.json. Without a record, the
    distance from the prediction, and the errors of predictions of held-out trials.
    """

    def compare() -> None:
        write_json(run.folder / METRICS, metrics_of(run, pushes=None).as_dict())

    return replace(
        validate_stage(run),
        run=compare,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            "correction.json",
            ROLLOUTS["nominal"],
            WALKS,
            REPEATS,
            f"policy/{GAIN}",
        ),
    )


def predicted_report_stage(run: Run) -> Stage:
    """Everything in the prediction folder of `run` → report.html, -details.html and report.pdf."""
    return replace(
        report_stage(run),
        inputs=(
            "subject.toml",
            "configuration.toml",
            "model.urdf",
            "scaling.csv",
            "reference.npz",
            "policy/training.csv",
            "metrics.json",
            ROLLOUTS["nominal"],
        ),
        outputs=page_files(run),
    )


def untrained(run: Run, *, force: bool = False) -> bool:
    """Whether the general policy walks the reference of the prediction `run` without training; if
    so, it is left in the folder of its first round.
    """
    choose_start(run, train_stage(run, 1))
    run_stage(need_stage(run, 1), run.folder, force=force, observer=run.observer)
    if (
        run.configuration.training.samples != "auto"
        or read_json(run.folder / FIRST / NEED)["needed"]
    ):
        return False
    for stage in (train_stage(run, 1), hand_on_stage(run, 1)):
        run_stage(stage, run.folder, force=force, observer=run.observer)
    return True


def run_prediction(run: Run, of_range: Run, *, force: bool = False) -> None:
    """The walk of `run` at one speed, with the general policy, or where that needs training with
    the one of the range `of_range`, which is trained first if it is not there; with `force`, every
    stage again.
    """
    for stage in (scale_stage(run), reference_stage(run)):
        run_stage(stage, run.folder, force=force, observer=run.observer)
    source = run.folder / FIRST
    if not untrained(run, force=force):
        run_range(of_range, force=force)
        source = of_range.folder
    for stage in (
        adopt_stage(run, source),
        predicted_correction_stage(run),
        predicted_walk_stage(run),
        repeat_stage(run, predicted=True),
        compare_stage(run),
        predicted_report_stage(run),
    ):
        run_stage(stage, run.folder, force=force, observer=run.observer)
