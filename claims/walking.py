"""Who walks without own training, by the general policy: at which speeds, and which strangers."""

import csv
import statistics
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

import claims
import gaitval
from claims import Claim

if TYPE_CHECKING:
    from numpy.random import Generator

    from gaitval.arrays import Array
    from gaitval.policy.storage import Policy
    from gaitval.subjects.subject import Subject
    from gaitval.walk.simulation.walker import WalkingTask

PEOPLE: Final = tuple(f"S{number:02d}" for number in range(1, 11))
SPEEDS: Final = (0.3, 0.4, 0.6, 0.9, 1.25, 1.6, 1.8)
"""m/s: the ends that are asked for and those that must be, and steps of up to a half between."""
COUNT: Final = 200
SEED: Final = 20261124
"""How many strangers, and of which draw."""
CYCLES: Final = 100
STARTS: Final = 8
WALKS: Final = 0.95
"""Share of people and starts that must walk at a speed."""
TABLES: Final = {"F": "ANSUR_II_FEMALE_Public.csv", "M": "ANSUR_II_MALE_Public.csv"}
SLOWEST, FASTEST = 0.4, 1.6
"""m/s, of the strangers' speeds."""
CHILDREN: Final = 5
"""Every so many strangers is a child."""
GROWTH: Final = {
    "F": (
        (6, 115.1244, 0.04447, -1.0794, 15.2697, 0.10195),
        (8, 126.5558, 0.04581, -1.3880, 15.6810, 0.11291),
        (10, 138.6363, 0.04614, -1.4864, 16.6133, 0.12307),
        (12, 151.2327, 0.04523, -1.4006, 17.9966, 0.13129),
        (14, 159.7890, 0.04345, -1.2266, 19.5647, 0.13700),
        (16, 162.5156, 0.04176, -1.0368, 20.7008, 0.14070),
    ),
    "M": (
        (6, 115.9509, 0.04249, -0.9921, 15.3062, 0.08682),
        (8, 127.2651, 0.04438, -1.4629, 15.7368, 0.09526),
        (10, 137.7795, 0.04626, -1.7407, 16.4433, 0.10566),
        (12, 149.0807, 0.04753, -1.7751, 17.5334, 0.11522),
        (14, 163.1816, 0.04714, -1.6211, 19.0050, 0.12191),
        (16, 172.8967, 0.04495, -1.3529, 20.4951, 0.12579),
    ),
}
"""Growth reference of the WHO (de Onis et al. 2007, Bull World Health Organ 85:660) by sex: age in
years; median of stature, cm, and coefficient of variation; L, M and S of body mass index, kg/m²."""


@claims.measured()
def speeds(_: claims.Given) -> list[Claim]:
    """Speeds at which the ten walk with the general policy, from every start."""
    from gaitval.subjects.subject_file import load_subject

    shares = []
    for speed in SPEEDS:
        fell = {who: _fell(load_subject(who), speed) for who in PEOPLE}
        shares.append(1.0 - sum(fell.values()) / (STARTS * len(fell)))
        who = ", ".join(f"{name} {count} of {STARTS}" for name, count in fell.items() if count)
        print(f"{speed:g} m/s: {shares[-1]:.1%} walk{', fell: ' + who if who else ''}", flush=True)
    slowest, fastest = _widest(SPEEDS, shares)
    what = f"speeds walked without own training, by {WALKS:.0%} of the ten from {STARTS} starts"
    count = STARTS * len(PEOPLE) * len(shares)
    return [
        Claim(f"{what}: slowest", slowest, "m/s", count),
        Claim(f"{what}: fastest", fastest, "m/s", count),
    ]


def _widest(speeds: list[float], shares: list[float]) -> tuple[float, float]:
    """The ends, m/s, of the widest row of neighbouring speeds at which enough walk."""
    found, begin = (float("inf"), 0.0), None
    for speed, share in zip(speeds, shares, strict=True):
        begin = (speed if begin is None else begin) if share >= WALKS else None
        if begin is not None and speed - begin >= max(found[1] - found[0], 0.0):
            found = begin, speed
    return found


@claims.measured("data")
def strangers(given: claims.Given) -> Claim:
    """Adults of ANSUR II and children of the WHO's growth reference, each with the gait of one of
    the ten, walked at some speed without own training: how many walk from every start.
    """
    from gaitval._internal.io.artefacts import read_json, write_json

    table = adults(given.data)
    store = given.work / f"strangers-{gaitval.__version__}.json"
    known = read_json(store) if store.is_file() else []
    for number in range(len(known), COUNT):
        person, gait, speed = drawn_stranger(table, SEED, number, (SLOWEST, FASTEST))
        about = {
            "laboratory": person.laboratory,
            "sex": person.sex,
            "height_m": round(person.height_m, 3),
            "mass_kg": round(person.mass_kg, 1),
            "gait": gait,
            "speed": round(speed, 3),
            "fell": _fell(person, speed),
        }
        known.append(about)
        write_json(store, known)
        print(f"{number + 1}: {about}", flush=True)
    walk = sum(not each["fell"] for each in known)
    return Claim(
        f"strangers, adults of ANSUR II at {SLOWEST} to {FASTEST} m/s and, one in {CHILDREN}, "
        "children of 6 to 16 (WHO) at the same dimensionless speeds, without own training: share "
        f"that walk {CYCLES} cycles from {STARTS} starts",
        100.0 * walk / len(known),
        "%",
        len(known),
    )


