"""Whether the bands of 90 % hold what they say, and how wide they are.

The truth is that of the sample, a virtual person whose angles and moments are known. Discrepancies
are drawn, of the sizes of `gaitval.measurement.sources`: markers beside their landmarks, soft
tissue that moves with the joints, plates that are not where and as they should be. Then the whole
import works on it, the joint fit included, which the bands leave out. So this tests how errors are
propagated, not how large they are in a laboratory.
"""

import csv
import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import claims
from claims import ROOT, Claim
from claims.measurement.faults import SAMPLE, _imported, _read, _recordings
from claims.measurement.planting import crossed, gained, moved, rotated
from gaitval.arrays import Array
from gaitval.coordinates import COORDINATES
from gaitval.errors import GaitvalError
from gaitval.gait.cycles import normalise
from gaitval.measurement.bands import ABOVE
from gaitval.measurement.expected import USUAL
from gaitval.measurement.measured import measurement_of
from gaitval.measurement.sources import LANDMARKS, TISSUE, TISSUE_TURN, of_stature
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames
from gaitval.session.read import SessionRecordings
from gaitval.session.session import Import
from gaitval.session.trial import valid_cycles
from gaitval.text_tables import without_unit

DRAWS = 20
"""Virtual people."""
SEED = 39_000_001
"""Of the first draw."""
SAGITTAL = ("hip_flexion", "knee_angle", "ankle_angle")


def drawn(session: SessionRecordings, right: Import, seed: int) -> SessionRecordings:
    """The session with discrepancies of this seed."""
    random = np.random.default_rng(seed)
    stature = of_stature(right.request.height_m)
    model, walk = right.body.model, right.trials[0]
    moving = segment_frames(model, walk.positions)[:, :, :3, :3]
    still = segment_frames(model, right.body.placement.standing[None])[0]
    marks = {name: landmark for landmark, name in session.marker_set.landmarks.items()}
    segments = {marker.name: marker.segment for marker in right.body.markers}
    standing, walking = session.standing.markers.copy(), session.walking[0].markers.copy()
    tissue = {
        segment: (
            stature * TISSUE.get(_plain(segment), 0.0) * random.standard_normal(3),
            TISSUE_TURN.get(_plain(segment), 0.0) * random.standard_normal(),
        )
        for segment in sorted({*segments.values()})
    }
    for name, segment in segments.items():
        index = SEGMENTS.index(segment)
        landmark = marks.get(name, "").removeprefix("R.").removeprefix("L.")
        by = stature * LANDMARKS.get(landmark, 0.0) * random.standard_normal(3)
        column = session.standing.names.index(name)
        place = still[index, :3, :3].T @ (standing[:, column].mean(axis=0) - still[index, :3, 3])
        standing[:, column] += still[index, :3, :3] @ by
        if name not in session.walking[0].names:
            continue
        shift, turn = tissue[segment]
        own = shift + turn * np.cross([0.0, 0.0, 1.0], place)
        moved_by = np.broadcast_to(by, (len(walking), 3)).copy()
        if _plain(segment) in ABOVE:
            side = segment[-1] if segment[-2:] in ("_r", "_l") else "r"
            joint = COORDINATES.index(f"{ABOVE[_plain(segment)]}_{side}")
            angle = walk.positions[:, joint] - right.body.placement.standing[joint]
            moved_by += angle[:, None] * own
        at = session.walking[0].names.index(name)
        walking[:, at] += np.einsum("tij,tj->ti", moving[:, index], moved_by)
    trial = replace(session.walking[0], markers=walking)
    for plate in range(len(trial.plates)):
        for axis in (0, 1):
            trial = moved(trial, plate, axis, USUAL["place"].sound * random.standard_normal())
            trial = crossed(
                trial, plate, axis, USUAL["cross-talk"].sound * random.standard_normal()
            )
        trial = gained(trial, plate, USUAL["gain"].sound * random.standard_normal())
        trial = rotated(trial, plate, USUAL["rotation"].sound * random.standard_normal())
    return replace(session, standing=replace(session.standing, markers=standing), walking=(trial,))


def _plain(segment: str) -> str:
    return segment.removesuffix("_r").removesuffix("_l")


