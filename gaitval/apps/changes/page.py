"""What the page of what changed shows beside the result: rows, and figures of curves."""

from typing import Any, Final

from gaitval.apps.changes.change import CHANGED, Change, CurveChange, headline
from gaitval.apps.changes.results import ChangedRegion, ChangeResult
from gaitval.apps.changes.visits import Visit
from gaitval.coordinates import SIDES, Side
from gaitval.metrics.norms import norms_at
from gaitval.reporting import grids
from gaitval.reporting.grids import DrawnCurve, Panel

_ALL: Final = {
    "kinematics": grids.KINEMATICS,
    "moments": grids.MOMENTS,
    "forces": grids.FORCES,
}


def shown(found: Change, result: ChangeResult) -> dict[str, Any]:
    """What the template is shown beside the `result` of what was `found`."""
    every = found.findings()
    changed = [one for one in every if one[1].level in CHANGED]
    perhaps = [one for one in every if one[1].level == "perhaps"]
    return {
        "headline": headline(found),
        "folders": [str(visit.folder) for visit in (found.before, found.after)],
        "changed": [_row(*one) for one in changed],
        "perhaps": [_row(*one) for one in perhaps],
        "rest": len(every) - len(changed) - len(perhaps),
        "rows": [_row(*one) for one in every],
        "parameters": _parameters(result),
        "sagittal": [
            (side, _grid(found, grids.SAGITTAL, side, f"sagittal-{side}", 0.79))
            for side in SIDES
            if any(name.endswith(f"_{side[0]}") for name in found.curves)
        ],
        "all": [
            (side, name, _grid(found, layout, side, f"{name}-{side}", 1.3))
            for name, layout in _ALL.items()
            for side in SIDES
            if any(
                f"{each}_{side[0]}" in found.curves for row in layout for each in row
            )
        ],
    }  # fmt: skip


_NAMES: Final = {
    "walking_speed": ("Walking speed, m/s", 2),
    "cadence": ("Cadence, steps/min", 1),
    "stride_time": ("Stride time, s", 2),
    "step_length": ("Step length, m", 2),
    "step_width": ("Step width, m", 3),
    "stance_fraction": ("Stance, share of the cycle", 3),
    "double_support_fraction": ("Double support, share of the cycle", 3),
}
"""Title and decimals of a parameter."""


def _parameters(result: ChangeResult) -> list[dict[str, Any]]:
    """A row of each parameter, and of the Gait Profile Score: cells of right, left and both sides,
    each before, after and their difference.
    """
    known = {row.name: row for row in result.parameters}
    rows: list[dict[str, Any]] = []
    for name, (title, digits) in _NAMES.items():
        cells = [known.get(f"{name}{suffix}") for suffix in ("_r", "_l", "")]
        if any(cells):
            values = [
                cell and (cell.before, cell.before_sd, cell.after, cell.after_sd) for cell in cells
            ]
            rows.append({"title": title, "digits": digits, "cells": values})
    both = any(row["cells"][2] for row in rows)
    if result.profile is not None:
        before, after = result.profile.before, result.profile.after
        right, left, total = (
            (getattr(before, which), None, getattr(after, which), None)
            for which in ("right", "left", "total")
        )
        title = f"Gait Profile Score, ° ({result.profile.smallest_difference} matters)"
        rows.append({"title": title, "digits": 1, "cells": [right, left, total]})
        if not both:
            rows.append({"title": "of both sides", "digits": 1, "cells": [total, None, None]})
    return [row | {"cells": row["cells"] if both else row["cells"][:2]} for row in rows]


def _row(curve: CurveChange, region: ChangedRegion) -> dict[str, Any]:
    return {
        "words": region.words,
        "short": region.words.partition("), ")[0] + ")",
        "by_speed": region.by_speed,
        "unit": curve.unit,
        "digits": 2 if curve.unit == "Nm/kg" else 1,
        "level": region.level,
    }


def _grid(
    found: Change,
    layout: tuple[tuple[str, ...], ...],
    side: Side,
    name: str,
    height: float,
) -> str:
    """Before in black, after in colour, of one side."""
    known = norms_at(found.after.speed, found.after.leg_length_m, found.after.age_years)
    panels = [[_panel(found, each, side, known) for each in row] for row in layout]
    return grids.grid(
        [row for row in panels if any(each.curves for each in row)],
        height=height,
        figure_name=name,
        words=("before", "after"),
        spread="band of 90 %" if not found.same_markers and found.at_once else "± SD of the cycles",
        linked=False,
    )


def _panel(found: Change, name: str, side: Side, known: Any) -> Panel:
    key = f"{name}_{side[0]}"
    if not name or key not in found.curves:
        return Panel(name)
    change = found.curves[key]
    curves = (
        DrawnCurve(side, change.before, _band(found, found.before, key), which="record"),
        DrawnCurve(side, change.after, _band(found, found.after, key), which="walk"),
    )
    shown = [r for r in change.regions if r.level in CHANGED]
    regions = {side: [(float(r.first), float(r.last)) for r in shown]} if shown else {}
    stance = found.after.parameters.get(f"stance_fraction_{side[0]}")
    toe_off = {} if stance is None else {side: 100.0 * stance.mean}
    return Panel(name, curves, known.get(name), toe_off, regions)


def _band(found: Change, visit: Visit, key: str) -> Any:
    """What is drawn about a mean: its band, or without one the spread of its cycles."""
    if not found.same_markers and found.at_once is not None and key in visit.half:
        return visit.half[key]
    cycles = visit.cycles.get(key)
    return None if cycles is None or len(cycles) < 2 else cycles.std(axis=0, ddof=1)
