"""A synthetic recording of walking with known events, places of the feet and forces.

The feet stand still on the ground or the belt in stance and swing forward in between; strides
last `STRIDE`, stance takes `STANCE` of it. A foot's force rises and falls within 40 ms.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.mocap.recording import Plate, Recording

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""From axes y up to z up."""

STRIDE = 1.1
STANCE = 0.62
SPEED = 1.2
WIDTH = 0.12
"""Half the distance between the lines of the feet, m."""
WEIGHT = 700.0
"""N."""
FREE_MOMENT = 3.0
"""Nm, of the right foot in stance; the opposite on the left."""

_FOOT = {
    "Heel": (0.0, 0.0, 0.03),
    "MT1": (0.19, 0.04, 0.03),
    "MT5": (0.16, -0.045, 0.02),
    "Ankle": (0.05, -0.04, 0.08),
}
"""Right foot: from the place of its heel, m; mirrored on the left."""
_BODY = {"ASIS": (0.12, -0.12, 1.0), "PSIS": (-0.08, -0.04, 1.02), "Knee": (0.02, -0.13, 0.5)}

NAMES = tuple(f"{side[0].upper()}.{name}" for side in SIDES for name in (*_BODY, *_FOOT))
LANDMARKS = {name: name for name in NAMES}
SEGMENTS = {
    f"{side[0].upper()}.{name}": segment if segment == "pelvis" else f"{segment}_{side[0]}"
    for side in SIDES
    for name, segment in {
        **{"ASIS": "pelvis", "PSIS": "pelvis", "Knee": "thigh", "Ankle": "shank"},
        **{"Heel": "foot", "MT1": "foot", "MT5": "foot"},
    }.items()
}


@dataclass(frozen=True)
class Rectangle:
    """A plate on the floor: from x and y to x and y, m."""

    x: tuple[float, float]
    y: tuple[float, float]

    @property
    def corners(self) -> Array:
        """(4, 3), in the order of a plate's quadrants with z down."""
        (back, front), (right, left) = self.x, self.y
        return np.array(
            [[front, left, 0], [front, right, 0], [back, right, 0], [back, left, 0]], dtype=float
        )[[0, 3, 2, 1]]

    def holds(self, point: Array) -> NDArray[np.bool_]:
        """(T,) whether points (T, 3) are on it."""
        return np.asarray(
            (self.x[0] <= point[:, 0])
            & (point[:, 0] < self.x[1])
            & (self.y[0] <= point[:, 1])
            & (point[:, 1] < self.y[1])
        )


BELTS = (
    Rectangle(x=(-1.0, 1.0), y=(-0.5, 0.0)),
    Rectangle(x=(-1.0, 1.0), y=(0.0, 0.5)),
)
"""A split-belt treadmill, right belt first."""


def strikes(side: Side, duration: float) -> Array:
    """Heel strikes within the trial, s; the left foot's half a stride after the right one's."""
    first = 0.3 if side == "right" else 0.3 + 0.5 * STRIDE
    times = first + STRIDE * np.arange(-3, int(duration / STRIDE) + 3)
    return times[(times > 0.0) & (times < duration)]


def toe_offs(side: Side, duration: float) -> Array:
    """Toe-offs within the trial, s."""
    first = 0.3 if side == "right" else 0.3 + 0.5 * STRIDE
    times = first + STANCE * STRIDE + STRIDE * np.arange(-3, int(duration / STRIDE) + 3)
    return times[(times > 0.0) & (times < duration)]


def _phase(side: Side, time: Array) -> tuple[Array, Array]:
    """Number of the stride and the share of it that has passed since the strike."""
    strides = (time - 0.3) / STRIDE - (0.0 if side == "right" else 0.5)
    number = np.floor(strides)
    return number, strides - number


def _heel(side: Side, time: Array, belt: float) -> Array:
    """(T, 3) place of the heel on the ground, in the axes of the laboratory."""
    number, phase = _phase(side, time)
    swing = np.clip((phase - STANCE) / (1.0 - STANCE), 0.0, 1.0)
    stride = SPEED * STRIDE
    lag = 0.0 if side == "right" else 0.5
    forward = stride * (number + lag + swing**2 * (3.0 - 2.0 * swing)) - belt * (time - 0.3) + 0.2
    sideways = np.full_like(time, -WIDTH if side == "right" else WIDTH)
    return np.stack([forward, sideways, np.zeros_like(time)], axis=1)


