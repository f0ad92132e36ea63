"""From a laboratory's recordings to a body, its motion, its moments and its mean gait cycle.

What `gaitval import` does, in the order of the stages: read, name and turn the trials; clean the
markers; scale the body and fit it to both trials; inverse kinematics; forces to feet; inverse
dynamics; gait cycles. `gaitval.laboratory_files` writes what comes out.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gaitval.configuration import Processing
from gaitval.coordinates import COORDINATES, ROOT, SIDES, Side
from gaitval.data.cleaning import CleaningReport, Finding, clean, low_pass
from gaitval.data.events import FOOT_CUTOFF_HZ, find_events
from gaitval.data.foot_forces import assign_forces, resample_forces, zero_plates
from gaitval.data.gait_cycles import (
    PLAUSIBLE_STRIDE,
    AverageCurve,
    GaitCycle,
    Part,
    SpatioTemporal,
    average,
    belt_speed,
    cut_cycles,
    spatiotemporal,
    without_gaps,
)
from gaitval.data.laboratory_axes import (
    LaboratoryAxes,
    check_axes,
    detect_axes,
    parse_axes,
    turn_to_walking_direction,
)
from gaitval.data.reading import read_recording
from gaitval.data.record import RECORDED_ANGLES
from gaitval.data.recording import Event, FootForces, Recording
from gaitval.data.subject import GRAVITY
from gaitval.errors import RecordError, ScalingError
from gaitval.kinematics.body_fit import ANATOMICAL_SD, BodyFit, FittedLength, fit_body
from gaitval.kinematics.consistency import ConsistentMotion, make_consistent
from gaitval.kinematics.foot_anchoring import AnchoredFeet, anchored
from gaitval.kinematics.inverse_dynamics import (
    InverseDynamics,
    cardan_coordinates,
    inverse_dynamics,
)
from gaitval.kinematics.inverse_kinematics import InverseKinematics, inverse_kinematics
from gaitval.kinematics.marker_labels import check_exchanged
from gaitval.kinematics.markers import ModelMarker
from gaitval.kinematics.placement import Placement, place_markers
from gaitval.kinematics.reference import pelvis_angles, pelvis_rotation, trunk_upright
from gaitval.kinematics.tree import segment_frames
from gaitval.scaling.anthropometry import Sex
from gaitval.scaling.joint_centres import measure
from gaitval.scaling.marker_sets import (
    RECOGNISED_SHARE,
    MarkerSet,
    load_marker_set,
    recognise,
)
from gaitval.scaling.measurements import Measurements, with_fitted_lengths
from gaitval.scaling.model import SEGMENTS, BodyModel
from gaitval.scaling.pair_factors import MeasurementFactor, scale_by_pairs
from gaitval.scaling.same_person import check_same_person, displaced
from gaitval.scaling.scaling import ScaledBody, build_body

Array = NDArray[np.float64]

LARGEST_SWAY = 0.04
"""m. Nine tenths of the time every marker of pelvis and feet is within this of its median place in
a standing trial; 0.019 at most in those of WBDS01 and Rajagopal et al. 2016, 0.07 and more in
walking, also on a treadmill."""

MASS_TOLERANCE = 0.12
"""Share of the body mass by which the force plates may say otherwise. Plates with a wrong offset
or a foot beside them miss some per cent; a mass in pounds is off by 120 %."""

POUND = 0.45359237  # kg

_MASS_HINTS = (
    (POUND, "The mass looks like pounds: give --mass {mass:.1f}."),
    (1.0 / GRAVITY, "The forces look like kilograms (kgf): export them in N."),
    (1.0 / (POUND * GRAVITY), "The forces look like pounds (lbf): export them in N."),
)
"""By the ratio of the weight on the plates to the mass."""

Tell = Callable[[str, str], None]


@dataclass(frozen=True)
class Request:
    """What the user gives.

    Attributes
    ----------
    static : file of the standing trial.
    trials : files of the walking trials, of the same session.
    forces : file of the ground reaction of each trial, where it is not in the trial's file; as
        many as `trials`, or none.
    identifier : name of the subject.
    mass_kg, height_m, sex : of the person.
    marker_set : name or file; recognised by the markers' names when None.
    axes : as `laboratory_axes.parse_axes` reads; found from the standing trial when None.
    knee_width_m, ankle_width_m, elbow_width_m : across the joint, for marker sets without medial
        markers.
    without_forces : kinematics only.
    consistent : also find the smallest change of motion and masses that brings the residuals
        down, and use that motion for the moments.
    """

    static: Path
    trials: tuple[Path, ...]
    identifier: str
    mass_kg: float
    height_m: float
    sex: Sex
    forces: tuple[Path, ...] = ()
    marker_set: str | None = None
    axes: str | None = None
    knee_width_m: float | None = None
    ankle_width_m: float | None = None
    elbow_width_m: float | None = None
    without_forces: bool = False
    consistent: bool = False

    @property
    def widths(self) -> dict[str, float | None]:
        """Keyword arguments of scaling."""
        return {
            "knee_width": self.knee_width_m,
            "ankle_width": self.ankle_width_m,
            "elbow_width": self.elbow_width_m,
        }


@dataclass(frozen=True)
class Session:
    """All trials of a session, named, turned and cleaned.

    Attributes
    ----------
    marker_set : whose names the recordings have.
    axes : of the laboratory.
    standing, walking : in the project's axes, walking along +x.
    """

    marker_set: MarkerSet
    axes: LaboratoryAxes
    standing: Recording
    walking: tuple[Recording, ...]


@dataclass(frozen=True)
class Body:
    """The body of the session in the ways it was scaled.

    Attributes
    ----------
    chosen : lengths of the model that is used: those of the joint fit.
    scaled : the model that is used, and its table.
    markers : on that model.
    placement : of the markers on the body of the standing trial alone.
    fit : the joint fit.
    factors : of the marker pairs, over the mean body of the stature.
    paired : the body scaled by these factors and the markers on it, to compare.
    """

    chosen: Measurements
    scaled: ScaledBody
    markers: tuple[ModelMarker, ...]
    placement: Placement
    fit: BodyFit
    factors: tuple[MeasurementFactor, ...]
    paired: tuple[BodyModel, Placement]

    @property
    def model(self) -> BodyModel:
        """The model that is used."""
        return self.scaled.model


@dataclass(frozen=True)
class Walk:
    """One walking trial, worked out; T marker frames.

    Attributes
    ----------
    name : of the trial's file.
    recording : cleaned.
    kinematics : of every frame as recorded, with the resting feet anchored.
    anchoring : what that changed.
    compared : the same trial with the body that was scaled by marker pairs.
    positions : (T, 31) low-passed, with trunk and arms where no marker shows them upright and
        hanging.
    events : of both feet.
    forces : at `force_cutoff_hz`, at the plates' rate; None without plates.
    loads : at `moment_force_cutoff_hz` and the marker frames, as inverse dynamics uses them.
    dynamics : of `positions` and `loads`, with the masses of the model.
    consistent : motion and masses changed for small residuals, if asked for.
    belt : speed of the belt, m/s; 0 over ground.
    cycles : of each side.
    gait : spatiotemporal parameters of each side.
    findings : about forces and plates.
    """

    name: str
    recording: Recording
    kinematics: InverseKinematics
    anchoring: AnchoredFeet
    compared: InverseKinematics
    positions: Array
    events: tuple[Event, ...]
    forces: FootForces | None
    loads: FootForces | None
    dynamics: InverseDynamics | None
    consistent: ConsistentMotion | None
    belt: float
    cycles: Mapping[Side, tuple[GaitCycle, ...]]
    gait: Mapping[Side, SpatioTemporal]
    findings: tuple[Finding, ...]

    @property
    def moments(self) -> InverseDynamics | None:
        """The inverse dynamics that counts: of the consistent motion where there is one."""
        return self.dynamics if self.consistent is None else self.consistent.dynamics

    @property
    def motion(self) -> Array:
        """The motion that counts, likewise, (T, 31)."""
        return self.positions if self.consistent is None else self.consistent.positions


@dataclass(frozen=True)
class Import:
    """Everything that an import found.

    Attributes
    ----------
    angles : rad, mean curves by name (`hip_flexion_r`, …), 0 to 100 % of the side's cycle.
    moments : Nm/kg, likewise; empty without forces.
    forces : body weights, (101, 3) forward, left, up for each side; empty without forces.
    weight_ratio : mean vertical force over whole gait cycles, of all the body's weight; None
        where no cycle of both feet is shown whole.
    decisions : what was decided on the way: the step, and a sentence.
    """

    request: Request
    processing: Processing
    session: Session
    body: Body
    walks: tuple[Walk, ...]
    angles: Mapping[str, AverageCurve]
    moments: Mapping[str, AverageCurve]
    forces: Mapping[Side, AverageCurve]
    weight_ratio: float | None
    decisions: tuple[tuple[str, str], ...]


def _silent(step: str, message: str) -> None:
    """Tell nobody."""


def work_out(request: Request, processing: Processing, tell: Tell = _silent) -> Import:
    """Everything from the files to the mean gait cycle.

    Parameters
    ----------
    tell : is told what was decided: the step, and a sentence.

    Raises
    ------
    RecordError, ScalingError : see the modules of each step.
    """
    decisions: list[tuple[str, str]] = []

    def noted(step: str, message: str) -> None:
        decisions.append((step, message))
        tell(step, message)

    session = read_session(request, processing, noted)
    body = scale_body(request, processing, session, noted)
    walks = [
        work_out_walk(request, processing, session, body, trial.name, recording, noted)
        for trial, recording in zip(request.trials, session.walking, strict=True)
    ]
    weight_ratio = check_mass(request, walks)
    moments, forces = _mean_kinetics(request, walks)
    return Import(
        request=request,
        processing=processing,
        session=session,
        body=body,
        walks=tuple(walks),
        angles=_mean_angles(body.model, walks),
        moments=moments,
        forces=forces,
        weight_ratio=weight_ratio,
        decisions=tuple(decisions),
    )


# --- reading -----------------------------------------------------------------------------


def read_session(request: Request, processing: Processing, tell: Tell = _silent) -> Session:
    """Read all trials, bring them into the project's axes and clean them.

    Raises
    ------
    RecordError : a file that cannot be used, or files that do not belong together.
    """
    _check_files(request)
    standing = read_recording(request.static)
    walking = [
        read_recording(trial, forces=request.forces[i] if request.forces else None)
        for i, trial in enumerate(request.trials)
    ]
    for recording in (standing, *walking):
        tell("read", _described(recording))
    for recording in walking:
        _check_length(recording, processing)
    with _about(standing.source):
        marker_set = (
            recognise(standing.names)
            if request.marker_set is None
            else load_marker_set(request.marker_set)
        )
    tell("markers", f"marker set: {marker_set.title} ({marker_set.name})")
    with _about(standing.source):
        ignored = marker_set.ignored(standing.names)
    if ignored:
        tell("markers", f"not of this set, ignored: {', '.join(ignored)}")
    standing, *walking = (_named(recording, marker_set) for recording in (standing, *walking))
    for trial, recording in zip(request.trials, walking, strict=True):
        lacking = [name for name in marker_set.essential if name not in recording.names]
        if lacking:
            tell("markers", f"{trial.name}: without {', '.join(lacking)}")
    landmarks = marker_set.landmarks
    if request.axes is None:
        axes = detect_axes(standing, landmarks)
    else:
        axes = parse_axes(request.axes)
        check_axes(axes, standing, landmarks)
    tell("axes", axes.description)
    segments = {name: d.segment for name, d in marker_set.markers.items()}
    standing, report = clean(
        standing.turned(axes.rotation), segments, processing, landmarks=landmarks
    )
    _tell_cleaning(tell, request.static, report)
    check_stands(standing, landmarks)
    turned = []
    for trial, recording in zip(request.trials, walking, strict=True):
        recording = recording.turned(axes.rotation)
        recording, heading = turn_to_walking_direction(recording, landmarks)
        tell("axes", heading)
        recording, report = clean(recording, segments, processing, landmarks=landmarks)
        _tell_cleaning(tell, trial, report)
        distances = check_same_person(
            _trajectories(standing),
            _trajectories(recording),
            marker_set,
            names=(str(request.static), recording.source),
        )
        for distance in displaced(distances, marker_set):
            tell(
                "cleaning",
                f"{trial.name}: {' to '.join(distance.markers)}: {1000 * distance.standing:.0f} mm "
                f"in standing, {1000 * distance.walking:.0f} mm in walking: one of the two is not "
                "where it was, or not the same marker; left as it is: check the labels",
            )
        if not recording.plates and not request.without_forces:
            raise RecordError(
                f"{recording.source}: no force plates in the trial, so there are no moments and no "
                "ground reaction. Give their file with --forces, or use --kinematics-only for "
                "model, angles and cycles alone (a walk is not learned from these)."
            )
        turned.append(recording)
    return Session(
        marker_set=marker_set,
        axes=axes,
        standing=standing,
        walking=tuple(turned),
    )


def _check_files(request: Request) -> None:
    """Refuse forces that do not pair with trials, and a file that is given twice."""
    if request.forces and len(request.forces) != len(request.trials):
        raise RecordError(
            f"--forces is given {len(request.forces)} times and --trial {len(request.trials)} "
            "times. Give one --forces for each --trial, in the same order."
        )
    roles: dict[Path, str] = {}
    for option, path in (
        ("--static", request.static),
        *(("--trial", path) for path in request.trials),
        *(("--forces", path) for path in request.forces),
    ):
        other = roles.get(path.resolve())
        if other is not None:
            raise RecordError(
                f"{path}: given twice, with {other} and with {option}. Give each file once, with "
                "the option that it is for."
            )
        roles[path.resolve()] = option


@contextmanager
def _about(source: str) -> Iterator[None]:
    """Name the file in errors of functions that know only what is in it."""
    try:
        yield
    except (RecordError, ScalingError) as error:
        raise type(error)(f"{source}: {error}") from None


def _check_length(recording: Recording, processing: Processing) -> None:
    """Refuse a walking trial that is too short for a stride or too coarse for the filters."""
    where, rate = recording.source, recording.marker_rate
    length = len(recording.markers) / rate
    if length < PLAUSIBLE_STRIDE[0]:
        raise RecordError(
            f"{where}: {len(recording.markers)} frame(s) at {rate:g} Hz, {length:.3g} s: shorter "
            "than a gait cycle. Give a walking trial in which both feet strike the ground at "
            "least twice."
        )
    for what, found, cutoff in (
        ("markers", rate, max(processing.marker_cutoff_hz, FOOT_CUTOFF_HZ)),
        ("forces", recording.force_rate, processing.force_cutoff_hz),
    ):
        if 0.0 < found <= 2.0 * cutoff:
            raise RecordError(
                f"{where}: {what} at {found:g} Hz; the low-pass at {cutoff:g} Hz needs more than "
                f"{2.0 * cutoff:g} Hz. Walking is recorded at 50 Hz and more, forces at 200 Hz and "
                "more: export the trial at the rate at which it was recorded."
            )


def _described(recording: Recording) -> str:
    frames, count = recording.markers.shape[:2]
    plates = (
        f", {len(recording.plates)} force plates at {recording.force_rate:g} Hz"
        if recording.plates
        else ""
    )
    return (
        f"{recording.source}: {count} markers, {frames / recording.marker_rate:.1f} s at "
        f"{recording.marker_rate:g} Hz{plates}"
    )


def _named(recording: Recording, marker_set: MarkerSet) -> Recording:
    """Only the markers of the set, by its names."""
    with _about(recording.source):
        names = marker_set.renamed(recording.names)
    missing = [marker for marker in marker_set.essential if marker not in names.values()]
    if len(missing) > (1.0 - RECOGNISED_SHARE) * len(marker_set.essential):
        raise RecordError(
            f"{recording.source}: {len(missing)} of the {len(marker_set.essential)} markers that "
            f"the marker set {marker_set.name} needs are missing: {', '.join(missing)}. The file "
            f"has {', '.join(recording.names)}. Label the trial by the same names as the standing "
            "trial, or give the right set with --marker-set."
        )
    columns = [recording.names.index(name) for name in names]
    return recording.with_markers(names.values(), recording.markers[:, columns])


def _trajectories(recording: Recording) -> dict[str, Array]:
    return {name: recording.marker(name) for name in recording.names}


def _tell_cleaning(tell: Tell, file: Path, report: CleaningReport) -> None:
    for finding in report.findings:
        tell("cleaning", f"{file.name}: {finding}")


# --- scaling -----------------------------------------------------------------------------


def standing_places(recording: Recording) -> dict[str, Array]:
    """Where each marker stood: the median over the frames, (3,) m; unseen markers are left out."""
    places = {}
    for name in recording.names:
        trajectory = recording.marker(name)
        seen = trajectory[np.isfinite(trajectory).all(axis=1)]
        if len(seen):
            places[name] = np.median(seen, axis=0)
    return places


def check_stands(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse a standing trial in which the person walks or changes place.

    Raises
    ------
    RecordError : names the marker that moves most.
    """
    sway = {}
    for landmark, name in landmarks.items():
        if name in recording.names and landmark.rpartition(".")[2] in _STILL:
            trajectory = recording.marker(name)
            seen = trajectory[np.isfinite(trajectory).all(axis=1)]
            if len(seen):
                away = np.linalg.norm(seen - np.median(seen, axis=0), axis=1)
                sway[name] = float(np.percentile(away, 90.0))
    most = max(sway, key=lambda name: sway[name], default=None)
    if most is not None and sway[most] > LARGEST_SWAY:
        raise RecordError(
            f"{recording.source}: the person does not stand still: {most} is more than "
            f"{100 * sway[most]:.0f} cm from its median place in a tenth of the frames (at most "
            f"{100 * LARGEST_SWAY:.0f} cm in standing). Give the standing trial as --static, cut "
            "to the time in which the person stands."
        )


