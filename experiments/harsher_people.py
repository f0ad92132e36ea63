"""Identify virtual people of a world that is harsher than the harsh one, and keep what was found.

    python -m experiments.harsher_people --seed 5101 --people 24 --store runs/harsher.json

An outsider's world: skin of the thigh turns with the hip and wobbles after heel strike, that of the
shank with the knee and with the load on it, that of the foot with the ankle, all with 40 % between
the sides; the belt is reported 2 % fast; soles are .35 to 2 times as stiff, thighs .85 to 1.25
times as heavy; a leg that is longer is so in one segment. Every second person also holds one knee
more flexed, by 5 to 20 degrees, and has zeros of angles that differ by side. Nothing of it is taken
from the fit or from how `gaitval.apps.virtual.harsh` draws; sizes are at the upper end of the
literature.
Every third person's legs differ by 12 to 25 mm, the others' as people's do.

Constants are chosen on people of `CHOSEN_ON`; the claims are made of the others, whose seed follows
from a rule. Interrupted, the same command resumes.
"""

import argparse
import hashlib
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from experiments.bodies import as_scaled, fit_of, person_of
from experiments.harsh_people import all_of, leg
from gaitval.apps.virtual.harsh import Faults, HarshPerson, seen_with
from gaitval.apps.virtual.person import drawn_parameters
from gaitval.configuration import load_configuration
from gaitval.datasets.subject import Subject
from gaitval.errors import GaitvalError
from gaitval.identification.prior import prior_sd
from gaitval.identification.shared_errors import identified
from gaitval.identification.verdicts import WEAK
from gaitval.measurement.sources import NINETY
from gaitval.metrics.comparison import rms
from gaitval.policy.storage import load_start
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "harsher.json"
CHOSEN_ON: Final = 5101
RULE: Final = f"gaitval: harsher virtual people, {'issue'} 79"
SEED: Final = int(hashlib.sha256(RULE.encode()).hexdigest()[:8], 16) % 100_000
DEGREE: Final = np.pi / 180.0
_WORLD: Final = 5
"""Third number of the seed, so that these draws are not another world's."""


class Held(NamedTuple):
    """A knee that is held more flexed than the record has it: by how much, rad, and whose."""

    angle: float
    side: str


def drawn_faults(random: np.random.Generator, number: int) -> tuple[Faults, Held]:
    """Faults of person `number`, and how they walk."""

    def one(sd: float, mean: float = 0.0) -> float:
        return float(mean + sd * np.clip(random.standard_normal(), -2.5, 2.5))

    def pair(sd: float, mean: float = 0.0) -> tuple[float, float]:
        both = one(sd, mean)
        apart = 0.4 * abs(both) * random.standard_normal()
        return both + 0.5 * apart, both - 0.5 * apart

    differ, posture = number % 3 == 2, number % 2 == 1
    sign = float(random.choice([-1.0, 1.0]))
    axes = (2.5 if posture else 1.4) * DEGREE
    faults = Faults(
        thigh_by_hip=pair(0.04, -0.06),
        shank_by_knee=pair(0.03, -0.02),
        foot_by_ankle=pair(0.05, -0.03),
        shank_by_load=pair(0.7 * DEGREE),
        wobble=pair(0.5 * DEGREE, 1.0 * DEGREE),
        belt=0.02,
        axes=tuple(tuple(one(axes) for _ in range(3)) for _ in range(2)),
        pelvis=one(1.4 * DEGREE),
        sole=(
            float(random.uniform(np.log(0.35), np.log(2.0))),
            one(0.4),
            one(0.01),
            one(0.01),
        ),
        thigh_mass=float(random.uniform(0.85, 1.25)),
        trunk=(one(0.015), one(0.02)),
        arms=float(np.exp(one(0.3))),
        left_leg=sign * float(random.uniform(0.012, 0.025)) if differ else one(0.0065),
        longer="thigh" if random.choice(["thigh", "shank"]) == "thigh" else "shank",
    )
    held = float(random.uniform(5.0, 20.0)) * DEGREE if posture else 0.0
    return faults, Held(held, str(random.choice(["r", "l"])))


