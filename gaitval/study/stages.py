"""The stages of a run, from scaling to the report, each as a `Stage`.

It is long because every stage is here, in order, with what it reads and writes.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import chain, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitval import file_gate
from gaitval.artefacts import copy_file, copy_files, read_json, replacing, value_hash, write_json
from gaitval.datasets.subject_file import builtin_subjects
from gaitval.errors import ArtefactError
from gaitval.identification.prior import prior_sd
from gaitval.journal import Journal
from gaitval.metrics.identified_body import identified_model
from gaitval.metrics.walk_results import (
    Endurance,
    Repeat,
    StoredPushes,
    StoredStarts,
    StoredWalks,
)
from gaitval.model.parameters import nominal_parameters
from gaitval.model.urdf import read_urdf
from gaitval.policy.processes import kept_workers
from gaitval.study import body_stage
from gaitval.study.inputs import (
    GAIN,
    IDENTIFIED,
    METRICS,
    NEED,
    POLICY_FILES,
    PUSHED,
    REPEATS,
    ROLLOUTS,
    STANDING,
    STARTS,
    UNFINISHED,
    WALKER,
    WALKS,
    WITNESS,
    asked,
    body_parameters,
    identified_task,
    start_kind,
    start_policy,
    stored,
    stored_policy,
    validated_task,
    walking_task,
)
from gaitval.study.stage import Run, Stage

if TYPE_CHECKING:
    from gaitval.arrays import Array
    from gaitval.configuration import Start
    from gaitval.learning_control.correct import Corrected
    from gaitval.metrics.results import FoundParameters, Metrics
    from gaitval.metrics.round_errors import RoundErrors
    from gaitval.metrics.walk_results import PushRecovery
    from gaitval.model.body import BodyModel
    from gaitval.policy.storage import Policy
    from gaitval.reference.motion import ReferenceMotion
    from gaitval.simulation.walker import WalkingTask

SIMULATION_SECTIONS = ("seed", "contact", "servo", "environment")
LEARNING_SECTIONS = (*SIMULATION_SECTIONS, "reward", "randomisation")


def scale_stage(run: Run) -> Stage:
    """Subject of `run` → body model."""

    def scale() -> None:
        from gaitval.model.urdf import write_urdf
        from gaitval.scaling.scaling import scale_subject

        if run.subject.guessed:
            run.observer.say(
                f"{run.subject.identifier}: who it is was not given; assumed: "
                f"{run.subject.guessed}. Subjects with both in common count as one person: say "
                "who it is with person and laboratory in the subject's file."
            )
        from gaitval.identification.unusual import remarks_before_scaling

        for remark in remarks_before_scaling(run.subject, run.configuration, run.told().record):
            run.observer.say(remark)
        body = scale_subject(run.subject, symmetric=run.configuration.scaling.symmetric)
        write_urdf(body.model, run.folder / "model.urdf")
        body.write_table(run.folder / "scaling.csv")

    return Stage(
        "scale",
        scale,
        inputs=("subject.toml",),
        outputs=("model.urdf", "scaling.csv"),
        values=run.sections("scaling"),
    )


def reference_stage(run: Run) -> Stage:
    """Recorded gait and body model of `run` → reference motion."""

    def build() -> None:
        from gaitval.identification.unusual import remarks_on_gait

        for remark in remarks_on_gait(run.subject, builtin_subjects()):
            run.observer.say(remark)
        model = read_urdf(run.folder / "model.urdf")
        _reference_of(run, model).save(run.folder / "reference.npz")

    return Stage(
        "reference",
        build,
        inputs=("subject.toml", "model.urdf"),
        outputs=("reference.npz",),
        values=run.sections("contact", "record"),
    )


def _reference_of(
    run: Run, body: "BodyModel", near: "ReferenceMotion | None" = None
) -> "ReferenceMotion":
    """The motion of `body` to walk; that of a similar body is `near`."""
    from gaitval.reference.dynamic_fit import consistent_reference

    record, accuracy = asked(run)
    return consistent_reference(record, body, run.configuration.contact, accuracy, near)


def _start_of(run: Run, round_number: int) -> str | None:
    """Folder of the policy that a round's training starts from; None for nothing."""
    if round_number > 1:
        return f"rounds/{round_number - 1}/policy"
    return "start" if (run.folder / "start").exists() else None


