"""How near the fitted walks come to the record, and at what price: the ten stored baselines.

Reads `reports/Snn/baseline/metrics.json`. Means are over ten people and both sides, against the
record corrected for the plates. What is held out (unseen speeds, kinetics from kinematics) is of
the runs that `experiments/held_out_runs.py` keeps.
"""

import csv
import tempfile
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import evidence
from evidence.fitted import (
    MOMENTS,
    Stored,
    ankles,
    corrected,
    skill_of,
    stored_baselines,
    values_of,
)
from evidence.held_out import mean, rmse_of, split_by_speed, stored
from evidence.marked_table import with_table
from evidence.skill_interval import skill_interval
from gaitval.arrays import Array
from gaitval.artefacts import write_text
from gaitval.configuration import RecordSettings, load_configuration
from gaitval.constants import GRAVITY
from gaitval.datasets.stored_gait import StanceFraction
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.errors import RecordError
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.metrics.baselines import others_line
from gaitval.metrics.comparison import rms
from gaitval.metrics.groups import GROUPS, group_rows
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.results import Metrics, metrics_from
from gaitval.prediction.deviations import (
    KINETICS,
    Trial,
    kinetics_of,
    kinetics_of_curves,
    learned_from,
    stored_fits,
    trial_of,
    units,
)
from gaitval.prediction.estimate import WIDER_ELSEWHERE, Estimate, estimate
from gaitval.prediction.known import told
from gaitval.prediction.normal_form import SAMPLES, NormalForm, moment_units, normal_form
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.servo import closed_cycle
from gaitval.study.estimate_stage import of_known

