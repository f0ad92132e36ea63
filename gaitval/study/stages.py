"""The stages of a run, from scaling to the report, each as a `Stage`.

It is long because every stage is here, in order, with what it reads and writes.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import chain, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaitval.artefacts import read_json, replacing, write_json
from gaitval.journal import Journal
from gaitval.study.inputs import (
    GAIN,
    IDENTIFIED,
    POLICY_FILES,
    REPEATS,
    ROLLOUTS,
    UNFINISHED,
    WALKS,
    WITNESS,
    body_parameters,
    copy_file,
    copy_files,
    corrected_task,
    identified_task,
    start_kind,
    start_policy,
    stored_policy,
    walking_task,
)
from gaitval.study.stage import Run, Stage

if TYPE_CHECKING:
    from gaitval.policy.storage import Policy
    from gaitval.simulation.walker import WalkingTask

SIMULATION_SECTIONS = ("seed", "contact", "servo", "environment")
LEARNING_SECTIONS = (*SIMULATION_SECTIONS, "reward", "randomisation")


def scale_stage(run: Run) -> Stage:
    """Subject → body model."""

    def scale() -> None:
        from gaitval.model.urdf import write_urdf
        from gaitval.prediction.unusual import remarks_on_body
        from gaitval.scaling.scaling import scale_subject

        for remark in remarks_on_body(run.subject):
            run.observer.say(remark)
        body = scale_subject(run.subject)
        write_urdf(body.model, run.folder / "model.urdf")
        with replacing(run.folder / "scaling.csv") as temporary:
            body.frame().to_csv(temporary, index=False)

    return Stage("scale", scale, inputs=("subject.toml",), outputs=("model.urdf", "scaling.csv"))


def reference_stage(run: Run) -> Stage:
    """Recorded gait and body model → reference motion."""

    def build() -> None:
        from gaitval.datasets.subject_file import builtin_subjects
        from gaitval.model.urdf import read_urdf
        from gaitval.prediction.unusual import remarks_on_gait
        from gaitval.reference.dynamic_fit import consistent_reference

        for remark in remarks_on_gait(run.subject, builtin_subjects()):
            run.observer.say(remark)
        model = read_urdf(run.folder / "model.urdf")
        told = run.told()
        contact = run.configuration.contact
        consistent_reference(told.record, model, contact, told.accuracy).save(
            run.folder / "reference.npz"
        )

    return Stage(
        "reference",
        build,
        inputs=("subject.toml", "model.urdf"),
        outputs=("reference.npz",),
        values=run.sections("contact", "record"),
    )


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
    if round_number == 1 or not supported(read_json(run.folder / before / "epsilon.json")):
        return walking_task(run)
    found = read_json(run.folder / f"{before}/identification/identification.json")
    return identified_task(run, np.array(found["identified"]), f"{before}/identification")


def train_stage(run: Run, round_number: int) -> Stage:
    """One training of Algorithm 1; round 1 starts from `start/` or nothing."""
    training = run.configuration.training
    here = f"rounds/{round_number}/trained"
    start = _start_of(run, round_number)
    samples = training.samples_from(start_kind(run.folder) if round_number == 1 else "policy")

    def train() -> None:
        from gaitval.policy.storage import save_policy
        from gaitval.policy.training import train

        policy = train(
            _trained_task(run, round_number),
            run.folder / here,
            samples=samples,
            start=None if start is None else start_policy(run, run.folder / start),
            subject=run.subject.identifier,
            on_progress=run.observer.progress,
        )
        save_policy(policy, run.folder / here)

    return Stage(
        f"train-{round_number}",
        train,
        inputs=("model.urdf", "reference.npz", *_before_training(run, round_number)),
        outputs=tuple(f"{here}/{name}" for name in (*POLICY_FILES, "training.csv")),
        values=run.sections(*LEARNING_SECTIONS, "training"),
        workspace=here,
    )


def hand_on_stage(run: Run, round_number: int) -> Stage:
    """Start and trained policy of a round → the better one, and what the training gave."""
    here = f"rounds/{round_number}"
    start = _start_of(run, round_number)

    def decide() -> None:
        before = None if start is None else start_policy(run, run.folder / start)
        hand_on(
            run, [_trained_task(run, round_number)], before, f"{here}/trained", f"{here}/policy"
        )

    return Stage(
        f"keep-{round_number}",
        decide,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            *_before_training(run, round_number),
            *(f"{here}/trained/{name}" for name in POLICY_FILES),
        ),
        outputs=tuple(f"{here}/policy/{name}" for name in (*POLICY_FILES, GAIN)),
        values=hand_on_values(run),
    )


def hand_on_values(run: Run) -> dict[str, Any]:
    """The settings of the walks on which start and trained policy are compared."""
    validation = run.configuration.validation
    return {
        **run.sections(*SIMULATION_SECTIONS),
        "walks": validation.model_dump(mode="json", exclude={"consecutive_cycles"}),
        "pushes": run.configuration.pushes.model_dump(
            mode="json", include={"phases", "force", "cycles"}
        ),
    }


def hand_on(
    run: Run, tasks: "Sequence[WalkingTask]", start: "Policy | None", trained_in: str, target: str
) -> None:
    """Store the better of start and trained policy, and what the training gave.

    Parameters
    ----------
    trained_in, target : folders of the trained policy and for the one that is handed on.
    """
    from gaitval.metrics.policy_comparison import handed_on, learning_gain
    from gaitval.model.parameters import nominal_parameters
    from gaitval.policy.storage import save_policy

    trained = stored_policy(run, run.folder / trained_in)
    found = tasks[0].reference_mu
    mu = nominal_parameters() if found is None else found
    samples = int(trained.about["samples"])
    gain = learning_gain(tasks, start, trained, mu, samples=samples)
    run.observer.say(gain.in_words())
    write_json(run.folder / target / GAIN, gain.as_dict())
    save_policy(handed_on(gain, start, trained), run.folder / target)


def identify_stage(run: Run, round_number: int) -> Stage:
    """Record and scaled body → posterior of mu, and the reference of the identified body.

    No policy has a part in it, so later rounds of Algorithm 1 take over what the first one found.
    """
    here = f"rounds/{round_number}/identification"
    before = f"rounds/{round_number - 1}/identification"
    names = ("identification.json", IDENTIFIED)
    values = run.sections("seed", "contact", "record", "noise", "identification", "randomisation")
    # More rounds, or another threshold, do not change what is found.
    for name in ("rounds", "kappa"):
        del values["identification"][name]

    def identify() -> None:
        from gaitval.identification.identify import identify
        from gaitval.identification.prior import prior_sd
        from gaitval.metrics.results import FoundParameters
        from gaitval.model.urdf import read_urdf
        from gaitval.prediction.told import quantities_told

        if round_number > 1:
            copy_files(run.folder / before, run.folder / here, names)
            return
        told, model = run.told(), read_urdf(run.folder / "model.urdf")
        found = identify(
            told.record,
            model,
            prior_sd(run.subject),
            run.configuration,
            run.folder / here,
            kinetics_told="moments" in quantities_told(run.subject, run.configuration.record),
            on_progress=run.observer.progress,
        )
        result = FoundParameters(**found.as_dict())
        write_json(run.folder / here / "identification.json", result.as_dict())
        save_identified_reference(run, run.folder / here)

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


def save_identified_reference(run: Run, folder: Path) -> None:
    """Write the reference of the body in a folder's `identification.json` beside it."""
    from gaitval.model.parameters import apply_parameters, nominal_parameters
    from gaitval.model.urdf import read_urdf
    from gaitval.reference.dynamic_fit import consistent_reference

    mu = body_parameters(folder / "identification.json")
    if np.array_equal(mu[2:], nominal_parameters()[2:]):  # as scaled, whose reference there is
        copy_file(run.folder / "reference.npz", folder / IDENTIFIED)
        return
    told = run.told()
    body = apply_parameters(read_urdf(run.folder / "model.urdf"), mu)
    contact = run.configuration.contact
    consistent_reference(told.record, body, contact, told.accuracy).save(folder / IDENTIFIED)


