"""Which foot makes a contact on a force plate, and whether the plates show it completely.

Axes: the project's (REP-103, z up). Forces act on the person.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from gaitval.arrays import Array, Flags, runs
from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.gait.events import foot_contacts, marker_events
from gaitval.gait.feet_on_plates import FEET, Feet, distances_to_feet, nearest_foot, over_plate
from gaitval.mocap.recording import Event, Plate, Recording
from gaitval.mocap.repairs import Repair, repair


@dataclass(frozen=True)
class ContactLimits:
    """When a contact with a plate is one of the whole foot and of that foot."""

    outside_foot: float = 0.06
    """m. How far outside the outline of the foot a centre of pressure may be: the shoe extends 1 to
    2 cm beyond the markers, plates and cameras agree within 2 cm, and small forces make it
    uncertain."""
    edge_m: float = 0.02
    """m by which markers may be beside a plate: the outline's toes are an estimate, and plates and
    cameras agree no better."""
    outside_share: float = 0.2
    """Fraction of a contact's loaded time beyond `outside_foot` that marks it as another foot's."""
    well_loaded: float = 0.2
    """Fraction of the contact's peak force above which the centre of pressure is used."""
    least_shown: float = 0.95
    """Fraction of a stance, by markers, in which the plates must show a force, but for the time
    within which its events are known (`FEET.settling_seconds`): plates miss -25 to 41 ms of its
    beginning and -28 to 50 ms of its end in 64 stances of 24 people, the last at 0.5 m/s."""
    least_faint: float = 0.8
    """Likewise where no foot loads a plate with ten force thresholds, as in another unit, so that
    where stances begin and end is not known from it."""
    brush_force: float = 2.0
    """A touch too short for a stance is reported above this many force thresholds."""
    longest_flight: float = 0.25
    """s. Runners are in the air for at most about 0.15 s of a step (Weyand et al. 2000)."""
    largest_lag_seconds: float = 0.06
    """s. Events from forces may be this much earlier or later than those from markers, in the
    median of strikes and of toe-offs: at most 0.03 s in WBDS01 T01 and the walk of Rajagopal et al.
    2016."""
    usual_delay: float = 0.003
    """s by which forces come later than the motion that markers show, mean of sound recordings of
    three laboratories: soft tissue moves before the bones, and force channels have filters."""


CONTACTS: Final = ContactLimits()

OUTSIDE: Final = "outside the foot"
"""Words of a finding about that, by which such contacts are counted."""


def owners_of(vertical: Array, distances: Array, shared: Flags) -> NDArray[np.int64]:
    """The foot that a plate's contact belongs to, sample by sample: (n,) its column, 0 right, 1
    left.

    There is one foot for each period in which no other is on the plate; a period that is `shared`
    (n,) stays with the foot before it (and is not valid for either). `vertical` (n,) N is the force
    of the contact, `distances` (n, 2) m are those of `distances_to_feet`. What is outside one foot
    belongs to the other, if that is not seen.
    """
    load = np.maximum(vertical, 0.0)
    owner = np.full(len(vertical), -1)
    for start, stop in zip(*runs(~shared), strict=True):
        # Distances count by their load: at small forces the centre of pressure is uncertain.
        weight = np.where(np.isfinite(distances[start:stop]), load[start:stop, None], 0.0)
        mean = (weight * np.nan_to_num(distances[start:stop])).sum(axis=0)
        total = weight.sum(axis=0)
        mean = np.where(total > 0.0, mean / np.maximum(total, 1e-12), CONTACTS.outside_foot)
        owner[start:stop] = int(np.argmin(mean))
    alone = np.flatnonzero(owner >= 0)
    if not len(alone):
        return np.full(len(vertical), nearest_foot(distances))
    # A contact that begins shared has no foot before; it goes to the first foot alone on it.
    before = np.searchsorted(alone, np.arange(len(vertical)), side="right") - 1
    return owner[alone[np.maximum(before, 0)]]


