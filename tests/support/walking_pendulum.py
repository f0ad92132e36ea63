"""A linear inverted pendulum that walks by a known law: what the analysis must find again."""

import numpy as np

from gaitval.constants import GRAVITY
from gaitval.metrics.balance_walk import BalanceWalk, Footstep

HEIGHT, STEP_TIME, DT = 0.95, 0.54, 0.01
RATE = np.sqrt(GRAVITY / HEIGHT)
OUT, BACK = 0.03, -0.17
"""m, of each foot outward of the extrapolated centre of mass, and forward of it."""
SIGN = (-1.0, 1.0)


def _start(column):
    """Place and speed (2,) from the stance foot at a heel strike of the periodic walk."""
    grow, decay = np.exp(RATE * STEP_TIME), np.exp(-RATE * STEP_TIME)
    unstable = -np.array([BACK, SIGN[column] * OUT])
    following = unstable * grow + [BACK, -SIGN[column] * OUT]  # the next foot from this one
    # place - speed / RATE decays; seen from the next foot it is the same, mirrored sideways
    stable = following * [-1.0 / (1.0 - decay), 1.0 / (1.0 + decay)]
    return 0.5 * (unstable + stable), 0.5 * RATE * (unstable - stable), following


def pendulum(kicks=(), *, steps=16, first=0, law=None, jitter=0.0, seed=0, pressure_shift=None):
    """Walk `steps` steps from the foot `first`; `kicks` are (row, forward m/s, left m/s), and the
    first one is the onset.

    `law` gives the place of the next foot from (extrapolated centre of mass, column, number); by
    default it keeps its distance, with an SD of `jitter` m. `pressure_shift` of a row moves the
    pressure to the left within the foot.
    """
    random, each = np.random.default_rng(seed), round(STEP_TIME / DT)
    rows, column = each * steps, first
    centre, velocity = np.zeros((rows, 3)), np.zeros((rows, 3))
    feet, pressure = np.zeros((rows, 2, 3)), np.full((rows, 2, 2), np.nan)
    force, found, foot = np.zeros((rows, 2, 3)), [], np.zeros(2)
    place, speed, following = _start(column)
    feet[:, 1 - column, :2] = -following * np.array([1.0, -1.0])
    for n in range(steps):
        if n:
            column, extrapolated = 1 - column, place + speed / RATE
            out = [BACK, SIGN[column] * (OUT + jitter * random.standard_normal())]
            foot = np.add(extrapolated, out) if law is None else law(extrapolated, column, n)
            found.append(Footstep(("right", "left")[column], n * each, max(0, (n - 1) * each + 20)))
        feet[n * each :, column, :2] = foot
        for row in range(n * each, (n + 1) * each):
            for at, *kick in kicks:
                speed = np.add(speed, kick) if at == row else speed
            centre[row] = *place, HEIGHT
            velocity[row, :2] = speed
            under = np.add(foot, [0.0, 0.0 if pressure_shift is None else pressure_shift(row)])
            pressure[row, column], force[row, column, 2] = under, 700.0
            away, c, s = place - under, np.cosh(RATE * DT), np.sinh(RATE * DT)
            place, speed = under + away * c + speed / RATE * s, away * RATE * s + speed * c
    return BalanceWalk(
        time=DT * np.arange(rows), centre=centre, velocity=velocity, feet=feet,
        pressure=pressure, force=force, steps=tuple(found), pendulum=HEIGHT,
        onset=min((row for row, *_ in kicks), default=rows), fell=False,
    )  # fmt: skip
