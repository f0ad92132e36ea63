"""The stages that identify the body, compare its walk with the record, choose the best round."""

from collections.abc import Sequence
from itertools import chain, pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import copy_file, copy_files, read_json, replacing, write_json
from gaitval.errors import ArtefactError
from gaitval.identification.prior import prior_sd
from gaitval.metrics.identified_body import identified_model
from gaitval.model.parameters import nominal_parameters
from gaitval.model.urdf import read_urdf
from gaitval.policy.processes import kept_workers
from gaitval.study.inputs import (
    GAIN,
    IDENTIFIED,
    POLICY_FILES,
    SIMULATION_SECTIONS,
    body_parameters,
    identified_task,
    round_errors,
    stored,
    stored_policy,
    walking_task,
)
from gaitval.study.scaling_stages import reference_of
from gaitval.study.stage import Run, Stage
from gaitval.study.stage_versions import STAGE_VERSIONS

if TYPE_CHECKING:
    from gaitval.arrays import Array
    from gaitval.configuration import Configuration
    from gaitval.metrics.results import FoundParameters


def identify_stage(run: Run, round_number: int) -> Stage:
    """Record, scaled body and reference of `run` → posterior of mu, and the reference of the
    identified body.

    It uses no policy, so every later `round_number` of Algorithm 1 copies the result of the first.
    Identification by rollouts walks with what the round has trained, and looks anew in each.
    """
    here = f"rounds/{round_number}/identification"
    before = f"rounds/{round_number - 1}/identification"
    names = ("identification.json", IDENTIFIED)
    walks = walks_to_identify(run.configuration)
    copied = round_number > 1 and not walks
    values = run.sections("seed", "contact", "record", "noise", "identification", "randomisation")
    # More rounds, or another threshold, do not change what is found.
    for name in ("rounds", "kappa"):
        del values["identification"][name]
    method = run.configuration.identification.method
    if walks:
        values |= run.sections(*SIMULATION_SECTIONS, "validation")

    def identify() -> None:
        if copied:
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
        version=STAGE_VERSIONS["identify"],
        inputs=(
            "subject.toml",
            "model.urdf",
            "reference.npz",
            *([f"{before}/{name}" for name in names] if copied else []),
            *([f"rounds/{round_number}/trained/{name}" for name in POLICY_FILES] if walks else []),
        ),
        outputs=tuple(f"{here}/{name}" for name in names),
        values=values,
        workspace=here,
    )


def walks_to_identify(configuration: "Configuration") -> bool:
    """Whether identification needs the policy of its round, as the paper's does."""
    return configuration.identification.method == "rollouts"


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
    """What the record of `run` says about mu, whose `prior` SD is (14,); `folder` is that of the
    round's identification.
    """
    from gaitval.identification.begin import begin
    from gaitval.subjects.prediction.known import quantities_known
    from gaitval.walk.reference.motion import ReferenceMotion

    record, model = run.known_record().record, read_urdf(run.folder / "model.urdf")
    configuration = run.configuration
    # whether the record's kinetics are the person's own
    own = "moments" in quantities_known(run.subject, configuration.record)
    progress = run.observer.progress
    from gaitval.identification.default import shared_identification
    from gaitval.identification.rollouts import rollouts_identification

    near = ReferenceMotion.load(run.folder / "reference.npz")
    fit, solution = begin(record, model, prior, configuration, own, near)
    if configuration.identification.method == "shared":
        return shared_identification(
            fit, solution, run.subject, record, model, configuration, progress
        )
    policy = stored_policy(run, folder.parent / "trained")
    return rollouts_identification(fit, record, model, policy, configuration, progress)


def save_identified_reference(run: Run, folder: Path) -> None:
    """Write the reference of the body in `folder`/identification.json beside it, for `run`."""
    from gaitval.model.parameters import apply_parameters
    from gaitval.walk.reference.motion import ReferenceMotion

    mu = body_parameters(folder / "identification.json")
    if np.array_equal(mu[2:], nominal_parameters()[2:]):  # as scaled, whose reference there is
        copy_file(run.folder / "reference.npz", folder / IDENTIFIED)
        return
    model = identified_model(
        read_urdf(run.folder / "model.urdf"), read_json(folder / "identification.json")
    )
    scaled = ReferenceMotion.load(run.folder / "reference.npz")
    reference_of(run, apply_parameters(model, mu), scaled).save(folder / IDENTIFIED)


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
        from gaitval.metrics.learning_gain import LearningGain, RoundErrors
        from gaitval.metrics.reference_curves import floor_of
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
            started = {}
            for which, each in tasks.items():
                mu = body_parameters(run.folder / identification, which)
                walks = [Walks(policy, mu, phases) for phases in groups]
                # both bodies are given to the workers before the results of either are awaited
                started[which] = pool.with_task(each).each_together(epsilons, walks)
            walked = {which: list(chain.from_iterable(parts)) for which, parts in started.items()}
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
        version=STAGE_VERSIONS["evaluate"],
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
    from gaitval.metrics.tolerances import push_limit

    numbers = range(1, rounds + 1)

    def choose() -> None:
        from gaitval.metrics.learning_gain import LearningGain
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
        version=STAGE_VERSIONS["choose"],
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
        values={"push_limit": push_limit()},
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


def round_gained(run: Run, round_number: int) -> bool:
    """Whether `round_number` of `run` lowered epsilon by more than its scatter over starts."""
    before, after = round_errors(run, round_number - 1), round_errors(run, round_number)
    if before.identified is None or after.identified is None:
        return before.identified is None
    return after.total < before.total - max(before.scatter or 0.0, after.scatter or 0.0)
