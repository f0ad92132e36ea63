"""How good walks are on what was held out: tables, and the rows of evidence/held_out.csv.

Reads `reports/held_out/*/*.json` (made by `experiments/held_out_runs.py`) and the stored baselines
of people who were held out at another speed. Writes `reports/evidence/held_out.csv` and the table
of docs/held-out.md. Records are those with the faults of the plates corrected, scaled to one body
weight; beside them as measured.
"""

import json
import subprocess
import sys
from argparse import Namespace
from typing import Any

import numpy as np

import evidence
from evidence import ROOT
from evidence.likeness import printed
from evidence.marked_table import with_table
from gaitval.artefacts import write_text
from gaitval.datasets.subject_file import load_subject
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.baselines import others_line
from gaitval.metrics.comparison import rms
from gaitval.metrics.recorded import by_kind

STORE = ROOT / "reports" / "held_out"
PAGE = ROOT / "docs" / "held-out.md"
JOINTS = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
GROUPS = {
    "sagittal angles": ("angles", tuple(JOINTS)),
    "moments": ("moments", tuple(JOINTS)),
    "forces": ("forces", ("vertical", "forward", "medial")),
}
NEAR = 0.15
"""Change of speed up to which copying the nearest trial is hard to beat."""
Stored = dict[str, Any]
MEASURES = {
    "poison tests that fail": {
        "code": (
            "evidence/held_out.py:poison_row",
            "gaitval/prediction/*.py",
            "gaitval/study/stages.py",
            "gaitval/study/inputs.py",
        ),
        "data": ("tests/workflows/test_poison.py",),
    },
    "kinetics from kinematics: *the dynamic fit before any walk": {
        "code": (
            "@body",
            "@scaled",
            "@reference",
            "@errors",
            "gaitval/metrics/reference_curves.py",
            "gaitval/learning_control/centring.py",
            "gaitval/study/stages.py:_reference_of",
            "gaitval/prediction/*.py",
            "experiments/held_out_runs.py:reference_errors,store,KINEMATICS",
        ),
        "results": ("reports/held_out/kinematics/*.json",),
        "allowed": 130,
        "why": "the URDF is read by Python's XML, scaling.csv written without pandas, and speeds "
        "far below every trial are predicted otherwise: bodies and known records keep their bits",
    },
    "kinetics from kinematics: *": {
        "code": (
            "@walk",
            "@identified",
            "@errors",
            "gaitval/study/stages.py:_reference_of",
            "gaitval/prediction/*.py",
            "experiments/held_out_runs.py:walked,kinematics,KINEMATICS,store",
        ),
        "data": ("reports/general/policy.safetensors",),
        "results": ("reports/held_out/kinematics/*.json",),
        "allowed": 130,
        "why": "the URDF is read by Python's XML, scaling.csv written without pandas, and speeds "
        "far below every trial are predicted otherwise: bodies and known records keep their bits",
    },
    "unseen speed*": {
        "code": (
            "@walk",
            "@identified",
            "@errors",
            "gaitval/prediction/*.py",
            "experiments/held_out_runs.py:holdout,store",
        ),
        "data": ("reports/general/policy.safetensors",),
        "results": ("reports/held_out/holdout/*.json",),
        "allowed": 130,
        "why": "the URDF is read by Python's XML, scaling.csv written without pandas, and speeds "
        "far below every trial are predicted otherwise: bodies and known records keep their bits",
    },
    "unseen half *": {
        "code": (
            "@walk",
            "@identified",
            "@errors",
            "@motion",
            "gaitval/measurement/halves.py",
            "experiments/held_out_runs.py:walked,halves,store",
        ),
        "data": ("reports/general/policy.safetensors",),
        "results": ("reports/held_out/halves/*.json",),
    },
}
"""What the rows depend on; see evidence/stale.py."""


def stored(kind: str) -> dict[str, Stored]:
    """What runs of a kind reached, by name."""
    return {
        path.stem: json.loads(path.read_text()) for path in sorted((STORE / kind).glob("*.json"))
    }


def mean(errors: dict[str, Any], names: tuple[str, ...]) -> float:
    """Mean RMSE of curves, both sides; NaN where a walk was too short."""
    values = [errors[f"{name}_{side}"] for name in names for side in "rl"]
    return float(np.mean([np.nan if value is None else value for value in values]))