def adults(data: Path) -> list[dict[str, str]]:
    """The rows of ANSUR II, women first, each with a `sex`."""
    table = []
    for sex, name in TABLES.items():
        path = data / "anthropometry" / name
        with path.open(encoding="latin-1", newline="") as file:
            table += [{**row, "sex": sex} for row in csv.DictReader(file)]
    return table


def drawn_stranger(
    table: list[dict[str, str]], seed: int, number: int, speeds: tuple[float, float]
) -> tuple["Subject", str, float]:
    """A person of a `seed`, the name of whose gait it is, and a speed, m/s: between those two for
    an adult of mean leg length.
    """
    import numpy as np

    leg = statistics.mean(float(row["trochanterionheight"]) for row in table) / 1000.0
    random = np.random.default_rng((seed, number))
    row, gait = table[random.integers(len(table))], PEOPLE[random.integers(len(PEOPLE))]
    speed = float(random.uniform(*speeds))
    person = _stranger(row, gait)
    if number % CHILDREN == CHILDREN - 1:
        person = _child(person, random)
        speed *= (person.leg_length_m / leg) ** 0.5
    return person, gait, speed


def _child(person: "Subject", random: "Generator") -> "Subject":
    """A child of a drawn age and size who walks as the `person` does at the same dimensionless
    speed, with the same share of leg in stature.
    """
    from gaitval.identification.virtual_person import on_legs

    years, median, spread, skew, index, scatter = GROWTH[person.sex][random.integers(6)]
    height = 0.01 * median * (1.0 + spread * random.standard_normal())
    mass = height**2 * index * (1.0 + skew * scatter * random.standard_normal()) ** (1.0 / skew)
    leg = person.leg_length_m * height / person.height_m
    return on_legs(person, leg, leg / person.leg_length_m).model_copy(
        update={
            "person": f"{person.person}-child",
            "laboratory": "WHO",
            "age_years": float(years),
            "mass_kg": float(mass),
            "height_m": float(height),
        }
    )


def _stranger(row: Mapping[str, str], gait: str) -> "Subject":
    """Somebody of the body of a `row` of ANSUR II (mm, hectograms) who walks as one of the ten does
    at the same dimensionless speed; only stature, leg and mass are known of the body.
    """
    from gaitval.identification.virtual_person import on_legs
    from gaitval.subjects.subject_file import load_subject

    leg, person = float(row["trochanterionheight"]) / 1000.0, load_subject(gait).by_stature()
    return on_legs(person, leg, leg / person.leg_length_m).model_copy(
        update={
            "person": f"ANSUR-{row.get('SubjectId') or row.get('subjectid')}",
            "laboratory": "ANSUR II",
            "sex": row["sex"],
            "mass_kg": float(row["weightkg"]) / 10.0,
            "height_m": float(row["stature"]) / 1000.0,
            "trials": (),
        }
    )


def task_of(person: "Subject", speed: float | None = None) -> "WalkingTask":
    """What a person is to walk at a speed, m/s, or as recorded, with the default settings."""
    from gaitval.configuration import Configuration
    from gaitval.scaling.scaling import scale_subject
    from gaitval.subjects.prediction.known import known_record
    from gaitval.subjects.subject_file import builtin_subjects
    from gaitval.walk.simulation.walker import WalkingTask

    configuration = Configuration()
    known = known_record(person, configuration.record, builtin_subjects(), speed=speed, forced=True)
    body = scale_subject(person, symmetric=configuration.scaling.symmetric).model
    return WalkingTask.of(body, known.record, configuration, known.accuracy)


def _fell(person: "Subject", speed: float | None = None) -> int:
    """Of the starts of a person at a speed, m/s, or as recorded: walks of `CYCLES` that end in a
    fall.
    """
    from gaitval.model.parameters import nominal_parameters
    from gaitval.study.stored_policy import general_walker

    task = task_of(person, speed)
    policy = general_walker(task.configuration.environment, task.record, person.leg_length_m)
    return falls(task, policy, nominal_parameters(), CYCLES)


def falls(task: "WalkingTask", policy: "Policy", mu: "Array", cycles: float) -> int:
    """Of `STARTS` of a task with the parameters mu (14,), by a policy: walks of so many gait cycles
    that end in a fall.
    """
    import numpy as np

    from gaitval.policy.rollouts import walks_together
    from gaitval.policy.walking_group import WalkingGroup

    fell = np.zeros(STARTS, dtype=bool)
    starts = [{"phase": start / STARTS} for start in range(STARTS)]
    group = WalkingGroup([task] * STARTS)
    for walking, fallen in walks_together(group, policy, mu, starts, cycles):
        fell |= walking & fallen
    return int(fell.sum())
