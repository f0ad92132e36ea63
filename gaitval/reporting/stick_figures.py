"""The walker as lines between its joints: animated, and as frames side by side."""

from collections.abc import Mapping, Sequence
from typing import Final

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from gaitval.arrays import Array
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.reporting.figures import COLOURS, RECORD_SHADE, SETTINGS, WIDTH, svg

_LINES: Final = {
    "right": ("thigh_r", "shank_r", "foot_r", "heel_r", "toes_r", "toe_tip_r"),
    "left": ("thigh_l", "shank_l", "foot_l", "heel_l", "toes_l", "toe_tip_l"),
    "right arm": ("upper_arm_r", "forearm_r", "hand_r"),
    "left arm": ("upper_arm_l", "forearm_l", "hand_l"),
    "trunk": ("pelvis", "torso", "shoulders", "head"),
}
_HEAD_HEIGHT = 0.24
"""m, from the shoulders to the middle of the head, in the picture only."""
_HEAD_RADIUS = 0.1


def stick_figure(model: BodyModel, positions: Array) -> dict[str, Array]:
    """Points of a stick figure.

    Parameters
    ----------
    positions : (T, 31).

    Returns
    -------
    By name, (T, K, 3) m, world: legs with heel and toe tip, arms, trunk up to the head's middle.
    """
    frames = segment_frames(model, positions)
    points = {name: frames[:, index, :3, 3] for index, name in enumerate(SEGMENTS)}

    def fixed(segment: str, place: Array) -> Array:
        pose = frames[:, SEGMENTS.index(segment)]
        return np.asarray(pose[:, :3, :3] @ place + pose[:, :3, 3])

    for side in "rl":
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


def _colour(line: str) -> str:
    side = line.split()[0]
    return COLOURS["right"] if side == "right" else COLOURS["left"] if side == "left" else "#404040"


_ON_A_DARK_PAGE: Final = (
    "<style>@media (prefers-color-scheme: dark) {"
    '[stroke="#404040"] { stroke: #c4c7cc } [fill="#606060"] { fill: #a9adb3 } '
    '[fill="white"] { fill: #16181c } [stroke="#d4d4d4"] { stroke: #50555d } '
    '[stroke="#00558f"] { stroke: #5da9ec } [stroke="#d96b0a"] { stroke: #f5b56b }'
    "}</style>"
)
"""The colours that report.css gives the other figures there."""


def animated_walk(figures: Mapping[str, Mapping[str, Array]], *, seconds: float) -> str:
    """Walking stick figures from the right and from behind, as an animated SVG document.

    Parameters
    ----------
    figures : `stick_figure` of "reference" (grey) and, if there is one, of "simulation".
    seconds : duration of one gait cycle.
    """
    scale, floor = 150.0, 285.0
    views = (("from the right", 0, 1.0, 160.0), ("from behind", 1, -1.0, 400.0))
    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 520 320" width="520" height="320" '
        'font-family="Georgia, serif" font-size="12" fill="none" stroke-linecap="round" '
        'stroke-linejoin="round">' + _ON_A_DARK_PAGE
    ]
    for title, axis, sign, middle in views:
        parts.append(
            f'<path d="M{middle - 115:g} {floor:g}h230" stroke="#b0b0b0"/>'
            f'<text x="{middle:g}" y="308" text-anchor="middle" fill="#606060">{title}</text>'
        )
        for which, lines in figures.items():
            grey = which == "reference"
            width = 7 if grey else 2.2
            for name, points in lines.items():
                x = middle + sign * scale * points[..., axis]
                z = floor - scale * points[..., 2]
                colour = RECORD_SHADE if grey else _colour(name)
                parts.append(_animated_line(x, z, colour, width, seconds))
                if name == "trunk":
                    parts.append(_animated_head(x[:, -1], z[:, -1], colour, width, scale, seconds))
    parts.append("</svg>")
    return "".join(parts)


def _animate(attribute: str, values: Sequence[str], seconds: float) -> str:
    return (
        f'<animate attributeName="{attribute}" dur="{seconds:.3f}s" repeatCount="indefinite" '
        f'values="{";".join(values)}"/>'
    )


def _animated_line(x: Array, z: Array, colour: str, width: float, seconds: float) -> str:
    frames = [
        " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(*frame, strict=True))
        for frame in zip(x, z, strict=True)
    ]
    return (
        f'<polyline stroke="{colour}" stroke-width="{width:g}" points="{frames[0]}">'
        f"{_animate('points', frames, seconds)}</polyline>"
    )


def _animated_head(
    x: Array, z: Array, colour: str, width: float, scale: float, seconds: float
) -> str:
    across, down = [f"{value:.1f}" for value in x], [f"{value:.1f}" for value in z]
    return (
        f'<circle r="{_HEAD_RADIUS * scale:g}" cx="{across[0]}" cy="{down[0]}" fill="white" '
        f'stroke="{colour}" stroke-width="{width:g}">'
        f"{_animate('cx', across, seconds)}{_animate('cy', down, seconds)}</circle>"
    )


def still_walk(figures: Mapping[str, Mapping[str, Array]], phases: Array) -> str:
    """Frames of the walk side by side, from the right; arguments as `animated_walk`.

    Parameters
    ----------
    phases : (T,) of the right gait cycle, of the frames of `figures`.
    """
    shown = np.linspace(0, len(phases) - 1, 9).round().astype(int)
    with matplotlib.rc_context(SETTINGS):
        figure = Figure(figsize=(WIDTH, 1.75), layout="constrained")
        axes = figure.subplots()
        for place, frame in enumerate(shown):
            for which, lines in figures.items():
                grey = which == "reference"
                for name, points in lines.items():
                    colour = RECORD_SHADE if grey else _colour(name)
                    width = 3.2 if grey else 1.0
                    x, z = points[frame, :, 0] + 0.9 * place, points[frame, :, 2]
                    axes.plot(x, z, color=colour, linewidth=width, zorder=1 if grey else 2)
                    if name == "trunk":
                        angle = np.linspace(0, 2 * np.pi, 33)
                        axes.fill(
                            x[-1] + _HEAD_RADIUS * np.cos(angle),
                            z[-1] + _HEAD_RADIUS * np.sin(angle),
                            facecolor="white",
                            edgecolor=colour,
                            linewidth=width,
                            zorder=1 if grey else 2,
                        )
            axes.text(0.9 * place, -0.17, f"{100 * phases[frame]:.0f} %", ha="center", va="center")
        axes.axhline(0.0, color="#b0b0b0", linewidth=0.5, zorder=0)
        axes.set_aspect("equal")
        axes.axis("off")
        return svg(figure, "stills")
