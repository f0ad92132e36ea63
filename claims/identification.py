"""How far identification with shared errors can be trusted: of strangers, and of the ten.

`harsh` reads `reports/identification/harsh.json` (`python -m experiments.harsh_people`, hours),
`shared` `ten_shared.json` (`python -m experiments.ten_bodies`).
"""

import json
from typing import Any

import numpy as np
from scipy.stats import norm

import claims
from claims import ROOT, Claim
from gaitval.identification.legs import LegDifference
from gaitval.identification.offsets import estimated
from gaitval.identification.verdicts import IDENTIFIED
from gaitval.metrics.comparison import rms

STORE = ROOT / "reports" / "identification"
DISTANCES = ("hip to knee", "knee to ankle", "hip to ankle, straight leg")
"""Of `gaitval.identification.joints.lengths`, which a range-of-motion trial measures."""


def within(z: Any, share: float) -> float:
    """Share of truths inside the central interval of a Gaussian."""
    return float(np.mean(np.abs(z) < norm.ppf(0.5 + 0.5 * share)))


def measured(store: str, experiment: str) -> list[dict[str, Any]]:
    """The people of a store. Stops if there are none yet."""
    people: list[dict[str, Any]] = json.loads((STORE / f"{store}.json").read_text())["people"]
    if not people:
        raise RuntimeError(f"Nobody was measured yet. Run python -m experiments.{experiment}.")
    return people


def harsh_people() -> list[dict[str, Any]]:
    """Those of the harsh world who could be measured."""
    return [each for each in measured("harsh", "harsh_people") if "refused" not in each]


def leg_errors(people: list[dict[str, Any]]) -> tuple[Any, Any, Any]:
    """(people,) m: error of the leg as found, its SD, and error of the leg as scaled."""
    legs_ = [each["leg"] for each in people]
    truth, mean, sd = (np.array([each[key] for each in legs_]) for key in ("truth", "mean", "sd"))
    return mean - truth, sd, -truth


def harsh_rows(people: list[dict[str, Any]]) -> list[Claim]:
    """Coverage, legs against the scaled ones, and legs that differ."""
    error, sd, _ = leg_errors(people)
    found = {
        key: np.array([each[key] for each in people])[:, 2:] for key in ("truth", "mean", "sd")
    }
    rows = []
    for name, z in (
        ("leg length (thigh + shank)", error / sd),
        ("all parameters that the fit looks for", (found["truth"] - found["mean"]) / found["sd"]),
    ):
        what, n = f"harsh world: coverage of 90 % intervals, {name}", int(np.size(z))
        rows.append(Claim(what, within(z, 0.9), "1", n))
    for by in ("markers", "stature"):
        part = [each for each in people if each["by"] == by]
        error, _, scaled = leg_errors(part)
        rows.append(
            Claim(
                f"harsh world: leg by {by}, RMS error over that of the leg as scaled",
                rms(error) / rms(scaled),
                "1",
                len(part),
            )
        )
    planted = [each for each in people if each["planted_left_leg"] is not None]
    others = [each for each in people if each["planted_left_leg"] is None]
    seen = [
        legs_of(each).differ and legs_of(each).found * each["planted_left_leg"] > 0
        for each in planted
    ]
    alarms = [legs_of(each).differ for each in others]
    rows += [
        Claim(
            "harsh world: legs that differ by 2 to 3 cm, found with the longer side",
            float(np.mean(seen)),
            "1",
            len(planted),
        ),
        Claim(
            "harsh world: legs that differ as people's do, called different",
            float(np.mean(alarms)),
            "1",
            len(others),
        ),
        Claim(
            "harsh world: processor time of one identification, slowest",
            max(each["processor_seconds"] for each in people),
            "s",
            len(people),
        ),
    ]
    return [*rows, *joint_rows(people), *epsilon_rows(people)]


def legs_of(each: dict[str, Any]) -> LegDifference:
    """What was found of the legs of a stored person."""
    found = each["leg_difference"]
    return LegDifference(found["found"], found["found_sd"], found["prior_sd"])


def joint_rows(people: list[dict[str, Any]]) -> list[Claim]:
    """With a range-of-motion trial: legs, and parameters that are declared identified."""
    rows, joints = [], [each | each["joints"] for each in people]
    known: list[dict[str, float]] = []
    per_person = []
    for by in ("markers", "stature"):
        part = [each for each in joints if each["by"] == by]
        distances = [each[name] for each in part for name in DISTANCES]
        declared = [each for each in distances if each["sd"] / each["prior_sd"] <= IDENTIFIED]
        known += declared
        per_person.append(len(declared) / len(part))
        error, _, scaled = leg_errors(part)
        rows.append(
            Claim(
                f"harsh world, with a range-of-motion trial: leg by {by}, RMS error over that of "
                "the leg as scaled",
                rms(error) / rms(scaled),
                "1",
                len(part),
            )
        )
    found = {
        key: np.array([each[key] for each in joints])[:, 2:]
        for key in ("truth", "mean", "sd", "prior_sd")
    }
    single = found["sd"] / found["prior_sd"] <= IDENTIFIED
    error, sd, _ = leg_errors(joints)
    legs_hold = within(error / sd, 0.9)
    what, n = "harsh world, with a range-of-motion trial: ", len(people)
    z = np.array([(each["mean"] - each["truth"]) / each["sd"] for each in known])
    return [
        *rows,
        Claim(
            what + "coverage of 90 % intervals, leg length (thigh + shank)",
            legs_hold,
            "1",
            n,
        ),
        Claim(
            what + "parameters declared identified, per person",
            float(single.sum() / n),
            "parameters",
            n,
        ),
        Claim(
            what + f"distances between joint centres ({', '.join(DISTANCES)}) declared "
            "identified, per person, of as many by markers as by stature",
            float(np.mean(per_person)),
            "distances",
            n,
        ),
        Claim(
            what + "distances declared identified that are within 2 SD",
            float(np.mean(np.abs(z) < 2.0)),
            "1",
            len(known),
        ),
    ]


