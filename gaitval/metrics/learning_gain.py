"""What a training gave: the trained policy beside its start, and which of them is handed on.

`metrics.policy_comparison` walks them.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

RULE: Final = (
    "The trained policy is handed on if, on walks that were not used for learning, it falls in no "
    "more of them, survives no fewer pushes and is no further from the record (epsilon) than the "
    "policy that its training started from; otherwise that one is."
)


@dataclass(frozen=True)
class Standing:
    """How a policy walks where it did not learn.

    Attributes
    ----------
    walks, falls : walks without a push, one from each start phase, and those that ended in a fall.
    pushes, survived : pushes, and those that were survived.
    epsilon : mean over the walks; None if one of them has no complete gait cycle.
    scatter : standard deviation of epsilon over the walks.
    """

    walks: int
    falls: int
    pushes: int
    survived: int
    epsilon: float | None
    scatter: float | None

    def not_worse_than(self, other: "Standing") -> bool:
        """Whether it is worse in nothing."""
        nearer = (self.epsilon or math.inf) <= (other.epsilon or math.inf)
        return self.falls <= other.falls and self.survived >= other.survived and nearer


@dataclass(frozen=True)
class LearningGain:
    """The policy at the start and at the end of a training.

    Attributes
    ----------
    samples : environment steps of the training.
    start : None for a training from nothing.
    """

    samples: int
    start: Standing | None
    trained: Standing

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "LearningGain":
        """What `as_dict` gave."""
        start = None if values["start"] is None else Standing(**values["start"])
        return cls(values["samples"], start, Standing(**values["trained"]))

    @property
    def trained_is_handed_on(self) -> bool:
        """By `RULE`; what was learned from nothing always is."""
        return self.start is None or self.trained.not_worse_than(self.start)

    def as_dict(self) -> dict[str, Any]:
        """To be written as JSON, with the rule and what follows from it."""
        handed_on = "trained" if self.trained_is_handed_on else "start"
        return {**asdict(self), "rule": RULE, "handed_on": handed_on}

    def in_words(self) -> str:
        """A sentence for the user."""
        trained, start = self.trained, self.start
        if start is None:
            return f"Learning from nothing: {_in_words(trained)}."
        kept = "handed on" if self.trained_is_handed_on else "the start is handed on"
        return (
            f"What {self.samples:,} samples gave: {_in_words(start)} before, {_in_words(trained)} "
            f"after; {kept}."
        )


def _in_words(standing: Standing) -> str:
    epsilon = "no whole cycle" if standing.epsilon is None else f"epsilon {standing.epsilon:.4f}"
    falls = f", {standing.falls} of {standing.walks} walks fell" if standing.falls else ""
    return f"{epsilon}, {standing.survived} of {standing.pushes} pushes survived{falls}"
