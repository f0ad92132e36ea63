"""What the walk says of the cameras and of the belt: whether the floor is level, and whether feet
go back as fast as the belt is said to run.

A foot that stands lies on the floor, so the same marker rests at the same height wherever the foot
is put down, and does not sink while a belt carries it back. Cameras whose vertical is tilted by
1.5 degrees let the floor rise by 26 mm a metre.

Axes: the project's (REP-103), the person walks along +x.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.findings.feet import ON_FEET
from gaitval.findings.finding import Finding, Seen
from gaitval.gait.cycles import stances, travel
from gaitval.mocap.recording import Event, Recording

FLAT: Final = (0.2, 0.5)
"""Shares of stance in which heel and forefoot lie on the floor."""
LEAST_WAY: Final = 0.6
"""m between the first and the last place of a marker, below which their heights show no slope."""
LEAST_STANCES: Final = 3
"""On a belt: one flat foot shows it to a degree only."""
LIES: Final = 0.05
ROLLING: Final = 0.03
"""Of the belt's speed, and m/s, by which a marker that it carries may move otherwise than the
others: one that does is not down, or its stance was cut off. Flat feet roll on as much."""


@dataclass(frozen=True)
class Laboratory:
    """What is known of a laboratory by a walk in it.

    Attributes
    ----------
    slope : of the floor (`floor_slope`).
    belt, feet : m/s, speed of the belt as it is given, and as flat feet show it; 0 over ground.
    """

    slope: "FloorSlope | None"
    belt: float
    feet: float


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
        names = (landmarks.get(f"{side[0].upper()}.{at}", "") for at in ON_FEET)
        for name in dict.fromkeys(names):  # in the same order in every process
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


def _level(of: Laboratory, *, belt: float) -> Iterator[Seen]:
    """Degrees, of the floor in the direction of the walk."""
    if of.slope is not None:
        value, error = (float(each) for each in np.degrees(of.slope))
        most = belt if of.belt else FLOOR_TILTED.high
        words = {"error": error, "most": most, "way": "rises" if value > 0 else "falls"}
        yield Seen(abs(value), "cameras", words, limits=(-np.inf, most + 2.0 * error))


def _belt(of: Laboratory, *, share: float) -> Iterator[Seen]:
    """m/s, by which flat feet move otherwise than the belt."""
    limits = (-np.inf, max(share * of.belt, ROLLING))
    words = {"feet": of.feet, "belt": of.belt}
    yield Seen(abs(of.feet - of.belt), "feet", words, limits=limits)


FLOOR_TILTED: Final[Finding] = Finding(
    name="level of the floor",
    needs=Laboratory,
    values=_level,
    numbers={"belt": 1.1},
    limits=0.7,
    # a slope to walk on is no camera's error, and a walk on it is not one on the level
    impossible=(-np.inf, 4.0),
    unit="deg",
    sentence=(
        "by the markers of the flat feet the floor {way} by {value:.1f} ± {error:.1f}° in the "
        "direction of the walk (at most {most:g}° in level laboratories): the vertical axis of the "
        "cameras is tilted, or the floor is. Forces and markers do not fit each other, and the "
        "pelvis is tilted by as much"
    ),
    remedy="Level the calibration frame of the cameras, or give a trial on level ground",
    source=(
        "over ground the floor rises by 0.20 (SD) in eleven recordings of McGill, at most 0.34; on "
        "a belt, where feet roll a little while they count as flat, by 0.3 to 0.8 in three"
    ),
)
BELT: Final[Finding] = Finding(
    name="belt",
    needs=Laboratory,
    values=_belt,
    numbers={"share": 0.05},
    limits=ROLLING,
    unit="m/s",
    sentence=(
        "flat feet move back at {feet:.3f} m/s, but the belt's speed is given as {belt:.3f} m/s: "
        "it is another trial's, or the markers' scale or frame rate is wrong"
    ),
)  # fmt: skip
