"""Whether a policy needs training for a person, and what a training gave: the trained policy beside
its start, and which of them is handed on.

`metrics.policy_comparison` walks them.
"""

import math
from pathlib import Path
from typing import Final, Literal

from gaitval._internal.io.artefacts import read_json
from gaitval.metrics.curve_results import Epsilon
from gaitval.metrics.typed import Count, Number, OpenResult, Result

NEEDED: Final = (
    "A policy is trained further for a person only if it needs it: on walks that were not used for "
    "learning it falls, or survives at a phase of the gait cycle fewer than {limit:g} % of the "
    "pushes from within 90 degrees of straight ahead, the acceptance limit."
)
FURTHER: Final = 1.25
"""By this factor a policy that survives more pushes may be further from the record. Strangers'
walks were after their correction as near to it whatever this was, from 0.8 to 1.3
(docs/learning.md)."""
RULE: Final = (
    "The trained policy is handed on if, on walks that were not used for learning, it falls in "
    "fewer of them than the policy that its training started from; or in as many, and survives "
    f"more pushes with an epsilon, its distance from the record, of at most {FURTHER:g} times the "
    "other's, since a correction follows; or as many, and is no further from the record. Otherwise "
    "that one is."
)


class Standing(Result):
    """How a policy walks where it did not learn."""

    walks: Count
    """Without a push, one from each start phase."""
    falls: Count
    """Walks that ended in a fall."""
    pushes: Count
    survived: Count
    weakest_phase: Number
    """Share of the pushes from within 90 degrees of straight ahead, which are judged, that is
    survived at the phase where it is smallest, %."""
    epsilon: Number | None
    """Mean over the walks; null if one of them has no complete gait cycle."""
    scatter: Number | None
    """Standard deviation of epsilon over the walks."""
    error: Epsilon | None = None
    """Epsilon with its parts; null, too, in a file from before it was kept."""

    def needs_training(self, limit: float) -> bool:
        """Whether it does, by `NEEDED`, with its `limit`, %."""
        return self.falls > 0 or self.weakest_phase < limit

    def lacking(self, limit: float) -> tuple[int, int]:
        """Falls and pushes not survived of who needs training by the `limit`, %; else none."""
        needs = self.needs_training(limit)
        return (self.falls, self.pushes - self.survived) if needs else (0, 0)

    def is_handed_on_after(self, other: "Standing") -> bool:
        """Whether what was trained from the `other` is, by `RULE`."""
        # without a complete cycle there is no epsilon: infinitely far; of two such it is NaN
        further = (self.epsilon or math.inf) / (other.epsilon or math.inf)
        if self.falls != other.falls:
            return self.falls < other.falls
        if self.survived != other.survived:
            return self.survived > other.survived and not further > FURTHER
        return not further > 1.0


class LearningGain(OpenResult):
    """The policy at the start and at the end of a training, and which of them is handed on."""

    samples: Count
    """Environment steps of the training; 0 if the start needed none."""
    start: Standing | None
    """Null for a training from nothing."""
    trained: Standing
    rule: str
    handed_on: Literal["trained", "start"]
    """By the rule; what was learned from nothing always is."""

    @classmethod
    def of(cls, samples: int, start: Standing | None, trained: Standing) -> "LearningGain":
        """What a training gave, by `RULE`."""
        better = start is None or trained.is_handed_on_after(start)
        handed_on: Literal["trained", "start"] = "trained" if better else "start"
        return cls(samples=samples, start=start, trained=trained, rule=RULE, handed_on=handed_on)

    @classmethod
    def none_needed(cls, start: Standing, limit: float) -> "LearningGain":
        """Of a policy that needed no training, by `NEEDED` with its `limit`, %."""
        rule = NEEDED.format(limit=limit)
        return cls(samples=0, start=start, trained=start, rule=rule, handed_on="start")

    @property
    def trained_is_handed_on(self) -> bool:
        """Whether the trained policy is the one that is handed on."""
        return self.handed_on == "trained"

    @property
    def standing(self) -> Standing:
        """Of the policy that is handed on."""
        return self.trained if self.start is None or self.trained_is_handed_on else self.start

    def in_words(self) -> str:
        """A sentence for the user."""
        trained, start = self.trained, self.start
        if start is None:
            return f"Learning from nothing: {_in_words(trained)}."
        if self.samples == 0:
            return f"No training was needed: {_in_words(start)}."
        kept = "handed on" if self.trained_is_handed_on else "the start is handed on"
        return (
            f"What {self.samples:,} samples gave: {_in_words(start)} before, {_in_words(trained)} "
            f"after; {kept}."
        )


def _in_words(standing: Standing) -> str:
    epsilon = "no whole cycle" if standing.epsilon is None else f"epsilon {standing.epsilon:.4f}"
    falls = f", {standing.falls} of {standing.walks} walks fell" if standing.falls else ""
    return f"{epsilon}, {standing.survived} of {standing.pushes} pushes survived{falls}"


EPSILON: Final = "epsilon.json"
"""Of a round: `RoundErrors`."""


class RoundErrors(Result):
    """Epsilon of the policy of one round of Algorithm 1: `epsilon.json`, with all digits."""

    nominal: Epsilon | None
    """With the nominal body, mean over the start phases; null if a walk was too short."""
    identified: Epsilon | None
    """The same with the body that was found."""
    scatter: Number | None
    """SD of epsilon over the start phases."""
    floor: Number
    """Epsilon of the reference itself."""

    @property
    def total(self) -> float:
        """Epsilon with the body that was found; infinite if the walker fell early."""
        return _total(self.identified)

    @property
    def supported(self) -> bool:
        """Whether the walk with the body that the search found is nearer to the record, by epsilon,
        than with the nominal body, for which the reference was made. Else the body stays nominal.
        """
        if self.identified is None:
            return self.nominal is None
        return self.total < _total(self.nominal)


def _total(error: Epsilon | None) -> float:
    return math.inf if error is None or error.total is None else error.total


def read_round(folder: Path) -> RoundErrors:
    """The errors of a finished round, of its folder. Raises ArtefactError."""
    path = folder / EPSILON
    return RoundErrors.read(
        read_json(path), str(path), file=EPSILON, fix="run `gaitval subject` again"
    )
