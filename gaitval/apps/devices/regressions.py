"""What published regressions on mechanical work would say of metabolic power. Nothing is measured.

The walker has no muscles, so its metabolic power is not known. Others measured how people's changed
with mechanical work; their ratios are taken to this person's work here. Each is of other people
under other conditions, and they disagree: that is how wrong any of them may be.
"""

from collections.abc import Sequence
from typing import Final, Literal, NamedTuple

from gaitval.apps.devices.curves import JOINTS, WalkCurves
from gaitval.apps.devices.experiments import com_work_rate
from gaitval.apps.devices.study import DeviceOutcome, at_kept_speed
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.model.devices.device import Device


class Regression(NamedTuple):
    """A published ratio of metabolic to mechanical power.

    Attributes
    ----------
    of : what it is a ratio to: positive work rate on the centre of mass, work rate of the muscles
        of hips, knees and ankles, or positive power of a device at the ankles.
    low, middle, high : W for each W; `low` and `high` as far as the paper's figures reach.
    negative : W for each W of negative work; 0 where the paper has none.
    people, source : who was measured; the paper, with its digital object identifier.
    """

    of: Literal["centre of mass", "joints", "device at the ankle"]
    low: float
    middle: float
    high: float
    negative: float
    people: str
    source: str


REGRESSIONS: Final = (
    Regression(
        "centre of mass",
        *(7.6 / 1.40, 0.5 * (7.6 / 1.40 + 1.0 / 0.16), 1.0 / 0.16, 0.0),
        "8 people with backpacks of up to 40 % of body weight, 1.25 m/s: 1.40 W on the centre of "
        "mass and 7.6 W of metabolic power for each kg, an efficiency of 16 %",
        "Huang and Kuo 2014, J Exp Biol 217:605, doi:10.1242/jeb.091587",
    ),
    Regression(
        "joints",
        *(1.0 / 0.25, 1.0 / 0.25, 1.0 / 0.25, 1.0 / 1.20),
        "walking up and down slopes, where efficiency approaches 25 % of positive and 120 % of "
        "negative work; no interval is given, and on the level it is too much, for tendons return "
        "work",
        "as quoted by Donelan, Kram and Kuo 2002, J Exp Biol 205:3717, doi:10.1242/jeb.205.23.3717",
    ),
    Regression(
        "device at the ankle",
        *(-0.52 / 0.21, -0.45 / 0.23, -0.38 / 0.25, 0.0),
        "9 people with powered ankle exoskeletons, 1.25 m/s, level: 0.23 ± 0.02 W/kg given, "
        "metabolic power lower by 0.45 ± 0.07 W/kg",
        "Sawicki and Ferris 2009, J Exp Biol 212:32, doi:10.1242/jeb.017277",
    ),
)


class PredictedPower(NamedTuple):
    """W/kg, by which metabolic power would change, as a regression has it."""

    low: float
    middle: float
    high: float


def powers(curves: WalkCurves, com_rate: float) -> dict[str, tuple[float, float]]:
    """W/kg, positive and negative (not below 0), by what a `Regression` is of, from the `curves`
    and the positive work rate on the centre of mass, `com_rate` W/kg.
    """
    of_joints = [
        sum(work[joint, side] / curves.stride_time[side] for joint in JOINTS for side in SIDES)
        for work in (curves.work, curves.negative_work)
    ]
    given = [curves.device_work["ankle_angle", side] / curves.stride_time[side] for side in SIDES]
    return {
        "centre of mass": (com_rate, 0.0),
        "joints": (of_joints[0], of_joints[1]),
        "device at the ankle": (float(sum(given)), 0.0),
    }


def change(
    regression: Regression,
    now: dict[str, tuple[float, float]],
    before: dict[str, tuple[float, float]],
) -> PredictedPower:
    """The change that a regression gives from powers without a device to those with it."""
    positive, negative = (now[regression.of][k] - before[regression.of][k] for k in (0, 1))
    paid = negative * regression.negative
    low, middle, high = (
        ratio * positive + paid for ratio in (regression.low, regression.middle, regression.high)
    )
    return PredictedPower(min(low, high), middle, max(low, high))


def predicted_power(
    outcomes: Sequence[DeviceOutcome],
    devices: Sequence[Device],
    configuration: Configuration,
    mass: float,
) -> list[tuple[Regression, list[PredictedPower | None]]]:
    """For each regression what it says of each of `outcomes`, whose first is without a device; None
    without a whole gait cycle, at another speed than without (a slower walk takes less power for
    its speed alone), and of the joints' work where a motion is kept in which a prosthesis
    has one of them: what is missing there is no work of muscles. That of powered ankles is there
    only if one of `devices` has a motor at the ankle.
    """
    powered = any(each.motor("ankle_angle") for each in devices)
    found = [
        None
        if each.curves is None
        else powers(each.curves, com_work_rate(each.walk, configuration) / mass)
        for each in outcomes
    ]
    before = found[0]
    lost = any(
        hinge.joint in JOINTS and not hinge.muscles for each in devices for hinge in each.hinges
    )

    def unknown(regression: Regression, outcome: DeviceOutcome) -> bool:
        if not at_kept_speed(outcome, outcomes[0]):
            return True
        return lost and regression.of == "joints" and outcome.assumption == "kinematics kept"

    return [
        (
            each,
            [
                None
                if now is None or before is None or unknown(each, outcome)
                else change(each, now, before)
                for outcome, now in zip(outcomes[1:], found[1:], strict=True)
            ],
        )
        for each in REGRESSIONS
        if powered or each.of != "device at the ankle"
    ]
