"""Faults planted in public recordings: which are warned of, and by which name.

The constants of `gaitval.measurement.expected` and its thresholds were chosen on recordings of
McGill (biomechZoo), Stanford (OpenCap) and Basel; the rows are of other laboratories and of the
sample. A recording that has a warning of its own when it is clean is not planted with another:
WBDS01's right plate, of which the shift that the built-in subject S01 corrects (23 mm, of other
trials) is taken away first.
"""

import json
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import numpy as np

import claims
import gaitval.measurement.measured as wing
from claims import ROOT, Claim
from claims.measurement.planting import SIZES, Fault, Sizes, drawn_sizes, faults, moved
from claims.recordings.public import OPTIONS, listed, local_file, several
from claims.rows import STARTED
from gaitval.configuration import load_configuration
from gaitval.errors import GaitvalError
from gaitval.importing.importing import request_of, work_out
from gaitval.measurement.balance import STEPPED_ON
from gaitval.measurement.estimate import alone
from gaitval.measurement.fault_text import CHECK, named
from gaitval.measurement.standing import KINDS, with_plates
from gaitval.mocap.recording import Recording
from gaitval.session import session as importing
from gaitval.session import trial as trials
from gaitval.session.read import SessionRecordings, read_session
from gaitval.session.request import ImportOptions, Request, checked
from gaitval.session.session import Import
from gaitval.session.subject import speed

SEED: Final = 20261128
"""Used once, after its number was in this file. Those of 3911 and 20261125 to 20261127 were
used before, for earlier constants."""
SAMPLE: Final = {
    "name": "sample",
    "laboratory": "virtual person of the package",
    "mass": 64.95,
    "height": 1.53,
    "sex": "F",
    "static": str(ROOT / "gaitval/samples/standing.c3d"),
    "trials": [str(ROOT / "gaitval/samples/walking.c3d")],
}
CHOSEN_ON: Final = ("McGill", "OpenCap")
"""Words of the laboratories that constants were chosen on."""
TWICE: Final = ("no standing", "flat feet")
"""Of recordings of one walk, the second."""
PLANTED: Final = (
    "Rajagopal walk",
    "PiG 3",
    "sample",
    "WBDS01 treadmill",
    "PiG full",
    "PiG one frame",
)
OWN_FAULTS: Final = {"WBDS01 treadmill": (1, 0.0235)}
"""Number of the plate, and by how far (m) it is too far forward (built-in subject S01)."""
LONGEST: Final = 10.0
"""s of a trial that faults are planted in: a fault is found as well in ten strides as in thirty."""
KNOWN_FAULTS: Final = {
    "WBDS01 treadmill": "place 2",
    "HC040A": "",
}
"""Recordings with a fault that something else shows, and the cause that is right: the shift of S01;
markers that jump, which the import says."""


def _recordings() -> list[dict[str, Any]]:
    """Those with forces that become a subject, one of each walk."""
    return [
        each
        for each in (*listed(), SAMPLE)
        if not each.get("refused")
        and not each.get("kinematics_only")
        and not any(word in each["name"] for word in TWICE)
    ]


def _read(recording: dict[str, Any], base: Path, folder: Path) -> tuple[Request, SessionRecordings]:
    """A recording's request, and what is read of it."""
    files = {
        key: [local_file(path, base, folder) for path in several(recording.get(key))]
        for key in ("static", "trials", "forces")
    }
    options = {key: recording[key] for key in OPTIONS if key in recording}
    options |= {key: files[key] for key in ("trials", "forces")}
    options["static"] = next(iter(files["static"]), None)
    if "marker_set" in recording:
        options["marker_set"] = str(ROOT / recording["marker_set"])
    request = request_of(checked(ImportOptions, options), folder / "out", lambda *_: None)
    return request, read_session(request, load_configuration().processing)


