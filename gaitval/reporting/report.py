"""The report of a run folder: one template, as self-contained HTML and as PDF."""

import csv
import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.artefacts import read_json, write_text
from gaitval.configuration import ReportSettings, load_configuration
from gaitval.coordinates import split_side
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ArtefactError
from gaitval.metrics.learning_gain import LearningGain
from gaitval.metrics.origin import is_recorded_at_all, not_judged
from gaitval.metrics.recorded import CURVE_UNITS
from gaitval.metrics.results import check_metrics
from gaitval.metrics.verdicts import (
    close_text,
    limit_results,
    spread_text,
    unjudged_text,
    value_text,
)
from gaitval.policy.training_log import LEARNING_CURVES
from gaitval.reference.adjustment import JOINTS, Adjustment
from gaitval.reporting import (
    credibility,
    curve_statistics,
    figure_data,
    figures,
    mechanics_figures,
    provenance,
    tables,
)
from gaitval.reporting.drawing import Draw
from gaitval.reporting.facts import UNKNOWN, compiled_walks, measured_force
from gaitval.reporting.page import write_page
from gaitval.reporting.replay import SCRIPTS, walk_pictures

Json = Mapping[str, Any]

FAILED_SHOWN = 6
"""Number of failed targets that the tolerance table names; all are in the table of errors."""

_SPATIOTEMPORAL = {
    "walking_speed": "Walking speed",
    "cadence": "Cadence",
    "stride_time_right": "Stride time, right",
    "stride_time_left": "Stride time, left",
    "stance_fraction_right": "Stance, right",
    "stance_fraction_left": "Stance, left",
    "double_support_fraction": "Double support",
    "step_length_right": "Step length, right",
    "step_length_left": "Step length, left",
    "step_width": "Step width",
}


def _target(target: str) -> str:
    """A measure's target in words: "left knee flexion"."""
    name, side = target[:-2], {"_r": "right", "_l": "left"}.get(target[-2:])
    if side is None:
        return "" if target == "walk" else target
    known = figures.NAMES.get(name)
    return f"{side} {name if known is None else known.lower()}"


def _failed_text(rows: Sequence[Json]) -> str:
    """The failed targets with their values; only the first ones if there are many."""
    failed = [
        f"{_target(row['target'])}: "
        + ("not measured" if row["value"] is None else f"{row['value']:.3g}")
        for row in rows
        if not row["passed"] and row["target"] != "walk"
    ]
    more = len(failed) - FAILED_SHOWN
    return "; ".join(failed[:FAILED_SHOWN]) + (f"; and {more} more" if more > 0 else "")


def _tolerances(metrics: Json, role: str) -> list[dict[str, Any]]:
    """One entry per tolerance, failed ones first, with the number of targets passed and the worst
    one.
    """
    return [
        {
            **found.first,
            "limit_text": found.limit_text(),
            "goal_text": found.goal_text(),
            "passed": found.passed,
            "reached": all(row["reached"] for row in found.rows),
            "count": len(found.rows),
            "count_passed": len(found.rows) - len(found.failed),
            "count_failed": len(found.failed),
            "count_reached": sum(bool(row["reached"]) for row in found.rows),
            "worst": found.value_text(),
            "worst_target": _target(found.worst["target"]),
            "repeats": spread_text(found.worst),
            "close": [
                {
                    "target": _target(row["target"]),
                    "value": value_text(row),
                    "repeats": spread_text(row),
                    "why": close_text(row),
                }
                for row in found.close
            ],
            "failed": _failed_text(found.rows),
            "remedy": found.remedy,
        }
        for found in limit_results(metrics, role)
    ]


def _correction(values: Json | None) -> dict[str, Any] | None:
    """What the correction of the reference changes, in degrees, and its effect."""
    if values is None:
        return None
    found = Adjustment.from_dict(values, "metrics.json")
    changes = np.rad2deg(found.angles(np.linspace(0.0, 1.0, 101))[0])
    rows: dict[str, list[dict[str, float]]] = {}
    for index, joint in enumerate(JOINTS):
        name = split_side(joint)[1].replace("_", " ")
        largest = float(np.abs(changes[:, index]).max())
        mean = math.degrees(found.harmonics[index, 0])
        rows.setdefault(name, []).append({"mean": mean, "largest": largest})
    groups = [
        {
            "name": kind,
            "unit": CURVE_UNITS[kind],
            "fitted": fitted,
            **{key: float(np.mean([row[key] for row in group])) for key in ("before", "after")},
        }
        for kind in CURVE_UNITS
        for fitted in (True, False)
        if (group := [r for r in values["curves"] if (r["kind"], r["fitted"]) == (kind, fitted)])
    ]
    return {
        **{key: values[key] for key in ("errors", "height", "numbers", "effective_number")},
        "refused": values["refused"],
        "groups": groups,
        "rows": [{"name": name, "sides": sides} for name, sides in rows.items()],
    }


_AXIS = 3.0
"""Prior SDs that the drawing of a parameter reaches to on both sides."""