def _lift(side: Side, name: str, time: Array) -> Array:
    """(T,) height of a marker of the foot above its place in standing."""
    _, phase = _phase(side, time)
    if name in ("Heel", "Ankle"):
        begin, end, height = 0.45, 1.0, 0.12
    else:
        begin, end, height = 0.55, 1.08, 0.06  # the forefoot comes down after the heel
    since = np.where(phase < end - 1.0, phase + 1.0, phase)
    share = np.clip((since - begin) / (end - begin), 0.0, 1.0)
    return height * np.sin(np.pi * share)


def centre_of_pressure(side: Side, time: Array, belt: float) -> Array:
    """(T, 3) m: from heel to metatarsal heads in the time of a stance."""
    _, phase = _phase(side, time)
    share = np.clip(phase / STANCE, 0.0, 1.0)
    point = _heel(side, time, belt)
    point[:, 0] += 0.02 + 0.15 * share
    return point


def vertical_force(side: Side, time: Array) -> Array:
    """(T,) N on one foot: rising and falling within 40 ms of the events."""
    _, phase = _phase(side, time)
    since, left = phase * STRIDE, (STANCE - phase) * STRIDE
    return WEIGHT * np.clip(np.minimum(since, left) / 0.04, 0.0, 1.0)


def walk(
    duration: float = 6.0,
    *,
    belt: float = 0.0,
    plates: Sequence[Rectangle] = (),
    marker_rate: float = 100.0,
    force_rate: float = 500.0,
    offset: Callable[[Array], Array] | None = None,
) -> Recording:
    """A walk along x.

    Parameters
    ----------
    belt : m/s, of a treadmill.
    plates : what is on the floor. A foot's force goes to the plate under its centre of pressure.
    offset : of each plate, (T, 6) N and Nm about the origin, from the times (T,).
    """
    time = np.arange(round(duration * marker_rate)) / marker_rate
    paths = []
    for side in SIDES:
        mirror = np.array([1.0, 1.0 if side == "right" else -1.0, 1.0])
        body = np.stack([(SPEED - belt) * (time - 0.3) + 0.2, 0 * time, 0 * time], axis=1)
        paths += [body + mirror * np.array(at) for at in _BODY.values()]
        for name, at in _FOOT.items():
            path = _heel(side, time, belt) + mirror * np.array(at)
            path[:, 2] += _lift(side, name, time)
            paths.append(path)
    samples = np.arange(round(duration * force_rate)) / force_rate
    made = []
    for number, rectangle in enumerate(plates):
        force, moment = np.zeros((len(samples), 3)), np.zeros((len(samples), 3))
        for side in SIDES:
            point = centre_of_pressure(side, samples, belt)
            vertical = np.where(rectangle.holds(point), vertical_force(side, samples), 0.0)
            part = np.stack([0.1 * vertical, 0.05 * vertical, vertical], axis=1)
            free = FREE_MOMENT * (1.0 if side == "right" else -1.0) * vertical / WEIGHT
            force += part
            moment += np.cross(point, part) + free[:, None] * np.array([0.0, 0.0, 1.0])
        if offset is not None:
            shown = offset(samples)
            force, moment = force + shown[:, :3], moment + shown[:, 3:]
        made.append(_plate(str(number + 1), rectangle, force, moment))
    return Recording(
        source="walk.c3d",
        axes="project",
        names=NAMES,
        markers=np.stack(paths, axis=1),
        marker_rate=marker_rate,
        plates=tuple(made),
        force_rate=force_rate if made else 0.0,
    )


def _plate(name: str, rectangle: Rectangle, force: Array, moment: Array) -> Plate:
    vertical = np.where(force[:, 2] > 10.0, force[:, 2], np.nan)
    point = np.stack([-moment[:, 1] / vertical, moment[:, 0] / vertical, 0.0 * vertical], axis=1)
    free = np.zeros_like(force)
    free[:, 2] = np.nan_to_num((moment - np.cross(point, force))[:, 2])
    return Plate(name, rectangle.corners, force, point, free, moment)
