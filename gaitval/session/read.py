"""Read the trials of a session: name the markers, turn the axes and clean the trajectories."""

import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import ProcessingSettings
from gaitval.errors import RecordError, RecordWarning, ScalingError, count_of
from gaitval.findings import Looked, Result, look
from gaitval.findings.feet import Beside
from gaitval.findings.markers import AsRead, Walking
from gaitval.gait.cycles import CYCLES
from gaitval.gait.events import EVENTS
from gaitval.gait.quality_flags import QualityFlag
from gaitval.gait.raised_plates import without_raised
from gaitval.mocap.axes import LaboratoryAxes, detect_axes, turn_to_walking_direction
from gaitval.mocap.cleaning import clean
from gaitval.mocap.lost_markers import without_lost
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Recording
from gaitval.mocap.repairs import Repair
from gaitval.scaling.marker_set import MarkerSet
from gaitval.scaling.marker_sets import RECOGNISED_SHARE, load_marker_set, recognise
from gaitval.scaling.same_person import check_same_person, displaced
from gaitval.session.pelvis_markers import completed
from gaitval.session.request import Notify, Request, part_text, silent
from gaitval.session.standing import check_stands, without_seldom

if TYPE_CHECKING:
    from gaitval.scaling.given_centres import GivenCentre

NAMED: Final = 20
"""Points named when they are ignored: Plug-in Gait writes 250 computed ones into a file."""


@dataclass(frozen=True)
class SessionRecordings:
    """All trials of a session, with markers named, axes turned and trajectories cleaned.

    Attributes
    ----------
    marker_set : the recordings use its names.
    axes : of the laboratory.
    standing, walking : in the project's axes, walking along +x.
    warnings : the trial, and a warning about its markers.
    looked : the trial, and what was looked for in its markers.
    placement_sd : m, each way, of landmarks that no marker is on, by name.
    points : joint centres that the standing trial has as points, or the first walk that has any.
    """

    marker_set: MarkerSet
    axes: LaboratoryAxes
    standing: Recording
    walking: tuple[Recording, ...]
    warnings: tuple[tuple[str, QualityFlag], ...] = ()
    looked: tuple[tuple[str, Looked], ...] = ()
    placement_sd: Mapping[str, float] = field(default_factory=dict)
    points: "tuple[GivenCentre, ...]" = ()


