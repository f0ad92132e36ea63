"""People of whom a stride a side is known: they are walked from angles alone, and judged.

`walks` runs the product's own path, `gaitval patients --walk`, for the 104 records of `gps/` in the
data (42 healthy people, 22 with Parkinson's disease off and on medication, 18 above-knee amputees);
who is walked below `work` already with the same code is not walked again. Amputees' ankle moments,
which no run is given, are those of `amputee/ankle.csv` (Hood et al. 2020) at the speed of the
strides.
"""

import csv
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import claims
from claims import Claim
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.comparison import rms

SPEEDS = ("transfemoral_amputee=0.8", "TF02=0.7")
"""m/s on the treadmill (Hood et al. 2020); TF02's fastest trial, which his stride is of, by his
ankle's angle."""
HEALTHY = "control"


def tables(data: Path) -> tuple[Path, list[Path]]:
    """The strides, and the tables of people."""
    people = ["gps/amputee_subjects.csv", "gps/parkinson_subjects.csv"]
    return data / "gps" / "strides.csv", [
        *(data / each for each in people),
        data / "wbds" / "WBDS_subjects_merged.csv",
    ]


def true_moments(data: Path) -> dict[tuple[str, str], Array]:
    """Ankle moment (101,) Nm/kg, dorsiflexion positive, at the speed of the strides, by person and
    side ("prosthetic", "intact").

    A person's speeds are 0.4, 0.5, … m/s or 0.6, 0.8, … (by the ratio of the slowest two), of which
    the file has the dimensionless ones.
    """
    found: dict[tuple[str, str], dict[float, Array]] = {}
    with (data / "amputee" / "ankle.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["quantity"] == "ankle_moment_nm_kg":
                curve = np.array([float(row[f"p{each}"]) for each in range(101)])
                known = found.setdefault((row["subject"], row["side"]), {})
                known[float(row["dimensionless_speed"])] = curve
    chosen = {}
    for (subject, side), curves in found.items():
        slowest, second = sorted(curves)[:2]
        first, step = (0.4, 0.1) if second / slowest < 1.29 else (0.6, 0.2)
        wanted = 0.7 if subject == "TF02" else 0.8
        number = round((wanted - first) / step)
        chosen[subject, side] = curves[sorted(curves)[number]]
    return chosen


def ankle_errors(walks: Sequence[dict[str, Any]], data: Path) -> dict[str, Array]:
    """By side ("intact", "prosthetic"): RMS of the walk's ankle moment and of the healthy one that
    is expected, (people, 2) Nm/kg.
    """
    truth = true_moments(data)
    found: dict[str, list[tuple[float, float]]] = {"intact": [], "prosthetic": []}
    for each in walks:
        for side in SIDES if each["prosthesis"] and each["moments"] else ():
            kind = "prosthetic" if side == each["prosthesis"] else "intact"
            true = truth.get((each["name"], kind))
            if true is None:
                continue
            name = f"ankle_angle_{side[0]}"
            found[kind].append(
                (
                    rms(np.array(each["moments"][name]) - true),
                    rms(np.array(each["expected"][name]) - true),
                )
            )
    return {kind: np.array(each) for kind, each in found.items()}


def _ankle_rows(what: str, found: Sequence[dict[str, Any]], data: Path) -> list[Claim]:
    """Of each side, as far as it is known, how far ankle moments are off, and their skill."""
    rows = []
    for kind, errors in ankle_errors(found, data).items():
        if not len(errors):
            continue
        print(kind, errors.round(3).tolist())
        own, usual = errors.mean(axis=0)
        skill = float(1.0 - own / usual)
        rows += [
            Claim(f"{what}, {kind} side, RMS", float(own), "Nm/kg", len(errors)),
            Claim(f"{what}, {kind} side, skill against healthy people's", skill, "1", len(errors)),
        ]
    return rows


@claims.measured("data")
def walks(given: claims.Given) -> list[Claim]:
    """The 104 records of `gps/` walked from angles alone: falls, angles, scores, ankle moments."""
    from gaitval.apps.patients.cohort import found_patients, walked

    strides, people = tables(given.data)
    patients = found_patients(strides, people, SPEEDS, [HEALTHY])
    invented = sum(
        bool(each.subject.gait.mirrored or each.subject.gait.not_recorded)
        or any(
            each.subject.gait.angles[f"{name[:-2]}_r"] == each.subject.gait.angles[name]
            for name in each.strides.angles
            if name.endswith("_l")
        )
        for each in patients
    )
    found = walked(patients, given.work / "patients", lambda text: print(text, flush=True))
    stood = [each for each in found if each["falls"] == 0 and each["cycles"] >= 100]
    angles = np.array([each["angle"] for each in found if each["angle"] is not None])
    scores = np.array(
        [
            each["scores"]["walk"] - each["scores"]["stride"]
            for each in found
            if each["scores"]["walk"] is not None
        ]
    )
    for group in dict.fromkeys(each["group"] for each in found):
        own = [each["angle"] for each in found if each["group"] == group and each["angle"]]
        print(f"{group}: {len(own)} walk, {np.mean(own):.2f}°, worst {max(own):.2f}°")
    all_ = len(found)
    share = 100.0 * len(stood) / all_
    rows = [
        Claim("gps records that walk 100 cycles from every start without a fall", share, "%", all_),
        Claim("known angles of gps records, mean", float(angles.mean()), "deg", len(angles)),
        Claim("known angles of gps records, worst person", float(angles.max()), "deg", len(angles)),
        Claim(
            "GPS of walker against the person's, mean size",
            float(np.abs(scores).mean()),
            "deg",
            len(scores),
        ),
        Claim(
            "GPS of walker against the person's, largest",
            float(np.abs(scores).max()),
            "deg",
            len(scores),
        ),
        Claim("sides of gps records that are invented", invented, "sides", 104),
    ]
    return rows + _ankle_rows("amputees' ankle moment", found, given.data)


@claims.measured("data")
def ankles(given: claims.Given) -> list[Claim]:
    """Amputees' ankle moments to expect before they are walked, a prosthetic foot's as springs'."""
    from gaitval.apps.patients.cohort import found_patients
    from gaitval.apps.patients.known_record import expected_record
    from gaitval.apps.patients.passive_foot import expected_ankles
    from gaitval.datasets.subject_file import builtin_subjects

    strides, people = tables(given.data)
    others, phase = builtin_subjects(), np.linspace(0.0, 1.0, 101)
    found = []
    for each in found_patients(strides, people, SPEEDS, [HEALTHY]):
        if each.person.amputation is None:
            continue
        usual = expected_record(each.subject, others).moments
        names = {side: f"ankle_angle_{side[0]}" for side in SIDES}
        moments = expected_ankles(each, others)
        found.append(
            {
                "name": each.subject.identifier,
                "prosthesis": each.person.amputation,
                "moments": {names[side]: moments[side](phase) for side in SIDES},
                "expected": {name: usual[name](phase) for name in names.values()},
            }
        )
    return _ankle_rows("amputees' ankle moment before the walk", found, given.data)


@claims.measured("data")
def speed(given: claims.Given) -> list[Claim]:
    """Speed estimated from a stride of healthy people whose speed is known, none of the ten."""
    from gaitval.apps.patients.people import read_people
    from gaitval.apps.patients.records import patient
    from gaitval.apps.patients.strides import read_strides
    from gaitval.datasets.subject_file import builtin_subjects

    strides, people = tables(given.data)
    known = read_people(people[-1])
    chosen_on = {each.person for each in builtin_subjects()}
    found = []
    for each in read_strides(strides):
        name = each.subject.removeprefix("WBDS").lstrip("0")
        person = known.get(name)
        if each.group != HEALTHY or each.subject in chosen_on or person is None:
            continue
        if person.speed is None:
            continue
        without = {name: dataclasses.replace(person, speed=None)}
        estimate = patient(each, without, healthy=True).estimates["speed"]
        low, high = estimate.interval()
        found.append((estimate.value / person.speed - 1.0, low <= person.speed <= high))
    errors, fixed = np.array(found, dtype=float).T
    what = "speed of a stride of healthy people"
    return [
        Claim(
            f"{what}, mean size of the error",
            100.0 * float(np.abs(errors).mean()),
            "%",
            len(errors),
        ),
        Claim(f"{what}, bias", 100.0 * abs(float(errors.mean())), "%", len(errors)),
        Claim(f"{what}, in the 90 % interval", 100.0 * float(fixed.mean()), "%", len(errors)),
    ]
