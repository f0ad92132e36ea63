"""Rows of measures and verdicts in `metrics.json`, and how far a verdict can be relied on: the same
value in repeated walks, or over many pushes.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from scipy.special import ndtri, stdtrit

from gaitval.metrics.curve_results import OF_SKILL, RMSE
from gaitval.metrics.origin import Origins, is_judged, measure_origin, status
from gaitval.metrics.results import (
    ComparedMeasure,
    Endurance,
    ErrorRow,
    Learned,
    PushRecovery,
    Repeat,
    Summary,
)
from gaitval.metrics.tolerances import Measure, Spread, Verdict, evaluate
from gaitval.metrics.typed import number

ENDURANCE = ("consecutive_cycles", "falls")
"""Measures of how far walks go. Not of the second engine: it walks the compared cycles only."""


CONFIDENCE: Final = 0.9
"""Of intervals, and of bands around predicted curves: the share of people whose curve is within, at
each percent of the cycle."""

Repeated = Mapping[tuple[str, str], Sequence[float | None]]
"""Values by measure and target, one a repeat; None where it could not be measured."""


def repeated_values(repeats: Sequence[Repeat]) -> Repeated:
    """The values of `repeats` of a walk, by measure and target."""
    found: dict[tuple[str, str], list[float | None]] = {}
    for repeat in repeats:
        for measure, targets in repeat.measures.items():
            for target, value in targets.items():
                found.setdefault((measure, target), []).append(value)
    return found


def prediction_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Where one more value falls with probability `CONFIDENCE` if `values` are normal (Student's
    t); None with fewer than three.
    """
    count = len(values)
    if count < 3:
        return None
    t = float(stdtrit(count - 1, 0.5 + 0.5 * CONFIDENCE))
    # the 1 is the scatter of the new value, 1/n that of the mean
    half = t * float(np.std(values, ddof=1)) * math.sqrt(1.0 + 1.0 / count)
    mean = float(np.mean(values))
    return mean - half, mean + half


def share_interval(kept: int, count: int) -> tuple[float, float]:
    """Wilson's score interval (Wilson 1927), from 0 to 1, of the share `kept` of `count`."""
    # unlike p ± z √(p q / n), the score interval stays within 0 and 1, also where all are kept
    z = float(ndtri(0.5 + 0.5 * CONFIDENCE))
    share, grown = kept / count, 1.0 + z * z / count
    middle = (share + z * z / (2 * count)) / grown
    half = z * math.sqrt(share * (1.0 - share) / count + z * z / (4 * count * count)) / grown
    return max(middle - half, 0.0), min(middle + half, 1.0)


def spread_of(verdict: Verdict, values: Sequence[float | None]) -> Spread | None:
    """The spread of `verdict` over the `values` of repeated walks; None without any."""
    if not values:
        return None
    kept = sum(map(verdict.holds, values))
    found = [value for value in values if value is not None]
    interval = prediction_interval(found)
    if interval is None:
        close = verdict.passed and kept < len(values)
        return Spread(repeats=len(values), kept=kept, low=None, high=None, close=close)
    low, high = interval
    if min(found) >= 0.0 and not verdict.measure.endswith("_skill"):
        # sizes of errors have no other side; a skill below zero is worse than its opponent
        low = max(low, 0.0)
    worst = low if verdict.limit in ("at_least", "above") else high
    beyond = kept < len(values) or not verdict.holds(worst)
    return Spread(
        repeats=len(values),
        kept=kept,
        low=number(low),
        high=number(high),
        close=verdict.passed and beyond,
    )


def spread_of_pushes(verdict: Verdict, survived: int, count: int) -> Spread:
    """The spread of `verdict` on the share, %, of `survived` among `count` pushes."""
    low, high = (100.0 * end for end in share_interval(survived, count))
    # a share near its limit is judged by single pushes, not by its wide interval
    close = verdict.passed and not verdict.holds(100.0 * (survived - 1) / count)
    return Spread(repeats=count, kept=survived, low=low, high=high, close=close)


def spread_of_falls(falls: int, walks: int) -> Spread:
    """The spread of a number of `falls` in `walks`: walks without a fall, and the interval of how
    many of as many new walks would fall.
    """
    # Jeffreys' prior of the share
    from scipy import stats  # a third of a second, for who falls

    later = stats.betabinom(walks, falls + 0.5, walks - falls + 0.5)
    low, high = later.ppf([0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE])
    return Spread(repeats=walks, kept=walks - falls, low=low, high=high, close=False)


def spread_in_repeats(
    verdict: Verdict, repeated: Repeated, pushes: PushRecovery | None, starts: Sequence[Endurance]
) -> Spread | None:
    """The spread of `verdict` over `pushes`, over `starts`, or else over `repeated` walks."""
    measure, target = verdict.measure, verdict.target
    if measure == "push_survival" and pushes is not None:
        survived = pushes.survived[pushes.targets().index(target)]
        return spread_of_pushes(verdict, sum(survived), len(survived))
    if measure == "falls":
        return spread_of_falls(sum(start.fell for start in starts), len(starts))
    if measure == "consecutive_cycles":
        return spread_of(verdict, [float(start.cycles.right) for start in starts])
    return spread_of(verdict, repeated.get((measure, target), ()))


def judged(measures: Sequence[Measure], origins: Origins) -> list[Verdict]:
    """The verdicts on those of `measures` whose `origins` are a record, or that need none."""
    return evaluate(
        [each for each in measures if is_judged(measure_origin(each.measure, each.target, origins))]
    )


def measure_rows(
    measures: Sequence[Measure], known_by: Mapping[str, Sequence[str]], origins: Origins
) -> list[ComparedMeasure]:
    """`measures` with their origins and whether their reference was known to the run (`known_by`:
    what read each quantity). Skill is left out where there is no record to compare with.
    """
    known = [quantity for quantity, read_by in known_by.items() if read_by]
    return [
        ComparedMeasure(**each.as_dict(), comparison=status(each.measure, known), origin=origin)
        for each in measures
        if is_judged(origin := measure_origin(each.measure, each.target, origins))
        or each.measure not in OF_SKILL
    ]


def summary(
    verdicts: Sequence[Verdict],
    errors: Sequence[ErrorRow] = (),
    learned: Learned | None = None,
) -> Summary:
    """How many of `verdicts` with role acceptance passed, of how many curves the walk is nearer to
    the measured one than any prediction without a model, how many limits of curves the best one
    would meet, the `errors` of the walk and what was `learned`.
    """
    deciding = [verdict for verdict in verdicts if verdict.role == "acceptance"]
    skills = [verdict for verdict in deciding if verdict.measure in OF_SKILL]
    beside = [verdict for verdict in verdicts if _is_of_curve(verdict)]
    return Summary(
        accepted=sum(verdict.passed for verdict in deciding),
        refused=sum(not verdict.passed for verdict in deciding),
        not_shown=sum(verdict.state == "not shown" for verdict in deciding),
        curves=len(skills),
        nearer=sum("limit" not in verdict.failed_by for verdict in skills),
        guess_judged=len(beside),
        guess_within=sum(bool(verdict.guess_within) for verdict in beside),
        errors=list(errors),
        learned=learned,
    )


def _is_of_curve(verdict: Verdict) -> bool:
    """Whether it is one of gaitval's own limits on the error of a curve, which a prediction without
    a model has too.
    """
    own = verdict.citation == "gaitval" and verdict.measure in RMSE.values()
    return own and verdict.guess_within is not None
