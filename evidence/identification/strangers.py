"""How far identification with shared errors can be trusted: of strangers, and of the ten.

`harsh` reads `reports/identification/harsh.json` (`experiments/harsh_people.py`), `shared`
`ten_shared.json` (`experiments/ten_bodies.py`), `skin.json` (`experiments/skin_width.py`) and
`longer_leg.json` (`experiments/longer_leg.py`), `rollouts` `rollouts.json`
(`experiments/rollout_identification.py`). Writes the rows, and tables of docs/identification.md.
"""

import json
from argparse import Namespace
from typing import Any

import numpy as np

import evidence
from evidence.identification.bodies import PAGE, STORE, rms, within
from evidence.marked_table import with_table
from experiments.harsh_people import PEOPLE
from gaitval.artefacts import write_text
from gaitval.identification.legs import LegDifference
from gaitval.identification.offsets import OFFSETS, estimated
from gaitval.identification.shared_errors import NARROWER
from gaitval.identification.verdicts import IDENTIFIED
from gaitval.model.parameters import PARAMETERS

Row = evidence.Row
DISTANCES = ("hip to knee", "knee to ankle", "hip to ankle, straight leg")
"""Of `gaitval.identification.joints.lengths`, which a range-of-motion trial measures."""
MEASURES = {
    "harsh world*": {
        "code": (
            "@body with shared errors",
            "gaitval/identification/legs.py",
            "gaitval/identification/joints.py",
            "gaitval/gait/accuracy.py",
            "gaitval/scaling/functional.py",
            "gaitval/apps/virtual/harsh.py",
            "gaitval/apps/virtual/person.py",
            "gaitval/apps/virtual/range_of_motion.py",
            "experiments/harsh_people.py",
        ),
        "data": ("reports/general/policy.safetensors",),
        "results": ("reports/identification/harsh.json",),
        "allowed": 60,
        "why": "a line of intervals below a table, and forefeet without markers on the heads: the "
        "stored people and the ten have these, so their bodies keep their hashes",
    },
    "shared errors, the ten: *": {
        "code": (
            "@body with shared errors",
            "gaitval/identification/offsets.py",
            "experiments/ten_bodies.py",
            "evidence/identification/strangers.py:shift_errors",
            "evidence/identification/strangers.py:unseen_halves",
            "evidence/identification/strangers.py:between_trials",
            "evidence/identification/strangers.py:shared",
        ),
        "results": ("reports/identification/ten_shared.json",),
        "allowed": 40,
        "why": "forefeet without markers on the heads: the ten have these and keep their hashes",
    },
    "skin of the ten: *": {
        "code": (
            "@body with shared errors",
            "experiments/skin_width.py",
            "evidence/identification/strangers.py:shared",
        ),
        "results": ("reports/identification/skin.json",),
        "allowed": 40,
        "why": "forefeet without markers on the heads: the ten have these and keep their hashes",
    },
}
"""What the rows depend on; see evidence/stale.py."""


def measured(store: str, experiment: str) -> list[dict[str, Any]]:
    """The people of a store. Stops if there are none yet."""
    people: list[dict[str, Any]] = json.loads((STORE / f"{store}.json").read_text())["people"]
    if not people:
        raise SystemExit(f"Nobody was measured yet. Run python -m experiments.{experiment}.")
    return people


def harsh_people() -> list[dict[str, Any]]:
    """Those of the harsh world who could be measured."""
    return [each for each in measured("harsh", "harsh_people") if "refused" not in each]


def leg_errors(people: list[dict[str, Any]]) -> tuple[Any, Any, Any]:
    """(people,) m: error of the leg as found, its SD, and error of the leg as scaled."""
    legs_ = [each["leg"] for each in people]
    truth, mean, sd = (np.array([each[key] for each in legs_]) for key in ("truth", "mean", "sd"))
    return mean - truth, sd, -truth