def read_session(
    request: Request, processing: ProcessingSettings, notify: Notify = silent
) -> SessionRecordings:
    """Read all trials of `request`, bring them into the project's axes and clean them by
    `processing`; `notify` is called with each decision.

    Raises RecordError if a file cannot be used, or the files do not belong together.
    """
    _check_files(request)
    walking = [_walk_of_file(request, number, notify) for number in range(len(request.trials))]
    standing = _standing_file(request, walking, notify)
    for recording in (*(() if request.stands_in_walk else (standing,)), *walking):
        notify("read", _described(recording))
    for number, recording in enumerate(walking):
        with of_trial(number):
            _check_length(recording, processing)
    for one, two in combinations(range(len(walking)), 2):
        if np.array_equal(walking[one].markers, walking[two].markers, equal_nan=True):
            raise RecordError(
                f"{request.called(one)} and {request.called(two)} are the same recording: its "
                "cycles would count twice. Give each trial once."
            )
    marker_set = _marker_set(request, standing, notify)
    standing = named(standing, marker_set)
    for number, recording in enumerate(walking):
        with of_trial(number):
            walking[number] = named(recording, marker_set)
    for number, recording in enumerate(walking):
        lacking = [name for name in marker_set.essential if name not in recording.names]
        if lacking:
            notify("markers", f"{request.called(number)}: without {', '.join(lacking)}")
    stood = Result((), ())
    if not request.stands_in_walk:
        standing, stood = without_seldom(standing)
    whole = completed(marker_set, standing, walking)
    marker_set, standing, walking = whole.marker_set, whole.standing, list(whole.walking)
    points = _points((standing, *walking), marker_set)
    axes = detect_axes(standing, marker_set.landmarks)
    notify("axes", axes.description)

    flags = list[tuple[str, QualityFlag]]()

    def warn(number: int, found: Iterable[QualityFlag]) -> None:
        for warning in found:
            notify("warnings", f"{request.called(number)}: {warning}")
            flags.append((request.called(number), warning))

    def walked(number: int) -> Recording:
        recording, trial = walking[number].turned(axes.rotation), request.trials[number]
        lost: list[QualityFlag] = []
        found = prepared(recording, marker_set, processing, trial, notify, lost)
        warn(number, lost)
        return found

    # A standing pose from the walk needs the walk cleaned first; it is not cleaned twice.
    first = None
    if request.stands_in_walk:
        with of_trial(0):
            first = walked(0)
    floor = _floor(request, axes, standing, walking, notify)
    standing, of_walk = _standing(
        request, processing, marker_set, axes, standing, first, floor, notify
    )
    warn(0, (*stood.flags, *whole.flags, *of_walk))
    turned = list[Recording]()
    looked = [(request.called(0), row) for row in stood.looked]
    for number, named_walk in enumerate(walking):
        with of_trial(number):
            recording = walked(number) if first is None or number > 0 else first
            doubts = _doubts_beside(request, marker_set, standing, recording, named_walk)
            looked += [(request.called(number), row) for row in doubts.looked]
            warn(number, doubts.flags)
            if recording.plates and not request.kinematics_only:
                recording, raised = without_raised(recording, marker_set.landmarks, aid=request.aid)
                warn(number, raised)
            _check_plates(request, recording)
        turned.append(recording)
    return SessionRecordings(
        marker_set=marker_set,
        axes=axes,
        standing=standing,
        walking=tuple(turned),
        warnings=tuple(flags),
        looked=tuple(looked),
        placement_sd=whole.placement_sd,
        points=points,
    )


def _points(recordings: Iterable[Recording], marker_set: MarkerSet) -> "tuple[GivenCentre, ...]":
    """The joint centres of the first of the `recordings` that has any, in its own axes."""
    first = next((each for each in recordings if each.centres), None)
    if first is None:
        return ()
    from gaitval.scaling.given_centres import of_recording

    return tuple(of_recording(first, marker_set.segments))


def _walk_of_file(request: Request, number: int, notify: Notify) -> Recording:
    """A walking trial as read: the part, the plates and their axes that the user says."""
    with of_trial(number):
        forces = request.forces[number] if request.forces else None
        part = request.time_of(number)
        found = _read(notify, request.trials[number], forces=forces, part=part)
        if part is not None:
            found = replace(found, source=f"{found.source}, {part_text(part)}")
        if request.plate:
            from gaitval.session.stated_plates import with_stated_plates

            found = with_stated_plates(found, request.plate)
        return _sound(found, request, notify)


def _doubts_beside(
    request: Request,
    marker_set: MarkerSet,
    standing: Recording,
    walk: Recording,
    as_recorded: Recording,
) -> Result:
    """Findings of the markers of a `walk` beside those in standing; RecordError if they are of
    another person. `as_recorded` is the walk before it was cleaned.
    """
    # What is left out, and said to be, is not doubted once more.
    as_recorded = without_lost(as_recorded, marker_set.segments)
    distances = check_same_person(
        trajectories(standing),
        trajectories(walk),
        marker_set,
        names=(str(request.static), walk.source),
    )
    moved = displaced(distances, marker_set)
    segments = {name: marker.segment for name, marker in marker_set.markers.items()}
    return look(
        AsRead(as_recorded, segments),
        Walking(walk, segments),
        Beside(standing, walk, marker_set.landmarks, moved, stood=not request.stands_in_walk),
    )


