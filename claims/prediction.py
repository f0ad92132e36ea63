"""Kinetics of people of whom only angles are known: walked, and estimated by the nine others."""

from dataclasses import replace

import numpy as np

import claims
from claims import Claim
from claims.accuracy import MOMENTS
from claims.held_out import mean, stored
from claims.skill_interval import skill_interval
from gaitval.arrays import Array
from gaitval.configuration import RecordSettings
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.insoles import InsoleForces
from gaitval.metrics.baselines import others_line
from gaitval.metrics.comparison import rms
from gaitval.metrics.curve_results import by_kind
from gaitval.subjects.prediction.deviations import (
    KINETICS,
    kinetics_of,
    kinetics_of_curves,
    learned_from,
    stored_fits,
    trial_of,
    units,
)
from gaitval.subjects.prediction.estimate import Estimate, estimate
from gaitval.subjects.prediction.insoles import with_insoles
from gaitval.subjects.prediction.known import known_record
from gaitval.subjects.prediction.normal_form import normal_form
from gaitval.subjects.subject_file import builtin_subjects, load_subject
from gaitval.walk.simulation.servo import closed_cycle

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


@claims.measured()
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
    ours = [estimate_of(person) for person in found]
    plain = [estimate_of(person, angles=False) for person in found]
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
        before = estimate_of(person.identifier)
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


def estimate_of(person: str, *, angles: bool = True) -> Estimate:
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
