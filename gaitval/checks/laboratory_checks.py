"""What the walk says of the cameras themselves: whether their floor is level, and their rate one
that cameras are set to.

A foot that stands lies on the floor, so the same marker rests at the same height wherever the foot
is put down, and does not sink while a belt carries it back. Cameras whose vertical is tilted by
1.5 degrees let the floor rise by 26 mm a metre.

Axes: the project's (REP-103), the person walks along +x.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.gait.cycles import stances, travel
from gaitval.gait.quality_flags import QualityFlag
from gaitval.mocap.recording import Event, Recording

LEVEL: Final = 0.7
LEVEL_BELT: Final = 1.1
"""Degrees. Over ground the floor rises by 0.20 (SD) in eleven recordings of McGill, at most 0.34;
on a belt, where feet roll a little while they count as flat, by 0.3 to 0.8 in three."""
FLOOR_TILTED: Final = "level of the floor"
"""The check that says so."""
FLAT: Final = (0.2, 0.5)
"""Shares of stance in which heel and forefoot lie on the floor."""
ON_FOOT: Final = ("Heel", "Ankle", "MT1", "MT2", "MT5", "Toe")
LEAST_WAY: Final = 0.6
"""m between the first and the last place of a marker, below which their heights show no slope."""
LEAST_STANCES: Final = 3
"""On a belt: one flat foot shows it to a degree only."""
LIES: Final = 0.05
ROLLING: Final = 0.03
"""Of the belt's speed, and m/s, by which a marker that it carries may move otherwise than the
others: one that does is not down, or its stance was cut off."""
USUAL_RATES: Final = (
    24.0, 48.0, 64.0, 72.0, 83.333, 96.0, 128.0, 144.0, 166.667, 256.0, 333.333, 512.0,
)  # fmt: skip
"""Hz, that cameras are set to beside tens and multiples of 25."""
RATE_ERROR: Final = 0.005
"""Of such a rate: what a file's average over its times, or video (1000/1001), may be off by."""


class FloorSlope(NamedTuple):
    """How much the floor rises in the direction of the walk, and the standard error, rad."""

    value: float
    error: float


def floor_slope(
    recording: Recording,
    events: Sequence[Event],
    landmarks: Mapping[str, str],
    belt: float,
) -> FloorSlope | None:
    """By the markers of the flat feet; None where too few places or stances show it. `belt` is its
    speed, m/s, 0 over ground; the rest is as `gait.cycles.belt_speed` takes it.
    """
    whole = stances(events)
    if not whole:
        return None
    forward = travel(recording, events, landmarks=landmarks)
    along: list[float] = []
    up: list[float] = []
    for side in SIDES:
        for name in {landmarks.get(f"{side[0].upper()}.{at}", "") for at in ON_FOOT}:
            if name not in recording.names:
                continue
            rests = _rests(recording, recording.marker(name), whole, side)
            if belt:
                along += [float(velocity @ forward) for _, velocity in rests]
                up += [float(velocity[2]) for _, velocity in rests]
            elif len(rests) > 1:
                places = np.array([place for place, _ in rests])
                places -= places.mean(axis=0)
                if np.ptp(places @ forward) > LEAST_WAY:
                    along += list(places @ forward)
                    up += list(places[:, 2])
    if len(along) < (2 * LEAST_STANCES if belt else 2):
        return None
    x, y = np.array(along), np.array(up)
    if belt:
        down = np.abs(x - np.median(x)) <= max(LIES * belt, ROLLING)
        if down.sum() < 2 * LEAST_STANCES:
            return None
        x, y = x[down], y[down]
    slope = float(x @ y / (x @ x))
    error = float(np.sqrt(np.mean((y - slope * x) ** 2) / (x @ x) * len(x) / (len(x) - 1)))
    return FloorSlope(float(np.arctan(slope)), error)


def level_warnings(slope: FloorSlope | None, belt: float) -> Iterator[QualityFlag]:
    """Warning about a floor that is not level under the feet: one at most."""
    if slope is None:
        return
    limit = LEVEL_BELT if belt else LEVEL
    value, error = np.degrees(slope)
    if abs(value) > limit + 2.0 * error:
        yield QualityFlag(
            FLOOR_TILTED, "cameras", abs(float(value)), limit, "deg",
            f"by the markers of the flat feet the floor {'rises' if value > 0 else 'falls'} by "
            f"{abs(value):.1f} ± {error:.1f}° in the direction of the walk (at most {limit:g}° in "
            "level laboratories): the vertical axis of the cameras is tilted, or the floor is. "
            "Level the calibration frame of the cameras; forces and markers do not fit each other "
            "until then, and the pelvis is tilted by as much",
        )  # fmt: skip


def odd_rate_warnings(rate: float) -> Iterator[QualityFlag]:
    """Warning about a frame `rate` (Hz) that no camera is set to: one at most."""
    usual = (*USUAL_RATES, 10.0 * round(rate / 10.0), 25.0 * round(rate / 25.0))
    nearest = min(usual, key=lambda each: abs(rate - each))
    if abs(rate / nearest - 1.0) > RATE_ERROR if nearest else True:
        yield QualityFlag(
            "odd frame rate", "cameras", rate, nearest, "Hz",
            f"the file says {rate:.6g} Hz, which is no rate that cameras are set to ({nearest:g} "
            "Hz is the nearest): check the frame rate in the recording program. Speeds are wrong "
            "by as much as it is, what accelerates by twice that",
        )  # fmt: skip


def _rests(
    recording: Recording, marker: Array, whole: Sequence[tuple[str, float, float]], side: str
) -> list[tuple[Array, Array]]:
    """Median place (3,) m and velocity (3,) m/s of a `marker` (T, 3) of a foot while it is flat, in
    the stances of its `side` in which it is seen.
    """
    found = []
    for whose, start, stop in whole:
        begin, end = (start + share * (stop - start) for share in FLAT)
        inside = (recording.time >= begin) & (recording.time <= end)
        if whose != side or inside.sum() < 4 or not np.isfinite(marker[inside]).all():
            continue
        velocity = np.polyfit(recording.time[inside] - begin, marker[inside], 1)[0]
        found.append((np.median(marker[inside], axis=0), velocity))
    return found
