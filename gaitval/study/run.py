"""Run the stages of a subject in order, each only if its inputs have changed.

A stage is a function that reads and writes files of one run folder. For every stage, `stages.json`
there keeps its version, and hashes of all that it depended on and of all that it wrote; a stage for
which these still match is skipped. `provenance.json` keeps versions, seed, hashes and wall times.
No other file contains times, so equal runs give equal files.

Algorithm 1 (train, identify, until epsilon < kappa) is a sequence of such stages, one pair a
round, in `rounds/1`, `rounds/2`, ...; the best round, by falls and pushes where it lacks some and
then by epsilon, is copied to `policy/` and `identification.json`, where the later stages read it.
"""

import shutil
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from gaitval._internal.io.artefacts import copy_files
from gaitval.errors import ArtefactError, ConfigurationError, PolicyError
from gaitval.policy.processes import keeping_workers
from gaitval.study.identification_stages import (
    choose_stage,
    evaluate_stage,
    identify_stage,
    round_gained,
    walks_to_identify,
)
from gaitval.study.inputs import GAIN, POLICY_FILES, round_errors, start_policy, stored
from gaitval.study.learning_stages import hand_on_stage, need_stage, train_stage
from gaitval.study.report_stages import body_stages, report_stage, validate_stage
from gaitval.study.scaling_stages import reference_stage, scale_stage
from gaitval.study.stage import INTERRUPTED, Observer, Run, Stage, run_stage, why_run
from gaitval.study.stored_policy import general_policy
from gaitval.study.unread import given, say_unread
from gaitval.study.walking_stages import correct_stage, push_stage, repeat_stage, simulate_stage

IN_WORKERS = (
    "gaitval.cli",  # a worker begins with what the main program imports
    "gaitval.correction.correct",
    "gaitval.metrics.epsilon",
    "gaitval.metrics.policy_comparison",
    "gaitval.metrics.push_recovery",
    "gaitval.metrics.repeats",
    "gaitval.metrics.rollouts",
)
"""Modules whose functions the stages run in worker processes."""


def choose_start(run: Run, stage: Stage, *, scratch: bool = False) -> None:
    """Put the general policy, from which the training `stage` of `run` starts, into `start/`;
    nothing with `scratch`, or if its observation or size is another.

    A training that is finished or under way keeps its start: a later call resumes or skips it.
    """
    start = run.folder / "start"
    with suppress(ArtefactError):  # one of its inputs is missing, so it is not finished
        if not scratch and why_run(stage, run.folder) in (None, INTERRUPTED):
            return
    shutil.rmtree(start, ignore_errors=True)
    if scratch:
        return
    general = general_policy(
        run.known_record().record, run.subject.leg_length_m, run.configuration.environment
    )
    if general is None:
        run.observer.say("There is no general policy to start from: training from nothing.")
        return
    try:
        start_policy(run, general)
    except PolicyError as error:
        run.observer.say(f"The general policy cannot be used, so training from nothing: {error}")
        return
    copy_files(general, start, POLICY_FILES)
    run.observer.say(
        f"Training starts from the general policy in {general} (with --scratch it would not)."
    )


def plan(run: Run, rounds: int) -> tuple[Stage, ...]:
    """All stages of `run` in order, with this number of `rounds` of Algorithm 1."""
    pairs = [
        stage(run, number)
        for number in range(1, rounds + 1)
        for stage in (need_stage, train_stage, identify_stage, hand_on_stage, evaluate_stage)
    ]
    return (
        scale_stage(run),
        reference_stage(run),
        *pairs,
        choose_stage(run, rounds),
        correct_stage(run),
        simulate_stage(run),
        repeat_stage(run),
        *body_stages(run),
        push_stage(run),
        validate_stage(run),
        report_stage(run),
    )


