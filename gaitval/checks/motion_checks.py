"""Whether forces and markers agree on the motion: Newton's law over the whole body.

The ground must give each foot what the body's acceleration needs. The limits were measured on the
recordings named in `force_checks`; each constant gives the values there.

Axes: the project's (REP-103), the person walks along +x.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from gaitval.arrays import Array, Flags
from gaitval.checks.force_checks import Stance
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES
from gaitval.gait.agreement import both_known
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Event, FootForces

LEAST_SECONDS: Final = 0.3
"""s with both feet's forces known below which nothing is concluded."""
ALONG: Final = "fore-aft force and motion"
WEIGHT: Final = "weight"
"""The check of the warning that the plates carry another weight than the body has."""
LARGEST_WEIGHT_ERROR: Final = 0.2
"""Of what the plates carry: at most 0.05, and 0.12 in the two trials whose markers jump. Over whole
cycles `session.average.check_mass` asks for more, and refuses."""
LEAST_CORRELATION: Final = 0.7
"""Between what the motion needs and what the plates show, vertically: at least 0.84, but for two
trials whose markers jump in those frames (0.44 and less), of which nothing is concluded."""
RATE_RATIOS: Final = ((0.5, 1.8), (0.4, 2.4))
"""Vertical acceleration of the markers over that of the forces. Outside the first range there is a
warning, outside the second the rate cannot be right; in the recordings 0.72 to 1.06. It changes
with the square of the frame rate: a rate that is written double makes it at least 2.9, half at most
0.27."""
FORCE_RATIOS: Final = (0.4, 1.8)
"""What the motion needs fore and aft over what a plate shows: 0.62 to 1.19."""
LARGEST_DRIFT: Final = 0.05
"""Mean horizontal force that the motion does not need, body weights: at most 0.028 (a trial whose
markers jump), and 0.006 over whole strides."""
LARGEST_MISMATCH: Final = 0.3
"""Vertical force that the motion does not need, or that it lacks, body weights, on average over
`MISMATCH_SECONDS`: at most 0.09 (WBDS01 on the treadmill, 30 s) and 0.07 (Rajagopal 2016). A plate
that goes silent in the middle of a step lacks 0.5 and more."""
MISMATCH_SECONDS: Final = 0.06
"""s, about what the low-pass of 8 Hz leaves of a shorter fault."""
SWING_TIMES: Final = (1.0, 2.2)
"""Swing time over the square root of leg length / gravity: 1.21 (1.4 m/s) to 1.89 (0.49 m/s). A leg
swings nearly as a pendulum, so this hardly depends on speed and size; a frame rate written double
halves it."""
LARGEST_BELT_ERROR: Final = 0.05
"""Of the belt's speed."""
ROLLING: Final = 0.03
"""m/s at which flat feet roll on, so that a slow belt's speed is known no better."""
LEG_SHARE: Final = 0.53
"""Height of the hip over stature (Winter 2009, figure 4.1)."""


def weight_warnings(needed: Array, loads: FootForces) -> Iterator[QualityFlag]:
    """Warning about plates that carry more or less than the body weighs; whatever else they show is
    then in the wrong unit, too. `needed` (T, 3) N is as for `motion_warnings`, `loads` are on the
    feet at the same frames. One warning at most; none with less than `LEAST_SECONDS` of known
    forces.
    """
    ratio = _weight_ratio(needed, loads)
    if ratio is None:
        return
    if abs(ratio - 1.0) > LARGEST_WEIGHT_ERROR:
        yield QualityFlag(
            WEIGHT, "all plates", ratio, 1.0 + np.copysign(LARGEST_WEIGHT_ERROR, ratio - 1.0),
            "1", f"the plates carry {ratio:.2f} times what the body weighs: the mass, or the unit "
            "of the forces, is wrong",
        )  # fmt: skip


def aid_warnings(aid: str, needed: Array, loads: FootForces) -> Iterator[QualityFlag]:
    """Warning about what an `aid` carries, by `needed` and `loads` as in `weight_warnings`."""
    ratio = _weight_ratio(needed, loads)
    if ratio is not None:
        yield QualityFlag(
            "aid", "all plates", ratio, 1.0, "1",
            f"with {aid} the feet carry {ratio:.2f} times what the body weighs; the rest, and how "
            "the aid pushes, is not measured. Moments of the legs are those of what the feet "
            "carry, trunk and residuals those of the aid",
        )  # fmt: skip