def held_flexed(person: Subject, held: Held) -> Subject:
    """The gait of a person with one knee more flexed, and hip and ankle half as much."""
    if not held.angle:
        return person
    angles = dict(person.gait.angles)
    for name, share in (("hip_flexion", 0.5), ("knee_angle", 1.0), ("ankle_angle", 0.5)):
        key = f"{name}_{held.side}"
        angles[key] = angles[key].model_copy(update={"mean": angles[key].mean + share * held.angle})
    gait = person.gait.model_copy(update={"angles": angles})
    return person.model_copy(update={"gait": gait})


def harsher_person(number: int, seed: int, person: Subject) -> HarshPerson:
    """The person of this `number` and `seed`, drawn around `person` as `harsh.harsh_person` does.
    Raises VirtualError if they fall.
    """
    configuration = load_configuration()
    policy = load_start(ROOT / "reports" / "general", configuration.environment)
    random = np.random.default_rng([seed, number, _WORLD])
    truth = drawn_parameters(prior_sd(person), random)
    faults, held = drawn_faults(random, number)
    return seen_with(
        faults, number, seed, truth, person, held_flexed(person, held), policy, configuration,
        random, world="X",
    )  # fmt: skip


def one(number: int, seed: int) -> dict[str, Any]:
    """What was found of one person, for a file."""
    about = {"number": number, "seed": seed, "by": "stature" if number // 2 % 2 else "markers"}
    try:
        person = harsher_person(number, seed, person_of(number))
    except GaitvalError as error:
        return about | {"refused": str(error)}
    began = time.process_time()
    fit, model = fit_of(person.subject), scale_subject(person.subject).model
    found = identified(fit, as_scaled(fit, person.subject))
    mean, sd = found.legs.estimate
    return about | {
        "faults": person.about(),
        "truth": person.truth.tolist(),
        "prior_mean": found.posterior.prior_mean.tolist(),
        "prior_sd": found.posterior.prior_sd.tolist(),
        "mean": found.posterior.mean.tolist(),
        "sd": found.posterior.sd.tolist(),
        "leg": leg(found.posterior, model, person.truth),
        "leg_difference": {"truth": person.faults.left_leg, "mean": mean, "sd": sd},
        "deviance": found.cost,
        "processor_seconds": time.process_time() - began,
    }


def said(people: Sequence[Mapping[str, Any]]) -> str:
    """The table of the docs: legs, parameters, differences of legs."""
    rows = []
    for by in ("markers", "stature"):
        legs = [each["leg"] for each in people if each.get("leg") and each["by"] == by]
        scaled, mean = (np.array([leg[name] for leg in legs]) for name in ("truth", "mean"))
        off = scaled - mean
        held = [abs(o) <= NINETY * leg["sd"] for o, leg in zip(off, legs, strict=True)]
        rows.append(
            f"{by}: {len(legs)} people, leg {100 * rms(scaled):.2f} -> {100 * rms(off):.2f} cm, "
            f"ratio {rms(off) / rms(scaled):.2f}, 90 % hold {100 * np.mean(held):.0f} %"
        )
    every, weak, differ = [], [], []
    for each in people:
        if "leg" not in each:
            continue
        truth, mean, sd, before = (
            np.array(each[key])[2:] for key in ("truth", "mean", "sd", "prior_sd")
        )
        inside = np.abs(truth - mean) <= NINETY * sd
        every += inside.tolist()
        weak += inside[sd / before <= WEAK].tolist()
        apart = each["leg_difference"]
        differ.append(abs(apart["truth"] - apart["mean"]) <= NINETY * apart["sd"])
    rows.append(
        f"parameters: 90 % hold {100 * np.mean(every):.0f} % of {len(every)}, of {len(weak)} weak "
        f"ones {100 * np.mean(weak) if weak else np.nan:.0f} %; differences of legs: "
        f"{100 * np.mean(differ):.0f} % of {len(differ)}"
    )
    return "\n".join(rows)


def main() -> None:
    """Command line; see the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--people", type=int, default=40, help="how many")
    parser.add_argument("--store", type=Path, default=STORE)
    arguments = parser.parse_args()
    wanted = [(arguments.seed, number) for number in range(arguments.people)]
    print(said(all_of(wanted, one, arguments.store)))


if __name__ == "__main__":
    main()