def identified_reference_stage(run: Run) -> Stage:
    """The reference of the identified body of a stored run, which does not contain it."""
    return Stage(
        "identified",
        lambda: save_identified_reference(run, run.folder),
        inputs=("subject.toml", "model.urdf", "reference.npz", "identification.json"),
        outputs=(IDENTIFIED,),
        values=run.sections("contact", "record"),
    )


def evaluate_stage(run: Run, round_number: int) -> Stage:
    """Epsilon of a round's policy with the nominal and the identified body, means over the start
    phases; its scatter over them; and its floor, which is the reference's own.
    """
    here = f"rounds/{round_number}"
    identification = f"{here}/identification/identification.json"
    validation = run.configuration.validation
    values = run.sections(*SIMULATION_SECTIONS, "validation")
    # How far other walks go does not change the cycles that are compared.
    del values["validation"]["consecutive_cycles"]

    def evaluate() -> None:
        from gaitval.metrics.epsilon import Walks, epsilons, mean_of
        from gaitval.metrics.habit import floor_of
        from gaitval.policy.rollouts import RolloutPool, in_groups

        task = walking_task(run)
        policy = stored_policy(run, run.folder / here / "policy")
        found = body_parameters(run.folder / identification)
        tasks = {
            "nominal": task,
            "identified": identified_task(run, found, f"{here}/identification"),
        }
        groups = in_groups(validation.start_phases)
        with RolloutPool(task, workers=run.configuration.training.workers) as pool:
            begun = {}
            for which, each in tasks.items():
                mu = body_parameters(run.folder / identification, which)
                walks = [Walks(policy, mu, phases) for phases in groups]
                begun[which] = pool.with_task(each).each_together(epsilons, walks)
            errors: dict[str, Any] = {"floor": floor_of(task), "scatter": None}
            for which, parts in begun.items():
                each_walk = list(chain.from_iterable(parts))
                error = mean_of(each_walk)
                errors[which] = None if error is None else error.as_dict()
                if which == "identified" and error is not None:
                    errors["scatter"] = float(np.std([e.total for e in each_walk if e is not None]))
        write_json(run.folder / here / "epsilon.json", errors)

    return Stage(
        f"evaluate-{round_number}",
        evaluate,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            identification,
            f"{here}/identification/{IDENTIFIED}",
            *(f"{here}/policy/{name}" for name in POLICY_FILES),
        ),
        outputs=(f"{here}/epsilon.json",),
        values=values,
    )


