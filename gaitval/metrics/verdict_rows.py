"""Rows of measures and verdicts in `metrics.json`."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from gaitval.metrics.origin import SKILLS, Origins, is_judged, measure_origin
from gaitval.metrics.rollouts import Endurance
from gaitval.metrics.spread import (
    Repeated,
    Spread,
    spread_of,
    spread_of_falls,
    spread_of_pushes,
)
from gaitval.metrics.told_measures import status
from gaitval.metrics.tolerances import UNITS, Measure, Verdict, evaluate

Json = dict[str, Any]


def spread_in_repeats(
    verdict: Verdict,
    repeated: Repeated,
    pushes: Mapping[str, Any] | None,
    starts: Sequence[Endurance],
) -> Spread | None:
    """A verdict in repeats: of walks, of pushes, of starts."""
    measure, target = verdict.tolerance.measure, verdict.target
    if measure == "push_survival" and pushes is not None:
        phases = [f"phase {phase:g}" for phase in pushes["phases"]]
        survived = pushes["survived"][phases.index(target)]
        return spread_of_pushes(verdict, sum(survived), len(survived))
    if measure == "falls":
        return spread_of_falls(sum(start.fell for start in starts), len(starts))
    if measure == "consecutive_cycles":
        return spread_of(verdict, [float(start.cycles["right"]) for start in starts])
    return spread_of(verdict, repeated.get((measure, target), ()))


def verdict_row(verdict: Verdict, spread: Spread | None) -> Json:
    """A verdict with its limit, and its spread where it was repeated."""
    return {
        **verdict.tolerance.model_dump(exclude={"applies_to", "value"}),
        "target": verdict.target,
        "value": verdict.value,
        "tolerance": verdict.tolerance.value,
        "passed": verdict.passed,
        "reached": verdict.reached,
        "spread": None if spread is None else spread.as_dict(),
    }


def judged(measures: Sequence[Measure], origins: Origins) -> list[Verdict]:
    """The verdicts on what is compared with a record, or needs none."""
    return evaluate(
        [each for each in measures if is_judged(measure_origin(each.measure, each.target, origins))]
    )


def measure_rows(
    measures: Sequence[Measure], told: Mapping[str, Sequence[str]], origins: Origins
) -> list[Json]:
    """Measures with their unit, whether what they are compared with was told, and where that comes
    from. Skill against a guess is only told where there is a record to be near to.
    """
    known = [quantity for quantity, read_by in told.items() if read_by]
    return [
        {
            **asdict(each),
            "unit": UNITS[each.measure],
            "comparison": status(each.measure, known),
            "origin": origin,
        }
        for each in measures
        if is_judged(origin := measure_origin(each.measure, each.target, origins))
        or each.measure not in SKILLS
    ]


def summary(verdicts: Sequence[Verdict]) -> Json:
    """How many rows of role acceptance passed, and how many of their goals are reached."""
    deciding = [verdict for verdict in verdicts if verdict.tolerance.role == "acceptance"]
    accepted = [verdict.passed for verdict in deciding]
    goals = [verdict.reached for verdict in deciding if verdict.reached is not None]
    return {
        "accepted": sum(accepted),
        "refused": len(accepted) - sum(accepted),
        "goals": len(goals),
        "goals_reached": sum(goals),
    }