def _before_training(run: Run, round_number: int) -> list[str]:
    """Files of the start of a round's training, and of what is trained."""
    start, before = _start_of(run, round_number), f"rounds/{round_number - 1}"
    files = [] if start is None else [f"{start}/{name}" for name in POLICY_FILES]
    if round_number > 1:
        found = ("identification/identification.json", f"identification/{IDENTIFIED}")
        files += [f"{before}/{name}" for name in (*found, "epsilon.json")]
    return files


def _trained_task(run: Run, round_number: int) -> "WalkingTask":
    """Later rounds train for the identified body, if the record supports it."""
    before = f"rounds/{round_number - 1}"
    if round_number == 1 or not round_errors(run, round_number - 1).supported:
        return walking_task(run)
    found = read_json(run.folder / f"{before}/identification/identification.json")
    return identified_task(run, np.array(found["identified"]), f"{before}/identification")


def learned(
    run: Run, tasks: "Sequence[WalkingTask]", start: str | None, folder: Path, samples: int
) -> "Policy":
    """The policy of `run` for `tasks`: what is in its folder `start`, if that needs no training, or
    what is trained from it, or from nothing, over so many `samples` in `folder`.
    """
    subject, scaled = run.subject.identifier, read_urdf(run.folder / "model.urdf")
    policy = None if start is None else start_policy(run, run.folder / start)
    if policy is not None and not _trains(run, folder.parent):
        from gaitval.policy.storage import Policy, description, of_body
        from gaitval.policy.training_log import write_log

        write_log(folder / "training.csv", [])
        about = description(run.configuration, of_body(scaled, subject), 0)
        return Policy(policy.tensors, about)
    from gaitval.policy.training import train

    first, *rest = tasks
    return train(
        first, folder, also=rest, samples=samples, start=policy, subject=subject, scaled=scaled,
        on_progress=run.observer.progress,
    )  # fmt: skip


def _asked(run: Run) -> bool:
    """Whether training is asked for, needed or not."""
    return run.configuration.training.samples != "auto"


def _trains(run: Run, folder: Path) -> bool:
    """Whether a training of `run` is made, by what was found of its need in `folder`."""
    return _asked(run) or bool(read_json(folder / NEED)["needed"])


def need_files(run: Run, here: str) -> list[str]:
    """What a training of `run` reads about its need, in the sub-folder `here`: nothing if it is
    asked for, so that what measures the need does not matter to it.
    """
    return [] if _asked(run) else [f"{here}{NEED}"]


def need_stage(run: Run, round_number: int, speeds: Mapping[str, float] | None = None) -> Stage:
    """The policy that training in the round `round_number` of `run`, or of a range, starts from →
    how it walks, and whether it needs training. A range has `speeds`, as in `hand_on_stage`.
    """
    here, start = _place_of(round_number, speeds), _start_of(run, round_number)

    def compare() -> None:
        from gaitval.metrics.policy_comparison import push_limit, standing_of

        found = None
        if start is not None:
            tasks = _tasks_of(run, round_number, speeds)
            policy = start_policy(run, run.folder / start)
            found = standing_of(tasks, policy, _body_of(tasks[0]))
        needed = found is None or found.needs_training(push_limit())
        write_json(run.folder / here / STANDING, {"start": found and found.as_dict()})
        write_json(run.folder / here / NEED, {"needed": needed})
        if not (needed or _asked(run)):
            run.observer.say(
                "This person needs no training: the policy walks without a fall and stands the "
                "pushes (training.samples=full trains all the same)."
            )

    return Stage(
        "need-range" if speeds else f"need-{round_number}",
        compare,
        inputs=("subject.toml", *_compared(run, round_number, speeds)),
        outputs=(f"{here}{STANDING}", f"{here}{NEED}"),
        values=_comparing(run, speeds),
    )