def harsh_rows(people: list[dict[str, Any]]) -> list[Row]:
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
        rows.append(Row(f"{what}, at least", within(z, 0.9), "1", ">=", 0.85, 0.80, n))
        rows.append(Row(f"{what}, at most", within(z, 0.9), "1", "<=", 0.95, 0.97, n))
    for by, goal, must in (("markers", 0.75, 0.95), ("stature", 0.6, 0.8)):
        part = [each for each in people if each["by"] == by]
        error, _, scaled = leg_errors(part)
        rows.append(
            Row(
                f"harsh world: leg by {by}, RMS error over that of the leg as scaled",
                rms(error) / rms(scaled), "1", "<=", goal, must, len(part),
            )
        )  # fmt: skip
    planted = [each for each in people if each["planted_left_leg"] is not None]
    others = [each for each in people if each["planted_left_leg"] is None]
    seen = [
        legs_of(each).differ and legs_of(each).found * each["planted_left_leg"] > 0
        for each in planted
    ]
    alarms = [legs_of(each).differ for each in others]
    rows += [
        Row("harsh world: legs that differ by 2 to 3 cm, found with the longer side",
            float(np.mean(seen)), "1", ">=", 0.95, 0.85, len(planted)),
        Row("harsh world: legs that differ as people's do, called different",
            float(np.mean(alarms)), "1", "<=", 0.05, 0.10, len(others)),
        Row("harsh world: processor time of one identification, slowest",
            max(each["processor_seconds"] for each in people), "s", "<=", 60, 120, len(people)),
    ]  # fmt: skip
    return [*rows, *joint_rows(people), *epsilon_rows(people)]


def legs_of(each: dict[str, Any]) -> LegDifference:
    """What was found of the legs of a stored person."""
    found = each["leg_difference"]
    return LegDifference(found["found"], found["found_sd"], found["prior_sd"])


def joint_rows(people: list[dict[str, Any]]) -> list[Row]:
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
            Row(
                f"harsh world, with a range-of-motion trial: leg by {by}, RMS error over that of "
                "the leg as scaled", rms(error) / rms(scaled), "1", "<=", 0.4, 0.6, len(part),
            )
        )  # fmt: skip
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
        Row(what + "coverage of 90 % intervals, leg length (thigh + shank), at least", legs_hold,
            "1", ">=", 0.85, 0.80, n),
        Row(what + "parameters declared identified, per person", float(single.sum() / n),
            "parameters", ">=", 3, 2, n),
        Row(what + f"distances between joint centres ({', '.join(DISTANCES)}) declared "
            "identified, per person, of as many by markers as by stature",
            float(np.mean(per_person)), "distances", ">=", 3, 2, n),
        Row(what + "distances declared identified that are within 2 SD",
            float(np.mean(np.abs(z) < 2.0)), "1", ">=", 0.95, 0.90, len(known)),
    ]  # fmt: skip


def joints_table(people: list[dict[str, Any]]) -> list[str]:
    """What a range-of-motion trial leaves of the prior's SDs, by how people were scaled."""
    lines = [
        "SD / prior SD with a range-of-motion trial, mean. In brackets, of parameters what would "
        "be left if the distance were known exactly, of distances the share of people of whom it "
        "is declared identified, and the RMS error in mm.",
        "",
        "| leg by | thigh | shank | hip up | " + " | ".join(DISTANCES) + " |",
        "|---|---|---|---|" + len(DISTANCES) * "---|",
    ]
    for by in ("markers", "stature"):
        part = [each for each in people if each["by"] == by]
        cells = []
        for name, other, distance in (
            ("thigh_length", "knee_z", "hip to knee"),
            ("shank_length", "ankle_z", "knee to ankle"),
            ("hip_z", "", ""),
        ):
            i = PARAMETERS.index(name)
            cell = f"{np.mean([e['joints']['sd'][i] / e['prior_sd'][i] for e in part]):.2f}"
            if other:
                # Of a sum that is known each part keeps the other's share of the prior.
                o = PARAMETERS.index(other)
                floor = [e["prior_sd"][o] / e["joints"][distance]["prior_sd"] for e in part]
                cell += f" ({np.mean(floor):.2f})"
            cells.append(cell)
        for name in DISTANCES:
            error, sd, _ = leg_errors([{"leg": each["joints"][name]} for each in part])
            left = sd / [each["joints"][name]["prior_sd"] for each in part]
            cells.append(
                f"{left.mean():.2f} ({100 * np.mean(left <= IDENTIFIED):.0f} %, "
                f"{1000 * rms(error):.1f})"
            )
        lines.append(f"| {by} | {' | '.join(cells)} |")
    return lines