def _parameters(identification: Json | None) -> list[dict[str, Any]] | None:
    """Rows of mu and of combinations, with places on an axis of prior SDs as percentages."""
    if identification is None:
        return None
    keys = {
        "names": "name",
        "nominal": "prior_mean",
        "prior_standard_deviation": "prior_sd",
        "posterior_mean": "mean",
        "standard_deviation": "sd",
        "identified": "used",
        "verdicts": "verdict",
    }
    rows = [
        dict(zip(keys.values(), values, strict=True))
        for values in zip(*(identification[key] for key in keys), strict=True)
    ]
    grown = identification.get("profiles") or [[0.0] * 4] * len(rows)
    for row, profile in zip(rows, grown, strict=True):
        row["profile"] = (profile[0], profile[-1]) if any(profile) else None
    rows += [
        {
            "name": each["name"] + ", m",
            "prior_mean": 0.0,
            "prior_sd": each["prior_standard_deviation"],
            "mean": each["mean"],
            "sd": each["standard_deviation"],
            "used": None,
            "verdict": each["verdict"],
            "profile": None,
        }
        for each in identification["combinations"]
    ]

    def place(z: float) -> float:
        return 50.0 * (1.0 + min(1.0, max(-1.0, z / _AXIS)))

    for row in rows:
        at, width = (
            (row["mean"] - row["prior_mean"]) / row["prior_sd"],
            row["sd"] / row["prior_sd"],
        )
        row |= {
            "name": str(row["name"]).replace("_", " "),
            "contraction": width,
            "place": place(at),
            "prior_place": place(-1.0),
            "prior_width": place(1.0) - place(-1.0),
            "spread_place": place(at - width),
            "spread_width": place(at + width) - place(at - width),
        }
    return rows


def _correlated(identification: Json | None) -> list[dict[str, Any]]:
    """Pairs of parameters that the record tells apart badly, the strongest first."""
    if identification is None:
        return []
    names = [str(name).replace("_", " ") for name in identification["names"]]
    matrix = identification["correlation"]
    pairs = [
        {"first": names[i], "second": names[j], "r": matrix[i][j]}
        for i in range(len(names))
        for j in range(i)
        if abs(matrix[i][j]) >= 0.4
    ]
    return sorted(pairs, key=lambda pair: -abs(pair["r"]))[:6]


