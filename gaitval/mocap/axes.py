"""From the laboratory's axes to the project's (REP-103: x forward, y left, z up).

Floors are level and cameras are calibrated with an axis along the walkway, so a laboratory's axes
can be found from a person standing in it: up is the signed axis nearest to the line from the feet
to the pelvis, forward the one nearest to the line from the heels to the toes.

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
OPPOSITE: Final = float(np.cos(np.radians(130.0)))
"""Cosine of the angle between pelvis and feet beyond which one faces backwards; feet turn out by
25°."""
LARGEST_TURN: Final = 30.0
"""A person who faces along an axis of the laboratory does so to within this angle, degrees."""
LARGEST_TURN_SAID: Final = 60.0
"""Degrees, likewise, of axes that the user says, as for who stands at an angle to the walkway."""

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

_PELVIS: Final = ("ASIS", "PSIS")  # of each side; a sacral marker may replace both PSIS
_HEEL: Final = ("Heel",)
_TOES: Final = ("MT1", "MT2", "MT5", "Toe")
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
        """The same axes as text for `--axes`."""
        forward, _, up = self.rotation
        return f"forward={axis_name(forward)} up={axis_name(up)}"

    @property
    def spoken(self) -> str:
        """The three directions, for a sentence."""
        forward, left, up = (axis_name(row) for row in self.rotation)
        return f"{forward} forward, {left} to the left, {up} up"


def axis_name(vector: Array) -> str:
    """The signed axis along a `vector`, such as "+x"."""
    index = int(np.argmax(np.abs(vector)))
    return f"{'-' if vector[index] < 0 else '+'}{LETTERS[index]}"


def detect_axes(
    recording: Recording, landmarks: Mapping[str, str], said: LaboratoryAxes | None = None
) -> LaboratoryAxes:
    """Axes of the laboratory from `recording`, a standing trial in them, or those that the user
    `said`, if it does not contradict them. `landmarks` names the marker of each, such as
    {"R.ASIS": "RASI"}; those present are used.

    Raises RecordError if the markers needed are missing; the person's size is wrong by a power of
    ten (unit); the person does not stand, or stands across the axes (up to 60° across those said);
    pelvis and feet do not face one way (markers exchanged).
    """
    _check_straight(recording, landmarks)
    where, points = recording.source, standing_points(recording, landmarks)
    upward = upward_of(points)
    up = nearest_axis(upward) if said is None else said.rotation[2]
    lean = _apart(upward, up)
    taken = "taken to be" if said is None else "said to be (--axes)"
    if lean > LARGEST_LEAN:
        raise RecordError(
            f"{where}: the direction from the ankles to the pelvis is {lean:.0f}° off "
            f"{axis_name(up)}, which is {taken} up, more than {LARGEST_LEAN:.0f}° (nearest: "
            f"{axis_name(upward)}): this is not a standing trial, or the floor is not parallel to "
            "two of the laboratory's axes, or other axes were said. Give a standing trial, or the "
            'axes, for example --axes "forward=+x up=+z".'
        )
    ahead = _facing(where, points, up)
    forward = nearest_axis(ahead) if said is None else said.rotation[0]
    turn, most = _apart(ahead, forward), LARGEST_TURN if said is None else LARGEST_TURN_SAID
    if turn > most:
        raise RecordError(
            f"{where}: the feet point {turn:.0f}° off {axis_name(forward)}, which is {taken} "
            f"forward, more than {most:.0f}° (nearest: {axis_name(ahead)}). Give the axis that "
            f'the person walks along, for example --axes "forward={axis_name(ahead)} '
            f'up={axis_name(up)}".'
        )
    # y = z × x is to the left of a person who faces along x.
    axes = LaboratoryAxes(np.stack([forward, np.cross(up, forward), up]), "")
    return LaboratoryAxes(
        axes.rotation,
        f"Axes of the laboratory {taken} {axes.spoken} (in the standing trial the direction from "
        f"the ankles to the pelvis is {lean:.1f}° off the vertical, and the feet point {turn:.1f}° "
        f"off {axis_name(forward)}).",
    )


def standing_points(recording: Recording, landmarks: Mapping[str, str]) -> dict[str, Array]:
    """Median position (3,) of each of `landmarks` in `recording` from the pelvis (who may walk).
    Raises RecordError if they are too few, or of no person's size.
    """
    seen = {at: recording.marker(name) for at, name in landmarks.items() if name in recording.names}
    pelvis = [path for at, path in seen.items() if at.rpartition(".")[2] in _PELVIS]
    middle = np.mean(pelvis, axis=0) if pelvis else np.zeros(3)
    # Without one frame of the whole pelvis nothing is subtracted.
    middle = middle if np.isfinite(middle).any() else np.zeros(3)
    found = {
        at: np.median(path[whole], axis=0)
        for at, path in ((at, path - middle) for at, path in seen.items())
        if (whole := np.isfinite(path).all(axis=1)).any()
    }
    parts = {"the pelvis (ASIS, PSIS)": _PELVIS, "the ankles": ("Ankle",), "the heels": _HEEL}
    for what, names in (parts | {"the toes (MT1, MT2, MT5, Toe)": _TOES}).items():
        if not any(f"{side}.{name}" in found for side in "RL" for name in names):
            raise RecordError(
                f"{recording.source}: no marker on {what} is seen, or the marker set names none, "
                "so neither the laboratory's axes nor the person's size can be found. Label the "
                "markers in the standing trial, or give a marker set that has your names for them "
                "(--marker-set; `gaitval markers FILE` drafts one)."
            )
    _check_height(recording.source, float(np.linalg.norm(upward_of(found))))
    return found


def _check_height(where: str, height: float) -> None:
    """Refuse a pelvis that is too near to or too far from the ankles for a person, m."""
    if not PELVIS_HEIGHT.fits(height):
        wrong = confused(PELVIS_HEIGHT, height)
        raise RecordError(
            f"{where}: the pelvis is {height:.3g} m from the ankles, but a person's is "
            f"{PELVIS_HEIGHT.low:g} to {PELVIS_HEIGHT.high:g} m away: the markers are in the wrong "
            f"unit{f', {wrong}' if wrong else ''}, their names are wrong, or the person does not "
            "stand upright. Check the file and the labels in the recording program."
        )


def _mean(points: Mapping[str, Array], names: tuple[str, ...], sides: str = "RL") -> Array:
    """Mean of the two sides' means, so that a side with more landmarks does not weigh more; NaN
    without a landmark. The sacrum has no side.
    """
    means = []
    for side in sides:
        at = [name if name == "Sacrum" else f"{side}.{name}" for name in names]
        if there := [points[name] for name in at if name in points]:
            means.append(np.mean(there, axis=0))
    return np.mean(means, axis=0) if means else np.full(3, np.nan)


def upward_of(points: Mapping[str, Array]) -> Array:
    """From the ankles to the pelvis, (3,) m, of `points` by landmark."""
    return _mean(points, _PELVIS) - _mean(points, ("Ankle",))


def _facing(where: str, points: Mapping[str, Array], up: Array) -> Array:
    """Horizontal unit vector (3,) from the heels to the toes of `points`, at right angles to `up`;
    toeing out cancels. RecordError, about `where`, if pelvis and feet do not face one way.
    """
    # One unit vector each: the direction of the feet's sum halves the angle between them.
    ways = {
        what: unit_vector(_level(_mean(points, front, sides) - _mean(points, rear, sides), up))
        for what, front, rear, sides in (
            ("the right foot", _TOES, _HEEL, "R"),
            ("the left foot", _TOES, _HEEL, "L"),
            ("the pelvis", ("ASIS",), ("PSIS", "Sacrum"), "RL"),
        )
    }
    ways = {what: way for what, way in ways.items() if np.isfinite(way).all()}
    for what, way in ways.items():
        others = [other for name, other in ways.items() if name != what]
        # Two heels, or toes, that are exchanged between the sides turn both feet by less.
        if others and way @ np.sum(others, axis=0) < OPPOSITE:
            raise RecordError(
                f"{where}: {what} faces away from the rest: its front and rear markers (ASIS and "
                "PSIS, or toes and heel), or those of all others, are exchanged. Correct these "
                "labels in the recording program, in all trials, and export them again."
            )
    feet = [way for what, way in ways.items() if "foot" in what]
    if not feet:
        feet = [_level(_mean(points, _TOES) - _mean(points, _HEEL), up)]
    return unit_vector(np.sum(feet, axis=0))


def _level(vector: Array, up: Array) -> Array:
    return vector - (vector @ up) * up


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
    pelvis = _path(shown, landmarks, _FRONT + _REAR)
    seen = np.isfinite(pelvis).all(axis=1)
    if np.count_nonzero(seen) < 2:
        raise RecordError(
            f"{where}: the markers of the pelvis (ASIS, PSIS) are not seen at once, each in more "
            "than half of the frames that show one, so the direction of walking is unknown. Label "
            "the trial, or take a part of it that shows them with --trial-time BEGIN:END, in s."
        )
    _check_same_axes(shown, landmarks, pelvis)
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


def _check_same_axes(recording: Recording, landmarks: Mapping[str, str], pelvis: Array) -> None:
    """Refuse a trial whose axes or unit differ from the standing trial's, by the pelvis' path."""
    where = recording.source
    # Of protocols without ankles in the walk, the feet and knees show it as well.
    for names in (("Ankle",), _HEEL, _TOES, ("Knee",)):
        below = tuple(f"{side}.{name}" for side in "RL" for name in names)
        upward = pelvis - _path(recording, landmarks, below)
        upward = upward[np.isfinite(upward).all(axis=1)]
        if len(upward):
            break
    if len(upward):
        middle = np.median(upward, axis=0)
        what = {"Ankle": "the ankles", "Knee": "the knees"}.get(names[0], "the feet")
        if names != ("Knee",):
            _check_height(where, float(np.linalg.norm(middle)))
        off = _apart(middle, np.array([0.0, 0.0, 1.0]))
        if off > LIMITS["farthest_lean"]:
            raise RecordError(
                f"{where}: in the axes of the standing trial the direction from {what} to the "
                f"pelvis is {off:.0f}° off the vertical: this trial has other axes than the "
                "standing trial. Export both in the same axes."
            )


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
    if off > LARGEST_TURN_SAID:
        raise RecordError(
            f"{recording.source}: the person faces {off:.0f}° off the direction of walking: walks "
            "backwards or sideways, or front and rear markers (ASIS and PSIS, or toes and heel) "
            "are exchanged. Only forward walking can be analysed; check the markers' names."
        )
