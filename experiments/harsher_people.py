"""Identify virtual people of a world that is harsher than the harsh one, and keep what was found.

    python -m experiments.harsher_people --seed 5101 --people 24 --store runs/harsher.json

An outsider's world: skin of the thigh turns with the hip and wobbles after heel strike, that of the
shank with the knee and with the load on it, that of the foot with the ankle, all with 40 % between
the sides; the belt is reported 2 % fast; soles are .35 to 2 times as stiff, thighs .85 to 1.25
times as heavy; a leg that is longer is so in one segment. Every second person also holds one knee
more flexed, by 5 to 20 degrees, and has zeros of angles that differ by side. Nothing of it is taken
from the fit or from `gaitval.apps.virtual.harsh`; sizes are at the upper end of the literature.
Every third person's legs differ by 12 to 25 mm, the others' as people's do.

Constants are chosen on people of `CHOSEN_ON`; the claims are made of the others, whose seed follows
from a rule. Interrupted, the same command resumes.
"""

import argparse
import hashlib
import pickle
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from experiments.bodies import as_scaled, fit_of, person_of
from experiments.harsh_people import leg
from gaitval.apps.virtual.harsh import with_arms_swung
from gaitval.apps.virtual.person import as_subject, drawn_parameters, seen, walked, with_errors
from gaitval.arrays import Array
from gaitval.artefacts import read_json, versions, write_json
from gaitval.configuration import Configuration, ContactSettings, load_configuration
from gaitval.coordinates import SIDES
from gaitval.datasets.subject import Subject
from gaitval.errors import GaitvalError
from gaitval.gait.cycle_curves import Curves
from gaitval.identification.prior import prior_sd
from gaitval.identification.shared_errors import identified
from gaitval.identification.verdicts import WEAK
from gaitval.measurement.sources import NINETY
from gaitval.model.body import BodyModel, Segment
from gaitval.model.extended import extended_body
from gaitval.policy.storage import Policy, load_start
from gaitval.reference.motion import ReferenceMotion
from gaitval.scaling.scaling import scale_subject

ROOT = Path(__file__).resolve().parent.parent
STORE = ROOT / "reports" / "identification" / "harsher.json"
CHOSEN_ON: Final = 5101
RULE: Final = f"gaitval: harsher virtual people, {'issue'} 79"
SEED: Final = int(hashlib.sha256(RULE.encode()).hexdigest()[:8], 16) % 100_000
DEGREE: Final = np.pi / 180.0
_WORLD: Final = 5
"""Third number of the seed, so that these draws are not another world's."""
_OWN_OFFSET: Final = 0.009
"""rad, of every joint beside those of the segments' axes."""


