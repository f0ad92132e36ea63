"""Hip, knee and ankle centres as somebody else has them: of a scaled OpenSim model, or points that
a program computed and wrote among the markers.

Both are the same thing: a centre beside markers of the segment above it, in some axes, in a pose or
in many. The markers are laid on those of the standing trial, rigidly (Kabsch 1976), and the centre
goes with them. A segment with two markers alone (Plug-in Gait's thigh and shank) takes the given
centre at its upper end as the third, which is laid before.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import ScalingError
from gaitval.mocap.recording import Recording
from gaitval.scaling.opensim.model import OsimModel
from gaitval.scaling.opensim.placing import place
from gaitval.scaling.rigid import FEWEST, carried, superimposed

ABOVE: Final = {"Hip": ("pelvis", ""), "Knee": ("thigh", "Hip"), "Ankle": ("shank", "Knee")}
"""Segment above each joint, and the joint at its upper end; a joint comes after that above it."""
BELOW: Final = {"Hip": "thigh", "Knee": "shank", "Ankle": "foot"}
"""Segment below each joint."""
BODIES: Final = {
    "pelvis": ("pelvis",),
    "thigh": ("femur", "thigh"),
    "shank": ("tibia", "shank"),
    "foot": ("talus", "foot", "calcn"),
}
"""What OpenSim's models call the bones."""
LARGEST_RESIDUAL: Final = 0.030
"""m, RMS over the markers of a segment, from which a model is another person's or not scaled, and
the markers beside points are exchanged or were moved."""
LEAST_WIDTH: Final = 0.010
"""m, RMS distance of markers from the line along them, below which they do not show a turn."""


@dataclass(frozen=True)
class GivenCentre:
    """A joint centre beside markers of the segment above it, in axes of their own.

    Attributes
    ----------
    name : such as "R.Knee.Centre".
    source : whose it is, for people.
    markers : (T, 3) m, by the names of the marker set.
    centre : (T, 3) m.
    one_frame : whether all centres of the source are in the same axes, as points of a file are, and
        not each in those of a body.
    """

    name: str
    source: str
    markers: Mapping[str, Array]
    centre: Array
    one_frame: bool


@dataclass(frozen=True)
class LaidCentre:
    """The same in standing.

    Attributes
    ----------
    place : (3,) m.
    residual : m, RMS distance of the laid markers from those in standing.
    """

    name: str
    source: str
    place: Array
    residual: float

    @property
    def title(self) -> str:
        """Such as "right knee"."""
        return _title(self.name)


def of_recording(recording: Recording, segments: Mapping[str, str]) -> list[GivenCentre]:
    """The centres that a `recording` has as points, in its axes, beside its markers, which are on
    `segments` by their names.
    """
    return [
        GivenCentre(
            name=name,
            source=point.source,
            markers={
                marker: recording.marker(marker)
                for marker, segment in segments.items()
                if segment == _segment(name) and marker in recording.names
            },
            centre=point.places,
            one_frame=True,
        )
        for name, point in recording.centres.items()
    ]


def of_model(
    model: OsimModel, source: str, renamed: Callable[[Sequence[str]], Mapping[str, str]]
) -> list[GivenCentre]:
    """The centres of a scaled OpenSim `model`, each in the axes of the body above it, with all
    coordinates at zero; a knee that glides has its centre where it is at 0°. `renamed` says what
    the marker set calls the model's markers.

    Raises ScalingError if the model has no pelvis, or no bone of a leg.
    """
    neutral = {name: np.zeros(1) for name in model.coordinates}
    for coupler in model.couplers:
        neutral[coupler.dependent] = coupler.function(neutral[coupler.independent])
    poses = place(model, neutral)
    names = renamed([marker.name for marker in model.markers])
    found = []
    for side in "RL":
        for joint, (segment, _) in ABOVE.items():
            above, below = (_body(model, source, each, side) for each in (segment, BELOW[joint]))
            ends = (joint.parent if reverse else joint.child for joint, reverse in model.tree)
            end = next((each for each in ends if each.body == below), None)
            if end is None:
                raise ScalingError(
                    f"{source}: no joint leads to {below}, so where it turns is unknown. "
                    "Give a model whose joints go from the pelvis to the feet."
                )
            turn, origin = (each[0] for each in poses[below])
            rotation, start = (each[0] for each in poses[above])
            centre = rotation.T @ (turn @ end.origin + origin - start)
            markers = {
                names[marker.name]: marker.location[None]
                for marker in model.markers
                if marker.body == above and marker.name in names
            }
            name = f"{side}.{joint}.Centre"
            found.append(GivenCentre(name, source, markers, centre[None], one_frame=False))
    return found


