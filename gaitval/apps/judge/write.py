"""A judgement as the typed result that is written: `judge.json` and a page."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup

from gaitval._internal.io.artefacts import file_hash
from gaitval.apps.judge.body import segment_shares
from gaitval.apps.judge.gait import project_axes, valid, weight_ratio
from gaitval.apps.judge.judge import Judgement, floor_leg
from gaitval.apps.judge.markers import by_marker
from gaitval.apps.judge.moments import speed_group
from gaitval.apps.judge.results import JudgedLimit, JudgedResiduals, JudgeResult
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.norms import Norm
from gaitval.metrics.verdicts import SIGNS
from gaitval.reporting import grids
from gaitval.reporting import recording_figures as figures
from gaitval.reporting.written import taken

GROUPS: Final = {
    "Marker errors": ("ik_marker_",),
    "Residuals at the root": ("residual_",),
    "Moments": ("moment_",),
    "Angles": ("angle_", "coupler_"),
    "Right and left": ("side_",),
    "Mass and inertia": ("model_", "weight_", "body_", "mass_", "gyration_", "inertia_"),
}
"""Beginnings of the names of measures by the heading that they stand under."""


def write_judgement(found: Judgement, folder: Path) -> JudgeResult:
    """Write `judge.json`, `judge.html` and `judge.pdf` of what was `found` into `folder`; returns
    what is in the first.

    Equal inputs give equal bytes of JSON and, but for the minute on the page, of HTML.
    """
    result = result_of(found)
    result.write(
        folder,
        groups=[(title, _rows([one for one in result.limits if one.group == title]))
                for title in GROUPS],
        signs=SIGNS,
        panels=_drawings(found),
        reduced=found.request.reduced,
    )  # fmt: skip
    return result


def result_of(found: Judgement) -> JudgeResult:
    """What is written of what was `found`."""
    left, gait = found.residuals, found.gait
    return JudgeResult.made(
        inputs=[
            {"role": role, "name": path.name, "sha256": file_hash(path),
             "size": path.stat().st_size}
            for role, path in found.request.files()
        ],
        passed=found.outcome == "passed",
        verdict=found.outcome,
        model=_model(found),
        trial=_trial(found),
        marker_errors=_marker_errors(found),
        residuals=None if left is None else taken(
            JudgedResiduals, left,
            peak_ground_reaction=None if gait is None else gait.peak_force,
            centre_of_mass_height=None if gait is None else gait.height,
        ),
        moments={
            name: {
                "mean": found.moments[name][0],
                "low": band.low,
                "high": band.high,
                "distance": band.distance(found.moments[name][0]),
                "distance_if_negated": band.distance(-found.moments[name][0]),
            }
            for name, band in found.band.items()
        },
        angles_deg={name: np.degrees(mean) for name, (mean, _) in found.angles.items()},
        segments=segment_shares(found.skeleton),
        limits=[
            taken(
                JudgedLimit, verdict,
                group=next(title for title, names in GROUPS.items()
                           if verdict.measure.startswith(names)),
                limit=verdict.tolerance,
                relation=verdict.limit,
                decides=found.decides(verdict),
                verdict=found.state(verdict),
            )
            for verdict in found.verdicts()
        ],
        findings=found.findings,
        not_judged=found.not_judged,
        undecided=found.undecided,
    )  # fmt: skip


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
        "stature_given": found.request.height is not None,
        "senses": found.skeleton.senses,
    }


def _trial(found: Judgement) -> dict[str, Any] | None:
    motion, gait, leg = found.motion, found.gait, found.skeleton.leg_length
    if motion is None:
        return None
    speed = float("nan") if gait is None else gait.speed
    group = None
    if leg is not None and np.isfinite(speed):
        group = speed_group(speed, floor_leg(leg))
    return {
        "start_s": motion.time[0],
        "end_s": motion.time[-1],
        "frames": len(motion.time),
        "events_from": "motion" if gait is None or gait.forces is None else "forces",
        "cycles": {
            side: 0 if gait is None else len(valid(gait, side, kinetics=False)) for side in SIDES
        },
        "walking_speed_m_s": speed,
        "belt_speed_m_s": None if gait is None else gait.belt,
        "belt_given": found.request.belt is not None,
        "speed_group": group,
        "weight_ratio": None if gait is None else weight_ratio(gait, found.model.mass),
    }


def _marker_errors(found: Judgement) -> dict[str, Any] | None:
    errors = found.marker_errors
    if errors is None:
        return None
    return {
        "rms_m": errors.whole_rms,
        "largest_m": errors.whole_largest,
        "frames": len(errors.time),
        "by_marker": by_marker(errors),
    }


# ---- Of the page. ----


def _rows(limits: list[JudgedLimit]) -> list[tuple[JudgedLimit, int]]:
    """Limits of a table, those that failed first; targets that passed the same one in one row, the
    worst of them, and how many more there are.
    """
    rows = [(one, 0) for one in limits if not one.passed]
    for entry in dict.fromkeys(one.id for one in limits if one.passed):
        passed = [one for one in limits if one.id == entry and one.passed]
        most = max if passed[0].relation == "at_most" else min
        rows.append((most(passed, key=lambda one: one.value or 0.0), len(passed) - 1))
    return sorted(rows, key=lambda row: (row[0].passed or not row[0].decides, row[0].passed))


def _drawings(found: Judgement) -> dict[str, Markup]:
    """The figures; they contain no text from outside, so their markup is safe."""
    drawn = {}
    if found.angles:
        drawn["angles"] = _curves(
            found, "angles", found.angles,
            factor=float(np.degrees(1.0)), norms={}, layout=grids.KINEMATICS,
        )  # fmt: skip
    if found.moments:
        bands = {
            f"moments/{name[:-2]}": Norm(band.middle, 0.5 * (band.high - band.low), people=0)
            for name, band in found.band.items()
        }
        drawn["moments"] = _curves(
            found, "moments", found.moments, factor=1.0, norms=bands, layout=grids.MOMENTS
        )
    if found.residual_curves is not None:
        limits = {v.id: v.tolerance for v in found.verdicts()}
        time, force, moment = found.residual_curves
        turn = project_axes(found.model.up).T
        drawn["residuals"] = figures.residuals(
            time, force @ turn, moment @ turn,
            force_limit=limits["residual-force-peak"],
            moment_limit=limits["residual-moment-peak"],
            figure_name="residuals",
        )  # fmt: skip
    return {name: Markup(svg) for name, svg in drawn.items()}


def _curves(
    found: Judgement, kind: str, curves: Mapping[str, tuple[Array, Array]], **how: Any
) -> str:
    assert found.gait is not None
    rows = figures.curve_rows(curves, dict(found.gait.stance_fraction), kind, **how)
    return grids.grid(
        rows, height=1.6, figure_name=kind, words=("model", "motion"), linked=False,
        norm="typically developing children ± SD",
    )  # fmt: skip