def run_subject(
    run: Run,
    *,
    scratch: bool = False,
    start: Path | None = None,
    force: bool = False,
    afterwards: Sequence[Callable[[Run], Stage]] = (),
) -> None:
    """The main job: every stage of `run` that is not up to date (all with `force`), with the loop
    of Algorithm 1.

    Training starts from the general policy, from nothing (`scratch`), or from the policy in the
    folder `start`. `afterwards` are stages of the validated walk, before the report, which links to
    what they write. Raises ConfigurationError if both are given, PolicyError if `start` is unfit.
    """
    if scratch and start is not None:
        raise ConfigurationError(
            f"a training starts from nothing or from {start}. Give one of --scratch and --start."
        )

    def do(stage: Stage) -> bool:
        return run_stage(stage, run.folder, force=force, observer=run.observer)

    if run.configuration.training.workers > 1:
        from gaitval.policy.workers import ready_to_start

        ready_to_start(*IN_WORKERS)  # beside the first stages
    if given(run.configuration):
        say_unread(run, plan(run, 1), "scratch" if scratch else "general")
    do(scale_stage(run))
    rounds, done = 0, False
    with ExitStack() as kept:

        def renew_workers() -> None:
            kept.close()  # they have grown by their walkers; new ones are forked when needed
            kept.enter_context(keeping_workers(run.configuration.training.workers))

        renew_workers()
        do(reference_stage(run))
        if start is not None:
            from gaitval.study.inputs import start_from

            start_from(run, start)
        else:
            choose_start(run, train_stage(run, 1), scratch=scratch)
        while not done:
            rounds += 1
            _train_and_identify(run, rounds, force=force)
            renew_workers()
            do(hand_on_stage(run, rounds))
            do(evaluate_stage(run, rounds))
            done, why = algorithm_1_ends(run, rounds)
            run.observer.say(f"Round {rounds} of Algorithm 1: {why}.")
        do(choose_stage(run, rounds))
        do(correct_stage(run))
        renew_workers()
        # the workers do one what the other leaves of their time
        walks, pushes = (simulate_stage(run), repeat_stage(run)), push_stage(_silent(run))
        _together(run, (*walks, *body_stages(run)), pushes, force=force)
        kept.close()
        do(validate_stage(run))
        further = [each(run) for each in afterwards]
        if run.knew_no_kinetics:
            from gaitval.study import estimate_stage  # which loads all that draws its page

            further.append(estimate_stage.stage(run))
        for stage in further:  # the report links to them
            force |= do(stage)
        do(report_stage(run))


def _train_and_identify(run: Run, round_number: int, *, force: bool) -> None:
    """The stages `need`, `train` and `identify` of a round. If identification uses no policy, in
    the first round it runs beside the training.
    """
    training = need_stage(run, round_number), train_stage(run, round_number)
    if round_number > 1 or walks_to_identify(run.configuration):
        for stage in (*training, identify_stage(run, round_number)):
            run_stage(stage, run.folder, force=force, observer=run.observer)
        return
    shown = _loading()
    identify = identify_stage(_silent(run), round_number)
    _together(run, training, identify, shown, force=force)


@contextmanager
def _loading() -> Iterator[None]:
    """Within the block, load what the report needs, which takes a second, while others work."""
    threading.Thread(target=load_report, daemon=True).start()
    yield


def load_report() -> None:
    """Load what a report needs."""
    import weasyprint  # noqa: F401

    from gaitval.reporting import report  # noqa: F401


def _silent(run: Run) -> Run:
    """`run` with nobody who sees its stages."""
    return replace(run, observer=Observer())


def _together(
    run: Run,
    stages: Sequence[Stage],
    other: Stage,
    shown: "AbstractContextManager[None] | None" = None,
    *,
    force: bool,
) -> None:
    """Run `stages` one after another, and beside them an `other` one that needs none of their
    files, if the run may have several processes; `shown` while only that one still runs.
    """
    both = force or (
        why_run(other, run.folder) and any(why_run(each, run.folder) for each in stages)
    )
    if run.configuration.training.workers == 1 or not both:
        for stage in (*stages, other):
            run_stage(stage, run.folder, force=force, observer=run.observer)
        return
    from gaitval.study.watching import run_beside

    run_beside(run, stages, other, shown, force=force)


def algorithm_1_ends(run: Run, rounds: int) -> tuple[bool, str]:
    """Whether Algorithm 1 needs no more than the first `rounds` of `run`, and why in words.

    A walker that still falls, or is pushed over, learns on as long as that helps. Else it ends when
    the walker is near enough to its reference, when nothing had to be learned, or when another
    round gains no more than the scatter over start phases. It ends after `identification.rounds`.
    """
    from gaitval.metrics.learning_gain import LearningGain
    from gaitval.metrics.tolerances import push_limit

    settings = run.configuration.identification
    errors = round_errors(run, rounds)
    epsilon, floor = errors.total, errors.floor
    if epsilon == float("inf"):
        shown = "the walk fell early"
    else:
        shown = (
            f"epsilon {epsilon:.3f}, {epsilon / floor:.2f} times the reference's own {floor:.3f} "
            f"(kappa {settings.kappa:g})"
        )
    gain = stored(run, f"rounds/{rounds}/policy/{GAIN}", LearningGain)
    if gain.samples and gain.standing.needs_training(push_limit()):
        if gain.trained_is_handed_on:
            return rounds >= settings.rounds, f"{shown}; it still needs training"
        return True, f"{shown}; it still needs training, but this one did not help"
    if epsilon < settings.kappa * floor:
        return True, shown
    if gain.samples == 0:
        return True, f"{shown}; nothing was learned, so another round would change nothing"
    if rounds > 1 and not round_gained(run, rounds):
        return True, f"{shown}; it gained no more than walks differ"
    return rounds >= settings.rounds, shown