def _check_plates(request: Request, recording: Recording) -> None:
    """Refuse a trial without force plates, unless only its kinematics are asked for."""
    if not recording.plates and not request.kinematics_only:
        raise RecordError(
            f"{recording.source}: no force plates in the trial, so there are no moments "
            "and no ground reaction. Give the file of the forces with --forces, or use "
            "--kinematics-only: the walk then predicts moments and forces."
        ).with_way_on("--kinematics-only")


def _marker_set(request: Request, standing: Recording, notify: Notify) -> MarkerSet:
    """The marker set that was asked for, or that the standing trial's names show."""
    with about_file(standing.source):
        marker_set = (
            recognise(standing.names)
            if request.marker_set is None
            else load_marker_set(request.marker_set)
        )
    score = marker_set.score(
        name for name in standing.names if np.isfinite(standing.marker(name)).any()
    )
    notify("markers", f"marker set: {marker_set.title} ({marker_set.name}): {score}")
    if ignored := marker_set.ignored(standing.names):
        more = f" and {len(ignored) - NAMED} more" if len(ignored) > NAMED else ""
        notify("markers", f"not of this set, ignored: {', '.join(ignored[:NAMED])}{more}")
    return marker_set


def _standing(
    request: Request,
    processing: ProcessingSettings,
    marker_set: MarkerSet,
    axes: LaboratoryAxes,
    standing: Recording,
    first: Recording | None,
    floor: float,
    notify: Notify,
) -> tuple[Recording, list[QualityFlag]]:
    """The standing trial, cleaned and in the project's axes; put together from `first`, the first
    walk as `prepared`, if there is none.
    """
    landmarks, flags = marker_set.landmarks, list[QualityFlag]()
    if first is not None:
        from gaitval.session.standing_pose import of_walk, standing_in_walk

        standing = standing_in_walk(first, marker_set)
        flags.append(of_walk(len(standing.markers)))
    else:
        standing, findings = clean(
            standing.turned(axes.rotation), marker_set.segments, processing, landmarks=landmarks
        )
        _notify_cleaning(notify, request.static, findings)
        check_stands(standing, landmarks)
    if floor:
        from gaitval.session.standing_pose import on_floor

        standing = on_floor(standing, floor)
    if request.feet_not_flat:
        from gaitval.session.standing_pose import with_level_feet

        standing = with_level_feet(standing, landmarks)
    return standing, flags


HIGH_FLOOR: Final = 0.01
"""m. Plates that are nearer than this to the axes' origin are level with it."""
UNEVEN_PLATES: Final = 0.02
"""m. Plates whose corners differ by more in height say nothing of the floor."""
LOWEST_MARKER: Final = (-0.02, 0.12)
"""m above the floor, of the lowest marker of a standing person."""


def _floor(
    request: Request,
    axes: LaboratoryAxes,
    standing: Recording,
    walking: Sequence[Recording],
    notify: Notify,
) -> float:
    """Height of the floor in the standing trial, m: as the user says, else that of the plates'
    corners if it is not about 0 and the lowest marker fits it.
    """
    if request.floor is not None:
        return request.floor
    heights = np.array(
        [plate.corners @ axes.rotation[2] for walk in walking for plate in walk.plates]
    ).ravel()
    heights = heights[np.isfinite(heights)]
    even = len(heights) > 0 and np.ptp(heights) <= UNEVEN_PLATES
    floor = float(np.median(heights)) if even else 0.0
    seen = standing.markers[:, np.isfinite(standing.markers).any(axis=(0, 2))]
    lowest = float(np.nanmin(np.nanmedian(seen @ axes.rotation[2], axis=0)))
    low, high = LOWEST_MARKER
    if abs(floor) < HIGH_FLOOR or not low <= lowest - floor <= high:
        return 0.0
    notify(
        "axes",
        f"the floor is at {floor:.3f} m, by the corners of the plates (floor in a session file "
        "says else)",
    )
    return floor


@contextmanager
def of_trial(number: int) -> Iterator[None]:
    """Errors are about one walking trial, by its number."""
    try:
        yield
    except RecordError as error:
        error.trial = number
        raise


