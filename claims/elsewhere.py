"""One laboratory left out: people with markers alone, against the force plates they walked over.

Each recording is imported without its plates, and estimated from the ten of WBDS with what all
*other* laboratories of the list differ by from these (`estimate.OFFSETS`,
`force_split.forces_elsewhere`) and with bands as wide as those need. A laboratory counts once,
however many people it has. Two others of the list are kept for a last test and are not here.
"""

import tempfile
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

import claims
from claims import Claim, public_file
from claims.accuracy import MOMENTS
from claims.prediction import SKILLS
from claims.skill_interval import skill_interval
from gaitval.arrays import Array
from gaitval.configuration import RecordSettings, load_configuration
from gaitval.constants import GRAVITY
from gaitval.coordinates import SIDES
from gaitval.errors import GaitvalError
from gaitval.gait.events import force_events, marker_events
from gaitval.gait.foot_forces import assign_forces
from gaitval.gait.plate_offset import zero_plates
from gaitval.gait.record import GaitRecord
from gaitval.scaling.scaling import scale_subject
from gaitval.session.importing.importing import request_of, work_out
from gaitval.session.read import read_session
from gaitval.session.request import ImportOptions, Request, checked
from gaitval.session.subject import subject_of
from gaitval.study.estimate_stage import Elsewhere, of_known, with_kinetics
from gaitval.subjects.prediction.deviations import (
    KINETICS,
    SAGITTAL,
    kinetics_of,
    learned_from,
    trial_of,
    units,
)
from gaitval.subjects.prediction.estimate import OFFSETS, WIDER_WITH_TOTAL, estimate
from gaitval.subjects.prediction.force_split import (
    CORNER_HZ,
    NOISE,
    SPLIT,
    ForcesElsewhere,
    difference,
    together,
)
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.prediction.laboratories import Laboratories
from gaitval.subjects.prediction.laboratories import pooled as laboratories_of
from gaitval.subjects.prediction.normal_form import SAMPLES, normal_form
from gaitval.subjects.prediction.population import (
    expected_record,
    on_the_line,
    other_people,
    with_others_kinetics,
)
from gaitval.subjects.prediction.seen import PHASES
from gaitval.subjects.prediction.speed_line import dimensionless_speed
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_subjects

ARNOLD: Final = "stanfordnmbl+balance-exo-sim/results/experiments"
GAIT2354: Final = "opensim-org+opensim-models/Pipelines/Gait2354_Simbody/subject01"
RAJAGOPAL: Final = "data:opensim_rajagopal/ExpData"
PLUG_IN: Final = "Biomechanical-ToolKit+BTKData/Input/C3DSamples/PiG/PiG_"
MONTREAL: Final = "mcgillmotionlab+biomechzoo/data/sample_study/raw c3d files"
NO_STANDING: Final = "Basel"
"""The laboratory without standing trials: zeros of angles and joint centres are from the walk. Its
people are learned from, and are rows of their own."""
BASEL: Final = "fmoissenet+GaitEventsAlgorithms/NormSubjects"
BASEL_WALKS: Final = (
    "1001a16", "1003a09", "1004a05", "1005a05", "1006a12", "1008a11", "1009a20", "1010a15",
    "1011a17", "1012a07", "1013a06", "1014a05", "1022a05", "1023a03", "1025a16", "1026a11",
    "1027a18",
)  # fmt: skip
"""One walk of each child and adult that is whole in what was at hand and becomes a subject: the
plates under NP1002 carry another mass than is written."""
VERTICAL: Final = KINETICS.index(("forces", "vertical"))
TREADMILL: Final = {
    "name": "WBDS01 treadmill",
    "laboratory": "ABC federal university, Brazil (WBDS)",
    "static": "data:wbds/raw/WBDS01static1.c3d",
    "trials": ["data:wbds/raw/WBDS01walkT01.c3d"],
    "mass": 74.3, "height": 1.725, "sex": "M",
}  # fmt: skip
"""Of the laboratory of the ten: for heel strikes, which are not learned from it."""
EDGE_S: Final = 0.2
"""Farther than this from every landing by markers, a landing on a plate is none of theirs."""


