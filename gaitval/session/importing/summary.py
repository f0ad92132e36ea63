"""What the report and the command line show of an import: limits, tables, figures."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gaitval._internal.io.artefacts import file_hash, versions
from gaitval._internal.io.build_info import now, source_commit
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import GaitvalError
from gaitval.findings import Looked
from gaitval.gait.agreement import residuals_known
from gaitval.gait.cycles import mean_and_deviation
from gaitval.kinetics.inverse.consistent_motion import ConsistentMotion
from gaitval.kinetics.inverse.inverse_dynamics import Residuals, ground_level, residuals
from gaitval.kinetics.inverse.inverse_kinematics import marker_errors
from gaitval.kinetics.inverse.marker_placement import MarkerPlacement
from gaitval.kinetics.musculature.gait import MuscleGait, muscles_of
from gaitval.metrics.recording_limits import CONSISTENT, remedy, state_of
from gaitval.metrics.tolerances import Verdict, evaluate, measured
from gaitval.reporting import recording_report as page
from gaitval.session.loaded import loaded_motion, measured_knees
from gaitval.session.session import Import
from gaitval.session.subject import all_cycles, speed
from gaitval.session.trial import WalkingTrial


def verdicts(found: Import) -> list[Verdict]:
    """Marker errors, residuals and the weight on the plates of `found` against their limits
    (`metrics/tolerances.toml`). With an aid, residuals and weight hold what it carries, and have no
    limit.
    """
    rms, largest = _rms_and_largest(found.body.placement)
    measures = [
        measured("scaling_marker_rms", "standing", 100 * rms),
        measured("scaling_marker_largest", "standing", 100 * largest),
    ]
    for walk in found.trials:
        name = walk.name
        errors = marker_errors(walk.kinematics)
        measures += [
            measured("ik_marker_rms", name, 100 * errors.whole_rms),
            measured("ik_marker_largest", name, 100 * errors.whole_largest),
        ]
        # of the motion that the results are of: made consistent, where that was asked for
        for target, left in trial_residuals(walk)[-1:] if found.request.aid is None else ():
            measures += [
                measured("residual_force_peak", f"{name}{target}", left.force_peak),
                measured("residual_force_rms", f"{name}{target}", left.force_rms),
                measured("residual_moment_peak", f"{name}{target}", left.moment_peak),
                measured("residual_moment_rms", f"{name}{target}", left.moment_rms),
                measured("residual_force_share", f"{name}{target}", 100 * left.force_share),
                measured("residual_moment_share", f"{name}{target}", 100 * left.moment_share),
            ]
    if found.weight_ratio is not None and found.request.aid is None:
        error = 100 * abs(found.weight_ratio - 1.0)
        measures.append(measured("weight_error", "plates", error))
    return evaluate(measures)


def trial_residuals(walk: WalkingTrial) -> list[tuple[str, Residuals]]:
    """Residuals of `walk` where both feet's forces are known, as recorded and made consistent,
    without the edges (`residuals_known`).
    """
    if walk.dynamics is None or walk.loads is None:
        return []
    known = residuals_known(walk.loads)
    if not known.any():
        return []
    level = ground_level(walk.loads.centre_of_pressure)
    found = [("", residuals(walk.dynamics, known, ground_height=level))]
    if walk.consistent is not None:
        after = residuals(walk.consistent.dynamics, known, ground_height=level)
        found.append((CONSISTENT, after))
    return found


def input_files(found: Import) -> list[page.InputFile]:
    """The files that `found` was made from, with their hashes."""
    request = found.request
    files = [] if request.stands_in_walk else [("static", request.static)]
    files += [("trial", path) for path in request.trials]
    files += [("forces", path) for path in request.forces]
    files += [("functional", path) for path in request.functional]
    files += [("model", path) for path in (request.scaled_model,) if path is not None]
    return [page.InputFile(role, p.name, file_hash(p), p.stat().st_size) for role, p in files]


SPATIOTEMPORAL: Final = {
    "stride_time": ("Stride time", "s", 2),
    "step_time": ("Step time", "s", 2),
    "cadence": ("Cadence", "steps/min", 1),
    "stride_length": ("Stride length", "m", 3),
    "step_length": ("Step length", "m", 3),
    "step_width": ("Step width", "m", 3),
    "stance_fraction": ("Stance, share of the cycle", "1", 3),
    "double_support_fraction": ("Double support, share of the cycle", "1", 3),
    "speed": ("Speed", "m/s", 3),
    "walk_ratio": ("Walk ratio", "m/(steps/min)", 5),
}


def summary_of(found: Import) -> page.RecordingSummary:
    """What the page of the import `found` shows."""
    request, first = found.request, found.trials[0]
    errors = marker_errors(first.kinematics)
    limits = {verdict.id: verdict.tolerance for verdict in verdicts(found)}
    seen = np.isfinite(first.kinematics.marker_errors).mean(axis=0)
    changes: list[page.ConsistencyChange] = []
    if first.consistent is not None:
        whole = (first.consistent.before, first.consistent.after)
        before, after = [left for _, left in trial_residuals(first)] or whole
        changes = changes_by(first.consistent, before, after)
    return page.RecordingSummary(
        identifier=request.identifier,
        sex=request.sex,
        mass=request.mass_kg,
        height=request.height_m,
        trial=", ".join(walk.name for walk in found.trials),
        first_trial=first.name if len(found.trials) > 1 else "",
        duration=sum(len(w.recording.markers) / w.recording.marker_rate for w in found.trials),
        marker_rate=first.recording.marker_rate,
        force_rate=first.recording.force_rate,
        walking_speed=speed(found),
        cycles={side: len(all_cycles(found, side)) for side in SIDES},
        stance_fraction={side: _stance_fraction(found, side) for side in SIDES},
        inputs=input_files(found),
        decisions=[
            page.Decision(step, message) for step, message in found.decisions if step in _DECIDED
        ],
        gates=limit_rows(found),
        marker_errors=[
            page.MarkerError(name, float(errors.rms[i]), float(errors.largest[i]), float(seen[i]))
            for i, name in enumerate(errors.names)
        ],
        marker_rms_limit=limits["ik-marker-rms"] / 100,
        marker_largest_limit=limits["ik-marker-largest"] / 100,
        functional=[joint.row() for joint in found.functional],
        given_centres=[centre.row() for centre in found.given],
        weight_ratio=found.weight_ratio,
        segments=found.body.scaled.table,
        angles={name: (c.mean, c.deviation) for name, c in found.angles.items()},
        moments={name: (c.mean, c.deviation) for name, c in found.moments.items()},
        forces=_force_curves(found),
        strides={
            f"{kind}/{name}": curve.curves
            for kind, curves in (("angles", found.angles), ("moments", found.moments))
            for name, curve in curves.items()
        }
        | _force_strides(found),
        age=request.age,
        leg_length=found.body.chosen.hip_height,
        residuals=_residual_curves(first, limits),
        spatiotemporal=spatiotemporal_rows(found.trials),
        changes=changes,
        measurement=found.measurement,
        warnings=[f"{trial}: {warning}" for trial, warning in found.warnings],
        looked=_nearest(found.looked),
        repairs=[message for step, message in found.decisions if step not in _SHOWN_STEPS],
        left_out=[
            page.LeftOut(walk.name, side, cycle.start, "; ".join(cycle.reasons))
            for walk in found.trials
            for side in SIDES
            for cycle in walk.cycles[side]
            if cycle.reasons
        ],
        muscles=found_muscles(found),
        versions=versions(),
        commit=source_commit(),
        written=now(),
    )


MOST_CYCLES: Final = 5
"""Gait cycles of a side of each trial whose muscles the page shows: the middle ones."""


def found_muscles(found: Import) -> MuscleGait | None:
    """Muscles of the trials' middle cycles; None without moments, or where they cannot be worked
    out, which `gaitval muscles` says.
    """
    request = found.request
    if request.aid is not None:  # moments lack what the aid carries
        return None
    motions = []
    for walk in found.trials:
        motion = loaded_motion(
            walk,
            found.body.model,
            height=request.height_m,
            prosthesis=request.prosthesis,
            knees=measured_knees(
                found.body.model, found.body.markers, found.session.marker_set.landmarks
            ),
        )
        if motion is not None:
            few = {side: _middle(cycles) for side, cycles in motion.cycles.items()}
            motions.append(replace(motion, cycles=few, spans={}))
    try:
        return muscles_of(motions) if any(any(m.cycles.values()) for m in motions) else None
    except GaitvalError:
        return None


def _middle(cycles: Sequence[tuple[float, float]]) -> Sequence[tuple[float, float]]:
    first = max(0, (len(cycles) - MOST_CYCLES) // 2)
    return cycles[first : first + MOST_CYCLES]


def _force_curves(found: Import) -> dict[str, tuple[Array, Array]]:
    """Mean and deviation of each component of the ground reaction; medial is + on both sides."""
    return {
        f"{name}_{side[0]}": (sign * force.mean[:, axis], force.deviation[:, axis])
        for side, force in found.forces.items()
        for name, axis, sign in _force_axes(side)
    }


def _force_strides(found: Import) -> dict[str, Array]:
    """The ground reaction of each cycle, as `_force_curves` has the means."""
    return {
        f"forces/{name}_{side[0]}": sign * force.curves[:, :, axis]
        for side, force in found.forces.items()
        for name, axis, sign in _force_axes(side)
    }


def _force_axes(side: Side) -> tuple[tuple[str, int, float], ...]:
    """Name, axis and sign of the components of a side's ground reaction."""
    return (
        ("forward", 0, 1.0),
        ("medial", 1, 1.0 if side == "right" else -1.0),
        ("vertical", 2, 1.0),
    )


