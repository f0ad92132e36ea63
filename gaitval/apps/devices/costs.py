"""What devices do to the metabolic rate of a walk: the change, its sign, and how sure that is.

A change is of one person between two walks at one speed, so most of what models do not know of the
person cancels. What is left is of two kinds. Common to everybody is by how much the models are off,
which more people do not make smaller: a share of the change's size (`COMMON`), found at groups of
people who were measured. A person's own is that people do not change alike (`PERSON`, in each of
two walks).
"""

from typing import Final, NamedTuple

import numpy as np
from scipy.stats import norm as normal

from gaitval._internal.text.number_text import number
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
    before, after : gross, mean of the muscles' and the joints' model.
    changes : by model.
    """

    before: float
    after: float
    changes: dict[str, float]

    @property
    def middle(self) -> float:
        """The change of the mean of the muscles' and the joints' model."""
        return self.after - self.before

    @property
    def size(self) -> float:
        """How large a change is whose sign two models may not agree on: the root mean square of the
        muscles' and the joints'.
        """
        known = [self.changes[each] for each in (CENTRAL, OF_JOINTS) if each in self.changes]
        return float(np.sqrt(np.mean(np.square(known))))

    @property
    def band(self) -> tuple[float, float]:
        """Low and high of 90 % of what is common to people, and of what the rate of a walk may move
        by itself.
        """
        return self._around(MARGINS["W/kg"])

    @property
    def person(self) -> tuple[float, float]:
        """Low and high of 90 % of one person's change."""
        return self._around(REACH * np.sqrt(2.0) * PERSON)

    def _around(self, own: float) -> tuple[float, float]:
        reach = float(np.hypot(REACH * COMMON * self.size, own))
        return self.middle - reach, self.middle + reach

    @property
    def agreed(self) -> int:
        """1 if it costs more by every model, -1 if less, 0 if they have both signs."""
        found = list(self.changes.values())
        return int(min(found) > 0.0) - int(max(found) < 0.0)

    @property
    def sign(self) -> int:
        """1 if it costs more by all of the band and every model, -1 if less, else 0."""
        low, high = self.band
        return self.agreed * int(low > 0.0 or high < 0.0)

    @property
    def percent(self) -> float:
        """% of the rate without devices, gross."""
        return 100.0 * self.middle / self.before

    def words(self) -> str:
        """The change, W/kg and %, with its bands, and whether it has a sign."""
        (low, high), (least, most) = self.band, self.person
        way = "more" if self.agreed > 0 else "less"
        said = f"Walking with it costs {way} by every model"
        if not self.agreed:
            said = "The models do not agree whether walking with it costs more or less"
        elif not self.sign:
            said += ", but by so little that the rate of a walk may move as much by itself"
        return (
            f"{signed(self.middle)} W/kg ({'+' if self.percent > 0.0 else '−'}"
            f"{number(abs(self.percent), 0)} %; 90 %: people’s mean {signed(low)} to "
            f"{signed(high)}, one person {signed(least)} to {signed(most)}). {said}."
        )


def cost_change(without: DeviceOutcome, worn: DeviceOutcome) -> CostChange | None:
    """The change of metabolic rate from the walk `without` to that with devices; None where it is
    not known of both, or they are of other speeds.
    """
    if without.cost is None or worn.cost is None or not at_kept_speed(worn, without):
        return None
    now, before = worn.cost, without.cost
    changes = {
        model: now.gross[model] - before.gross[model]
        for model in now.gross
        if model in before.gross
    }
    return CostChange(before.middle, now.middle, changes)


UNKNOWN: Final = (
    "No change is given: no walk with it keeps the speed without, or muscles could not be worked "
    "out, for a prosthesis has a part of a leg, or no gait cycle is whole."
)
"""Said where `cost_change` is None."""


def signed(value: float) -> str:
    """W/kg with its sign."""
    return f"{'+' if value > 0.0 else '−'}{number(abs(value), 2)}"