_STILL = ("ASIS", "PSIS", "Sacrum", "Heel", "Ankle", "MT1", "MT2", "MT5", "Toe")
"""Landmarks that stay in place in standing; knees may bend and arms move."""


def scale_body(
    request: Request, processing: Processing, session: Session, tell: Tell = _silent
) -> Body:
    """Scale the body by the standing trial, then fit it to both trials."""
    places = standing_places(session.standing)
    marker_set = session.marker_set
    on_landmarks = marker_set.on_landmarks({name: at.tolist() for name, at in places.items()})
    with _about(str(request.static)):
        measured = measure(on_landmarks, **request.widths)
        scaled = build_body(request, measured)
        placement = place_markers(scaled.model, measured, places, marker_set, **request.widths)
    for walking in session.walking:
        _check_labels(scaled.model, placement, walking, request.static)
    first = session.walking[0]
    names = [marker.name for marker in placement.markers]
    stood = _columns(session.standing, names, session.standing.markers)
    stood[:, [name in placement.moved for name in names]] = np.nan
    fit = fit_body(
        scaled.model,
        placement.markers,
        stood,
        _columns(first, names, _low_passed_markers(first, processing)),
        placement_sd={
            name: ANATOMICAL_SD for name in names if marker_set.markers[name].role == "anatomical"
        },
    )
    tell(
        "scaling",
        f"joint fit: marker RMS {1000 * fit.rms_before:.1f} to {1000 * fit.rms_after:.1f} mm, "
        f"largest {1000 * fit.largest_before:.0f} to {1000 * fit.largest_after:.0f} mm",
    )
    chosen = with_fitted_lengths(
        measured,
        {length.name: length.fitted for length in fit.lengths if _taken(length)},
        "joint fit to standing and walking",
    )

    with _about(str(request.static)):
        by_pairs, factors = scale_by_pairs(
            {
                landmark: session.standing.marker(name)
                for landmark, name in marker_set.landmarks.items()
                if name in places
            },
            height_m=request.height_m,
            sex=request.sex,
            **request.widths,
        )
        paired = build_body(request, by_pairs)
    return Body(
        chosen=chosen,
        scaled=build_body(request, chosen),
        markers=fit.markers,
        placement=placement,
        fit=fit,
        factors=factors,
        paired=(
            paired.model,
            place_markers(paired.model, by_pairs, places, marker_set, **request.widths),
        ),
    )


