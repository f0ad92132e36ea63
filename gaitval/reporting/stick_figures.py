"""The walker as lines between its joints, as poses side by side."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from gaitval.arrays import Array
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.figures import COLOURS, RECORD_SHADE

_LINES: Final = {
    "right": ("thigh_r", "shank_r", "foot_r", "heel_r", "toes_r", "toe_tip_r"),
    "left": ("thigh_l", "shank_l", "foot_l", "heel_l", "toes_l", "toe_tip_l"),
    "right arm": ("upper_arm_r", "forearm_r", "hand_r"),
    "left arm": ("upper_arm_l", "forearm_l", "hand_l"),
    "trunk": ("pelvis", "torso", "shoulders", "head"),
}
RECORDED_POINTS: Final = 5
"""Points of a leg, from the hip on, whose place follows from recorded angles."""
_HEAD_HEIGHT = 0.24
"""m, from the shoulders to the middle of the head, in the picture only."""
_HEAD_RADIUS = 0.1
_APART = 1.0
"""m, between two poses; a step and both arms fit in."""


def stick_figure(model: BodyModel, positions: Array) -> dict[str, Array]:
    """Points of a stick figure of `model` at `positions` (T, 31), by name, (T, K, 3) m, world: legs
    with heel and toe tip, arms, trunk up to the middle of the head.
    """
    frames = segment_frames(model, positions)
    points = {name: frames[:, index, :3, 3] for index, name in enumerate(SEGMENTS)}

    def fixed(segment: str, place: Array) -> Array:
        pose = frames[:, SEGMENTS.index(segment)]
        return np.asarray(pose[:, :3, :3] @ place + pose[:, :3, 3])

    for side in "rl":
        # heel and toe tip are below the rearmost and the foremost contact sphere
        for name, segment, end in (("heel", "foot", np.argmin), ("toe_tip", "toes", np.argmax)):
            spheres = [s for s in model.spheres if s.segment == f"{segment}_{side}"]
            extreme = spheres[int(end([s.position[0] for s in spheres]))]
            sole = extreme.position - np.array([0.0, extreme.position[1], extreme.radius])
            points[f"{name}_{side}"] = fixed(segment + f"_{side}", sole)
        # the fingertips are about twice as far from the elbow as the centre of mass of forearm and
        # hand
        forearm = f"forearm_{side}"
        points[f"hand_{side}"] = fixed(forearm, 2.0 * model[forearm].centre_of_mass)
    points["shoulders"] = 0.5 * (points["upper_arm_r"] + points["upper_arm_l"])
    up = frames[:, SEGMENTS.index("torso"), :3, 2]
    points["head"] = points["shoulders"] + _HEAD_HEIGHT * up
    return {name: np.stack([points[p] for p in line], axis=1) for name, line in _LINES.items()}


def pose_strip(figures: Mapping[str, Mapping[str, Array]], percent: Array) -> str:
    """Poses at `percent` (T,) of the right gait cycle side by side, from the right, as SVG text: of
    each `stick_figure` in `figures`, "record" (grey) and, if there is one, "simulation".
    """
    with new_figure(1.1, width=3.3) as figure:
        axes = figure.subplots()
        for place, at in enumerate(percent):
            for which, lines in figures.items():
                for name, points in lines.items():
                    x, z = points[place, :, 0] + _APART * place, points[place, :, 2]
                    _pose_line(axes, x, z, name, grey=which == "record")
            axes.text(_APART * place, -0.22, f"{at:.0f} %", ha="center", va="center")
        axes.axhline(0.0, color="#b0b0b0", linewidth=0.5, zorder=0)
        axes.set_aspect("equal")
        axes.axis("off")
        return svg(figure, "poses")


def _pose_line(axes: Axes, x: Array, z: Array, name: str, *, grey: bool) -> None:
    own = next((colour for side, colour in COLOURS.items() if name.startswith(side)), "#404040")
    colour, width = (RECORD_SHADE, 4.0) if grey else (own, 1.3)
    axes.plot(x, z, color=colour, linewidth=width, zorder=1 if grey else 2)
    if name == "trunk":
        angle = np.linspace(0.0, 2.0 * np.pi, 33)
        axes.fill(
            x[-1] + _HEAD_RADIUS * np.cos(angle),
            z[-1] + _HEAD_RADIUS * np.sin(angle),
            facecolor="#ffffff",
            edgecolor=colour,
            linewidth=width,
            zorder=2,
        )