BOUNDS = {
    "sagittal angles": (1.0, 1.15),
    "moments": (0.025, 0.032),
    "vertical force": (1.3, 1.6),
    "fore-aft force": (0.6, 0.75),
    "medial force": (0.45, 0.6),
}
"""Goal and must of each of `GROUPS`, in its unit."""
PRICES = {
    "force_ringing": ("ringing of the vertical force, 12-25 Hz, RMS, mean", "% BW", 1.5, 2.0),
    "shoulder_moment_peak": ("shoulder moment, peak, mean", "Nm", 12.0, 15.0),
}
OWN_LINE = "line through two trials"
SKILLS = {
    ("forces", "vertical"): (0.25, 0.12),
    ("forces", "forward"): (0.2, 0.08),
    ("forces", "medial"): (0.35, 0.2),
    ("moments", "hip_flexion"): (0.3, 0.15),
    ("moments", "knee_angle"): (0.4, 0.32),
    ("moments", "ankle_angle"): (0.3, 0.2),
}
"""Goal and must of the skill of kinetics from kinematics against nine others, by curve."""
BOVI_SPEEDS = {
    "Very Slow": "XS", "Slow": "S", "Medium": "M", "Fast": "L", "Free": "Natural"
}  # fmt: skip
BOVI_ANGLES = (
    (1, "Hip Flex/Extension"),
    (1, "Hip Ad/Abduction"),
    (1, "Hip Int/External Rotation"),
    (1, "Knee Flex/Extension"),
    (1, "Ankle Dorsi/Plantarflexion"),
    (0, "Ankle Dorsi/Plantarflexion"),  # in place of subtalar angles, which are not looked at
    (-1, "Pelvic Ant/Posterior Tilt"),
    (1, "Pelvic Up/Down Obliquity"),
    (1, "Pelvic Int/External Rotation"),
)
"""Sign and name in Bovi2011.csv of the angles of a leg in the order of `REQUIRED_ANGLES`."""
BOVI_MOMENTS = (
    "Hip Ext/Flexion", "Hip Ab/Adduction", "Knee Ext/Flexion", "Ankle Dorsi/Plantarflexion"
)  # fmt: skip
BOVI_FORCES = ("Anterior/Posterior", "Medio_Lateral", "Vertical")
NEAR = 0.2
"""Change of speed up to which the nearest trial is copied."""
FROM = evidence.option(
    "--from", type=Path, dest="clones", required=True, help="folder of the clones, OWNER+NAME"
)
PAGE = evidence.ROOT / "docs" / "how-to" / "estimate.md"
MEASURES = {
    "unseen speed*": {
        "code": (
            "@walk",
            "@identified",
            "@errors",
            "gaitval/prediction/*.py",
            "experiments/held_out_runs.py:walked,holdout,store",
            "evidence/held_out.py:mean,rmse_of,split_by_speed,stored",
            "evidence/fit.py:unseen,predicted_errors",
        ),
        "data": ("reports/general/policy.safetensors",),
        "results": ("reports/held_out/holdout/*.json",),
        "allowed": 130,
        "why": "the URDF is read by Python's XML, scaling.csv written without pandas, and speeds "
        "far below every trial are predicted otherwise: bodies and known records keep their bits",
    },
    "kinetics from kinematics*": {
        "code": (
            "@walk",
            "@identified",
            "@errors",
            "gaitval/prediction/*.py",
            "gaitval/study/stages.py:_reference_of",
            "gaitval/prediction/*.py",
            "experiments/held_out_runs.py:walked,kinematics,store",
            "evidence/held_out.py:mean,rmse_of,split_by_speed,stored",
            "evidence/fit.py:kinematics,lower_end,SKILLS",
            "evidence/skill_interval.py",
        ),
        "data": ("reports/general/policy.safetensors", "gaitval/prediction/fits.json"),
        "results": ("reports/held_out/kinematics/*.json",),
        "allowed": 130,
        "why": "the URDF is read by Python's XML, scaling.csv written without pandas, and speeds "
        "far below every trial are predicted otherwise: bodies and known records keep their bits",
    },
    "another laboratory's means*": {
        "code": (
            "gaitval/prediction/normal_form.py",
            "gaitval/prediction/population.py",
            "gaitval/prediction/body.py",
            "gaitval/prediction/deviations.py",
            "gaitval/prediction/estimate.py",
            "evidence/fit.py:laboratory,_means_elsewhere",
        ),
    },
    "recordings elsewhere without plates*": {
        "code": (
            "@reference",
            "gaitval/prediction/*.py",
            "gaitval/session/subject.py:total_force",
            "gaitval/metrics/reference_curves.py",
            "gaitval/prediction/*.py",
            "evidence/fit.py:seen,_wider,_without_plates,_subject_of,_without_markers_say,lower_end,SKILLS",
            "evidence/skill_interval.py",
        ),
        "data": ("gaitval/prediction/fits.json",),
        "allowed": 30,
        "why": "both sides of each ratio are of the same imports",
    },
    "estimate of kinetics from kinematics*": {
        "code": (
            "@reference",
            "gaitval/prediction/*.py",
            "gaitval/metrics/reference_curves.py",
            "gaitval/prediction/body.py",
            "gaitval/prediction/deviations.py",
            "gaitval/prediction/estimate.py",
            "experiments/estimate_fits.py",
            "gaitval/metrics/baselines.py",
            "evidence/fit.py:estimates,_estimate_of,lower_end,SKILLS",
            "evidence/skill_interval.py",
        ),
        "data": ("gaitval/prediction/fits.json",),
    },
    "left-right difference *": {
        "code": (
            "gaitval/datasets/subject.py:Subject",
            "gaitval/gait/record.py",
            "evidence/fitted.py:ankles",
        ),
    },
    "*": {
        "code": (
            "gaitval/metrics/groups.py:GROUPS,group_rows,group_curves",
            "gaitval/prediction/speed_line.py:dimensionless_speed",
            "evidence/fitted.py:skill_of,values_of,corrected,stored_baselines,MOMENTS",
            "evidence/fit.py:baselines,_errors,_skills,_own_line,_prices,BOUNDS,PRICES",
        ),
        "data": ("reports/S??/baseline/metrics.json",),
    },
}
"""What the rows depend on; see evidence/stale.py."""


@evidence.measurement()
def baselines(_: Namespace) -> list[evidence.Row]:
    """Errors, skills, goals and side effects of the fitted walks of the ten stored baselines."""
    stored = stored_baselines()
    metrics = [metrics_from(each, f"S{person:02d}") for person, each in enumerate(stored, 1)]
    return [*_errors(metrics), *_skills(stored), _own_line(metrics[4]), *_prices(stored)]


def _errors(stored: list[Metrics]) -> Iterator[evidence.Row]:
    by_person = [{row.group: row for row in group_rows(each)} for each in stored]
    for group, (goal, must) in BOUNDS.items():
        rows = [found[group] for found in by_person]
        mean = float(np.mean([row.walked for row in rows if row.walked is not None]))
        count = 2 * len(GROUPS[group][1]) * len(rows)
        yield evidence.Row(
            f"fitted walk: {group}, RMSE", mean, rows[0].unit, "<=", goal, must, count
        )


