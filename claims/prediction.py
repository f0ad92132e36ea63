"""Kinetics of people of whom only angles are known: walked, estimated, and at other laboratories.

Of the built-in people each is estimated by the nine others. Recordings of other laboratories are
imported without their plates and compared with them.
"""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import claims
from claims import Claim
from claims.accuracy import MOMENTS
from claims.held_out import mean, stored
from claims.skill_interval import skill_interval
from gaitval.arrays import Array
from gaitval.configuration import RecordSettings, load_configuration
from gaitval.datasets.stored_gait import StanceFraction
from gaitval.datasets.subject import Subject
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.errors import RecordError
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.insoles import InsoleForces
from gaitval.metrics.baselines import others_line
from gaitval.metrics.comparison import rms
from gaitval.metrics.recorded import by_kind
from gaitval.prediction.deviations import (
    KINETICS,
    kinetics_of,
    kinetics_of_curves,
    learned_from,
    stored_fits,
    trial_of,
    units,
)
from gaitval.prediction.estimate import WIDER_WITH_TOTAL, Estimate, estimate
from gaitval.prediction.insoles import with_insoles
from gaitval.prediction.known import known_record
from gaitval.prediction.normal_form import normal_form
from gaitval.scaling.scaling import scale_subject
from gaitval.simulation.servo import closed_cycle
from gaitval.study.estimate_stage import of_known

WORN_ERROR = 0.05
TIMES_WORN = 5
INSOLES_SEED = 84
SKILLS = (
    ("forces", "vertical"),
    ("forces", "forward"),
    ("forces", "medial"),
    ("moments", "hip_flexion"),
    ("moments", "knee_angle"),
    ("moments", "ankle_angle"),
)


@claims.measured(stored=("reports/held_out/kinematics/*.json",))
def kinematics(_: claims.Given) -> list[Claim]:
    """Kinetics of walks that know angles only: skill against what is expected of anybody at this
    speed, with an interval over people.
    """
    found = stored("kinematics")
    settings, rows, ends = RecordSettings(use="kinematics"), [], []
    expected = []
    for person in found:
        subject = load_subject(person)
        known = by_kind(recorded_curves(known_record(subject, settings, builtin_subjects()).record))
        expected.append((known, by_kind(recorded_curves(subject.record()))))
    for kind, name in SKILLS:
        noun = f"{MOMENTS[name]} moment" if kind == "moments" else f"{name} force"
        ours = np.array([mean(each["errors"][kind], (name,)) for each in found.values()])
        guess = np.array(
            [
                np.mean(
                    [rms(known[kind][f"{name}_{s}"] - truth[kind][f"{name}_{s}"]) for s in "rl"]
                )
                for known, truth in expected
            ]
        )
        ends.append(lower_end(ours, guess))
        what = f"kinetics from kinematics: skill against the expectation, 5 % point, {noun}"
        rows.append(Claim(what, ends[-1], "1", len(ours)))
    what = "kinetics from kinematics: curves whose skill against the expectation is above 0 at 5 %"
    above = sum(end > 0.0 for end in ends)
    return [*rows, Claim(what, above, "curves", len(ends))]


