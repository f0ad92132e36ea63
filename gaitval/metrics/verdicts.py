"""The verdict in words, and what failed: one account for the terminal, the report and Python."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, Final

from gaitval.coordinates import split_side
from gaitval.metrics.origin import is_recorded_at_all, not_judged
from gaitval.metrics.tolerances import load_registry

Json = Mapping[str, Any]

SIGNS: Final[Mapping[str, str]] = {"at_most": "≤", "at_least": "≥", "exactly": "="}

CURVE_NAMES: Final[Mapping[str, str]] = {
    "hip_flexion": "hip flexion",
    "hip_adduction": "hip adduction",
    "hip_rotation": "hip rotation",
    "knee_angle": "knee flexion",
    "ankle_angle": "ankle dorsiflexion",
    "subtalar_angle": "subtalar inversion",
    "pelvis_tilt": "pelvis tilt",
    "pelvis_list": "pelvis list",
    "pelvis_rotation": "pelvis rotation",
    "forward": "fore-aft force",
    "medial": "medial force",
    "vertical": "vertical force",
}
"""Of the targets of measures, in the words of gait analysis."""


@dataclass(frozen=True)
class LimitResult:
    """A limit, and what became of all that it was put to.

    Attributes
    ----------
    rows : of `tolerances` in `metrics.json`, one a target.
    remedy : what to do where it fails.
    """

    rows: tuple[Json, ...]
    remedy: str

    @property
    def first(self) -> Json:
        """A row, for what all of them have."""
        return self.rows[0]

    @property
    def failed(self) -> list[Json]:
        """The rows that miss the limit."""
        return [row for row in self.rows if not row["passed"]]

    @property
    def passed(self) -> bool:
        """Whether every target keeps the limit."""
        return not self.failed

    @property
    def worst(self) -> Json:
        """The row furthest on the wrong side; one that was not measured, if any."""
        unmeasured = [row for row in self.rows if row["value"] is None]
        if unmeasured:
            return unmeasured[0]
        sign = -1.0 if self.first["limit"] == "at_least" else 1.0
        return max(self.rows, key=lambda row: sign * row["value"])

    @property
    def close(self) -> list[Json]:
        """The rows that keep the limit, but would not in every repeat."""
        return [
            row for row in self.rows if row["passed"] and (row.get("spread") or {}).get("close")
        ]

    def value_text(self) -> str:
        """The worst value with its unit."""
        return value_text(self.worst)

    def limit_text(self) -> str:
        """The limit with sign and unit."""
        return bound_text(self.first, self.first["tolerance"])

    def goal_text(self) -> str:
        """The goal with sign and unit; nothing without one."""
        return bound_text(self.first, self.first["goal"])


def limit_results(metrics: Json, role: str | None = None) -> list[LimitResult]:
    """Every limit that was put to the walk, those that failed first.

    Parameters
    ----------
    role : "acceptance" or "context"; all if none is given.
    """
    remedies = {each.id: each.remedy for each in load_registry().tolerance}
    found = [
        LimitResult(tuple(rows), rows[0].get("remedy") or remedies.get(name, ""))
        for name, group in groupby(metrics["tolerances"], key=lambda row: str(row["id"]))
        for rows in (list(group),)
        if role in (None, rows[0]["role"])
    ]
    return sorted(found, key=lambda each: each.passed)


def failed_limits(metrics: Json) -> list[LimitResult]:
    """What failed: acceptance limits first, then context."""
    return [
        each
        for role in ("acceptance", "context")
        for each in limit_results(metrics, role)
        if not each.passed
    ]


def spread_text(row: Json) -> str:
    """A row's value in repeats: "0.87-1.12° in 8 of 8 walks"; nothing where none were made."""
    spread = row.get("spread")
    if spread is None:
        return ""
    pushes = row["measure"] == "push_survival"
    count = f"{spread['kept']} of {spread['repeats']} {'pushes' if pushes else 'walks'}"
    if spread["low"] is None:
        return count
    interval = f"{spread['low']:.3g}–{spread['high']:.3g}{unit_text(row['unit'])}"
    return f"{interval}, {count}"


def close_text(row: Json) -> str:
    """Why a row that keeps its limit may not keep it again."""
    if row["measure"] == "push_survival":
        return "passes, but one push less survived would fail it"
    if row["spread"]["kept"] < row["spread"]["repeats"]:
        return "passes, but not in every repeated walk"
    return "passes, but one more walk may fail it"


def unit_text(unit: str) -> str:
    """A unit as written after a number."""
    return {"deg": "°", "1": ""}.get(unit, f" {unit}")


def value_text(row: Json) -> str:
    """A row's value with its unit."""
    if row["value"] is None:
        return "not measured"
    return f"{row['value']:.3g}{unit_text(row['unit'])}"


def bound_text(row: Json, bound: float | None) -> str:
    """A limit or goal of a row with sign and unit; nothing without one."""
    return "" if bound is None else f"{SIGNS[row['limit']]} {bound:g}{unit_text(row['unit'])}"


def target_text(target: str) -> str:
    """A measure's target in words: "left knee flexion"; nothing for the whole walk."""
    side, name = split_side(target)
    if target == "walk" or not side:
        return "" if target == "walk" else target
    return f"{side} {CURVE_NAMES.get(name, name.replace('_', ' '))}"


def sentence(metrics: Json) -> str:
    """The verdict in one sentence: it says of what was not recorded that it is not judged."""
    every = limit_results(metrics)
    if not is_recorded_at_all(metrics):
        speed = metrics["record"]["spatiotemporal"]["walking_speed"]
        return (
            f"Nothing was recorded at {speed:.3g} m/s: accuracy is not judged. The walk itself: "
            f"{sum(each.passed for each in every)} of {len(every)} limits kept."
        )
    counts = []
    for role in ("acceptance", "context"):
        some = [each for each in every if each.first["role"] == role]
        failed = sum(not each.passed for each in some)
        counts.append(
            f"all {len(some)} {role} limits passed"
            if not failed
            else f"{failed} of {len(some)} {role} limits failed"
        )
    first, second = counts
    close = sum(len(each.close) for each in every if each.first["role"] == "acceptance")
    narrow = f" {close} accepted {'value passes' if close == 1 else 'values pass'} narrowly."
    return (
        f"{first[0].upper()}{first[1:]}; {second}.{narrow if close else ''}{unjudged_text(metrics)}"
    )


def unjudged_text(metrics: Json) -> str:
    """What the walk is not judged by, and why; nothing if everything was recorded."""
    reasons = {
        "mirrored": "mirrored from the other side",
        "expected": "only expected",
        "predicted": "predicted by gaitval",
    }
    by_reason: dict[str, dict[str, list[str]]] = {}
    for quantity, side, origin in not_judged(metrics):
        by_reason.setdefault(origin, {}).setdefault(quantity, []).append(side)
    said = [
        f"{_listed([_quantity_text(name, sides) for name, sides in found.items()])} "
        f"({reasons[origin]})"
        for origin, found in by_reason.items()
    ]
    return f" Not recorded, so not judged: {'; '.join(said)}." if said else ""


def _quantity_text(name: str, sides: Sequence[str]) -> str:
    return name if len(sides) > 1 else f"{sides[0]} {name}"


def _listed(words: Sequence[str]) -> str:
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)
