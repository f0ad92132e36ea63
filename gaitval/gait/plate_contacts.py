"""Which foot makes a contact on a force plate, and whether the plates show it completely.

Axes: the project's (REP-103, z up). Forces act on the person.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from gaitval.arrays import Array, Flags, runs
from gaitval.configuration import ProcessingSettings
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.gait.events import foot_contacts, marker_events
from gaitval.gait.feet_on_plates import (
    SETTLING_SECONDS,
    SHORTEST_SHARED_SECONDS,
    Feet,
    distances_to_feet,
    nearest_foot,
    over_plate,
)
from gaitval.mocap.findings import Finding, sample_finding
from gaitval.mocap.recording import Plate, Recording

OUTSIDE_FOOT: Final = 0.06
"""m. How far outside the outline of the foot a centre of pressure may be: the shoe extends 1 to 2
cm beyond the markers, plates and cameras agree within 2 cm, and small forces make it uncertain."""
OUTSIDE: Final = "outside the foot"
"""What a finding about that says."""
OUTSIDE_SHARE: Final = 0.2
"""Fraction of a contact's loaded time beyond `OUTSIDE_FOOT` that marks it as another foot's."""
WELL_LOADED: Final = 0.2
"""Fraction of the contact's peak force above which the centre of pressure is used."""
LEAST_SHOWN: Final = 0.8
"""Fraction of a stance, by markers, in which the plates must show a force."""
BRUSH_FORCE: Final = 2.0
"""A touch too short for a stance is reported above this many force thresholds."""

LARGEST_LAG_SECONDS: Final = 0.06
"""s. Events from forces may be this much earlier or later than those from markers, in the median of
strikes and of toe-offs: at most 0.03 s in WBDS01 T01 and the walk of Rajagopal et al. 2016."""


def owners_of(vertical: Array, distances: Array, shared: Flags) -> NDArray[np.int64]:
    """(n,) column of the foot that a plate's contact belongs to, sample by sample.

    There is one foot for each period in which no other is on the plate; a shared period stays with
    the foot before it (and is not valid for either).
    """
    load = np.maximum(vertical, 0.0)
    owner = np.zeros(len(vertical), dtype=np.int64)
    starts, stops = runs(~shared)
    previous = 0
    for start, stop in zip(starts, stops, strict=True):
        owner[previous:start] = owner[previous - 1] if previous else 0
        weight = np.where(np.isfinite(distances[start:stop]), load[start:stop, None], 0.0)
        mean = (weight * np.nan_to_num(distances[start:stop])).sum(axis=0)
        total = weight.sum(axis=0)
        mean = np.where(total > 0.0, mean / np.maximum(total, 1e-12), np.inf)
        owner[start:stop] = int(np.argmin(mean))
        if previous == 0 and start > 0:
            owner[:start] = owner[start]
        previous = stop
    owner[previous:] = owner[previous - 1] if previous else nearest_foot(distances)
    return owner


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
) -> list[Finding]:
    """Mark where a contact is not one foot's only, or not completely on the plates; say why."""
    findings = []
    plates = [other for other in recording.plates if np.isfinite(other.corners).all()]
    for start, stop in zip(*runs(sharing[begin:end]), strict=True):
        first, last = begin + int(start), begin + int(stop)
        points = [
            (over_plate(plate, feet.outlines[c][first:last]) & feet.low[c][first:last]).mean(axis=0)
            for c in (0, 1)
        ]
        guest = int(np.argmin([share.mean() for share in points]))
        partly = any(
            other is not plate
            and (
                over_plate(other, feet.outlines[guest][first:last]) & feet.low[guest][first:last]
            ).any()
            for other in plates
        )
        action = (
            f"the {SIDES[guest]} foot crosses onto this plate, where the {SIDES[1 - guest]} one "
            "is standing; forces not used"
            if partly
            else "both feet on this plate; forces not used"
        )
        valid[first:last] = False
        names = (f"plate {plate.name}", *(f"{side} foot" for side in SIDES))
        findings.append(sample_finding(recording, "contact", names, first, last, action))
    load = plate.force[begin:end, 2]
    heavy = load > WELL_LOADED * load.max()
    for column, side in enumerate(SIDES):
        mine = (owner == column) & ~sharing[begin:end]
        if not mine.any():
            continue
        first, last = begin + int(np.argmax(mine)), begin + len(mine) - int(np.argmax(mine[::-1]))
        names = (f"plate {plate.name}", f"{side} foot")
        known = mine & heavy & np.isfinite(distances[:, column])
        away = distances[known, column] > OUTSIDE_FOOT
        if len(away) and away.mean() > OUTSIDE_SHARE:
            valid[first:last, column] = False
            action = (
                f"the centre of pressure is up to {100 * distances[known, column].max():.0f} cm "
                f"{OUTSIDE}, in {100 * away.mean():.0f} % of the loaded time (another foot "
                "or person on the plate, or wrong corners or axes); forces not used"
            )
            findings.append(sample_finding(recording, "contact", names, first, last, action))
        if len(plates) < len(recording.plates):
            continue  # a plate whose position is unknown may carry what seems to be beside it
        on_any = np.any([over_plate(other, feet.outlines[column]) for other in plates], axis=0)
        beside = (feet.low[column] & ~on_any).any(axis=1)[begin:end] & mine & heavy
        if beside.mean() * len(beside) > SHORTEST_SHARED_SECONDS * recording.force_rate:
            valid[first:last, column] = False
            action = "part of the foot is beside the plates; forces not used"
            findings.append(sample_finding(recording, "contact", names, first, last, action))
    return findings


