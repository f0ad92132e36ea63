"""Identify virtual people, whose true bodies are known, and keep what was found.

    python -m experiments.virtual_people --people 40 --seed 1

Person n of a seed is drawn around built-in subject 1 + n // 2 % 10; every other pair of them was
measured by markers, the others by stature alone. Writes `reports/identification/virtual.json` after
every person; interrupted, the same command resumes. With --walks the general policy also walks each
of them as scaled and as identified, and epsilon against the person's record is kept.
`evidence/identification/bodies.py` makes tables of it.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from experiments.real_people import fit_of
from gaitval.apps.virtual.person import virtual_person
from gaitval.artefacts import read_json, versions, write_json
from gaitval.configuration import Configuration, load_configuration
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import GaitvalError
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.identification.combinations import combinations, judged_combinations
from gaitval.identification.posterior import walked_with
from gaitval.identification.verdicts import judged
from gaitval.metrics.comparison import curves_of
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.epsilon import epsilon
from gaitval.model.body import BodyModel
from gaitval.model.parameters import nominal_parameters
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import record_rollout
from gaitval.policy.storage import Policy, load_start
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.walker import WalkingTask

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "virtual.json"


def person_of(number: int) -> Subject:
    """Whom a virtual person is drawn around."""
    person = load_subject(1 + number // 2 % 10)
    if number // 2 % 2:
        return person.model_copy(update={"markers": {}})
    return person


def walked(
    subject: Subject, model: BodyModel, mu: Any, policy: Policy, configuration: Configuration
) -> float | None:
    """Epsilon of the general policy's walk with mu against the subject's record."""
    record = subject.record()
    task = WalkingTask.of(model, record, configuration, mu=mu)
    validation = configuration.validation
    rollout = record_rollout(
        WalkingEnvironment(task), policy, mu=mu, start_phase=0.0,
        cycles=validation.settling_cycles + 14,
    )  # fmt: skip
    curves = curves_of(task, rollout, find_cycles(rollout, configuration).first(12))
    found = epsilon(curves, recorded_curves(record))
    return None if found is None else found.total


def one(number: int, seed: int, walks: bool) -> dict[str, Any]:
    """What was found of one person."""
    configuration = load_configuration()
    policy = load_start(ROOT / "reports" / "general", configuration.environment)
    around = person_of(number)
    about: dict[str, Any] = {
        "number": number,
        "seed": seed,
        "around": around.identifier,
        "by": "markers" if around.markers else "stature",
    }
    try:
        person = virtual_person(number, seed, around, policy, configuration)
    except GaitvalError as error:
        return about | {"refused": str(error)}
    subject, model = person.subject, scale_subject(person.subject).model
    fit = fit_of(subject)
    held = fit.solve(fixed=nominal_parameters())
    posterior = fit.posterior(fit.mode(held))
    verdicts = judged(posterior)
    identified = walked_with(posterior, verdicts)
    about |= {
        "truth": person.truth.tolist(),
        "prior_mean": posterior.prior_mean.tolist(),
        "prior_sd": posterior.prior_sd.tolist(),
        "mean": posterior.mean.tolist(),
        "sd": posterior.sd.tolist(),
        "verdicts": [each.verdict for each in verdicts],
        "identified": identified.tolist(),
        "deviance": [held.cost, -2.0 * posterior.log_posterior],
        "combinations": [
            asdict(each) | {"truth": float(sum_.weights @ (person.truth - posterior.prior_mean))}
            for each, sum_ in zip(
                judged_combinations(posterior, model), combinations(model), strict=True
            )
        ],
    }
    if walks:
        about["epsilon"] = {
            name: walked(subject, model, mu, policy, configuration)
            for name, mu in (("nominal", nominal_parameters()), ("identified", identified))
        }
    return about


def of_truth(each: dict[str, Any]) -> dict[str, Any]:
    """A stored person, with epsilon of the walks of their identified and their true body: the most
    that could be gained by knowing it.
    """
    configuration = load_configuration()
    policy = load_start(ROOT / "reports" / "general", configuration.environment)
    number, seed = each["number"], each["seed"]
    person = virtual_person(number, seed, person_of(number), policy, configuration)
    model = scale_subject(person.subject).model
    bodies = {"identified": np.array(each["identified"]), "truth": person.truth}
    found = {
        name: walked(person.subject, model, mu, policy, configuration)
        for name, mu in bodies.items()
    }
    return each | {"epsilon": each["epsilon"] | found}


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--walks", action="store_true")
    parser.add_argument("--truth", type=int, default=0, metavar="N", help="walk N true bodies too")
    arguments = parser.parse_args()
    stored = read_json(STORE)["people"] if STORE.exists() else []
    stored = [each for each in stored if each["seed"] == arguments.seed]
    done = {each["number"] for each in stored}
    wanted = [number for number in range(arguments.people) if number not in done]
    with ProcessPoolExecutor(arguments.workers) as pool:
        jobs = [pool.submit(one, number, arguments.seed, arguments.walks) for number in wanted]
        for job in as_completed(jobs):
            stored = sorted([*stored, job.result()], key=lambda each: each["number"])
            write_json(STORE, {"versions": versions(), "people": stored})
            print(f"{len(stored)} of {arguments.people}", flush=True)
        unknown = [
            each
            for each in stored[: arguments.truth]
            if each.get("epsilon") and "truth" not in each["epsilon"]
        ]
        for walk in as_completed([pool.submit(of_truth, each) for each in unknown]):
            known = walk.result()
            stored = [known if each["number"] == known["number"] else each for each in stored]
            write_json(STORE, {"versions": versions(), "people": stored})
            print(f"truth of {known['number']}: {known['epsilon']}", flush=True)


if __name__ == "__main__":
    main()
