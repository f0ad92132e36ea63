"""What devices do to the metabolic rate of a walk: the change, its sign, and how sure that is.

A change is of one person between two walks at one speed, so most of what models do not know of the
person cancels. What does not is the model: `model_band` is where one more of such models would lie,
and decides the sign. Nor do people change alike: `change_band` is where the change of those who
walk lies, be it one person (`person_band`), whose rate is as far from a model's in each of the two
walks as people's are on the level, or the mean of a group.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from scipy.stats import norm as normal
from scipy.stats import t as student

from gaitval.apps.devices.curves import JOINTS, WalkCurves
from gaitval.apps.devices.study import DeviceOutcome, at_kept_speed
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.musculature.metabolics import REST
from gaitval.number_text import number
from gaitval.quantities.metabolic_cost import PERSON
from gaitval.quantities.metabolic_rate import CENTRAL, leg_rate

SHARE: Final = 0.90


class CostChange(NamedTuple):
    """Metabolic rate of a walk with devices against that without, W/kg of the person.

    Attributes
    ----------
    assumption : how the person adapts.
    before, after : gross, mean of the muscles' and the joints' model.
    changes : by model.
    low, high : of the change, 90 %: where one more such model would lie.
    """

    assumption: str
    before: float
    after: float
    changes: dict[str, float]
    low: float
    high: float

    @property
    def middle(self) -> float:
        """The change of the mean of the muscles' and the joints' model."""
        return self.after - self.before

    @property
    def sign(self) -> int:
        """1 if it costs more by all of the band, -1 if it costs less, 0 if models disagree."""
        return int(self.low > 0.0) - int(self.high < 0.0)

    @property
    def agreed(self) -> int:
        """1 if it costs more by every model, -1 if less, 0 if they have both signs."""
        found = list(self.changes.values())
        return int(min(found) > 0.0) - int(max(found) < 0.0)

    @property
    def person(self) -> tuple[float, float]:
        """Low and high of 90 % of one person's change."""
        return person_band(list(self.changes.values()))

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
    low, high = model_band(list(changes.values()))
    return CostChange(outcome.assumption, before.middle, now.middle, changes, low, high)


def joints_rate(curves: WalkCurves) -> float:
    """W/kg, gross, of a walk by the model of the joints, from its mean `curves`."""
    rate = REST
    for side in SIDES:
        size = sum(float(np.abs(curves.own[joint, side][:-1]).mean()) for joint in JOINTS)
        positive, negative = (
            sum(work[joint, side] for joint in JOINTS) / curves.stride_time[side]
            for work in (curves.work, curves.negative_work)
        )
        rate += float(leg_rate(*np.array([[size], [positive], [negative]]))[0])
    return rate


def model_band(values: Sequence[float]) -> tuple[float, float]:
    """Low and high of 90 % of one more value of those that gave `values` (Student's t)."""
    count = len(values)
    if count < 2:
        return -np.inf, np.inf
    spread = float(np.std(values, ddof=1)) * np.sqrt(1.0 + 1.0 / count)
    reach = float(student.ppf(0.5 + SHARE / 2.0, count - 1)) * spread
    middle = float(np.mean(values))
    return middle - reach, middle + reach


def change_band(values: Sequence[float], own: float) -> tuple[float, float]:
    """Low and high of 90 % of a change that models gave as `values`: the band of one more model,
    and what is not known of those who walk, a standard deviation `own`. All in the same unit.
    """
    low, high = model_band(values)
    reach = float(np.hypot((high - low) / 2.0, float(normal.ppf(0.5 + SHARE / 2.0)) * own))
    middle = float(np.mean(values))
    return middle - reach, middle + reach


def person_band(values: Sequence[float]) -> tuple[float, float]:
    """`change_band` of one person, whose two rates are `PERSON` off each, W/kg."""
    return change_band(values, np.sqrt(2.0) * PERSON)


def group_band(changes: Array, measured: int) -> tuple[float, float]:
    """`change_band` of the mean of a `measured` number of people, of others' `changes` (people,
    models): both groups are samples of people who change as unlike as these do.
    """
    people = len(changes)
    if people < 2:
        return -np.inf, np.inf
    spread = float(np.std(changes.mean(axis=1), ddof=1)) * np.sqrt(1.0 / people + 1.0 / measured)
    # Of so few people the spread itself is not well known: Student's t.
    edge = 0.5 + SHARE / 2.0
    own = spread * float(student.ppf(edge, people - 1) / normal.ppf(edge))
    return change_band(changes.mean(axis=0).tolist(), own)


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
            "The assumption decides the sign, not the device: walking costs more where it is "
            f"{_listed(by[1])}, and less where it is {_listed(by[-1])}."
        )
    said = [
        f"Walking costs {way} where it is {_listed(by[sign])}."
        for sign, way in ((1, "more"), (-1, "less"))
        if by[sign]
    ]
    unsure = [each for each in changes if not each.sign]
    for sign, way in ((1, "more"), (-1, "less")):
        alike = [each.assumption for each in unsure if each.agreed == sign]
        if alike:
            said.append(
                f"Where it is {_listed(alike)}, every model says that walking costs {way}, but "
                "they are so far apart that one more model might not."
            )
    apart = [each.assumption for each in unsure if not each.agreed]
    if apart:
        said.append(
            f"Where it is {_listed(apart)}, the models decide the sign, not the device: they do "
            "not agree whether walking costs more or less."
        )
    if len({each.middle > 0.0 for each in changes}) > 1:
        said.append("Nor do the assumptions, by the mean of the models.")
    return " ".join(said)


def _listed(names: Sequence[str]) -> str:
    return " or ".join(f"“{name}”" for name in names)


def model_names(changes: Sequence[CostChange]) -> list[str]:
    """The models of the `changes`, the one that stands for muscles first."""
    names = list(dict.fromkeys(name for each in changes for name in each.changes))
    return sorted(names, key=lambda name: name != CENTRAL)


def signed(value: float) -> str:
    """W/kg with its sign."""
    return f"{'+' if value > 0.0 else '−'}{number(abs(value), 2)}"
