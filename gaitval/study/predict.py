"""A person at a speed that was not recorded: one policy for the range, and a walk at each speed.

The range's run folder holds a policy that learned to walk at several speeds, whose references are
predicted from the trials that are told. Every prediction is a run folder inside it, with that
policy: it costs a reference and a few walks, and no training.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.artefacts import read_json, write_json
from gaitval.errors import ConfigurationError
from gaitval.journal import Journal
from gaitval.study.inputs import (
    GAIN,
    POLICY_FILES,
    REPEATS,
    ROLLOUTS,
    UNFINISHED,
    WALKS,
    copy_files,
    corrected_task,
    range_task,
    start_policy,
    stored_policy,
    walking_task,
)
from gaitval.study.run import choose_start
from gaitval.study.stage import Run, Stage, run_stage
from gaitval.study.stages import (
    LEARNING_SECTIONS,
    SIMULATION_SECTIONS,
    hand_on,
    hand_on_values,
    reference_stage,
    repeat_values,
    scale_stage,
    walk_again,
)
from gaitval.study.unread import say_unread

SPEEDS: Final = 6
"""Speeds that the policy of a range learns at."""

WIDEST: Final = 0.4
"""They reach this share below the slowest and above the fastest trial that is told."""


def range_speeds(told: Sequence[float]) -> list[float]:
    """The speeds that a policy learns at, m/s, if these were walked."""
    ends = (1.0 - WIDEST) * min(told), (1.0 + WIDEST) * max(told)
    return [round(float(speed), 4) for speed in np.geomspace(*ends, SPEEDS)]


def _references(speeds: Sequence[float]) -> tuple[str, ...]:
    return tuple(f"range/{index}.npz" for index in range(len(speeds)))


def range_stage(run: Run) -> Stage:
    """Told trials → reference motions at all speeds of the range."""
    speeds = _speeds(run)

    def build() -> None:
        from gaitval.model.urdf import read_urdf
        from gaitval.reference.dynamic_fit import consistent_reference

        model = read_urdf(run.folder / "model.urdf")
        for done, (speed, name) in enumerate(zip(speeds, _references(speeds), strict=True)):
            run.observer.progress({"samples": done, "total": len(speeds)})
            told = run.told(speed=speed)
            consistent_reference(told.record, model, run.configuration.contact, told.accuracy).save(
                run.folder / name
            )

    return Stage(
        "range",
        build,
        inputs=("subject.toml", "model.urdf"),
        outputs=_references(speeds),
        values={**run.sections("contact", "record"), "speeds": speeds},
    )


def _speeds(run: Run) -> list[float]:
    from gaitval.prediction.speed import trials_told

    holdout = run.configuration.record.holdout or None
    return range_speeds([t.walking_speed_m_s for t in trials_told(run.subject, holdout)])


def train_range_stage(run: Run) -> Stage:
    """References of the range → one policy for all of them, from the general policy."""
    speeds = _speeds(run)
    start = run.folder / "start"
    earlier = [f"start/{name}" for name in POLICY_FILES] if start.exists() else []
    training = run.configuration.training

    def train() -> None:
        from gaitval.policy.storage import save_policy
        from gaitval.policy.training import train

        first, *rest = [range_task(run, name) for name in _references(speeds)]
        policy = train(
            first,
            run.folder / "trained",
            also=rest,
            samples=training.samples_from("range" if earlier else "scratch"),
            start=start_policy(run, start) if earlier else None,
            subject=run.subject.identifier,
            on_progress=run.observer.progress,
        )
        save_policy(policy, run.folder / "trained")

    return Stage(
        "train-range",
        train,
        inputs=("model.urdf", *_references(speeds), *earlier),
        outputs=tuple(f"trained/{name}" for name in (*POLICY_FILES, "training.csv")),
        values=run.sections(*LEARNING_SECTIONS, "training"),
        workspace="trained",
    )


def hand_on_range_stage(run: Run) -> Stage:
    """Start and trained policy of the range → the better one, and what the training gave."""
    speeds = _speeds(run)
    start = run.folder / "start"
    earlier = [f"start/{name}" for name in POLICY_FILES] if start.exists() else []

    def decide() -> None:
        tasks = [range_task(run, name) for name in _references(speeds)]
        hand_on(run, tasks, start_policy(run, start) if earlier else None, "trained", "policy")
        copy_files(run.folder / "trained", run.folder / "policy", ("training.csv",))

    return Stage(
        "keep-range",
        decide,
        inputs=(
            "subject.toml",
            "model.urdf",
            *_references(speeds),
            *earlier,
            *(f"trained/{name}" for name in (*POLICY_FILES, "training.csv")),
        ),
        outputs=tuple(f"policy/{name}" for name in (*POLICY_FILES, "training.csv", GAIN)),
        values={**hand_on_values(run), **run.sections("record"), "speeds": speeds},
    )


def run_range(run: Run, *, force: bool = False) -> None:
    """The policy of a person's range."""
    stages = (reference_stage(run), train_range_stage(run), predicted_correction_stage(run))
    walks = (predicted_walk_stage(run), compare_stage(run))
    say_unread(run, (*stages, *walks), "general", ("correction.rounds",))
    run_stage(scale_stage(run), run.folder, force=force, observer=run.observer)
    run_stage(range_stage(run), run.folder, force=force, observer=run.observer)
    choose_start(run, train_range_stage(run))
    run_stage(train_range_stage(run), run.folder, force=force, observer=run.observer)
    run_stage(hand_on_range_stage(run), run.folder, force=force, observer=run.observer)


