"""How good walks are on what was held out of the record.

Reads `reports/held_out/*/*.json`, which `make held-out` writes (`experiments/held_out_runs.py`, two
hours), and the stored baselines of people who were held out at another speed. Records are those
with the faults of the plates corrected, scaled to one body weight; beside them as measured.
"""

import json
from typing import Any

import numpy as np

import claims
from claims import ROOT, Claim
from claims.marked_table import with_table
from gaitval._internal.io.artefacts import write_text
from gaitval.configuration import RecordSettings
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics import baselines, other_trials, verdict_rows
from gaitval.metrics.baselines import others_line
from gaitval.metrics.comparison import rms
from gaitval.metrics.curve_results import CURVE_UNITS, by_kind
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.subject_file import builtin_subjects, load_subject

STORE = ROOT / "reports" / "held_out"
JOINTS = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
GROUPS = {
    "sagittal angles": ("angles", tuple(JOINTS)),
    "moments": ("moments", tuple(JOINTS)),
    "forces": ("forces", ("vertical", "forward", "medial")),
}
ADDUCTION = {"hip adduction moment": ("moments", ("hip_adduction",))}
NEAR = 0.15
"""Change of speed up to which copying the nearest trial is hard to beat."""
_Stored = dict[str, Any]


def stored(kind: str) -> dict[str, _Stored]:
    """What runs of a kind reached, by name."""
    return {
        path.stem: json.loads(path.read_text()) for path in sorted((STORE / kind).glob("*.json"))
    }


def mean(errors: dict[str, Any], names: tuple[str, ...]) -> float:
    """Mean RMSE of curves, both sides; NaN where a walk was too short."""
    values = [errors[f"{name}_{side}"] for name in names for side in "rl"]
    return float(np.mean([np.nan if value is None else value for value in values]))


def falls(found: _Stored) -> int:
    """Walks that fell, or did not reach 100 cycles."""
    return sum(start["fell"] or start["cycles"]["right"] < 100 for start in found["starts"])


def kinetics_rows(found: dict[str, _Stored]) -> list[Claim]:
    """Kinetics from kinematics: skills, and the angles that were known."""
    rows, count = [], 2 * len(found)
    skill_of = "kinetics from kinematics: skill"
    for which, key in (
        ("record corrected", "errors"),
        ("record as measured", "errors_as_measured"),
    ):
        for kind, names in (("forces", ("vertical", "forward", "medial")), ("moments", JOINTS)):
            for name in names:
                ours = [mean(each[key][kind], (name,)) for each in found.values()]
                guesses = [guess(each, kind, name, which) for each in found.values()]
                value = float(1.0 - np.mean(ours) / np.mean(guesses))
                noun = f"{JOINTS[name]} moment" if kind == "moments" else f"{name} force"
                what = f"{skill_of}, {noun}, {which}"
                rows.append(Claim(what, value, "1", count))
    angles = [mean(each["errors"]["angles"], tuple(JOINTS)) for each in found.values()]
    for what, value in (("mean", np.mean(angles)), ("worst person", np.max(angles))):
        what = f"kinetics from kinematics: sagittal angles (known to the model), {what}"
        rows.append(Claim(what, float(value), "deg", len(angles)))
    fell = sum(falls(each) > 0 for each in found.values())
    what = "kinetics from kinematics: people who fall within 100 cycles"
    rows.append(Claim(what, fell, "people", len(found)))
    return rows


def guess(found: _Stored, kind: str, name: str, which: str) -> float:
    """Error of the line through the nine others."""
    subject = load_subject(found["subject"]["identifier"])
    if "as measured" not in which:
        return mean(found["predictions"][0]["rmse"][kind], (name,))
    raw = by_kind(recorded_curves(subject.measured()))[kind]
    people = [load_subject(number) for number in range(1, 11)]
    unscaled = [each.model_copy(update={"plates": None}) for each in people]
    line = others_line(subject.model_copy(update={"plates": None}), unscaled)
    assert line is not None
    drawn = by_kind(line.curves)[kind]
    return float(np.mean([rms(drawn[f"{name}_{s}"] - raw[f"{name}_{s}"]) for s in "rl"]))