@dataclass(frozen=True)
class HarsherFaults:
    """What is wrong in one record; right, left where there are two.

    Attributes
    ----------
    thigh_by_hip, shank_by_knee, foot_by_ankle : shares of a joint's excursion by which skin turns
        further than its bone.
    shank_by_load : rad a body weight.
    wobble : rad, of the thigh's skin at heel strike; it decays.
    belt : share by which the speed is reported too large.
    axes : (2, 3) rad, of thigh's, shank's and foot's axes in the sagittal plane.
    pelvis : rad, of the pelvis' axes, forward.
    sole : (4,) logarithms of stiffness and dissipation, m of heel and forefoot.
    thigh_mass : factor.
    trunk : (2,) m, forward, up.
    arms : factor on their swing.
    left_leg : m, by which the left leg is longer.
    segment : in which one.
    held : rad, by which one knee is held more flexed than the record that is walked.
    held_side : whose.
    """

    thigh_by_hip: tuple[float, float]
    shank_by_knee: tuple[float, float]
    foot_by_ankle: tuple[float, float]
    shank_by_load: tuple[float, float]
    wobble: tuple[float, float]
    belt: float
    axes: tuple[tuple[float, ...], tuple[float, ...]]
    pelvis: float
    sole: tuple[float, ...]
    thigh_mass: float
    trunk: tuple[float, float]
    arms: float
    left_leg: float
    segment: str
    held: float
    held_side: str

    def body(self, model: BodyModel, contact: ContactSettings) -> tuple[BodyModel, ContactSettings]:
        """The body that walks, and the ground under it; see `person.Another`."""
        model, contact = extended_body(model, contact, np.array([*self.sole, 0.0]))
        thighs = [each.mass for each in model.segments if each.kind == "thigh"]
        added = (self.thigh_mass - 1.0) * sum(thighs)

        def changed(segment: Segment) -> Segment:
            factor, joint, centre = 1.0, segment.joint_position, segment.centre_of_mass
            if segment.kind == "thigh":
                factor = self.thigh_mass
            if segment.name == "torso":
                factor = 1.0 - added / segment.mass
                centre = centre + np.array([self.trunk[0], 0.0, self.trunk[1]])
            # A segment is as long as its lower joint is below its upper one.
            if segment.kind == {"thigh": "shank", "shank": "foot"}[self.segment]:
                sign = -1.0 if segment.side == "left" else 1.0
                joint = joint + np.array([0.0, 0.0, sign * 0.5 * self.left_leg])
            return replace(
                segment, joint_position=joint, mass=factor * segment.mass,
                centre_of_mass=centre, inertia=factor * segment.inertia,
            )  # fmt: skip

        return replace(model, segments=tuple(map(changed, model.segments))), contact

    def motion(self, reference: ReferenceMotion, model: BodyModel) -> ReferenceMotion:
        """The motion with arms that swing otherwise."""
        return with_arms_swung(reference, model, self.arms)


def drawn_faults(random: np.random.Generator, number: int) -> HarsherFaults:
    """Faults of person `number`."""

    def one(sd: float, mean: float = 0.0) -> float:
        return float(mean + sd * np.clip(random.standard_normal(), -2.5, 2.5))

    def pair(sd: float, mean: float = 0.0) -> tuple[float, float]:
        both = one(sd, mean)
        apart = 0.4 * abs(both) * random.standard_normal()
        return both + 0.5 * apart, both - 0.5 * apart

    differ, posture = number % 3 == 2, number % 2 == 1
    sign = float(random.choice([-1.0, 1.0]))
    axes = (2.5 if posture else 1.4) * DEGREE
    return HarsherFaults(
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
        segment=str(random.choice(["thigh", "shank"])),
        held=float(random.uniform(5.0, 20.0)) * DEGREE if posture else 0.0,
        held_side=str(random.choice(["r", "l"])),
    )


def _excursion(curve: Array) -> Array:
    return np.asarray(curve - curve[:-1].mean())


def seen_by(curves: Curves, faults: HarsherFaults) -> Curves:
    """True `curves` (101,) each, rad, Nm/kg and body weights, as this laboratory sees them."""
    found = Curves(dict(curves.angles), dict(curves.moments), dict(curves.forces))
    phase = np.linspace(0.0, 1.0, 101)
    for i, side in enumerate(SIDES):
        s = side[0]
        hip, knee, ankle = (
            _excursion(curves.angles[f"{name}_{s}"])
            for name in ("hip_flexion", "knee_angle", "ankle_angle")
        )
        load = _excursion(curves.forces[f"vertical_{s}"])
        wobble = faults.wobble[i] * np.exp(-phase / 0.06) * np.sin(2 * np.pi * phase / 0.09)
        thigh = faults.axes[i][0] + faults.thigh_by_hip[i] * hip + wobble
        shank = faults.axes[i][1] - faults.shank_by_knee[i] * knee + faults.shank_by_load[i] * load
        foot = faults.axes[i][2] + faults.foot_by_ankle[i] * ankle
        wrong = {
            "hip_flexion": thigh + faults.pelvis,
            "knee_angle": thigh - shank,
            "ankle_angle": foot - shank,
            "pelvis_tilt": faults.pelvis,
        }
        for name, error in wrong.items():
            found.angles[f"{name}_{s}"] = curves.angles[f"{name}_{s}"] + error
    return found


