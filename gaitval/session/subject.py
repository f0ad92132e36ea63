"""The subject that an import makes, and whether its files can be written."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from scipy.interpolate import make_interp_spline

from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import COORDINATES, SIDES, Side, opposite
from gaitval.errors import RecordError
from gaitval.gait.cycles import GaitCycle
from gaitval.gait.mean_curves import (
    ANGLE_TOLERANCE,
    TOLERANCES,
    fit_curve,
    fit_force,
    mean_vertical_force,
    stance_fraction,
)
from gaitval.gait.record import (
    ANGLE_NAMES,
    MOMENT_NAMES,
    FittedCurve,
    Force,
    MeanSteps,
    OneSide,
    fit_periodic,
)
from gaitval.model.body import BodyModel
from gaitval.model.tree import centres_of_mass, tree_arrays
from gaitval.session.average import largest_drift, left_open
from gaitval.session.one_side import missing_sides, refuse_without_forces
from gaitval.session.session import Import
from gaitval.session.trial import WalkingTrial, valid_cycles
from gaitval.subjects.stored_gait import Forces, Gait, StanceFraction
from gaitval.subjects.subject import Subject, make_subject

PHASE: Final = np.linspace(0.0, 1.0, 101)


def subject_of(found: Import) -> Subject:
    """The subject that the main job reads, from the import `found`; without moments and forces if
    none were used.

    Raises RecordError if the plates show no cycle whole on either side, and SubjectError for
    implausible values.
    """
    request = found.request
    where = ", ".join(walk.name for walk in found.trials)
    if not request.kinematics_only:
        if not found.forces:
            refuse_without_forces(found.trials)
        counts = " and ".join(
            f"{len(found.forces[side].curves) if side in found.forces else 0} {side}"
            for side in SIDES
        )
        where += f" ({counts} cycles)"
    missing = missing_sides(found.angles, found.forces)
    seen = opposite(missing["angles"]) if "angles" in missing else "right"
    stance = {side: _stance(found, side) for side in SIDES}
    means = {side: np.asarray(found.forces[side].mean) for side in SIDES if side in found.forces}
    durations = [cycle.duration for side in SIDES for cycle in all_cycles(found, side)]
    body = found.body
    values = {
        "identifier": request.identifier,
        **request.who._asdict(),
        "trial": request.trial,
        "source": ", ".join(walk.name for walk in found.trials),
        "citation": request.citation,
        "licence": request.licence,
        "sex": request.sex,
        "age_years": request.age,
        "prosthesis": request.prosthesis,
        "aid": request.aid,
        "slope_percent": None if body.model.ground.level else body.model.ground.slope,
        "mass_kg": request.mass_kg,
        "height_m": request.height_m,
        "leg_length_m": body.chosen.hip_height,
        "walking_speed_m_s": speed(found),
        "stride_time_s": float(np.mean(durations)),
        "left_phase": _left_phase(found, seen),
        "mean_vertical_force": mean_vertical_force(means) if len(means) == len(SIDES) else None,
        "stance_fraction": StanceFraction(**stance),
        "gait": _mean_gait(found, missing, stance, where).model_copy(
            update={
                "total_force": total_force(body.model, found.trials),
                "steps": None if "angles" in missing else steps(found.trials),
            }
        ),
        "low_pass": {
            "moments_hz": found.processing.moment_force_cutoff_hz,
            "forces_hz": found.processing.force_cutoff_hz,
        }
        if means
        else None,
        "measurements": body.chosen.to_dict(),
        "uncertainty": {} if found.measurement is None else found.measurement.uncertainty(),
    }
    return make_subject(values, request.identifier)


def _stance(found: Import, side: Side) -> float | None:
    """Stance fraction of a side: of its mean force, or the mean over its cycles without one; None
    if it was not recorded.
    """
    if side in found.forces:
        return stance_fraction(np.asarray(found.forces[side].mean)[:, 2])
    if not all_cycles(found, side):
        return None
    values = np.concatenate([walk.gait[side].stance_fraction for walk in found.trials])
    return float(np.nanmean(values)) if np.isfinite(values).any() else None


def _mean_gait(
    found: Import, missing: OneSide, stance: Mapping[Side, float | None], where: str
) -> Gait:
    """The mean curves as the subject's file keeps them."""
    means = {name: np.asarray(curve.mean) for name, curve in found.angles.items()}
    angles = {
        name: fit_curve(name, PHASE, closed(name, "angle", curve, where), ANGLE_TOLERANCE, where)
        for name, curve in means.items()
        if name in ANGLE_NAMES and not left_open(name, curve)
    }
    if not found.forces:
        return Gait(samples=len(PHASE), angles=angles, not_recorded=missing)
    fitted = {
        side: fit_force(np.asarray(force.mean), ends, where)
        for side, force in found.forces.items()
        if (ends := stance[side]) is not None
    }
    moments = {
        name: fit_curve(
            name,
            PHASE,
            closed(name, "moment", np.asarray(found.moments[name].mean), where),
            TOLERANCES.moment_tolerance,
            where,
        )
        for name in MOMENT_NAMES
        if name in found.moments
    }
    return Gait(
        samples=len(PHASE),
        angles=angles,
        moments=moments,
        forces=Forces(right=fitted.get("right"), left=fitted.get("left")),
        not_recorded=missing,
    )