def _check_labels(model: BodyModel, placement: Placement, walking: Recording, static: Path) -> None:
    markers = [
        marker
        for marker in placement.markers
        if marker.name in walking.names and marker.name not in placement.moved
    ]
    measured = _columns(walking, [marker.name for marker in markers], walking.markers)
    check_exchanged(model, markers, measured, names=(str(static), walking.source))


def _taken(length: FittedLength) -> bool:
    """Whether a length of the fit goes into the measurements. Those of arms that no marker shows
    stay de Leva's; trunk and shoulders hang on the hips, which the fit moves.
    """
    return length.fitted != length.prior or length.name in (
        "lumbar_forward",
        "lumbar_up",
        "shoulder_up",
    )


def _columns(recording: Recording, names: Iterable[str], markers: Array) -> Array:
    """Trajectories (T, M, 3) of these markers in this order, NaN for one that is not there."""
    gap = np.full((len(markers), 3), np.nan)
    return np.stack(
        [
            markers[:, recording.names.index(name)] if name in recording.names else gap
            for name in names
        ],
        axis=1,
    )


def _low_passed_markers(recording: Recording, processing: Processing) -> Array:
    flat = recording.markers.reshape(len(recording.markers), -1)
    return low_pass(
        flat,
        rate=recording.marker_rate,
        cutoff_hz=processing.marker_cutoff_hz,
        order=processing.filter_order,
    ).reshape(recording.markers.shape)