def speed_rows(found: dict[str, _Stored]) -> list[Claim]:
    """Held-out trials at other speeds."""
    rows = []
    near, far = split_by_speed(found)
    for group, (kind, names) in GROUPS.items():
        fitted = {name: fitted_error(name, kind, names) for name in near}
        ratios = [mean(near[n]["errors"][kind], names) / fitted[n] for n in near]
        what = f"unseen speed within 15 %: {group}, error over that of the fitted trial, worst"
        rows.append(Claim(what, max(ratios), "1", len(ratios)))
    for group, (kind, names) in GROUPS.items():
        ours = np.mean([mean(each["errors"][kind], names) for each in far.values()])
        for against in ("nearest trial copied", "other people's change added"):
            theirs = np.mean([mean(rmse_of(each, against)[kind], names) for each in far.values()])
            what = f"unseen speed within 40 %: {group}, skill against {against}"
            value = float(1.0 - ours / theirs)
            rows.append(Claim(what, value, "1", len(far)))
    for what, kind, names, unit in (
        ("sagittal angles", "angles", tuple(JOINTS), "deg"),
        ("moments", "moments", tuple(JOINTS), "Nm/kg"),
        ("vertical force", "forces", ("vertical",), "% BW"),
    ):
        value = float(np.mean([mean(each["errors"][kind], names) for each in far.values()]))
        what = f"unseen speed within 40 %: {what}, mean error"
        rows.append(Claim(what, value, unit, len(far)))
    fell = sum(falls(each) > 0 for each in found.values())
    what = "unseen speeds: held-out trials with a fall within 100 cycles"
    rows.append(Claim(what, fell, "trials", len(found)))
    return rows


def split_by_speed(found: dict[str, _Stored]) -> tuple[dict[str, _Stored], dict[str, _Stored]]:
    """Trials within a fraction of a known speed, and the others."""
    near, far = {}, {}
    for name, each in found.items():
        person, trial = name.split("-")
        subject = load_subject(person)
        names = [subject.trial, *(each.name for each in subject.trials)]
        known = [subject.on_trial(each) for each in names if each != trial]
        change = min(abs(each["speed"] / t.walking_speed_m_s - 1.0) for t in known)
        (near if change <= NEAR + 0.005 else far)[name] = each
    return near, far


def fitted_error(name: str, kind: str, names: tuple[str, ...]) -> float:
    """Error of the walker that was fitted to the person's own trial: the stored baseline."""
    path = ROOT / "reports" / name.split("-")[0] / "baseline" / "metrics.json"
    metrics = json.loads(path.read_text())
    errors = metrics["walks"][metrics["final"]]["errors"][kind]
    return mean({curve: error and error["rmse"] for curve, error in errors.items()}, names)


def rmse_of(found: _Stored, prediction: str) -> dict[str, Any]:
    """Errors of a prediction without a model."""
    rmse: dict[str, Any] = next(
        each["rmse"] for each in found["predictions"] if each["name"] == prediction
    )
    return rmse


def halves_rows(found: dict[str, _Stored]) -> list[Claim]:
    """The half of a session's cycles that was held out; and without what the person's own two
    halves differ by, which no walk of one half can foresee.
    """
    rows = []
    for group, (kind, names) in GROUPS.items():
        pairs = [
            (
                mean(row["rmse"][kind], names),
                mean(row["between"][kind], names),
                mean(each["errors"][kind], names),
            )
            for each in found.values()
            for row in each["unseen"]
        ]
        what = f"unseen half of a session's cycles: {group}, error over the fitted half's, worst"
        ratio = max(unseen / fitted for unseen, _, fitted in pairs)
        rows.append(Claim(what, ratio, "1", len(pairs)))
        beyond = max(
            max(unseen**2 - between**2, 0.0) ** 0.5 / fitted for unseen, between, fitted in pairs
        )
        what += ", beyond the person's own difference between halves"
        rows.append(Claim(what, beyond, "1", len(pairs)))
    return rows


@claims.measured()
def kinetics(_: claims.Given) -> list[Claim]:
    """Kinetics of walks that know angles only: skill against nine others."""
    return kinetics_rows(stored("kinematics"))