def steps(walks: Sequence[WalkingTrial]) -> MeanSteps | None:
    """The mean steps of all `walks`; None without a step of each foot."""
    found = {
        (name, side): np.concatenate([getattr(walk.gait[side], name) for walk in walks])
        for name in ("step_length", "step_width")
        for side in SIDES
    }
    if any(not np.isfinite(values).any() for values in found.values()):
        return None
    right, left, *widths = (float(np.nanmean(values)) for values in found.values())
    return MeanSteps(right=right, left=left, width=0.5 * sum(widths))


def total_force(model: BodyModel, walks: Sequence[WalkingTrial]) -> Force | None:
    """The force on both feet together that the motion of the centre of mass of `model` needs
    (Newton's law) in its trials `walks`, of which no force is read, in the mean over the right
    side's cycles; None without any.
    """
    tree, cycles = tree_arrays(model), []
    for walk in walks:
        centre = centres_of_mass(tree, walk.positions)
        acceleration = make_interp_spline(walk.recording.time, centre, k=5).derivative(2)
        for cycle in valid_cycles(walk, "right", kinetics=False):
            cycles.append(acceleration(cycle.start + cycle.duration * PHASE) / STANDARD_GRAVITY)
    if not cycles:
        return None
    mean = np.mean(cycles, axis=0)
    # A walk that is not quite steady does not end as it began; its speed and height stay, so that
    # the mean is the weight and nothing else.
    mean -= np.outer(PHASE - 0.5, mean[-1] - mean[0])
    mean += model.ground.up - mean[:-1].mean(axis=0)
    # Sideways it is a tenth as large as a foot's force.
    fits = [
        FittedCurve.fitted(fit_periodic(PHASE, each, 0.1 * TOLERANCES.force_tolerance))
        for each in mean.T
    ]
    return Force(forward=fits[0], left=fits[1], up=fits[2])


def closed(name: str, kind: str, curve: Array, where: str) -> Array:
    """A mean `curve` (101,) called `name`, of `kind` "angle" (rad) or "moment" (Nm/kg), made to end
    where it starts.

    The mean of few cycles drifts, from one heel strike to the next; the drift is taken away evenly
    over the cycle. Raises RecordError, with `where` in its message, if the drift is more than
    `largest_drift`.
    """
    drift, limit = float(curve[-1] - curve[0]), largest_drift(name, kind)
    if abs(drift) > limit:
        size = f"{np.degrees(drift):.1f}°" if kind == "angle" else f"{drift:.2f} Nm/kg"
        most = f"{np.degrees(limit):.0f}°" if kind == "angle" else f"{limit:g} Nm/kg"
        raise RecordError(
            f"{where}: the mean {kind} {name} ends {size} from where it began, more than {most}, "
            "so the walk was not steady. Give trials of steady walking, or more cycles of them."
        )
    # Symmetric about the middle of the cycle, so that the mean of the curve stays.
    return np.asarray(curve - drift * (PHASE - 0.5))


def all_cycles(found: Import, side: Side) -> list[GaitCycle]:
    """The cycles of one `side` in all trials of `found` that count for kinematics."""
    return [cycle for walk in found.trials for cycle in valid_cycles(walk, side, kinetics=False)]


def speed(found: Import) -> float:
    """Mean walking speed in `found` over all cycles of both sides, m/s: of the feet from place to
    place, or of the pelvis where a trial ends before the foot is on the ground again.
    """
    strides = np.concatenate([walk.gait[side].speed for walk in found.trials for side in SIDES])
    if np.isfinite(strides).any():
        return float(np.nanmean(strides))
    of_pelvis = [
        walk.belt + _pelvis_speed(walk, cycle)
        for walk in found.trials
        for side in SIDES
        for cycle in valid_cycles(walk, side, kinetics=False)
    ]
    return float(np.mean(of_pelvis))


def _pelvis_speed(walk: WalkingTrial, cycle: GaitCycle) -> float:
    """Forward speed of the pelvis over a cycle, m/s."""
    forward = walk.positions[:, COORDINATES.index("pelvis_tx")]
    begin, end = np.interp([cycle.start, cycle.end], walk.recording.time, forward)
    return float(end - begin) / cycle.duration


def _left_phase(found: Import, seen: Side) -> float:
    """Mean phase of the right cycle at which the left heel strikes, from the cycles of a side."""
    shares = [(c.opposite_strike - c.start) / c.duration for c in all_cycles(found, seen)]
    share = float(np.nanmean(shares))
    # Of the left cycle it is the phase at which the right heel strikes: the rest of a stride.
    return share if seen == "right" else 1.0 - share
