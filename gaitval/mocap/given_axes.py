"""The laboratory's axes as a user writes them, checked with the standing trial."""

import re
from collections.abc import Mapping

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.axes import (
    LARGEST_LEAN,
    LETTERS,
    LaboratoryAxes,
    axis_name,
    check_pelvis,
    facing_of,
    nearest_axis,
    standing_points,
    unit_vector,
    upward_of,
)
from gaitval.mocap.recording import Recording


def parse_axes(text: str) -> LaboratoryAxes:
    """Laboratory axes as a user writes them: `forward=+x up=+y`.

    Parameters
    ----------
    text : two or more of forward, backward, left, right, up and down, each with a signed axis; a
        plus sign may be left out (`up=z` is `up=+z`).

    Raises
    ------
    RecordError
        The text has another form, an axis is not x, y or z, two directions share an axis, or three
        of them form a left-handed system.
    """
    form = (
        'Name the axis that the person faces along and the axis that points up: "forward=+x up=+y".'
    )
    found: dict[str, Array] = {}
    for part in text.replace(",", " ").split():
        name, _, axis = part.lower().partition("=")
        match = re.fullmatch(r"([+-]?)([xyz])", axis)
        if name not in ("forward", "backward", "left", "right", "up", "down") or match is None:
            raise RecordError(f'axes "{text}": {part!r} is not understood. {form}')
        vector = np.zeros(3)
        vector[LETTERS.index(match[2])] = -1.0 if match[1] == "-" else 1.0
        opposite = {"backward": "forward", "right": "left", "down": "up"}
        if name in opposite:
            name, vector = opposite[name], -vector
        if name in found:
            raise RecordError(f'axes "{text}": {name} is given twice. {form}')
        found[name] = vector
    if len(found) < 2:
        raise RecordError(f'axes "{text}": two directions are needed. {form}')
    given = list(found.values())
    # Signed unit vectors are at right angles unless they lie along the same axis.
    if any(a @ b for i, a in enumerate(given) for b in given[:i]):
        raise RecordError(f'axes "{text}": two directions share an axis. {form}')
    forward = found.get("forward")
    left = found.get("left")
    up = found.get("up")
    # The third axis of a right-handed system: x = y × z, z = x × y, y = z × x.
    if forward is None:
        forward = np.cross(_given(left), _given(up))
    if up is None:
        up = np.cross(forward, _given(left))
    if left is None:
        left = np.cross(up, forward)
    rotation = np.stack([forward, left, up])
    # Three given directions may contradict each other; two never do.
    if np.linalg.det(rotation) < 0:
        raise RecordError(
            f'axes "{text}": forward, left and up as given form a left-handed system, which no '
            f"recording has: one of them is reversed. {form}"
        )
    axes = LaboratoryAxes(rotation, "")
    return LaboratoryAxes(rotation, f"Axes of the laboratory as given: {axes.spoken}.")


def check_axes(axes: LaboratoryAxes, recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse the user's axes if the standing trial contradicts them.

    The person may stand at an angle to the walkway, so up must agree and left must be left, but
    forward may be up to 60° off.

    Parameters
    ----------
    axes : of `parse_axes`.
    recording, landmarks : as for `detect_axes`.

    Raises
    ------
    RecordError
        As `detect_axes`, and if the given axes contradict the standing trial.
    """
    points = standing_points(recording, landmarks)
    upward = unit_vector(upward_of(points))
    lean = float(np.arccos(np.clip(upward @ axes.rotation[2], -1, 1)))
    if lean > LARGEST_LEAN:
        raise RecordError(
            f"{recording.source}: the axes say that up is {axis_name(axes.rotation[2])}, but in "
            "the standing trial the direction from the ankles to the pelvis is "
            f"{np.degrees(lean):.0f}° off it (nearest: {axis_name(nearest_axis(upward)[0])}). "
            "Correct --axes, or leave it out."
        )
    facing = facing_of(points, axes.rotation[2])
    turn = float(np.arccos(np.clip(facing @ axes.rotation[0], -1, 1)))
    if turn > np.radians(60.0):
        raise RecordError(
            f"{recording.source}: the axes say that forward is {axis_name(axes.rotation[0])}, but "
            f"in the standing trial the feet point {np.degrees(turn):.0f}° off it (nearest: "
            f"{axis_name(nearest_axis(facing)[0])}). Correct --axes, or leave it out."
        )
    check_pelvis(recording.source, points, axes)


def _given(vector: Array | None) -> Array:
    assert vector is not None  # two of the three were found
    return vector