def choose_stage(run: Run, rounds: int) -> Stage:
    """The round with the smallest epsilon, copied to where later stages read it."""
    numbers = range(1, rounds + 1)

    def choose() -> None:
        from gaitval.metrics.results import IdentificationResult

        errors = [read_json(run.folder / f"rounds/{number}/epsilon.json") for number in numbers]
        best = min(numbers, key=lambda number: round_epsilon(run, number))
        source = run.folder / f"rounds/{best}"
        copy_files(source / "policy", run.folder / "policy", (*POLICY_FILES, GAIN))
        _join_logs(
            [run.folder / f"rounds/{number}/trained/training.csv" for number in range(1, best + 1)],
            run.folder / "policy" / "training.csv",
        )
        searched = read_json(source / "identification" / "identification.json")
        reference = source / "identification" / IDENTIFIED
        if not supported(errors[best - 1]):
            searched |= {"searched": searched["identified"], "identified": searched["nominal"]}
            reference = run.folder / "reference.npz"
        copy_file(reference, run.folder / IDENTIFIED)
        found = IdentificationResult(
            **searched,
            chosen_round=best,
            epsilon_nominal=errors[best - 1]["nominal"],
            epsilon_identified=errors[best - 1]["identified"],
            rounds=[
                {
                    "round": number,
                    "epsilon": error["identified"],
                    "epsilon_nominal": error["nominal"],
                    "scatter": error["scatter"],
                    "floor": error["floor"],
                }
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


def supported(errors: Mapping[str, Any]) -> bool:
    """Whether the walk with the body that the search found is nearer to the record, by epsilon,
    than with the nominal body, for which the reference was made. Else the body stays nominal.
    """
    nominal, identified = errors["nominal"], errors["identified"]
    if identified is None:
        return nominal is None
    return nominal is None or bool(identified["total"] < nominal["total"])


def _join_logs(logs: Sequence[Path], target: Path) -> None:
    """Join the logs of trainings that each continued the one before."""
    import pandas as pd

    parts = [pd.read_csv(log) for log in logs]
    for before, part in pairwise(parts):
        for name in ("samples", "wall_seconds"):
            part[name] += before[name].iloc[-1]
    with replacing(target) as temporary:
        pd.concat(parts).to_csv(temporary, index=False)


def round_epsilon(run: Run, round_number: int) -> float:
    """Normalised error epsilon at mu* of a finished round; infinite if the walker fell early."""
    error = _round(run, round_number)["identified"]
    return float("inf") if error is None else float(error["total"])


def round_floor(run: Run, round_number: int) -> float:
    """Epsilon of the reference itself."""
    return float(_round(run, round_number)["floor"])


def round_gained(run: Run, round_number: int) -> bool:
    """Whether a later round's epsilon is lower than the one's before by more than their scatter
    over start phases.
    """
    before, after = _round(run, round_number - 1), _round(run, round_number)
    if before["identified"] is None or after["identified"] is None:
        return before["identified"] is None
    scatter = max(before["scatter"], after["scatter"])
    return bool(after["identified"]["total"] < before["identified"]["total"] - scatter)


def _round(run: Run, round_number: int) -> dict[str, Any]:
    return dict(read_json(run.folder / f"rounds/{round_number}/epsilon.json"))


def correct_stage(run: Run) -> Stage:
    """Policy and mu → the change of the reference with which the walk is most like it."""

    def correct() -> None:
        from gaitval.learning_control.correct import correct

        mu = body_parameters(run.folder / "identification.json")
        result = correct(
            identified_task(run, mu),
            stored_policy(run, run.folder / "policy"),
            mu,
            journal=Journal(run.folder / UNFINISHED["correct"] / "walks.jsonl"),
            on_progress=run.observer.progress,
        )
        write_json(run.folder / "correction.json", result.as_dict())

    validation = run.configuration.validation
    return Stage(
        "correct",
        correct,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            IDENTIFIED,
            "identification.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=("correction.json",),
        values={
            **run.sections(*SIMULATION_SECTIONS, "correction"),
            # How far other walks go does not change the cycles that are compared.
            "walks": validation.model_dump(mode="json", exclude={"consecutive_cycles"}),
        },
        workspace=UNFINISHED["correct"],
        emptied=True,
    )


def simulate_stage(run: Run, *, witness: bool = True) -> Stage:
    """Policy, mu and correction → rollouts of the deterministic policy without pushes.

    The identified body with the corrected reference walks from every start phase. For comparison
    the nominal body with the uncorrected reference walks from the first phase, for the cycles that
    are compared; and the identified body does in MuJoCo.

    Parameters
    ----------
    witness : walk in MuJoCo too.
    """
    validation = run.configuration.validation

    def simulate() -> None:
        from gaitval.metrics.cycles import find_cycles
        from gaitval.metrics.rollouts import begun_walk, roll_out_from
        from gaitval.metrics.torque_shares import torque_shares
        from gaitval.policy.rollouts import RolloutPool

        policy = stored_policy(run, run.folder / "policy")
        nominal, mu = (
            body_parameters(run.folder / "identification.json", which)
            for which in ("nominal", "identified")
        )
        task, phases = corrected_task(run), validation.start_phases
        compared = validation.settling_cycles + validation.cycles + 2
        starts: dict[str, Any] = {"witness": None}
        workers = run.configuration.training.workers
        with RolloutPool(task, workers=workers, engine="dart") as pool:
            begin = partial(begun_walk, policy=policy, phase=phases[0], cycles=compared)
            # They are the first that the workers take up.
            in_mujoco = begin(pool, mu=mu, engine="mujoco") if witness else None
            before = begin(pool.with_task(walking_task(run)), mu=nominal, engine="dart")
            walks = roll_out_from(
                pool,
                policy,
                mu,
                phases,
                cycles=validation.settling_cycles + validation.consecutive_cycles,
                workspace=run.folder / UNFINISHED["simulate"],
            )
            if in_mujoco is not None:
                went, rollout = in_mujoco()
                rollout.save(run.folder / WITNESS)
                starts["witness"] = went.as_dict()
            went, rollout = before()
        rollout.save(run.folder / ROLLOUTS["nominal"])
        walks.compared.save(run.folder / ROLLOUTS["identified"])
        starts["nominal"] = [went.as_dict()]
        starts["identified"] = [each.as_dict() for each in walks.starts]
        found = find_cycles(walks.compared, run.configuration).first(validation.cycles)
        starts["torque_shares"] = torque_shares(walks.compared, found, task)
        write_json(run.folder / WALKS, starts)

    return Stage(
        "simulate",
        simulate,
        inputs=(
            "model.urdf",
            "reference.npz",
            IDENTIFIED,
            "identification.json",
            "correction.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=(*ROLLOUTS.values(), *([WITNESS] if witness else []), WALKS),
        values={
            **run.sections(*SIMULATION_SECTIONS),
            "walks": validation.model_dump(mode="json", exclude={"filter_frequency"}),
        },
        workspace=UNFINISHED["simulate"],
        emptied=True,
    )


def walk_again(run: Run, task: "WalkingTask", mu: NDArray[np.float64]) -> None:
    """Repeat the compared walk from every start phase with noise, and write what is measured."""
    from gaitval.datasets.subject_file import builtin_subjects
    from gaitval.metrics.repeats import Compared, repeated_walks
    from gaitval.metrics.validation import compared_with
    from gaitval.model.urdf import read_urdf

    subject, record = run.compared()
    compared = Compared(
        record,
        *compared_with(subject, record, builtin_subjects(), run.configuration),
        read_urdf(run.folder / "model.urdf"),
        subject.leg_length_m,
    )
    policy = stored_policy(run, run.folder / "policy")
    write_json(run.folder / REPEATS, repeated_walks(task, policy, mu, compared))


def repeat_stage(run: Run) -> Stage:
    """Policy, mu and correction → what is measured of walks from every start phase with noise."""

    def repeat() -> None:
        walk_again(run, corrected_task(run), body_parameters(run.folder / "identification.json"))

    return Stage(
        "repeat",
        repeat,
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            IDENTIFIED,
            "identification.json",
            "correction.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=(REPEATS,),
        values=repeat_values(run),
    )


def repeat_values(run: Run) -> dict[str, Any]:
    """The settings that repeated walks depend on."""
    validation = run.configuration.validation
    return {
        **run.sections(*SIMULATION_SECTIONS, "record"),
        "walks": validation.model_dump(mode="json", exclude={"consecutive_cycles"}),
    }


def push_stage(run: Run) -> Stage:
    """Policy and mu → which pushes the identified body survives."""
    validation = run.configuration.validation

    def push() -> None:
        from gaitval.metrics.push_recovery import push_recovery

        recovery, traces = push_recovery(
            corrected_task(run),
            stored_policy(run, run.folder / "policy"),
            body_parameters(run.folder / "identification.json"),
            journal=Journal(run.folder / UNFINISHED["push"] / "pushes.jsonl"),
            on_progress=run.observer.progress,
        )
        write_json(
            run.folder / "push.json",
            {"recovery": recovery.as_dict(), "traces": [trace.as_dict() for trace in traces]},
        )

    return Stage(
        "push",
        push,
        inputs=(
            "model.urdf",
            "reference.npz",
            IDENTIFIED,
            "identification.json",
            "correction.json",
            *(f"policy/{name}" for name in POLICY_FILES),
        ),
        outputs=("push.json",),
        values={
            **run.sections(*SIMULATION_SECTIONS, "pushes"),
            "settling_cycles": validation.settling_cycles,
        },
        workspace=UNFINISHED["push"],
        emptied=True,
    )


def metrics_of(run: Run, *, pushes: Mapping[str, Any] | None) -> dict[str, Any]:
    """The walks of the run folder against the record and the tolerances."""
    from gaitval.datasets.subject_file import builtin_subjects
    from gaitval.metrics.rollouts import Endurance, Rollouts
    from gaitval.metrics.validation import validate
    from gaitval.model.urdf import read_urdf
    from gaitval.simulation.rollout import Rollout

    starts = read_json(run.folder / WALKS)

    def rollouts(name: str, went: Any) -> Rollouts:
        return Rollouts(
            Rollout.load(run.folder / name), tuple(Endurance.from_dict(each) for each in went)
        )

    nominal, identified = (rollouts(name, starts[which]) for which, name in ROLLOUTS.items())
    return validate(
        *run.compared(),
        read_urdf(run.folder / "model.urdf"),
        nominal,
        identified,
        run.configuration,
        identification=read_json(run.folder / "identification.json"),
        correction=read_json(run.folder / "correction.json"),
        pushes=pushes,
        others=builtin_subjects(),
        torque_shares=starts["torque_shares"],
        witness=rollouts(WITNESS, [starts["witness"]]) if starts["witness"] else None,
        repeats=read_json(run.folder / REPEATS) if (run.folder / REPEATS).is_file() else (),
        training=read_json(run.folder / f"policy/{GAIN}"),
    )


def validate_stage(run: Run) -> Stage:
    """Rollouts and pushes, compared with the record and the tolerances → metrics.json."""
    from gaitval.metrics.results import SCHEMA_VERSION

    def validate() -> None:
        pushes = read_json(run.folder / "push.json")["recovery"]
        write_json(run.folder / "metrics.json", metrics_of(run, pushes=pushes))

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
        outputs=("metrics.json",),
        values={
            **run.sections("seed", "record", "contact", "validation"),
            # metrics of an earlier version cannot be read, so they are written again
            "schema_version": SCHEMA_VERSION,
        },
    )


def report_stage(run: Run) -> Stage:
    """Everything in the run folder → report.html and report.pdf, and evidence.toml, which they
    cite.
    """

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
            "identification.json",
            "metrics.json",
            "push.json",
            *ROLLOUTS.values(),
        ),
        outputs=("report.html", "report.pdf", "evidence.toml"),
    )