def _stance_fraction(found: Import, side: Side) -> float:
    """Mean stance fraction of a side; NaN if no trial shows a whole cycle of it."""
    values = np.concatenate([walk.gait[side].stance_fraction for walk in found.trials])
    return mean_and_deviation(values)[0]


_DECIDED: Final = ("person", "read", "markers", "axes", "functional", "scaling", "kinematics")
"""Steps of `Import.decisions` that are decisions; the others are findings about the data."""


def _nearest(looked: Iterable[tuple[str, Looked]]) -> list[Looked]:
    """Of each finding that was looked for, the value nearest to its limits or beyond."""
    found: dict[str, Looked] = {}
    for _, row in looked:
        if row.name not in found or row.excess > found[row.name].excess:
            found[row.name] = row
    return list(found.values())


_SHOWN_STEPS: Final = (*_DECIDED, "warnings", "uncertainty")
"""Steps that the page says elsewhere than among the findings."""


def _residual_curves(walk: WalkingTrial, limits: Mapping[str, float]) -> page.ResidualCurves | None:
    """Residuals of a `walk` over time and their `limits`; None without moments."""
    dynamics = walk.moments
    if dynamics is None:
        return None
    return page.ResidualCurves(
        time=dynamics.time,
        force=_where_known(walk, dynamics.residual_force),
        moment=_where_known(walk, dynamics.residual_moment),
        force_limit=limits.get("residual-force-peak", np.nan),
        moment_limit=limits.get("residual-moment-peak", np.nan),
    )