def falls(found: Stored) -> int:
    """Walks that fell, or did not reach 100 cycles."""
    return sum(start["fell"] or start["cycles"]["right"] < 100 for start in found["starts"])


def kinetics_rows(found: dict[str, Stored]) -> list[evidence.Row]:
    """Kinetics from kinematics: skills, and the angles that were known."""
    rows, count = [], 2 * len(found)
    skill_of = "kinetics from kinematics: skill"
    for which, key in (
        ("record corrected", "errors"),
        ("record as measured", "errors_as_measured"),
        ("record corrected, the dynamic fit before any walk", "reference_errors"),
    ):
        for kind, names in (("forces", ("vertical", "forward", "medial")), ("moments", JOINTS)):
            for name in names:
                ours = [mean(each[key][kind], (name,)) for each in found.values()]
                guesses = [guess(each, kind, name, which) for each in found.values()]
                value = float(1.0 - np.mean(ours) / np.mean(guesses))
                noun = f"{JOINTS[name]} moment" if kind == "moments" else f"{name} force"
                what = f"{skill_of}, {noun}, {which}"
                rows.append(evidence.Row(what, value, "1", ">=", 0.3, 0.0, count))
    angles = [mean(each["errors"]["angles"], tuple(JOINTS)) for each in found.values()]
    for what, value in (("mean", np.mean(angles)), ("worst person", np.max(angles))):
        rows.append(
            evidence.Row(
                f"kinetics from kinematics: sagittal angles (known to the model), {what}",
                float(value), "deg", "<=", 2.0, 3.0, len(angles),
            )
        )  # fmt: skip
    fell = sum(falls(each) > 0 for each in found.values())
    what = "kinetics from kinematics: people who fall within 100 cycles"
    rows.append(evidence.none_may(what, fell, "people", len(found)))
    return rows


def guess(found: Stored, kind: str, name: str, which: str) -> float:
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


def speed_rows(found: dict[str, Stored]) -> list[evidence.Row]:
    """Held-out trials at other speeds."""
    rows = []
    near, far = split_by_speed(found)
    for group, (kind, names) in GROUPS.items():
        fitted = {name: fitted_error(name, kind, names) for name in near}
        ratios = [mean(near[n]["errors"][kind], names) / fitted[n] for n in near]
        what = f"unseen speed within 15 %: {group}, error over that of the fitted trial, worst"
        rows.append(
            evidence.Row(what, max(ratios), "1", "<=", 1.15, 1.4, len(ratios))
        )  # fmt: skip
    limits = {"sagittal angles": (0.4, 0.2), "moments": (0.25, 0.0), "forces": (0.25, 0.0)}
    for group, (kind, names) in GROUPS.items():
        ours = np.mean([mean(each["errors"][kind], names) for each in far.values()])
        for against, goal, must in (
            ("nearest trial copied", *limits[group]),
            ("other people's change added", 0.1, -np.inf),
        ):
            theirs = np.mean([mean(rmse_of(each, against)[kind], names) for each in far.values()])
            what = f"unseen speed within 40 %: {group}, skill against {against}"
            value = float(1.0 - ours / theirs)
            rows.append(evidence.Row(what, value, "1", ">=", goal, must, len(far)))
    for what, kind, names, unit, goal, must in (
        ("sagittal angles", "angles", tuple(JOINTS), "deg", 3.0, 4.5),
        ("moments", "moments", tuple(JOINTS), "Nm/kg", 0.10, 0.10),
        ("vertical force", "forces", ("vertical",), "% BW", 7.0, 7.0),
    ):
        value = float(np.mean([mean(each["errors"][kind], names) for each in far.values()]))
        what = f"unseen speed within 40 %: {what}, mean error"
        rows.append(evidence.Row(what, value, unit, "<=", goal, must, len(far)))
    fell = sum(falls(each) > 0 for each in found.values())
    what = "unseen speeds: held-out trials with a fall within 100 cycles"
    rows.append(evidence.none_may(what, fell, "trials", len(found)))
    return rows


def split_by_speed(
    found: dict[str, Stored], near_by: float = NEAR
) -> tuple[dict[str, Stored], dict[str, Stored]]:
    """Trials within a fraction of a known speed, and the others."""
    near, far = {}, {}
    for name, each in found.items():
        person, trial = name.split("-")
        subject = load_subject(person)
        names = [subject.trial, *(each.name for each in subject.trials)]
        known = [subject.on_trial(each) for each in names if each != trial]
        change = min(abs(each["speed"] / t.walking_speed_m_s - 1.0) for t in known)
        (near if change <= near_by + 0.005 else far)[name] = each
    return near, far


