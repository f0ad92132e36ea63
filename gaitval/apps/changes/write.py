"""Write what changed: `change.json`, `change.csv`, `change_curves.csv` and a page."""

from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitval._internal.io.artefacts import versions, write_json, write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval.apps.changes.change import Change, CurveChange, sentence
from gaitval.apps.changes.page import write_change_page
from gaitval.apps.changes.results import CHANGE_VERSION, ChangeResult
from gaitval.apps.changes.visits import PARAMETERS, Visit
from gaitval.coordinates import SIDES
from gaitval.metrics.curve_statistics import ALPHA
from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE
from gaitval.metrics.typed import tidy

NAME: Final = "change"


def write_change(found: Change, folder: Path) -> ChangeResult:
    """Write `change.json`, `.csv`, `_curves.csv`, `.html` and `.pdf` of what was `found` into
    `folder`; returns what is in the first.
    """
    result = result_of(found)
    write_json(folder / f"{NAME}.json", result.as_dict())
    write_text(folder / f"{NAME}.csv", _findings_table(found, result))
    write_text(folder / f"{NAME}_curves.csv", _curves_table(result))
    write_change_page(found, result, folder)
    return result


def result_of(found: Change) -> ChangeResult:
    """What is written as `change.json`."""
    values: dict[str, Any] = {
        "schema_version": CHANGE_VERSION,
        "versions": versions(),
        "before": _session(found.before),
        "after": _session(found.after),
        "same_markers": found.same_markers,
        "speed": found.speed,
        "notes": list(found.notes),
        "alpha": ALPHA,
        "threshold": None if found.test is None else found.test.threshold,
        "permutations": 0 if found.test is None else found.test.permutations,
        "stride_correlation": None if found.test is None else found.test.correlation,
        "at_once": found.at_once,
        "curves": {name: _curve(curve, found) for name, curve in found.curves.items()},
        "parameters": _parameters(found),
        "profile": None
        if found.profiles is None
        else {
            "before": found.profiles[0].model_dump(),
            "after": found.profiles[1].model_dump(),
            "smallest_difference": SMALLEST_DIFFERENCE,
        },
        "findings": [sentence(curve, region, found) for curve, region in found.findings()],
    }
    return ChangeResult.model_validate(tidy(values))


def _session(visit: Visit) -> dict[str, Any]:
    return {
        "source": visit.source,
        "identifier": visit.identifier,
        "sex": visit.sex,
        "mass_kg": visit.mass_kg,
        "height_m": visit.height_m,
        "walking_speed_m_s": visit.speed if np.isfinite(visit.speed) else None,
        "cycles": {
            side: max(
                (len(v) for name, v in visit.cycles.items() if name.endswith(f"_{side[0]}")),
                default=0,
            )
            for side in SIDES
        },
        "files": dict(visit.files),
    }


def _curve(curve: CurveChange, found: Change) -> dict[str, Any]:
    return {
        "unit": curve.unit,
        "before": curve.before,
        "after": curve.after,
        "half": curve.half,
        "limit": curve.limit,
        "t": curve.t,
        "p": curve.p,
        "regions": [
            {
                **{name: getattr(region, name) for name in _OF_A_REGION},
                "words": sentence(curve, region, found),
            }
            for region in curve.regions
        ],
    }


_OF_A_REGION: Final = (
    *("first", "last", "at", "difference", "half", "level", "tested", "by_speed"),
)


def _parameters(found: Change) -> list[dict[str, Any]]:
    names = [
        name
        for each in PARAMETERS
        for name in (each, f"{each}_r", f"{each}_l")
        if name in found.before.parameters and name in found.after.parameters
    ]
    rows = []
    for name in names:
        before, after = found.before.parameters[name], found.after.parameters[name]
        plain = name[:-2] if name[-2:] in ("_r", "_l") else name
        rows.append(
            {
                "name": name,
                "unit": PARAMETERS[plain],
                "before": before.mean,
                "after": after.mean,
                "before_sd": before.sd,
                "after_sd": after.sd,
            }
        )
    return rows


def _findings_table(found: Change, result: ChangeResult) -> str:
    rows: list[list[object]] = [["curve", "unit", *_OF_A_REGION, "words"]]
    for curve, region in found.findings():
        values = [getattr(region, name) for name in _OF_A_REGION]
        rows.append([curve.name, curve.unit, *values, sentence(curve, region, found)])
    for row in result.parameters:
        rows.append([row.name, row.unit, None, None, None, row.after - row.before, *[None] * 5])
    return csv_text(rows)


def _curves_table(result: ChangeResult) -> str:
    rows: list[list[object]] = [
        ["curve", "percent", "unit", "before", "after", "difference", "half", "limit", "t"]
    ]
    for name, curve in result.curves.items():
        for at in range(101):
            rest = [
                None if each is None else each[at] for each in (curve.half, curve.limit, curve.t)
            ]
            before, after = curve.before[at], curve.after[at]
            rows.append([name, at, curve.unit, before, after, round(after - before, 6), *rest])
    return csv_text(rows)
