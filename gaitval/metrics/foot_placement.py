"""Where feet are placed after a disturbance, and by which law.

What is compared is the difference from the undisturbed walk of the same start: the next foot's
place, its distance from the extrapolated centre of mass (Hof 2010: it stays as it is), when the
foot and the centre of pressure answer, and after how many steps the walk is as before.

Beside the walk stand two guesses. *No reaction*: the next foot lands where it would have. *The
pendulum*: the body falls over its stance foot as a linear inverted pendulum, and the foot lands
with its usual distance from the extrapolated centre of mass.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.metrics.balance_walk import BalanceWalk, Footstep

RECOVERED: Final = 0.02
"""m; a foot that is this close to its usual place from the extrapolated centre of mass needs no
further step: so far the ankle moves the centre of pressure (Hof 2010)."""
TIME_FOR_A_STEP: Final = 0.3
"""s, that people need for a step (Hof 2010): of pushes with less time, the step after counts."""
ANSWERED: Final = 0.5
"""Share of a change by which it counts as there: its time is when it has passed half of it."""


class Placement(NamedTuple):
    """A step after a disturbance, beside the same step of the undisturbed walk.

    Attributes
    ----------
    number : 1 for the first step whose heel strike is after the disturbance began.
    column : 0 for the right foot, 1 for the left.
    lead : s, from the beginning of the disturbance to the heel strike.
    foot : (2,) m, change of the foot's place in the world, forward and to the left.
    extrapolated : (2,) m, change of the extrapolated centre of mass at the heel strike.
    offset : (2,) m, change of the foot's distance from it, forward and outward.
    guess : (2,) m, change of the foot's place by the pendulum, forward and to the left; NaN if no
        usual step follows.
    """

    number: int
    column: int
    lead: float
    foot: Array
    extrapolated: Array
    offset: Array
    guess: Array


def placements(disturbed: BalanceWalk, plain: BalanceWalk, *, ends: float) -> Iterator[Placement]:
    """The steps of a `disturbed` walk beside those of the `plain` one from the same start, as long
    as feet alternate in both; the disturbance takes `ends` s.
    """
    theirs = [each for each in plain.steps if each.strike >= disturbed.onset]
    guess = _pendulum(disturbed, plain, theirs, ends)
    for number, (mine, usual) in enumerate(zip(disturbed.after(), theirs, strict=False), start=1):
        if mine.side != usual.side:
            return
        foot = (
            disturbed.feet[mine.strike, mine.column, :2] - plain.feet[usual.strike, mine.column, :2]
        )
        yield Placement(
            number,
            mine.column,
            float(disturbed.time[mine.strike] - disturbed.time[disturbed.onset]),
            foot,
            disturbed.extrapolated[mine.strike] - plain.extrapolated[usual.strike],
            disturbed.offset(mine) - plain.offset(usual),
            guess,
        )


def _pendulum(
    disturbed: BalanceWalk, plain: BalanceWalk, theirs: Sequence[Footstep], ends: float
) -> Array:
    """(2,) m, change of a foot's place by the capture point of a linear inverted pendulum that is
    left alone from the end of the disturbance to the next of the usual heel strikes (`theirs`); NaN
    if there is none. A walk that keeps its distance from there on stays as far from the usual one.

    About the same centre of pressure a difference of extrapolated centres of mass grows as
    exp(ω t), whatever that pressure does; so the pressure itself is not needed.
    """
    step = float(plain.time[1] - plain.time[0])
    row = disturbed.onset + round(ends / step)
    later = [each.strike for each in theirs if each.strike >= row]
    if not later or row >= min(len(disturbed.time), len(plain.time)):
        return np.full(2, np.nan)
    away = disturbed.extrapolated[row] - plain.extrapolated[row]
    return np.asarray(away * np.exp(plain.rate * (later[0] - row) * step))


def answered(found: Iterable[Placement], least: float) -> Placement | None:
    """The first of the `found` steps that there was time for: its heel strike is at least `least` s
    after the disturbance began.
    """
    return next((each for each in found if each.lead >= least), None)


def steps_to_recover(found: Sequence[Placement], axes: Sequence[int] = (0, 1)) -> int | None:
    """Steps until the feet are placed as before, and stay so, from the extrapolated centre of mass
    forward (0) and sideways (1), or along one of these `axes`: 0 if they always were, None if not
    within the steps `found`.
    """
    last = 0
    for each in found:
        if not (np.abs(each.offset[list(axes)]) <= RECOVERED).all():
            last = each.number
    return None if not found or last == found[-1].number else last


class Ankle(NamedTuple):
    """What the centre of pressure under the stance foot does.

    Attributes
    ----------
    shift : m, its largest change sideways while that foot alone carries the body, towards the side
        to which the body falls.
    delay : s, from the beginning of the disturbance until it has half of it.
    """

    shift: float
    delay: float


def ankle_answer(disturbed: BalanceWalk, plain: BalanceWalk) -> Ankle | None:
    """The ankle's answer to a sideways disturbance in single stance; None in double support."""
    row = disturbed.onset
    loaded = plain.force[row, :, 2] > 0.0
    carrying = np.isfinite(plain.pressure[row, :, 0]) & loaded
    if carrying.sum() != 1:
        return None
    column = int(np.flatnonzero(carrying)[0])
    later = [each.strike for each in (*disturbed.steps, *plain.steps) if each.strike > row]
    if not later:
        return None
    rows = slice(row, min(later))
    change = disturbed.pressure[rows, column, 1] - plain.pressure[rows, column, 1]
    # The foot itself may be pushed along; what the ankle does is within the foot.
    change = change - (disturbed.feet[rows, column, 1] - plain.feet[rows, column, 1])
    fall = disturbed.extrapolated[rows, 1] - plain.extrapolated[rows, 1]
    if not np.isfinite(change).all() or not len(change):
        return None
    at = int(np.abs(change).argmax())
    # Towards where it goes at last: the push itself may move it the other way before.
    half = int(np.flatnonzero(change * np.sign(change[at]) >= ANSWERED * abs(change[at]))[0])
    step = float(plain.time[1] - plain.time[0])
    return Ankle(float(change[at] * np.sign(fall[-1])), half * step)


def step_delay(found: Sequence[Placement]) -> float | None:
    """s, the shortest time before a heel strike from which feet land by at least `ANSWERED` of what
    keeps their distance from the extrapolated centre of mass, sideways, of single steps `found`
    after pushes at many phases; None if none do.

    It is the shortest lead from which on the median of five neighbouring steps does that much; of
    shorter ones the last does less.
    """
    shares = [
        (each.lead, float(each.foot[1] / each.extrapolated[1]))
        for each in found
        if abs(each.extrapolated[1]) > 0.01
    ]
    if len(shares) < 5:
        return None
    leads, share = np.array(sorted(shares)).T
    # A running median of five, so that one step does not decide.
    middle = np.array([np.median(share[max(0, i - 2) : i + 3]) for i in range(len(share))])
    enough = middle >= ANSWERED
    if not enough.any():
        return None
    # From the last step on that does less.
    less = np.flatnonzero(~enough)
    first = 0 if not len(less) else int(less[-1]) + 1
    return float(leads[first]) if first < len(leads) else None