def _imported(
    request: Request, session: SessionRecordings, right: "_Right | None" = None
) -> Import:
    """The import of what was read. Where the markers are those of `right`, so are the body and the
    motion: neither sees a force.
    """
    with ExitStack() as stack:
        stack.enter_context(patch.object(importing, "read_session", lambda *_: session))
        if right is not None and right.has_markers_of(session):
            body = replace(right.found.body, walking=session.walking)
            motions, compared = iter(right.motions), iter(right.found.trials)
            for module, name, instead in (
                (importing, "scale_body", lambda *_, **__: body),
                (trials, "trial_motion", lambda *_: next(motions)),
                (trials, "inverse_kinematics", lambda *_: next(compared).compared),
            ):
                stack.enter_context(patch.object(module, name, instead))
        return work_out(request, load_configuration().processing)


@dataclass(frozen=True)
class _Right:
    """A session without a fault, its import, and the motion of its trials."""

    session: SessionRecordings
    found: Import
    motions: list[Any]

    def has_markers_of(self, other: SessionRecordings) -> bool:
        """Whether another session has the same markers, at the same times."""
        pairs = [(self.session.standing, other.standing)]
        pairs += zip(self.session.walking, other.walking, strict=True)
        return all(
            one.marker_rate == two.marker_rate
            and np.array_equal(one.markers, two.markers, equal_nan=True)
            for one, two in pairs
        )


def _right(request: Request, session: SessionRecordings) -> _Right:
    motions: list[Any] = []
    make = trials.trial_motion

    def kept(*arguments: Any) -> Any:
        motions.append(make(*arguments))
        return motions[-1]

    with patch.object(trials, "trial_motion", kept):
        return _Right(session, _imported(request, session), motions)


def _warnings(found: Import) -> set[str]:
    return {f"{flag.check}, {flag.where}" for _, flag in found.warnings}


def _errors(right: Import, wrong: Import, mass: float) -> dict[str, float]:
    """What a fault does to the mean curves."""
    angle = [
        np.abs(right.angles[n].mean - wrong.angles[n].mean).max()
        for n in {*right.angles} & {*wrong.angles}
    ]
    moment = [
        np.abs(right.moments[n].mean - wrong.moments[n].mean).max()
        for n in {*right.moments} & {*wrong.moments}
    ]
    force = [
        np.abs(right.forces[n].mean - wrong.forces[n].mean).max()
        for n in {*right.forces} & {*wrong.forces}
    ]
    return {
        "angle": float(np.degrees(max(angle, default=0.0))),
        "moment": float(max(moment, default=0.0)),
        "force": 100 * max(float(max(force, default=0.0)), abs(1 / mass - 1)),
        "speed": 100 * abs(speed(wrong) / speed(right) - 1),
    }


def _case(
    request: Request, session: SessionRecordings, right: _Right, fault: Fault
) -> dict[str, Any]:
    """What becomes of one fault."""
    given = request.model_copy(update={"mass": request.mass * fault.mass})
    row: dict[str, Any] = {"fault": fault.name, "causes": fault.causes, "size": fault.size}
    try:
        # The masses of the body's segments are those of the mass that is given.
        known = right if fault.mass == 1.0 else None
        found = _imported(given, fault.change(session), known)
    except GaitvalError as error:
        return row | {"refused": str(error)}
    row |= {
        "errors": _errors(right.found, found, fault.mass),
        "new": sorted(_warnings(found) - _warnings(right.found)),
    }
    seen = wing.measurement_of(found).seen if found.measurement else None
    if seen is not None:
        matter = [f for f in seen.found if f.matters]
        row["named"] = [[cause.name for cause in named(f)] for f in matter]
        figures = alone(seen)
        row["estimates"] = {name: figures[name] for name in figures if kind_plate(name, fault)}
    return row


def kind_plate(name: str, fault: Fault) -> bool:
    """Whether an estimate is one that the fault is about."""
    return any(name.replace(" x ", " ").replace(" y ", " ") == cause for cause in fault.causes)