def _place_of(round_number: int, speeds: Mapping[str, float] | None) -> str:
    """Sub-folder of a run's folder for what a round, or a range of `speeds`, learns."""
    return "" if speeds else f"rounds/{round_number}/"


def _tasks_of(
    run: Run, round_number: int, speeds: Mapping[str, float] | None
) -> "list[WalkingTask]":
    """What is learned in a round of `run`, or in a range of `speeds` as in `hand_on_stage`."""
    if not speeds:
        return [_trained_task(run, round_number)]
    from gaitval.study.predicted_tasks import range_task

    return [range_task(run, name) for name in speeds]


def _compared(run: Run, round_number: int, speeds: Mapping[str, float] | None) -> list[str]:
    """Files that the policies of a round, or of a range, are compared on."""
    motions = speeds or ("reference.npz",)
    return ["model.urdf", *motions, *_before_training(run, round_number)]


def _comparing(run: Run, speeds: Mapping[str, float] | None) -> dict[str, Any]:
    """Values of a stage that compares policies of `run`, or of a range of `speeds`."""
    validation, pushes = run.configuration.validation, run.configuration.pushes
    of_range = {**run.sections("record"), "speeds": list(speeds.values())} if speeds else {}
    return {
        **run.sections(*SIMULATION_SECTIONS, "randomisation"),
        "walks": validation.model_dump(mode="json", exclude={"consecutive_cycles"}),
        "pushes": pushes.model_dump(mode="json", include={"phases", "force", "cycles"}),
        **of_range,
    }


def _body_of(task: "WalkingTask") -> "Array":
    """mu (14,) with which the policy for `task` is tried."""
    found = task.reference_mu
    return nominal_parameters() if found is None else found


def train_stage(run: Run, round_number: int) -> Stage:
    """The training of `round_number` in `run`; round 1 starts from `start/` or nothing."""
    training = run.configuration.training
    here = f"rounds/{round_number}/trained"
    start = _start_of(run, round_number)
    further: Start = "policy" if _asked(run) else "needing"
    samples = training.samples_from(start_kind(run.folder) if round_number == 1 else further)

    def train() -> None:
        from gaitval.policy.storage import save_policy

        task = _trained_task(run, round_number)
        save_policy(learned(run, [task], start, run.folder / here, samples), run.folder / here)

    return Stage(
        f"train-{round_number}",
        train,
        inputs=(
            *_compared(run, round_number, None),
            *need_files(run, _place_of(round_number, None)),
        ),
        outputs=tuple(f"{here}/{name}" for name in (*POLICY_FILES, "training.csv")),
        values=run.sections(*LEARNING_SECTIONS, "training"),
        workspace=here,
    )


def hand_on_stage(run: Run, round_number: int, speeds: Mapping[str, float] | None = None) -> Stage:
    """Start and trained policy of the round `round_number` of `run`, or of a range → the better
    one, and what the training gained. A range has `speeds`, m/s, by the file of the reference.
    """
    here, start = _place_of(round_number, speeds), _start_of(run, round_number)
    log = ("training.csv",) if speeds else ()

    def decide() -> None:
        from gaitval.metrics.learning_gain import Standing
        from gaitval.metrics.policy_comparison import handed_on, learning_gain
        from gaitval.policy.storage import save_policy

        tasks = _tasks_of(run, round_number, speeds)
        trained_in, target = run.folder / f"{here}trained", run.folder / f"{here}policy"
        trained = stored_policy(run, trained_in)
        walked = read_json(run.folder / here / STANDING)["start"]
        before = None if walked is None else Standing.model_validate(walked)
        samples = int(trained.about["samples"])
        gain = learning_gain(tasks, before, trained, _body_of(tasks[0]), samples=samples)
        run.observer.say(gain.in_words())
        write_json(target / GAIN, gain.as_dict())
        started = None if start is None else start_policy(run, run.folder / start)
        save_policy(handed_on(gain, started, trained), target)
        copy_files(trained_in, target, log)

    return Stage(
        "keep-range" if speeds else f"keep-{round_number}",
        decide,
        inputs=(
            "subject.toml",
            *_compared(run, round_number, speeds),
            f"{here}{STANDING}",
            *(f"{here}trained/{name}" for name in (*POLICY_FILES, *log)),
        ),
        outputs=tuple(f"{here}policy/{name}" for name in (*POLICY_FILES, *log, GAIN)),
        values=_comparing(run, speeds),
    )