def adopt_stage(run: Run, source: Path) -> Stage:
    """The policy of the range, for a prediction's folder."""
    names = (*POLICY_FILES, "training.csv", GAIN)

    def adopt() -> None:
        copy_files(source / "policy", run.folder / "policy", names)

    from gaitval.artefacts import file_hash

    return Stage(
        "adopt",
        adopt,
        inputs=(),
        outputs=tuple(f"policy/{name}" for name in names),
        values={"policy": [file_hash(source / "policy" / name) for name in names]},
    )


def predicted_correction_stage(run: Run) -> Stage:
    """Reference and policy → how much of the policy's habit to take away, and the change of the
    reference with which it walks most like it. Neither reads a record.
    """

    def correct_walk() -> None:
        from gaitval.learning_control.correct import correct
        from gaitval.metrics.habit import centred, with_centring
        from gaitval.model.parameters import nominal_parameters

        task, policy = walking_task(run), stored_policy(run, run.folder / "policy")
        mu = nominal_parameters()
        share = centred(task, policy, mu)
        run.observer.say(f"{share:g} of the policy's habit is taken away at this speed.")
        task = with_centring(task, share)
        rounds = run.configuration.correction.range_rounds
        result = correct(
            task,
            policy,
            mu,
            rounds=rounds,
            journal=Journal(run.folder / UNFINISHED["correct"] / "walks.jsonl"),
            on_progress=run.observer.progress,
        )
        write_json(run.folder / "centring.json", {"centring": share})
        write_json(run.folder / "correction.json", result.as_dict())

    return Stage(
        "correct",
        correct_walk,
        inputs=("model.urdf", "reference.npz", *(f"policy/{name}" for name in POLICY_FILES)),
        outputs=("centring.json", "correction.json"),
        values={
            **run.sections(*SIMULATION_SECTIONS, "correction"),
            "walks": run.configuration.validation.model_dump(
                mode="json", exclude={"consecutive_cycles"}
            ),
        },
        workspace=UNFINISHED["correct"],
        emptied=True,
    )


