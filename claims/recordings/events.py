"""Whether anybody who walks is seen to land: events of markers against force plates.

`events.toml` lists the recordings: two of the project's data, the others public.
FOLDER has a clone of each repository, named OWNER+NAME, as for `public.py`.

A plate, zeroed as in an import, shows an event where its force crosses 20 N, one foot is wholly on
it (its heel and heads within 1 cm) and the other one, its swing included, is not near the floor
beside it. The same foot's event of the markers alone that is nearest is compared with it; one that
is farther than 0.2 s away is missed. Recordings that were looked at when the methods were chosen
have rows of their own beside the others.
"""

import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import claims
from claims import ROOT, Claim
from claims.given import DATA
from claims.recordings.zoo_to_c3d import zoo_to_c3d
from gaitval.configuration import load_configuration
from gaitval.coordinates import SIDES
from gaitval.gait.events import foot_contacts, marker_events
from gaitval.gait.feet_on_plates import over_plate
from gaitval.gait.filters import low_pass
from gaitval.gait.plate_offset import zero_plates
from gaitval.gait.sampling import interpolated
from gaitval.mocap.axes import detect_axes
from gaitval.mocap.foot_markers import foot_markers
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import Event, EventKind, Recording
from gaitval.scaling.marker_sets import recognise
from gaitval.session.read import named, prepared

LIST = ROOT / "claims" / "recordings" / "events.toml"
THRESHOLD_N = 20.0
HEIGHT_M = 0.03
"""m above its usual lowest height below which a marker of the other foot is near the floor."""
MISSED_S = 0.2


@dataclass(frozen=True)
class ComparedEvents:
    """Events of one trial: errors in ms by kind, and how many were missed."""

    patient: bool
    chosen: bool
    errors: Mapping[EventKind, list[float]]
    missed: int


def _walks(
    laboratory: Mapping[str, Any], clones: Path
) -> Iterator[tuple[Recording, dict[str, str]]]:
    """The walking trials of a laboratory, cleaned, in the project's axes, with their landmarks."""
    processing = load_configuration().processing

    def placed(name: str) -> Path:
        whole = laboratory["folder"] + name
        data = DATA
        return data / whole[5:] if whole.startswith("data:") else clones / whole

    with tempfile.TemporaryDirectory() as folder:
        for number, name in enumerate(laboratory["trials"]):
            path = placed(name)
            if path.suffix == ".zoo":
                zoo_to_c3d(path, Path(folder) / f"{path.stem}.c3d")
                path = Path(folder) / f"{path.stem}.c3d"
            forces = placed(laboratory["forces"][number]) if "forces" in laboratory else None
            walk = read_recording(path, forces=forces)
            given = laboratory.get("static")
            stand = walk if given is None else read_recording(placed(given), plates=False)
            marker_set = recognise(stand.names)
            landmarks = dict(marker_set.landmarks)
            axes = detect_axes(named(stand, marker_set), landmarks)
            turned = named(walk, marker_set).turned(axes.rotation)
            yield prepared(turned, marker_set, processing, path), landmarks