# --- one walking trial -------------------------------------------------------------------


def work_out_walk(
    request: Request,
    processing: Processing,
    session: Session,
    body: Body,
    name: str,
    recording: Recording,
    tell: Tell = _silent,
) -> Walk:
    """Kinematics, forces, dynamics and cycles of one walking trial."""
    landmarks = session.marker_set.landmarks
    markers = [marker for marker in body.markers if marker.name in recording.names]
    measured = _columns(recording, [marker.name for marker in markers], recording.markers)
    anchoring = anchored(
        body.model,
        markers,
        measured,
        inverse_kinematics(body.model, markers, measured),
        rate=recording.marker_rate,
    )
    kinematics = anchoring.kinematics
    shown = {side: _leg_shown(kinematics, side, recording, session.marker_set) for side in SIDES}
    ever = np.asarray(kinematics.determined.any(axis=0))
    hidden = [name for name, seen in zip(COORDINATES, ever, strict=True) if not seen]
    if hidden:
        tell(
            "kinematics",
            f"{name}: no marker shows {', '.join(hidden)}; they stay neutral (toes straight, trunk "
            "upright, arms hanging)",
        )
    if anchoring.resting.any():
        tell(
            "kinematics",
            f"{name}: resting feet anchored; they slid by {1000 * anchoring.sliding_before:.1f} mm "
            f"(RMS), now {1000 * anchoring.sliding_after:.1f} mm; marker RMS "
            f"{1000 * anchoring.marker_rms_before:.1f} to "
            f"{1000 * anchoring.marker_rms_after:.1f} mm",
        )
    model, placement = body.paired
    placed = [marker for marker in placement.markers if marker.name in recording.names]
    compared = inverse_kinematics(model, placed, measured)
    positions = completed(
        kinematics,
        smoothed(kinematics.positions, recording.marker_rate, processing),
    )

    forces = loads = dynamics = consistent = None
    findings: tuple[Finding, ...] = ()
    if recording.plates and not request.without_forces:
        recording, zeroing = zero_plates(recording, landmarks=landmarks)
        forces, assigning = assign_forces(recording, processing, landmarks=landmarks)
        findings = (*zeroing, *assigning)
        for finding in findings:
            tell("forces", str(finding))
        slow, _ = assign_forces(
            recording,
            processing,
            landmarks=landmarks,
            cutoff_hz=processing.moment_force_cutoff_hz,
        )
        loads = resample_forces(slow, recording.time)
        moving = shown["right"] & shown["left"]
        loads = replace(loads, valid=loads.valid & moving[:, None])
        wrenches = (loads.force, loads.centre_of_pressure, loads.free_moment)
        dynamics = inverse_dynamics(body.model, recording.time, positions, *wrenches)
        if request.consistent:
            tell("dynamics", f"{name}: looks for the smallest change that lowers the residuals")
            consistent = make_consistent(
                body.model,
                recording.time,
                positions,
                *wrenches,
                markers,
                known=np.asarray(loads.valid.all(axis=1)),
            )

    events = find_events(recording, forces, processing, landmarks=landmarks)
    with _about(recording.source):
        cycles: dict[Side, tuple[GaitCycle, ...]] = {
            side: without_gaps(
                cut_cycles(events, side, forces=forces),
                recording.time,
                shown[side],
                longest_gap_s=processing.largest_gap_s,
            )
            for side in SIDES
        }
    belt = belt_speed(recording, events, landmarks=landmarks)
    gait = {
        side: spatiotemporal(recording, events, cycles[side], landmarks=landmarks) for side in SIDES
    }
    return Walk(
        name=name,
        recording=recording,
        kinematics=kinematics,
        anchoring=anchoring,
        compared=compared,
        positions=positions,
        events=events,
        forces=forces,
        loads=loads,
        dynamics=dynamics,
        consistent=consistent,
        belt=belt,
        cycles=cycles,
        gait=gait,
        findings=findings,
    )