def predicted_walk_stage(run: Run) -> Stage:
    """Reference, correction and policy → walks from every start phase."""
    validation = run.configuration.validation

    def walk() -> None:
        from gaitval.metrics.cycles import find_cycles
        from gaitval.metrics.habit import with_centring
        from gaitval.metrics.rollouts import roll_out_from
        from gaitval.metrics.torque_shares import torque_shares
        from gaitval.model.parameters import nominal_parameters
        from gaitval.policy.rollouts import RolloutPool

        share = read_json(run.folder / "centring.json")["centring"]
        task = with_centring(corrected_task(run), share)
        policy, mu = stored_policy(run, run.folder / "policy"), nominal_parameters()
        workers = min(run.configuration.training.workers, len(validation.start_phases))
        with RolloutPool(task, workers=workers, engine="dart") as pool:
            walks = roll_out_from(
                pool,
                policy,
                mu,
                validation.start_phases,
                cycles=validation.settling_cycles + validation.consecutive_cycles,
                workspace=run.folder / UNFINISHED["simulate"],
            )
        walks.compared.save(run.folder / ROLLOUTS["nominal"])
        found = find_cycles(walks.compared, run.configuration).first(validation.cycles)
        write_json(
            run.folder / WALKS,
            {
                "centring": share,
                "nominal": [went.as_dict() for went in walks.starts],
                "torque_shares": torque_shares(walks.compared, found, task),
            },
        )

    return Stage(
        "simulate",
        walk,
        inputs=(
            "model.urdf",
            "reference.npz",
            "centring.json",
            "correction.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=(ROLLOUTS["nominal"], WALKS),
        values={
            **run.sections(*SIMULATION_SECTIONS),
            "walks": validation.model_dump(mode="json", exclude={"filter_frequency"}),
        },
        workspace=UNFINISHED["simulate"],
        emptied=True,
    )


def predicted_repeat_stage(run: Run) -> Stage:
    """Reference, correction and policy → what is measured of walks with noise."""

    def repeat() -> None:
        from gaitval.metrics.habit import with_centring
        from gaitval.model.parameters import nominal_parameters

        share = read_json(run.folder / "centring.json")["centring"]
        walk_again(run, with_centring(corrected_task(run), share), nominal_parameters())

    return Stage(
        "repeat",
        repeat,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            "centring.json",
            "correction.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=(REPEATS,),
        values=repeat_values(run),
    )


def compare_stage(run: Run) -> Stage:
    """Predicted walks against the record that the run was not told → metrics.json. Where there is
    no record, the distance from the prediction, and how wrong predictions of held-out trials are.
    """
    from gaitval.metrics.results import SCHEMA_VERSION

    def compare() -> None:
        from gaitval.datasets.subject_file import builtin_subjects
        from gaitval.metrics.held_out import prediction_errors
        from gaitval.metrics.rollouts import Endurance, Rollouts
        from gaitval.metrics.validation import validate
        from gaitval.model.urdf import read_urdf
        from gaitval.prediction.told import is_unrecorded
        from gaitval.simulation.rollout import Rollout

        went = read_json(run.folder / WALKS)
        subject, record = run.compared()
        settings, people = run.configuration.record, builtin_subjects()
        walks = Rollouts(
            Rollout.load(run.folder / ROLLOUTS["nominal"]),
            tuple(Endurance.from_dict(each) for each in went["nominal"]),
        )
        model = read_urdf(run.folder / "model.urdf")
        metrics = validate(
            subject,
            record,
            model,
            walks,
            None,
            run.configuration,
            others=people,
            torque_shares=went["torque_shares"],
            prediction_errors=prediction_errors(run.subject, settings, people)
            if is_unrecorded(settings)
            else None,
            correction=read_json(run.folder / "correction.json"),
            centring=went["centring"],
            repeats=read_json(run.folder / REPEATS),
            training=read_json(run.folder / f"policy/{GAIN}"),
        )
        write_json(run.folder / "metrics.json", metrics)

    return Stage(
        "validate",
        compare,
        inputs=(
            "subject.toml",
            "model.urdf",
            "correction.json",
            ROLLOUTS["nominal"],
            WALKS,
            REPEATS,
            f"policy/{GAIN}",
        ),
        outputs=("metrics.json",),
        values={
            **run.sections("seed", "record", "contact", "validation"),
            "schema_version": SCHEMA_VERSION,
        },
    )


def predicted_report_stage(run: Run) -> Stage:
    """Everything in the prediction's folder → report.html and report.pdf."""

    def report() -> None:
        from gaitval.reporting.report import write_report

        write_report(run.folder)

    return Stage(
        "report",
        report,
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
        outputs=("report.html", "report.pdf"),
    )


def run_prediction(run: Run, range_folder: Path, *, force: bool = False) -> None:
    """The walk at one speed with the policy of `range_folder`."""
    if not (range_folder / "policy" / POLICY_FILES[0]).is_file():
        raise ConfigurationError(f"{range_folder}: there is no policy of a range yet.")
    for stage in (
        scale_stage(run),
        reference_stage(run),
        adopt_stage(run, range_folder),
        predicted_correction_stage(run),
        predicted_walk_stage(run),
        predicted_repeat_stage(run),
        compare_stage(run),
        predicted_report_stage(run),
    ):
        run_stage(stage, run.folder, force=force, observer=run.observer)
