"""A walker's recoveries in the quantities in which people's were published, beside two guesses."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.io.text_tables import shipped_table
from gaitval.apps.balance.disturb import Slip, StepDown, Trip
from gaitval.apps.balance.experiment import DisturbedWalk
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.metrics.balance_walk import OUTWARD, BalanceWalk, Footstep
from gaitval.metrics.foot_placement import (
    TIME_FOR_A_STEP,
    LinearMap,
    Placement,
    ankle_answer,
    answered,
    placements,
    step_delay,
    steps_to_recover,
)

SHORTLY: Final = 0.2
"""s after a push in which forces are compared."""


class Published(NamedTuple):
    """A row of `recoveries.csv`; see there."""

    kind: str
    quantity: str
    sign: int | None
    value: float | None
    low: float | None
    high: float | None
    unit: str
    of: str
    words: str
    source: str
    doi: str
    locator: str

    def right_sign(self, value: float | None) -> bool:
        """Whether a `value` has the published sign; of a published 0, or where nothing is said of
        the sign, every one has it, and the bounds judge.
        """
        return value is not None and (not self.sign or np.sign(value) == self.sign)

    def inside(self, value: float | None) -> bool | None:
        """Whether a `value` is within what was published; None if that has no bounds."""
        if self.low is None and self.high is None:
            return None
        low = -math.inf if self.low is None else self.low
        high = math.inf if self.high is None else self.high
        return value is not None and low <= value <= high


@cache
def published() -> tuple[Published, ...]:
    """All rows, compared or not."""
    return tuple(map(_published, shipped_table("gaitval.apps.balance", "recoveries.csv").by_name()))


def _published(row: Mapping[str, str]) -> Published:
    numbers = {n: float(row[n]) if row[n] else None for n in ("value", "low", "high")}
    return Published(**dict(row) | numbers | {"sign": int(row["sign"]) if row["sign"] else None})  # type: ignore[arg-type]


class Guessed(NamedTuple):
    """A quantity of the walker, of one who does not react, and of the pendulum; None where it has
    none.
    """

    walker: float | None
    nothing: float | None = None
    pendulum: float | None = None


def _percentile(values: Iterable[float]) -> float | None:
    found = [abs(each) for each in values if math.isfinite(each)]
    return float(np.percentile(found, 95.0)) if found else None


def _mean(values: Iterable[float | None]) -> float | None:
    found = [each for each in values if each is not None and math.isfinite(each)]
    return float(np.mean(found)) if found else None


@dataclass(frozen=True)
class Pushes:
    """Pushed walks beside the plain one.

    Attributes
    ----------
    plain : without a push.
    walks : with one each, of those that did not fall within two steps.
    found : their steps.
    """

    plain: BalanceWalk
    walks: tuple[BalanceWalk, ...]
    found: tuple[tuple[Placement, ...], ...]

    @classmethod
    def of(cls, plain: BalanceWalk, walks: Iterable[BalanceWalk], seconds: float) -> "Pushes":
        """Of `walks` with pushes of so many `seconds`."""
        kept = [
            (walk, tuple(placements(walk, plain, ends=seconds)))
            for walk in walks
            if not (walk.fell and len(walk.after()) < 2)
        ]
        return cls(plain, tuple(w for w, _ in kept), tuple(f for _, f in kept))

    def answers(self) -> list[Placement]:
        """Of each walk the first step that there was time for."""
        first = (answered(each, TIME_FOR_A_STEP) for each in self.found)
        return [each for each in first if each is not None]


def sideways(pushes: Pushes, steady: LinearMap | None, moved: LinearMap | None) -> dict[
    str, Guessed
]:  # fmt: skip
    """By name the quantities of sideways `pushes`, and of the linear maps of `steady` walking and
    of pushed walks (`moved`).
    """
    answers = pushes.answers()
    fall = [np.sign(each.extrapolated[1]) for each in answers]
    shifts = [each.foot[1] * sign for each, sign in zip(answers, fall, strict=True)]
    guesses = [each.guess[1] * sign for each, sign in zip(answers, fall, strict=True)]
    first = [steps[0] for steps in pushes.found if steps]
    ankles = [
        each for walk in pushes.walks if (each := ankle_answer(walk, pushes.plain)) is not None
    ]
    needed = [steps_to_recover(each, (1,)) for each in pushes.found]
    rate, left = pushes.plain.rate, _half_step(pushes.plain)
    grow = math.exp(rate * left)
    gains = None if moved is None else moved.gains
    return {
        "offset_change": Guessed(
            _percentile(each.offset[1] for each in answers),
            _percentile(each.extrapolated[1] for each in answers),
            _percentile(each.guess[1] - each.extrapolated[1] for each in answers),
        ),
        "foot_shift": Guessed(_largest(shifts), 0.0, _largest(guesses)),
        "step_delay": Guessed(step_delay(first), None, 0.0),
        "ankle_shift": Guessed(_largest([each.shift for each in ankles]), 0.0, 0.0),
        "ankle_rolls_to_fall": Guessed(_mean(each.shift for each in ankles), 0.0, 0.0),
        "ankle_delay": Guessed(_median([each.delay for each in ankles])),
        "steps_to_recover": Guessed(
            None if None in needed or not needed else float(max(n or 0 for n in needed)), None, 0.0
        ),
        "explained_sideways": Guessed(
            None if steady is None else float(steady.explained[1]), 0.0, 1.0
        ),
        "gain_sideways": Guessed(_of(gains, 1, 0), 0.0, grow),
        "gain_velocity_sideways": Guessed(_of(gains, 1, 2), 0.0, grow / rate),
        "gain_forward": Guessed(_of(gains, 0, 1), 0.0, grow),
        "gain_length_on_side": Guessed(_of(gains, 0, 0), 0.0, 0.0),
        "step_width_by_outward": Guessed(_slope(pushes), 0.0, None),
        **_outward(pushes),
    }


def _of(gains: Array | None, row: int, column: int) -> float | None:
    return None if gains is None else float(gains[row, column])


def _largest(values: Sequence[float]) -> float | None:
    """Of the largest size, with its sign."""
    found = [each for each in values if math.isfinite(each)]
    return float(max(found, key=abs)) if found else None


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _half_step(plain: BalanceWalk) -> float:
    """s, from the middle of stance to the next heel strike, mean of the `plain` walk."""
    strikes = [plain.time[each.strike] for each in plain.steps]
    return 0.5 * float(np.mean(np.diff(strikes)))


def _slope(pushes: Pushes) -> float | None:
    """How far outward a foot lands for each m that the centre of mass is further from the stance
    foot, at the heel strike.
    """
    rows = []
    for walk, steps in zip(pushes.walks, pushes.found, strict=True):
        step = answered(steps, TIME_FOR_A_STEP)
        if step is None:
            continue
        mine, usual = (
            side[step.number - 1] for side in (walk.after(), _usual(pushes.plain, walk.onset))
        )
        sign = OUTWARD[step.column]
        away = walk.centre[mine.strike, 1] - pushes.plain.centre[usual.strike, 1]
        rows.append((sign * away, sign * step.foot[1]))
    if len(rows) < 5:
        return None
    x, y = np.array(rows).T
    return float(x @ y / (x @ x))


def _usual(plain: BalanceWalk, onset: int) -> list[Footstep]:
    return [each for each in plain.steps if each.strike >= onset]


def _outward(pushes: Pushes) -> dict[str, Guessed]:
    """Of pushes towards the side of the only foot on the ground: the mean change for a short time
    of the body's angular momentum towards that side, kg m²/s, of the vertical force under the foot,
    N, and of its centre of pressure forward within the foot, m.
    """
    plain, spin, up, ahead = pushes.plain, [], [], []
    step = float(plain.time[1] - plain.time[0])
    for walk in pushes.walks:
        loaded = np.isfinite(plain.pressure[walk.onset, :, 0])
        if loaded.sum() != 1:
            continue
        column = int(np.flatnonzero(loaded)[0])
        rows = slice(walk.onset, walk.onset + round(SHORTLY / step))
        pushed_to = walk.velocity[rows, 1][-1] - plain.velocity[rows, 1][-1]
        if np.sign(pushed_to) != OUTWARD[column]:
            continue
        # About the axis forward, rolling to the right is positive.
        rolled = np.mean(walk.spin[rows, 0] - plain.spin[rows, 0])
        spin.append(float(-OUTWARD[column] * rolled))
        up.append(float(np.mean(walk.force[rows, column, 2] - plain.force[rows, column, 2])))
        inside = [w.pressure[rows, column, 0] - w.feet[rows, column, 0] for w in (walk, plain)]
        ahead.append(float(np.nanmean(inside[0] - inside[1])))
    return {
        "spin_by_outward": Guessed(_mean(spin), 0.0, 0.0),
        "vertical_by_outward": Guessed(_mean(up), 0.0, 0.0),
        "pressure_forward_by_outward": Guessed(_mean(ahead), 0.0, 0.0),
    }


def on_ground(found: Sequence[DisturbedWalk]) -> dict[str, Guessed]:
    """By name the quantities of walks on disturbed ground, means over those of a kind."""
    values: dict[str, list[float | None]] = {}
    for each in found:
        for name, value in _OF_GROUND[type(each.ground)](each).items():
            values.setdefault(name, []).append(value)
    return {name: Guessed(_mean(kept)) for name, kept in values.items()}


def _width(each: DisturbedWalk) -> float | None:
    """m, by how much wider the first step after the disturbance is."""
    widths = []
    for walk in (each.walk, each.plain):
        later = [s for s in walk.steps if s.strike > walk.onset and s.side != each.ground.side]
        if not later:
            return None
        feet = walk.feet[later[0].strike, :, 1]
        widths.append(feet[1] - feet[0])
    return float(widths[0] - widths[1])


def _rows(each: DisturbedWalk, first: float, last: float) -> slice:
    """Rows from `first` to `last` s after the beginning, of both walks."""
    step = float(each.plain.time[1] - each.plain.time[0])
    end = min(len(each.walk.time), len(each.plain.time))
    return slice(
        min(each.walk.onset + round(first / step), end - 1),
        min(each.walk.onset + round(last / step), end),
    )


def _slip(each: DisturbedWalk) -> dict[str, float | None]:
    column, rows = SIDES.index(each.ground.side), _rows(each, 0.0, 0.5)
    at = _rows(each, 0.15, 0.17).start
    ahead = [w.extrapolated[at, 0] - w.feet[at, column, 0] for w in (each.walk, each.plain)]
    knee = _rows(each, 0.19, 0.35)  # when people answer (Cham and Redfern's 190 to 350 ms)
    # Of the largest size: the largest alone is a drop in every walk, for it begins with none.
    drop = each.plain.pelvis[rows, 2] - each.walk.pelvis[rows, 2]
    return {
        "slip_width": _width(each),
        "slip_hip_drop": _largest(drop.tolist()),
        "slip_stability": float(ahead[0] - ahead[1]),
        "slip_knee": float(np.mean(each.knee[knee] - each.plain_knee[knee])),
    }


def _trip(each: DisturbedWalk) -> dict[str, float | None]:
    assert isinstance(each.ground, Trip)
    column, other = SIDES.index(each.ground.side), 1 - SIDES.index(each.ground.side)
    over = _rows(each, each.ground.hold, each.ground.hold + 0.02).start
    gained = each.walk.spin[over, 1] - each.plain.spin[over, 1]
    support = _rows(each, 0.0, 0.4)
    step = float(each.plain.time[1] - each.plain.time[0])
    mine = [s.strike for s in each.walk.steps if s.strike > each.walk.onset and s.column == column]
    lifted = each.walk.feet[support, column, 2].max() - each.plain.feet[support, column, 2].max()
    # Whether the foot goes on, over where it was stopped, or comes down before its time.
    sooner = (each.step.strike - mine[0]) * step if mine else math.nan
    found: dict[str, float | None] = {
        "trip_spin": float(gained),
        "trip_ankle": float(
            each.walk.ankle[support, other].max() - each.plain.ankle[support, other].max()
        ),
        "stumble_width": _width(each),
    }
    if each.ground.swing < 1.0 / 3.0:
        found["trip_early_elevates"] = float(lifted)
    else:
        found["trip_late_lowers"] = float(sooner)
    return found


def _step_down(each: DisturbedWalk) -> dict[str, float | None]:
    """Over the perturbed contact: vertical force in its first third, N, and where the centre of
    pressure is from the centre of mass, m.
    """
    column = SIDES.index(each.ground.side)
    contacts = []
    for walk in (each.walk, each.plain):
        strikes = [s.strike for s in walk.steps if s.column == column and s.strike >= walk.onset]
        later = [
            s.lift for s in walk.steps if s.column == column and strikes and s.lift > strikes[0]
        ]
        if not strikes or not later:
            return {}
        contacts.append((walk, slice(strikes[0], later[0])))
    forces, places = [], []
    for walk, rows in contacts:
        force = walk.force[rows, column, 2]
        forces.append(force[: len(force) // 3].mean())
        places.append(np.nanmean(walk.pressure[rows, column, 0] - walk.centre[rows, 0]))
    return {
        "drop_early_force": float(forces[0] - forces[1]),
        "drop_pressure": float(places[0] - places[1]),
    }


MEASURED: Final = {
    "slip_width": "first step wider by",
    "slip_hip_drop": "hip lower by",
    "slip_stability": "centre of mass further ahead of the foot by",
    "slip_knee": "knee more flexed by",
    "trip_spin": "forward angular momentum gained",
    "trip_ankle": "largest moment of the standing ankle greater by",
    "stumble_width": "first step wider by",
    "trip_early_elevates": "foot lifted higher by",
    "trip_late_lowers": "foot on the ground sooner by",
    "drop_early_force": "early vertical force greater by",
    "drop_pressure": "centre of pressure further ahead of the centre of mass by",
}
"""What is measured of a walk on disturbed ground, in words, against the walk without it."""

_OF_GROUND: Final[Mapping[type, Callable[[DisturbedWalk], dict[str, float | None]]]] = {
    Slip: _slip,
    Trip: _trip,
    StepDown: _step_down,
}
