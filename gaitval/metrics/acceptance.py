"""Whether curves of a walk are accepted: nearer to the measured curve than any prediction without a
model.

Each curve is judged by itself: its skill, 1 - error / error of the prediction that is nearest to
the measured curve, has to be above 0. So a prediction that is shown as a walk is not accepted, and
no curve is because others of its group are. Among the predictions are the person's own other
trials, copied or interpolated, if there are any that do not repeat the walk's own, but not their
moments and forces where the walk was given angles alone. The best one is chosen curve by curve with
the measurement at hand, which is to its favour, and its moments of the hip are about the point that
brings it nearest, for the walk's are too.

An error larger than what the measured curve itself is known to is not accepted either. A skill that
is not above 0, but by less than the walks of the same policy from other starts differ, is "not
shown" instead of failed.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.coordinates import SIDES, Side, split_side
from gaitval.metrics.baselines import GROUPS, skill
from gaitval.metrics.comparison import mean_of_all, rms, rmse_of
from gaitval.metrics.curve_results import (
    CURVE_UNITS,
    OF_SKILL,
    RMSE,
    SKILL,
    CurveLight,
    CurveLights,
    Kind,
    Kinds,
    KnownTo,
    Light,
    MeanCurve,
    PredictionResult,
    Reason,
)
from gaitval.metrics.origin import Origins, curve_origin
from gaitval.metrics.results import CurveErrors, HeldOutErrors
from gaitval.metrics.tolerances import AgainstGuess, FailedBy, Measure, Verdict, holds, measured
from gaitval.metrics.typed import array, number, sided

_OF_ERROR: Final[Mapping[str, Kind]] = {measure: kind for kind, measure in RMSE.items()}
"""Kind of the curves of each error."""

_ROUNDING: Final = 1e-6
"""A skill as small as this is 0: a prediction shown as a walk differs from itself by rounding."""


@dataclass(frozen=True)
class Baselines:
    """The predictions that a walk has to be nearer than.

    Attributes
    ----------
    guesses : without a model, of the compared record.
    own : kinds of curves of which the person's own trials were given to the run: of the others a
        prediction from these trials would know more than the walk.
    origins : of the compared record.
    """

    guesses: Sequence[PredictionResult]
    own: Collection[Kind]
    origins: Origins

    def best(self, kind: Kind, curve: str) -> tuple[PredictionResult, float] | None:
        """The prediction that is nearest to a recorded `curve` of a `kind`, and its error; None
        without any.
        """
        if curve_origin(kind, curve, self.origins) != "recorded":
            return None
        found = [
            (guess, error)
            for guess in self.guesses
            if (kind in self.own or not guess.own)
            and (error := guess.error(kind, curve)) is not None
        ]
        return min(found, key=lambda each: each[1], default=None)


def skill_measures(errors: CurveErrors, baselines: Baselines) -> list[Measure]:
    """Skill of the `errors` of a walk against the best of `baselines`, of every curve that has
    one.
    """
    return [
        measured(SKILL[kind], name, _skill(rmse_of(error), best[1]))
        for kind, name, error in errors.items()
        if (best := baselines.best(kind, name)) is not None
    ]


def _skill(walk: float | None, guess: float) -> float | None:
    if guess == 0.0:  # nothing is nearer than a prediction that is exact
        return 0.0
    found = skill(walk, guess)
    return None if found is None else 0.0 if abs(found) < _ROUNDING else number(found)


def known_to(uncertainty: Mapping[str, float]) -> dict[tuple[Kind, str], float]:
    """Half the width of the 90 % band of each recorded mean curve in the units of `metrics.json`,
    by kind and name, from the `uncertainty` of a subject.
    """
    found: dict[tuple[Kind, str], float] = {}
    for name, value in uncertainty.items():
        kind, _, curve = name.partition("_")
        if kind == "angle":
            found["angles", curve] = float(np.rad2deg(value))
        elif kind == "moment":
            found["moments", curve] = value
        elif kind == "force":
            axis, _, side = curve.rpartition("_")
            words = {"forward": "forward", "left": "medial", "up": "vertical"}
            found["forces", f"{words[axis]}_{side}"] = 100.0 * value
    return found


def accepted(
    verdicts: Sequence[Verdict],
    errors: CurveErrors,
    known: Mapping[tuple[Kind, str], float],
    baselines: Baselines,
) -> list[Verdict]:
    """`verdicts` with the whole rule: each skill beside the best of `baselines` and what the record
    is `known` to, by the `errors` of the walk; each error with whether that prediction would meet
    the limit.
    """
    return [_accepted(each, errors, known, baselines) for each in verdicts]


def _accepted(
    verdict: Verdict,
    errors: CurveErrors,
    known: Mapping[tuple[Kind, str], float],
    baselines: Baselines,
) -> Verdict:
    kind = OF_SKILL.get(verdict.measure)
    if kind is None:
        return _beside_guess(verdict, baselines)
    best = baselines.best(kind, verdict.target)
    assert best is not None  # else it has no skill
    guess, other = best
    error = rmse_of(errors.of(kind)[verdict.target])
    band = known.get((kind, verdict.target))
    missed: list[FailedBy] = list(verdict.failed_by)
    spread = verdict.spread
    unsure = spread is not None and spread.high is not None and spread.high > 0.0
    if band is not None and (error is None or error > band):
        missed.append("record")
    state = verdict.state
    if missed:
        # walks of this policy are on both sides of the prediction
        state = "not shown" if missed == ["limit"] and error is not None and unsure else "failed"
    if spread is not None and missed:
        spread = spread.model_copy(update={"close": False})
    return verdict.model_copy(
        update={
            "passed": not missed,
            "state": state,
            "failed_by": missed,
            "guess": AgainstGuess(guess=guess.name, error=other, walk=number(error)),
            "known": number(band),
            "spread": spread,
        }
    )


def _beside_guess(verdict: Verdict, baselines: Baselines) -> Verdict:
    """A `verdict` on the error of a curve, a stance, a step or the speed, with whether the best
    prediction would meet its limit.
    """
    kind = _OF_ERROR.get(verdict.measure)
    if kind is None:
        of_walk = [
            each
            for guess in baselines.guesses
            if (each := guess.figures.get(verdict.measure, {}).get(verdict.target)) is not None
        ]
        error = min(of_walk, default=None)
    else:
        best = baselines.best(kind, verdict.target)
        error = None if best is None else best[1]
    if error is None:
        return verdict
    within = holds(verdict.limit, error, verdict.tolerance)
    return verdict.model_copy(update={"guess_within": within})


def group_of(kind: Kind, name: str) -> str | None:
    """The group of the curve `name` (without side) of a `kind`; None if it is in none."""
    return next((g for g, (of, names) in GROUPS.items() if of == kind and name in names), None)


def lights(
    errors: CurveErrors,
    verdicts: Sequence[Verdict],
    known: Mapping[tuple[Kind, str], float],
    baselines: Baselines,
    second: CurveErrors | None,
    held_out: HeldOutErrors | None = None,
) -> CurveLights:
    """Whether each curve of a walk may be believed: by its `errors`, the `verdicts` on it, what the
    record is `known` to, its `baselines`, and its errors in a `second` engine. Where nothing was
    recorded `errors` are distances from a prediction, and `held_out` how wrong predictions are.
    """
    wrong = {} if held_out is None else {each.group: each.mean for each in held_out.groups}
    rows: dict[tuple[Kind, str], list[Verdict]] = {}
    for row in verdicts:
        of = OF_SKILL.get(row.measure, _OF_ERROR.get(row.measure))
        if row.role == "acceptance" and of is not None:
            rows.setdefault((of, row.target), []).append(row)
    found: dict[Kind, dict[str, CurveLight]] = {}
    for kind, curve, each in errors.items():
        group = group_of(kind, split_side(curve)[1])
        side = next(each for each in SIDES if curve.endswith(f"_{each[0]}"))
        best = baselines.best(kind, curve)
        error = rmse_of(each)
        if curve_origin(kind, curve, baselines.origins) == "recorded":
            light, reason = _light(error, rows.get((kind, curve), ()))
            there = None if second is None else rmse_of(second.of(kind)[curve])
            nearer_there = best is None or (there is not None and there < best[1])
            if light == "believe" and second is not None and not nearer_there:
                light, reason = "with care", "engine"
        elif error is None:
            light, reason = "do not", "too short"
        elif group in wrong and _distance(errors, group, side) > wrong[group]:
            light, reason = "do not", "held out"
        else:
            light, reason = "with care", "not recorded"
        found.setdefault(kind, {})[curve] = CurveLight(
            light=light,
            reason=reason,
            error=number(error),
            guess=None if best is None else best[0].name,
            guess_error=None if best is None else best[1],
            known=number(known.get((kind, curve))),
        )
    return CurveLights(**found)


def _distance(errors: CurveErrors, group: str, side: Side) -> float:
    kind, names = GROUPS[group]
    found = mean_of_all([rmse_of(errors.of(kind)[f"{name}_{side[0]}"]) for name in names])
    return np.inf if found is None else found


def _light(error: float | None, rows: Sequence[Verdict]) -> tuple[Light, Reason]:
    """Of a recorded curve with an `error`, by the `rows` of the limits that decide on it."""
    if error is None:
        return "do not", "too short"
    skills = [row for row in rows if row.measure in OF_SKILL]
    if any(row.failed_by for row in rows if row not in skills):
        return "do not", "limit"
    if not skills:
        return "with care", "no guess"
    (row,) = skills
    if "record" in row.failed_by:
        return "do not", "record"
    if not row.passed:
        return ("with care", "not shown") if row.state == "not shown" else ("do not", "guess")
    close = row.spread is not None and row.spread.close
    return ("with care", "narrow") if close else ("believe", "nearer")


def known_groups(
    walked: Kinds[MeanCurve],
    second: Kinds[MeanCurve] | None,
    known: Mapping[tuple[Kind, str], float],
    origins: Origins,
) -> list[KnownTo]:
    """What the error of each group is known to, of the mean curves `walked`, those of the same walk
    in a `second` engine, and what the record is `known` to; `origins` say what was recorded.
    """
    steps = time_steps()
    rows = []
    for group, (kind, names) in GROUPS.items():
        curves = sided(names)
        recorded = [c for c in curves if curve_origin(kind, c, origins) == "recorded"]
        record = mean_of_all([known.get((kind, curve)) for curve in recorded])
        apart = None
        if second is not None:
            apart = mean_of_all([_apart(walked.of(kind)[c], second.of(kind)[c]) for c in curves])
        rows.append(
            KnownTo(
                group=group,
                unit=CURVE_UNITS[kind],
                record=number(record),
                time_step=steps.get(group),
                second_engine=number(apart),
            )
        )
    return rows


def _apart(one: MeanCurve, other: MeanCurve) -> float | None:
    if one.mean is None or other.mean is None:
        return None
    return number(rms(array(one.mean) - array(other.mean)))


@cache
def time_steps() -> Mapping[str, float]:
    """By group of curves, the largest change of mean curves when the study of a built-in person is
    made anew at a quarter of the step (experiments/time_step.py).
    """
    found: dict[str, float] = {}
    for _, (_, group, _, change, _) in shipped_table("gaitval.metrics", "time_step.csv").rows:
        found[group] = max(found.get(group, 0.0), float(change))
    return found