def judge_brushes(
    recording: Recording,
    plate: Plate,
    feet: Feet,
    vertical: Array,
    used: Flags,
    processing: ProcessingSettings,
    valid: Flags,
) -> list[Finding]:
    """Mark touches that are too short to be a stance, but not too weak to matter."""
    findings = []
    threshold = processing.force_threshold_n
    for begin, end in zip(*runs((vertical > threshold) & ~used), strict=True):
        peak = float(vertical[begin:end].max())
        if peak < BRUSH_FORCE * threshold:
            continue
        column = nearest_foot(distances_to_feet(plate, feet, begin, end))
        valid[begin:end, column] = False
        action = f"touched with {peak:.0f} N, too short for a stance; not used"
        names = (f"plate {plate.name}", f"{SIDES[column]} foot")
        findings.append(sample_finding(recording, "contact", names, begin, end, action))
    return findings


def check_synchrony(recording: Recording, touched: Flags, landmarks: Mapping[str, str]) -> None:
    """Refuse forces that do not rise and fall when the feet strike and leave the ground."""
    events = marker_events(recording, landmarks=landmarks)
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
        lags[kind] = float(np.median(found)) if found else 0.0
    early, late = sorted(lags.values())
    lag = late if early > LARGEST_LAG_SECONDS else early if late < -LARGEST_LAG_SECONDS else 0.0
    if lag:
        when = "after" if lag > 0 else "before"
        raise RecordError(
            f"{recording.source}: by the forces the feet strike the ground "
            f"{abs(lags['heel_strike']):.2f} s and leave it {abs(lags['toe_off']):.2f} s {when} "
            "the markers show it (medians): the forces are of another trial, or not synchronised "
            "with the cameras, or the rate of both is not that of the recording. Give the forces "
            "of this trial, exported on the markers' clock."
        )


def judge_unshown(recording: Recording, feet: Feet, touched: Flags, valid: Flags) -> list[Finding]:
    """Mark stances that the plates do not show."""
    findings = []
    settling = round(SETTLING_SECONDS * recording.force_rate)
    for column, side in enumerate(SIDES):
        shown = binary_dilation(touched[:, column], iterations=settling)
        for begin, end in zip(*runs(feet.stance[:, column]), strict=True):
            share = float(shown[begin:end].mean())
            if share >= LEAST_SHOWN:
                continue
            valid[begin:end, column] = False
            action = (
                "is on no plate; no forces there"
                if share < 1.0 - LEAST_SHOWN
                else f"the plates show only {100 * share:.0f} % of this stance; forces not used"
            )
            findings.append(
                sample_finding(recording, "contact", (f"{side} foot",), begin, end, action)
            )
    return findings
