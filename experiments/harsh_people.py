"""Identify virtual people of the harsh world, with and without shared errors, and keep what was
found.

    python -m experiments.harsh_people --people 64

The seed is not chosen: it is the first eight hexadecimal digits of the SHA-256 of `RULE`, modulo
100,000, so it was not used while anything was written. Person n is drawn around built-in subject
1 + n // 2 % 10; every other pair is measured by markers, the others by stature alone. Every fourth
has a left leg that is 20 to 30 mm longer or shorter; the others' legs differ as people's do. Each
is also identified with a range-of-motion trial. At the end the first `WALKED` of them walk with the
general policy, as scaled, as identified and with their true body. Writes
`reports/identification/harsh.json` after every person; interrupted, the same command resumes.
`evidence/identification/strangers.py` makes rows of it.
"""

import argparse
import hashlib
import time
from pathlib import Path
from typing import Any, Final

import numpy as np

from experiments.real_people import fit_of
from experiments.virtual_people import person_of, walked
from gaitval.artefacts import read_json, versions, write_json
from gaitval.configuration import Configuration, load_configuration
from gaitval.coordinates import Side
from gaitval.errors import GaitvalError
from gaitval.identification.verdicts import combinations, judged_combinations
from gaitval.model.body import BodyModel
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.policy.storage import load_start
from gaitval.scaling.scaling import scale_subject
from gaitval_bodies.joints import FunctionalHip, with_joints
from gaitval_bodies.shared_errors import identified
from gaitval_virtual.harsh import HarshPerson, harsh_person
from gaitval_virtual.range_of_motion import functional_hips

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "harsh.json"
PLAIN: Final = 10
"""People who are also identified without shared errors."""
WALKED: Final = 24
"""People who also walk."""
RULE: Final = "gaitval: harsh virtual people, " + "issue" + " 40"
SEED: Final = int(hashlib.sha256(RULE.encode()).hexdigest()[:8], 16) % 100_000


def planted(number: int, seed: int) -> float | None:
    """m, by which the left leg of this person is longer; None: as people's are."""
    if number % 4 != 3:
        return None
    random = np.random.default_rng([seed, number, 3])
    return float(random.choice([-1.0, 1.0]) * random.uniform(0.020, 0.030))


def leg(posterior: Any, model: Any, truth: Any, index: int = 0) -> dict[str, float]:
    """Thigh + shank (or hip to ankle, 1), m about the scaled one: truth, mean, SD, prior's SD."""
    found = judged_combinations(posterior, model)[index]
    true = float(combinations(model)[index].weights @ (truth - posterior.prior_mean))
    return {"truth": true, "mean": found.mean, "sd": found.sd, "prior_sd": found.prior_sd}


def hips_of(
    person: HarshPerson, model: BodyModel, configuration: Configuration, number: int, seed: int
) -> dict[Side, FunctionalHip]:
    """What a range-of-motion trial finds of a person's hips, against the body as scaled."""
    true, _ = person.faults.body(apply_parameters(model, person.truth), configuration.contact)
    random = np.random.default_rng([seed, number, 4])
    found: dict[Side, FunctionalHip] = {}
    for side, hip in functional_hips(true, random).items():
        joints = {name: model[f"{name}_{side[0]}"].joint_position for name in
                  ("thigh", "shank", "foot")}  # fmt: skip
        scaled = -float(joints["shank"][2] + joints["foot"][2])
        found[side] = FunctionalHip(
            difference=hip.found.centre - joints["thigh"],
            longer=hip.to_ankle - scaled,
            standard_error=hip.found.standard_error,
        )
    return found


def one(number: int, seed: int) -> dict[str, Any]:
    """What was found of one person."""
    configuration = load_configuration()
    policy = load_start(ROOT / "reports" / "general", configuration.environment)
    around, left = person_of(number), planted(number, seed)
    about: dict[str, Any] = {
        "number": number,
        "seed": seed,
        "around": around.identifier,
        "by": "markers" if around.markers else "stature",
        "planted_left_leg": left,
    }
    try:
        person = harsh_person(number, seed, around, policy, configuration, left_leg=left)
    except GaitvalError as error:
        return about | {"refused": str(error)}
    began = time.process_time()
    fit, model = fit_of(person.subject), scale_subject(person.subject).model
    held = fit.solve(fixed=nominal_parameters())
    found = identified(fit, held)
    seconds = time.process_time() - began
    if number < PLAIN:
        # The same record without shared errors among the unknowns, for comparison.
        plain = fit.posterior(fit.mode(held))
        about["plain"] = {
            "mean": plain.mean.tolist(),
            "sd": plain.sd.tolist(),
            "leg": leg(plain, model, person.truth),
        }
    posterior, faults = found.posterior, person.faults
    joints = with_joints(posterior, model, hips_of(person, model, configuration, number, seed))
    return about | {
        "faults": person.about(),
        "truth": person.truth.tolist(),
        "prior_mean": posterior.prior_mean.tolist(),
        "prior_sd": posterior.prior_sd.tolist(),
        "mean": posterior.mean.tolist(),
        "sd": posterior.sd.tolist(),
        "shared": found.values.tolist(),
        "shared_sd": found.sd.tolist(),
        "leg": leg(posterior, model, person.truth),
        "joints": {
            "mean": joints.mean.tolist(),
            "sd": joints.sd.tolist(),
            "leg": leg(joints, model, person.truth),
            "hip to ankle": leg(joints, model, person.truth, 1),
        },
        # A longer leg and a lower hip centre are one to the ground.
        "leg_difference": {
            "truth": faults.left_leg - faults.left_hip[1],
            "found": found.legs.found,
            "found_sd": found.legs.found_sd,
            "prior_sd": found.legs.prior_sd,
        },
        "deviance": [held.cost, found.cost],
        "left": found.left,
        "processor_seconds": seconds,
    }


def epsilons(each: dict[str, Any]) -> dict[str, float | None]:
    """Epsilon of the general policy's walks of a stored person, by the body that walks."""
    configuration = load_configuration()
    policy = load_start(ROOT / "reports" / "general", configuration.environment)
    number, seed = each["number"], each["seed"]
    person = harsh_person(
        number, seed, person_of(number), policy, configuration, left_leg=each["planted_left_leg"]
    )
    model = scale_subject(person.subject).model
    bodies = {
        "scaled": nominal_parameters(), "identified": np.array(each["mean"]),
        "truth": person.truth,
    }  # fmt: skip
    return {
        name: walked(person.subject, model, mu, policy, configuration)
        for name, mu in bodies.items()
    }


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=64)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--store", type=Path, default=STORE)
    arguments = parser.parse_args()
    stored = read_json(arguments.store)["people"] if arguments.store.exists() else []
    stored = [each for each in stored if each["seed"] == arguments.seed]
    done = {each["number"] for each in stored}
    for number in range(arguments.people):
        if number not in done:
            stored.append(one(number, arguments.seed))
            write_json(arguments.store, {"versions": versions(), "people": stored})
            print(f"{len(stored)} of {arguments.people}", flush=True)
    for each in stored[:WALKED]:
        if "refused" not in each and "epsilon" not in each:
            each["epsilon"] = epsilons(each)
            write_json(arguments.store, {"versions": versions(), "people": stored})
            print(f"walks of {each['number']}: {each['epsilon']}", flush=True)


if __name__ == "__main__":
    main()
