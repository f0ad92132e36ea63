"""How far identification can be trusted: tables, and the rows of evidence/identification.csv.

Reads `reports/identification/virtual.json` (`experiments/virtual_people.py --walks`), `real.json`
(`experiments/real_people.py`), `ablation.json` (`experiments/identification_ablation.py`) and the
stored baselines. Writes the rows, and the tables and pictures of docs/identification.md.

It is long because each table stands beside the rows of the same numbers.
"""

import json
from argparse import Namespace
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import binom, norm

import evidence
from evidence import ROOT
from evidence.marked_table import with_table
from gaitval.artefacts import replacing, write_text
from gaitval.model.parameters import PARAMETERS

mpl.use("agg")

STORE = ROOT / "reports" / "identification"
PAGE = ROOT / "docs" / "identification.md"
Row = evidence.Row
MEASURES = {
    "identification of one subject, *": {"data": ("reports/S??/baseline/times.json",)},
    "the ten: *": {
        "code": ("@body", "@scaled", "@reference", "@identified", "experiments/real_people.py"),
        "results": ("reports/identification/real.json",),
    },
    "two seeds of the search, *": {
        "code": ("@body", "@scaled", "@reference", "@identified", "experiments/real_people.py"),
        "results": ("reports/identification/real.json",),
    },
    "Laplace against importance sampling*": {
        "code": ("@body", "@scaled", "@reference", "@identified", "experiments/real_people.py"),
        "results": ("reports/identification/real.json",),
    },
    "virtual people: *epsilon*": {
        "code": (
            "@walk",
            "@identified",
            "@errors",
            "gaitval/metrics/epsilon.py",
            "gaitval/apps/virtual/person.py",
            "experiments/virtual_people.py",
        ),
        "data": ("reports/general/policy.safetensors",),
        "results": ("reports/identification/virtual.json",),
    },
    "virtual people: *": {
        "code": (
            "@body",
            "@scaled",
            "@reference",
            "@identified",
            "gaitval/apps/virtual/person.py",
            "experiments/virtual_people.py",
        ),
        "results": ("reports/identification/virtual.json",),
    },
    "6-seed ablation, *": {
        "code": (
            "@walk",
            "@identified",
            "@errors",
            "gaitval/metrics/epsilon.py",
            "experiments/identification_ablation.py",
        ),
        "data": ("reports/general/policy.safetensors",),
        "results": ("reports/identification/ablation.json",),
    },
}
"""What the rows depend on; see evidence/stale.py."""


def virtual_people() -> list[dict[str, Any]]:
    """Those who could be measured."""
    people = json.loads((STORE / "virtual.json").read_text())["people"]
    return [each for each in people if "refused" not in each]


def arrays(people: list[dict[str, Any]]) -> dict[str, Any]:
    """(people, 14) of truth, prior and posterior, and derived numbers."""
    keys = ("truth", "prior_mean", "prior_sd", "mean", "sd")
    found = {key: np.array([each[key] for each in people]) for key in keys}
    found["z"] = (found["truth"] - found["mean"]) / found["sd"]
    found["verdicts"] = np.array([each["verdicts"] for each in people])
    return found


def within(z: Any, share: float) -> float:
    """Share of truths inside the central interval of a Gaussian."""
    return float(np.mean(np.abs(z) < norm.ppf(0.5 + 0.5 * share)))


def legs(people: list[dict[str, Any]], index: int = 0) -> Any:
    """(people, 4) m: truth, mean, SD and prior SD of a combination."""
    return np.array(
        [[each["combinations"][index][key] for key in ("truth", "mean", "sd", "prior_sd")]
         for each in people]
    )  # fmt: skip