def _where_known(walk: WalkingTrial, residual: Array) -> Array:
    """NaN where the plates do not show both feet, and at the ends, as in `trial_residuals`: what is
    missing there is no residual.
    """
    assert walk.loads is not None
    return np.where(residuals_known(walk.loads)[:, None], residual, np.nan)


def limit_rows(found: Import) -> list[page.GateRow]:
    """Every limit of the import `found` and its verdict (`metrics.recording_limits`)."""
    rows = []
    for verdict in verdicts(found):
        reduced = verdict.target.endswith(CONSISTENT)
        state = state_of(verdict.id, verdict.passed, reduced=reduced)
        rows.append(
            page.GateRow(
                title=verdict.title,
                value=verdict.value,
                limit=verdict.tolerance,
                unit=verdict.unit,
                passed=verdict.passed,
                source=verdict.note
                if verdict.status == "convention"
                else f"{verdict.citation.split('.')[0]}: {verdict.locator}",
                applies=state != "not judged",
                remedy=remedy(verdict.id, reduced=found.request.consistent),
                target=verdict.target,
            )
        )
    # The landmark distances are already among the tolerances.
    return rows + [
        page.GateRow(
            *(check.name, check.value, check.limit, check.unit, check.passed, check.source),
            remedy=remedy("standing-angle", reduced=False),
        )
        for check in found.body.placement.checks
        if check.unit == "deg"
    ]


