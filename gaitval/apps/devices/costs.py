"""What devices do to the metabolic rate of a walk: the change, its sign, and how sure that is.

A change is of one person between two walks at one speed, so most of what models do not know of the
person cancels. What is left is of two kinds. Common to everybody is by how much the models are off,
which more people do not make smaller: a share of the change's size (`COMMON`), found at groups of
people who were measured. A person's own is that people do not change alike (`PERSON`, in each of
two walks), which the band of one person has, too (`person_band`).
"""

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.stats import norm as normal

from gaitval._internal.text.number_text import number
from gaitval.apps.devices.answer import WORDS
from gaitval.apps.devices.results import MARGINS
from gaitval.apps.devices.study import DeviceOutcome, at_kept_speed
from gaitval.quantities.metabolic_cost import JOINTS as OF_JOINTS
from gaitval.quantities.metabolic_rate import CENTRAL

REACH: Final = float(normal.ppf(0.95))
"""Standard deviations to either side in which 90 % lie."""

PERSON: Final = 0.20
"""W/kg, by which a person's rate of one walk strays: the standard error of estimate of Looney et
al. (2019), Med Sci Sports Exerc 51:1954, abstract. By more, people differ from each other
(`metabolic_cost.SPREAD`), but in both walks alike."""

COMMON: Final = 0.33
"""Standard deviation of what people's mean change is off that of the models, as a share of its
size (`size`): of 19 means of four studies, of vests, inclines and a powered ankle, what chance of
who was measured explains taken off (`claims/slopes.py` of commit 60ee3cba). On slopes alone it
is 0.66: 10 % downhill models see half of what people save."""


class CostChange(NamedTuple):
    """Metabolic rate of a walk with devices against that without, W/kg of the person.

    Attributes
    ----------
    assumption : how the person adapts.
    before, after : gross, mean of the muscles' and the joints' model.
    changes : by model.
    """

    assumption: str
    before: float
    after: float
    changes: dict[str, float]

    @property
    def middle(self) -> float:
        """The change of the mean of the muscles' and the joints' model."""
        return self.after - self.before

    @property
    def band(self) -> tuple[float, float]:
        """Low and high of 90 % of what is common to people, and of what the rate of a walk may move
        by itself.
        """
        return _around(self.middle, REACH * COMMON * size(self.changes), MARGINS["W/kg"])

    @property
    def sign(self) -> int:
        """1 if it costs more by all of the band and every model, -1 if less, else 0."""
        low, high = self.band
        return self.agreed * int(low > 0.0 or high < 0.0)

    @property
    def agreed(self) -> int:
        """1 if it costs more by every model, -1 if less, 0 if they have both signs."""
        found = list(self.changes.values())
        return int(min(found) > 0.0) - int(max(found) < 0.0)

    @property
    def person(self) -> tuple[float, float]:
        """Low and high of 90 % of one person's change."""
        return person_band(self.changes)

    @property
    def percent(self) -> float:
        """% of the rate without devices, gross."""
        return 100.0 * self.middle / self.before


def cost_changes(outcomes: Sequence[DeviceOutcome]) -> list[CostChange]:
    """Of each of `outcomes` but the first, which is without: those at the speed without devices
    whose metabolic rate is known.
    """
    without, *others = outcomes
    if without.cost is None:
        return []
    return [
        change_of(each, without)
        for each in others
        if each.cost is not None and at_kept_speed(each, without)
    ]


def change_of(outcome: DeviceOutcome, without: DeviceOutcome) -> CostChange:
    """The change of metabolic rate from the walk `without`; both have one."""
    assert outcome.cost is not None
    assert without.cost is not None
    now, before = outcome.cost, without.cost
    changes = {
        model: now.gross[model] - before.gross[model]
        for model in now.gross
        if model in before.gross
    }
    return CostChange(outcome.assumption, before.middle, now.middle, changes)


