"""The page of a judgement, `judge.html` and `judge.pdf`; needs the libraries that make pages."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup

from gaitval.apps.judge.gait import project_axes
from gaitval.apps.judge.judge import Judgement
from gaitval.apps.judge.markers import by_marker
from gaitval.apps.judge.results import JudgeResult
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.norms import Norm
from gaitval.metrics.tolerances import Verdict
from gaitval.metrics.verdicts import SIGNS
from gaitval.reporting import grids
from gaitval.reporting import recording_figures as figures
from gaitval.reporting.page import write_page

GROUPS: Final = {
    "Marker errors": ("ik_marker_rms", "ik_marker_largest"),
    "Residuals at the root": (
        "residual_force_peak",
        "residual_force_rms",
        "residual_moment_peak",
        "residual_moment_rms",
        "residual_force_share",
        "residual_moment_share",
    ),
    "Moments": ("moment_band_distance", "moment_side_difference"),
    "Angles": ("angle_beyond_range", "coupler_error", "angle_side_difference"),
    "Right and left": ("side_correlation", "side_length_difference", "side_mass_difference"),
    "Mass and inertia": (
        "model_mass_error",
        "weight_error",
        "body_mass_index",
        "mass_share_factor",
        "gyration_factor",
        "inertia_triangle",
    ),
}
"""Measures by the heading that they stand under."""


def write_judge_page(found: Judgement, result: JudgeResult, folder: Path) -> None:
    """Write the page of what was `found`, with its `result`, into `folder`."""
    write_page(folder, "judge", "gaitval.apps.judge:judge.html.j2", _context(found, result))


def _context(found: Judgement, result: JudgeResult) -> dict[str, Any]:
    verdicts = found.verdicts()
    return {
        "result": result,
        "groups": [(title, _rows(found, verdicts, names)) for title, names in GROUPS.items()],
        "failed": len(found.failed),
        "decide": sum(found.decides(verdict) for verdict in verdicts),
        "markers": sorted(by_marker(found.marker_errors).items(), key=lambda one: -one[1][0])
        if found.marker_errors is not None
        else [],
        "panels": _drawings(found),
        "reduced": found.request.reduced,
    }


def _rows(
    found: Judgement, verdicts: list[Verdict], measures: tuple[str, ...]
) -> list[dict[str, Any]]:
    """The rows of a table, those that failed first; targets that passed the same limit in one
    row, with the worst of them.
    """
    rows = []
    for entry in dict.fromkeys(v.id for v in verdicts if v.measure in measures):
        mine = [verdict for verdict in verdicts if verdict.id == entry]
        passed = [verdict for verdict in mine if verdict.passed]
        rows += [_row(found, [verdict]) for verdict in mine if not verdict.passed]
        if passed:
            most = max if passed[0].limit == "at_most" else min
            worst = most(passed, key=lambda one: one.value or 0.0)
            rows.append(_row(found, [worst, *(one for one in passed if one is not worst)]))
    return sorted(rows, key=lambda row: (row["passed"] or not row["decides"], row["passed"]))


def _row(found: Judgement, verdicts: list[Verdict]) -> dict[str, Any]:
    worst = verdicts[0]
    return {
        "title": worst.title,
        "target": worst.target.replace("_", " "),
        "others": len(verdicts) - 1,
        "value": worst.value,
        "digits": 3 if worst.unit in ("1", "Nm/kg") else 1,
        "sign": SIGNS[worst.limit],
        "limit": worst.tolerance,
        "unit": "" if worst.unit == "1" else worst.unit,
        "source": worst.citation,
        "passed": worst.passed,
        "decides": found.decides(worst),
        "state": found.state(worst),
    }


def _drawings(found: Judgement) -> dict[str, list[Markup]]:
    stance = {side: float("nan") for side in SIDES}
    if found.gait is not None:
        stance = dict(found.gait.stance_fraction)
    bands = {
        f"moments/{name[:-2]}": Norm(band.middle, 0.5 * (band.high - band.low), people=0)
        for name, band in found.band.items()
    }
    drawn: dict[str, list[Markup]] = {}
    kinds: tuple[tuple[str, Mapping[str, tuple[Array, Array]], float], ...] = (
        ("angles", found.angles, float(np.degrees(1.0))),
        ("moments", found.moments, 1.0),
    )
    for kind, curves, factor in kinds:
        drawn[kind] = []
        if curves:
            # Figures contain no text from outside, so their markup is safe.
            rows = figures.curve_rows(
                curves, stance, kind, factor=factor, norms=bands if kind == "moments" else {},
                layout=grids.KINEMATICS if kind == "angles" else grids.MOMENTS,
            )  # fmt: skip
            svg = grids.grid(
                rows, height=1.6, figure_name=kind, words=("model", "motion"), linked=False,
                norm="typically developing children ± SD",
            )  # fmt: skip
            drawn[kind].append(Markup(svg))
    drawn["residuals"] = []
    if found.residual_curves is not None:
        limits = {v.id: v.tolerance for v in found.verdicts()}
        time, force, moment = found.residual_curves
        turn = project_axes(found.model.up).T
        svg = figures.residuals(
            time, force @ turn, moment @ turn,
            force_limit=limits["residual-force-peak"],
            moment_limit=limits["residual-moment-peak"],
            figure_name="residuals",
        )  # fmt: skip
        drawn["residuals"].append(Markup(svg))
    return drawn
