"""Walks of many people, and of the same people before and after a change of the program."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gaitval.apps.regression.regression import Allowed, Row, compare
from gaitval.metrics.results import Metrics


@dataclass(frozen=True)
class StoredWalk:
    """The metrics of a run folder or of a stored baseline.

    Attributes
    ----------
    folder : that they were read from.
    metrics : of its `metrics.json`.
    margins : by measure, those that a baseline was stored with; None of a run folder.
    """

    folder: Path
    metrics: Metrics
    margins: Mapping[str, Allowed] | None

    @property
    def subject(self) -> str:
        """Identifier of the person."""
        return self.metrics.subject.identifier


@dataclass(frozen=True)
class WalkPair:
    """The walks of one person before and now.

    Attributes
    ----------
    rows : every measure, with the margins that the one before was stored with.
    same_record : whether both are compared with the same recorded gait.
    """

    before: StoredWalk
    now: StoredWalk
    rows: tuple[Row, ...]
    same_record: bool


@dataclass(frozen=True)
class Versions:
    """Two versions, matched by subject.

    Attributes
    ----------
    only_before, only_now : subjects without a counterpart.
    """

    pairs: tuple[WalkPair, ...]
    only_before: tuple[str, ...]
    only_now: tuple[str, ...]

    def lost(self) -> list[tuple[str, Row]]:
        """Subject and row of each measure that got worse by more than its margin."""
        return self._with("lost")

    def improved(self) -> list[tuple[str, Row]]:
        """Subject and row of each measure that got better by more than its margin."""
        return self._with("improved")

    def _with(self, change: str) -> list[tuple[str, Row]]:
        found = [
            (pair.now.subject, row) for pair in self.pairs for row in pair.rows
            if row.change == change
        ]  # fmt: skip
        return sorted(found, key=lambda each: -abs(in_margins(each[1]) or float("inf")))


def matched(before: Sequence[StoredWalk], now: Sequence[StoredWalk]) -> Versions:
    """The walks of the same people in `before` and `now`; nobody may be in one of them twice."""
    then, here = ({walk.subject: walk for walk in walks} for walks in (before, now))
    assert len(then) == len(before)
    assert len(here) == len(now)
    return Versions(
        pairs=tuple(_pair(then[name], walk) for name, walk in here.items() if name in then),
        only_before=tuple(name for name in then if name not in here),
        only_now=tuple(name for name in here if name not in then),
    )


def _pair(before: StoredWalk, now: StoredWalk) -> WalkPair:
    records = {walk.metrics.provenance.record for walk in (before, now)}
    return WalkPair(
        before=before,
        now=now,
        rows=tuple(compare(before.metrics, now.metrics, margins=before.margins)),
        same_record=len(records) == 1,
    )


def twice(walks: Sequence[StoredWalk]) -> list[str]:
    """Subjects of whom there is more than one of `walks`."""
    return [name for name, count in Counter(walk.subject for walk in walks).items() if count > 1]


def in_margins(row: Row) -> float | None:
    """How much the measure of a `row` grew, in units of its margin; None if it was not measured
    twice, infinite where nothing may change and it did.
    """
    if row.baseline is None or row.current is None:
        return None
    change = row.current - row.baseline
    if row.margin == 0.0:
        return 0.0 if change == 0.0 else float("inf") if change > 0.0 else -float("inf")
    return change / row.margin
