"""Whether forces and markers agree on the motion: Newton's law over the whole body.

The ground must give each foot what the body's acceleration needs. The limits were measured on the
recordings named in `findings.plates`; `source` gives the values there.

Axes: the project's (REP-103), the person walks along +x.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES
from gaitval.findings.finding import Finding, Limits, Seen
from gaitval.gait.agreement import both_known
from gaitval.mocap.recording import Event, FootForces

LEAST_SECONDS: Final = 0.3
"""s with both feet's forces known below which nothing is concluded."""
LEAST_CORRELATION: Final = 0.7
"""Between what the motion needs and what the plates show: at least 0.84, but for two trials whose
markers jump in those frames (0.44 and less), of which nothing is concluded."""
LEG_SHARE: Final = 0.53
"""Height of the hip over stature (Winter 2009, figure 4.1)."""


@dataclass(frozen=True)
class Balance:
    """What the motion of a person needs of the ground, beside what the plates show.

    Attributes
    ----------
    needed : (T, 3) N, total ground reaction that the motion needs (measured plus residual), at the
        marker frames.
    loads : on the feet there, filtered as the motion is.
    mass_kg : of the person.
    """

    needed: Array
    loads: FootForces
    mass_kg: float

    @cached_property
    def known(self) -> Flags:
        """(T,) whether the forces of both feet are known; nowhere if that is for too short."""
        known = both_known(self.loads)
        return known & (np.count_nonzero(known) >= LEAST_SECONDS * self.loads.rate)

    @property
    def weight(self) -> float:
        """N."""
        return self.mass_kg * STANDARD_GRAVITY

    @cached_property
    def excess(self) -> Array:
        """(T, 3) body weights that the plates show and the motion does not need."""
        return np.asarray((self.loads.force.sum(axis=1) - self.needed) / self.weight)


def _weight(balance: Balance) -> Iterator[Seen]:
    """What the plates carry over what the motion needs."""
    known = balance.known
    if known.any():
        carried = balance.loads.force[known, :, 2].sum(axis=1).mean()
        ratio = float(carried / balance.needed[known, 2].mean())
        yield Seen(ratio, "all plates")


def _frame_rate(balance: Balance) -> Iterator[Seen]:
    """Vertical acceleration of the markers over that of the forces, which changes with the square
    of the frame rate.
    """
    known = balance.known
    # With one foot that no plate shows, only support by the other is left, in which the vertical
    # force hardly changes.
    if not known.any() or not balance.loads.force[known].any(axis=(0, 2)).all():
        return
    # Each less its own mean: a wrong mass is then not taken for a wrong frame rate.
    shown, needed = (
        each - each.mean()
        for each in (balance.loads.force[known, :, 2].sum(axis=1), balance.needed[known, 2])
    )
    ratio, correlation = _against(shown, needed)
    if correlation > LEAST_CORRELATION:
        factor = float(np.sqrt(ratio)) if ratio > 0.0 else float("nan")
        yield Seen(ratio, "markers and plates", {"factor": factor})


def _mismatch(balance: Balance, *, seconds: float) -> Iterator[Seen]:
    """Vertical force that the motion does not need, or that it lacks, body weights, on average over
    `seconds`: the noise of one frame is no fault of a plate.
    """
    known, loads = balance.known, balance.loads
    frames = max(round(seconds * loads.rate), 1)
    if not known.any():
        return
    off = np.where(known, balance.excess[:, 2], 0.0)
    mean = np.abs(np.convolve(off, np.ones(frames) / frames, "same"))
    worst = int(np.argmax(mean))
    way = "more" if balance.excess[worst, 2] > 0 else "less"
    yield Seen(float(mean[worst]), "all plates", {"time": float(loads.time[worst]), "way": way})