def _skills(stored: list[Stored]) -> Iterator[evidence.Row]:
    for name, joint in MOMENTS.items():
        value = skill_of(stored, "moments", name, corrected)
        what = f"fitted walk: skill against nine others, {joint} moment"
        yield evidence.Row(what, value, "1", ">=", 0.75, 0.65, 2 * len(stored))


def _own_line(metrics: Metrics) -> evidence.Row:
    skills = [row.skills()[OWN_LINE] for row in group_rows(metrics)]
    better = sum(skill is not None and skill > 0.0 for skill in skills)
    what = "fitted S05: groups of curves nearer than the line through two own other trials"
    return evidence.Row(what, better, "groups", ">=", 5, 2, len(BOUNDS))


def _prices(stored: list[Stored]) -> Iterator[evidence.Row]:
    for measure, (what, unit, goal, must) in PRICES.items():
        values = values_of(stored, measure)
        yield evidence.Row(what, float(np.mean(values)), unit, "<=", goal, must, len(values))
    yield replace(ankles(), must=12.0)
    reached = sum(each["summary"]["goals_reached"] for each in stored)
    goals = sum(each["summary"]["goals"] for each in stored)
    yield evidence.Row("goals of acceptance", reached, "goals", ">=", 438, 432, goals)


@evidence.measurement()
def unseen(_: Namespace) -> list[evidence.Row]:
    """Walks of a held-out trial: their errors over those of the prediction without physics that
    they follow, and their skill against the nearest trial.
    """
    found = stored("holdout")
    before = {name: predicted_errors(*name.split("-")) for name in found}
    rows = []
    for group, (kind, names) in GROUPS.items():
        walked = np.mean([mean(each["errors"][kind], names) for each in found.values()])
        predicted = np.mean([mean(before[name][kind], names) for name in found])
        what = f"unseen speed: {group}, error of the walk over that of the statistical prediction"
        value = float(walked / predicted)
        rows.append(evidence.Row(what, value, "1", "<=", 1.05, 1.2, len(found)))
    kind, names = GROUPS["moments"]
    near, _ = split_by_speed(found, NEAR)
    ours = np.mean([mean(each["errors"][kind], names) for each in near.values()])
    copied = np.mean(
        [mean(rmse_of(each, "nearest trial copied")[kind], names) for each in near.values()]
    )
    what = "unseen speed within 20 %: moments, skill against the nearest trial copied"
    value = float(1.0 - ours / copied)
    return [*rows, evidence.Row(what, value, "1", ">=", 0.3, 0.1, len(near))]


def predicted_errors(person: str, trial: str) -> dict[str, dict[str, float]]:
    """RMSE of what other trials predict of one, without a model."""
    subject = load_subject(person)
    known = told(subject, RecordSettings(holdout=trial), builtin_subjects()).record
    truth = by_kind(recorded_curves(subject.on_trial(trial).record()))
    return {
        kind: {name: rms(curve - truth[kind][name]) for name, curve in curves.items()}
        for kind, curves in by_kind(recorded_curves(known)).items()
    }


@evidence.measurement()
def kinematics(_: Namespace) -> list[evidence.Row]:
    """Kinetics of walks that know angles only: skill against nine others, and against what is
    expected of anybody at this speed, with an interval over people.
    """
    found = stored("kinematics")
    settings, rows, ends = RecordSettings(use="kinematics"), [], []
    expected = []
    for person in found:
        subject = load_subject(person)
        known = by_kind(recorded_curves(told(subject, settings, builtin_subjects()).record))
        expected.append((known, by_kind(recorded_curves(subject.record()))))
    for (kind, name), (goal, must) in SKILLS.items():
        noun = f"{MOMENTS[name]} moment" if kind == "moments" else f"{name} force"
        ours = np.array([mean(each["errors"][kind], (name,)) for each in found.values()])
        line = [
            mean(rmse_of(each, "line through others")[kind], (name,)) for each in found.values()
        ]
        guess = np.array(
            [
                np.mean(
                    [rms(known[kind][f"{name}_{s}"] - truth[kind][f"{name}_{s}"]) for s in "rl"]
                )
                for known, truth in expected
            ]
        )
        what = f"kinetics from kinematics: skill against nine others, {noun}"
        skill = float(1.0 - ours.mean() / np.mean(line))
        rows.append(evidence.Row(what, skill, "1", ">=", goal, must, len(ours)))
        ends.append(lower_end(ours, guess))
        what = f"kinetics from kinematics: skill against the expectation, 5 % point, {noun}"
        rows.append(evidence.Row(what, ends[-1], "1", ">=", 0.0, -0.03, len(ours)))
    what = "kinetics from kinematics: curves whose skill against the expectation is above 0 at 5 %"
    above = sum(end > 0.0 for end in ends)
    return [*rows, evidence.Row(what, above, "curves", ">=", 6, 4, len(ends))]