def walked_harsh(people: list[dict[str, Any]]) -> dict[str, Any]:
    """Epsilons (people,) of those who could walk with each of their bodies, by the body's name."""
    walked = [
        each["epsilon"] for each in people if None not in each.get("epsilon", {0: None}).values()
    ]
    return {name: np.array([each[name] for each in walked]) for name in walked[0]}


def epsilon_rows(people: list[dict[str, Any]]) -> list[Row]:
    """What the general policy gains by the identified body, and by the true one."""
    epsilons = walked_harsh(people)
    gains = {name: 1.0 - each / epsilons["scaled"] for name, each in epsilons.items()}
    identified, truth = (float(np.median(gains[name])) for name in ("identified", "truth"))
    n = len(epsilons["scaled"])
    return [
        Row("harsh world: epsilon of the general policy lower as identified than as scaled",
            float(np.mean(gains["identified"] > 0.0)), "1", ">=", 0.8, 0.7, n),
        # As a difference: the true body's gain, by which one would divide, may be none.
        Row("harsh world: median gain of epsilon as identified, less a third of that with the true "
            "body", 100.0 * (identified - truth / 3), "%", ">=", max(0.0, 100.0 * truth / 6), 0, n),
    ]  # fmt: skip


def gained_table(people: list[dict[str, Any]]) -> list[str]:
    """Gains of epsilon by each body, with intervals from drawing people again."""
    epsilons, random = walked_harsh(people), np.random.default_rng(0)
    n = len(epsilons["scaled"])
    drawn = random.integers(n, size=(4000, n))
    lines = [
        f"{n} people. Gain: by how much ε is lower than with the body as scaled; 95 % intervals by "
        "drawing people again.",
        "",
        "| body | ε, median | lower in | gain, median |",
        "|---|---|---|---|",
    ]
    for name, each in epsilons.items():
        gain = 1.0 - each / epsilons["scaled"]
        low, high = np.percentile(np.median(gain[drawn], axis=1), [2.5, 97.5])
        shown = (
            f"{np.sum(gain > 0)} | {100 * np.median(gain):.1f} % "
            f"({100 * low:.1f} to {100 * high:.1f})"
        )
        lines.append(f"| {name} | {np.median(each):.3f} | {'|' if name == 'scaled' else shown} |")
    return lines


