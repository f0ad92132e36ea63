"""The estimate of a run: what its walk is to be, and its curves as a table and on a page, in the
folder `estimate` of the run.

A study of a person whose moments and forces it did not know makes it before and after the walk;
`gaitval estimate` makes it of a finished run.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.io.artefacts import parse_toml, read_json, value_hash, write_json, write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval.arrays import Array
from gaitval.configuration import ContactSettings
from gaitval.coordinates import SIDES
from gaitval.errors import ArtefactError, ConfigurationError
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.cycle_curves import JOINT_MOMENTS
from gaitval.gait.events import EVENTS
from gaitval.gait.insoles import InsoleForces
from gaitval.gait.record import GaitRecord
from gaitval.metrics.reference_curves import reference_curves
from gaitval.metrics.results import read_metrics
from gaitval.model.body import BodyModel
from gaitval.model.urdf import read_urdf
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.page import write_html
from gaitval.study.stage import Run, Stage
from gaitval.study.stage_versions import STAGE_VERSIONS
from gaitval.subjects.prediction.deviations import (
    KINETICS,
    fit_of,
    kinetics_of,
    learned_from,
    trial_of,
    units,
)
from gaitval.subjects.prediction.estimate import (
    OFFSETS,
    WIDER_ELSEWHERE,
    WIDER_WITH_TOTAL,
    Estimate,
    about_imported_joints,
    estimate,
)
from gaitval.subjects.prediction.force_split import ForcesElsewhere, with_total
from gaitval.subjects.prediction.insoles import with_insoles
from gaitval.subjects.prediction.known import KINEMATIC_ACCURACY, KnownRecord, is_predicted
from gaitval.subjects.prediction.laboratories import Laboratories
from gaitval.subjects.prediction.normal_form import normal_form, record_from
from gaitval.subjects.prediction.seen import (
    at_own_contacts,
    is_of_the_laboratory,
    knows_contacts,
    knows_total,
    speeds_beyond,
)
from gaitval.subjects.subject import Subject
from gaitval.subjects.subject_file import builtin_subjects
from gaitval.walk.reference.dynamic_fit import consistent_reference

FOLDER: Final = "estimate"
TABLE: Final = f"{FOLDER}/estimate.csv"
INSOLES_KEPT: Final = f"{FOLDER}/insoles.json"
"""What insoles said of this walk, where `gaitval estimate` was given any."""
_WALK: Final = "of_walk"
PAGE: Final = f"{FOLDER}/estimate.html"
_Row = tuple[object, ...]
ESTIMATE_ACCURACY: Final = KINEMATIC_ACCURACY._replace(
    sagittal=1.5 * KINEMATIC_ACCURACY.sagittal,
    frontal=1.5 * KINEMATIC_ACCURACY.frontal,
    rotation=1.5 * KINEMATIC_ACCURACY.rotation,
    pelvis=1.5 * KINEMATIC_ACCURACY.pelvis,
    moment=0.02,
    adduction_moment=0.03,
    forward_force=0.0027,
    sideways_force=0.0021,
    vertical_force=0.009,
    hip_centre=RecordAccuracy().hip_centre,
)
"""Of an estimate: about a quarter of how far estimates of others are off in each quantity. They are
nearer to the truth than the kinetics of a motion within a degree of the recorded angles, so the
angles give way. Its moments are about the hip centres of the people that it is learned from, so
these are looked for. Sets that were tried: docs/what-we-tried.md."""
_UNITS: Final = {"moments": "Nm/kg", "forces": "% BW"}
_JOINTS: Final = {"hip_flexion": "hip", "knee_angle": "knee", "ankle_angle": "ankle"}
_COLOURS: Final = {"right": "#0072b2", "left": "#d55e00"}


class Elsewhere(NamedTuple):
    """Of other laboratories than the built-in people's: what is known of their forces, and what a
    regression has of their people.
    """

    forces: ForcesElsewhere
    people: Laboratories


def stage(run: Run) -> Stage:
    """Known record and reference of `run`, and insoles that it was given → the estimate's table and
    page.
    """
    given = (INSOLES_KEPT,) if (run.folder / INSOLES_KEPT).is_file() else ()
    return Stage(
        "estimate",
        lambda: write(run),
        version=STAGE_VERSIONS["estimate"],
        inputs=("subject.toml", "model.urdf", "metrics.json", *given),
        outputs=(TABLE, PAGE),
        values={
            **run.sections("contact", "record"),
        },
    )


def check(run: Run) -> None:
    """Raise ConfigurationError if `run` knew the moments and forces of the person."""
    if not run.knew_no_kinetics:
        raise ConfigurationError(
            f"{run.folder}: this run knew the person's moments and forces, so there is nothing to "
            "estimate. An estimate is for a person without force plates: give the folder of such a "
            "run, or run this person with --use kinematics."
        )


def keep_insoles(run: Run, insoles: InsoleForces) -> None:
    """Keep what `insoles` say in the folder of `run`, and of which walk: its estimates have it from
    now on, until another recording is in the folder.
    """
    (run.folder / FOLDER).mkdir(exist_ok=True)
    kept = insoles._replace(vertical=insoles.vertical.round(6).tolist())
    write_json(run.folder / INSOLES_KEPT, kept._asdict() | {_WALK: _walk_of(run.subject)})


def _walk_of(subject: Subject) -> str:
    """A hash of the recorded walk of a `subject`, and of the mass that forces are divided by; with
    the digits of its file, so that it is that of the subject read from there, too.
    """
    stored = parse_toml(subject.to_toml(), subject.identifier, ArtefactError)
    names = ("mass_kg", "trial", "walking_speed_m_s", "stride_time_s", "left_phase", "gait")
    return value_hash({name: stored.get(name) for name in names})


def kept_insoles(run: Run) -> InsoleForces | None:
    """The insoles that are kept in the folder of `run`; None without, or if they are of another
    walk than that of its subject, which is said.
    """
    path = run.folder / INSOLES_KEPT
    if not path.is_file():
        return None
    try:
        found = read_json(path)
        walk = found.pop(_WALK, None)
        kept = InsoleForces(**found)
        vertical = np.array(kept.vertical, float).reshape(2, -1)
        gain, error, time = float(kept.gain), float(kept.error), float(kept.stride_time)
    except (AttributeError, TypeError, ValueError):
        raise ArtefactError(
            f"{path}: not what gaitval wrote there; it was edited. Delete it, and give the insoles "
            "again with `gaitval estimate --insoles`."
        ) from None
    if walk != _walk_of(run.subject):
        run.observer.say(
            f"{path}: not used. These insoles ({kept.source}) were given "
            + ("for another recording than" if walk else "to an earlier gaitval, perhaps not for")
            + " the one that is in this folder now. Give this walk's with "
            "`gaitval estimate --insoles`, or delete the file."
        )
        return None
    return kept._replace(vertical=vertical, gain=gain, error=error, stride_time=time)


def of_run(run: Run, model: BodyModel | None = None) -> Estimate:
    """The estimate of the kinetics of `run`, by the scaled `model` or that of its folder; raises as
    `check`.
    """
    check(run)
    model = model or read_urdf(run.folder / "model.urdf")
    return of_known(run.known_record(), run.subject, model, run.configuration.contact)


def of_known(
    known: KnownRecord,
    subject: Subject,
    model: BodyModel,
    contact: ContactSettings,
    laboratories: Elsewhere | None = None,
) -> Estimate:
    """The estimate of the kinetics of `subject`, of whom `known` has the angles and what kinetics
    are expected of anybody; the scaled `model` walks on the ground of `contact`. `laboratories`:
    else those that come with the package.
    """
    forces, those = (None, None) if laboratories is None else laboratories
    (record, accuracy), others = known, builtin_subjects()
    at_home = is_of_the_laboratory(subject)
    own = with_total(at_own_contacts(record, subject), subject, forces)
    reference = consistent_reference(own, model, contact, accuracy)
    fit = fit_of(reference_curves(reference, model.mass, own.left_phase), own, subject.leg_length_m)
    trial, people = trial_of(subject, record, fit), learned_from(subject, others)
    found = estimate(trial, people, angles=at_home, laboratories=those)
    if _is_of_an_import_elsewhere(subject):
        found = about_imported_joints(found)
    return found if own is record else _seen(found, record, subject, forces)


def _seen(
    found: Estimate, record: GaitRecord, subject: Subject, forces: ForcesElsewhere | None
) -> Estimate:
    """The estimate with what markers say of the forces in what is expected and regressed."""
    there = with_kinetics(record, subject, found.expected + found.regressed)
    there = at_own_contacts(there, subject)
    there = with_total(there, subject, forces, angles=not found.looked_at_angles)
    kinetics = kinetics_of(normal_form(there, subject.leg_length_m))
    weights, wide = found.weights.copy(), found.half_width
    if knows_total(subject):  # is what mechanics says of the forces
        weights[[kind == "forces" for kind, _ in KINETICS]] = 0.0
        if not found.looked_at_angles:
            wide = wide / WIDER_ELSEWHERE * WIDER_WITH_TOTAL
    kinetics = kinetics + weights * found.own
    return replace(found, kinetics=kinetics, weights=weights, half_width=wide)


def target_record(run: Run, model: BodyModel | None = None) -> KnownRecord:
    """What the walk of `run` is to be: the known angles with the estimate's kinetics, by `model` as
    `of_run`. At another speed than the recorded one it is what the run knows.
    """
    if is_predicted(run.configuration.record):
        return run.known_record()
    known = at_own_contacts(run.known_record().record, run.subject)
    return KnownRecord(
        with_kinetics(known, run.subject, of_run(run, model).kinetics), ESTIMATE_ACCURACY
    )


def with_kinetics(known: GaitRecord, subject: Subject, kinetics: Array) -> GaitRecord:
    """The record that is `known` of a `subject`, with other `kinetics`, as `Estimate` has them."""
    moments, forces = np.split(kinetics, [len(JOINT_MOMENTS)], axis=1)
    gait = replace(
        normal_form(known, subject.leg_length_m),
        moments=moments.reshape(-1, moments.shape[-1]),
        forces=forces.transpose(0, 2, 1),
    )
    other = record_from(gait, subject.leg_length_m)
    return replace(known, moments=other.moments, forces=other.forces)


def write(run: Run) -> Estimate:
    """Write `TABLE` and `PAGE` into the folder of `run`; the errors are those of `of_run`."""
    found, insoles = of_run(run), kept_insoles(run)
    if insoles is not None:
        found = with_insoles(found, insoles)
    curves = read_metrics(run.folder).walk.curves
    walked = [
        [
            [np.nan if v is None else v for v in getattr(curves, kind)[f"{name}_{side}"].mean or ()]
            for kind, name in KINETICS
        ]
        for side in "rl"
    ]
    rows = table(found, walked, run.subject.leg_length_m)
    (run.folder / FOLDER).mkdir(exist_ok=True)
    write_text(run.folder / TABLE, csv_text(rows))
    widths = units(run.subject.leg_length_m) * found.half_width
    typical = np.sqrt(np.mean(widths**2, axis=1))
    beyond = speeds_beyond(run.subject)
    if beyond is not None:
        run.observer.say(
            f"The estimate is learned from walks at {beyond[0]:.2f} to {beyond[1]:.2f} m/s on legs "
            f"of this length. This one is at {run.subject.walking_speed_m_s:.2f} m/s: its bands "
            "are of those speeds, and do not say how far it is off."
        )
    context = {
        "beyond": beyond,
        "speed": run.subject.walking_speed_m_s,
        "name": run.subject.identifier,
        "looked_at_angles": found.looked_at_angles,
        "contacts": knows_contacts(run.subject),
        "total": knows_total(run.subject),
        "insoles": None if insoles is None else insoles._asdict(),
        "rows": [
            (
                _title(kind, name),
                float(np.mean(found.weights[i])),
                _scale(kind) * typical[i],
                _UNITS[kind],
            )
            for i, (kind, name) in enumerate(KINETICS)
        ],
        "landing_ms": round(1000.0 * EVENTS.landing_error),
        "joints": {
            joint: abs(round(1000.0 * OFFSETS[name]))
            for name, joint in (("hip_flexion", "hip"), ("knee_angle", "knee"))
        }
        if _is_of_an_import_elsewhere(run.subject)
        else None,
        "drawings": {"estimate": partial(_draw, rows)},
    }
    write_html(run.folder / FOLDER, "estimate", "estimate.html.j2", context)
    return found


def _is_of_an_import_elsewhere(subject: Subject) -> bool:
    # An import puts joints where every import does; whose curves were given, where is not known.
    return not is_of_the_laboratory(subject) and subject.gait.total_force is not None


def table(
    found: Estimate, walked: Sequence[Sequence[Sequence[float]]], leg_length: float
) -> list[_Row]:
    """A header, and a row for each quantity of what was `found`, side and percent of that side's
    gait cycle. `walked` has, of each side and of `KINETICS`, the 101 points of the walk in the
    units of reports; none where it made no gait cycle. `leg_length` is the person's, m.
    """
    one = units(leg_length)[:, 0]
    rows: list[_Row] = [
        ("quantity", "side", "unit", "percent", "estimate", "plus_minus", "expected", "walk")
    ]
    for i, (kind, name) in enumerate(KINETICS):
        for j, side in enumerate(SIDES):
            for percent, values in enumerate(
                zip(found.kinetics[j, i], found.half_width[i], found.expected[j, i], strict=True)
            ):
                walk = walked[j][i][percent] if len(walked[j][i]) else np.nan
                numbers = [*(_scale(kind) * one[i] * value for value in values), walk]
                rows.append(
                    (
                        _title(kind, name),
                        side,
                        _UNITS[kind],
                        percent,
                        *(f"{v:.5g}" for v in numbers),
                    )
                )
    return rows


def _title(kind: str, name: str) -> str:
    return f"{_JOINTS.get(name, name.replace('_', ' '))} {kind.removesuffix('s')}"


def _scale(kind: str) -> float:
    return 100.0 if kind == "forces" else 1.0


def _draw(rows: Sequence[_Row]) -> str:
    """A panel for each quantity, both sides, as SVG: band and estimate, expectation, walk."""
    with new_figure(7.2) as figure:
        panels = figure.subplots(3, 3).ravel()
        for i, axes in enumerate(panels):
            if i >= len(KINETICS):
                axes.set_axis_off()
                continue
            title, unit = _title(*KINETICS[i]), _UNITS[KINETICS[i][0]]
            for side in SIDES:
                values = np.array(
                    [row[3:] for row in rows if row[:2] == (title, side)], dtype=float
                ).T  # percent, estimate, ±, expected, walk
                percent, mean, width, usual, walk = values
                colour, dashed = _COLOURS[side], "-" if side == "right" else "--"
                axes.fill_between(
                    percent, mean - width, mean + width, color=colour, alpha=0.15, lw=0
                )
                axes.plot(percent, mean, dashed, color=colour, label=f"estimate, {side}")
                axes.plot(percent, walk, dashed, color="#777777", lw=0.7, label=f"walk, {side}")
            axes.plot(percent, usual, ":", color="black", lw=0.9, label="expected of anybody")
            axes.set_title(f"{title}, {unit}")
            axes.set_xlim(0.0, 100.0)
            if i + 3 >= len(KINETICS):  # the lowest of its column
                axes.set_xlabel("% of the gait cycle")
        handles, names = panels[0].get_legend_handles_labels()
        panels[-1].legend(handles, names, loc="center")
        return svg(figure, "estimate")