@evidence.measurement()
def estimates(_: Namespace) -> list[evidence.Row]:
    """Kinetics of people of whom angles only are known, estimated: as `kinematics`, and with the
    weights that would have been best for all ten; how many points are within the bands; and
    without what angles say, as for another laboratory.
    """
    people = builtin_subjects()
    found = [each.identifier for each in people]
    ours = [_estimate_of(person) for person in found]
    plain = [_estimate_of(person, angles=False) for person in found]
    truth = [kinetics_of(normal_form(each.record(), each.leg_length_m)) for each in people]
    drawn = [others_line(each, people) for each in people]
    legs = [each.leg_length_m for each in people]
    lines = [kinetics_of_curves(d.curves, leg) for d, leg in zip(drawn, legs, strict=True) if d]
    rows, ends, plain_ends, inside = [], [], [], []
    for (kind, name), (goal, must) in SKILLS.items():
        noun = f"{MOMENTS[name]} moment" if kind == "moments" else f"{name} force"
        i, scale = KINETICS.index((kind, name)), 100.0 if kind == "forces" else 1.0

        def error(curves: list[Array], i: int = i, scale: float = scale) -> Array:
            pairs = zip(curves, truth, legs, strict=True)
            return np.array(
                [
                    units(leg)[i, 0]
                    * np.mean([scale * rms(closed_cycle(c[s, i] - t[s, i])) for s in (0, 1)])
                    for c, t, leg in pairs
                ]
            )

        line = error(lines)
        errors, guess = (
            error([each.kinetics for each in ours]),
            error([each.expected for each in ours]),
        )
        best = min(
            error([e.expected + e.regressed + w * e.own for e in ours]).mean()
            for w in np.linspace(0.0, 1.0, 101)
        )
        of = "estimate of kinetics from kinematics: skill against"
        what = f"{of} nine others, {noun}"
        for which, value in (("", errors.mean()), (", weight chosen in hindsight", best)):
            least = must if not which else -np.inf
            skill = float(1.0 - value / np.mean(line))
            rows.append(evidence.Row(what + which, skill, "1", ">=", goal, least, len(found)))
        ends.append(lower_end(errors, guess))
        what = f"{of} the expectation, 5 % point, {noun}"
        rows.append(evidence.Row(what, ends[-1], "1", ">=", 0.0, -0.03, len(found)))
        plain_ends.append(lower_end(error([each.kinetics for each in plain]), guess))
        inside += [
            np.mean(np.abs(e.kinetics[:, i] - t[:, i]) <= e.half_width[i])
            for e, t in zip(ours, truth, strict=True)
        ]
    of = "estimate of kinetics from kinematics:"
    what = f"{of} curves whose skill against the expectation is above 0 at 5 %"
    above = sum(end > 0.0 for end in ends)
    rows.append(evidence.Row(what, above, "curves", ">=", 6, 4, len(ends)))
    what = f"{of} without what angles say, skill against the expectation, 5 % point, worst curve"
    rows.append(evidence.Row(what, min(plain_ends), "1", ">=", 0.0, -0.03, len(found)))
    what = f"{of} points within the band of 90 %"
    share = float(100.0 * np.mean(inside))
    return [*rows, evidence.Row(what, share, "%", ">=", 90.0, 85.0, len(inside))]