def not_judged(found: Import) -> str:
    """Why the verdict on the import `found` is none: forces were to be used, and no moments came of
    them. Empty where some did, or where the options say that forces are not to be.
    """
    if found.request.kinematics_only or found.forces:
        return ""
    return "moments and ground reaction, for in no gait cycle are the forces of a foot known"


def unseen_residuals(found: Import) -> str:
    """Why whether motion and forces agree is not judged; empty where it is, or is not to be."""
    if found.request.kinematics_only or found.request.aid is not None or not found.forces:
        return ""
    if any(each.measure == "residual_force_share" for each in verdicts(found)):
        return ""
    return (
        "whether motion and forces agree, for in no frame do the plates show both feet. Moments "
        "are those of single stances"
    )


def _rms_and_largest(placement: MarkerPlacement) -> tuple[float, float]:
    """Distances of the markers of a standing trial from their landmarks, m."""
    distances = np.array(list(placement.distances.values()))
    return float(np.sqrt((distances**2).mean())), float(distances.max())


def spatiotemporal_rows(walks: Sequence[WalkingTrial]) -> list[page.SpatiotemporalRow]:
    """Mean and SD of each parameter over the cycles of all trials (`walks`)."""
    rows = []
    for name, (title, unit, digits) in SPATIOTEMPORAL.items():
        right, left = (
            mean_and_deviation(np.concatenate([getattr(walk.gait[side], name) for walk in walks]))
            for side in SIDES
        )
        rows.append(
            page.SpatiotemporalRow(
                title,
                unit,
                None if np.isnan(right[0]) else right,
                None if np.isnan(left[0]) else left,
                digits=digits,
            )
        )
    return rows


def changes_by(
    consistent: ConsistentMotion, before: Residuals, after: Residuals
) -> list[page.ConsistencyChange]:
    """What `consistent` changed: residuals (`before`, `after`), markers, coordinates and masses, a
    row each.
    """
    row = page.ConsistencyChange
    rows = [
        row("residual force, RMS", before.force_rms, after.force_rms, "N"),
        row("residual force, peak", before.force_peak, after.force_peak, "N"),
        row("residual moment, RMS", before.moment_rms, after.moment_rms, "Nm"),
        row("residual moment, peak", before.moment_peak, after.moment_peak, "Nm"),
        row("markers on the body, RMS", 0.0, 1000 * consistent.marker_change_rms, "mm"),
        row("markers on the body, largest", 0.0, 1000 * consistent.marker_change_max, "mm"),
    ]
    for name, change in consistent.coordinate_change.items():
        length = name.startswith("pelvis_t")
        value = 1000 * change if length else float(np.degrees(change))
        if value < 0.005:
            continue  # shown as 0.00: a held coordinate
        rows.append(
            page.ConsistencyChange(f"{name}, RMS change", 0.0, value, "mm" if length else "°")
        )
    rows += [
        page.ConsistencyChange(f"mass of {name.replace('_', ' ')}, factor", 1.0, factor, "1")
        for name, factor in consistent.mass_factors.items()
    ]
    return rows
