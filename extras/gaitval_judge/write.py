"""Write a judgement: `judge.json` and a page, `judge.html` and `judge.pdf`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup

from gaitval.arrays import Array
from gaitval.artefacts import file_hash, versions, write_json
from gaitval.build_info import now, source_commit
from gaitval.coordinates import SIDES
from gaitval.metrics.tolerances import Verdict
from gaitval.metrics.typed import tidy
from gaitval.reporting import grids
from gaitval.reporting import recording_figures as figures
from gaitval.reporting.page import write_page
from gaitval_judge.body import segment_shares
from gaitval_judge.gait import project_axes, valid, weight_ratio
from gaitval_judge.judge import Judgement, floor_leg
from gaitval_judge.markers import by_marker
from gaitval_judge.moments import speed_group
from gaitval_judge.results import JUDGE_VERSION, JudgeResult

NAME: Final = "judge"
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


def write_judgement(found: Judgement, folder: Path) -> JudgeResult:
    """Write `judge.json`, `judge.html` and `judge.pdf` of what was `found` into `folder`; returns
    what is in the first.

    Equal inputs give equal bytes of JSON and, but for the minute on the page, of HTML.
    """
    result = result_of(found)
    write_json(folder / f"{NAME}.json", result.as_dict())
    write_page(folder, NAME, "gaitval_judge:judge.html.j2", _context(found, result))
    return result


def result_of(found: Judgement) -> JudgeResult:
    """What is written as `judge.json` of what was `found`."""
    values: dict[str, Any] = {
        "schema_version": JUDGE_VERSION,
        "versions": versions(),
        "inputs": [
            {"role": role, "name": path.name, "sha256": file_hash(path),
             "size": path.stat().st_size}
            for role, path in found.request.files()
        ],
        "passed": not found.failed,
        "model": _model(found),
        "trial": _trial(found),
        "marker_errors": _marker_errors(found),
        "residuals": _residuals(found),
        "moments": {
            name: {
                "mean": found.moments[name][0],
                "low": band.low,
                "high": band.high,
                "distance": band.distance(found.moments[name][0]),
                "distance_if_negated": band.distance(-found.moments[name][0]),
            }
            for name, band in found.band.items()
        },
        "angles_deg": {name: np.degrees(mean) for name, (mean, _) in found.angles.items()},
        "segments": {
            one.segment: {
                "mass_kg": one.mass, "share": one.share, "expected_share": one.expected,
            }
            for one in segment_shares(found.skeleton)
        },
        "limits": [
            {
                "id": verdict.id,
                "title": verdict.title,
                "target": verdict.target,
                "value": verdict.value,
                "limit": verdict.tolerance,
                "relation": verdict.limit,
                "unit": verdict.unit,
                "passed": verdict.passed,
                "decides": found.decides(verdict),
                "verdict": found.state(verdict),
            }
            for verdict in found.verdicts()
        ],
        "findings": found.findings,
        "not_judged": found.not_judged,
    }  # fmt: skip
    return JudgeResult.model_validate(tidy(values))


def _model(found: Judgement) -> dict[str, Any]:
    model = found.model
    return {
        "name": model.name,
        "version": model.version,
        "mass_kg": model.mass,
        "bodies": len(model.bodies),
        "coordinates": len(model.coordinates),
        "markers": len(model.markers),
        "thigh_and_shank_m": found.skeleton.leg_length,
        "stature_m": found.stature,
        "stature_told": found.request.height is not None,
        "senses": dict(found.skeleton.senses),
    }


def _trial(found: Judgement) -> dict[str, Any] | None:
    motion, gait, leg = found.motion, found.gait, found.skeleton.leg_length
    if motion is None:
        return None
    speed = float("nan") if gait is None else gait.speed
    return {
        "start_s": float(motion.time[0]),
        "end_s": float(motion.time[-1]),
        "frames": len(motion.time),
        "events_from": "motion" if gait is None or gait.forces is None else "forces",
        "cycles": {
            side: 0 if gait is None else len(valid(gait, side, kinetics=False)) for side in SIDES
        },
        "walking_speed_m_s": speed,
        "speed_group": speed_group(speed, floor_leg(leg))
        if leg is not None and np.isfinite(speed)
        else None,
        "weight_ratio": float("nan") if gait is None else weight_ratio(gait, found.model.mass),
    }


def _marker_errors(found: Judgement) -> dict[str, Any] | None:
    errors = found.marker_errors
    if errors is None:
        return None
    apart, frames = found.log_difference or (None, 0)
    return {
        "source": "placed" if errors.names else "log",
        "rms_m": errors.whole_rms,
        "largest_m": errors.whole_largest,
        "frames": len(errors.time),
        "by_marker": {
            name: {"rms_m": rms, "largest_m": largest, "at_s": at, "seen": seen}
            for name, (rms, largest, at, seen) in by_marker(errors).items()
        },
        "log_difference_m": apart,
        "log_frames": frames,
    }


def _residuals(found: Judgement) -> dict[str, Any] | None:
    left, gait = found.residuals, found.gait
    if left is None:
        return None
    return {
        "force_rms": left.force_rms,
        "force_peak": left.force_peak,
        "moment_rms": left.moment_rms,
        "moment_peak": left.moment_peak,
        "force_share": left.force_share,
        "moment_share": left.moment_share,
        "peak_ground_reaction": None if gait is None else gait.peak_force,
        "centre_of_mass_height": None if gait is None else gait.height,
        "frames": left.frames,
    }


# ---- The page. ----


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
        "commit": source_commit(),
        "written": now(),
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
        "sign": {"at_most": "≤", "at_least": "≥", "exactly": "="}[worst.limit],
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
        f"moments/{name[:-2]}": (0.5 * (band.low + band.high), 0.5 * (band.high - band.low))
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