def identify_stage(run: Run, round_number: int) -> Stage:
    """Record, scaled body and reference of `run` → posterior of mu, and the reference of the
    identified body.

    It uses no policy, so every later `round_number` of Algorithm 1 copies the result of the first.
    """
    here = f"rounds/{round_number}/identification"
    before = f"rounds/{round_number - 1}/identification"
    names = ("identification.json", IDENTIFIED)
    values = run.sections("seed", "contact", "record", "noise", "identification", "randomisation")
    # More rounds, or another threshold, do not change what is found.
    for name in ("rounds", "kappa"):
        del values["identification"][name]
    method = run.configuration.identification.method
    if method == "rollouts":  # it walks
        values |= run.sections(*SIMULATION_SECTIONS, "validation")

    def identify() -> None:
        if round_number > 1:
            copy_files(run.folder / before, run.folder / here, names)
            return
        # in a worker, which has loaded what it takes; the others have work for all workers
        workers = kept_workers() if method == "shared" else None
        if workers is None:
            _identify(run, run.folder / here)
        else:
            workers.submit(_identify, run, run.folder / here).result()

    return Stage(
        f"identify-{round_number}",
        identify,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            *([f"{before}/{name}" for name in names] if round_number > 1 else []),
        ),
        outputs=tuple(f"{here}/{name}" for name in names),
        values=values,
        workspace=here,
    )


def _identify(run: Run, folder: Path) -> None:
    """Write what the record of `run` says about mu into `folder`, and the reference."""
    prior = prior_sd(run.subject)
    if run.configuration.identification.method == "none":
        from gaitval.identification.unidentified import unidentified

        found = unidentified(run.configuration, prior)
    else:
        found = _searched(run, prior, folder)
    write_json(folder / "identification.json", found.as_dict())
    save_identified_reference(run, folder)


def _searched(run: Run, prior: "Array", folder: Path) -> "FoundParameters":
    """What the record of `run` says about mu, whose `prior` SD is (14,); `folder` keeps a search
    that is interrupted.
    """
    from gaitval.identification.begin import begin
    from gaitval.prediction.known import quantities_told
    from gaitval.reference.motion import ReferenceMotion

    record, model = run.told().record, read_urdf(run.folder / "model.urdf")
    configuration = run.configuration
    # whether the record's kinetics are the person's own
    own = "moments" in quantities_told(run.subject, configuration.record)
    progress, method = run.observer.progress, configuration.identification.method
    if method == "posterior":
        from gaitval.identification.posterior import identify

        return identify(
            record, model, prior, configuration, folder,
            kinetics_told=own, on_progress=progress,
        )  # fmt: skip
    from gaitval.identification.methods import rollouts_identification, shared_identification

    near = ReferenceMotion.load(run.folder / "reference.npz")
    fit, solution = begin(record, model, prior, configuration, own, near)
    if method == "shared":
        return shared_identification(
            fit, solution, run.subject, record, model, configuration, progress
        )
    from gaitval.study.stored_policy import general_walker

    walker = general_walker(configuration.environment)
    return rollouts_identification(fit, record, model, walker, configuration, progress)