def _read(
    notify: Notify,
    path: Path,
    forces: Path | None = None,
    *,
    plates: bool = True,
    part: tuple[float, float] | None = None,
) -> Recording:
    """`read_recording`, which says what it passed over."""
    with warnings.catch_warnings(record=True) as passed_over:
        warnings.simplefilter("always", RecordWarning)
        try:
            return read_recording(path, forces=forces, plates=plates, faulty=True, part=part)
        finally:  # what was passed over may be why the rest is refused
            for each in passed_over:
                notify("warnings", f"{each.message}.")


def _sound(recording: Recording, request: Request, notify: Notify) -> Recording:
    """A walk without plates that cannot be used, where nobody asks for forces. Raises RecordError
    for one where somebody does.
    """
    sound = tuple(plate for plate in recording.plates if not plate.fault)
    for plate in recording.plates:
        if plate.fault and request.kinematics_only:
            notify("warnings", f"{plate.fault} The plate is left out")
        elif plate.fault and not sound:
            raise RecordError(plate.fault).with_way_on("--kinematics-only")
        elif plate.fault:
            raise RecordError(
                f"{plate.fault} Or leave the plate out with --plate {quote(plate.name)}=none, if "
                "nobody steps on it."
            ).with_way_on(f"--plate {quote(plate.name)}=none")
    return replace(recording, plates=sound, force_rate=recording.force_rate if sound else 0.0)


def _standing_file(request: Request, walking: Sequence[Recording], notify: Notify) -> Recording:
    """The standing trial as read; the first walk where there is none."""
    if request.stands_in_walk:
        if request.static_time is not None:
            raise RecordError(
                "static_time: there is no standing trial to cut. Give one with --static."
            )
        return walking[0]
    # Nobody needs the forces of standing, so faults of its plates do not matter.
    recording = _read(notify, request.static, plates=False)
    if request.static_time is None:
        return recording
    return recording.between(request.static_time, "static_time")


def _check_files(request: Request) -> None:
    """Refuse force files that do not pair with trials, a file that is given twice, and a hip
    centre without a trial to find it in.
    """
    if request.forces and len(request.forces) != len(request.trials):
        raise RecordError(
            f"--forces is given {len(request.forces)}× and --trial "
            f"{len(request.trials)}×. Give one --forces for each --trial, in the same order."
        )
    if len(request.trial_time) not in (0, 1, len(request.trials)):
        raise RecordError(
            f"--trial-time is given {len(request.trial_time)}× and --trial "
            f"{len(request.trials)}×. Give it once for all trials, or once for each, in the "
            "same order."
        )
    parts = len(request.trial_time) > 1
    if request.joint_centres == "functional" and not request.functional:
        raise RecordError(
            "--joint-centres functional: there is no trial to find the hips in. Give a "
            'range-of-motion trial in a session file: functional = ["FILE"].'
        )
    roles: dict[Path, str] = {}
    for option, path in (
        *(() if request.stands_in_walk else (("--static", request.static),)),
        *(("--trial", path) for path in request.trials),
        *(("--forces", path) for path in request.forces),
    ):
        other = roles.get(path.resolve())
        if other is not None and not (parts and other == option):
            raise RecordError(
                f"{path}: the same recording is given twice, with {other} and with {option}. Give "
                "each file once, with "
                "its own option."
            )
        roles[path.resolve()] = option


@contextmanager
def about_file(source: str) -> Iterator[None]:
    """Add the file's name, `source`, to errors of functions that see only its contents."""
    try:
        yield
    except (RecordError, ScalingError) as error:
        raise type(error)(f"{source}: {error}").with_way_on(*error.goes_on) from None