def _truth() -> tuple[Array, dict[str, Array]]:
    with (ROOT / "gaitval/samples/truth.csv").open(newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    columns = {name: np.array([float(row[name]) for row in table]) for name in table[0]}
    time_s = columns.pop("time_s")
    return time_s, {without_unit(name)[0]: values for name, values in columns.items()}


def inside(found: Import) -> dict[str, tuple[int, int, float]]:
    """By kind: points of the true curves inside the bands, all points, and the median width."""
    time_s, truth = _truth()
    start = found.trials[0].recording.start
    result = {}
    for kind, of, factor in (
        ("angle", found.angles, 180 / np.pi),
        ("moment", found.moments, 1.0),
    ):
        counts, points, widths = 0, 0, []
        for joint in (*SAGITTAL, "hip_adduction"):
            for side in ("right", "left"):
                name = f"{joint}_{side[0]}"
                cycles = valid_cycles(found.trials[0], side, kinetics=kind == "moment")
                curves = [normalise(time_s + start, truth[f"{kind}_{name}"], c) for c in cycles]
                half = factor * measurement_of(found).bands.half[f"{kind}_{name}"]
                off = np.abs(factor * of[name].mean - np.mean(curves, axis=0))
                counts, points = counts + int((off <= half).sum()), points + len(off)
                widths.append(2 * float(np.median(half)))
        result[kind] = (counts, points, float(np.median(widths)))
    return result


@claims.measured()
def covered(_: claims.Given) -> list[Claim]:
    """Points of the true curves of virtual people that are inside the bands."""
    with tempfile.TemporaryDirectory() as folder:
        request, session = _read(SAMPLE, Path(folder), Path(folder))
        right = _imported(request, session)
        cases = []
        for draw in range(DRAWS):
            try:
                found = _imported(request, drawn(session, right, SEED + draw))
            except GaitvalError as error:
                print(draw, "refused:", str(error)[:100], flush=True)
                continue
            seen = measurement_of(found)
            bands = None if seen is None else seen.bands
            sides = {f"moment_hip_flexion_{side}" for side in "rl"}
            if bands is None or not sides <= bands.half.keys():
                print(draw, "without forces of both sides:", found.decisions[-1], flush=True)
                continue
            cases.append(inside(found))
            print(draw, json.dumps(cases[-1]), flush=True)
    rows = []
    for kind in ("angle", "moment"):
        share = 100 * sum(case[kind][0] for case in cases) / sum(case[kind][1] for case in cases)
        what = f"{kind}s of virtual people with drawn discrepancies: share inside bands of 90 %"
        rows.append(Claim(what, share, "%", len(cases)))
    return rows


@claims.measured("public")
def widths(given: claims.Given) -> list[Claim]:
    """Widths of the bands of public recordings, and the time they take."""
    found_widths: dict[str, list[float]] = {"angle": [], "moment": []}
    seconds = []
    for recording in _recordings():
        with tempfile.TemporaryDirectory() as folder:
            try:
                found = _imported(*_read(recording, given.public, Path(folder)))
            except (GaitvalError, OSError) as error:
                print(recording["name"], "|", error)
                continue
        measurement = measurement_of(found)
        if measurement is None or measurement.bands is None:
            continue
        from gaitval.measurement.measured import measured

        begin = time.process_time()
        measured(replace(found, of_means=()), lambda *_: None)
        length = len(found.trials[0].recording.time) / found.trials[0].recording.marker_rate
        seconds.append((length, time.process_time() - begin))
        for kind, factor in (("angle", 180 / np.pi), ("moment", 1.0)):
            for joint in SAGITTAL:
                for side in "rl":
                    half = measurement.bands.half.get(f"{kind}_{joint}_{side}")
                    if half is not None:
                        found_widths[kind].append(2 * factor * float(np.median(half)))
        print(recording["name"], seconds[-1], flush=True)
    name = "bands of 90 % of public recordings: median width, sagittal"
    longest = max(seconds)
    return [
        Claim(
            f"{name} angles",
            float(np.median(found_widths["angle"])),
            "deg",
            len(found_widths["angle"]),
        ),
        Claim(
            f"{name} moments",
            float(np.median(found_widths["moment"])),
            "Nm/kg",
            len(found_widths["moment"]),
        ),
        Claim(f"time added to an import of {longest[0]:.0f} s, processor", longest[1], "s", 1),
    ]
