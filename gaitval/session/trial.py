"""One walking trial: its motion, events, forces, moments and cycles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array, Flags, runs
from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import COORDINATES, ROOT, SIDES, Side
from gaitval.errors import NoCycleError, RecordError
from gaitval.findings import Looked, look
from gaitval.findings.laboratory import Laboratory
from gaitval.findings.poses import Poses
from gaitval.findings.trial import findings_of_trial
from gaitval.gait.cycle_checks import without_gaps, without_odd_support
from gaitval.gait.cycles import GaitCycle, SpatioTemporal, belt_speed, cut_cycles, spatiotemporal
from gaitval.gait.events import find_events
from gaitval.gait.filters import low_pass
from gaitval.gait.foot_forces import assign_forces, resample_forces, settled
from gaitval.gait.plate_offset import zero_plates
from gaitval.gait.quality_flags import QualityFlag
from gaitval.gait.record import RECORDED_ANGLES
from gaitval.kinetics.inverse.foot_anchoring import AnchoredFeet, anchored
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics, inverse_dynamics
from gaitval.kinetics.inverse.inverse_kinematics import InverseKinematics, inverse_kinematics
from gaitval.kinetics.inverse.motion_rates import cardan_coordinates
from gaitval.mocap.recording import Event, FootForces, Recording
from gaitval.mocap.repairs import Repair
from gaitval.model.body import BodyModel
from gaitval.model.markers import ModelMarker
from gaitval.model.rotations import pelvis_rotation
from gaitval.scaling.marker_set import MarkerSet
from gaitval.session.read import SessionRecordings
from gaitval.session.request import Notify, Request, silent
from gaitval.session.scale import FittedBody
from gaitval.walk.reference.motion import trunk_upright

if TYPE_CHECKING:  # few ask for the one, and few files store events
    from gaitval.kinetics.inverse.consistent_motion import ConsistentMotion


@dataclass(frozen=True)
class WalkingTrial:
    """One walking trial, worked out; T marker frames.

    Attributes
    ----------
    name : of the trial's file.
    recording : cleaned.
    kinematics : of every frame as recorded, with the resting feet anchored.
    anchoring : what that changed.
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
    warnings : what physics or everybody's walking contradicts.
    looked : what was looked for, with value and limits.
    """

    name: str
    recording: Recording
    kinematics: InverseKinematics
    anchoring: AnchoredFeet
    positions: Array
    events: tuple[Event, ...]
    forces: FootForces | None
    loads: FootForces | None
    dynamics: InverseDynamics | None
    consistent: "ConsistentMotion | None"
    belt: float
    cycles: Mapping[Side, tuple[GaitCycle, ...]]
    gait: Mapping[Side, SpatioTemporal]
    findings: tuple[Repair, ...]
    warnings: tuple[QualityFlag, ...]
    looked: tuple[Looked, ...] = ()

    @property
    def moments(self) -> InverseDynamics | None:
        """The inverse dynamics that counts: of the consistent motion where there is one."""
        return self.dynamics if self.consistent is None else self.consistent.dynamics

    @property
    def motion(self) -> Array:
        """The motion that counts, likewise, (T, 31)."""
        return self.positions if self.consistent is None else self.consistent.positions


def work_out_trial(
    request: Request,
    processing: ProcessingSettings,
    session: SessionRecordings,
    body: FittedBody,
    name: str,
    recording: Recording,
    notify: Notify = silent,
) -> WalkingTrial:
    """Kinematics, forces, dynamics and cycles of one walking trial (`name`) of `session` on the
    scaled `body`, by `request` and `processing`.

    `recording` is cleaned, in the project's axes; `notify` is called with each decision.
    """
    landmarks = session.marker_set.landmarks
    motion = trial_motion(body.model, body.markers, recording, processing)
    anchoring, positions = motion.anchoring, motion.positions
    kinematics = anchoring.kinematics
    shown = {side: leg_shown(kinematics, side, recording, session.marker_set) for side in SIDES}
    _notify_motion(notify, name, anchoring)
    ground = _Ground(recording)
    if recording.plates and not request.kinematics_only:
        ground = _on_plates(
            request, processing, body.model, recording, motion, landmarks, shown,
            lambda topic, text: notify(topic, f"{name}: {text}"),
        )  # fmt: skip
    recording, forces = ground.recording, ground.forces

    events = find_events(recording, forces, processing, landmarks=landmarks)
    cycles = _cycles(recording, events, forces, shown, processing)
    feet = _belt(recording, events, landmarks, cycles)
    belt = feet if request.belt is None else request.belt
    posed = look(Poses(kinematics, body.markers))
    found = findings_of_trial(
        recording, landmarks, events, ground.findings, ground.measured,
        height_m=request.height_m, mass_kg=request.mass_kg, aid=request.aid,
        laboratory=Laboratory(belt, feet),
        before={warning.check for trial, warning in session.warnings if trial == name},
    )  # fmt: skip
    warnings = (
        *posed.flags,
        *found.flags,
    )
    for warning in warnings:
        notify("warnings", f"{name}: {warning}")
    return WalkingTrial(
        name=name,
        recording=recording,
        kinematics=kinematics,
        anchoring=anchoring,
        positions=positions,
        events=events,
        forces=forces,
        loads=ground.loads,
        dynamics=ground.dynamics,
        consistent=ground.consistent,
        belt=belt,
        cycles=cycles,
        gait={
            side: spatiotemporal(
                recording, events, cycles[side], side, landmarks=landmarks, belt=belt
            )
            for side in SIDES
        },
        findings=ground.findings,
        warnings=warnings,
        looked=(*posed.looked, *found.looked),
    )


def _belt(
    recording: Recording,
    events: Sequence[Event],
    landmarks: Mapping[str, str],
    cycles: Mapping[Side, Sequence[GaitCycle]],
) -> float:
    """Speed of the belt, m/s; NaN in a trial without a whole stance, and so without a cycle."""
    try:
        return belt_speed(recording, events, landmarks=landmarks)
    except RecordError:
        if any(cycle.kinematics_valid for side in SIDES for cycle in cycles[side]):
            raise
        return float("nan")


class _Ground(NamedTuple):
    """Forces, and what follows from them; empty without plates."""

    recording: Recording
    forces: FootForces | None = None
    loads: FootForces | None = None
    dynamics: InverseDynamics | None = None
    consistent: "ConsistentMotion | None" = None
    findings: tuple[Repair, ...] = ()

    @property
    def measured(self) -> tuple[FootForces, FootForces, InverseDynamics] | None:
        """Forces, loads and dynamics, for the checks."""
        if self.forces is None or self.loads is None or self.dynamics is None:
            return None
        return self.forces, self.loads, self.dynamics


def _on_plates(
    request: Request,
    processing: ProcessingSettings,
    model: BodyModel,
    recording: Recording,
    motion: "TrialMotion",
    landmarks: Mapping[str, str],
    shown: Mapping[Side, Flags],
    notify: Notify,
) -> _Ground:
    """The forces on the feet, their inverse dynamics, and the consistent motion if asked for."""
    carried = trial_loads(recording, processing, landmarks, shown)
    for finding in carried.findings:
        notify("forces", str(finding))
    mechanics = (model, carried.recording.time, motion.positions, *carried.wrenches)
    dynamics, consistent = carried.marked(inverse_dynamics(*mechanics)), None
    if request.consistent:
        notify("dynamics", "finding the smallest change that lowers the residuals")
        from gaitval.kinetics.inverse.residual_reduction import reduce_residuals

        consistent = reduce_residuals(*mechanics, motion.markers, known=carried.known)
        consistent = replace(consistent, dynamics=carried.marked(consistent.dynamics))
    return _Ground(
        carried.recording, carried.forces, carried.loads, dynamics, consistent, carried.findings
    )


@dataclass(frozen=True)
class TrialMotion:
    """Inverse kinematics of a walking trial; T frames.

    Attributes
    ----------
    markers : on the model, those that the trial has: M.
    measured : (T, M, 3) m, where they were measured.
    anchoring : of the resting feet; its `kinematics` are the poses as recorded.
    positions : (T, 31) low-passed and completed.
    """

    markers: tuple[ModelMarker, ...]
    measured: Array
    anchoring: AnchoredFeet
    positions: Array


def trial_motion(
    model: BodyModel,
    markers: Sequence[ModelMarker],
    recording: Recording,
    processing: ProcessingSettings,
) -> TrialMotion:
    """The motion of a trial: inverse kinematics, feet anchored, low-passed by `processing`, trunk
    upright.

    `markers` are on `model`; those that `recording` (clean, the project's axes) lacks are left out.
    """
    found = tuple(marker for marker in markers if marker.name in recording.names)
    measured = recording.columns([marker.name for marker in found])
    rate = recording.marker_rate
    poses = inverse_kinematics(model, found, measured)
    anchoring = anchored(model, found, measured, poses, rate=rate)
    kinematics = anchoring.kinematics
    positions = completed(kinematics, smoothed(kinematics, rate, processing))
    return TrialMotion(found, measured, anchoring, positions)


def _notify_motion(notify: Notify, name: str, anchoring: AnchoredFeet) -> None:
    ever = np.asarray(anchoring.kinematics.determined.any(axis=0))
    hidden = [name for name, seen in zip(COORDINATES, ever, strict=True) if not seen]
    if hidden:
        notify(
            "kinematics",
            f"{name}: no marker shows {', '.join(hidden)}; they stay neutral (toes straight, trunk "
            "upright, arms hanging), until --consistent moves them, if it is asked for",
        )
    if anchoring.resting.any():
        notify(
            "kinematics",
            f"{name}: stance feet anchored; they slid by {1000 * anchoring.sliding_before:.1f} mm "
            f"(RMS), now {1000 * anchoring.sliding_after:.1f} mm; marker RMS "
            f"{1000 * anchoring.marker_rms_before:.1f} to "
            f"{1000 * anchoring.marker_rms_after:.1f} mm",
        )


@dataclass(frozen=True)
class TrialLoads:
    """What the ground does to the feet in a walking trial.

    Attributes
    ----------
    recording : with its plates zeroed.
    forces : at `force_cutoff_hz`, at the plates' rate.
    loads : at `moment_force_cutoff_hz` and the T marker frames; not valid where a leg is not shown.
    findings : about forces and plates.
    """

    recording: Recording
    forces: FootForces
    loads: FootForces
    findings: tuple[Repair, ...]

    @property
    def wrenches(self) -> tuple[Array, Array, Array]:
        """Force N, centre of pressure m and free moment Nm on each foot, (T, 2, 3) each."""
        return self.loads.force, self.loads.centre_of_pressure, self.loads.free_moment

    @property
    def known(self) -> Flags:
        """(T,) whether the ground reaction on both feet is known."""
        return np.asarray(self.loads.valid.all(axis=1))

    def marked(self, dynamics: InverseDynamics) -> InverseDynamics:
        """The `dynamics` of these loads, with where they are known, of both legs and of each."""
        return replace(dynamics, known=self.known, foot_known=settled(self.loads))


def trial_loads(
    recording: Recording,
    processing: ProcessingSettings,
    landmarks: Mapping[str, str],
    shown: Mapping[Side, Flags],
) -> TrialLoads:
    """The ground reaction on each foot, for gait cycles and for inverse dynamics.

    `recording` is cleaned, in the project's axes, with force plates; `landmarks` names its markers;
    `processing` has two cut-offs of forces; `shown` (T,) is whether the markers show each leg, see
    `leg_shown`.
    """
    recording, zeroing = zero_plates(recording, landmarks=landmarks)
    forces, assigning = assign_forces(recording, processing, landmarks=landmarks)
    # Different cut-offs of motion and force make impact artefacts (`ProcessingSettings`).
    slow, _ = assign_forces(
        recording, processing, landmarks=landmarks,
        cutoff_hz=processing.moment_force_cutoff_hz,
    )  # fmt: skip
    loads = resample_forces(slow, recording.time)
    moving = shown["right"] & shown["left"]
    loads = replace(loads, valid=loads.valid & moving[:, None])
    return TrialLoads(recording, forces, loads, (*zeroing, *assigning))


def _cycles(
    recording: Recording,
    events: Sequence[Event],
    forces: FootForces | None,
    shown: Mapping[Side, Flags],
    processing: ProcessingSettings,
) -> dict[Side, tuple[GaitCycle, ...]]:
    """The gait cycles of each side, with those marked in which its markers have gaps. A trial need
    not show both sides, nor a whole cycle: `require_cycles` asks for one of all together.
    """
    cut = without_odd_support({side: cut_cycles(events, side, forces=forces) for side in SIDES})
    return {
        side: without_gaps(
            cut[side], recording.time, shown[side], longest_gap_s=processing.largest_gap_s
        )
        for side in SIDES
    }


def require_cycles(trials: Sequence[WalkingTrial]) -> None:
    """Raise NoCycleError, with the reason of every right cycle of the first trial, if `trials`
    together show no whole cycle of either side.
    """
    if any(valid_cycles(walk, side, kinetics=False) for walk in trials for side in SIDES):
        return
    walk = trials[0]
    strikes = sum((each.side, each.kind) == ("right", "heel_strike") for each in walk.events)
    raise NoCycleError(
        f"{walk.recording.source}: no complete right gait cycle in the trial, but at least 1 "
        f"needed: {strikes} right heel strike{'' if strikes == 1 else 's'} found, and a cycle goes "
        "from one to the next. Give a longer trial of steady walking, in which the right foot "
        "strikes the ground at least 2 times."
        + "".join(f"\n  {cycle}" for cycle in walk.cycles["right"])
    )


def leg_shown(
    kinematics: InverseKinematics, side: Side, recording: Recording, marker_set: MarkerSet
) -> Flags:
    """(T,) whether the markers show the pelvis and the leg of a `side`, as far as they do at all,
    from what `kinematics` of `recording` determines.

    Raises RecordError, which names the missing markers of `marker_set`, if an angle of hip, knee or
    ankle is never shown, or the knee's by pelvis and foot alone.
    """
    names = [*ROOT, *(f"{name}_{side[0]}" for name in RECORDED_ANGLES)]
    seen = kinematics.determined[:, [COORDINATES.index(name) for name in names]]
    ever = np.asarray(seen.any(axis=0))
    never = [
        name
        for name, one in zip(names, ever, strict=True)
        if not one and not name.startswith("subtalar")
    ]
    if not never and not shows_knee(recording, marker_set, side):
        never = [f"knee_angle_{side[0]}"]
    if never:
        seen_names = [name for name in recording.names if np.isfinite(recording.marker(name)).any()]
        missing = [name for name in marker_set.essential if name not in seen_names]
        raise RecordError(
            f"{recording.source}: the markers never show {', '.join(never)}: too few markers of "
            f"the {side} leg are seen together. Missing: "
            f"{', '.join(missing) or 'none, but never together'}. "
            "Label them in the recording program and export again."
        )
    return np.asarray(seen[:, ever].all(axis=1))


def shows_knee(recording: Recording, marker_set: MarkerSet, side: Side) -> bool:
    """Whether a marker of thigh or shank of a `side` is ever seen, but for those of the ankle."""
    letter = side[0]
    return any(
        each.segment in (f"thigh_{letter}", f"shank_{letter}")
        and not (each.landmark or "").startswith(f"{letter.upper()}.Ankle")
        and name in recording.names
        and bool(np.isfinite(recording.marker(name)).any())
        for name, each in marker_set.markers.items()
    )


def smoothed(kinematics: InverseKinematics, rate: float, processing: ProcessingSettings) -> Array:
    """The motion (T, 31) of `kinematics` at `rate` Hz, low-passed at the markers' cut-off of
    `processing`, the pelvis through its Cardan angles.

    A coordinate is filtered separately before and after each gap in which its markers do not show
    it: where they come into view it jumps from the held value, and the filter would smear that jump
    into the motion that was seen.
    """
    coordinates = cardan_coordinates(kinematics.positions)
    # Cardan angles are smooth where a rotation vector jumps; inverse kinematics holds the last
    # value in a gap, which is put back after filtering.
    filled = coordinates.copy()
    longest = processing.largest_gap_s * rate
    for column in np.flatnonzero(kinematics.determined.any(axis=0)):
        for begin, end in zip(*runs(~kinematics.determined[:, column]), strict=True):
            if end - begin > longest:
                coordinates[begin:end, column] = np.nan
    coordinates = low_pass(
        coordinates, rate=rate, cutoff_hz=processing.marker_cutoff_hz, order=processing.filter_order
    )
    coordinates = np.where(np.isnan(coordinates), filled, coordinates)
    turn = pelvis_rotation(coordinates[:, 0], coordinates[:, 1], coordinates[:, 2])
    coordinates[:, :3] = Rotation.from_matrix(turn).as_rotvec()
    return coordinates


def completed(kinematics: InverseKinematics, positions: Array) -> Array:
    """The motion `positions` (T, 31) with a trunk that stays upright where no marker shows it
    (`kinematics`).

    A trunk that were fixed to the pelvis would turn with it; people keep it upright. The arms hang
    and the toes are straight, as inverse kinematics left them.
    """
    lumbar = [COORDINATES.index(f"lumbar_{name}") for name in ("extension", "bending", "rotation")]
    if kinematics.determined[..., lumbar].any():
        return positions
    positions = positions.copy()
    positions[:, lumbar] = trunk_upright(Rotation.from_rotvec(positions[:, :3]).as_matrix())
    return positions


def valid_cycles(walk: WalkingTrial, side: Side, *, kinetics: bool) -> tuple[GaitCycle, ...]:
    """Cycles of a `side` of `walk` that count for kinematics or, with `kinetics`, for kinetics."""
    return tuple(
        cycle
        for cycle in walk.cycles[side]
        if (cycle.kinetics_valid if kinetics else cycle.kinematics_valid)
    )