@claims.measured()
def estimates(_: claims.Given) -> list[Claim]:
    """Kinetics of people of whom angles only are known, estimated: as `kinematics`; how many points
    are within the bands; and without what angles say, as for another laboratory.
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
    for kind, name in SKILLS:
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
        of = "estimate of kinetics from kinematics: skill against"
        what = f"{of} nine others, {noun}"
        rows.append(Claim(what, float(1.0 - errors.mean() / np.mean(line)), "1", len(found)))
        ends.append(lower_end(errors, guess))
        what = f"{of} the expectation, 5 % point, {noun}"
        rows.append(Claim(what, ends[-1], "1", len(found)))
        plain_ends.append(lower_end(error([each.kinetics for each in plain]), guess))
        inside += [
            np.mean(np.abs(e.kinetics[:, i] - t[:, i]) <= e.half_width[i])
            for e, t in zip(ours, truth, strict=True)
        ]
    of = "estimate of kinetics from kinematics:"
    what = f"{of} curves whose skill against the expectation is above 0 at 5 %"
    above = sum(end > 0.0 for end in ends)
    rows.append(Claim(what, above, "curves", len(ends)))
    what = f"{of} without what angles say, skill against the expectation, 5 % point, worst curve"
    rows.append(Claim(what, min(plain_ends), "1", len(found)))
    what = f"{of} points within the band of 90 %"
    share = float(100.0 * np.mean(inside))
    return [*rows, Claim(what, share, "%", len(inside))]


@claims.measured()
def insoles(_: claims.Given) -> list[Claim]:
    """Estimates of the ten with insoles that are as far off as they are stated to be (their own
    plates with planted gains and waves): what error is left of that without, and points of the
    vertical force within its band.
    """
    rng, left, inside = np.random.default_rng(INSOLES_SEED), [], []
    for person in builtin_subjects():
        before = _estimate_of(person.identifier)
        truth = kinetics_of(normal_form(person.record(), person.leg_length_m))
        for _again in range(TIMES_WORN):
            found = with_insoles(before, _worn(truth[:, -1], person.stride_time_s, rng))
            left.append(
                np.divide(*(np.sqrt(np.mean((e.kinetics - truth) ** 2, (0, 2)))
                            for e in (found, before)))
            )  # fmt: skip
            stance = truth[:, -1] > 0.0
            off = np.abs(found.kinetics[:, -1] - truth[:, -1])
            inside.append(np.mean((off <= found.half_width[-1])[stance]))
    rows, count = [], len(left)
    for kind, name in SKILLS:
        noun = f"{MOMENTS[name]} moment" if kind == "moments" else f"{name} force"
        value = float(np.mean(left, axis=0)[KINETICS.index((kind, name))])
        what = f"estimate with insoles that are {100 * WORN_ERROR:g} % of body weight off: {noun}"
        rows.append(Claim(f"{what}, error over that without", value, "1", count))
    what = "estimate with insoles: points of the vertical force in stance within the band of 90 %"
    return [*rows, Claim(what, 100.0 * float(np.mean(inside)), "%", count)]


def _worn(vertical: Array, stride_time: float, rng: np.random.Generator) -> InsoleForces:
    """What insoles say of a `vertical` force (2, n): each has a gain of its own and slow waves."""
    phase = 2.0 * np.pi * np.arange(vertical.shape[1]) / vertical.shape[1]
    waves = sum(
        rng.normal(size=(2, 1)) * np.cos(k * phase + rng.uniform(0.0, 2.0 * np.pi, (2, 1)))
        for k in (3, 5, 7)
    )
    gain, off = 1.0 + WORN_ERROR * rng.normal(size=(2, 1)), 0.5 * WORN_ERROR * waves
    shown = np.where(vertical > 0.0, np.maximum(gain * vertical + off, 0.0), 0.0)
    shown /= shown.mean(axis=1).sum()
    return InsoleForces("", shown, 1.0, (9, 9), stride_time, WORN_ERROR)


@claims.measured("public")
def seen(given: claims.Given) -> list[Claim]:
    """Kinetics of people of other laboratories, imported without their plates and compared with
    them: error of the estimate with what markers say of the forces (contacts, and the total of both
    feet), over that of the estimate without, and an interval over people. And how many points are
    within the bands, which are as wide as errors in the other laboratories of these need.
    """
    before, after, widths, laboratories = [], [], [], []
    for laboratory, known, truth in _without_plates(given.public):
        model, contact = scale_subject(known).model, load_configuration().contact
        usual = known_record(known, RecordSettings(), builtin_subjects())
        for subject, errors in ((_without_markers_say(known), before), (known, after)):
            found = of_known(usual, subject, model, contact)
            errors.append(units(known.leg_length_m) * (found.kinetics - truth))
        widths.append(units(known.leg_length_m) * found.half_width / WIDER_WITH_TOTAL)
        laboratories.append(laboratory)
    rows, count = [], len(laboratories)
    size = [np.sqrt(np.mean(np.square(each), axis=3)).mean(axis=1) for each in (before, after)]
    for kind, name in SKILLS:
        i = KINETICS.index((kind, name))
        without, with_them = (each[:, i] for each in size)
        noun = f"{MOMENTS[name]} moment" if kind == "moments" else f"{name} force"
        scale, nearer = 100.0 if kind == "forces" else 1.0, int(np.sum(with_them < without))
        print(f"{noun}: {scale * without.mean():.3f} without, {scale * with_them.mean():.3f} with "
              f"what markers say, nearer {nearer} of {count}", flush=True)  # fmt: skip
        what = f"recordings elsewhere without plates: {noun}, contacts and total force by markers"
        ratio = float(with_them.mean() / without.mean())
        of = f"{what}: error over that without them"
        rows.append(Claim(of, ratio, "1", count))
        of = f"{what}: skill against that without them, 5 % point"
        least = lower_end(with_them, without)
        rows.append(Claim(of, least, "1", count))
    # (recordings, quantities): how much wider a band has to be to hold 90 of 100 points
    off = np.abs(np.array(after)) / np.maximum(np.array(widths)[:, None], 1e-9)
    print("wider:", np.round(_wider(off), 2).tolist(), "shipped:", WIDER_WITH_TOTAL[:, 0].tolist())
    inside = []
    for laboratory in dict.fromkeys(laboratories):
        here = np.array([each == laboratory for each in laboratories])
        inside += (off[here] <= _wider(off[~here])[:, None]).mean(axis=(1, 2, 3)).tolist()
    what = (
        "recordings elsewhere without plates: points within the band of 90 % of other laboratories"
    )
    share = 100.0 * float(np.mean(inside))
    return [*rows, Claim(what, share, "%", count)]


def _wider(off: Array) -> Array:
    """(7,) half widths that 90 of 100 points of `off` (recordings, 2, 7, n) are within; each
    recording counts as much as another.
    """
    return np.asarray(np.quantile(off, 0.9, axis=(0, 1, 3)))


def _without_plates(clones: Path) -> Iterator[tuple[str, Subject, Array]]:
    """People of public recordings with both sides' plates: their laboratory, the subject that an
    import without the plates makes, and the true kinetics (2, 7, n).
    """
    from claims.measurement.faults import SAMPLE, _recordings

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
    from claims.measurement.faults import _imported, _read
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


def lower_end(ours: Array, guess: Array) -> float:
    """Lower end of the 90 % interval of the skill, by drawing people with replacement."""
    return skill_interval(ours, guess)[0]