def harsh_table(people: list[dict[str, Any]]) -> list[str]:
    """Legs with and without shared errors, by how they were scaled."""
    lines = [
        f"{len(people)} people of seeds {' and '.join(map(str, seeds_of(people)))}. Of "
        f"{len(PEOPLE)} who are asked for, {len(measured('harsh', 'harsh_people'))} are measured "
        "by now, and of these some fell. Errors in cm RMS.",
        "",
        "| leg by | people | as scaled | found | 90 % hold | without shared errors: people, found,"
        " 90 % hold | with a range-of-motion trial: found, 90 % hold | hip to ankle so |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for by in ("markers", "stature"):
        part = [each for each in people if each["by"] == by]
        error, sd, scaled = leg_errors(part)
        plain = [each["plain"] | {"leg": each["plain"]["leg"]} for each in part if "plain" in each]
        plain_error, plain_sd, _ = leg_errors(plain)
        moved = [
            leg_errors([{"leg": each["joints"][key]} for each in part])[:2]
            for key in ("leg", "hip to ankle, straight leg")
        ]
        lines.append(
            f"| {by} | {len(part)} | {100 * rms(scaled):.1f} | {100 * rms(error):.1f} "
            f"| {100 * within(error / sd, 0.9):.0f} % | {len(plain)}, "
            f"{100 * rms(plain_error):.1f}, {100 * within(plain_error / plain_sd, 0.9):.0f} % "
            + "".join(f"| {100 * rms(e):.1f}, {100 * within(e / s, 0.9):.0f} % " for e, s in moved)
            + "|"
        )
    said = [f"by {by} {ratio_of(people, by)}" for by in ("markers", "stature")]
    for seed in seeds_of(people):
        part = [each for each in people if each["seed"] == seed]
        said.append(f"by stature, of seed {seed} alone, {ratio_of(part, 'stature')}")
    return [*lines, "", f"Found over scaled, RMS: {'; '.join(said)}."]


def seeds_of(people: list[dict[str, Any]]) -> list[int]:
    """Of whom the people are, in order."""
    return list(dict.fromkeys(each["seed"] for each in people))


def ratio_of(people: list[dict[str, Any]], by: str) -> str:
    """The ratio of the legs' errors, its interval by drawing people again, and what is expected
    of the posterior's SDs if the prior is right.
    """
    part, random = [each for each in people if each["by"] == by], np.random.default_rng(0)
    error, sd, scaled = leg_errors(part)
    drawn = random.integers(len(part), size=(4000, len(part)))
    ratios = np.sqrt(np.mean(error[drawn] ** 2, axis=1) / np.mean(scaled[drawn] ** 2, axis=1))
    low, high = np.percentile(ratios, [2.5, 97.5])
    expected = rms(sd) / rms([each["leg"]["prior_sd"] for each in part])
    return (
        f"{rms(error) / rms(scaled):.2f} ({low:.2f} to {high:.2f} by drawing people again; "
        f"{expected:.2f} by the fit's own SDs)"
    )


@evidence.measurement()
def harsh(_: Namespace) -> list[Row]:
    """People of the harsh world; also writes their table in docs/identification.md."""
    people = harsh_people()
    text = PAGE.read_text(encoding="utf-8")
    text = with_table(text, "harsh", "\n".join(harsh_table(people)))
    text = with_table(text, "joints", "\n".join(joints_table(people)))
    write_text(PAGE, with_table(text, "gained", "\n".join(gained_table(people))))
    return harsh_rows(people)


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
                told = [np.array(each["joint"]) for each in (one, other)]
                # Of the posterior mean, what is error has the variance C - C².
                variance = sum(np.diag(each - each @ each) for each in told)
                apart = np.array(one["shift"]) - other["shift"]
                ratios.append((apart / np.sqrt(variance.clip(1e-9)))[2:14])
    return rms(ratios), len(ratios)


@evidence.measurement()
def shared(_: Namespace) -> list[Row]:
    """The ten built-in people with shared errors: whether their shifts are draws from the prior."""
    stored = json.loads((STORE / "ten_shared.json").read_text())
    arrays_ = {
        kind: [np.array([each[key] for each in stored[kind]]) for key in ("shift", "joint")]
        for kind in ("alone", "people")
    }
    lines = [
        "Mean shift over the ten in prior SDs, and over its standard error.",
        "",
        "| parameter | alone | with the offset of the nine others |",
        "|---|---|---|",
    ]
    ratios = {}
    means = {kind: shifts.mean(axis=0) for kind, (shifts, _) in arrays_.items()}
    for kind, (_, joints) in arrays_.items():
        ratios[kind] = means[kind] / shift_errors(joints)
    for i, name in enumerate(OFFSETS[2:], start=2):
        cells = [f"{means[kind][i]:+.2f}, {ratios[kind][i]:+.1f}" for kind in arrays_]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    text = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(text, "shared", "\n".join(lines)))
    skin = json.loads((STORE / "skin.json").read_text())
    logs = np.sum([each["log_likelihood"] for each in skin["people"]], axis=0)
    logs -= logs[skin["widths"].index(1.0)]
    text = with_table(PAGE.read_text(encoding="utf-8"), "skin", "\n".join(skin_table(skin, logs)))
    write_text(PAGE, with_table(text, "longer", longer_leg()))
    people, (trials, pairs) = stored["people"], between_trials(stored)
    what = "shared errors, the ten: mean shift of a parameter over its standard error"
    return [
        Row(f"{what}, largest", float(np.abs(ratios["people"][2:14]).max()), "1", "<=", 2, 3,
            len(people)),
        Row(f"{what}, largest in five of them with the offset of the five others",
            unseen_halves(*arrays_["alone"]), "1", "<=", 2, 3, len(people)),
        Row("shared errors, the ten: two trials of one person, shift of a parameter over that of "
            "independent errors, RMS", trials, "1", "<=", 1, 1.5, pairs),
        Row("shared errors, the ten: processor time of one identification, slowest",
            max(each["processor_seconds"] for each in people), "s", "<=", 60, 120, len(people)),
        Row("skin of the ten: log likelihood of their records with the width that the fit takes, "
            "less that with the studies'", float(logs[skin["widths"].index(NARROWER)]), "1",
            ">=", 2, 0, len(skin["people"])),
    ]  # fmt: skip