def _leg_shown(
    kinematics: InverseKinematics, side: Side, recording: Recording, marker_set: MarkerSet
) -> NDArray[np.bool_]:
    """(T,) whether the markers show the pelvis and a leg, as far as they do at all.

    Raises
    ------
    RecordError : an angle of hip, knee or ankle is never shown.
    """
    names = [*ROOT, *(f"{name}_{side[0]}" for name in RECORDED_ANGLES)]
    seen = kinematics.determined[:, [COORDINATES.index(name) for name in names]]
    ever = np.asarray(seen.any(axis=0))
    never = [
        name
        for name, one in zip(names, ever, strict=True)
        if not one and not name.startswith("subtalar")
    ]
    if never:
        seen_names = [name for name in recording.names if np.isfinite(recording.marker(name)).any()]
        missing = [name for name in marker_set.essential if name not in seen_names]
        raise RecordError(
            f"{recording.source}: the markers never show {', '.join(never)}: too few of the {side} "
            f"leg are seen together. Missing: {', '.join(missing) or 'none, but never together'}. "
            "Label them in the recording program and export again."
        )
    return np.asarray(seen[:, ever].all(axis=1))


def smoothed(positions: Array, rate: float, processing: Processing) -> Array:
    """A motion (T, 31) low-passed at the markers' cut-off, the pelvis through its Cardan angles."""
    coordinates = low_pass(
        cardan_coordinates(positions),
        rate=rate,
        cutoff_hz=processing.marker_cutoff_hz,
        order=processing.filter_order,
    )
    turn = pelvis_rotation(coordinates[:, 0], coordinates[:, 1], coordinates[:, 2])
    coordinates[:, :3] = Rotation.from_matrix(turn).as_rotvec()
    return coordinates


