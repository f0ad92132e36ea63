"""The numbers behind each figure, as CSV: what a reader draws again or computes with.

Columns have the units of the figure; an empty field is a value that was not measured.
"""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.artefacts import write_text
from gaitval.coordinates import SIDES
from gaitval.metrics.comparison import FORCES, PELVIS_ANGLES
from gaitval.metrics.joint_power import JOINTS
from gaitval.metrics.whole_body import AXES

Json = Mapping[str, Any]

FOLDER: Final = "figures"
"""Folder of the tables, beside the page."""

CURVES: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "sagittal_angles": ("angles", ("hip_flexion", "knee_angle", "ankle_angle")),
    "other_angles": ("angles", ("hip_adduction", "hip_rotation", "subtalar_angle")),
    "pelvis_angles": ("angles", tuple(PELVIS_ANGLES)),
    "moments": ("moments", ("hip_flexion", "knee_angle", "ankle_angle", "hip_adduction")),
    "forces": ("forces", tuple(FORCES)),
}
"""Kind and curves of each figure of curves over the gait cycle."""

_PERCENT: Final = np.arange(101)


def table(columns: Mapping[str, Iterable[Any] | None]) -> str:
    """Columns of equal length as CSV; one that is None is left out."""
    kept = {name: list(values) for name, values in columns.items() if values is not None}
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(kept)
    writer.writerows([_field(value) for value in row] for row in zip(*kept.values(), strict=True))
    return text.getvalue()


def _field(value: Any) -> str:
    if isinstance(value, str):
        return value
    return "" if value is None or not np.isfinite(value) else f"{value:.6g}"


def write_tables(folder: Path, tables: Mapping[str, str]) -> None:
    """Write each table as `FOLDER`/NAME.csv."""
    for name, text in tables.items():
        write_text(folder / FOLDER / f"{name}.csv", text)


def of_run(
    metrics: Json, training: Mapping[str, Array] | None, traces: Sequence[Json] | None
) -> dict[str, str]:
    """Tables of the figures of a run, by the names of the figures.

    Parameters
    ----------
    metrics : content of `metrics.json`.
    training : columns of the learning curve.
    traces : `push_recovery.Trace.as_dict` of each push.
    """
    tables = {name: _curves(metrics, kind, names) for name, (kind, names) in CURVES.items()}
    tables["torque_loop"] = _torque_loop(metrics)
    tables["pressure"] = _pressure(metrics)
    tables["joint_power"] = _joint_power(metrics)
    tables["centre_of_mass"] = _centre_of_mass(metrics)
    if metrics["push_recovery"] is not None:
        tables["stability"] = _stability(metrics["push_recovery"])
    if traces is not None:
        tables["push_velocity"] = _push_velocity(traces)
    if metrics["final"] == "identified":
        tables["error_bars"] = _error_bars(metrics)
    if training is not None:
        tables["learning"] = table(training)
    return tables


def _keys(names: Sequence[str]) -> list[str]:
    return [f"{name}_{side[0]}" for name in names for side in SIDES]


def _curves(metrics: Json, kind: str, names: Sequence[str]) -> str:
    walks, record = metrics["walks"], metrics["record"]["curves"][kind]
    columns: dict[str, Any] = {"percent": _PERCENT}
    for key in _keys(names):
        walked = walks[metrics["final"]]["curves"][kind][key]
        columns[f"{key}_record"] = record[key]
        columns[f"{key}_mean"] = walked["mean"]
        columns[f"{key}_sd"] = walked["sd"]
        if metrics["final"] == "identified":
            columns[f"{key}_before"] = walks["nominal"]["curves"][kind][key]["mean"]
    return table(columns)


def _torque_loop(metrics: Json) -> str:
    record = metrics["record"]["curves"]
    walked = metrics["walks"][metrics["final"]]["curves"]
    columns: dict[str, Any] = {"percent": _PERCENT}
    for key in _keys(["hip_flexion"]):
        for kind in ("angles", "moments"):
            columns[f"{key}_{kind}_record"] = record[kind][key]
            columns[f"{key}_{kind}_mean"] = walked[kind][key]["mean"]
    return table(columns)


def _pressure(metrics: Json) -> str:
    contact = metrics["walks"][metrics["final"]]["foot_contact"]
    columns: dict[str, Any] = {"percent_of_stance": _PERCENT}
    for side in SIDES:
        for way, curve in contact[side]["path"].items():
            columns[f"{way}_{side}_mean"] = curve["mean"]
            columns[f"{way}_{side}_sd"] = curve["sd"]
    return table(columns)


def _joint_power(metrics: Json) -> str:
    walked = metrics["walks"][metrics["final"]]["joint_power"]
    columns: dict[str, Any] = {"percent": _PERCENT}
    for key in _keys(JOINTS):
        columns[f"{key}_record"] = metrics["record"]["joint_power"]["power"][key]
        columns[f"{key}_mean"] = None if walked is None else walked["power"][key]
    return table(columns)


def _centre_of_mass(metrics: Json) -> str:
    """In mm, as drawn."""
    walked = metrics["walks"][metrics["final"]]["centre_of_mass"]
    columns: dict[str, Any] = {"percent": _PERCENT}
    for name, path in (("record", metrics["record"]["centre_of_mass"]), ("mean", walked)):
        for axis, values in zip(AXES, np.array(path).T if path else (), strict=False):
            columns[f"{axis}_{name}_mm"] = 1e3 * values
    return table(columns)


def _stability(pushes: Json) -> str:
    rows = [
        (phase, direction, force)
        for phase, forces in zip(pushes["phases"], pushes["largest"], strict=True)
        for direction, force in zip(pushes["directions"], forces, strict=True)
    ]
    names = ("phase", "direction_deg", "largest_survived_n")
    return table(dict(zip(names, zip(*rows, strict=True), strict=True)))


def _push_velocity(traces: Sequence[Json]) -> str:
    """As simulated, m/s; the figure shows its change from the cycle before the push."""
    rows = [
        (trace["phase"], trace["direction"], cycle, *velocity[:2])
        for trace in traces
        for cycle, velocity in zip(trace["cycles"], trace["velocity"], strict=True)
    ]
    names = ("phase", "direction_deg", "cycles_since_push", "forward_m_s", "left_m_s")
    return table(dict(zip(names, zip(*rows, strict=True), strict=True)))


def _error_bars(metrics: Json) -> str:
    rows = []
    for kind in ("angles", "moments", "forces"):
        before = metrics["walks"]["nominal"]["errors"][kind]
        after = metrics["walks"]["identified"]["errors"][kind]
        for key in after:
            errors = [each[key] and each[key]["rmse"] for each in (before, after)]
            rows.append((kind, key, metrics["units"][kind], *errors))
    names = ("kind", "curve", "unit", "rmse_before", "rmse_after")
    return table(dict(zip(names, zip(*rows, strict=True), strict=True)))