def judge_contact(
    recording: Recording,
    plate: Plate,
    feet: Feet,
    begin: int,
    end: int,
    owner: NDArray[np.int64],
    distances: Array,
    sharing: Flags,
    valid: Flags,
) -> list[Repair]:
    """Findings where a contact on a `plate` of `recording` (in the project's axes), from force
    sample `begin` to before `end` (n), is not one foot's only, or not completely on the plates.

    `feet` are of `feet_of`, `owner` (n,) of `owners_of`, `distances` (n, 2) m of
    `distances_to_feet`, `sharing` (T,) of `shared_by_both` over the whole trial. `valid` (T, 2) is
    set to False in place where a foot's force is not known.
    """
    findings = []
    for start, stop in zip(*runs(sharing[begin:end]), strict=True):
        first, last = begin + int(start), begin + int(stop)
        # Of both feet: a plate measures the sum of two forces.
        valid[first:last] = False
        names = (f"plate {plate.name}", *(f"{side} foot" for side in SIDES))
        action = "both feet on this plate; forces not used"
        findings.append(repair(recording, "contact", names, first, last, action))
    load = plate.force[begin:end, 2]
    heavy = load > CONTACTS.well_loaded * load.max()
    for column, side in enumerate(SIDES):
        mine = (owner == column) & ~sharing[begin:end]
        if not mine.any():
            continue
        first, last = begin + int(np.argmax(mine)), begin + len(mine) - int(np.argmax(mine[::-1]))
        names = (f"plate {plate.name}", f"{side} foot")
        for reason in (
            _why_outside(
                distances[:, column], mine & heavy & _seen_whole(feet, column, begin, end)
            ),
            _why_beside(recording, feet, column, begin, mine & heavy),
        ):
            if reason is not None:
                valid[first:last, column] = False
                findings.append(repair(recording, "contact", names, first, last, reason))
    return findings


def _seen_whole(feet: Feet, column: int, begin: int, end: int) -> Flags:
    """(n,) whether all markers of a foot that are ever seen are: the outline of the others is
    smaller than the foot.
    """
    outline = feet.outlines[column]
    ever = np.isfinite(outline).all(axis=2).any(axis=0)
    return np.asarray(np.isfinite(outline[begin:end, ever]).all(axis=(1, 2)))


def _why_outside(distances: Array, loaded: Flags) -> str | None:
    """Why the centre of pressure is not this foot's, by its `distances` (n,) m from the foot where
    the plate is well `loaded` (n,); None if it is. A small force has an uncertain one.
    """
    known = distances[loaded & np.isfinite(distances)]
    away = known > CONTACTS.outside_foot
    if not len(away) or away.mean() <= CONTACTS.outside_share:
        return None
    return (
        f"the centre of pressure is up to {100 * known.max():.0f} cm "
        f"{OUTSIDE}, in {100 * away.mean():.0f} % of the loaded time (another foot "
        "or person on the plate, or wrong corners or axes); forces not used"
    )


def _why_beside(
    recording: Recording, feet: Feet, column: int, begin: int, loaded: Flags
) -> str | None:
    """Whether part of the foot is beside all plates while one is well `loaded` (n,), from sample
    `begin`; None if not, or if a plate whose position is unknown may carry that part.
    """
    if not all(np.isfinite(plate.corners).all() for plate in recording.plates):
        return None
    # Within 2 cm of an edge the centre of pressure knows better than markers.
    on_any = np.any(
        [
            over_plate(other, feet.outlines[column], margin=CONTACTS.edge_m)
            for other in recording.plates
        ],
        axis=0,
    )
    off = (feet.low[column] & ~on_any).any(axis=1)[begin : begin + len(loaded)] & loaded
    few = off.mean() * len(off) <= FEET.shortest_shared_seconds * recording.force_rate
    return None if few else "part of the foot is beside the plates; forces not used"


def judge_brushes(
    recording: Recording,
    plate: Plate,
    feet: Feet,
    vertical: Array,
    used: Flags,
    processing: ProcessingSettings,
    valid: Flags,
) -> list[Repair]:
    """A finding for each touch of a `plate` of `recording` that is too short to be a stance, but
    above `CONTACTS.brush_force` thresholds of `processing`.

    `vertical` (T,) N is the plate's low-passed force, `used` (T,) are samples that are part of a
    contact; `valid` (T, 2) is set to False in place for the nearer one of `feet`.
    """
    findings = []
    threshold = processing.force_threshold_n
    for begin, end in zip(*runs((vertical > threshold) & ~used), strict=True):
        peak = float(vertical[begin:end].max())
        if peak < CONTACTS.brush_force * threshold:
            continue
        column = nearest_foot(distances_to_feet(plate, feet, begin, end))
        valid[begin:end, column] = False
        action = f"touched with {peak:.0f} N, too short for a stance; not used"
        names = (f"plate {plate.name}", f"{SIDES[column]} foot")
        findings.append(repair(recording, "contact", names, begin, end, action))
    return findings