def completed(kinematics: InverseKinematics, positions: Array) -> Array:
    """The motion with a trunk that stays upright where no marker shows it.

    A trunk that were fixed to the pelvis would turn with it; people keep it upright. The arms
    hang and the toes are straight, as inverse kinematics left them.
    """
    lumbar = [COORDINATES.index(f"lumbar_{name}") for name in ("extension", "bending", "rotation")]
    if kinematics.determined[..., lumbar].any():
        return positions
    positions = positions.copy()
    positions[:, lumbar] = trunk_upright(Rotation.from_rotvec(positions[:, :3]).as_matrix())
    return positions


# --- mean cycles -------------------------------------------------------------------------


def valid_cycles(walk: Walk, side: Side, *, kinetics: bool) -> tuple[GaitCycle, ...]:
    """The cycles of a walk that count for kinematics or for kinetics."""
    return tuple(
        cycle
        for cycle in walk.cycles[side]
        if (cycle.kinetics_valid if kinetics else cycle.kinematics_valid)
    )


def side_angles(model: BodyModel, positions: Array, side: Side) -> dict[str, Array]:
    """Angles of one side over a motion, (T,) rad each, by the names and signs of
    `data.record.GaitRecord`: of the joints, the pelvis and the foot.
    """
    suffix, sign = side[0], 1.0 if side == "right" else -1.0
    found = {
        f"{name}_{suffix}": positions[:, COORDINATES.index(f"{name}_{suffix}")]
        for name in RECORDED_ANGLES
    }
    tilt, list_right, rotation_right = pelvis_angles(
        Rotation.from_rotvec(positions[:, :3]).as_matrix()
    ).T
    found[f"pelvis_tilt_{suffix}"] = tilt
    found[f"pelvis_list_{suffix}"] = sign * list_right
    found[f"pelvis_rotation_{suffix}"] = sign * rotation_right
    forward = segment_frames(model, positions)[:, SEGMENTS.index(f"foot_{suffix}"), :3, 0]
    found[f"foot_pitch_{suffix}"] = np.arcsin(forward[:, 2])
    found[f"foot_progression_{suffix}"] = sign * np.arctan2(forward[:, 1], forward[:, 0])
    return found


