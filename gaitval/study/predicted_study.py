"""A person at an unrecorded speed: one policy for the range, and a walk at each speed.

The range's run folder holds a policy that learned to walk at several speeds, whose references are
predicted from the given trials. Every prediction is a run folder inside it that uses this policy:
it takes a reference and a few walks, but no training.
"""

from dataclasses import replace
from pathlib import Path

from gaitval.artefacts import copy_files, write_json
from gaitval.errors import ConfigurationError
from gaitval.study.inputs import (
    GAIN,
    METRICS,
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
)
from gaitval.study.predicted_tasks import predicted_task, range_stage, range_task, speeds_of
from gaitval.study.report_stages import metrics_of, report_stage, validate_stage
from gaitval.study.run import choose_start
from gaitval.study.scaling_stages import reference_stage, scale_stage
from gaitval.study.stage import Run, Stage, run_stage
from gaitval.study.unread import say_unread
from gaitval.study.walking_stages import repeat_stage, save_correction, simulate_stage


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
    """The policy of the range in the folder `source`, for a prediction `run`."""
    names = (*POLICY_FILES, "training.csv", GAIN)

    def adopt() -> None:
        copy_files(source / "policy", run.folder / "policy", names)

    from gaitval.artefacts import file_hash

    return Stage(
        "adopt",
        adopt,
        inputs=(),
        outputs=tuple(f"policy/{name}" for name in names),
        # the files are outside this run folder, so they count as values, not inputs
        values={"policy": [file_hash(source / "policy" / name) for name in names]},
    )


def predicted_correction_stage(run: Run) -> Stage:
    """Reference and policy of `run` → the share of the policy's action bias to remove, and the
    change of the reference with which the walk is nearest to it. Neither reads a record.
    """

    def correct_walk() -> None:
        from gaitval.learning_control.centring import centred
        from gaitval.learning_control.correct import correct
        from gaitval.model.parameters import nominal_parameters

        task, policy = walking_task(run), stored_policy(run, run.folder / "policy")
        mu = nominal_parameters()
        share = centred(task, policy, mu)
        run.observer.say(f"{share:g} of the policy's action bias is removed at this speed.")
        task = task.with_environment(centring=share)
        result = correct(task, policy, mu, on_progress=run.observer.progress)
        write_json(run.folder / "centring.json", {"centring": share})
        save_correction(run, result)

    return Stage(
        "correct",
        correct_walk,
        inputs=("model.urdf", "reference.npz", *(f"policy/{name}" for name in POLICY_FILES)),
        outputs=("centring.json", "correction.json", STARTS),
        values=run.sections(*SIMULATION_SECTIONS, "correction", "validation"),
    )


def predicted_walk_stage(run: Run) -> Stage:
    """Reference, correction and policy of `run` → walks from every start phase."""

    def walk() -> None:
        from gaitval.metrics.cycles import find_cycles
        from gaitval.metrics.rollouts import roll_out_from
        from gaitval.metrics.torque_shares import torque_shares
        from gaitval.metrics.walk_results import StoredStarts, StoredWalks
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
        outputs=("report.html", "report-details.html", "report.pdf"),
    )


def run_prediction(run: Run, range_folder: Path, *, force: bool = False) -> None:
    """The walk of `run` at one speed with the policy of `range_folder`; with `force`, every stage
    again. Raises ConfigurationError without that policy.
    """
    if not (range_folder / "policy" / POLICY_FILES[0]).is_file():
        raise ConfigurationError(f"{range_folder}: there is no policy of a range yet.")
    for stage in (
        scale_stage(run),
        reference_stage(run),
        adopt_stage(run, range_folder),
        predicted_correction_stage(run),
        predicted_walk_stage(run),
        repeat_stage(run, predicted=True),
        compare_stage(run),
        predicted_report_stage(run),
    ):
        run_stage(stage, run.folder, force=force, observer=run.observer)