class PersonElsewhere(NamedTuple):
    """Somebody of another laboratory.

    Attributes
    ----------
    laboratory : whose.
    truth, found, line : (2, 7, n) Nm/kg and body weights: by their plates, estimated without
        `OFFSETS`, and of the line through the ten at their speed.
    vertical : (2, n) N/kg expected of anybody.
    width : (7, n) half of the band, as wide as at home.
    """

    laboratory: str
    truth: Array
    found: Array
    line: Array
    vertical: Array
    width: Array


def recordings(public: Path) -> list[dict[str, Any]]:
    """What is imported. Raises LackingError without the clone whose people are not named here."""
    found: list[dict[str, Any]] = []
    for number, mass, height in (("01", 72.84, 1.75), ("04", 80.3, 1.85)):
        of = f"{ARNOLD}/subject{number}"
        found.append(
            {
                "laboratory": "Stanford (Arnold 2013)",
                "static": f"{of}/static/expdata/marker_trajectories.trc",
                "trials": [f"{of}/walk2/expdata/marker_trajectories.trc"],
                "forces": [f"{of}/walk2/expdata/ground_reaction_unfiltered.mot"],
                "mass": mass, "height": height, "sex": "M",
            }
        )  # fmt: skip
    found += [
        {
            "laboratory": "OpenSim (Gait2354)",
            "static": f"{GAIT2354}_static.trc",
            "trials": [f"{GAIT2354}_walk1.trc"],
            "forces": [f"{GAIT2354}_walk1_grf.mot"],
            "mass": 72.6, "height": 1.8, "sex": "M",
        },
        {
            "laboratory": "Stanford (Rajagopal 2016)",
            "static": f"{RAJAGOPAL}/static_walk_1.trc",
            "trials": [f"{RAJAGOPAL}/motion_capture_walk.trc"],
            "forces": [f"{RAJAGOPAL}/grf_walk.mot"],
            "mass": 85.07, "height": 1.829, "sex": "M",
        },
        {
            "laboratory": "Plug-in Gait samples",
            "static": f"{PLUG_IN}Calibration3_noFF.c3d",
            "trials": [f"{PLUG_IN}Motion3_noFF.c3d"],
            "sex": "F",
        },
    ]  # fmt: skip
    found += [
        {
            "laboratory": "McGill and Shriners, Montreal",
            "static": str(next((person / "Static").glob("*.c3d")).relative_to(public)),
            "trials": [str(next((person / "Straight").glob("*.c3d")).relative_to(public))],
            "sex": "F",
        }
        for person in sorted(public_file(MONTREAL, public).glob("HC*"))
    ]
    found += [
        {
            "laboratory": NO_STANDING,
            "trials": [f"{BASEL}/walkNorm_NP{walk}.c3d"],
            "sex": "M",
        }
        for walk in BASEL_WALKS
    ]
    return [{"name": each["trials"][0].rpartition("/")[2], **each} for each in found]


class ImportedElsewhere(NamedTuple):
    """A recording's laboratory, and its subject with and without plates."""

    laboratory: str
    full: Subject
    known: Subject


def _request(recording: dict[str, Any], base: Path, folder: Path) -> Request:
    """What an import is asked for, into `folder`."""
    options = {key: value for key, value in recording.items() if key in ImportOptions.model_fields}
    for key in ("trials", "forces"):
        options[key] = [public_file(each, base) for each in recording.get(key) or ()]
    if "static" in recording:
        options["static"] = public_file(recording["static"], base)
    return request_of(checked(ImportOptions, options), folder / "out", lambda *_: None)


def subject_from(recording: dict[str, Any], base: Path) -> Subject:
    """The subject that a recording becomes."""
    with tempfile.TemporaryDirectory() as folder:
        request = _request(recording, base, Path(folder))
        return subject_of(work_out(request, load_configuration().processing))


def imported(public: Path) -> list[ImportedElsewhere]:
    """All `recordings` that become a subject without their plates."""
    found = []
    for each in recordings(public):
        try:
            full = subject_from(each, public)
            known = subject_from(each | {"kinematics_only": True, "forces": None}, public)
        except (GaitvalError, StopIteration) as error:
            print(f"{each['name']}: left out ({error})"[:200], flush=True)
            continue
        found.append(ImportedElsewhere(each["laboratory"], full, known))
    return found


