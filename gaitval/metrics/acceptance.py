"""Whether curves of a walk are accepted: nearer to the record than the best guess without a model.

A curve that decides keeps its limit (`tolerances.toml`), is within what the record itself is known
to, where that is known, and its group of curves on its side is nearer to the record than the same
curves of the best guess. So a guess that is shown as a walk is not accepted, whatever the limits.

The best guess is that of the smallest mean error of the group on the side, among the `baselines`
that know no more than the walk was told. The person's other trials stand against a walk that was
predicted from them, and against no other: whether a walk is accepted must not hang on what else was
recorded. It is chosen with the record at hand, which is to its favour. Skill 0 is not accepted.
Where it is not above 0, but by less than the walks of the same policy from other starts differ, it
is "not shown" instead of failed.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.coordinates import SIDES, Side, split_side
from gaitval.metrics.baselines import GROUPS, skill
from gaitval.metrics.comparison import rms, rmse_of
from gaitval.metrics.curve_results import (
    CURVE_UNITS,
    RMSE,
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
from gaitval.metrics.tolerances import AcceptanceState, AgainstGuess, FailedBy, Verdict, holds
from gaitval.metrics.typed import array, number, sided
from gaitval.metrics.verdict_rows import Repeated, prediction_interval

_KINDS: Final[Mapping[str, Kind]] = {measure: kind for kind, measure in RMSE.items()}
"""Kind of the curves of each measure that a guess is compared by."""

REMEDY: Final = (
    "Take these curves from the guess or from the record, not from this walk: a guess without a "
    "model is as near to the record or nearer."
)
"""Where a limit is kept, and the guess is nearer."""

_ROUNDING: Final = 1e-6
"""A skill as small as this is 0: a guess shown as a walk differs from itself by rounding."""


@dataclass(frozen=True)
class Baselines:
    """The baseline predictions that a walk has to be nearer than.

    Attributes
    ----------
    guesses : without a model, of the compared record.
    own : kinds of curves of the person's other trials that the run was told, so that guesses from
        these know no more.
    origins : of the compared record.
    """

    guesses: Sequence[PredictionResult]
    own: Collection[Kind]
    origins: Origins

    def best(self, kind: Kind, names: Sequence[str], side: Side) -> PredictionResult | None:
        """The guess with the smallest mean error of the curves `names` (without side) of a `kind`
        that were recorded on a `side`; None without any.
        """
        curves = self.recorded(kind, names, side)
        found = [
            (error, guess)
            for guess in self.guesses
            if kind in self.own or not guess.own
            if (error := _mean([guess.rmse.of(kind)[curve] for curve in curves])) is not None
        ]
        return min(found, key=lambda each: each[0])[1] if found else None

    def recorded(self, kind: Kind, names: Sequence[str], side: Side) -> list[str]:
        """Those of the curves `names` (without side) of a `kind` that were recorded on a `side`."""
        every = [f"{name}_{side[0]}" for name in names]
        return [each for each in every if curve_origin(kind, each, self.origins) == "recorded"]


def against_guesses(
    errors: CurveErrors, repeated: Repeated, baselines: Baselines
) -> dict[tuple[str, Side], AgainstGuess]:
    """The `errors` of a walk, by group and side, beside those of the best of its `baselines`; the
    skill's interval is by `repeated` walks. Without those groups that have no opponent.
    """
    found = {}
    for group, (kind, names) in GROUPS.items():
        for side in SIDES:
            best = baselines.best(kind, names, side)
            curves = baselines.recorded(kind, names, side)
            if best is None or not curves:
                continue
            guess = _mean([best.rmse.of(kind)[curve] for curve in curves])
            assert guess is not None
            walk = _mean([rmse_of(errors.of(kind)[curve]) for curve in curves])
            each = [repeated.get((RMSE[kind], curve), ()) for curve in curves]
            means = [m for m in map(_mean, zip(*each, strict=True)) if m is not None]
            interval = prediction_interval(means)
            low, high = (None, None) if interval is None else interval
            found[group, side] = AgainstGuess(
                group=group,
                side=side,
                guess=best.name,
                error=guess,
                walk=number(walk),
                skill=_skill(walk, guess),
                low=_skill(high, guess),
                high=_skill(low, guess),
            )
    return found


def _mean(values: Sequence[float | None]) -> float | None:
    known = [each for each in values if each is not None]
    return float(np.mean(known)) if known and len(known) == len(values) else None


def _skill(walk: float | None, guess: float) -> float | None:
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
    against: Mapping[tuple[str, Side], AgainstGuess],
    known: Mapping[tuple[Kind, str], float],
    baselines: Baselines,
) -> list[Verdict]:
    """`verdicts` with the whole rule: those of role acceptance on curves are also `against` the
    best guess of their group and side and what the record is `known` to. `baselines` says of each
    whether the guess in the place of the walk would keep it.
    """
    return [
        each if each.role != "acceptance" else _accepted(each, against, known, baselines)
        for each in verdicts
    ]


def _accepted(
    verdict: Verdict,
    against: Mapping[tuple[str, Side], AgainstGuess],
    known: Mapping[tuple[Kind, str], float],
    baselines: Baselines,
) -> Verdict:
    kind = _KINDS.get(verdict.measure)
    if kind is None:
        return _beside_figures(verdict, baselines)
    side, name = split_side(verdict.target)
    group = group_of(kind, name)
    found = next((each for key, each in against.items() if key == (group, side)), None)
    band = known.get((kind, verdict.target))
    missed: list[FailedBy] = list(verdict.failed_by)
    if band is not None and (verdict.value is None or verdict.value > band):
        missed.append("record")
    if found is not None and found.state != "passed":
        missed.append("guess")
    state: AcceptanceState = "failed" if missed else "passed"
    if missed == ["guess"] and found is not None:
        state = found.state
    error = None
    if found is not None:
        guess = next(each for each in baselines.guesses if each.name == found.guess)
        error = guess.rmse.of(kind)[verdict.target]
    narrow = found is not None and found.low is not None and found.low <= 0.0
    spread = verdict.spread
    if spread is not None:
        close = not missed and (spread.close or narrow)
        spread = spread.model_copy(update={"close": close})
    return verdict.model_copy(
        update={
            "passed": not missed,
            "remedy": REMEDY if missed == ["guess"] else verdict.remedy,
            "reached": None if verdict.reached is None else verdict.reached and not missed,
            "state": state,
            "failed_by": missed,
            "guess": found,
            "known": number(band),
            "spread": spread,
            "guess_within": None
            if error is None
            else holds(verdict.limit, error, verdict.tolerance),
            # it is as near as itself, and a walk has to be nearer
            "guess_passes": None if error is None else False,
        }
    )


def _beside_figures(verdict: Verdict, baselines: Baselines) -> Verdict:
    """A `verdict` on stance, steps or speed, which some guesses have and no rule compares."""
    found = [
        error
        for guess in baselines.guesses
        if baselines.own or not guess.own
        if (error := guess.figures.get(verdict.measure, {}).get(verdict.target)) is not None
    ]
    if not found:
        return verdict
    within = holds(verdict.limit, min(found), verdict.tolerance)
    return verdict.model_copy(update={"guess_within": within, "guess_passes": within})


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
    rows = {
        (_KINDS[row.measure], row.target): row
        for row in verdicts
        if row.role == "acceptance" and row.measure in _KINDS
    }
    found: dict[Kind, dict[str, CurveLight]] = {}
    for kind, curve, each in errors.items():
        name = split_side(curve)[1]
        side = next(each for each in SIDES if curve.endswith(f"_{each[0]}"))
        group = group_of(kind, name)
        best = baselines.best(kind, (name,) if group is None else GROUPS[group][1], side)
        other = None if best is None else best.rmse.of(kind)[curve]
        error = rmse_of(each)
        there = None if second is None else rmse_of(second.of(kind)[curve])
        if curve_origin(kind, curve, baselines.origins) == "recorded":
            light, reason = _light(error, other, rows.get((kind, curve)), second is not None, there)
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
            guess=None if best is None or other is None else best.name,
            guess_error=other,
            known=number(known.get((kind, curve))),
        )
    return CurveLights(**found)


def _distance(errors: CurveErrors, group: str, side: Side) -> float:
    kind, names = GROUPS[group]
    found = _mean([rmse_of(errors.of(kind)[f"{name}_{side[0]}"]) for name in names])
    return np.inf if found is None else found


def _light(
    error: float | None,
    guess: float | None,
    row: Verdict | None,
    looked: bool,
    there: float | None,
) -> tuple[Light, Reason]:
    """Of a recorded curve with an `error`, its `guess`, the `row` of the limit that decides on it,
    and, if the second engine `looked`, the error `there`.
    """
    if error is None:
        return "do not", "too short"
    missed = [] if row is None else row.failed_by
    if "limit" in missed:
        return "do not", "limit"
    if "record" in missed:
        return "do not", "record"
    if guess is None:
        return "with care", "no guess"
    nearer = error < guess * (1.0 - _ROUNDING)
    if "guess" in missed:
        if row is not None and row.state == "not shown":
            return "with care", "not shown"
        return ("with care", "group") if nearer else ("do not", "guess")
    if not nearer:
        # an angle without a limit of its own has no group that may be nearer
        return ("do not", "guess") if row is None else ("with care", "guess nearer")
    if row is not None and row.spread is not None and row.spread.close:
        return "with care", "narrow"
    if looked and (there is None or there >= guess):
        return "with care", "engine"
    return "believe", "nearer"


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
        record = _mean([known.get((kind, curve)) for curve in recorded])
        apart = None
        if second is not None:
            apart = _mean([_apart(walked.of(kind)[c], second.of(kind)[c]) for c in curves])
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
