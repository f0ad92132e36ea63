"""Identify virtual people of the harsh world, with and without shared errors, and keep what was
found.

    python -m experiments.harsh_people

Seeds are not chosen: each is the first eight hexadecimal digits of the SHA-256 of one of `RULES`,
modulo 100,000, so it was not used while anything was written (a first rule gave the 64 people of
seed 66889, on whom constants were chosen later). Person n is drawn around built-in subject
1 + n // 2 % 10; every other pair is measured by markers, the others by stature alone. Of the second
seed, which was asked when legs by stature of the first had too wide an interval, only those by
stature count; how many was set before. Every fourth person, as often of these as of those, has a
left leg that is 20 to 30 mm longer or shorter; the others' legs differ as people's do. Each is also
identified with a range-of-motion trial. At the end the first `WALKED` of them walk with the general
policy, as scaled, as identified and with their true body. Writes
`reports/identification/harsh.json` after every person; interrupted, the same command resumes.
`claims/identification.py` reads it.
"""

import argparse
import hashlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from experiments.bodies import as_scaled, fit_of, person_of, walked
from gaitval.apps.virtual.harsh import HarshPerson, harsh_person
from gaitval.apps.virtual.range_of_motion import functional_legs
from gaitval.artefacts import read_json, versions, write_json
from gaitval.configuration import Configuration, load_configuration
from gaitval.coordinates import Side
from gaitval.errors import GaitvalError
from gaitval.identification.joints import (
    ANKLE,
    KNEE,
    FunctionalLeg,
    judged_lengths,
    lengths,
    with_joints,
)
from gaitval.identification.prior import measured_by
from gaitval.identification.shared_errors import identified
from gaitval.model.body import BodyModel
from gaitval.model.parameters import apply_parameters, nominal_parameters
from gaitval.policy.storage import load_start
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "harsh.json"
PLAIN: Final = 10
"""People who are also identified without shared errors."""
WALKED: Final = 24
"""People who also walk."""
RULES: Final = tuple(
    f"gaitval: harsh virtual people, {'issue'} 40, {which}" for which in ("second", "third")
)
SEEDS: Final = tuple(
    int(hashlib.sha256(rule.encode()).hexdigest()[:8], 16) % 100_000 for rule in RULES
)
PEOPLE: Final = tuple(
    (seed, number)
    for seed, count in zip(SEEDS, (96, 208), strict=True)
    for number in range(count)
    if seed == SEEDS[0] or number // 2 % 2
)
"""Seed and number of everybody."""


def planted(number: int, seed: int) -> float | None:
    """m, by which the left leg of this person is longer; None: as people's are."""
    if number % 8 not in (3, 5):
        return None
    random = np.random.default_rng([seed, number, 3])
    return float(random.choice([-1.0, 1.0]) * random.uniform(0.020, 0.030))


def leg(posterior: Any, model: Any, truth: Any, index: int = 0) -> dict[str, float]:
    """Thigh + shank (or another of `lengths`), m about the scaled one: truth, mean, SD, prior's
    SD.
    """
    found = judged_lengths(posterior, model)[index]
    true = float(lengths(model)[index].weights @ (truth - posterior.prior_mean))
    return {"truth": true, "mean": found.mean, "sd": found.sd, "prior_sd": found.prior_sd}


def legs_of(
    person: HarshPerson, model: BodyModel, configuration: Configuration, number: int, seed: int
) -> dict[Side, FunctionalLeg]:
    """What a range-of-motion trial finds of a person's legs, against the body as scaled.

    Who was scaled by markers was scaled by the palpated knee, so only the functional one is new;
    who was scaled by stature alone is palpated for the first time.
    """
    true, _ = person.faults.body(apply_parameters(model, person.truth), configuration.contact)
    random = np.random.default_rng([seed, number, 4])
    found: dict[Side, FunctionalLeg] = {}
    for side, leg in functional_legs(true, random).items():
        hip, knee, ankle = (model[f"{name}_{side[0]}"].joint_position for name in
                            ("thigh", "shank", "foot"))  # fmt: skip
        height, error = leg.knee.point[2], KNEE
        if measured_by(person.subject)["shank_length"] != "markers":
            weights = np.array([KNEE, ANKLE]) ** -2.0
            height = weights @ [height, leg.palpated_knee[2]] / weights.sum()
            error = float(weights.sum() ** -0.5)
        found[side] = FunctionalLeg(
            difference=leg.hip.centre - hip,
            longer=float(leg.hip.centre[2] - leg.ankle[2] + knee[2] + ankle[2]),
            standard_error=leg.hip.standard_error,
            shank_longer=float(height - leg.ankle[2] + ankle[2]),
            knee_error=error,
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
    fixed = as_scaled(fit, person.subject)
    found = identified(fit, fixed)
    seconds = time.process_time() - began
    if number < PLAIN:
        # The same record without shared errors among the unknowns, for comparison.
        plain = fit.posterior(fit.mode(fixed))
        about["plain"] = {
            "mean": plain.mean.tolist(),
            "sd": plain.sd.tolist(),
            "leg": leg(plain, model, person.truth),
        }
    posterior, faults = found.posterior, person.faults
    joints = with_joints(posterior, model, legs_of(person, model, configuration, number, seed))
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
            **{
                each.name: leg(joints, model, person.truth, index)
                for index, each in enumerate(lengths(model))
                if index
            },
        },
        # A longer leg and a lower hip centre are one to the ground.
        "leg_difference": {
            "truth": faults.left_leg - faults.left_hip[1],
            "found": found.legs.found,
            "found_sd": found.legs.found_sd,
            "prior_sd": found.legs.prior_sd,
        },
        "deviance": [fixed.cost, found.cost],
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


def all_of(
    wanted: Sequence[tuple[int, int]], one: Callable[[int, int], dict[str, Any]], store: Path
) -> list[dict[str, Any]]:
    """What `one` finds of each seed and number; what the file `store` has is not found again."""
    stored: list[dict[str, Any]] = read_json(store)["people"] if store.exists() else []
    done = {(each["seed"], each["number"]) for each in stored}
    for seed, number in wanted:
        if (seed, number) not in done:
            stored.append(one(number, seed))
            write_json(store, {"versions": versions(), "people": stored})
            print(f"{len(stored)} of {len(wanted)}", flush=True)
    return stored


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, help="of other people, to develop with")
    parser.add_argument("--people", type=int, default=96, help="how many of this seed")
    parser.add_argument("--store", type=Path, default=STORE)
    arguments = parser.parse_args()
    others = tuple((arguments.seed, number) for number in range(arguments.people))
    stored = all_of(PEOPLE if arguments.seed is None else others, one, arguments.store)
    for each in stored[:WALKED]:
        if "refused" not in each and "epsilon" not in each:
            each["epsilon"] = epsilons(each)
            write_json(arguments.store, {"versions": versions(), "people": stored})
            print(f"walks of {each['number']}: {each['epsilon']}", flush=True)


if __name__ == "__main__":
    main()