def skin_table(skin: dict[str, Any], logs: Any) -> list[str]:
    """How likely the records of the ten are with other widths of the prior of skin."""
    left = np.mean([each["leg"] for each in skin["people"]], axis=0)
    return [
        f"{len(skin['people'])} people: logarithm of the likelihood of their records, less that "
        "with the studies' widths, and what the record leaves of the leg's SD by markers.",
        "",
        "| share of the studies' widths | " + " | ".join(f"{w:g}" for w in skin["widths"]) + " |",
        "|---|" + len(logs) * "---|",
        "| log likelihood | " + " | ".join(f"{each:+.1f}" for each in logs) + " |",
        "| leg, SD / prior SD | " + " | ".join(f"{each:.2f}" for each in left) + " |",
    ]


def longer_leg() -> str:
    """What else is known of the one of the ten whose leg is called longer."""
    found = json.loads((STORE / "longer_leg.json").read_text())
    name, own = found["person"], found["standing"][found["person"]]
    others = 1000 * np.array([e["leg"] for k, e in found["standing"].items() if k != name])
    as_it_is, *_, straight = found["walking"]
    up = ", ".join(f"{1000 * own[each]:.0f}" for each in ("ASIS", "Iliac.Crest", "PSIS"))

    def mm(of: dict[str, float], mean: str, sd: str) -> str:
        return f"{1000 * of[mean]:.0f} ± {1000 * of[sd]:.0f}"

    return (
        f"{name}'s left leg is called {mm(as_it_is, 'mean', 'sd')} mm longer. The only other trial "
        "of this person here, the standing one, agrees:\n\n"
        f"* thigh and shank are {1000 * own['leg']:.0f} mm longer by markers (the nine others: "
        f"{others.mean():.0f} ± {others.std(ddof=1):.0f} mm);\n"
        f"* the pelvis is {up} mm higher on the left (ASIS, iliac crest, PSIS);\n"
        f"* the left knee is bent {np.degrees(own['bend']):.0f}° more than the right, in stance "
        f"{np.degrees(found['bend_in_stance']):.0f}°, as people shorten a longer leg.\n\n"
        f"Markers may err instead. Were {straight['straighter_deg']:.0f}° of the bend their error, "
        f"the record alone would say {mm(straight, 'alone', 'alone_sd')} mm instead of "
        f"{mm(as_it_is, 'alone', 'alone_sd')}, within what people's legs differ. But the logarithm "
        "of the record's likelihood is then lower by "
        f"{(straight['cost'] - as_it_is['cost']) / 2:.1f}, and the bend in standing is that of "
        "joint centres, which no axes enter. What is left is a longer leg or a hip centre in the "
        "wrong place. Measure both legs to decide."
    )


@evidence.measurement()
def rollouts(_: Namespace) -> list[Row]:
    """The paper's identification by rollouts beside the posterior; a table in the page, no row."""
    stored = json.loads((STORE / "rollouts.json").read_text())
    lines = [
        "| subject | seeds | ε: as scaled, posterior | ε by rollouts | walks, processor time of a "
        "search | seeds apart, posterior SDs | from the posterior, posterior SDs | "
        "mean of thigh and shank: posterior, rollouts |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, own in stored["posteriors"].items():
        searches = [each for each in stored["searches"] if each["name"] == name]
        mus = np.array([each["mu"] for each in searches])[:, 2:]
        mean, sd = (np.array(own[key])[2:] for key in ("mean", "sd"))
        epsilons = [each["epsilon"]["rollouts"] for each in searches]
        apart = rms((mus - mus.mean(axis=0)) / sd) * np.sqrt(len(mus) / (len(mus) - 1))
        lengths = [100 * (each.mean() - 1.0) for each in (mean[1:3], mus[:, 1:3])]
        lines.append(
            f"| {name} | {len(searches)} | {searches[0]['epsilon']['scaled']:.3f}, "
            f"{own['epsilon']:.3f} | {np.mean(epsilons):.3f} ± {np.std(epsilons, ddof=1):.3f} "
            f"| {np.mean([each['walks'] for each in searches]):.0f}, "
            f"{np.mean([each['processor_seconds'] for each in searches]):.0f} s | {apart:.2f} "
            f"| {rms((mus - mean) / sd):.2f} | {lengths[0]:+.1f} %, {lengths[1]:+.1f} % |"
        )
    text = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(text, "rollouts", "\n".join(lines)))
    return []
