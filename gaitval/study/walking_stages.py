"""The stages that walk with the policy: the correction of the reference, the compared walks, those
from other starts, and the pushes.
"""

from functools import partial
from typing import TYPE_CHECKING

from gaitval._internal.io.artefacts import write_json
from gaitval.metrics.results import Endurance, StoredPushes, StoredStarts, StoredWalks
from gaitval.model.urdf import read_urdf
from gaitval.policy.processes import kept_workers
from gaitval.study.inputs import (
    CENTRING,
    IDENTIFIED,
    POLICY_FILES,
    PUSHED,
    REPEATS,
    ROLLOUTS,
    SECOND_ENGINE,
    SIMULATION_SECTIONS,
    STARTS,
    WALKER,
    WALKS,
    body_parameters,
    identified_task,
    stored,
    stored_policy,
    target_record,
    validated_task,
    walking_task,
)
from gaitval.study.stage import Run, Stage
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.subjects.subject_file import builtin_subjects

if TYPE_CHECKING:
    from gaitval.correction.correct import Corrected


def correct_stage(run: Run) -> Stage:
    """Policy and mu of `run` → the change of the reference with which the walk is most like it."""

    def correct() -> None:
        from gaitval.correction.correct import CORRECTION, correct

        kept_workers()  # they start while this process reads
        mu = body_parameters(run.folder / "identification.json")
        result = correct(
            identified_task(run, mu),
            stored_policy(run, run.folder / "policy"),
            mu,
            target_record=target_record(run).record,
            to_record=CORRECTION.to_estimate if run.knew_no_kinetics else CORRECTION.to_record,
            on_progress=run.observer.progress,
        )
        save_correction(run, result)

    return Stage(
        "correct",
        correct,
        version=STAGE_VERSIONS["correct"],
        inputs=("subject.toml", *WALKER),
        outputs=("correction.json", STARTS),
        values={
            **run.sections(*SIMULATION_SECTIONS, "correction", "record", "validation"),
        },
    )


def save_correction(run: Run, found: "Corrected") -> None:
    """Write what was `found` into the folder of `run`: the correction, and its long walks."""
    write_json(run.folder / "correction.json", found.result().as_dict())
    write_json(run.folder / STARTS, StoredStarts(starts=list(found.starts)).as_dict())


def simulate_stage(run: Run, *, second_engine: bool = True) -> Stage:
    """Policy, mu and correction of `run` → rollouts of the deterministic policy without pushes.

    The identified body with the corrected reference walks the compared cycles, from the first start
    phase, and for comparison the nominal body with the uncorrected reference. With `second_engine`,
    so does the identified body in MuJoCo.
    """
    validation = run.configuration.validation

    def simulate() -> None:
        from gaitval.metrics.cycles import find_cycles
        from gaitval.metrics.rollouts import roll_out_from, started_walk
        from gaitval.metrics.torque_shares import torque_shares
        from gaitval.policy.rollouts import RolloutPool

        policy = stored_policy(run, run.folder / "policy")
        nominal = body_parameters(run.folder / "identification.json", "nominal")
        task, mu = validated_task(run)
        starts = stored(run, STARTS, StoredStarts).starts
        second: Endurance | None = None
        with RolloutPool(task, workers=run.configuration.training.workers) as pool:
            begin = partial(started_walk, policy=policy, phase=starts[0].start_phase)
            # They are the first that the workers take up.
            in_mujoco = begin(pool, mu=mu, engine="mujoco") if second_engine else None
            before = begin(pool.with_task(walking_task(run)), mu=nominal, engine="compiled")
            walks = roll_out_from(pool, policy, mu, starts)
            if in_mujoco is not None:
                second, rollout = in_mujoco()
                rollout.save(run.folder / SECOND_ENGINE)
            went, rollout = before()
        rollout.save(run.folder / ROLLOUTS["nominal"])
        walks.compared.save(run.folder / ROLLOUTS["identified"])
        found = find_cycles(walks.compared, run.configuration).first(validation.cycles)
        result = StoredWalks(
            nominal=[went],
            identified=list(walks.starts),
            second_engine=second,
            torque_shares=torque_shares(walks.compared, found, task),
        )
        write_json(run.folder / WALKS, result.as_dict())

    return Stage(
        "simulate",
        simulate,
        version=STAGE_VERSIONS["simulate"],
        inputs=(*WALKER, "correction.json", STARTS),
        outputs=(*ROLLOUTS.values(), *([SECOND_ENGINE] if second_engine else []), WALKS),
        values={
            **run.sections(*SIMULATION_SECTIONS),
            "walks": validation.model_dump(mode="json", exclude={"filter_frequency"}),
        },
    )


def repeat_stage(run: Run, *, predicted: bool = False) -> Stage:
    """Policy and body of `run` → measures of walks from every start phase with noise. A run that is
    `predicted` has the body as scaled and its own share of action bias removed.
    """

    def repeat() -> None:
        from gaitval.metrics.comparator import compared_with
        from gaitval.metrics.repeats import repeated_walks

        if predicted:
            from gaitval.study.predicted_tasks import predicted_task

            task, mu = predicted_task(run)
        else:
            task, mu = validated_task(run)
        subject, record = run.compared()
        model = read_urdf(run.folder / "model.urdf")
        of = compared_with(subject, record, builtin_subjects(), model, run.configuration)
        walks = repeated_walks(task, stored_policy(run, run.folder / "policy"), mu, of)
        write_json(run.folder / REPEATS, [each.as_dict() for each in walks])

    validation = run.configuration.validation
    return Stage(
        "repeat",
        repeat,
        version=STAGE_VERSIONS["repeat"],
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            *((CENTRING,) if predicted else (IDENTIFIED, "identification.json")),
            "correction.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=(REPEATS,),
        values={
            **run.sections(*SIMULATION_SECTIONS, "record"),
            "walks": validation.model_dump(mode="json", exclude={"consecutive_cycles"}),
        },
    )


def push_stage(run: Run) -> Stage:
    """Policy and mu of `run` → which pushes the identified body survives."""
    validation = run.configuration.validation

    def push() -> None:
        from gaitval.metrics.push_recovery import push_recovery, pushed_walks
        from gaitval.metrics.pushed_steps import placed_feet

        task, mu = validated_task(run)
        policy = stored_policy(run, run.folder / "policy")
        recovery, traces = push_recovery(
            task,
            policy,
            mu,
            on_progress=run.observer.progress,
        )
        found = StoredPushes(
            recovery=recovery,
            traces=[each.stored() for each in traces],
            placed=placed_feet(task, policy, mu),
        )
        write_json(run.folder / "push.json", found.as_dict())
        for name, walk in zip(PUSHED, pushed_walks(task, policy, mu), strict=True):
            walk.save(run.folder / name)

    return Stage(
        "push",
        push,
        version=STAGE_VERSIONS["push"],
        inputs=(*WALKER, "correction.json"),
        outputs=("push.json", *PUSHED),
        values={
            **run.sections(*SIMULATION_SECTIONS, "pushes"),
            "settling_cycles": validation.settling_cycles,
        },
    )
