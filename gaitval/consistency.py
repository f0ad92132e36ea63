"""What is wrong with an input that contradicts itself: changes weighed by their probability.

An input (a recording, a table of curves, results) is held against what is known of such inputs.
Where it disagrees, each of a set of changes is undone: a sign, a unit, a side, a delay, a place.
The likelihood of the input with each change undone, times the probability that such a mistake is
made, gives the probability of each; "nothing is wrong" and "something else" are among them. Nothing
is named because it fits better than one other: it has to be more probable than all others together.

The same rules hold wherever causes are told apart:

- one cause is named if its probability is `NAMED` or more; otherwise the two or three that together
  reach it, as what cannot be told apart;
- advice that alters data is given above `ADVISED` alone, and never for "something else".
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from scipy.special import logsumexp

NAMED: Final = 0.8
"""Probability from which on one cause is named alone, and a warning is given at all."""
ADVISED: Final = 0.95
"""Probability from which on a remedy that alters data is printed."""
MOST: Final = 3
"""Causes that one sentence names."""
FEWEST: Final = 0.1
"""Probability below which a cause is not named beside another."""
OTHER_PRIOR: Final = 0.02
"""Probability, before the data, of a mistake that is not among the changes."""
WIDEST: Final = 30.0
"""Times its standard deviation that data may be off by a mistake that nobody thought of."""


@dataclass(frozen=True)
class Change:
    """A mistake that may have been made, which is undone to see whether the input then agrees.

    Attributes
    ----------
    name : of the kind of mistake. Changes of one name differ by a parameter (how late, how large):
        their probabilities are added, and the words are those of the likeliest.
    words : what happened, a clause without its point: "the forces come 20 ms late".
    prior : probability of it before the data; of all parameters of one name together one number,
        shared among them.
    remedy : what to do about it, a clause that begins with a verb.
    alters : whether the remedy changes numbers of the input (an option that corrects, a sign).
    """

    name: str
    words: str
    prior: float
    remedy: str = ""
    alters: bool = True


SOUND: Final = Change("none", "nothing is wrong", 1.0, alters=False)
OTHER: Final = Change("something else", "something else is wrong", OTHER_PRIOR, alters=False)


def log_likelihood(square: float, count: float, widest: float = 1.0) -> float:
    """Log probability of data, up to a constant that all changes share.

    Parameters
    ----------
    square : sum of the squares of what is left, each over its variance.
    count : number of independent data.
    widest : up to how many times as large the deviations may be; each size between 1 and it is
        equally probable on a log scale. 1 for a change that explains the data, more for something
        that nobody thought of (`WIDEST`).
    """
    if widest <= 1.0:
        return -0.5 * square
    log_scale = np.linspace(0.0, np.log(widest), 200)
    each = -0.5 * square * np.exp(-2.0 * log_scale) - count * log_scale
    return float(logsumexp(each) - np.log(len(log_scale)))


@dataclass(frozen=True)
class Cause:
    """A kind of mistake and its probability; `change` is its likeliest parameter."""

    change: Change
    probability: float


@dataclass(frozen=True)
class Verdict:
    """Causes of what an input shows, the most probable first, "none" and "something else" among
    them; their probabilities add up to 1.
    """

    causes: tuple[Cause, ...]

    def probability(self, name: str) -> float:
        """Of the cause of this `name`; 0 if it was not looked for."""
        return next((each.probability for each in self.causes if each.change.name == name), 0.0)

    @property
    def sound(self) -> float:
        """Probability that nothing is wrong."""
        return self.probability(SOUND.name)

    @cached_property
    def named(self) -> tuple[Cause, ...]:
        """What a warning names: empty if it is not `NAMED` that something is wrong; one cause, or
        up to `MOST` that reach `NAMED` together.
        """
        if 1.0 - self.sound < NAMED:
            return ()
        found: list[Cause] = []
        for each in self.causes:
            if each.change.name == SOUND.name:
                continue
            if found and each.probability < FEWEST:
                break
            found.append(each)
            if sum(cause.probability for cause in found) >= NAMED or len(found) == MOST:
                break
        return tuple(found)

    @property
    def remedy(self) -> str:
        """What to do, if the cause is certain enough for it; empty otherwise."""
        if len(self.named) != 1:
            return ""
        (cause,) = self.named
        enough = ADVISED if cause.change.alters else NAMED
        return cause.change.remedy if cause.probability >= enough else ""

    def __str__(self) -> str:
        """The causes that are `named`, a clause without its point; empty if there is none."""
        if not self.named:
            return ""
        said = [
            f"{each.change.words} (probability {share(each.probability)})" for each in self.named
        ]
        if len(said) == 1:
            return said[0]
        return (
            f"{', '.join(said[:-1])} or {said[-1]}: these data cannot tell which, so look at each "
            "before you change anything"
        )


def share(probability: float) -> str:
    """A `probability` for a sentence: two digits, never 0 or 1."""
    if probability > 0.99:
        return "over 0.99"
    return f"{probability:.2f}" if probability >= 0.01 else "under 0.01"


def verdict_of(logs: Iterable[tuple[Change, float]]) -> Verdict:
    """The verdict on changes that exclude each other, each with the log of its probability up to a
    constant, "none" and "something else" among them.
    """
    logs = [*logs]
    total = float(logsumexp([log for _, log in logs]))
    found = [Cause(change, float(np.exp(log - total))) for change, log in logs]
    return Verdict(tuple(sorted(found, key=lambda each: -each.probability)))


def weigh(changes: Iterable[tuple[Change, float]], sound: float, other: float) -> Verdict:
    """The probabilities of `changes`.

    Parameters
    ----------
    changes : each with the log likelihood of the data with it undone (`log_likelihood`).
    sound, other : log likelihood of the data as they are, and if something else is wrong.
    """
    kinds: dict[str, list[tuple[Change, float]]] = {}
    for change, log in changes:
        kinds.setdefault(change.name, []).append((change, log))
    logs: list[tuple[Change, float]] = []
    for members in kinds.values():
        best = max(members, key=lambda each: each[1])[0]
        mean = float(np.logaddexp.reduce([log for _, log in members])) - np.log(len(members))
        logs.append((best, mean + np.log(best.prior)))
    spent = sum(change.prior for change, _ in logs) + OTHER.prior
    if spent >= 1.0:
        raise ValueError(f"the priors of the changes add up to {spent:.2f}: leave room for 'none'")
    logs.append((SOUND, sound + np.log(1.0 - spent)))
    logs.append((OTHER, other + np.log(OTHER.prior)))
    return verdict_of(logs)