def rms(values: Any) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def virtual_rows(people: list[dict[str, Any]]) -> list[Row]:
    """Coverage, errors, legs, and what the walkers gain."""
    found = arrays(people)
    declared = found["verdicts"] == "identified"
    told = (found["verdicts"] == "identified") | (found["verdicts"] == "weak")
    rows = [
        Row(
            "virtual people: parameters declared identified, per person",
            float(declared.sum() / len(people)), "parameters", ">=", 0, 0, len(people),
        )
    ]  # fmt: skip
    legs_ = legs(people)
    leg_z = (legs_[:, 0] - legs_[:, 1]) / legs_[:, 2]
    for name, z in (
        ("all parameters that the fit looks for", found["z"][:, 2:]),
        ("parameters declared identified or weak", found["z"][told]),
        ("leg length (thigh + shank)", leg_z),
    ):
        cover = within(z, 0.9)
        what = f"virtual people: coverage of 90 % intervals, {name}"
        n = int(np.size(z))
        rows.append(Row(f"{what}, at least", cover, "1", ">=", 0.85, 0.80, n))
        rows.append(Row(f"{what}, at most", cover, "1", "<=", 0.95, 0.97, n))
    error = ((found["mean"] - found["truth"]) / found["prior_sd"])[told]
    rows.append(
        Row(
            "virtual people: declared identified or weak, RMS error over the prior's SD",
            rms(error), "1", "<=", 0.3, 0.5, int(told.sum()),
        )
    )  # fmt: skip
    missed = float(np.mean(np.abs(found["z"][told]) > 2.0))
    rows.append(
        Row(
            "virtual people: declared identified or weak, missed by more than 2 posterior SD",
            missed, "1", "<=", 0.05, 0.10, int(told.sum()),
        )
    )  # fmt: skip
    for by in ("markers", "stature"):
        part = np.array([each["by"] == by for each in people])
        chosen = legs_[part]
        prior = 100 * rms(chosen[:, 0])
        rows.append(
            Row(
                f"virtual people: leg length by {by} (prior misses {prior:.1f} cm RMS), RMS error",
                100 * rms(chosen[:, 0] - chosen[:, 1]), "cm", "<=", 1.0, 1.5, int(part.sum()),
            )
        )  # fmt: skip
    walked = [each["epsilon"] for each in people if each.get("epsilon")]
    walked = [each for each in walked if "truth" in each and None not in each.values()]
    if walked:
        gains = np.array([1.0 - each["identified"] / each["nominal"] for each in walked])
        n = len(gains)
        rows += [
            Row(
                "virtual people: epsilon of the general policy lower as identified than as scaled",
                float(np.mean(gains > 0.0)), "1", ">=", 0.9, 0.8, n,
            ),
            Row(
                "virtual people: median gain of epsilon",
                float(100 * np.median(gains)), "%", ">=", 15, 8, n,
            ),
        ]  # fmt: skip
    return rows


def ceiling(people: list[dict[str, Any]]) -> list[str]:
    """What knowing the truth gains, in words."""
    known = [each["epsilon"] for each in people if (each.get("epsilon") or {}).get("truth")]
    known = [each for each in known if None not in each.values()]
    if not known:
        return []
    gains = {
        key: np.array([1.0 - each[key] / each["nominal"] for each in known])
        for key in ("truth", "identified")
    }
    lower = {key: int(np.sum(each > 0)) for key, each in gains.items()}
    median = {key: 100 * np.median(each) for key, each in gains.items()}
    return [
        f"{len(known)} of them also walked with their true body: epsilon is lower than as scaled "
        f"in {lower['truth']}, by {median['truth']:.1f} % in the median; with the identified body "
        f"in {lower['identified']}, by {median['identified']:.1f} %. No identification can be "
        "asked for more than the truth gains."
    ]


def virtual_table(people: list[dict[str, Any]]) -> list[str]:
    """A row for each parameter."""
    found = arrays(people)
    error = (found["mean"] - found["truth"]) / found["prior_sd"]
    lines = [
        f"{len(people)} people of seed {people[0]['seed']}. Error: posterior mean less truth.",
        "",
        "| parameter | SD, posterior / prior | RMS error / prior SD | 50 % intervals hold |"
        " 90 % hold | verdicts: identified, weak, not |",
        "|---|---|---|---|---|---|",
    ]
    for i, name in enumerate(PARAMETERS):
        z = found["z"][:, i]
        verdicts = found["verdicts"][:, i]
        counts = ", ".join(
            str(int(np.sum(verdicts == verdict)))
            for verdict in ("identified", "weak", "not identified")
        )
        ratio = np.mean(found["sd"][:, i] / found["prior_sd"][:, i])
        lines.append(
            f"| {name} | {ratio:.2f} | {rms(error[:, i]):.2f} | {100 * within(z, 0.5):.0f} % "
            f"| {100 * within(z, 0.9):.0f} % | {counts} |"
        )
    for index, name in ((0, "leg length, cm"), (1, "hip to ankle, cm")):
        for by in ("markers", "stature"):
            part = [each for each in people if each["by"] == by]
            if not part:
                continue
            numbers = legs(part, index)
            z = (numbers[:, 0] - numbers[:, 1]) / numbers[:, 2]
            lines.append(
                f"| {name}, by {by} | {np.mean(numbers[:, 2] / numbers[:, 3]):.2f} "
                f"| {100 * rms(numbers[:, 0] - numbers[:, 1]):.1f} cm (before: "
                f"{100 * rms(numbers[:, 0]):.1f}) | {100 * within(z, 0.5):.0f} % "
                f"| {100 * within(z, 0.9):.0f} % | |"
            )
    return lines


