"""Predictions without a model: the yardstick for an error.

An error of 5 % of body weight says little by itself. A prediction that knows only the person's
speed and leg length shows what is possible without a walker: skill = 1 - error / error of the
prediction. 1 is perfect, 0 is no better, below 0 is worse.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.gait.cycle_curves import JOINT_ANGLES, PELVIS_ANGLES, Curves, recorded_curves
from gaitval.gait.record import GaitRecord, Origin
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.comparison import rms
from gaitval.metrics.curve_results import Kind, PredictionErrors, PredictionResult, by_kind
from gaitval.metrics.origin import Origins, curve_origin, furthest, measure_origin
from gaitval.metrics.recorded import step_lengths
from gaitval.metrics.results import Metrics
from gaitval.metrics.typed import array, number, sided
from gaitval.subjects.prediction.speed_line import FEWEST_PEOPLE, dimensionless_speed, line_weights
from gaitval.subjects.subject import Subject
from gaitval.walk.reference.hip_moments import HIP_SIGNS


@dataclass(frozen=True)
class Prediction:
    """The curves of a person as someone would guess them who has no model.

    Attributes
    ----------
    name : of the method, as shown in tables.
    known : what the method knows of the person.
    people : how many others it was made from.
    curves : as `gait.cycle_curves.recorded_curves`; without moments and forces where the method's
        trials have none, and without angles where it only has kinetics.
    steps : stance fractions, right and left, and step lengths, right and left, in leg lengths (4,).
    own : whether it is made from the person's own other trials.
    """

    name: str
    known: str
    people: int
    curves: Curves
    steps: Array
    own: bool


def others_line(subject: Subject, others: Sequence[Subject]) -> Prediction | None:
    """The curves that `others` would have at the speed of `subject`; None with fewer than
    `FEWEST_PEOPLE`.

    At every percent of the gait cycle a straight line on dimensionless speed is fitted through
    their recorded curves by least squares, and read at the speed of the person, who is left out of
    `others`, so that nobody is predicted from their own record.
    """
    learned = [other for other in others if not subject.is_person_of(other)]
    if len(learned) < FEWEST_PEOPLE:
        return None
    speeds = np.array([dimensionless_speed(other) for other in learned])
    # the value of a least-squares line at one speed is a weighted sum, with the same weights for
    # every point of every curve
    weights = line_weights(speeds, dimensionless_speed(subject))
    recorded = [recorded_curves(other.record()) for other in learned]
    return Prediction(
        name="line through others",
        known="walking speed and leg length",
        people=len(learned),
        curves=_combined(recorded, weights),
        steps=weights @ np.array([_steps(other) for other in learned]),
        own=False,
    )


def anybody(subject: Subject, others: Sequence[Subject]) -> Prediction | None:
    """The moments and forces that a walk told angles alone is given: those expected of anybody at
    the speed of `subject` from `others`; None with fewer than `FEWEST_PEOPLE`.
    """
    from gaitval.subjects.prediction.population import with_others_kinetics

    learned = [other for other in others if not subject.is_person_of(other)]
    if len(learned) < FEWEST_PEOPLE:
        return None
    record = with_others_kinetics(subject, learned)
    curves = recorded_curves(record)
    return Prediction(
        name="expected of anybody",
        known="walking speed, stride time and leg length",
        people=len(learned),
        curves=Curves({}, curves.moments, curves.forces),
        steps=_steps_of(record, subject.leg_length_m),
        own=False,
    )


def nearest_trial(subject: Subject) -> Prediction | None:
    """The other trial of `subject` at the nearest speed, copied; None without another."""
    trials = _other_trials(subject)
    if not trials:
        return None
    nearest = min(trials, key=lambda t: abs(t.walking_speed_m_s - subject.walking_speed_m_s))
    return Prediction(
        name="nearest trial copied",
        known=f"the person's {nearest.trial} at {nearest.walking_speed_m_s:g} m/s",
        people=0,
        curves=_curves_of([nearest])[0],
        steps=_steps(nearest),
        own=True,
    )


def line_of_trials(subject: Subject) -> Prediction | None:
    """The straight line on speed through the two other trials of `subject` at the nearest speeds,
    of two trials at one speed the first; None without two different speeds.
    """
    speed = subject.walking_speed_m_s
    nearest = sorted(_other_trials(subject), key=lambda t: abs(t.walking_speed_m_s - speed))
    others = [each for each in nearest if each.walking_speed_m_s != nearest[0].walking_speed_m_s]
    if not others:
        return None
    trials = [nearest[0], others[0]]
    speeds = [trial.walking_speed_m_s for trial in trials]
    weights = line_weights(np.array(speeds), speed)
    return Prediction(
        name="line through two trials",
        known="the person's " + " and ".join(trial.trial for trial in trials),
        people=0,
        curves=_combined(_curves_of(trials), weights),
        steps=weights @ np.array([_steps(trial) for trial in trials]),
        own=True,
    )


def change_added(subject: Subject, others: Sequence[Subject]) -> Prediction | None:
    """The `nearest_trial` of `subject` plus the change to this speed of the line through `others`;
    None without another trial or with fewer than `FEWEST_PEOPLE` others.
    """
    copied = nearest_trial(subject)
    learned = [other for other in others if not subject.is_person_of(other)]
    if copied is None or len(learned) < FEWEST_PEOPLE:
        return None
    near = min(
        _other_trials(subject), key=lambda t: abs(t.walking_speed_m_s - subject.walking_speed_m_s)
    )
    speeds = np.array([dimensionless_speed(other) for other in learned])
    here, there = (line_weights(speeds, dimensionless_speed(each)) for each in (subject, near))
    recorded = [recorded_curves(other.record()) for other in learned]
    return Prediction(
        name="other people's change added",
        known=copied.known,
        people=len(learned),
        # a line's value is linear in its curves: the difference of the weights gives the difference
        # between the two speeds
        curves=_combined([copied.curves, *recorded], np.append(1.0, here - there)),
        steps=copied.steps + (here - there) @ np.array([_steps(other) for other in learned]),
        own=True,
    )


def predictions(subject: Subject, others: Sequence[Subject]) -> list[Prediction]:
    """Every prediction that can be made for `subject`; the line through `others` first."""
    found = (
        others_line(subject, others),
        anybody(subject, others),
        nearest_trial(subject),
        line_of_trials(subject),
        change_added(subject, others),
    )
    return [each for each in found if each is not None]


def predicted_parts(
    subject: Subject,
    others: Sequence[Subject],
    recorded: Mapping[Kind, Mapping[str, Array]],
    origins: Origins,
    *,
    free_hips: bool = False,
) -> list[PredictionResult]:
    """Every prediction for `subject` from `others`, with its RMSE from the `recorded` curves in
    their units: None where `origins` say that a curve was not recorded, and where the prediction
    has none. Empty where no curve was recorded. With `free_hips` also of the hips' moments about
    the point that brings them nearest: two numbers a side, as a reference has that finds where the
    record's hips are.
    """

    def error(kind: Kind, name: str, curve: Array | None) -> float | None:
        if curve is None or curve_origin(kind, name, origins) != "recorded":
            return None
        return number(rms(curve - recorded[kind][name]))

    def about_nearest_hips(curves: Mapping[Kind, Mapping[str, Array]]) -> dict[str, float]:
        found = {}
        for name in sided(tuple(HIP_SIGNS)):
            moment, vertical = curves["moments"].get(name), f"vertical_{name[-1]}"
            if moment is None or curve_origin("moments", name, origins) != "recorded":
                continue
            away, force = moment - recorded["moments"][name], curves["forces"][vertical]
            # the lever of least squares, free for each hip and axis; see `about_record`
            lever = float(away @ force) / float(force @ force)
            found[name] = float(number(rms(away - lever * force)) or 0.0)
        return found

    if not any(curve_origin(k, n, origins) == "recorded" for k in recorded for n in recorded[k]):
        return []
    return [
        PredictionResult(
            name=each.name,
            known=each.known,
            people=each.people,
            rmse=PredictionErrors(
                **{
                    kind: {name: error(kind, name, curves.get(name)) for name in recorded[kind]}
                    for kind, curves in by_kind(each.curves).items()
                }
            ),
            about_nearest_hips=about_nearest_hips(by_kind(each.curves)) if free_hips else {},
            own=each.own,
            figures=_figures(each, subject, origins),
        )
        for each in predictions(subject, others)
    ]


def _figures(guess: Prediction, subject: Subject, origins: Origins) -> dict[str, dict[str, float]]:
    """Errors of the stance fractions (% of cycle) and step lengths (cm) of a `guess` for `subject`
    that were recorded. It is told the speed.
    """
    away = np.abs(guess.steps - _steps(subject))
    units = {"stance_fraction_error": 100.0, "step_length_error": 100.0 * subject.leg_length_m}
    found: dict[str, dict[str, float]] = {
        measure: {
            side: float(unit * error)
            for side, error in zip(SIDES, errors, strict=True)
            if measure_origin(measure, side, origins) == "recorded" and np.isfinite(error)
        }
        for (measure, unit), errors in zip(units.items(), away.reshape(2, 2), strict=True)
    }
    return {**found, "speed_error": {"walk": 0.0}}


def _steps(subject: Subject) -> Array:
    """Of the record of `subject`, see `Prediction.steps`; NaN where no forces were recorded."""
    if not subject.has_kinetics:
        return np.full(4, np.nan)
    return _steps_of(subject.record(), subject.leg_length_m)


def _steps_of(record: GaitRecord, leg_length: float) -> Array:
    lengths = step_lengths(record)
    return np.array(
        [
            *(record.stance_fraction[side] for side in SIDES),
            *(lengths[side] / leg_length for side in SIDES),
        ]
    )


def _other_trials(subject: Subject) -> list[Subject]:
    """`subject` on the further trials; those without forces only where they are all there is, or
    this trial has none to compare with either.
    """
    trials = [subject.on_trial(trial.name) for trial in subject.trials]
    with_forces = [trial for trial in trials if trial.has_kinetics]
    return with_forces if with_forces and subject.has_kinetics else trials


def _curves_of(trials: Sequence[Subject]) -> list[Curves]:
    """The recorded curves of each of `trials`; of all only the angles, unless all have forces."""
    if all(trial.has_kinetics for trial in trials):
        return [recorded_curves(trial.record()) for trial in trials]
    phase = np.linspace(0.0, 1.0, SAMPLES)
    names = sided((*JOINT_ANGLES, *PELVIS_ANGLES))
    angles = [trial.gait.angles_of_both() for trial in trials]
    return [Curves({name: each[name](phase) for name in names}, {}, {}) for each in angles]


def _combined(curves: Sequence[Curves], weights: Array) -> Curves:
    """Sum of curves times weights; the others have at least those of the first."""
    return Curves(
        *(
            {
                name: np.tensordot(weights, [getattr(each, field.name)[name] for each in curves], 1)
                for name in getattr(curves[0], field.name)
            }
            for field in fields(Curves)
        )
    )


def skill(error: float | None, baseline: float | None) -> float | None:
    """1 - error / baseline; None where one of them is not known or the baseline is exact."""
    if error is None or not baseline:
        return None
    return 1.0 - error / baseline


GROUPS: Final[Mapping[str, tuple[Kind, tuple[str, ...]]]] = {
    "sagittal angles": ("angles", ("hip_flexion", "knee_angle", "ankle_angle")),
    "other angles": (
        "angles",
        ("hip_adduction", "hip_rotation", "pelvis_tilt", "pelvis_list", "pelvis_rotation"),
    ),
    "moments": ("moments", ("hip_flexion", "knee_angle", "ankle_angle")),
    "hip adduction moment": ("moments", ("hip_adduction",)),
    "vertical force": ("forces", ("vertical",)),
    "fore-aft force": ("forces", ("forward",)),
    "medial force": ("forces", ("medial",)),
}
"""Kind and names of the curves of each group; both sides."""


class GroupRow(NamedTuple):
    """Mean RMSE of a group of curves.

    Attributes
    ----------
    walked : of the walk; None if it is too short.
    guesses : by name of the prediction without a model; None where nothing was recorded, or the
        prediction has no such curves.
    origin : where what the walk is compared with comes from. If some curves of the group were
        recorded, the means are over those.
    """

    group: str
    unit: str
    status: str
    walked: float | None
    guesses: dict[str, float | None]
    origin: Origin = "recorded"

    def skills(self) -> dict[str, float | None]:
        """Skill of the walk against each prediction."""
        return {name: skill(self.walked, guess) for name, guess in self.guesses.items()}


def group_curves(metrics: Metrics) -> dict[str, tuple[Kind, tuple[str, ...], str]]:
    """Kind, curves of both sides, and unit in `metrics` of each of `GROUPS`."""
    return {
        group: (kind, sided(names), metrics.units.of(kind))
        for group, (kind, names) in GROUPS.items()
    }


def group_rows(metrics: Metrics) -> list[GroupRow]:
    """Mean RMSE in `metrics` of each of `GROUPS`, of walk and predictions without a model."""
    errors, origins = metrics.walk.errors, metrics.origins
    rows = []
    for group, (kind, every, unit) in group_curves(metrics).items():
        curves = [name for name in every if curve_origin(kind, name, origins) == "recorded"]
        # if nothing of the group was recorded, the row is the distance from all its curves, without
        # skill
        recorded, curves = bool(curves), curves or list(every)
        found = [errors.of(kind)[curve] for curve in curves]
        rmse = [error.rmse for error in found if error is not None]
        # a mean over fewer curves could not be compared with the predictions' mean
        walked = float(np.mean(array(rmse))) if len(rmse) == len(found) else None
        guesses = {
            prediction.name: number(
                float(np.mean(array([prediction.rmse.of(kind)[c] for c in curves])))
            )
            if recorded
            else None
            for prediction in metrics.predictions
        }
        status = "fitted" if metrics.known[kind] else "predicted"
        origin = furthest([curve_origin(kind, name, origins) for name in curves])
        rows.append(GroupRow(group, unit, status, walked, guesses, origin))
    return rows