def walked_harsh(people: list[dict[str, Any]]) -> dict[str, Any]:
    """Epsilons (people,) of those who could walk with each of their bodies, by the body's name."""
    walked = [
        each["epsilon"] for each in people if None not in each.get("epsilon", {0: None}).values()
    ]
    return {name: np.array([each[name] for each in walked]) for name in walked[0]}


def epsilon_rows(people: list[dict[str, Any]]) -> list[Claim]:
    """What the general policy gains by the identified body, and by the true one."""
    epsilons = walked_harsh(people)
    gains = {name: 1.0 - each / epsilons["scaled"] for name, each in epsilons.items()}
    identified, truth = (float(np.median(gains[name])) for name in ("identified", "truth"))
    n = len(epsilons["scaled"])
    return [
        Claim(
            "harsh world: epsilon of the general policy lower as identified than as scaled",
            float(np.mean(gains["identified"] > 0.0)),
            "1",
            n,
        ),
        # As a difference: the true body's gain, by which one would divide, may be none.
        Claim(
            "harsh world: median gain of epsilon as identified, less a third of that with the true "
            "body",
            100.0 * (identified - truth / 3),
            "%",
            n,
        ),
    ]


@claims.measured(stored=("reports/identification/harsh.json",))
def harsh(_: claims.Given) -> list[Claim]:
    """People of the harsh world, whose true bodies are known."""
    return harsh_rows(harsh_people())


def shift_errors(joints: Any) -> Any:
    """(…) standard error of the mean shift of people (P, 16, 16): if the prior is right, shifts are
    draws whose variance is the prior's less the posterior's.
    """
    expected = 1.0 - np.diagonal(joints, axis1=1, axis2=2)
    return np.sqrt(expected.clip(1e-9).sum(axis=0)) / len(joints)


def unseen_halves(shifts: Any, joints: Any) -> float:
    """Largest mean shift of a parameter over its standard error in five people, with the offset of
    the five others, to first order; mean of 100 halves.
    """
    found, random = [], np.random.default_rng(0)
    for _ in range(100):
        mixed = random.permutation(len(shifts))
        one, other = mixed[: len(mixed) // 2], mixed[len(mixed) // 2 :]
        offset = estimated(shifts[other], joints[other])
        left = shifts[one] - offset + joints[one] @ offset
        found.append(np.abs(left.mean(axis=0) / shift_errors(joints[one]))[2:14].max())
    return float(np.mean(found))


def between_trials(stored: dict[str, Any]) -> tuple[float, int]:
    """RMS difference of what two trials of one person say of a parameter, over its SD if their
    errors were independent, and the number of pairs.
    """
    records = [*stored["alone"], *stored["trials"]]
    ratios = []
    for i, one in enumerate(records):
        for other in records[:i]:
            if one["person"] == other["person"]:
                resolved = [np.array(each["joint"]) for each in (one, other)]
                # Of the posterior mean, what is error has the variance C - C².
                variance = sum(np.diag(each - each @ each) for each in resolved)
                apart = np.array(one["shift"]) - other["shift"]
                ratios.append((apart / np.sqrt(variance.clip(1e-9)))[2:14])
    return rms(np.array(ratios)), len(ratios)


@claims.measured(stored=("reports/identification/ten_shared.json",))
def shared(_: claims.Given) -> list[Claim]:
    """The ten built-in people with shared errors: whether their shifts are draws from the prior."""
    stored = json.loads((STORE / "ten_shared.json").read_text())
    arrays_ = {
        kind: [np.array([each[key] for each in stored[kind]]) for key in ("shift", "joint")]
        for kind in ("alone", "people")
    }
    ratios = {}
    means = {kind: shifts.mean(axis=0) for kind, (shifts, _) in arrays_.items()}
    for kind, (_, joints) in arrays_.items():
        ratios[kind] = means[kind] / shift_errors(joints)
    people, (trials, pairs) = stored["people"], between_trials(stored)
    what = "shared errors, the ten: mean shift of a parameter over its standard error"
    return [
        Claim(f"{what}, largest", float(np.abs(ratios["people"][2:14]).max()), "1", len(people)),
        Claim(
            f"{what}, largest in five of them with the offset of the five others",
            unseen_halves(*arrays_["alone"]),
            "1",
            len(people),
        ),
        Claim(
            "shared errors, the ten: two trials of one person, shift of a parameter over that of "
            "independent errors, RMS",
            trials,
            "1",
            pairs,
        ),
        Claim(
            "shared errors, the ten: processor time of one identification, slowest",
            max(each["processor_seconds"] for each in people),
            "s",
            len(people),
        ),
    ]
