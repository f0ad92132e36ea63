"""Rows of the report's tables of curves, plates, power and parts of the moments."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gaitval.coordinates import ACTUATED, split_side
from gaitval.metrics.baselines import skill
from gaitval.metrics.comparison import FORCES, JOINT_ANGLES, JOINT_MOMENTS, PELVIS_ANGLES
from gaitval.metrics.groups import group_curves, group_rows
from gaitval.metrics.joint_power import BURSTS, burst_places
from gaitval.metrics.joint_power import JOINTS as POWER_JOINTS
from gaitval.metrics.origin import curve_origin, is_recorded_at_all, origins_in
from gaitval.metrics.validation import ENDURANCE
from gaitval.reporting.figures import NAMES

Json = Mapping[str, Any]


def error_table(metrics: Json) -> list[dict[str, Any]]:
    """Rows of every curve and side, beside the RMSE before identification and correction, and that
    of a prediction without a model with the skill against it.
    """
    groups = (
        ("angles", (*JOINT_ANGLES, *PELVIS_ANGLES), 1),
        ("moments", JOINT_MOMENTS, 2),
        ("forces", FORCES, 1),
    )
    walks, origins = metrics["walks"], origins_in(metrics)
    guesses = [prediction["rmse"] for prediction in metrics["predictions"][:1]]
    tables = []
    for kind, names, digits in groups:
        rows = []
        for name in names:
            for side in ("right", "left"):
                key = f"{name}_{side[0]}"
                error = walks[metrics["final"]]["errors"][kind][key]
                guess = guesses[0][kind][key] if guesses else None
                rows.append(
                    {
                        "name": NAMES[name],
                        "side": side,
                        "error": error,
                        "before": walks["nominal"]["errors"][kind][key],
                        "guess": guess,
                        "origin": curve_origin(kind, key, origins),
                        "skill": skill(None if error is None else error["rmse"], guess),
                    }
                )
        tables.append(
            {"kind": kind, "unit": metrics["units"][kind], "digits": digits, "rows": rows}
        )
    return tables


def as_measured(metrics: Json) -> list[dict[str, Any]] | None:
    """Rows of moments and forces whose recorded curve the correction of the plates changes: RMSE
    against it, and against the record as measured.
    """
    walk = metrics["walks"][metrics["final"]]
    measured = walk["errors_as_measured"]
    if measured is None:
        return None
    rows = []
    for kind, names, digits in (("moments", JOINT_MOMENTS, 3), ("forces", FORCES, 1)):
        for name in names:
            for side in ("right", "left"):
                key = f"{name}_{side[0]}"
                error = walk["errors"][kind][key]
                rows.append(
                    {
                        "name": NAMES[name],
                        "unit": metrics["units"][kind],
                        "side": side,
                        "digits": digits,
                        "corrected": None if error is None else error["rmse"],
                        "measured": measured[kind][key],
                    }
                )
    return rows


def bursts(metrics: Json) -> list[dict[str, Any]]:
    """Rows of the bursts of power and of the work of the joints, by side; bursts as the curves show
    them, also of a file that was written when they were looked for otherwise.
    """
    recorded = _with_bursts(metrics["record"]["joint_power"])
    walked = metrics["walks"][metrics["final"]]["joint_power"]
    walked = None if walked is None else _with_bursts(walked)

    def row(name: str, unit: str, group: str, key: str, digits: int) -> dict[str, Any]:
        sides = {
            side: {
                "recorded": recorded[group][f"{key}_{side[0]}"],
                "walked": None if walked is None else walked[group][f"{key}_{side[0]}"],
            }
            for side in ("right", "left")
        }
        return {"name": name, "unit": unit, "digits": digits, "sides": sides}

    return [
        *(row(burst, "W/kg", "bursts", burst, 2) for burst in BURSTS),
        *(
            row(f"{label}, {title}", "J/kg", group, joint, 3)
            for joint, label in zip(POWER_JOINTS, ("Hip", "Knee", "Ankle"), strict=True)
            for group, title in (("generated", "generated"), ("absorbed", "absorbed"))
        ),
    ]


def _with_bursts(found: Json) -> dict[str, Any]:
    bursts: dict[str, float | None] = {}
    for side in "rl":
        powers = {
            joint: np.array(found["power"][f"{joint}_{side}"], dtype=float)
            for joint in POWER_JOINTS
        }
        for name, at in burst_places(powers).items():
            value = None if at is None else float(powers[BURSTS[name].joint][at])
            bursts[f"{name}_{side}"] = value
    return {**found, "bursts": bursts}


def torque_shares(values: Json | None) -> list[dict[str, Any]] | None:
    """Rows of each coordinate and side with the parts of its moment."""
    if values is None:
        return None
    return [
        {
            "name": name.replace("_", " "),
            "side": side,
            "parts": values[joint],
        }
        for joint in ACTUATED
        for side, name in (split_side(joint),)
    ]


def witness(metrics: Json) -> dict[str, Any] | None:
    """What a second engine says, with the rows in which it differs most from the walk, by kind."""
    found = metrics.get("witness")
    if found is None:
        return None
    here = {(row["measure"], row["target"]): row["value"] for row in metrics["measures"]}
    there = {(row["measure"], row["target"]): row["value"] for row in found["measures"]}
    rows = []
    for measure, name, unit, digits in (
        ("angle_rmse", "Angle", "deg", 2),
        ("moment_rmse", "Moment", "Nm/kg", 3),
        ("force_rmse", "Ground reaction", "% BW", 2),
    ):
        both = {
            target: (value, there[measure, target])
            for (kind, target), value in here.items()
            if kind == measure and value is not None and there[measure, target] is not None
        }
        if not both:
            continue
        worst = max(both, key=lambda target: abs(both[target][1] - both[target][0]))
        side, curve = split_side(worst)
        rows.append(
            {
                "name": name,
                "target": f"{NAMES[curve]}, {side}",
                "here": both[worst][0],
                "there": both[worst][1],
                "unit": unit,
                "digits": digits,
            }
        )
    counted = [
        row["reached"]
        for row in metrics["tolerances"]
        if (row["measure"], row["target"]) in there
        and row["measure"] not in ENDURANCE
        and row["role"] == "acceptance"
        and row["reached"] is not None
    ]
    return {**found, "rows": rows, "here": sum(counted)}


def distances(metrics: Json) -> dict[str, Any] | None:
    """The walk's distance from its prediction by groups of curves, beside how wrong predictions of
    held-out trials are; None where something was recorded.
    """
    if is_recorded_at_all(metrics):
        return None
    errors = metrics.get("prediction_errors")
    held_out = {row["group"]: row for row in errors["groups"]} if errors else {}
    return {
        "errors": errors,
        "rows": [
            {
                "group": row.group,
                "unit": row.unit,
                "digits": 3 if row.unit == "Nm/kg" else 1,
                "walked": row.walked,
                "held_out": held_out.get(row.group),
            }
            for row in group_rows(metrics)
        ],
    }


def told(metrics: Json) -> dict[str, Any]:
    """What the walker was told, and its errors beside those of predictions without a model."""
    known = [name for name, read_by in metrics["told"].items() if read_by]
    recorded = metrics["recorded"]
    rows = [
        {**row._asdict(), "skills": row.skills(), "digits": 3 if row.unit == "Nm/kg" else 1}
        for row in group_rows(metrics)
    ]
    return {
        "how": "predicted" if not known else "fitted" if "forces" in known else "partly",
        "kinetics_recorded": "forces" in recorded or not is_recorded_at_all(metrics),
        "nowhere": not is_recorded_at_all(metrics),
        "guesses": [prediction["name"] for prediction in metrics["predictions"]],
        "rows": rows,
    }


def unseen(metrics: Json) -> list[dict[str, Any]]:
    """Trials at the same speed that were not told, by groups of curves."""
    errors = metrics["walks"][metrics["final"]]["errors"]
    tables = []
    for trial in metrics["unseen"]:
        groups = []
        for name, (kind, every, unit) in group_curves(metrics).items():
            recorded = [curve for curve in every if trial["between"][kind][curve] is not None]
            curves = recorded or every
            of_told = [error and error["rmse"] for error in (errors[kind][c] for c in curves)]
            told_mean = _mean(of_told)
            untold_mean = _mean([trial["rmse"][kind][curve] for curve in curves])
            groups.append(
                {
                    "name": name,
                    "unit": unit,
                    "digits": 3 if unit == "Nm/kg" else 1,
                    "told": told_mean,
                    "untold": untold_mean,
                    "ratio": untold_mean / told_mean if told_mean and untold_mean else None,
                    "between": _mean([trial["between"][kind][curve] for curve in curves]),
                    "correlation": _mean(
                        [trial["multiple_correlation"][kind][curve] for curve in curves]
                    ),
                }
            )
        tables.append({"trial": trial["trial"], "speed": trial["speed"], "groups": groups})
    return tables


def _mean(values: Sequence[float | None]) -> float | None:
    found = [value for value in values if value is not None]
    return sum(found) / len(found) if found and len(found) == len(values) else None