def _mean_angles(model: BodyModel, walks: Sequence[Walk]) -> dict[str, AverageCurve]:
    found = {}
    for side in SIDES:
        sampled = [side_angles(model, walk.motion, side) for walk in walks]
        for name in sampled[0]:
            curve = average(
                (walk.recording.time, angles[name], valid_cycles(walk, side, kinetics=False))
                for walk, angles in zip(walks, sampled, strict=True)
            )
            if curve is not None:
                found[name] = curve
    return found


def _mean_kinetics(
    request: Request, walks: Sequence[Walk]
) -> tuple[dict[str, AverageCurve], dict[Side, AverageCurve]]:
    """Moments in Nm/kg and ground reactions in body weights; empty without forces."""
    moments: dict[str, AverageCurve] = {}
    forces: dict[Side, AverageCurve] = {}
    for i, side in enumerate(SIDES):
        parts: dict[str, list[Part]] = {}
        reactions: list[Part] = []
        for walk in walks:
            if walk.moments is None or walk.forces is None:
                return {}, {}
            cycles = valid_cycles(walk, side, kinetics=True)
            for name, values in walk.moments.recorded_moments().items():
                if name.endswith(f"_{side[0]}"):
                    parts.setdefault(name, []).append(
                        (walk.recording.time, values / request.mass_kg, cycles)
                    )
            weights = walk.forces.force[:, i] / (request.mass_kg * GRAVITY)
            reactions.append((walk.forces.time, weights, cycles))
        for name, of_name in parts.items():
            curve = average(of_name)
            if curve is not None:
                moments[name] = curve
        force = average(reactions)
        if force is not None:
            forces[side] = force
    return moments, forces