def middle(changes: Mapping[str, float]) -> float:
    """The stated change, of `changes` by model: the mean of the muscles' and the joints'."""
    return float(np.mean([changes[each] for each in (CENTRAL, OF_JOINTS) if each in changes]))


def size(changes: Mapping[str, float]) -> float:
    """How large a change is whose sign two models may not agree on, of `changes` by model: the root
    mean square of the muscles' and the joints'.
    """
    known = [changes[each] for each in (CENTRAL, OF_JOINTS) if each in changes]
    return float(np.sqrt(np.mean(np.square(known))))


def person_band(changes: Mapping[str, float]) -> tuple[float, float]:
    """Low and high of 90 % of one person's change that models gave as `changes`, W/kg."""
    own = np.sqrt(2.0) * PERSON
    return _around(middle(changes), REACH * COMMON * size(changes), REACH * own)


def _around(at: float, *reaches: float) -> tuple[float, float]:
    reach = float(np.sqrt(np.sum(np.square(reaches))))
    return at - reach, at + reach


def in_words(changes: Sequence[CostChange]) -> str:
    """What decides the sign: the device, the assumption, or the model; empty without a change."""
    if not changes:
        return ""
    by = {sign: [each.assumption for each in changes if each.sign == sign] for sign in (1, -1, 0)}
    if len(changes) in (len(by[1]), len(by[-1])):
        way = "more" if by[1] else "less"
        return f"Walking with it costs {way}, by every assumption and every model."
    if by[1] and by[-1]:
        return (
            "The assumption decides the sign, not the device: walking costs more "
            f"{_listed(by[1])}, and less {_listed(by[-1])}."
        )
    said = [
        f"Walking costs {way} {_listed(by[sign])}."
        for sign, way in ((1, "more"), (-1, "less"))
        if by[sign]
    ]
    unsure = [each for each in changes if not each.sign]
    for sign, way in ((1, "more"), (-1, "less")):
        alike = [each.assumption for each in unsure if each.agreed == sign]
        if alike:
            said.append(
                f"It costs {way} by every model {_listed(alike)}, but by so little that the rate "
                "of a walk may move as much by itself."
            )
    apart = [each.assumption for each in unsure if not each.agreed]
    if apart:
        said.append(
            f"The models decide the sign, not the device, {_listed(apart)}: they do not agree "
            "whether walking costs more or less."
        )
    if len({each.middle > 0.0 for each in changes}) > 1:
        said.append("By the mean of the models the assumptions do not agree either.")
    return " ".join(said)


def _listed(names: Sequence[str]) -> str:
    return " or ".join(WORDS[name][0].lower() + WORDS[name][1:] for name in names)


def rate_in_words(change: CostChange) -> str:
    """The change by an assumption, W/kg and %, with its bands."""
    (low, high), (least, most) = change.band, change.person
    return (
        f"{signed(change.middle)} W/kg ({'+' if change.percent > 0.0 else '−'}"
        f"{number(abs(change.percent), 0)} %; 90 %: people’s mean {signed(low)} to {signed(high)}, "
        f"one person {signed(least)} to {signed(most)})"
    )


def unknown_in_words(outcomes: Sequence[DeviceOutcome]) -> str:
    """Why no change of metabolic rate is given of `outcomes`, the first without devices; empty
    where one is.
    """
    if cost_changes(outcomes):
        return ""
    if outcomes[0].cost is None or all(each.cost is None for each in outcomes[1:]):
        return (
            "not given: muscles could not be worked out, for the person’s height is not known, a "
            "prosthesis has a part of a leg, or no gait cycle is whole"
        )
    return "not given: no walk with it keeps the speed without"


def model_names(changes: Sequence[CostChange]) -> list[str]:
    """The models of the `changes`, the one that stands for muscles first."""
    names = list(dict.fromkeys(name for each in changes for name in each.changes))
    return sorted(names, key=lambda name: name != CENTRAL)


def signed(value: float) -> str:
    """W/kg with its sign."""
    return f"{'+' if value > 0.0 else '−'}{number(abs(value), 2)}"
