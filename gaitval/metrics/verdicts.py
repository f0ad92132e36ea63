"""The verdict in words, and what failed: the same texts for the terminal, the report and Python."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final

from gaitval._internal.text.number_text import unit_text
from gaitval.coordinates import split_side
from gaitval.metrics.curve_results import CURVE_UNITS, OF_SKILL
from gaitval.metrics.origin import Origins, furthest, not_recorded
from gaitval.metrics.results import Metrics
from gaitval.metrics.tolerances import AcceptanceState, Verdict, load_registry

SIGNS: Final[Mapping[str, str]] = {
    "at_most": "≤",
    "at_least": "≥",
    "above": ">",
    "exactly": "=",
}

CURVE_NAMES: Final[Mapping[str, str]] = {
    "hip_flexion": "hip flexion",
    "hip_adduction": "hip adduction",
    "hip_rotation": "hip internal rotation",
    "knee_angle": "knee flexion",
    "ankle_angle": "ankle dorsiflexion",
    "subtalar_angle": "subtalar inversion",
    "pelvis_tilt": "pelvis anterior tilt",
    "pelvis_list": "pelvis obliquity",
    "pelvis_rotation": "pelvis rotation",
    "forward": "anterior-posterior force",
    "medial": "mediolateral force",
    "vertical": "vertical force",
}
"""Of the targets of measures, in the words of gait analysis."""


GUESSES: Final[Mapping[str, str]] = {
    "line through others": "the line through others",
    "expected of anybody": "what is expected of anybody",
    "nearest trial copied": "the nearest trial, copied,",
    "line through two trials": "the line through two trials",
    "other people's change added": "the nearest trial with other people's change added",
}
"""Predictions without a model as an object in a sentence, by their names."""


@dataclass(frozen=True)
class LimitVerdict:
    """A limit, and the verdicts on everything it was applied to.

    Attributes
    ----------
    rows : of `tolerances` in `metrics.json`, one a target.
    remedy : what to do where it fails.
    """

    rows: tuple[Verdict, ...]
    remedy: str

    @property
    def first(self) -> Verdict:
        """A row, for what all of them have."""
        return self.rows[0]

    @property
    def failed(self) -> list[Verdict]:
        """The rows that miss the limit."""
        return [row for row in self.rows if not row.passed]

    @property
    def passed(self) -> bool:
        """Whether every target keeps the limit."""
        return not self.failed

    @property
    def state(self) -> AcceptanceState:
        """Passed, failed, or where nothing failed but something was not shown, that."""
        states = {row.state for row in self.failed}
        return "passed" if not states else "not shown" if states == {"not shown"} else "failed"

    @property
    def worst(self) -> Verdict:
        """The row furthest on the wrong side, of those that failed if any did; one that was not
        measured, if any.
        """
        # below a lower limit the smallest value is the worst
        sign = -1.0 if self.first.limit in ("at_least", "above") else 1.0
        return max(
            self.failed or self.rows,
            key=lambda row: math.inf if row.value is None else sign * row.value,
        )

    @property
    def close(self) -> list[Verdict]:
        """The rows that keep the limit, but would not in every repeat."""
        return [row for row in self.rows if row.passed and row.spread and row.spread.close]

    def value_text(self) -> str:
        """The worst value with its unit."""
        return value_text(self.worst)

    def limit_text(self) -> str:
        """The limit with sign and unit."""
        return bound_text(self.first, self.first.tolerance)

    def reason_text(self) -> str:
        """What its worst row was not nearer than; nothing for limits on other measures."""
        return "" if self.passed else reason_text(self.worst)

    @property
    def guess(self) -> tuple[int, int] | None:
        """How many rows the best prediction without a model meets in the place of the walk, and of
        how many; None where no prediction has what is judged, such as falls.
        """
        beside = [row.guess_within for row in self.rows if row.guess_within is not None]
        return (sum(beside), len(beside)) if beside else None


def limit_verdicts(metrics: Metrics, role: str | None = None) -> list[LimitVerdict]:
    """Every limit applied to the walk in `metrics`, failed ones first: of one `role` ("acceptance"
    or "context"), or all.
    """
    remedies = {each.id: each.remedy for each in load_registry().tolerance}
    found = [
        LimitVerdict(tuple(rows), remedy or remedies.get(name, ""))
        for name, group in groupby(metrics.tolerances, key=lambda row: row.id)
        for rows in (list(group),)
        # of what failed, if anything did: it may say why this walk did
        for remedy in (min(rows, key=lambda row: row.passed).remedy,)
        if role in (None, rows[0].role)
    ]
    return sorted(found, key=lambda each: each.passed)


def counted_limits(metrics: Metrics, role: str | None = None) -> list[LimitVerdict]:
    """Those of `limit_verdicts` that verdicts count and list: their sources were read in full.
    Those of status "unread" are in the list of all limits alone.
    """
    return [each for each in limit_verdicts(metrics, role) if each.first.verified]


def failed_limits(metrics: Metrics) -> list[LimitVerdict]:
    """The failed ones of `counted_limits` in `metrics`: acceptance limits first, then context."""
    return [
        each
        for role in ("acceptance", "context")
        for each in counted_limits(metrics, role)
        if not each.passed
    ]


def reason_text(row: Verdict) -> str:
    """Why the skill `row` of a curve did not pass; nothing for other rows."""
    if row.guess is None or row.passed:
        return ""
    parts = []
    if "limit" in row.failed_by:
        known = "not shown to be nearer" if row.state == "not shown" else "not nearer"
        parts.append(f"{known} than {GUESSES.get(row.guess.guess, row.guess.guess)}")
    if "record" in row.failed_by and row.known is not None:
        parts.append(f"the measurement is known to ±{row.known:.2g}{_curve_unit(row)}")
    return "; ".join(parts)


def spread_text(row: Verdict) -> str:
    """The value of a `row` in repeats: "0.87-1.12° in 8 of 8 walks"; empty where none were made."""
    spread = row.spread
    if spread is None:
        return ""
    pushes = row.measure == "push_survival"
    count = f"{spread.kept} of {spread.repeats} {'pushes' if pushes else 'walks'}"
    if spread.low is None:
        return count
    return f"{spread.low:.3g}–{spread.high:.3g}{unit_text(row.unit)}, {count}"


def close_text(row: Verdict) -> str:
    """Why a `row` that meets its limit may not meet it again."""
    if row.measure == "push_survival":
        return "passes, but one push less survived would fail it"
    if row.spread is not None and row.spread.kept < row.spread.repeats:
        return "passes, but not in every repeated walk"
    return "passes, but one more walk may fail it"


def value_text(row: Verdict) -> str:
    """The value of a `row` with its unit; of a skill, the two errors that it is made from."""
    if row.value is None:
        return "not measured"
    if row.guess is not None and row.guess.walk is not None:
        unit = _curve_unit(row)
        return f"{row.guess.walk:.2g}{unit}, prediction {row.guess.error:.2g}{unit}"
    return f"{row.value:.3g}{unit_text(row.unit)}".replace("-", "−", row.value < 0)


def _curve_unit(row: Verdict) -> str:
    """The unit of the curve that the skill `row` is of."""
    return unit_text(CURVE_UNITS[OF_SKILL[row.measure]])


def bound_text(row: Verdict, bound: float | None) -> str:
    """The limit or goal `bound` of a `row`, with sign and unit; empty without one."""
    if row.measure in OF_SKILL:
        return "nearer"
    return "" if bound is None else f"{SIGNS[row.limit]} {bound:g}{unit_text(row.unit)}"


def target_text(target: str) -> str:
    """The `target` of a measure in words: "left knee flexion"; empty for the whole walk."""
    side, name = split_side(target)
    if target == "walk":
        return ""
    return f"{side} {CURVE_NAMES.get(name, name.replace('_', ' '))}".strip()


def sentence(metrics: Metrics, where: str = "") -> str:
    """The verdict of `metrics` in one sentence; what was not recorded is named as not judged.
    `where` says of a walk what beside its speed nothing was recorded with.
    """
    every = counted_limits(metrics)
    if not metrics.is_recorded_at_all:
        speed = metrics.record.spatiotemporal.walking_speed
        return (
            f"Nothing was recorded at {speed:.3g} m/s{where}: accuracy is not judged. The walk "
            f"itself: {sum(each.passed for each in every)} of {len(every)} limits kept."
        )
    counts = []
    for role in ("acceptance", "context"):
        some = [each for each in every if each.first.role == role]
        failed = sum(each.state == "failed" for each in some)
        unshown = sum(each.state == "not shown" for each in some)
        counts.append(
            f"no {role} limit was judged"
            if not some
            else f"all {len(some)} {role} limits passed"
            if not failed + unshown
            else ", ".join(
                f"{count} of {len(some)} {role} limits {word}"
                for count, word in ((failed, "failed"), (unshown, "not shown to be kept"))
                if count
            )
        )
    first, second = counts
    close = sum(len(each.close) for each in every if each.first.role == "acceptance")
    narrow = f" {close} accepted {'value passes' if close == 1 else 'values pass'} narrowly."
    message = f"{first[0].upper()}{first[1:]}; {second}.{narrow if close else ''}"
    message += nearness(metrics)
    return message + unjudged_text(metrics.origins)


def nearness(metrics: Metrics) -> str:
    """To how many curves the walk is nearer than any prediction without a model, and what the
    limits say of the best one; empty without one.
    """
    found = metrics.summary
    if not found.curves:
        return ""
    return (
        f" Nearer than the best prediction without a model: {found.nearer} of {found.curves} "
        f"curves; that prediction meets {found.guess_within} of {found.guess_judged} limits."
    )


def unjudged_text(origins: Origins) -> str:
    """What the walk is not judged by, and why, by its `origins`; empty if all was recorded."""
    reasons = {
        "mirrored": "mirrored from the other side",
        "expected": "only expected",
        "predicted": "predicted by gaitval",
    }
    by_reason: dict[str, dict[str, list[str]]] = {}
    for quantity, side, origin in not_recorded(origins):
        by_reason.setdefault(origin, {}).setdefault(quantity, []).append(side)
    messages = [
        f"{_listed([n if len(sides) > 1 else f'{sides[0]} {n}' for n, sides in found.items()])} "
        f"({reasons[origin]})"
        for origin, found in by_reason.items()
    ]
    return f" Not recorded, so not judged: {'; '.join(messages)}." if messages else ""


def not_judged(metrics: Metrics) -> str:
    """Why the verdict of `metrics` is none: of what decides, whole kinds were judged on neither
    side, such as moments of a walk recorded without forces. Empty where something of each was.
    """
    missing: dict[str, str] = {}
    for quantity, sides in metrics.origins.items():
        if "recorded" not in sides.values():
            missing[quantity] = furthest(list(sides.values()))
    if missing:
        reasons = ", ".join(f"{name} ({origin})" for name, origin in missing.items())
        return f"Not judged, because not recorded: {reasons}."
    if not any(row.role == "acceptance" for row in metrics.tolerances):
        return "Not judged: no limit that decides was put to any value."
    return ""


def _listed(words: Sequence[str]) -> str:
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)