@evidence.measurement(FROM)
def seen(arguments: Namespace) -> list[evidence.Row]:
    """Kinetics of people of other laboratories, imported without their plates and compared with
    them: error of the estimate with what markers say of the forces (contacts, and the total of both
    feet), over that of the estimate without, and an interval over people. And how many points are
    within the bands, which are as wide as errors in the other laboratories of these need.
    """
    before, after, widths, laboratories = [], [], [], []
    for laboratory, known, truth in _without_plates(arguments.clones):
        model, contact = scale_subject(known).model, load_configuration().contact
        usual = told(known, RecordSettings(), builtin_subjects())
        for subject, errors in ((_without_markers_say(known), before), (known, after)):
            found = of_known(usual, subject, model, contact)
            errors.append(units(known.leg_length_m) * (found.kinetics - truth))
        widths.append(units(known.leg_length_m) * found.half_width / WIDER_ELSEWHERE)
        laboratories.append(laboratory)
    rows, count = [], len(laboratories)
    size = [np.sqrt(np.mean(np.square(each), axis=3)).mean(axis=1) for each in (before, after)]
    table = ["| RMS error | without | with what markers say | nearer |", "|---|---|---|---|"]
    for kind, name in SKILLS:
        i = KINETICS.index((kind, name))
        without, with_them = (each[:, i] for each in size)
        noun = f"{MOMENTS[name]} moment" if kind == "moments" else f"{name} force"
        what = f"recordings elsewhere without plates: {noun}, contacts and total force by markers"
        nearer = int(np.sum(with_them < without))
        scale, digits, unit = (100, 1, "% BW") if kind == "forces" else (1, 3, "Nm/kg")
        table.append(
            f"| {noun}, {unit} | {scale * without.mean():.{digits}f} | "
            f"{scale * with_them.mean():.{digits}f} | {nearer} of {count} |"
        )
        ratio = float(with_them.mean() / without.mean())
        of = f"{what}: error over that without them"
        rows.append(evidence.Row(of, ratio, "1", "<=", 0.8, 1.0, count))
        of = f"{what}: skill against that without them, 5 % point"
        least = lower_end(with_them, without)
        rows.append(evidence.Row(of, least, "1", ">=", 0.0, -0.03, count))
    page = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, with_table(page, "seen", "\n".join(table)))
    # (recordings, quantities): how much wider a band has to be to hold 90 of 100 points
    off = np.abs(np.array(after)) / np.maximum(np.array(widths)[:, None], 1e-9)
    print("wider:", np.round(_wider(off), 2).tolist(), "shipped:", WIDER_ELSEWHERE[:, 0].tolist())
    inside = []
    for laboratory in dict.fromkeys(laboratories):
        here = np.array([each == laboratory for each in laboratories])
        inside += (off[here] <= _wider(off[~here])[:, None]).mean(axis=(1, 2, 3)).tolist()
    what = (
        "recordings elsewhere without plates: points within the band of 90 % of other laboratories"
    )
    share = 100.0 * float(np.mean(inside))
    return [*rows, evidence.Row(what, share, "%", ">=", 90.0, 85.0, count)]


def _wider(off: Array) -> Array:
    """(7,) half widths that 90 of 100 points of `off` (recordings, 2, 7, n) are within; each
    recording counts as much as another.
    """
    return np.asarray(np.quantile(off, 0.9, axis=(0, 1, 3)))


def _without_plates(clones: Path) -> Iterator[tuple[str, Subject, Array]]:
    """People of public recordings with both sides' plates: their laboratory, the subject that an
    import without the plates makes, and the true kinetics (2, 7, n).
    """
    from evidence.measurement.faults import SAMPLE, _recordings

    for recording in _recordings():
        if recording is SAMPLE or "WBDS" in recording["laboratory"]:
            continue  # nobody, and the laboratory of the built-in people
        full = _subject_of(recording, clones)
        try:
            known = _subject_of(recording | {"kinematics_only": True, "forces": None}, clones)
        except RecordError as error:
            print(f"{recording['name']}: no subject without its plates ({error})", flush=True)
            continue
        if not full.gait.not_recorded:
            print(recording["name"], full.source, flush=True)
            yield (
                recording["laboratory"],
                known,
                kinetics_of(normal_form(full.record(), full.leg_length_m)),
            )


def _subject_of(recording: dict[str, Any], clones: Path) -> Subject:
    from evidence.measurement.faults import _imported, _read
    from gaitval.session.subject import subject_of

    with tempfile.TemporaryDirectory() as folder:
        return subject_of(_imported(*_read(recording, clones, Path(folder))))


def _without_markers_say(subject: Subject) -> Subject:
    """The `subject` of whom contacts and the total of the forces are unknown."""
    unknown = StanceFraction.model_construct(right=None, left=None)
    gait = subject.gait.model_copy(update={"total_force": None})
    return subject.model_copy(update={"stance_fraction": unknown, "gait": gait})