def real_rows(people: dict[str, Any]) -> list[Row]:
    """The ten: likelihood on the trial used and on others, seeds, and the time."""
    own = [each["own"]["identified"] < each["own"]["nominal"] for each in people.values()]
    others = [
        trial["identified"] < trial["nominal"]
        for each in people.values()
        for trial in each["others"].values()
    ]
    rows = [
        Row("the ten: trial used is more likely as identified", sum(own), "people", ">=", 10, 8,
            len(own)),
        Row("the ten: held-out trials are more likely as identified", sum(others), "trials", ">=",
            len(others), round(4 / 6 * len(others)), len(others)),
    ]  # fmt: skip
    for key, what in (("mode", "the result"), ("cma", "CMA-ES alone")):
        apart = [each["seeds"][key] for each in people.values() if "seeds" in each]
        rows.append(
            Row(f"two seeds of the search, largest difference of {what}", max(apart),
                "posterior SD", "<=", 0.2, 0.4, len(apart))
        )  # fmt: skip
    off = [each["sampled"] for each in people.values() if "sampled" in each]
    rows.append(
        Row("Laplace against importance sampling: SD, largest relative difference",
            max(max(abs(np.array(each["sd_ratio"]) - 1.0)) for each in off), "1", "<=", 0.2, 0.3,
            len(off))
    )  # fmt: skip
    seconds = []
    for path in sorted((ROOT / "reports").glob("S??/baseline/times.json")):
        for run in json.loads(path.read_text()).values():
            if "identify-1" in run["stages"]:
                seconds.append(run["stages"]["identify-1"])
    rows.append(
        Row("identification of one subject, 2 cores, slowest of the stored runs", max(seconds) / 60,
            "min", "<=", 3, 6, len(seconds))
    )  # fmt: skip
    return rows