def _session(
    recording: dict[str, Any], base: Path, folder: Path
) -> tuple[Request, SessionRecordings]:
    request, session = _read(recording, base, folder)
    session = replace(session, walking=tuple(_beginning(walk) for walk in session.walking))
    with suppress(GaitvalError):
        session = with_plates(request, session)
    if recording["name"] in OWN_FAULTS:
        plate, metres = OWN_FAULTS[recording["name"]]
        walks = tuple(moved(walk, plate, 0, -metres) for walk in session.walking)
        session = replace(session, walking=walks)
    return request, session


def _beginning(walk: Recording) -> Recording:
    """The first seconds of a trial."""
    frames = round(LONGEST * walk.marker_rate)
    samples = round(frames * walk.force_rate / walk.marker_rate)
    plates = tuple(
        replace(
            plate,
            force=plate.force[:samples],
            centre_of_pressure=plate.centre_of_pressure[:samples],
            free_moment=plate.free_moment[:samples],
            moment=None if plate.moment is None else plate.moment[:samples],
        )
        for plate in walk.plates
    )
    events = tuple(event for event in walk.events if event.time < walk.start + LONGEST)
    return replace(walk, markers=walk.markers[:frames], plates=plates, events=events)


def _used(found: Import) -> list[int]:
    """Numbers of the plates that carry a foot in the first trial."""
    seen = wing.measurement_of(found).seen.data
    walked = seen.effect[~np.isin(seen.kind, KINDS)]
    return [
        i
        for i, plate in enumerate(found.trials[0].recording.plates)
        if np.abs(walked[:, seen.names.index(f"gain {plate.name}")]).max() > STEPPED_ON
    ]


def _all_cases(base: Path, names: Sequence[str], sizes: Sizes) -> Iterator[dict[str, Any]]:
    for name in names:
        recording = next(each for each in _recordings() if each["name"] == name)
        with tempfile.TemporaryDirectory() as folder:
            request, session = _session(recording, base, Path(folder))
            used = _used(_imported(request, session))
            kept = tuple(
                replace(walk, plates=tuple(walk.plates[i] for i in used))
                for walk in session.walking
            )
            stood = session.standing
            order = [*used, *(i for i in range(len(stood.plates)) if i not in used)]
            stood = replace(stood, plates=tuple(stood.plates[i] for i in order if stood.plates))
            session = replace(session, walking=kept, standing=stood)
            right = _right(request, session)
            names = [plate.name for plate in kept[0].plates]
            for fault in faults(names, sizes):
                row = _case(request, session, right, fault)
                print(
                    recording["name"],
                    "|",
                    fault.name,
                    "|",
                    row.get("named", row.get("refused", "")),
                    flush=True,
                )
                yield {"recording": recording["name"]} | row


@claims.measured("public")
def planted(given: claims.Given) -> list[Claim]:
    """Faults planted in recordings of other laboratories: warned of, and named."""
    return planted_rows(_stored_cases(given, "planted", Sizes()), WHERE)


@claims.measured("public")
def drawn(given: claims.Given) -> list[Claim]:
    """The same with sizes, plates and directions drawn anew, which nothing was chosen on."""
    cases = _stored_cases(given, f"drawn-{SEED}", drawn_sizes(SEED))
    name = f"planted faults drawn by seed {SEED}:"
    return planted_rows(cases, name)[:2]


def _stored_cases(given: claims.Given, kind: str, sizes: Sizes) -> list[dict[str, Any]]:
    """All cases; those of this commit that are below `work` are not made again."""
    store = given.work / f"{kind}-{STARTED}.jsonl"
    lines = store.read_text(encoding="utf-8").splitlines() if store.exists() else []
    cases = list(map(json.loads, lines))
    known = {case["recording"] for case in cases}
    # No row needs the bands of a curve, which take as long as the rest.
    nothing = {"bands": object(), "said_bands": "", "unshown": (), "curves_with_bands": {}}
    with ExitStack() as stack:
        for part, value in nothing.items():
            stack.enter_context(patch.object(wing, part, lambda *_, value=value: value))
        for name in (name for name in PLANTED if name not in known):
            cases += _all_cases(given.public, [name], sizes)
            text = "".join(json.dumps(case) + "\n" for case in cases)
            store.write_text(text, encoding="utf-8")
    return cases