def _weight_ratio(needed: Array, loads: FootForces) -> float | None:
    """What the plates carry over what the motion needs; None with too little of both feet."""
    known = both_known(loads)
    if np.count_nonzero(known) < LEAST_SECONDS * loads.rate:
        return None
    return float(loads.force[known, :, 2].sum(axis=1).mean() / needed[known, 2].mean())


def motion_warnings(
    needed: Array, loads: FootForces, stances: Sequence[Stance], force_rate: float, mass_kg: float
) -> Iterator[QualityFlag]:
    """Warnings about the forces that follow from the motion: about the frame rate; if that is
    right, about each plate's fore-aft force, the mean horizontal force and the vertical force.

    `needed` (T, 3) N is the total ground reaction that the motion of a person of `mass_kg` needs
    (measured plus residual), at the marker frames; `loads` are on the feet there, filtered as the
    motion is. `stances` are of `whole_stances`, in samples of the plates, at `force_rate` Hz.
    """
    known = both_known(loads)
    if np.count_nonzero(known) < LEAST_SECONDS * loads.rate:
        return
    weight = mass_kg * STANDARD_GRAVITY
    total = loads.force.sum(axis=1)
    # Less the weight, both are mass times vertical acceleration. A wrong frame rate changes that of
    # the markers by its square, and that of the plates not at all.
    # Each less its own mean: a wrong mass is then not taken for a wrong frame rate.
    pair = (total[known, 2], needed[known, 2])
    ratio, correlation = _against(*(each - each.mean() for each in pair))
    # With one foot that no plate shows, only support by the other is left, in which the vertical
    # force hardly changes.
    both = loads.force[known].any(axis=(0, 2)).all()
    if both and correlation > LEAST_CORRELATION and not _within(ratio, RATE_RATIOS[0]):
        yield _rate_warning(ratio)
        return  # the other ratios are off for the same reason
    for name in dict.fromkeys(stance.plate for stance in stances):
        carried = np.zeros(len(known))
        for stance in stances:
            if stance.plate == name:
                # Stances are in force samples, the loads at the marker frames.
                frames = slice(*(round(at * loads.rate / force_rate) for at in _ends(stance)))
                carried[frames] += loads.force[frames, SIDES.index(stance.side), 0]
        # The other plates are taken to be right: this one has to supply what they leave.
        rest = total[:, 0] - carried
        alone = known & (np.abs(carried) > 0.0)
        if np.count_nonzero(alone) < LEAST_SECONDS * loads.rate:
            continue
        ratio, together = _against(carried[alone], (needed[:, 0] - rest)[alone])
        if abs(together) > LEAST_CORRELATION and not _within(ratio, FORCE_RATIOS):
            yield QualityFlag(
                ALONG, f"plate {name}", ratio, FORCE_RATIOS[ratio > 1.0],
                "1", f"the body's fore-aft acceleration needs {ratio:.2f} times the force that "
                f"the plate shows ({FORCE_RATIOS[0]:g} to {FORCE_RATIOS[1]:g} elsewhere): check "
                "its calibration and axes", certain=ratio < 0.0, plate=name,
            )  # fmt: skip
    drift = (total - needed)[known, :2].mean(axis=0) / weight
    largest = float(np.abs(drift).max())
    if largest > LARGEST_DRIFT:
        yield QualityFlag(
            "horizontal impulse", "all plates", largest, LARGEST_DRIFT, "body weights",
            f"on average the plates push the body by {100 * drift[0]:.1f} % of its weight forward "
            f"and {100 * drift[1]:.1f} % to the left more than its motion shows (at most "
            f"{100 * LARGEST_DRIFT:.0f} %): a horizontal channel is not zeroed",
        )  # fmt: skip
    yield from _mismatch_warnings((total - needed)[:, 2] / weight, known, loads)