def real_table(people: dict[str, Any]) -> list[str]:
    """A row for each subject."""
    lines = [
        "| subject | leg by markers, cm | change found, cm | BMI | weak or identified | deviance,"
        " own trial: as scaled, as identified | other trials |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, each in people.items():
        told = [
            parameter.replace("_", " ")
            for parameter, verdict in zip(PARAMETERS, each["verdicts"], strict=True)
            if verdict != "not identified"
        ]
        others = "; ".join(
            f"{trial}: {at['nominal']:.1f}, {at['identified']:.1f}"
            for trial, at in each["others"].items()
        )
        leg = each["leg"]
        lines.append(
            f"| {name} | {100 * each['leg_scaled']:.1f} ± {100 * leg['prior_sd']:.1f} "
            f"| {100 * leg['mean']:+.1f} ± {100 * leg['sd']:.1f} "
            f"| {each['body_mass_index']:.0f} | {', '.join(told)} "
            f"| {each['own']['nominal']:.1f}, {each['own']['identified']:.1f} | {others} |"
        )
    change = np.array([each["leg"]["mean"] for each in people.values()])
    index = np.array([each["body_mass_index"] for each in people.values()])
    lines += [
        "",
        f"Correlation of the change of the leg with the body mass index over the "
        f"{len(people)} people: {np.corrcoef(change, index)[0, 1]:+.2f}.",
    ]
    for name, each in people.items():
        if "sampled" in each:
            by = each["sampled"]
            lines.append(
                f"{name}: importance sampling with {by['draws']} draws (worth "
                f"{by['effective_draws']:.0f}) against Laplace: means differ by at most "
                f"{np.abs(by['mean_off_in_sd']).max():.2f} SD, SDs by a factor of "
                f"{min(by['sd_ratio']):.2f} to {max(by['sd_ratio']):.2f}."
            )
    return lines


def legs_table(people: dict[str, Any]) -> list[str]:
    """Thigh + shank of the ten, cm, by everything that knows something of it."""
    lines = [
        "| subject | markers | stature alone | stature, then the record | stance | tape, to the"
        " ground |",
        "|---|---|---|---|---|---|",
    ]
    for name, each in people.items():
        leg, by = each["leg"], each["by_stature"]
        lines.append(
            f"| {name} | {100 * each['leg_scaled']:.1f} ± {100 * leg['prior_sd']:.1f} "
            f"| {100 * by['scaled']:.1f} ± {100 * by['prior_sd']:.1f} "
            f"| {100 * by['found']:.1f} ± {100 * by['sd']:.1f} "
            f"| {100 * each['leg_stance']:.1f} | {100 * each['leg_tape']:.1f} |"
        )
    found = {
        key: np.array([of(each) for each in people.values()])
        for key, of in (
            ("markers", lambda each: each["leg_scaled"]),
            ("record", lambda each: each["leg_scaled"] + each["leg"]["mean"]),
            ("stance", lambda each: each["leg_stance"]),
            ("before", lambda each: each["by_stature"]["scaled"]),
            ("after", lambda each: each["by_stature"]["found"]),
        )
    }
    lines.append("")
    for other, words in (
        ("markers", "the legs by markers"),
        ("record", "those by markers and the record"),
        ("stance", "those that stance asks for"),
    ):
        apart = [100 * rms(found[key] - found[other]) for key in ("before", "after")]
        lines.append(
            f"From {words}, legs by stature are {apart[0]:.1f} cm RMS away before the record is "
            f"seen, and {apart[1]:.1f} cm after."
        )
    return lines


def ablation() -> tuple[list[Row], list[str], dict[str, Any]]:
    """Row, table, and the figures: by body and subject, arrays (seeds,) as scaled and as found."""
    stored = json.loads((STORE / "ablation.json").read_text())
    found: dict[str, Any] = {}
    for key, walk in stored["walks"].items():
        subject, body, seed, which = key.split()
        place = found.setdefault(body, {}).setdefault(subject, {"nominal": {}, "identified": {}})
        place[which][int(seed)] = walk
    lines = [
        f"{stored['samples']:,} samples from the general policy, the same for both; "
        "walks from eight starts without correction, mean ± SD over the seeds. Errors: RMSE of "
        "hip, knee and ankle (sagittal), and of the ground reaction.",
        "",
        "| body by | subject | | ε | angles, deg | moments, Nm/kg | forces, % BW | seeds with a "
        "lower ε |",
        "|---|---|---|---|---|---|---|---|",
    ]
    rows = []
    for body, subjects in found.items():
        for subject, walks in subjects.items():
            both = [seed for seed in walks["nominal"] if seed in walks["identified"]]
            lower = sum(
                (walks["identified"][seed]["epsilon"] or np.inf)
                < (walks["nominal"][seed]["epsilon"] or np.inf)
                for seed in both
            )
            for which, title in (("nominal", "RL alone"), ("identified", "RL + identification")):
                each = [walk for walk in walks[which].values() if walk["epsilon"] is not None]
                cells = " | ".join(
                    f"{np.mean([walk[kind] for walk in each]):.{digits}f} ± "
                    f"{np.std([walk[kind] for walk in each], ddof=1):.{digits}f}"
                    for kind, digits in (("epsilon", 3), ("angles", 2), ("moments", 3),
                                         ("forces", 2))
                )  # fmt: skip
                count = f"{lower} of {len(both)}" if which == "identified" else ""
                lines.append(f"| {body} | {subject} | {title} | {cells} | {count} |")
        seeds = sorted(
            set.intersection(
                *(set(by_seed) for walks in subjects.values() for by_seed in walks.values())
            )
        )
        means = {
            which: [
                np.mean([subjects[name][which][seed]["epsilon"] or np.inf for name in subjects])
                for seed in seeds
            ]
            for which in ("nominal", "identified")
        }
        gains = 1.0 - np.array(means["identified"]) / np.array(means["nominal"])
        if body == "stature":
            rows = [
                Row("6-seed ablation, body by stature: seeds whose epsilon, mean of the subjects, "
                    "is lower with identification", int(np.sum(gains > 0)), "seeds", ">=",
                    len(seeds), len(seeds) - 1, len(seeds)),
            ]  # fmt: skip
        gain = f"{100 * np.mean(gains):.1f} ± {100 * np.std(gains, ddof=1):.1f} %"
        lower = f"{int(np.sum(gains > 0))} of {len(seeds)}"
        lines.append(f"| {body} | all | gain of ε | {gain} | | | | {lower} |")
    return rows, lines, found


def draw_ablation(found: dict[str, Any]) -> None:
    """The paper's bars: mean and SD over the seeds, RL alone against RL with identification."""
    kinds = (("angles", "RMSE, °"), ("moments", "RMSE, Nm/kg"), ("forces", "RMSE, % BW"))
    cases = [(body, name) for body, subjects in found.items() for name in subjects]
    figure, axes = plt.subplots(1, 3, figsize=(9.0, 2.8), layout="constrained")
    for axis, (kind, label) in zip(axes, kinds, strict=True):
        for offset, which, colour, title in (
            (-0.2, "nominal", "0.6", "RL alone"),
            (0.2, "identified", "#0072b2", "RL + identification"),
        ):
            values = [
                [walk[kind] for walk in found[body][name][which].values()
                 if walk["epsilon"] is not None]
                for body, name in cases
            ]  # fmt: skip
            axis.bar(
                np.arange(len(cases)) + offset,
                [np.mean(each) for each in values],
                0.4,
                yerr=[np.std(each, ddof=1) for each in values],
                color=colour,
                label=title,
                capsize=2,
            )
        axis.set_xticks(range(len(cases)), [f"{name}\n{body}" for body, name in cases], fontsize=7)
        axis.set_title(kind)
        axis.set_ylabel(label)
    axes[0].legend(fontsize=7, loc="lower right")
    save(figure, "identification_ablation")


def draw_ranks(people: list[dict[str, Any]]) -> None:
    """Rank histograms (Talts et al. 2018): where in its posterior each truth is."""
    found = arrays(people)
    legs_ = legs(people)
    cases = [
        *((PARAMETERS[i].replace("_", " "), found["z"][:, i]) for i in range(2, len(PARAMETERS))),
        ("leg length", (legs_[:, 0] - legs_[:, 1]) / legs_[:, 2]),
        ("all parameters", found["z"][:, 2:].ravel()),
    ]
    figure, axes = plt.subplots(2, 7, figsize=(9.5, 3.0), layout="constrained", sharex=True)
    bins = 5
    for axis, (name, z) in zip(axes.flat, cases, strict=True):
        axis.hist(norm.cdf(z), bins=np.linspace(0.0, 1.0, bins + 1), color="#0072b2")
        low, high = binom.ppf([0.05, 0.95], z.size, 1.0 / bins)
        axis.axhspan(low, high, color="0.8", zorder=0)
        axis.set_title(name, fontsize=7)
        axis.tick_params(labelsize=6)
    save(figure, "identification_ranks")


def save(figure: Any, name: str) -> None:
    """The same bytes whenever it is drawn."""
    with (
        plt.rc_context({"svg.hashsalt": name, "svg.fonttype": "path"}),
        replacing(ROOT / "docs" / f"{name}.svg") as temporary,
    ):
        figure.savefig(temporary, format="svg", metadata={"Date": None})
    plt.close(figure)


@evidence.measurement()
def bodies(_: Namespace) -> list[Row]:
    """Virtual and real people, and the ablation; also writes docs/identification.md."""
    people = virtual_people()
    real = json.loads((STORE / "real.json").read_text())["people"]
    rows, ablated, walks = ablation()
    text = PAGE.read_text(encoding="utf-8")
    for mark, lines in (
        ("virtual", virtual_table(people)),
        ("ceiling", ceiling(people)),
        ("real", real_table(real)),
        ("legs", legs_table(real)),
        ("ablation", ablated),
    ):
        text = with_table(text, mark, "\n".join(lines))
    write_text(PAGE, text)
    draw_ablation(walks)
    draw_ranks(people)
    return [*virtual_rows(people), *real_rows(real), *rows]
