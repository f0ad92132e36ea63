"""From the laboratory's axes to the project's (REP-103: x forward, y left, z up).

Floors are level and cameras are calibrated with an axis along the walkway, so a laboratory's axes
can be found from a person standing in it: up is the signed axis nearest to the line from the feet
to the pelvis, forward the one nearest to where pelvis or feet face.

Landmarks are named as in `gaitval.scaling.joint_centres`: `R.` or `L.` and ASIS, PSIS, Knee, Ankle,
Heel, MT1, MT5 …; any other marker on the toes or the metatarsals counts as `Toe`, `MT2`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.activities import check_on_ground
from gaitval.mocap.foot_markers import facing
from gaitval.mocap.recording import Recording
from gaitval.units import PELVIS_HEIGHT, confused

LARGEST_LEAN: Final = 20.0
"""A standing person's pelvis is above the ankles to within this angle, degrees."""
LARGEST_TURN: Final = 60.0
"""A person who walks faces along the way to within this angle, degrees."""

LIMITS: Final[Mapping[str, float]] = {
    # Degrees. In the median frame a walking person's pelvis is above the middle of the
    # ankles to within this angle; exchanged axes put it 90 or 180 degrees off.
    "farthest_lean": 45.0,
    # Walking is faster than this, m/s; standing sway is slower.
    "slowest_walk": 0.1,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""


TURNED: Final = (float(np.cos(np.radians(45.0))), 0.25)
"""Who faces 45° off the usual direction in a quarter of the frames does not walk straight; pelvises
rotate by 15° at most."""

ACROSS: Final = ("ASIS", "PSIS", "Knee", "Ankle", "Heel")
"""Landmarks of which the line from right to left shows where the person faces, the best first."""
ALONG_AXIS: Final = float(np.radians(5.0))
"""A path within this angle of an axis of the laboratory is taken to lie along it, as walkways and
belts do; the rest of the angle is the person's own."""

_HEEL: Final = ("Heel",)
_TOES: Final = ("MT1", "MT2", "MT5", "Toe")
_BELOW: Final = {
    "the ankles": ("Ankle",),
    "the heels": _HEEL,
    "the toes": _TOES,
    "the knees": ("Knee",),
}
_FRONT: Final = ("R.ASIS", "L.ASIS")
_REAR: Final = ("R.PSIS", "L.PSIS", "Sacrum")
LETTERS: Final = "xyz"
"""Names of the axes, in their order."""


@dataclass(frozen=True)
class LaboratoryAxes:
    """The directions of the laboratory's axes.

    Attributes
    ----------
    rotation : (3, 3), takes vectors in laboratory axes to project axes; rows are forward, left and
        up in the laboratory's axes.
    description : what was decided, and why, for the user.
    """

    rotation: Array
    description: str

    @property
    def option(self) -> str:
        """The same axes as text, as `read_recording` takes them."""
        forward, _, up = self.rotation
        return f"forward={axis_name(forward)} up={axis_name(up)}"


def axis_name(vector: Array) -> str:
    """The signed axis along a `vector`, such as "+x"."""
    index = int(np.argmax(np.abs(vector)))
    return f"{'-' if vector[index] < 0 else '+'}{LETTERS[index]}"


def detect_axes(recording: Recording, landmarks: Mapping[str, str]) -> LaboratoryAxes:
    """Axes of the laboratory from `recording`, a standing trial in them. `landmarks` names the
    marker of each, such as {"R.ASIS": "RASI"}; those present are used.

    Raises RecordError if the markers needed are missing; the person's size is wrong by a power of
    ten (unit); the person does not stand, or turns; pelvis and feet do not face one way (markers
    exchanged).
    """
    _check_straight(recording, landmarks)
    upward, below = _upward(recording, landmarks, _pelvis_path(recording, landmarks, least=1))
    up = nearest_axis(upward)
    lean = _apart(upward, up)
    if lean > LARGEST_LEAN:
        raise RecordError(
            f"{recording.source}: the direction from {below} to the pelvis is {lean:.0f}° off "
            f"{axis_name(up)}, the nearest axis, more than {LARGEST_LEAN:.0f}°: this is not a "
            "standing trial, or the floor is not parallel to two of the laboratory's axes. Give a "
            "standing trial, or turn the files so that one axis is vertical."
        )
    # Any axes with this one up show where the person faces.
    upright = np.stack([np.roll(up, 1), np.cross(up, np.roll(up, 1)), up])
    ahead = facing(recording.turned(upright), landmarks) @ upright
    forward = nearest_axis(ahead)
    # y = z × x is to the left of a person who faces along x.
    left = np.cross(up, forward)
    return LaboratoryAxes(
        np.stack([forward, left, up]),
        f"Axes of the laboratory taken to be {axis_name(forward)} forward, {axis_name(left)} to "
        f"the left, {axis_name(up)} up (in the standing trial the direction from {below} to the "
        f"pelvis is {lean:.1f}° off the vertical, and the person faces "
        f"{_apart(ahead, forward):.1f}° off {axis_name(forward)}).",
    )


def _pelvis_path(recording: Recording, landmarks: Mapping[str, str], least: int) -> Array:
    """Path (T, 3) m of the pelvis' middle; RecordError if fewer frames than `least` show it."""
    pelvis = _path(recording, landmarks, _FRONT + _REAR)
    if np.count_nonzero(np.isfinite(pelvis).all(axis=1)) < least:
        raise RecordError(
            f"{recording.source}: the markers of the pelvis (ASIS, PSIS) are not seen at once, "
            "each in more than half of the frames that show one, so neither the laboratory's axes "
            "nor the direction of walking can be found. Label the trial, give a marker set that "
            "has your names (--marker-set; `gaitval markers FILE` drafts one), or take a part that "
            "shows them with --trial-time BEGIN:END, in s."
        )
    return pelvis


def _upward(recording: Recording, landmarks: Mapping[str, str], pelvis: Array) -> tuple[Array, str]:
    """Median (3,) m of the way up to the `pelvis`, and from where: the ankles or, in protocols that
    do not mark them in the walk, the feet or knees. Raises RecordError if none is seen, or if the
    pelvis is too near to them or too far for a person.
    """
    seen = dict[str, Array]()
    for each, names in _BELOW.items():
        below = tuple(f"{side}.{name}" for side in "RL" for name in names)
        upward = pelvis - _path(recording, landmarks, below)
        seen[each] = upward[np.isfinite(upward).all(axis=1)]
    what = next((each for each, upward in seen.items() if len(upward)), None)
    if what is None:
        raise RecordError(
            f"{recording.source}: no marker on {', '.join(_BELOW)} is seen together with the "
            "pelvis, so neither the axes nor the person's size can be found. Label the markers, or "
            "give a marker set that has your names for them (--marker-set; `gaitval markers FILE` "
            "drafts one)."
        )
    middle = np.median(seen[what], axis=0)
    height = float(np.linalg.norm(middle))
    if what != "the knees" and not PELVIS_HEIGHT.fits(height):
        wrong = confused(PELVIS_HEIGHT, height)
        raise RecordError(
            f"{recording.source}: the pelvis is {height:.3g} m from {what}, but a person's is "
            f"{PELVIS_HEIGHT.low:g} to {PELVIS_HEIGHT.high:g} m away: the markers are in the wrong "
            f"unit{f', {wrong}' if wrong else ''}, their names are wrong, or the person does not "
            "stand upright. Check the file and the labels in the recording program."
        )
    return middle, what


def unit_vector(vector: Array) -> Array:
    """A `vector` of length 1; zero stays zero."""
    length = float(np.linalg.norm(vector))
    return vector / length if length else vector


def nearest_axis(vector: Array) -> Array:
    """The signed laboratory axis nearest to a `vector`."""
    index = int(np.argmax(np.abs(vector)))
    axis = np.zeros(3)
    axis[index] = np.sign(vector[index])
    return axis


def _apart(one: Array, other: Array) -> float:
    """Degrees between two vectors."""
    return float(np.degrees(np.arccos(np.clip(unit_vector(one) @ unit_vector(other), -1, 1))))


def turn_to_walking_direction(
    recording: Recording, landmarks: Mapping[str, str], shown: Recording | None = None
) -> tuple[Recording, str]:
    """A walking trial turned about the vertical so that the person walks along +x, and what was
    decided, for the user. `recording` is in the project's axes (`Recording.turned` with the axes of
    the standing trial); `landmarks` are as in `detect_axes`.

    Overground this is the direction of the pelvis' path. On a treadmill, where the feet on the
    ground move faster than the pelvis, it is the direction of the pelvis relative to them. A
    direction within 5° of an axis is taken to lie along it: the trial is then turned by a multiple
    of 90°. `shown` is the same trial without the markers that are not on the body, which decide
    nothing; left out, all do.

    Raises RecordError if the trial is not yet in the project's axes, or its axes or unit differ
    from the standing trial's; the person stands, runs, turns or walks backwards (or front and rear
    markers are exchanged).
    """
    where = recording.source
    if recording.axes != "project":
        raise RecordError(
            f"{where}: still in the laboratory's axes. Turn it with the axes of the standing "
            "trial first."
        )
    shown = recording if shown is None else shown
    pelvis = _pelvis_path(shown, landmarks, least=2)
    upward, below = _upward(shown, landmarks, pelvis)
    lean = _apart(upward, np.array([0.0, 0.0, 1.0]))
    if lean > LIMITS["farthest_lean"]:
        raise RecordError(
            f"{where}: in the axes of the standing trial the direction from {below} to the pelvis "
            f"is {lean:.0f}° off the vertical: this trial has other axes than the standing trial. "
            "Export both in the same axes."
        )
    _check_straight(shown, landmarks)
    velocity, how = _walking_velocity(shown, landmarks, pelvis)
    speed = float(np.linalg.norm(velocity))
    check_on_ground(shown, landmarks)
    angle = float(np.arctan2(velocity[1], velocity[0]))
    quarter = round(angle / (np.pi / 2)) * np.pi / 2
    along = abs(angle - quarter) <= ALONG_AXIS
    turned_by, off = (-quarter, angle - quarter) if along else (-angle, 0.0)
    cosine, sine = np.cos(turned_by), np.sin(turned_by)
    rotation = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    # cos and sin of a right angle are 1 and 0 only to rounding, which would move every marker.
    if off or not turned_by:
        rotation = np.round(rotation)  # a multiple of a right angle, exactly
    turned = recording.turned(rotation)
    _check_facing(shown.turned(rotation), landmarks)
    # The same turn within −180° to 180°, for the text.
    by = 180.0 - (180.0 - np.degrees(turned_by)) % 360.0
    # that of the strides, which is among the results, differs a little
    text = (
        f"Walks {how} at {speed:.2f} m/s by a first estimate; turned by {by:.0f}° about the "
        "vertical to walk along +x"
    )
    return turned, text + (f" (the path is {np.degrees(off):.1f}° off it)." if off else ".")


def _walking_velocity(
    recording: Recording, landmarks: Mapping[str, str], pelvis: Array
) -> tuple[Array, str]:
    """Horizontal velocity (2,) m/s relative to the ground or belt, and which of the two it was, by
    the path (T, 3) m of the `pelvis`. Raises RecordError if the person stands.
    """
    where = recording.source
    seen = np.isfinite(pelvis).all(axis=1)
    time = recording.time[seen]
    # The slope of a line through the path: single frames at its ends do not decide.
    drift = np.array([np.polyfit(time - time[0], pelvis[seen, i], 1)[0] for i in range(2)])
    ground = _ground_velocity(recording, landmarks)
    # Overground the pelvis travels and the feet on the ground rest; on a belt it is the reverse.
    if np.linalg.norm(drift) > np.linalg.norm(ground):
        velocity, how = drift, "overground"
    else:
        velocity, how = drift - ground, "on a treadmill"
    speed = float(np.linalg.norm(velocity))
    if speed < LIMITS["slowest_walk"]:
        raise RecordError(
            f"{where}: neither the pelvis nor a belt under the feet moves (at most {speed:.2f} "
            "m/s): this is not a walking trial. Give a walking trial, or the part of this one in "
            "which the person walks with --trial-time; or give it as --static if the person stands."
        )
    return velocity, how


def _check_straight(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse a person who turns, by the line between the ASIS, or between others at both sides."""
    for name in ACROSS:
        left, right = (_path(recording, landmarks, (f"{side}.{name}",)) for side in "LR")
        across = left - right
        if np.isfinite(across).all(axis=1).any():
            break
    seen = np.asarray(np.isfinite(across).all(axis=1))
    across = across[seen] / np.linalg.norm(across[seen], axis=1)[:, None]
    usual = unit_vector(np.median(across, axis=0)) if len(across) else np.zeros(3)
    if np.sum(across @ usual < TURNED[0]) / max(len(across), 1) > TURNED[1]:
        raise RecordError(
            f"{recording.source}: the person turns: the pelvis does not face within 45° of one "
            "direction. Give each part in which the person walks straight, in s, as a trial: "
            "--trial FILE --trial-time BEGIN:END."
        )


def _path(recording: Recording, landmarks: Mapping[str, str], names: tuple[str, ...]) -> Array:
    """Mean (T, 3) of these landmarks; NaN where any of those used is hidden."""
    used = [landmarks[name] for name in names if landmarks.get(name) in recording.names]
    seen = {name: np.isfinite(recording.marker(name)).all(axis=1) for name in used}
    # A landmark that is hidden most of the time would hide the mean; before a person comes in and
    # after they have left, all are.
    there = np.any([*seen.values()], axis=0).sum() if used else 0
    shown = [name for name in used if seen[name].sum() > 0.5 * there]
    if not shown:
        return np.full((len(recording.markers), 3), np.nan)
    return np.asarray(np.mean([recording.marker(name) for name in shown], axis=0))


def _ground_velocity(recording: Recording, landmarks: Mapping[str, str]) -> Array:
    """Horizontal velocity (2,) m/s of the surface under the feet: about zero, or a belt's.

    It is the median velocity of heels and toes in the lower quarter of their height range: each is
    on the ground through most of stance, and a quarter of its rise separates stance from swing.
    """
    velocities = []
    for side in "RL":
        for name in _HEEL + _TOES:
            marker = landmarks.get(f"{side}.{name}")
            if marker not in recording.names:
                continue
            path = recording.marker(str(marker))
            velocity = np.gradient(path[:, :2], 1 / recording.marker_rate, axis=0)
            seen = np.isfinite(velocity).all(axis=1) & np.isfinite(path[:, 2])
            if np.count_nonzero(seen) < 2:
                continue
            # Percentiles, because a spike of one frame would stretch the range.
            low, high = np.nanpercentile(path[:, 2], [2, 98])
            velocities.append(velocity[seen & (path[:, 2] <= low + 0.25 * (high - low))])
    if not velocities:
        return np.zeros(2)
    return np.asarray(np.median(np.concatenate(velocities), axis=0))


def _check_facing(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse a person who walks along +x but does not face it."""
    off = _apart(facing(recording, landmarks), np.array([1.0, 0.0, 0.0]))
    if off > LARGEST_TURN:
        raise RecordError(
            f"{recording.source}: the person faces {off:.0f}° off the direction of walking: walks "
            "backwards or sideways, or front and rear markers (ASIS and PSIS, or toes and heel) "
            "are exchanged. Only forward walking can be analysed; check the markers' names."
        )