def _estimate_of(person: str, *, angles: bool = True) -> Estimate:
    """Of a built-in person, by the nine others; their own kinetics are NaN in it."""
    subject = load_subject(person)
    fit = stored_fits()[f"{subject.identifier} {subject.trial}"]
    gait = normal_form(subject.record(), subject.leg_length_m)
    hidden = replace(gait, moments=np.nan * gait.moments, forces=np.nan * gait.forces)
    trial = trial_of(subject, subject.record(), fit)._replace(gait=hidden)
    return estimate(trial, learned_from(subject, builtin_subjects()), angles=angles)


@evidence.measurement(evidence.DATA)
def laboratory(arguments: Namespace) -> list[evidence.Row]:
    """Another laboratory's mean kinetics at five speeds of adults and of the young (Bovi and others
    2011, Gait Posture 33:6), as expected of anybody by our people, and with what the angles say.
    """
    folder = arguments.data / "normative"
    people = learned_from(load_subject("5").model_copy(update={"person": ""}), builtin_subjects())
    found, guess, truth = [], [], []
    for gait, leg in _means_elsewhere(folder):
        trial = Trial(gait, np.zeros((2, len(KINETICS), SAMPLES)))
        said = estimate(trial, people)
        one = units(leg)
        found.append(one * (said.expected + said.regressed))
        guess.append(one * said.expected)
        truth.append(one * kinetics_of(gait))
    skills, rows = [], []
    for kind, name in SKILLS:
        i, scale = KINETICS.index((kind, name)), 100.0 if kind == "forces" else 1.0
        ours, usual = (
            float(
                np.mean([scale * rms(c[0, i] - t[0, i]) for c, t in zip(each, truth, strict=True)])
            )
            for each in (found, guess)
        )
        skills.append(1.0 - ours / usual)
        noun = f"{MOMENTS[name]} moment" if kind == "moments" else f"{name} force"
        what = f"another laboratory's means: error of what is expected of anybody, {noun}"
        unit = "% BW" if kind == "forces" else "Nm/kg"
        rows.append(evidence.Row(what, usual, unit, "<=", 0.0, np.inf, len(truth)))
    what = "another laboratory's means: skill of what angles say against the expectation, worst"
    return [*rows, evidence.Row(what, min(skills), "1", ">=", 0.0, -np.inf, len(truth))]


def _means_elsewhere(folder: Path) -> Iterator[tuple[NormalForm, float]]:
    """Mean gaits of `Bovi2011.csv`, with moments of our sign, and legs, m."""
    with (folder / "Bovi2011.csv").open(encoding="utf-8", newline="") as file:
        curves = {tuple(row[:4]): np.array(row[4:-1], float) for row in list(csv.reader(file))[1:]}
    with (folder / "Bovi2011_parameters.csv").open(encoding="utf-8", newline="") as file:
        figures = {(row["parameter"], row["task"]): row for row in csv.DictReader(file)}
    for column, group in (("adult_mean", "A"), ("young_mean", "Y")):
        for speed, task in BOVI_SPEEDS.items():

            def figure(name: str, task: str = task, column: str = column) -> float:
                return float(figures[name, task][column])

            def both(kind: str, name: str, of: str = f"{speed} {group}") -> Array:
                return np.array([curves[kind, name, of, "mean"]] * 2)

            leg = 53.0 * figure("Stride length [m]") / figure("Stride length / BH [%BH]")  # Winter
            metres = figure("Stride length [m]") / figure("Stride time [s]")
            angles = [
                np.deg2rad(sign * both("joint_rotations", name)) for sign, name in BOVI_ANGLES
            ]
            moments = [-both("joint_moments", name) for name in BOVI_MOMENTS]
            forces = [both("ground_reaction_forces", name) for name in BOVI_FORCES]
            gait = NormalForm(
                metres / np.sqrt(GRAVITY * leg),
                figure("Stride time [s]") / np.sqrt(leg / GRAVITY),
                0.5,
                np.full(2, np.nan),
                np.stack(angles, axis=1).reshape(18, SAMPLES),
                np.stack(moments, axis=1).reshape(8, SAMPLES) / moment_units(leg),
                np.stack(forces, axis=2),
            )
            yield gait, leg


def lower_end(ours: Array, guess: Array) -> float:
    """Lower end of the 90 % interval of the skill, by drawing people with replacement."""
    return skill_interval(ours, guess)[0]