def save_identified_reference(run: Run, folder: Path) -> None:
    """Write the reference of the body in `folder`/identification.json beside it, for `run`."""
    from gaitval.model.parameters import apply_parameters
    from gaitval.reference.motion import ReferenceMotion

    mu = body_parameters(folder / "identification.json")
    if np.array_equal(mu[2:], nominal_parameters()[2:]):  # as scaled, whose reference there is
        copy_file(run.folder / "reference.npz", folder / IDENTIFIED)
        return
    model = identified_model(read_urdf(run.folder / "model.urdf"), folder / "identification.json")
    scaled = ReferenceMotion.load(run.folder / "reference.npz")
    _reference_of(run, apply_parameters(model, mu), scaled).save(folder / IDENTIFIED)


def evaluate_stage(run: Run, round_number: int) -> Stage:
    """Epsilon of the policy of a `round_number` of `run` with the nominal and the identified body,
    means over the start phases; its scatter over them; and its floor, which is the reference's own.
    """
    here = f"rounds/{round_number}"
    identification = f"{here}/identification/identification.json"
    validation = run.configuration.validation
    values = run.sections(*SIMULATION_SECTIONS, "validation")
    # How far other walks go does not change the cycles that are compared.
    del values["validation"]["consecutive_cycles"]

    def evaluate() -> None:
        from gaitval.metrics.epsilon import Walks, epsilons, mean_of
        from gaitval.metrics.learning_gain import LearningGain
        from gaitval.metrics.reference_curves import floor_of
        from gaitval.metrics.round_errors import RoundErrors
        from gaitval.metrics.typed import array
        from gaitval.policy.rollouts import RolloutPool, in_groups

        task = walking_task(run)
        policy = stored_policy(run, run.folder / here / "policy")
        found = body_parameters(run.folder / identification)
        tasks = {"identified": identified_task(run, found, f"{here}/identification")}
        if round_number > 1:
            tasks["nominal"] = task
        groups = in_groups(validation.start_phases)
        with RolloutPool(task, workers=run.configuration.training.workers) as pool:
            begun = {}
            for which, each in tasks.items():
                mu = body_parameters(run.folder / identification, which)
                walks = [Walks(policy, mu, phases) for phases in groups]
                # both bodies are given to the workers before the results of either are awaited
                begun[which] = pool.with_task(each).each_together(epsilons, walks)
            walked = {which: list(chain.from_iterable(parts)) for which, parts in begun.items()}
        error = mean_of(walked["identified"])
        if "nominal" in walked:
            before = mean_of(walked["nominal"])
        else:  # the first round's policy has walked so before it was handed on
            before = stored(run, f"{here}/policy/{GAIN}", LearningGain).standing.error
        totals = array([each.total for each in walked["identified"] if each is not None])
        found_errors = RoundErrors(
            nominal=before,
            identified=error,
            scatter=None if error is None else float(np.std(totals)),
            floor=floor_of(task),
        )
        write_json(run.folder / here / "epsilon.json", found_errors.as_dict())

    return Stage(
        f"evaluate-{round_number}",
        evaluate,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            identification,
            f"{here}/identification/{IDENTIFIED}",
            *(f"{here}/policy/{name}" for name in (*POLICY_FILES, GAIN)),
        ),
        outputs=(f"{here}/epsilon.json",),
        values=values,
    )