def held_flexed(person: Subject, faults: HarsherFaults) -> Subject:
    """The gait of a person with one knee more flexed, and hip and ankle half as much."""
    if not faults.held:
        return person
    angles = dict(person.gait.angles)
    for name, share in (("hip_flexion", 0.5), ("knee_angle", 1.0), ("ankle_angle", 0.5)):
        key = f"{name}_{faults.held_side}"
        angles[key] = angles[key].model_copy(
            update={"mean": angles[key].mean + share * faults.held}
        )
    gait = person.gait.model_copy(update={"angles": angles})
    return person.model_copy(update={"gait": gait})


@dataclass(frozen=True)
class HarsherPerson:
    """A virtual person: what a laboratory knows, the body's (14,) mu, and what else is wrong."""

    subject: Subject
    truth: Array
    faults: HarsherFaults


def harsher_person(
    number: int, seed: int, person: Subject, policy: Policy, configuration: Configuration
) -> HarsherPerson:
    """The person of this `number` and `seed`, drawn around `person` as `harsh.harsh_person` does.
    Raises VirtualError if they fall.
    """
    random = np.random.default_rng([seed, number, _WORLD])
    truth, faults = drawn_parameters(prior_sd(person), random), drawn_faults(random, number)
    task, walk = walked(
        number, seed, held_flexed(person, faults), truth, policy, configuration, random,
        another=faults,
    )  # fmt: skip
    curves, values = seen(walk, task, truth[0])
    noise = configuration.noise.model_copy(update={"angle_offset": _OWN_OFFSET})
    noisy = with_errors(seen_by(curves, faults), values["left_phase"], noise, random)
    values["walking_speed_m_s"] *= 1.0 + faults.belt
    return HarsherPerson(as_subject(f"X{seed}_{number:03d}", person, noisy, values), truth, faults)


def made(number: int, seed: int, kept: Path) -> HarsherPerson | str:
    """The person, kept in the folder `kept`; why there is none otherwise."""
    file = kept / f"{seed}_{number:03d}.pickle"
    if file.exists():
        stored: HarsherPerson | str = pickle.loads(file.read_bytes())
        return stored
    configuration = load_configuration()
    policy = load_start(ROOT / "reports" / "general", configuration.environment)
    try:
        found: HarsherPerson | str = harsher_person(
            number, seed, person_of(number), policy, configuration
        )
    except GaitvalError as error:
        found = str(error)
    kept.mkdir(parents=True, exist_ok=True)
    file.write_bytes(pickle.dumps(found))
    return found


def one(number: int, seed: int, kept: Path) -> dict[str, Any]:
    """What was found of one person, for a file."""
    person = made(number, seed, kept)
    about = {"number": number, "seed": seed, "by": "stature" if number // 2 % 2 else "markers"}
    if isinstance(person, str):
        return about | {"refused": person}
    began = time.process_time()
    fit, model = fit_of(person.subject), scale_subject(person.subject).model
    found = identified(fit, as_scaled(fit, person.subject))
    mean, sd = found.legs.estimate
    return about | {
        "faults": asdict(person.faults),
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

    def rms(values: Sequence[float]) -> float:
        return float(np.sqrt(np.mean(np.square(values))))

    rows = []
    for by in ("markers", "stature"):
        legs = [each["leg"] for each in people if each.get("leg") and each["by"] == by]
        scaled, off = [leg["truth"] for leg in legs], [leg["truth"] - leg["mean"] for leg in legs]
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
    stored = read_json(arguments.store)["people"] if arguments.store.exists() else []
    done = {(each["seed"], each["number"]) for each in stored}
    for number in range(arguments.people):
        if (arguments.seed, number) not in done:
            stored.append(one(number, arguments.seed, arguments.store.parent / "harsher_people"))
            write_json(arguments.store, {"versions": versions(), "people": stored})
            print(f"{len(stored)} of {arguments.people}", flush=True)
    print(said(stored))


if __name__ == "__main__":
    main()