def check_synchrony(recording: Recording, touched: Flags, landmarks: Mapping[str, str]) -> None:
    """Refuse forces of `recording` that do not rise and fall when the feet strike and leave the
    ground. `touched` (T, 2) is whether each foot is on a plate, at the force samples; `landmarks`:
    see `foot_markers`.

    Raises RecordError if in the median both strikes and toe-offs are more than
    `CONTACTS.largest_lag_seconds` later, or both earlier, than the markers show them; or as
    `marker_events`.
    """
    events = marker_events(recording, landmarks=landmarks)
    most = CONTACTS.largest_lag_seconds
    found = _lags(recording, touched, events)
    late = [float(np.median(each)) for each in found.values()]
    # A shifted clock moves strikes and toe-offs the same way. If only one is late the contacts are
    # longer or shorter, for which there are other reasons.
    shifted = min(late) > most or max(late) < -most
    # Half a stride is as near to the strike before as to the one after, so that medians of both
    # signs may be anything.
    exchanged = max(_sizes(_lags(recording, touched[:, ::-1], events))) < most < min(_sizes(found))
    if not (shifted or exchanged):
        return
    seen = (
        f"{recording.source}: by the forces the feet strike the ground {abs(late[0]):.2f} s and "
        f"leave it {abs(late[1]):.2f} s {'after' if late[0] > 0 else 'before'} the markers show it "
        "(medians)"
    )
    if exchanged:
        raise RecordError(
            f"{seen}, but with right and left of the plates exchanged they do so at the same time: "
            "the plates show each foot's forces under the other one. Their corners are numbered "
            "the other way round, or the channels of two plates (C3D: FORCE_PLATFORM:CHANNEL), the "
            "columns of right and left, or what was said of them, are exchanged: compare with the "
            "laboratory, and export both together. (Forces that are half a stride late would look "
            "the same.)"
        )
    raise RecordError(
        f"{seen}: the forces are of another trial, or not synchronised with the cameras, or the "
        "rate of both is not that of the recording, or frames of the markers are missing. Give the "
        "forces of this trial, exported on the markers' clock."
    )


def _lags(recording: Recording, touched: Flags, events: Sequence[Event]) -> dict[str, list[float]]:
    """Times, s, by which the plates show each kind of the markers' `events` later."""
    lags = {}
    for kind, edge in (("heel_strike", 0), ("toe_off", 1)):
        found: list[float] = []
        for column, side in enumerate(SIDES):
            shown = np.array([e.time for e in events if (e.side, e.kind) == (side, kind)])
            samples = foot_contacts(touched[:, column], rate=recording.force_rate)[edge]
            samples = samples[(samples > 0) & (samples < len(touched))]
            if len(shown):
                away = recording.start + samples[:, None] / recording.force_rate - shown
                nearest = np.argmin(np.abs(away), axis=1)
                found += away[np.arange(len(samples)), nearest].tolist()
        lags[kind] = found or [0.0]
    return lags


def _sizes(lags: Mapping[str, Sequence[float]]) -> list[float]:
    """Median size, s, of the `lags` of each kind of event."""
    return [float(np.median(np.abs(each))) for each in lags.values()]


def judge_unshown(
    recording: Recording, feet: Feet, touched: Flags, valid: Flags, *, faint: bool = False
) -> list[Repair]:
    """A finding for each stance of `feet`, by the markers of `recording`, that the plates do not
    show, or show in part, and each landing that nothing shows. `touched` (T, 2) is whether each
    foot is on a plate, at the force samples; `valid` (T, 2) is set to False in place over these
    stances.
    """
    findings = []
    settling = round(FEET.settling_seconds * recording.force_rate)
    for column, side in enumerate(SIDES):
        # Events from markers are accurate to about 20 ms, so a stance may seem to reach beyond its
        # contact on the plate.
        shown = binary_dilation(touched[:, column], iterations=settling)
        for begin, end in zip(*runs(feet.stance[:, column]), strict=True):
            if not _seen_whole(feet, column, begin, end).all():
                # Its events may be hidden, too: only where no plate shows a force is none known.
                valid[begin:end, column] &= shown[begin:end]
                continue
            share = float(shown[begin:end].mean())
            if share >= (CONTACTS.least_faint if faint else CONTACTS.least_shown):
                continue
            valid[begin:end, column] = False
            action = (
                f"the plates show only {100 * share:.0f} % of this stance; forces not used"
                if share > 1.0 - CONTACTS.least_shown
                else "is on no plate; no forces there"
            )
            findings.append(repair(recording, "contact", (f"{side} foot",), begin, end, action))
    for begin, end in zip(*runs(np.asarray(~(feet.stance | touched).any(axis=1))), strict=True):
        if end - begin > CONTACTS.longest_flight * recording.force_rate:
            valid[begin:end] = False
            action = "neither is seen on the ground, longer than anybody flies; no forces there"
            findings.append(repair(recording, "contact", ("both feet",), begin, end, action))
    return findings