def choose_stage(run: Run, rounds: int) -> Stage:
    """The best of the `rounds` of `run`, by what its policy lacks and then by epsilon, copied to
    where later stages read it.
    """
    numbers = range(1, rounds + 1)

    def choose() -> None:
        from gaitval.metrics.learning_gain import LearningGain
        from gaitval.metrics.policy_comparison import push_limit
        from gaitval.metrics.results import IdentificationResult, Round

        errors = [round_errors(run, number) for number in numbers]

        def order(number: int) -> tuple[tuple[int, int], float, bool, int]:
            gain = stored(run, f"rounds/{number}/policy/{GAIN}", LearningGain)
            # of rounds that are alike the one that made the policy; where all fell, the last
            lacking, error = gain.standing.lacking(push_limit()), errors[number - 1].total
            return lacking, error, not gain.trained_is_handed_on, -number

        best = min(numbers, key=order)
        source = run.folder / f"rounds/{best}"
        copy_files(source / "policy", run.folder / "policy", (*POLICY_FILES, GAIN))
        _join_logs(
            [run.folder / f"rounds/{number}/trained/training.csv" for number in range(1, best + 1)],
            run.folder / "policy" / "training.csv",
        )
        searched = read_json(source / "identification" / "identification.json")
        reference = source / "identification" / IDENTIFIED
        # the found body brings the walk no nearer to the record: it is reported, and not used
        if not errors[best - 1].supported and searched["identified"] != searched["nominal"]:
            searched |= {"searched": searched["identified"], "identified": searched["nominal"]}
            reference = run.folder / "reference.npz"
        copy_file(reference, run.folder / IDENTIFIED)
        found = IdentificationResult(
            **searched,
            chosen_round=best,
            epsilon_nominal=errors[best - 1].nominal,
            epsilon_identified=errors[best - 1].identified,
            rounds=[
                Round(
                    round=number,
                    epsilon=error.identified,
                    epsilon_nominal=error.nominal,
                    scatter=error.scatter,
                    floor=error.floor,
                )
                for number, error in zip(numbers, errors, strict=True)
            ],
        )
        write_json(run.folder / "identification.json", found.as_dict())

    return Stage(
        "choose",
        choose,
        inputs=(
            "reference.npz",
            *(
                f"rounds/{number}/{name}"
                for number in numbers
                for name in (
                    *(f"policy/{name}" for name in (*POLICY_FILES, GAIN)),
                    "trained/training.csv",
                    "identification/identification.json",
                    f"identification/{IDENTIFIED}",
                    "epsilon.json",
                )
            ),
        ),
        outputs=(
            *(f"policy/{name}" for name in (*POLICY_FILES, "training.csv", GAIN)),
            "identification.json",
            IDENTIFIED,
        ),
    )


def _join_logs(logs: Sequence[Path], target: Path) -> None:
    """Join the logs of trainings that each continued the one before."""
    if not any(True for log in logs for _ in file_gate.csv_rows(log, ArtefactError)):
        copy_file(logs[0], target)  # nothing was learned: pandas is 50 MB, which a run keeps
        return
    import pandas as pd

    parts = [file_gate.csv_frame(log, ArtefactError) for log in logs]
    for before, part in pairwise(parts):
        for name in ("samples", "wall_seconds"):
            # each log counts from 0, and the one before is shifted already
            part[name] += before[name].iloc[-1]
    with replacing(target) as temporary:
        pd.concat(parts).to_csv(temporary, index=False)


def round_errors(run: Run, round_number: int) -> "RoundErrors":
    """Epsilon of the finished round `round_number` of `run`."""
    from gaitval.metrics.round_errors import read_round

    return read_round(run.folder / f"rounds/{round_number}")


def round_gained(run: Run, round_number: int) -> bool:
    """Whether `round_number` of `run` lowered epsilon by more than its scatter over starts."""
    before, after = round_errors(run, round_number - 1), round_errors(run, round_number)
    if before.identified is None or after.identified is None:
        return before.identified is None
    return after.total < before.total - max(before.scatter or 0.0, after.scatter or 0.0)