@claims.measured()
def speeds(_: claims.Given) -> list[Claim]:
    """Walks of a trial at a speed that was held out, beside predictions without physics."""
    found = stored("holdout")
    rows = speed_rows(found)
    for which, those in zip(("15 %", "40 %"), split_by_speed(found), strict=True):
        before = {name: predicted_errors(*name.split("-")) for name in those}
        for group, (kind, names) in speed_groups().items():
            walked = np.mean([mean(each["errors"][kind], names) for each in those.values()])
            predicted = np.mean([mean(before[name][kind], names) for name in those])
            what = f"unseen speed within {which}: {group}, error of the walk"
            rows.append(Claim(what, float(walked), CURVE_UNITS[kind], len(those)))
            what += " over that of the statistical prediction"
            rows.append(Claim(what, float(walked / predicted), "1", len(those)))
    return rows


PAGE = ROOT / "docs" / "held-out.md"


def speed_table() -> str:
    """Errors of statistics and walks, near and far in speed, for the page."""
    lines = [
        "| | sagittal angles ° | moments Nm/kg | hip adduction moment | vertical "
        "| anterior–posterior | mediolateral % BW |",
        "|---|---|---|---|---|---|---|",
    ]
    for which, those in zip(("near", "far"), split_by_speed(stored("holdout")), strict=True):
        before = {name: predicted_errors(*name.split("-")) for name in those}
        cells: dict[str, list[str]] = {"the curves": [], "the walk": [], "ratio": []}
        for group, (kind, names) in speed_groups().items():
            digits = 2 if group.endswith("force") or kind == "angles" else 4
            walked = np.mean([mean(each["errors"][kind], names) for each in those.values()])
            predicted = np.mean([mean(before[name][kind], names) for name in those])
            cells["the curves"].append(f"{predicted:.{digits}f}")
            cells["the walk"].append(f"{walked:.{digits}f}")
            cells["ratio"].append(f"{walked / predicted:.2f}")
        label = f"{which}, {len(those)} trials"
        lines += [f"| {label}: {row} | " + " | ".join(c) + " |" for row, c in cells.items()]
    return "\n".join(lines)


def speed_groups() -> dict[str, tuple[Any, tuple[str, ...]]]:
    """Groups of curves of a walk at another speed: kind and names."""
    every = {**baselines.GROUPS, **ADDUCTION}
    first = ("sagittal angles", "moments", *ADDUCTION)
    return {name: every[name] for name in (*first, *(n for n in every if n.endswith("force")))}


@claims.measured()
def bands(_: claims.Given) -> list[Claim]:
    """Share of the points of held-out trials that the band of the other trials contains."""
    rows = list(other_trials.held_out_trials(builtin_subjects(), RecordSettings()))
    inside: dict[str, list[float]] = {"near": [], "far": []}
    for row in rows:
        others = [each for each in rows if each.independent != row.independent]
        widths = other_trials.half_widths(others, row.away)
        which = "near" if row.away < other_trials.FAR else "far"
        for (kind, name), error in row.errors.items():
            width = widths[kind, name[:-2]]
            says = width > 1e-3 * width.max()  # a force in swing is known
            inside[which].append(float(np.mean(np.abs(error[says]) <= width[says])))
    share = f"the {100 * verdict_rows.CONFIDENCE:.0f} % band of a predicted curve holds"
    return [
        *(
            Claim(f"unseen speed, {which}: {share}", float(np.mean(values)), "1", len(values))
            for which, values in inside.items()
        ),
        Claim(
            f"unseen speed: {share}",
            float(np.mean([*inside["near"], *inside["far"]])),
            "1",
            len(inside["near"]) + len(inside["far"]),
        ),
    ]


def predicted_errors(person: str, trial: str) -> dict[str, dict[str, float]]:
    """RMSE of what other trials predict of one, without a model."""
    subject = load_subject(person)
    known = known_record(subject, RecordSettings(holdout=trial), builtin_subjects()).record
    truth = by_kind(recorded_curves(subject.on_trial(trial).record()))
    return {
        kind: {name: rms(curve - truth[kind][name]) for name, curve in curves.items()}
        for kind, curves in by_kind(recorded_curves(known)).items()
    }


@claims.measured()
def halves(_: claims.Given) -> list[Claim]:
    """Walks that know one half of a session's cycles, against the other half."""
    return halves_rows(stored("halves"))


def write_page() -> None:
    """Write the table of the page from what is stored."""
    text = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(text, "speeds", speed_table()))


if __name__ == "__main__":
    write_page()