def apart(found: Sequence[ImportedElsewhere]) -> list[Array]:
    """(2, s) of each, `force_split.difference` from what is expected."""
    return [
        difference(each.full.record(), _expected(each.known), each.known.leg_length_m)
        for each in found
    ]


def pooled(found: Sequence[ImportedElsewhere], differences: Sequence[Array]) -> Array:
    """(2s, 2s) `force_split.together` of the `differences` of `apart`, every laboratory as heavy as
    another.
    """
    names = [each.laboratory for each in found]
    return together(differences, [1.0 / names.count(name) for name in names])


def later(values: Array, than: Array, stride_time: float) -> float:
    """s by which periodic `values` (n, k) come later than those of another cycle, `than` (n, k), to
    half a millisecond.
    """
    waves, lags = np.fft.rfft(than, axis=0), np.arange(-0.05, 0.0501, 0.0005)
    turns = np.arange(len(waves)) / stride_time
    moved = [
        np.fft.irfft((waves.T * np.exp(-2j * np.pi * lag * turns)).T, len(than), axis=0)
        for lag in lags
    ]
    return float(lags[np.argmin([np.var(values - each, axis=0).sum() for each in moved])])


def total_late(of: ImportedElsewhere) -> float:
    """s, `force_split.TOTAL_LATE` of one person: of the right cycle, which begins at plates' strike
    in one import and at markers' in the other.
    """
    full, known = of.full.record(), of.known
    total, time = known.gait.total_force, known.stride_time_s
    assert total is not None, "an import has it"
    turns = np.arange(len(PHASES) // 2 + 1) / time
    gain = np.where(turns <= SPLIT.highest_hz, 1.0 / (1.0 + (turns / CORNER_HZ) ** 4), 0.0)
    own = {"right": PHASES, "left": (PHASES - full.left_phase) % 1.0}
    plates = np.sum([full.ground_reaction(side, own[side]) for side in SIDES], axis=0)
    plates = np.fft.irfft((np.fft.rfft(plates, axis=0).T * gain).T, len(PHASES), axis=0)
    markers = [each.periodic()(PHASES) for each in (total.forward, total.left, total.up)]
    forces = later(plates / NOISE, np.stack(markers, axis=1) / NOISE, time)
    begins = {"r": (0.0, 0.0), "l": (full.left_phase, known.left_phase)}
    seen, beside = (
        [
            angles[f"{name}_{side}"](PHASES - begins[side][which])
            for side in "rl"
            for name in SAGITTAL
        ]
        for which, angles in enumerate((full.angles, known.gait.angles_of_both()))
    )
    return forces - later(np.stack(seen, axis=1), np.stack(beside, axis=1), time)


def regressed_from(found: Sequence[ImportedElsewhere]) -> Laboratories:
    """What a regression through people of several laboratories has of these, with their plates."""
    unfitted, people = np.zeros((2, len(KINETICS), SAMPLES)), builtin_subjects()
    trials = [trial_of(each.full, each.full.record(), unfitted) for each in found]
    everybody = learned_from(found[0].known, people)
    return laboratories_of(trials, [each.laboratory for each in found], everybody)


def _expected(known: Subject) -> GaitRecord:
    """What is expected of a person before markers say anything of forces and angles."""
    people = builtin_subjects()
    record = with_others_kinetics(known, people)
    unfitted = np.zeros((2, len(KINETICS), SAMPLES))
    trial = trial_of(known, record, unfitted)
    found = estimate(trial, learned_from(known, people), angles=False)
    usual = expected_record(known, other_people(known, people))
    return with_kinetics(usual, known, found.expected + found.regressed)


def _person(of: ImportedElsewhere, beside: Elsewhere) -> PersonElsewhere:
    people, contact = builtin_subjects(), load_configuration().contact
    full, known = of.full, of.known
    usual = known_record(known, RecordSettings(), people)
    found = of_known(usual, known, scale_subject(known).model, contact, beside)
    one = units(known.leg_length_m)
    vertical = GRAVITY * found.expected[:, VERTICAL]
    kinetics = one * found.kinetics
    for name, arm in OFFSETS.items():
        kinetics[:, KINETICS.index(("moments", name))] -= arm * vertical
    line = on_the_line(other_people(known, people), dimensionless_speed(known))
    return PersonElsewhere(
        of.laboratory,
        one * kinetics_of(normal_form(full.record(), full.leg_length_m)),
        kinetics,
        one * kinetics_of(line),
        vertical,
        one * found.half_width / WIDER_WITH_TOTAL,
    )


def _by_laboratory(
    people: Sequence[PersonElsewhere] | Sequence[ImportedElsewhere], values: Array
) -> Array:
    """Mean of `values` (people, ...), every laboratory as heavy as another."""
    names = np.array([each.laboratory for each in people])
    return np.mean([values[names == name].mean(axis=0) for name in dict.fromkeys(names)], axis=0)


def arms(people: Sequence[PersonElsewhere]) -> dict[str, Array]:
    """(people,) m, arm of the vertical force by which each moment of `OFFSETS` is off."""
    return {
        name: np.array(
            [
                np.sum((each.truth - each.found)[:, i] * each.vertical) / np.sum(each.vertical**2)
                for each in people
            ]
        )
        for name in OFFSETS
        for i in (KINETICS.index(("moments", name)),)
    }


def wider(off: Array, laboratories: Array) -> Array:
    """(7,) factors within which 90 of 100 points of `off` (people, 2, 7, n) are, every laboratory
    as heavy as another; forces in stance, as a foot in the air has none and that is known.
    """
    found = []
    for i in range(off.shape[2]):
        here = [off[laboratories == name][:, :, i].ravel() for name in np.unique(laboratories)]
        points = [each[each > 0.0] for each in here]
        weight = np.concatenate([np.full(len(each), 1.0 / len(each)) for each in points])
        values = np.concatenate(points)
        order = np.argsort(values)
        share = np.cumsum(weight[order]) / weight.sum()
        found.append(values[order][np.searchsorted(share, 0.9)])
    return np.array(found)


def left_out(people: Sequence[PersonElsewhere]) -> tuple[Array, Array]:
    """(people, 2, 7, n) kinetics by what all other laboratories differ by, and half bands
    (people, 7, n) as wide as these need.
    """
    names = np.array([each.laboratory for each in people])
    moved = np.array([each.found for each in people])
    lengths = arms(people)
    for at, each in enumerate(people):
        others = np.flatnonzero(names != each.laboratory)
        kept = [people[i] for i in others]
        for name, values in lengths.items():
            arm = _by_laboratory(kept, values[others])
            moved[at, :, KINETICS.index(("moments", name))] += arm * each.vertical
    truth, width = (np.array([getattr(each, a) for each in people]) for a in ("truth", "width"))
    off = np.abs(moved - truth) / np.maximum(width[:, None], 1e-9)
    bands = [
        width[at] * wider(off[names != each.laboratory], names[names != each.laboratory])[:, None]
        for at, each in enumerate(people)
    ]
    return moved, np.array(bands)


@claims.measured("public")
def laboratories(given: claims.Given) -> list[Claim]:
    """Kinetics of people of a laboratory that is left out, from markers alone: RMS errors, skill
    against a line through the ten of WBDS, and how many points the bands hold.
    """
    found = imported(given.public)
    people, differ = [], apart(found)
    late = np.array([total_late(each) for each in found])
    for each in found:
        kept = [i for i, other in enumerate(found) if other.laboratory != each.laboratory]
        others = [found[i] for i in kept]
        forces = ForcesElsewhere(
            pooled(others, [differ[i] for i in kept]), float(_by_laboratory(others, late[kept]))
        )
        people.append(_person(each, Elsewhere(forces, regressed_from(others))))
    moved, bands = left_out(people)
    truth, line = (np.array([getattr(each, a) for each in people]) for a in ("truth", "line"))
    scale = np.array([100.0 if kind == "forces" else 1.0 for kind, _ in KINETICS])
    ours, guess = (
        scale * np.sqrt(np.mean(np.square(each - truth), axis=3)).mean(axis=1)
        for each in (moved, line)
    )
    rows, count, names = [], len(people), np.array([each.laboratory for each in people])
    groups = {
        "one laboratory left out, markers alone": names != NO_STANDING,
        "markers alone, without a standing trial": names == NO_STANDING,
    }
    for (of, here), (kind, name) in product(groups.items(), SKILLS):
        i = KINETICS.index((kind, name))
        noun = f"{MOMENTS[name]} moment" if kind == "moments" else f"{name} force"
        unit, size = "Nm/kg" if kind == "moments" else "% BW", int(here.sum())
        those = [each for each, one in zip(people, here, strict=True) if one]
        for which, errors in (("RMS", ours), ("RMS of a line", guess)):
            mean = float(_by_laboratory(those, errors[here, i]))
            rows.append(Claim(f"{of}: {noun}, {which}", mean, unit, size))
        low, high = skill_interval(ours[here, i], guess[here, i])
        skill = float(1.0 - ours[here, i].mean() / guess[here, i].mean())
        print(f"{of}, {noun}: skill over people {skill:.2f} ({low:.2f} to {high:.2f})", flush=True)
        rows.append(Claim(f"{of}: {noun}, skill against a line", skill, "1", size))
    for name, values in arms(people).items():
        print(name, {p.laboratory: round(1000 * v) for p, v in zip(people, values, strict=True)})
        mean = 1000.0 * float(_by_laboratory(people, values))
        rows.append(Claim(f"{MOMENTS[name]} of imports: arm beside WBDS's", mean, "mm", count))
    print("late:", {p.laboratory: round(1000 * s) for p, s in zip(people, late, strict=True)})
    what = "total force on plates later than by markers, beside the angles"
    rows.append(Claim(what, 1000.0 * float(_by_laboratory(people, late)), "ms", count))
    missed = np.abs(moved - truth)
    held = np.where(missed > 0.0, missed <= bands[:, None], np.nan)  # without feet in the air
    inside = np.nanmean(held, axis=(1, 2, 3))
    by_kind = _by_laboratory(people, np.nanmean(held, axis=(1, 3)))
    print("held:", dict(zip([name for _, name in KINETICS], by_kind.round(2), strict=True)))
    what = "one laboratory left out, markers alone: points within the band of 90 %"
    rows.append(Claim(what, 100.0 * float(_by_laboratory(people, inside)), "%", count))
    every = np.abs(moved - truth) / np.array([np.maximum(e.width, 1e-9) for e in people])[:, None]
    print("wider:", wider(every, names).round(2).tolist(), "shipped:", WIDER_WITH_TOTAL[:, 0])
    width = float(np.median(2.0 * np.median(bands[:, : len(MOMENTS) + 1], axis=2)))
    what = "one laboratory left out, markers alone: width of the bands of moments, median"
    return [*rows, Claim(what, width, "Nm/kg", count)]


@claims.measured("public")
def strikes(given: claims.Given) -> list[Claim]:
    """Heel strikes of markers alone against the same recordings' plates. A laboratory's are moved
    by what the others need in the mean, as `LANDS_BEFORE` is all laboratories' mean.
    """
    processing, off = load_configuration().processing, dict[str, list[float]]()
    for recording in [*recordings(given.public), TREADMILL]:
        with tempfile.TemporaryDirectory() as folder:
            try:
                request = _request(recording, given.public, Path(folder))
                session = read_session(request, processing)
            except GaitvalError as error:
                print(f"{recording['name']}: left out ({error})"[:200], flush=True)
                continue
            landmarks = session.marker_set.landmarks
            for walk in session.walking:
                plates, _ = zero_plates(walk, landmarks=landmarks)
                forces, _ = assign_forces(plates, processing, landmarks=landmarks)
                seen = marker_events(walk, landmarks=landmarks)
                for event in force_events(forces, processing):
                    near = [
                        each.time - event.time
                        for each in seen
                        if (each.side, each.kind)
                        == (event.side, "heel_strike")
                        == (each.side, event.kind)
                    ]
                    if near and abs(min(near, key=abs)) < EDGE_S:
                        here = off.setdefault(recording["laboratory"], [])
                        here.append(1000.0 * min(near, key=abs))
    means = {name: float(np.mean(values)) for name, values in off.items()}
    print("means, ms:", {name: round(value, 1) for name, value in means.items()}, flush=True)
    left = {
        name: np.array(values) - np.mean([mean for other, mean in means.items() if other != name])
        for name, values in off.items()
    }
    sizes = np.abs(np.concatenate([*left.values()]))
    what = "heel strikes by markers alone, public sessions"
    return [
        Claim(f"{what}, median", float(np.median(sizes)), "ms", len(sizes)),
        Claim(f"{what}, 95 %", float(np.percentile(sizes, 95.0)), "ms", len(sizes)),
    ]