def _against(shown: Array, needed: Array) -> tuple[float, float]:
    """Factor of `shown` that explains `needed` best, and their correlation."""
    if shown.std() == 0.0 or needed.std() == 0.0:
        return 1.0, 0.0
    # Least squares of needed = factor × shown.
    factor = float((shown * needed).sum() / (shown * shown).sum())
    return factor, float(np.corrcoef(shown, needed)[0, 1])


@dataclass(frozen=True)
class Swings:
    """Events of both feet of a person of `height_m`, in order of time. With `forces` these show the
    frame rate better (`FRAME_RATE`): a long swing is then that of a slow walk.
    """

    events: Sequence[Event]
    height_m: float
    forces: bool = False


def _swing(of: Swings) -> Iterator[Seen]:
    """Median swing time over the square root of leg length / gravity: a leg swings nearly as a
    pendulum, so this hardly depends on speed and size.
    """
    times = [
        after.time - before.time
        for side in SIDES
        for mine in [[event for event in of.events if event.side == side]]
        for before, after in pairwise(mine)
        if (before.kind, after.kind) == ("toe_off", "heel_strike")
    ]
    if times:
        swing = float(np.median(times))
        relative = swing / float(np.sqrt(LEG_SHARE * of.height_m / STANDARD_GRAVITY))
        least, most = SWING.low, SWING.high
        limits: Limits = (least, np.inf if of.forces else most)
        short = relative < least
        words = {
            "swing": swing, "height": of.height_m,
            "way": "short" if short else "long", "rate": "high" if short else "low",
        }  # fmt: skip
        yield Seen(relative, "both feet", words, limits=limits)


WEIGHT: Final[Finding] = Finding(
    name="weight",
    needs=Balance,
    values=_weight,
    limits=(0.8, 1.2),
    unit="1",
    sentence=(
        "the plates carry {value:.2f} times what the body weighs: the mass, or the unit of the "
        "forces, is wrong"
    ),
    source=(
        "off by at most 0.05, and 0.12 in the two trials whose markers jump; over whole cycles "
        "`session.average.check_mass` asks for more, and refuses"
    ),
)
FRAME_RATE: Final[Finding] = Finding(
    name="frame rate",
    needs=Balance,
    values=_frame_rate,
    limits=(0.5, 1.8),
    impossible=(0.4, 2.4),
    unit="1",
    sentence=(
        "the markers' vertical acceleration is {value:.2f} times that of the forces, which gravity "
        "fixes ({low:g} to {high:g} elsewhere): the frame rate of the file looks {factor:.1f} "
        "times the true one"
    ),
    remedy="Check it in the recording program",
    source=("0.72 to 1.06; a rate that is written double makes it at least 2.9, half at most 0.27"),
    hidden_by=("weight",),
)
MISMATCH: Final[Finding] = Finding(
    name="vertical force and motion",
    needs=Balance,
    values=_mismatch,
    numbers={"seconds": 0.06},
    limits=0.3,
    unit="body weights",
    sentence=(
        "at {time:.2f} s the plates show {value:.0f %} of the body weight {way} than the motion "
        "needs (at most {limit:.0f %} elsewhere): a plate was silent or stuck, or the foot was "
        "also on something else"
    ),
    source=(
        "at most 0.09 (WBDS01 on the treadmill, 30 s) and 0.07 (Rajagopal 2016); a plate that goes "
        "silent in the middle of a step lacks 0.5 and more"
    ),
    hidden_by=("weight", "frame rate"),
)
SWING: Final[Finding] = Finding(
    name="swing time",
    needs=Swings,
    values=_swing,
    limits=(1.0, 2.2),
    unit="1",
    sentence=(
        "a swing takes {swing:.2f} s, too {way} for a person of {height:.2f} m who walks: the "
        "frame rate of the file looks too {rate}"
    ),
    remedy="Check it in the recording program",
    source=(
        "1.21 (1.4 m/s) to 1.89 (0.49 m/s), and 2.2 to 3.1 at 0.4 m/s (Schreiber and Moissenet "
        "2019); a frame rate written double halves it"
    ),
)