def _check_length(recording: Recording, processing: ProcessingSettings) -> None:
    """Refuse a walking trial that is too short for a stride, or sampled too slowly to filter."""
    where, rate = recording.source, recording.marker_rate
    length = len(recording.markers) / rate
    if length < CYCLES.plausible_stride[0]:
        frames = count_of(len(recording.markers), "frame")
        raise RecordError(
            f"{where}: {frames} at {rate:g} Hz, {length:.3g} s: shorter than a gait cycle. Give a "
            "walking trial in which both feet strike the ground at least twice."
        )
    for what, found, cutoff in (
        ("markers", rate, max(processing.marker_cutoff_hz, EVENTS.foot_cutoff_hz)),
        ("forces", recording.force_rate, processing.force_cutoff_hz),
    ):
        if 0.0 < found <= 2.0 * cutoff:
            raise RecordError(
                f"{where}: {what} at {found:g} Hz; the low-pass at {cutoff:g} Hz needs more than "
                f"{2.0 * cutoff:g} Hz. Walking is recorded at 50 Hz or more, forces at 200 Hz or "
                "more: export the trial at the rate at which it was recorded."
            )


def _described(recording: Recording) -> str:
    frames, count = recording.markers.shape[:2]
    source = f"{recording.source}: {count} markers, "
    source += f"{frames / recording.marker_rate:.1f} s at {recording.marker_rate:g} Hz"
    if recording.plates:
        source += (
            f", {count_of(len(recording.plates), 'force plate')} at {recording.force_rate:g} Hz"
        )
    return source


def named(recording: Recording, marker_set: MarkerSet) -> Recording:
    """Only the markers of `marker_set`, by its names. Raises RecordError if too few of them are in
    `recording`, or one is there twice.
    """
    with about_file(recording.source):
        names = marker_set.renamed(recording.names, recording.alike)
    missing = [marker for marker in marker_set.essential if marker not in names.values()]
    if len(missing) > (1.0 - RECOGNISED_SHARE) * len(marker_set.essential):
        raise RecordError(
            f"{recording.source}: {len(missing)} of the {len(marker_set.essential)} markers that "
            f"the marker set {marker_set.name} needs are missing: {', '.join(missing)}. The file "
            f"has {', '.join(recording.names)}. Label "
            "the trial with the same names as the standing trial, or give the right set with "
            "--marker-set."
        )
    columns = [recording.names.index(name) for name in names]
    return recording.with_markers(names.values(), recording.markers[:, columns])


def prepared(
    recording: Recording,
    marker_set: MarkerSet,
    processing: ProcessingSettings,
    file: Path,
    notify: Notify = silent,
    flags: list[QualityFlag] | None = None,
) -> Recording:
    """A walking trial `recording`, `named` after `marker_set` and in the project's axes, turned
    about the vertical, so that the person walks along +x, and cleaned as `processing` says;
    `notify` calls it `file`. Warnings about markers that were lost or jump go to `flags`. Raises
    RecordError as `turn_to_walking_direction` and `clean`.
    """
    landmarks = marker_set.landmarks
    # A marker that fell off says nothing about where the person walks and faces.
    shown = without_lost(recording, marker_set.segments)
    recording, heading = turn_to_walking_direction(recording, landmarks, shown)
    notify("axes", heading)
    recording, findings = clean(recording, marker_set.segments, processing, landmarks=landmarks)
    _notify_cleaning(notify, file, findings)
    if flags is not None:
        flags += [lost_doubt(each) for each in findings if each.kind in ("lost", "jump")]
    return recording


def lost_doubt(found: Repair) -> QualityFlag:
    """The warning about a marker that was `found` lost, or those that jump."""
    return QualityFlag(
        f"{found.kind} marker", ", ".join(found.names), found.end - found.start, 0.0, "s",
        f"from {found.start:.2f} s on it {found.action}. Look at it in the recording program: "
        "delete or label it there, and export again",
    )  # fmt: skip


def trajectories(recording: Recording) -> dict[str, Array]:
    """Trajectory (T, 3) m of each marker of `recording`."""
    return {name: recording.marker(name) for name in recording.names}


def _notify_cleaning(notify: Notify, file: Path, findings: Iterable[Repair]) -> None:
    for finding in findings:
        notify("cleaning", f"{file.name}: {finding}")