def counts(case: dict[str, Any]) -> bool:
    """Whether the error of a fault is large enough, or it is refused."""
    return "refused" in case or any(case["errors"][kind] > size for kind, size in SIZES.items())


REFUSED_BY: Final = {
    "mass": "the mass given is",
    "delay": "the feet strike the ground",
    "rate": "frame rate",
}


def is_right(case: dict[str, Any]) -> bool:
    """Whether the first warning names the right cause, or one that looks the same."""
    if "refused" in case:
        return any(
            kind in case["causes"] and words in case["refused"]
            for kind, words in REFUSED_BY.items()
        )
    first = case.get("named") or [[]]
    return bool(set(first[0]) & set(case["causes"]))


WHERE: Final = "planted faults, laboratories that no constant was chosen on:"


def planted_rows(cases: Sequence[dict[str, Any]], name: str) -> list[Claim]:
    """The rows of all cases, that begin with a `name`."""
    large = [case for case in cases if counts(case)]
    warned = [case for case in large if case.get("new") or "refused" in case]
    right = [is_right(case) for case in warned]
    share = 100 * len(warned) / len(large)
    rows = [
        Claim(f"{name} warned or refused", share, "%", len(large)),
        Claim(
            f"{name} the right cause among at most two named, of those warned of",
            100 * float(np.mean(right)),
            "%",
            len(warned),
        ),
    ]
    for kind, factor, unit in (
        ("delay", 1000.0, "ms"),
        ("gain", 100.0, "%"),
        ("rotation", 180 / np.pi, "deg"),
        ("place", 1000.0, "mm"),
    ):
        errors = [
            factor * (value - case["size"])
            for case in cases
            if case.get("estimates")
            and len(case["causes"]) == 1
            and case["causes"][0].startswith(kind)
            and "all" not in case["causes"][0]
            for value in [_along(case)]
        ]
        rows.append(
            Claim(
                f"{name} {kind}, root mean square error of the estimate",
                float(np.sqrt(np.mean(np.square(errors)))),
                unit,
                len(errors),
            )
        )
    return rows


def _along(case: dict[str, Any]) -> float:
    """The estimate of a planted fault, along its axis."""
    values = case["estimates"]
    if len(values) == 1:
        return float(next(iter(values.values()))[0])
    axis = " x " if "forward" in case["fault"] else " y "
    return float(next(value[0] for name, value in values.items() if axis in name))


@claims.measured("public")
def clean(given: claims.Given) -> list[Claim]:
    """Public recordings as they are: warnings of faults that nobody planted."""
    false: dict[bool, list[int]] = {True: [], False: []}
    own: list[float] = []
    for recording in _recordings():
        with tempfile.TemporaryDirectory() as folder:
            try:
                request, session = _read(recording, given.public, Path(folder))
                found = _imported(request, session)
            except (GaitvalError, OSError) as error:
                print(recording["name"], "|", error)
                continue
        known = KNOWN_FAULTS.get(recording["name"])
        flags = [flag for _, flag in found.warnings if flag.check.startswith(CHECK)]
        wrong = (
            0
            if known == ""
            else sum(not str(flag).startswith("plate 2") or known is None for flag in flags)
        )
        print(recording["name"], "|", [str(flag) for flag in flags], "| wrong:", wrong, flush=True)
        chosen_on = any(word in recording["laboratory"] for word in CHOSEN_ON)
        false[chosen_on].append(wrong)
        if found.measurement and not chosen_on:
            own.append(1000 * wing.measurement_of(found).seen.lag.value)
    print("delays of clean recordings, ms:", np.round(own, 1))
    every = false[True] + false[False]
    name = "clean recordings: false warnings of a fault, a recording"
    return [
        Claim(name, float(np.mean(every)), "warnings", len(every)),
        Claim(
            f"{name}, laboratories that no constant was chosen on",
            float(np.mean(false[False])),
            "warnings",
            len(false[False]),
        ),
    ]
