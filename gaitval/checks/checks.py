"""Warnings about a walking trial: its markers, its forces and its clock."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain

from gaitval.checks.event_checks import contact_warnings, while_seen
from gaitval.checks.filled_markers import filled_warnings
from gaitval.checks.force_checks import (
    CUT_OFF,
    FREE_MOMENT,
    NOT_ALONG,
    channel_warnings,
    force_warnings,
    place_warnings,
    whole_stances,
)
from gaitval.checks.loose_markers import loose_warnings
from gaitval.checks.marker_checks import (
    foot_marker_warnings,
    pelvis_marker_warnings,
    scale_warnings,
    trajectory_warnings,
)
from gaitval.checks.motion_checks import (
    aid_warnings,
    motion_warnings,
    swing_warnings,
    weight_warnings,
)
from gaitval.checks.pelvis_checks import pelvis_level_warnings
from gaitval.checks.unloaded_plates import unloaded_warnings
from gaitval.gait.events import marker_events
from gaitval.gait.plate_contacts import OUTSIDE
from gaitval.gait.quality_flags import QualityFlag
from gaitval.gait.sampling import interpolated
from gaitval.inverse.inverse_dynamics import InverseDynamics
from gaitval.mocap.foot_markers import pelvis_markers
from gaitval.mocap.lost_frames import lost_frames
from gaitval.mocap.recording import Event, FootForces, Recording
from gaitval.mocap.repairs import Repair
from gaitval.scaling.same_person import MarkerDistance


def marker_warnings(
    as_read: Recording,
    standing: Recording,
    walking: Recording,
    landmarks: Mapping[str, str],
    moved: Iterable[MarkerDistance],
    segments: Mapping[str, str],
    *,
    stood: bool = True,
) -> Iterator[QualityFlag]:
    """All warnings about the markers of a trial, `as_read` in the axes of its file. `standing` and
    `walking` are both trials, cleaned, in the project's axes, and `landmarks` names their markers;
    `moved` are distances on a segment that differ between them (`same_person.displaced`);
    `segments` has the segment of each marker. Of a pose that was put together from the walk (not
    `stood`) the heights of the feet say nothing.
    """
    of_paths = [*trajectory_warnings(as_read), *filled_warnings(as_read, segments)]
    yield from of_paths
    for one in moved:
        yield QualityFlag(
            "displaced marker", " to ".join(one.markers), abs(one.change), one.limit, "m",
            f"{1000 * one.standing:.0f} mm in standing, {1000 * one.walking:.0f} mm in walking: "
            "one of the two has moved, or is not the same marker; left as it is: check the labels",
        )  # fmt: skip
    if stood:
        yield from foot_marker_warnings(standing, walking, landmarks)
    twisted = [*pelvis_marker_warnings(standing, walking, landmarks)]
    yield from twisted or pelvis_level_warnings(standing, walking, landmarks)
    # Noise from frame to frame is said of all markers together.
    if not any(flag.check == "noise" for flag in of_paths):
        yield from loose_warnings(walking, segments, landmarks)
    yield from scale_warnings(standing, walking, landmarks)


def trial_warnings(
    recording: Recording,
    landmarks: Mapping[str, str],
    events: Sequence[Event],
    findings: Sequence[Repair],
    measured: tuple[FootForces, FootForces, InverseDynamics] | None,
    *,
    height_m: float,
    mass_kg: float,
    aid: str | None = None,
) -> tuple[QualityFlag, ...]:
    """All warnings about a trial but those about events of its file.

    `recording` is cleaned and zeroed, and `landmarks` names its markers; `events` were found;
    `findings` are of `assign_forces`. `measured` are forces at their own rate, at the marker
    frames, and inverse dynamics with these; None without forces. `height_m`, `mass_kg` and `aid`
    (what carries a part of the weight) are the person's.
    """
    found = [*swing_warnings(events, height_m, forces=measured is not None)]
    if measured is None:
        return tuple(found)
    forces, loads, dynamics = measured
    needed = loads.force.sum(axis=1) + dynamics.residual_force
    if aid is not None:
        # The aid is in none of the balances of force and motion; channels can still be dead.
        channels = [channel_warnings(plate, recording.force_rate) for plate in recording.plates]
        return (*found, *aid_warnings(aid, needed, loads), *chain(*channels))
    frames = (forces.time - recording.start) * recording.marker_rate
    pelvis = interpolated(pelvis_markers(recording, landmarks), frames)
    stances = whole_stances(recording, forces)
    of_plates = [*force_warnings(recording, forces, pelvis)]
    for plate in recording.plates:
        outside = sum(
            OUTSIDE in one.action and one.names[0] == f"plate {plate.name}" for one in findings
        )
        used = sum(stance.plate == plate.name for stance in stances)
        of_plates += place_warnings(plate, outside, used)
        if used:
            of_plates += unloaded_warnings(plate, recording.force_rate)
    if weight := [*weight_warnings(needed, loads)]:
        # with a wrong unit, balances of force and motion, limits in N and moments over forces are
        # off, too
        follows = {CUT_OFF, FREE_MOMENT}
        return (*found, *weight, *(each for each in of_plates if each.check not in follows))
    of_motion = motion_warnings(needed, loads, stances, forces.rate, mass_kg)
    by_markers = marker_events(recording, landmarks=landmarks)
    shown = [*while_seen(by_markers, recording, landmarks)]
    contacts = [*contact_warnings(forces, shown)]
    # What was lost, not a plate, makes events differ; looking for it takes a while.
    if contacts and not lost_frames(recording.markers):
        found += contacts
    # a plate with a warning already explains why its force and the motion disagree; one of its
    # sideways force or its free moment does not say why the fore-aft force does
    named = {warning.plate for warning in of_plates if warning.check not in NOT_ALONG}
    return (*found, *of_plates, *(d for d in of_motion if not d.plate or d.plate not in named))