def laid(
    given: Sequence[GivenCentre], standing: Mapping[str, Array]
) -> tuple[list[LaidCentre], list[str]]:
    """The `given` centres among the markers of the `standing` trial, (3,) m, and why others cannot
    be laid there.
    """
    found: dict[str, LaidCentre] = {}
    refused = []
    by_name = {each.name: each for each in given}
    for each in sorted(given, key=lambda one: _order(one.name)):
        markers = {
            name: (at, standing[name]) for name, at in each.markers.items() if name in standing
        }
        upper = _upper(each.name)
        if len(markers) < FEWEST and each.one_frame and upper in found:
            markers[upper] = (by_name[upper].centre, found[upper].place)
        if len(markers) < FEWEST or _on_a_line(markers):
            shown = ", ".join(each.markers) or "none"
            refused.append(
                f"{_title(each.name)} of {each.source}: the segment above it needs {FEWEST} "
                f"markers, not on a line, that the standing trial has, too; there are {shown}"
            )
            continue
        place_and_residual = _laid(markers, each.centre)
        if place_and_residual is None:
            refused.append(
                f"{_title(each.name)} of {each.source}: no frame shows it and {', '.join(markers)}"
            )
            continue
        found[each.name] = LaidCentre(each.name, each.source, *place_and_residual)
    return list(found.values()), refused


def with_centres(
    walking: Recording,
    segments: Mapping[str, str],
    standing: Mapping[str, Array],
    centres: Mapping[str, Array],
) -> Recording:
    """A `walking` trial with the `centres` (3,) m of the `standing` trial as markers, each of which
    goes with the markers of the segment above it; `segments` says which these are.
    """
    for name in sorted(centres, key=_order):
        shape = {
            marker: standing[marker]
            for marker, segment in segments.items()
            if segment == _segment(name) and marker in standing and marker in walking.names
        }
        if len(shape) < FEWEST and _upper(name) in centres:
            shape[_upper(name)] = centres[_upper(name)]
        at = carried(walking, shape, {name: centres[name]})[name]
        walking = walking.with_markers(
            (*walking.names, name), np.concatenate([walking.markers, at[:, None]], axis=1)
        )
    return walking


def segment_below(name: str) -> str:
    """The segment whose frame begins at a centre, such as "shank_r" at "R.Knee.Centre"."""
    side, joint, _ = name.split(".")
    return f"{BELOW[joint]}_{side.lower()}"


def _order(name: str) -> int:
    """Hips first, then knees."""
    return [*ABOVE].index(name.split(".")[1])


def _upper(name: str) -> str:
    """The centre at the upper end of the segment above another."""
    side, joint, _ = name.split(".")
    return f"{side}.{ABOVE[joint][1]}.Centre"


def _laid(markers: Mapping[str, tuple[Array, Array]], centre: Array) -> tuple[Array, float] | None:
    """Median place (3,) of the `centre` (T, 3) in standing, and RMS residual, m; None without a
    frame that shows it and all of the `markers`, (T, 3) and (3,) in standing.
    """
    moving = np.stack([at for at, _ in markers.values()], axis=1)
    standing = np.array([at for _, at in markers.values()])
    frames = np.isfinite(moving).all(axis=(1, 2)) & np.isfinite(centre).all(axis=1)
    if not frames.any():
        return None
    rotation, shift = superimposed(standing, moving[frames])
    back = np.einsum("tji,tj->ti", rotation, centre[frames] - shift)
    left = moving[frames] - np.einsum("tij,mj->tmi", rotation, standing) - shift[:, None]
    residual = float(np.sqrt((left**2).sum(axis=2).mean()))
    return np.median(back, axis=0), residual


def _on_a_line(markers: Mapping[str, tuple[Array, Array]]) -> bool:
    """Whether `markers`, (T, 3) and (3,) in standing, are on a line, or nearly, in either."""
    moving = np.stack([at for at, _ in markers.values()], axis=1)
    whole = moving[np.isfinite(moving).all(axis=(1, 2))][:1]
    for places in (np.array([at for _, at in markers.values()]), *whole):
        widths = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
        if widths[1] / np.sqrt(len(places)) < LEAST_WIDTH:
            return True
    return False


def _segment(name: str) -> str:
    """The segment above a centre, as marker sets call it."""
    side, joint, _ = name.split(".")
    segment = ABOVE[joint][0]
    return segment if segment == "pelvis" else f"{segment}_{side.lower()}"


def _title(name: str) -> str:
    side, joint, _ = name.split(".")
    return f"{'right' if side == 'R' else 'left'} {joint.lower()}"


def _body(model: OsimModel, source: str, segment: str, side: str) -> str:
    """The body of a bone in the `model`. Raises ScalingError without one."""
    ends = side.lower()
    names = [
        name
        for bone in BODIES[segment]
        for name in ((bone,) if segment == "pelvis" else (f"{bone}_{ends}", f"{ends}_{bone}"))
    ]
    known = {body.lower(): body for body in model.bodies}
    body = next((known[name] for name in names if name in known), None)
    if body is None:
        raise ScalingError(
            f"{source}: no body {' or '.join(names)}, so this is no model with a pelvis, thighs, "
            f"shanks and feet; it has {', '.join([*model.bodies][:8])}. Give the scaled model of "
            "this person."
        )
    return body