def correct_stage(run: Run) -> Stage:
    """Policy and mu of `run` → the change of the reference with which the walk is most like it."""

    def correct() -> None:
        from gaitval.learning_control.correct import TO_ESTIMATE, TO_RECORD, correct

        kept_workers()  # they start while this process reads
        mu = body_parameters(run.folder / "identification.json")
        result = correct(
            identified_task(run, mu),
            stored_policy(run, run.folder / "policy"),
            mu,
            asked=asked(run).record,
            to_record=TO_ESTIMATE if run.knew_no_kinetics else TO_RECORD,
            on_progress=run.observer.progress,
        )
        save_correction(run, result)

    return Stage(
        "correct",
        correct,
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


def simulate_stage(run: Run, *, witness: bool = True) -> Stage:
    """Policy, mu and correction of `run` → rollouts of the deterministic policy without pushes.

    The identified body with the corrected reference walks the compared cycles, from the first start
    phase, and for comparison the nominal body with the uncorrected reference. With `witness`, so
    does the identified body in MuJoCo.
    """
    validation = run.configuration.validation

    def simulate() -> None:
        from gaitval.metrics.cycles import find_cycles
        from gaitval.metrics.rollouts import begun_walk, roll_out_from
        from gaitval.metrics.torque_shares import torque_shares
        from gaitval.policy.rollouts import RolloutPool

        policy = stored_policy(run, run.folder / "policy")
        nominal = body_parameters(run.folder / "identification.json", "nominal")
        task, mu = validated_task(run)
        starts = stored(run, STARTS, StoredStarts).starts
        second: Endurance | None = None
        with RolloutPool(task, workers=run.configuration.training.workers) as pool:
            begin = partial(begun_walk, policy=policy, phase=starts[0].start_phase)
            # They are the first that the workers take up.
            in_mujoco = begin(pool, mu=mu, engine="mujoco") if witness else None
            before = begin(pool.with_task(walking_task(run)), mu=nominal, engine="compiled")
            walks = roll_out_from(pool, policy, mu, starts)
            if in_mujoco is not None:
                second, rollout = in_mujoco()
                rollout.save(run.folder / WITNESS)
            went, rollout = before()
        rollout.save(run.folder / ROLLOUTS["nominal"])
        walks.compared.save(run.folder / ROLLOUTS["identified"])
        found = find_cycles(walks.compared, run.configuration).first(validation.cycles)
        result = StoredWalks(
            nominal=[went],
            identified=list(walks.starts),
            witness=second,
            torque_shares=torque_shares(walks.compared, found, task),
        )
        write_json(run.folder / WALKS, result.as_dict())

    return Stage(
        "simulate",
        simulate,
        inputs=(*WALKER, "correction.json", STARTS),
        outputs=(*ROLLOUTS.values(), *([WITNESS] if witness else []), WALKS),
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
        from gaitval.metrics.repeats import repeated_walks
        from gaitval.metrics.validation import compared_with

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
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            *(("centring.json",) if predicted else (IDENTIFIED, "identification.json")),
            "correction.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=(REPEATS,),
        values={
            **run.sections(*SIMULATION_SECTIONS, "record"),
            "walks": validation.model_dump(mode="json", exclude={"consecutive_cycles"}),
        },
    )


def body_stages(run: Run) -> list[Stage]:
    """What the record of `run` says of the body, in words for the report; none if nothing is to be
    identified.
    """
    nothing = run.configuration.identification.method == "none"
    return [] if nothing else [body_stage.stage(run)]


def push_stage(run: Run) -> Stage:
    """Policy and mu of `run` → which pushes the identified body survives."""
    validation = run.configuration.validation

    def push() -> None:
        from gaitval.metrics.push_recovery import push_recovery, pushed_walks

        task, mu = validated_task(run)
        policy = stored_policy(run, run.folder / "policy")
        recovery, traces = push_recovery(
            task,
            policy,
            mu,
            journal=Journal(run.folder / UNFINISHED / "pushes.jsonl"),
            on_progress=run.observer.progress,
        )
        found = StoredPushes(recovery=recovery, traces=[each.stored() for each in traces])
        write_json(run.folder / "push.json", found.as_dict())
        for name, walk in zip(PUSHED, pushed_walks(task, policy, mu), strict=True):
            walk.save(run.folder / name)

    return Stage(
        "push",
        push,
        inputs=(*WALKER, "correction.json"),
        outputs=("push.json", *PUSHED),
        values={
            **run.sections(*SIMULATION_SECTIONS, "pushes"),
            "settling_cycles": validation.settling_cycles,
        },
        workspace=UNFINISHED,
        emptied=True,
    )


def metrics_of(run: Run, *, pushes: "PushRecovery | None") -> "Metrics":
    """The walks in the folder of `run`, and its `pushes`, against record and tolerances."""
    from gaitval.metrics.learning_gain import LearningGain
    from gaitval.metrics.results import CorrectionResult, IdentificationResult
    from gaitval.metrics.rollouts import Rollouts
    from gaitval.metrics.validation import validate
    from gaitval.prediction.known import is_unrecorded
    from gaitval.simulation.rollout import Rollout

    def rollouts(name: str, went: "Sequence[Endurance] | None") -> Rollouts | None:
        return Rollouts(Rollout.load(run.folder / name), tuple(went)) if went else None

    walks = stored(run, WALKS, StoredWalks)
    nominal = rollouts(ROLLOUTS["nominal"], walks.nominal)
    assert nominal is not None
    repeats = read_json(run.folder / REPEATS) if (run.folder / REPEATS).is_file() else []
    settings, people = run.configuration.record, builtin_subjects()
    expected_errors = None
    if is_unrecorded(settings):
        from gaitval.metrics.held_out import prediction_errors

        expected_errors = prediction_errors(run.subject, settings, people)
    found = validate(
        *run.compared(),
        read_urdf(run.folder / "model.urdf"),
        nominal,
        rollouts(ROLLOUTS["identified"], walks.identified),
        run.configuration,
        identification=stored(run, "identification.json", IdentificationResult)
        if walks.identified
        else None,
        correction=stored(run, "correction.json", CorrectionResult),
        pushes=pushes,
        others=people,
        torque_shares=walks.torque_shares,
        witness=rollouts(WITNESS, None if walks.witness is None else [walks.witness]),
        repeats=[Repeat.model_validate(each) for each in repeats],
        centring=walks.centring,
        prediction_errors=expected_errors,
        training=stored(run, f"policy/{GAIN}", LearningGain),
    )
    # of the file beside it, which has neither devices nor the trial that is held out as its own
    path = run.folder / "subject.toml"
    subject = value_hash(file_gate.read_text(path, ArtefactError, largest=file_gate.WRITTEN))
    own = found.provenance.model_copy(update={"subject": subject})
    return found.model_copy(update={"provenance": own})


def validate_stage(run: Run) -> Stage:
    """Rollouts and pushes of `run`, compared with the record and the tolerances → metrics.json."""
    from gaitval.metrics.results import SCHEMA_VERSION

    def validate() -> None:
        pushes = stored(run, "push.json", StoredPushes)
        write_json(run.folder / METRICS, metrics_of(run, pushes=pushes.recovery).as_dict())

    return Stage(
        "validate",
        validate,
        inputs=(
            "subject.toml",
            "model.urdf",
            "identification.json",
            "correction.json",
            *ROLLOUTS.values(),
            WITNESS,
            WALKS,
            REPEATS,
            "push.json",
            f"policy/{GAIN}",
        ),
        outputs=(METRICS,),
        values={
            **run.sections("seed", "record", "contact", "validation"),
            # metrics of an earlier version cannot be read, so they are written again
            "schema_version": SCHEMA_VERSION,
        },
    )


def report_stage(run: Run) -> Stage:
    """Everything in the folder of `run` → report.html, report.pdf and the cited claims.csv."""

    def report() -> None:
        from gaitval.reporting.report import write_report

        kept_workers()
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
            "identification.json",
            "metrics.json",
            "push.json",
            *PUSHED,
            *ROLLOUTS.values(),
            *(name for each in body_stages(run) for name in each.outputs),
        ),
        outputs=("report.html", "report.pdf", "claims.csv"),
    )