def fitted_error(name: str, kind: str, names: tuple[str, ...]) -> float:
    """Error of the walker that was fitted to the person's own trial: the stored baseline."""
    path = ROOT / "reports" / name.split("-")[0] / "baseline" / "metrics.json"
    metrics = json.loads(path.read_text())
    errors = metrics["walks"][metrics["final"]]["errors"][kind]
    return mean({curve: error and error["rmse"] for curve, error in errors.items()}, names)


def rmse_of(found: Stored, prediction: str) -> dict[str, Any]:
    """Errors of a prediction without a model."""
    rmse: dict[str, Any] = next(
        each["rmse"] for each in found["predictions"] if each["name"] == prediction
    )
    return rmse


def halves_rows(found: dict[str, Stored]) -> list[evidence.Row]:
    """The half of a session's cycles that was held out; and without what the person's own two
    halves differ by, which no walk of one half can foresee.
    """
    rows = []
    for group, (kind, names) in GROUPS.items():
        pairs = [
            (mean(row["rmse"][kind], names), mean(row["between"][kind], names),
             mean(each["errors"][kind], names))
            for each in found.values()
            for row in each["unseen"]
        ]  # fmt: skip
        what = f"unseen half of a session's cycles: {group}, error over the fitted half's, worst"
        ratio = max(unseen / fitted for unseen, _, fitted in pairs)
        rows.append(evidence.Row(what, ratio, "1", "<=", 1.1, 1.3, len(pairs)))
        beyond = max(
            max(unseen**2 - between**2, 0.0) ** 0.5 / fitted for unseen, between, fitted in pairs
        )
        what += ", beyond the person's own difference between halves"
        rows.append(evidence.Row(what, beyond, "1", "<=", 1.1, 1.3, len(pairs)))
    return rows


def poison_row() -> evidence.Row:
    """Run the poison tests."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "tests/workflows/test_poison.py"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    failed, passed = evidence.pytest_counts(done.stdout.strip().splitlines()[-1])
    return evidence.none_may("poison tests that fail", failed, "tests", failed + passed)


def table(kinds: dict[str, dict[str, Stored]]) -> str:
    """All runs by person and trial, beside predictions without a model."""
    lines = [
        "| run | status | sagittal angles ° | moments Nm/kg | vertical, fore-aft, medial % BW "
        "| nine others’ line: angles, moments, forces | nearest trial copied | fewest cycles |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for kind, found in kinds.items():
        for name, each in found.items():
            cells = [
                f"{kind} {name}",
                "known: " + ", ".join(k for k, v in each["told"].items() if v),
            ]
            cells[1] = cells[1] if any(each["told"].values()) else "predicted"
            cells += figures(each["errors"])
            for wanted in ("line through others", "nearest trial copied"):
                known = [p["name"] for p in each["predictions"]]
                cells.append(
                    "; ".join(figures(rmse_of(each, wanted))) if wanted in known else "none"
                )
            cells.append(str(min(start["cycles"]["right"] for start in each["starts"])))
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def figures(errors: dict[str, Any]) -> list[str]:
    """Means of the groups."""
    forces = ", ".join(f"{mean(errors['forces'], (n,)):.1f}" for n in GROUPS["forces"][1])
    return [
        f"{mean(errors['angles'], tuple(JOINTS)):.2f}",
        f"{mean(errors['moments'], tuple(JOINTS)):.3f}",
        forces,
    ]


@evidence.measurement()
def walks(_: Namespace) -> list[evidence.Row]:
    """Skills of walks that know a part of the record, and the table of docs/held-out.md."""
    kinds = {kind: stored(kind) for kind in ("kinematics", "holdout", "halves")}
    rows = []
    if kinds["kinematics"]:
        rows += kinetics_rows(kinds["kinematics"])
    if kinds["holdout"]:
        rows += speed_rows(kinds["holdout"])
    if kinds["halves"]:
        rows += halves_rows(kinds["halves"])
    rows.append(poison_row())
    page = PAGE.read_text(encoding="utf-8")
    page = with_table(page, "printed", printed(kinds["kinematics"]))
    write_text(PAGE, with_table(page, "held_out", table(kinds)))
    (evidence.FOLDER / "held_out.csv").unlink(missing_ok=True)  # all its rows are made here
    return rows