def _csv(path: Path) -> list[dict[str, str]] | None:
    """Rows of a table as text; None if there is no such file."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return [
                {key: value or "" for key, value in row.items() if key}
                for row in csv.DictReader(file)
            ]
    except FileNotFoundError:
        return None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ArtefactError(
            f"{path}: cannot be read as CSV ({error}). Delete it and run its stage again."
        ) from None


def _number_or_none(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _scaling(path: Path) -> list[dict[str, Any]] | None:
    rows = _csv(path)
    if rows is None:
        return None
    measured = ("right_m", "left_m", "length_m", "mass_kg", "factor")
    missing = [name for name in ("segment", *measured, "source") if rows and name not in rows[0]]
    if missing:
        raise ArtefactError(
            f"{path}: the columns {', '.join(missing)} are missing. "
            "Delete it and run `gaitval scale` again."
        )
    return [{**row, **{key: _number_or_none(row[key]) for key in measured}} for row in rows]


def _training(path: Path) -> dict[str, Array] | None:
    """Columns of the learning curve; None without the file or before its first row."""
    rows = _csv(path)
    if not rows:
        return None
    missing = [name for name in LEARNING_CURVES if name not in rows[0]]
    if missing:
        raise ArtefactError(
            f"{path}: the columns {', '.join(missing)} are missing. "
            "Delete it and run `gaitval train` again."
        )
    return {
        name: np.array([_number_or_none(row[name]) for row in rows], dtype=float)
        for name in LEARNING_CURVES
    }


def _traces(path: Path) -> list[Json] | None:
    """Velocities around pushes; None if none were tested."""
    if not path.exists():
        return None
    found = read_json(path)
    if not isinstance(found, dict) or not isinstance(found.get("traces"), list):
        raise ArtefactError(f"{path}: no traces in it. Delete it and run `gaitval push` again.")
    return list(found["traces"])


def _push_rows(pushes: Json | None) -> list[dict[str, Any]] | None:
    """Rows of the table of pushes, one per phase."""
    if pushes is None:
        return None
    rows = []
    for phase, largest, survived in zip(
        pushes["phases"], pushes["largest"], pushes["survived"], strict=True
    ):
        stood = dict(zip(pushes["criterion_directions"], survived, strict=True))
        cells = [
            {
                "force": force,
                "fell": stood.get(direction) is False,
                "ceiling": force >= pushes["ceiling"],
            }
            for direction, force in zip(pushes["directions"], largest, strict=True)
        ]
        rows.append(
            {"phase": phase, "cells": cells, "stood": sum(survived), "count": len(survived)}
        )
    return rows


def _drawings(
    metrics: Json, training: Mapping[str, Array] | None, traces: list[Json] | None
) -> dict[str, Draw]:
    """What draws each figure. Figures contain no text from outside."""
    drawings: dict[str, Draw] = {
        name: partial(figures.curves, metrics, kind, names, figure_name=name)
        for name, (kind, names) in figure_data.CURVES.items()
    }
    drawings["torque_loop"] = partial(figures.torque_loop, metrics)
    drawings["pressure"] = partial(figures.pressure_path, metrics)
    drawings["joint_power"] = partial(mechanics_figures.joint_power, metrics)
    drawings["centre_of_mass"] = partial(mechanics_figures.centre_of_mass, metrics)
    if metrics["push_recovery"] is not None:
        drawings["stability"] = partial(figures.stability_regions, metrics["push_recovery"])
    if traces is not None:
        drawings["push_velocity"] = partial(figures.push_velocity, traces)
    if metrics["final"] == "identified":
        drawings["error_bars"] = partial(figures.error_bars, metrics)
    if training is not None:
        drawings["learning"] = partial(figures.learning, training)
    return drawings | curve_statistics.drawings(metrics)


def _context(folder: Path) -> dict[str, Any]:
    """Everything that the template shows, read from the run folder."""
    subject = load_subject(str(folder / "subject.toml"))
    metrics = read_json(folder / "metrics.json")
    check_metrics(metrics, str(folder / "metrics.json"))
    training = _training(folder / "policy" / "training.csv")
    traces = _traces(folder / "push.json")
    walk = metrics["walks"][metrics["final"]]
    before = credibility.provenance_before(folder)
    return {
        "subject": subject,
        "metrics": metrics,
        "method": metrics["method"],
        "walk": walk,
        "compiled_walks": compiled_walks(walk["starts"]),
        "nominal": metrics["walks"]["nominal"],
        "identified": metrics["final"] == "identified",
        "identification": metrics["identification"],
        "acceptance": _tolerances(metrics, "acceptance"),
        "context_tolerances": _tolerances(metrics, "context"),
        "prediction": next(iter(metrics["predictions"]), None),
        "torque_shares": tables.torque_shares(metrics.get("torque_shares")),
        "judged": is_recorded_at_all(metrics),
        "unjudged": unjudged_text(metrics).strip(),
        "distances": tables.distances(metrics),
        "told": tables.told(metrics),
        "unseen": tables.unseen(metrics),
        "error_tables": tables.error_table(metrics),
        "plates": metrics["record"]["plates"],
        "witness": tables.witness(metrics),
        "as_measured": tables.as_measured(metrics),
        "bursts": tables.bursts(metrics),
        "parameters": _parameters(metrics["identification"]),
        "statistics": curve_statistics.tables(metrics),
        "correlated": _correlated(metrics["identification"]),
        "correction": _correction(metrics["correction"]),
        "spatiotemporal": [
            {**row, "label": _SPATIOTEMPORAL[row["name"]]} for row in walk["spatiotemporal"]
        ],
        "scaling": _scaling(folder / "scaling.csv"),
        "training": training,
        "learned": metrics["training"] and LearningGain.from_dict(metrics["training"]).in_words(),
        "picture": walk_pictures(folder, metrics),
        "provenance": before,
        "dates": provenance.dates(before),
        "hashes": provenance.hashes(folder),
        "credibility": credibility.sections(folder, metrics),
        "unknown": UNKNOWN,
        "pushes": metrics["push_recovery"],
        "push_rows": _push_rows(metrics["push_recovery"]),
        "consistency": metrics["record"]["consistency"],
        "contradictions": not {name for name, *_ in not_judged(metrics)} & {"moments", "forces"},
        "measured_force": measured_force(metrics["record"]),
        "curve_names": figures.NAMES,
        "drawings": _drawings(metrics, training, traces),
        "data": figure_data.of_run(metrics, training, traces),
    }


def _settings(folder: Path, asked: Sequence[str]) -> ReportSettings:
    """Paper and language as the run was asked for, and as is asked now."""
    path = folder / "configuration.toml"
    return load_configuration(path if path.exists() else None, settings=asked).report


def write_report(folder: Path, settings: Sequence[str] = ()) -> None:
    """Write `report.html` and `report.pdf` of a run folder, and `evidence.toml`, which they cite.

    The HTML needs no other file; its scripts show the replay of the walk, for which the PDF, from
    the same template, has six poses. A section whose input is missing says so.

    Parameters
    ----------
    settings : texts `report.language=de`; what they do not say is as in the run's configuration.

    Raises
    ------
    ArtefactError : `metrics.json` is missing, or an input is damaged.
    SubjectError : `subject.toml` cannot be used.
    """
    context = _context(folder)
    write_text(folder / credibility.EVIDENCE, credibility.evidence_text())
    write_page(
        folder,
        "report",
        "report.html.j2",
        context,
        _settings(folder, settings),
        scripts=SCRIPTS,
    )
