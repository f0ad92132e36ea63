"""`gaitval judge`: a model of OpenSim and its results against the limits of this project."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
from scipy.ndimage import binary_dilation

from gaitval.apps.judge import markers as of_markers
from gaitval.apps.judge.beside_import import with_import
from gaitval.apps.judge.body import body_measures, stature_of_legs
from gaitval.apps.judge.doubts import (
    Moments,
    Walk,
    check_times,
    found_in,
    odd_columns,
    odd_curves,
)
from gaitval.apps.judge.gait import (
    JudgedGait,
    find_gait,
    mean_curve,
    valid,
    weight_ratio,
)
from gaitval.apps.judge.limits import LIMITS
from gaitval.apps.judge.loads import read_loads
from gaitval.apps.judge.moments import BANDED, SIZED, Band, bands, speed_group
from gaitval.apps.judge.motion_units import LEGS, check_units, without_turns
from gaitval.apps.judge.request import JudgeRequest
from gaitval.apps.judge.residuals import generalised_forces, residual_wrench
from gaitval.apps.judge.skeleton import Skeleton, skeleton
from gaitval.arrays import Array, Flags
from gaitval.coordinates import RANGES, SIDES, Side
from gaitval.errors import RecordError, RecordWarning
from gaitval.gait import agreement
from gaitval.kinetics.inverse.inverse_dynamics import Residuals, residual_measures
from gaitval.metrics.recording_limits import State, state_of
from gaitval.metrics.tolerances import Measure, Verdict, evaluate, measured
from gaitval.mocap.mot import read_storage
from gaitval.mocap.reading import read_recording
from gaitval.scaling.anthropometry import WINTER
from gaitval.scaling.opensim.model import OsimModel
from gaitval.scaling.opensim.model_file import read_model
from gaitval.scaling.opensim.placing import (
    Motion,
    at_times,
    motion_of,
)
from gaitval.units import ANKLE_MOMENT, unit_of

SHOWN_ONLY: Final = (
    "side-length",
    "side-mass",
    "side-angle",
    "side-moment",
    "moment-band-frontal",
)
"""People may be asymmetric; frontal moments depend on step width and build more than on the model,
as everywhere in this project."""


@dataclass
class Judgement:
    """What was found; see `JudgeResult` for what becomes of it."""

    request: JudgeRequest
    skeleton: Skeleton
    measures: list[Measure] = field(default_factory=list)
    motion: Motion | None = None
    gait: JudgedGait | None = None
    marker_errors: of_markers.ModelMarkerErrors | None = None
    residuals: Residuals | None = None
    residual_curves: tuple[Array, Array, Array] | None = None
    angles: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    moments: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    band: dict[str, Band] = field(default_factory=dict)
    findings: list[str] = field(default_factory=list)
    not_judged: list[str] = field(default_factory=list)
    undecided: list[str] = field(default_factory=list)
    """What was given and could not be judged at all, so that limits that are kept say nothing."""

    @property
    def model(self) -> OsimModel:
        """The model."""
        return self.skeleton.model

    def doubted(self, sentences: list[str]) -> None:
        """Say what makes what was given no walk, or not one walk: then it is no pass."""
        self.findings += sentences
        self.undecided += sentences

    def verdicts(self) -> list[Verdict]:
        """Every limit on every measure; one that is not finite fails."""
        return evaluate(self.measures)

    def state(self, verdict: Verdict) -> State | Literal["shown only"]:
        """What is said of a limit."""
        if verdict.id in SHOWN_ONLY:
            return "shown only"
        return state_of(verdict.id, verdict.passed, reduced=self.request.reduced)

    def decides(self, verdict: Verdict) -> bool:
        """Whether the result depends on a limit."""
        return self.state(verdict) in ("passed", "FAILED")

    @property
    def failed(self) -> list[Verdict]:
        """Limits that decide and are not kept."""
        return [v for v in self.verdicts() if self.decides(v) and not v.passed]

    @property
    def outcome(self) -> State:
        """The verdict on everything that was given."""
        if self.failed:
            return "FAILED"
        return "not judged" if self.undecided else "passed"

    @property
    def stature(self) -> float | None:
        """As given, or that of the legs, m."""
        if self.request.height is not None:
            return self.request.height
        leg = self.skeleton.leg_length
        return None if leg is None else stature_of_legs(leg)


def judge(request: JudgeRequest) -> Judgement:
    """Read the files of `request` and judge what they allow to be judged. Raises GaitvalError if a
    file cannot be used, the files do not belong together, or mass or height are no person's.
    """
    request.check()
    # What a reader passes over in a file is a sentence beside the limits, not a warning of Python.
    with warnings.catch_warnings(record=True) as passed_over:
        warnings.simplefilter("always", RecordWarning)
        found = _judged(request)
    messages = [f"{one.message}." for one in passed_over if issubclass(one.category, RecordWarning)]
    found.findings[:0] = dict.fromkeys(messages)
    return found


def _judged(request: JudgeRequest) -> Judgement:
    model = read_model(request.model)
    found = Judgement(with_import(request, model.name), skeleton(model))
    request = found.request
    _model(found)
    if request.ik is None:
        unused = ", ".join(f"--{role.replace('_', '-')} {path}"
                           for role, path in request.files() if role != "model")  # fmt: skip
        message = f" Without it these files are not read: {unused}." if unused else ""
        found.not_judged.append(
            f"Motion: give the results of inverse kinematics with --ik.{message}"
        )
        if unused:
            found.undecided.append(f"What was given: nothing is judged without --ik.{message}")
        return found
    table = read_storage(request.ik)
    found.motion = motion_of(model, table, str(request.ik))
    check_times(table.time, request.ik)
    if table.in_degrees:
        found.motion, turned = without_turns(found.skeleton, found.motion)
        found.findings += turned
    check_units(found.skeleton, found.motion, table.in_degrees, str(request.ik))
    _coordinates(found)
    _markers(found)
    _walk(found)
    _dynamics(found)
    moments = {} if any("not low-passed" in each for each in found.undecided) else found.moments
    found.doubted(odd_curves(_means(found.angles), _means(moments)))
    _undecided(found)
    return found


def _means(curves: Mapping[str, tuple[Array, Array]]) -> dict[str, Array]:
    return {name: mean for name, (mean, _) in curves.items()}


def _undecided(found: Judgement) -> None:
    """What was given to be judged, and of which nothing could be: it is no pass."""
    request, seen = found.request, {measure.measure for measure in found.measures}
    of_dynamics = bool(found.moments) or "residual_force_share" in seen
    judged = found.angles or of_dynamics or found.marker_errors is not None
    if found.skeleton.has_legs and not judged:
        found.undecided.append(
            "The motion: no complete gait cycle was found in it. It is too short, or one leg's "
            "columns are half a stride off, a copy of the other's, or in another unit."
        )
    lacking = [name for name in ("residuals", "moments") if not getattr(found, name)]
    if request.id is not None and lacking and (lacking != ["moments"] or found.skeleton.has_legs):
        found.undecided.append(f"Inverse dynamics: {' and '.join(lacking)} could not be judged.")
    given = request.grf or request.external_loads
    if given is not None and not of_dynamics and "weight_error" not in seen:
        found.undecided.append("The ground reaction: no gait cycle shows that of both feet.")


# ---- The model. ----


def _model(found: Judgement) -> None:
    known, model = found.skeleton, found.model
    if model.mass <= 0.0:
        raise RecordError(
            f"{found.request.model}: the model has no mass. Give the model that inverse dynamics "
            "was run with."
        )
    found.measures += body_measures(known, found.stature, found.request.mass)
    if not known.has_legs:
        found.not_judged.append(
            "Legs: the model has no bodies named as femur, tibia and calcn of both sides "
            f"(it has {', '.join(list(model.bodies)[:8])} …)."
        )
    for name, sense in known.senses.items():
        if sense == 0:
            found.findings.append(
                f"Axis: {known.coordinates[name]} does not turn about the axis of "
                f"{name[:-2].replace('_', ' ')}; it is not judged."
            )


# ---- The motion. ----


def _coordinates(found: Judgement) -> None:
    """Angles beyond their range, and coupled coordinates that do not follow."""
    motion, model = found.motion, found.model
    assert motion is not None
    ours = {name: kind for kind, name in found.skeleton.coordinates.items()}
    root = model.root()
    of_root = root.coordinates if root else ()
    for name, coordinate in model.coordinates.items():
        if name not in motion.given or coordinate.motion != "rotational" or name in of_root:
            continue
        values, (low, high) = motion.values[name], coordinate.range
        sense = found.skeleton.senses.get(ours.get(name, ""), 0)
        target = name
        # A joint that we know is held against healthy people's range, others against the model's.
        if sense:
            values, (low, high), target = sense * values, RANGES[ours[name]], ours[name]
        beyond = max(float(values.max()) - high, low - float(values.min()), 0.0)
        if np.isfinite(beyond):
            found.measures.append(measured("angle_beyond_range", target, float(np.degrees(beyond))))
    for name, error in motion.coupler_errors.items():
        if model.coordinates[name].motion != "translational":
            found.measures.append(measured("coupler_error", name, float(np.degrees(error))))
    held = {coupler.dependent for coupler in model.couplers} | motion.given
    lacking = [n for n, each in model.coordinates.items() if not (each.locked or n in held)]
    if lacking:
        found.findings.append(
            "Motion: coordinates that are neither locked nor in the file stay at their defaults "
            f"({len(lacking)}): {', '.join(lacking[:8])}{' …' if len(lacking) > 8 else ''}."
        )
    legs = [name for name in lacking if ours.get(name, "")[:-2] in LEGS]
    if legs:
        found.doubted([f"The motion lacks {', '.join(legs)}: what depends on them means nothing."])


def _markers(found: Judgement) -> None:
    request, motion = found.request, found.motion
    assert motion is not None
    if request.markers is None:
        found.not_judged.append("Marker errors: give the trial with --markers.")
        return
    recording = read_recording(request.markers)
    found.marker_errors = of_markers.placed_errors(found.model, motion, recording)
    errors = found.marker_errors
    found.measures += [
        measured("ik_marker_rms", "trial", 100 * errors.whole_rms),
        measured("ik_marker_largest", "trial", 100 * errors.whole_largest),
    ]


# ---- The walk. ----


def _walk(found: Judgement) -> None:
    request, motion, known = found.request, found.motion, found.skeleton
    assert motion is not None
    if not known.has_legs:
        if request.grf is not None or request.external_loads is not None:
            found.not_judged.append("Forces: they cannot be put on feet without legs.")
        return
    loads = read_loads(request.grf, request.external_loads, known)
    plain = find_gait(known, motion, None, belt=request.belt)
    walk = Walk(known, motion, loads, plain, request.belt)
    doubts = found_in(walk)
    found.doubted(doubts)
    if isinstance(walk.gait, RecordError):
        if not doubts:
            raise walk.gait
        raise RecordError(f"{request.ik}: {' '.join(doubts)} If not: {walk.gait}")
    found.gait = walk.gait
    found.findings += found.gait.findings
    ratio = weight_ratio(found.gait, found.model.mass)
    if np.isfinite(ratio):
        found.measures.append(measured("weight_error", "model", 100 * abs(ratio - 1)))
    elif loads is None:
        found.not_judged.append("Weight: give the ground reaction with --grf.")
    else:
        found.not_judged.append("Weight: the forces do not show both feet for a whole gait cycle.")
    found.angles = _curves(found, motion.time, motion.values, kinetics=False)
    _compare_sides(found, found.angles, "angle", "angle_side_difference", np.degrees(1.0))


def _curves(
    found: Judgement, time: Array, values: Mapping[str, Array], *, kinetics: bool
) -> dict[str, tuple[Array, Array]]:
    """Mean curves (101,) of our joint angles, or of their moments, in our signs."""
    assert found.gait is not None
    curves = {}
    for ours, name in found.skeleton.coordinates.items():
        sense = found.skeleton.senses.get(ours, 0)
        if sense and name in values:
            side: Side = "right" if ours.endswith("_r") else "left"
            cycles = valid(found.gait, side, kinetics=kinetics)
            if (curve := mean_curve(time, sense * values[name], cycles)) is not None:
                curves[ours] = curve
    return curves


def _compare_sides(
    found: Judgement,
    curves: Mapping[str, tuple[Array, Array]],
    kind: str,
    measure: str,
    factor: float,
) -> None:
    for name in LEGS:
        pair = [curves.get(f"{name}_{side[0]}") for side in SIDES]
        if pair[0] is None or pair[1] is None:
            continue
        right, left = pair[0][0], pair[1][0]
        rmse = float(np.sqrt(((right - left) ** 2).mean()))
        found.measures.append(measured(measure, name, factor * rmse))
        # The correlation of two nearly constant curves is that of their noise.
        if min(right.std(), left.std()) > LIMITS.least_swing:
            correlation = float(np.corrcoef(right, left)[0, 1])
            found.measures.append(measured("side_correlation", f"{name} {kind}", correlation))


# ---- Forces of inverse dynamics. ----


def _dynamics(found: Judgement) -> None:
    request, motion = found.request, found.motion
    assert motion is not None
    if request.id is None:
        found.not_judged.append("Residuals, moments: give inverse dynamics' results with --id.")
        return
    table = read_storage(request.id)
    forces = generalised_forces(found.model, table, str(request.id))
    check_times(table.time, request.id)
    found.doubted(odd_columns(found.skeleton, forces, request.id))
    legs = {ours: forces[name] for ours, name in found.skeleton.coordinates.items()
            if ours[:-2] in LEGS and name in forces}  # fmt: skip
    found.doubted(found_in(Moments(table.time, legs)))
    if table.time[0] > motion.time[-1] or table.time[-1] < motion.time[0]:
        raise RecordError(
            f"{request.id}: goes from {table.time[0]:.3f} to {table.time[-1]:.3f} s, the motion "
            f"from {motion.time[0]:.3f} to {motion.time[-1]:.3f} s. Give results of the same trial."
        )
    _residuals(found, table.time, forces)
    _moments(found, table.time, forces)


def _residuals(found: Judgement, time: Array, forces: Mapping[str, Array]) -> None:
    root, motion, gait = found.model.root(), found.motion, found.gait
    assert motion is not None
    lacking = [name for name in (root.coordinates if root else ()) if name not in forces]
    if root is None or lacking:
        why = "no single joint to the ground" if root is None else f"no force of {lacking[0]}"
        found.not_judged.append(f"Residuals: the results have {why}.")
        return
    values = at_times(motion, time).values
    force, moment = residual_wrench(found.model, values, forces)
    # As in an import: the acceleration at an end of the motion is seen from one side only.
    end = agreement.EDGE_SECONDS - 0.5 * float(np.ptp(time)) / max(len(time) - 1, 1)
    shown = (time > motion.time[0] + end) & (time < motion.time[-1] - end)
    # Who did not measure the force of a foot says so: NaN.
    shown &= np.isfinite(np.hstack([force, moment])).all(axis=1)
    if gait is not None and gait.forces is not None:
        # Inverse dynamics is at the motion's times, the plates at their own rate.
        nearest = np.rint((time - gait.forces.start) * gait.forces.rate).astype(int)
        inside = (nearest >= 0) & (nearest < len(gait.forces.force))
        clipped = np.clip(nearest, 0, len(gait.forces.force) - 1)
        known = _away_from_unknown(np.asarray(gait.forces.valid.all(axis=1)), gait.forces.rate)
        shown &= inside & known[clipped]
    found.findings.append(
        f"Residuals: {int((~shown).sum())} of {len(time)} frames are left out, in which the plates "
        f"do not show both feet, or within {agreement.EDGE_SECONDS:g} s of an end of the motion."
    )
    if not shown.any():
        found.not_judged.append(
            "Residuals: in no frame but at the ends of the motion do the plates show both feet."
        )
        return
    peak = float("nan") if gait is None else gait.peak_force
    height = float("nan") if gait is None else gait.height
    left = residual_measures(force[shown], moment[shown], height=height, peak=peak)
    found.residuals, found.residual_curves = left, (time, force, moment)
    names = ("force_peak", "force_rms", "moment_peak", "moment_rms")
    found.measures += [measured(f"residual_{n}", "root", getattr(left, n)) for n in names]
    if np.isfinite(peak):
        found.measures += [
            measured(f"residual_{n}", "root", 100 * getattr(left, n))
            for n in ("force_share", "moment_share")
        ]
    else:
        found.not_judged.append(
            "Residuals as a share of the ground reaction: give it with --grf or --external-loads."
        )


def _away_from_unknown(known: Flags, rate: float) -> Flags:
    """Samples (T,) that are known and not within `JudgeLimits.edge` of one that is not."""
    width = 2 * round(LIMITS.edge * rate) + 1
    return ~np.asarray(binary_dilation(~known, np.ones(width, dtype=bool)))


def _moments(found: Judgement, time: Array, forces: Mapping[str, Array]) -> None:
    gait = found.gait
    if gait is None:
        return
    normalised = {name: values / found.model.mass for name, values in forces.items()}
    found.moments = _curves(found, time, normalised, kinetics=True)
    leg = found.skeleton.leg_length
    if not found.moments:
        found.not_judged.append("Moments: no complete gait cycle in the results.")
        return
    ankles = [np.abs(mean).max() for name, (mean, _) in found.moments.items() if name[:-2] in SIZED]
    seen = unit_of(ANKLE_MOMENT, "Nm", size=found.model.mass * max(ankles)) if ankles else None
    if seen is not None and seen.unit is None and seen.candidates:
        raise RecordError(
            f"{found.request.id}: the moments of the ankles go up to {seen.size:.3g}: "
            f"{seen.sentence}. Inverse dynamics' results are in Nm and N: export them so."
        )
    _compare_sides(found, found.moments, "moment", "moment_side_difference", 1.0)
    if leg is None or not np.isfinite(gait.speed):
        found.not_judged.append("Moments against literature: the walking speed is not known.")
        return
    group = speed_group(gait.speed, floor_leg(leg))
    for name, (mean, _) in found.moments.items():
        if name[:-2] not in BANDED:
            continue
        band = bands()[group, name[:-2]]
        found.band[name] = band
        found.measures.append(measured("moment_band_distance", name, band.distance(mean)))
        if name[:-2] in SIZED:
            found.measures.append(measured("moment_size_factor", name, band.factor(mean)))


def floor_leg(leg_length: float) -> float:
    """Hip to floor, m, from thigh and shank of `leg_length` m (Winter 2009: 0.530 of 0.491)."""
    shares = WINTER["thigh"] + WINTER["shank"]
    return leg_length * (shares + WINTER["ankle height"]) / shares