def plate_events(recording: Recording, landmarks: Mapping[str, str]) -> list[Event]:
    """The events that the plates, zeroed, show of one foot that is wholly on one of them."""
    recording, _ = zero_plates(recording, landmarks=landmarks)
    rate = recording.force_rate
    frames = (recording.force_time - recording.start) * recording.marker_rate
    feet = foot_markers(recording, landmarks)
    outlines = [interpolated(feet[side].outline[:, :4], frames) for side in SIDES]
    near = [
        each[:, :, 2] < np.nanpercentile(each[:, :, 2], 20.0, axis=0) + HEIGHT_M
        for each in outlines
    ]
    edge = max(3, round(0.1 * rate))
    contacts: list[tuple[int, int, int, int]] = []
    found: list[tuple[int, int, int, EventKind]] = []
    for number, plate in enumerate(recording.plates):
        force = low_pass(plate.force[:, 2], rate=rate, cutoff_hz=min(50.0, 0.4 * rate))
        for begin, end in zip(*foot_contacts(force > THRESHOLD_N, rate=rate), strict=True):
            if end - begin < 0.15 * rate or force[begin:end].max() < 5 * THRESHOLD_N:
                continue
            heavy = begin + np.flatnonzero(force[begin:end] > 0.3 * force[begin:end].max())
            pressed = plate.centre_of_pressure[heavy, :2]
            away = [
                np.nanmedian(
                    np.linalg.norm(np.nanmean(each[heavy, :, :2], axis=1) - pressed, axis=1)
                )
                for each in outlines
            ]
            foot = int(np.argmin(away))
            other = np.zeros(end - begin, dtype=bool)
            if np.isfinite(plate.corners).all():
                middle = slice(begin + 3 * (end - begin) // 10, begin + 6 * (end - begin) // 10)
                if over_plate(plate, outlines[foot][middle], margin=0.01).mean() < 0.97:
                    continue
                beside = over_plate(plate, outlines[1 - foot][begin:end], margin=0.02)
                other = (beside & near[1 - foot][begin:end]).any(axis=1)
            if min(away) > 0.15:
                continue
            contacts.append((number, begin, end, foot))
            before, after = force[max(begin - edge, 0) : begin], force[end : end + edge]
            if len(before) == edge and before.max() < THRESHOLD_N and not other[:edge].any():
                found.append((number, begin, foot, "heel_strike"))
            if len(after) == edge and after.max() < THRESHOLD_N and not other[-edge:].any():
                found.append((number, end, foot, "toe_off"))
    shown = []
    for number, at, foot, kind in found:
        # On another plate just before or after, the foot lands or leaves there.
        elsewhere = any(
            mine == foot and plate != number and first - edge <= at <= last + edge
            for plate, first, last, mine in contacts
        )
        if not elsewhere:
            shown.append(Event(float(recording.start + at / rate), SIDES[foot], kind))
    return shown


def compare(
    recording: Recording, landmarks: Mapping[str, str]
) -> tuple[dict[EventKind, list[float]], int]:
    """Errors in ms of the markers' events, by kind, and how many of the plates' they miss."""
    events = marker_events(recording, landmarks=landmarks)
    errors: dict[EventKind, list[float]] = {"heel_strike": [], "toe_off": []}
    missed = 0
    for shown in plate_events(recording, landmarks):
        off = [e.time - shown.time for e in events if (e.side, e.kind) == (shown.side, shown.kind)]
        nearest = min(off, key=abs, default=np.inf)
        if abs(nearest) < MISSED_S:
            errors[shown.kind].append(1000.0 * nearest)
        else:
            missed += 1
    return errors, missed


@claims.measured("public")
def events(given: claims.Given) -> list[Claim]:
    """Heel strikes and toe-offs of markers against the plates, of everybody and of patients."""
    found: list[ComparedEvents] = []
    for laboratory in tomllib.loads(LIST.read_text(encoding="utf-8"))["laboratories"]:
        kinds: dict[EventKind, list[float]] = {"heel_strike": [], "toe_off": []}
        total = 0
        for recording, landmarks in _walks(laboratory, given.public):
            errors, missed = compare(recording, landmarks)
            total += missed
            for kind in kinds:
                kinds[kind] += errors[kind]
        patient, chosen = laboratory.get("patient", False), laboratory.get("chosen", False)
        found.append(ComparedEvents(patient, chosen, kinds, total))
        message = "; ".join(
            f"{kind} n {len(each)}, median {np.median(np.abs(each)):.0f} ms"
            for kind, each in kinds.items()
            if each
        )
        print(f"{laboratory['laboratory']}: {message}; missed {total}", flush=True)
    groups = {
        "everybody": found,
        "patients": [each for each in found if each.patient],
        "recordings not looked at before": [each for each in found if not each.chosen],
        "patients not looked at before": [e for e in found if e.patient and not e.chosen],
    }
    rows = []
    for name, members in groups.items():
        sizes = np.abs([x for each in members for kind in each.errors.values() for x in kind])
        what = f"events of markers against plates, {name}"
        missed = sum(each.missed for each in members)
        rows += [
            Claim(f"{what}, median", float(np.median(sizes)), "ms", len(sizes)),
            Claim(f"{what}, 95 %", float(np.percentile(sizes, 95.0)), "ms", len(sizes)),
            Claim(f"{what}, missed", missed, "events", len(sizes) + missed),
        ]
    for kind, word in (("heel_strike", "heel strikes"), ("toe_off", "toe-offs")):
        sizes = np.abs([x for each in found for x in each.errors[kind]])
        rows += [
            Claim(f"{word} of markers, median", float(np.median(sizes)), "ms", len(sizes)),
            Claim(f"{word} of markers, 95 %", float(np.percentile(sizes, 95.0)), "ms", len(sizes)),
        ]
    return rows
