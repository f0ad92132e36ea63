"""Rows of measures and verdicts in `metrics.json`."""

from collections.abc import Mapping, Sequence

from gaitval.metrics.known_measures import status
from gaitval.metrics.origin import SKILLS, Origins, is_judged, measure_origin
from gaitval.metrics.results import ComparedMeasure
from gaitval.metrics.spread import Repeated, spread_of, spread_of_falls, spread_of_pushes
from gaitval.metrics.tolerances import Measure, Spread, Verdict, evaluate
from gaitval.metrics.verdict_counts import Summary
from gaitval.metrics.walk_results import Endurance, PushRecovery

ENDURANCE = ("consecutive_cycles", "falls")
"""Measures of how far walks go. Not of the second engine: it walks the compared cycles only."""


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
        or each.measure not in SKILLS
    ]


def summary(verdicts: Sequence[Verdict]) -> Summary:
    """How many of `verdicts` with role acceptance passed, and how many reached their goals."""
    deciding = [verdict for verdict in verdicts if verdict.role == "acceptance"]
    accepted = [verdict.passed for verdict in deciding]
    beside = [verdict for verdict in deciding if verdict.guess_passes is not None]
    goals = [verdict.reached for verdict in deciding if verdict.reached is not None]
    return Summary(
        accepted=sum(accepted),
        refused=len(accepted) - sum(accepted),
        not_shown=sum(verdict.state == "not shown" for verdict in deciding),
        guess_judged=len(beside),
        guess_passes=sum(bool(verdict.guess_passes) for verdict in beside),
        guess_within=sum(bool(verdict.guess_within) for verdict in beside),
        goals=len(goals),
        goals_reached=sum(goals),
    )