def _mismatch_warnings(off: Array, known: Flags, loads: FootForces) -> Iterator[QualityFlag]:
    """A moment in which the plates show another vertical force than the motion needs: `off` (T,)
    body weights too much, where the forces of both feet are `known` (T,). `loads` as in
    `motion_warnings`.
    """
    frames = max(round(MISMATCH_SECONDS * loads.rate), 1)
    # A moving average, because the noise of one frame is no fault of a plate.
    mean = np.abs(np.convolve(np.where(known, off, 0.0), np.ones(frames) / frames, "same"))
    worst = int(np.argmax(mean))
    if mean[worst] > LARGEST_MISMATCH:
        yield QualityFlag(
            "vertical force and motion", "all plates", float(mean[worst]), LARGEST_MISMATCH,
            "body weights", f"at {loads.time[worst]:.2f} s the plates show "
            f"{100 * mean[worst]:.0f} % of the body weight {'more' if off[worst] > 0 else 'less'} "
            f"than the motion needs (at most {100 * LARGEST_MISMATCH:.0f} % elsewhere): a plate "
            "was silent or stuck, or the foot was also on something else",
        )  # fmt: skip


def belt_warnings(belt: float, feet: float) -> Iterator[QualityFlag]:
    """Warning about a belt that runs at another speed m/s than flat feet move: one at most."""
    if abs(feet - belt) > max(LARGEST_BELT_ERROR * belt, ROLLING):
        yield QualityFlag(
            "belt",
            "feet",
            feet,
            belt,
            "m/s",
            f"flat feet move back at {feet:.3f} m/s, but the belt's speed is given as {belt:.3f} "
            "m/s: it is another trial's, or the markers' scale or frame rate is wrong.",
        )


def swing_warnings(
    events: Sequence[Event], height_m: float, *, forces: bool = False
) -> Iterator[QualityFlag]:
    """Warning about a swing too short or too long for a leg of this person, as a wrong frame rate
    makes it; needs no forces. One at most, from the median of all swings.

    `events` are of both feet, in order of time; `height_m` is the person's stature. `forces` says
    whether forces show the frame rate better (`motion_warnings`): a long swing is then that of a
    slow walk, 2.2 to 3.1 at 0.4 m/s (Schreiber and Moissenet 2019).
    """
    times = [
        after.time - before.time
        for side in SIDES
        for mine in [[event for event in events if event.side == side]]
        for before, after in pairwise(mine)
        if (before.kind, after.kind) == ("toe_off", "heel_strike")
    ]
    if not times:
        return
    swing = float(np.median(times))
    relative = swing / np.sqrt(LEG_SHARE * height_m / STANDARD_GRAVITY)
    if not _within(relative, SWING_TIMES):
        short = relative < SWING_TIMES[0]
        if forces and not short:
            return
        yield QualityFlag(
            "swing time", "both feet", relative, SWING_TIMES[not short], "1",
            f"a swing takes {swing:.2f} s, too {'short' if short else 'long'} for a person of "
            f"{height_m:.2f} m who walks: the frame rate of the file looks too "
            f"{'high' if short else 'low'}. Check it in the recording program",
        )  # fmt: skip


def _rate_warning(ratio: float) -> QualityFlag:
    # Acceleration is a second derivative, so it is wrong by the square of the rate's error.
    factor = float(np.sqrt(ratio)) if ratio > 0.0 else float("nan")
    return QualityFlag(
        "frame rate", "markers and plates", ratio, RATE_RATIOS[0][ratio > 1.0], "1",
        f"the markers' vertical acceleration is {ratio:.2f} times that of the forces, which "
        f"gravity fixes ({RATE_RATIOS[0][0]:g} to {RATE_RATIOS[0][1]:g} elsewhere): the frame rate "
        f"of the file looks {factor:.1f} times the true one. Check it in the recording program",
        certain=not _within(ratio, RATE_RATIOS[1]),
    )  # fmt: skip


def _ends(stance: Stance) -> tuple[int, int]:
    return stance.begin, stance.end


def _within(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]


def _against(shown: Array, needed: Array) -> tuple[float, float]:
    """Factor of `shown` that explains `needed` best, and their correlation."""
    if shown.std() == 0.0 or needed.std() == 0.0:
        return 1.0, 0.0
    # Least squares of needed = factor × shown.
    factor = float((shown * needed).sum() / (shown * shown).sum())
    return factor, float(np.corrcoef(shown, needed)[0, 1])
