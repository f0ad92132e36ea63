"""Lines, areas and markers of a painted sketch: their paths, of few points, and their looks.

Paths have absolute lines (L), curves (C) and ends (z) alone, which `paper_figures` counts on.
"""

from collections.abc import Iterable, Iterator
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array, Flags, runs
from gaitval.reporting.style import LINE

_DASHES: Final = {"--": (3.7, 1.6), ":": (1.0, 1.65)}
_NEAR: Final = 0.06
"""Points (21 µm on paper) that a line with fewer points may be off."""


def line_elements(points: Array, look: dict[str, Any]) -> Iterator[str]:
    """A line through `points`, and its markers."""
    known: Flags = np.all(np.isfinite(points), axis=1)
    parts = [points[begin:end] for begin, end in zip(*runs(known), strict=True)]
    if not parts:
        return
    if look.get("linestyle") != "none":
        drawn = path_of(thinned(part) for part in parts)
        yield f'<path d="{drawn}" style="{stroke_style(look)}"/>'
    if marker := look.get("marker"):
        yield marker_element(points[known], marker, look)


def area_elements(first: Array, second: Array, look: dict[str, Any]) -> Iterator[str]:
    """The area between two lines of as many points, or within the `first` if the other has none,
    wherever it is known: what is not a number belongs into no path.
    """
    known: Flags = np.all(np.isfinite(first), axis=1)
    if len(second):
        known &= np.all(np.isfinite(second), axis=1)
    spans = [slice(*each) for each in zip(*runs(known), strict=True)]
    drawn = "".join(
        path_of([np.concatenate([thinned(first[span]), thinned(second[span])[::-1]])]) + "z"
        for span in spans
    )
    if drawn:
        yield f'<path d="{drawn}" style="{fill_style(look)}"/>'


_SHAPES: Final = {
    "x": ((-1, -1, 1, 1), (-1, 1, 1, -1)),
    "|": ((0, -1, 0, 1),),
    "^": ((0, -1, -1, 1, 1, 1),),
    ">": ((1, 0, -1, -1, -1, 1),),
    "<": ((-1, 0, 1, -1, 1, 1),),
}
"""Corners of a marker, of half of its size, downwards; one of three corners is closed."""


def marker_element(points: Array, marker: str, look: dict[str, Any]) -> str:
    """All markers of a line as one path."""
    half = 0.5 * float(look.get("markersize", 6.0))
    path = []
    for x, y in points.tolist():
        if marker == "o":
            path.append(_circle(x, y, half))
            continue
        for corners in _SHAPES[marker]:
            pairs = zip(corners[::2], corners[1::2], strict=True)
            path.append(
                "M"
                + "L".join(f"{x + half * i:.2f} {y + half * j:.2f}" for i, j in pairs)
                + "z" * (len(corners) > 4)
            )
    colour = look["color"]
    filled = "none" if marker in "x|" else look.get("markerfacecolor", colour)
    edge = float(look.get("markeredgewidth", 1.0))
    return (
        f'<path d="{"".join(path)}" style="fill: {filled}; stroke: {colour}; '
        f'stroke-width: {edge:g}; stroke-linejoin: {"round" if marker == "o" else "miter"}"/>'
    )


def stroke_style(look: dict[str, Any] | Any) -> str:
    """The style of a line."""
    wide, dashes = float(look.get("linewidth", LINE)), look.get("linestyle", "-")
    style = f"fill: none; stroke: {look['color']}; stroke-width: {wide:g}"
    if dashes != "-":
        pattern = dashes[1] if isinstance(dashes, tuple) else _DASHES[dashes]
        style += "; stroke-dasharray: " + " ".join(f"{each * wide:g}" for each in pattern)
    elif look.get("solid_capstyle") != "butt":
        style += "; stroke-linecap: square"
    if "alpha" in look:
        style += f"; stroke-opacity: {look['alpha']:g}"
    return style + "; stroke-linejoin: round"


def fill_style(look: dict[str, Any] | Any) -> str:
    """The style of an area."""
    style = f"fill: {look.get('facecolor', look.get('color'))}"
    if "alpha" in look:
        style += f"; fill-opacity: {look['alpha']:g}"
    if edge := look.get("edgecolor"):
        style += f"; stroke: {edge}; stroke-width: {look['linewidth']:g}"
    return style


def path_of(parts: Iterable[Array]) -> str:
    """Lines through points (n, 2), each part on its own."""
    return "".join(
        "M" + "L".join(f"{x:g} {y:g}" for x, y in np.round(part, 2).tolist()) for part in parts
    )


def box_path(left: float, top: float, wide: float, high: float) -> str:
    """A rectangle."""
    right, bottom = left + wide, top + high
    corners = ((left, top), (right, top), (right, bottom), (left, bottom))
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in corners) + "z"


def _circle(x: float, y: float, radius: float) -> str:
    """A circle of four Bézier curves, which lie on it within a four-thousandth of its radius."""
    bent = radius * 4.0 / 3.0 * (2.0**0.5 - 1.0)
    quarter = ((radius, bent), (bent, radius), (0.0, radius))
    path = [f"M{x + radius:.2f} {y:.2f}"]
    for right, up in ((1, 0), (0, 1), (-1, 0), (0, -1)):
        turned = ((i * right - j * up, i * up + j * right) for i, j in quarter)
        path.append("C" + " ".join(f"{x + i:.2f} {y + j:.2f}" for i, j in turned))
    return "".join(path) + "z"


def thinned(points: Array) -> Array:
    """Points (n, 2) without those that lie on the line between the ones beside them."""
    for _ in range(3):
        if len(points) < 5:
            break
        before, here, after = points[:-2:2], points[1:-1:2], points[2::2]
        count = min(map(len, (before, here, after)))
        chord, to = (after - before[: len(after)])[:count], (here - before[: len(here)])[:count]
        length = np.maximum(np.hypot(*chord.T), 1e-9)
        far = np.abs(chord[:, 0] * to[:, 1] - chord[:, 1] * to[:, 0]) / length
        along = np.sum(chord * to, axis=1)
        kept = np.ones(len(points), dtype=bool)
        kept[1 : 2 * count : 2] = (far > _NEAR / 2) | (along < 0.0) | (along > length**2)
        points = points[kept]
    return points