def check_mass(request: Request, walks: Sequence[Walk]) -> float | None:
    """Mean vertical force over whole gait cycles, body weights; None where none is shown whole.

    Raises
    ------
    RecordError : the plates weigh another body, perhaps one in pounds.
    """
    shares = []
    for walk in walks:
        if walk.forces is None:
            continue
        time = walk.forces.time
        for side in SIDES:
            for cycle in valid_cycles(walk, side, kinetics=True):
                inside = (time >= cycle.start) & (time < cycle.end)
                if walk.forces.valid[inside].all():
                    shares.append(walk.forces.force[inside, :, 2].sum(axis=1).mean())
    if not shares:
        return None
    weight = float(np.mean(shares)) / GRAVITY
    ratio = weight / request.mass_kg
    if abs(ratio - 1.0) > MASS_TOLERANCE:
        hint = next(
            (words for factor, words in _MASS_HINTS if abs(ratio / factor - 1.0) < MASS_TOLERANCE),
            "Check the mass, the unit of the forces, and that the trial is of this person.",
        ).format(mass=request.mass_kg * POUND)
        raise RecordError(
            f"The force plates carry {weight:.1f} kg over {len(shares)} whole gait cycles, but the "
            f"mass given is {request.mass_kg:.1f} kg. Over whole cycles both must agree within "
            f"{100 * MASS_TOLERANCE:.0f} %. {hint}"
        )
    return ratio
