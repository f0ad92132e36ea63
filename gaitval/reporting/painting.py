"""SVG of a `Sketch`: equal figures give equal bytes, with as few elements as show the same.

Texts are letters, not outlines: on paper of the page's font, on a screen of one with its widths.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.reporting.font_widths import width
from gaitval.reporting.sketch import PARTS, X_DATA, Call, LegendKey, Sketch, SketchAxes
from gaitval.reporting.strokes import (
    area_elements,
    box_path,
    fill_style,
    line_elements,
    marker_element,
    path_of,
    stroke_style,
)
from gaitval.reporting.style import FONT, POINTS, SKETCHED, TICK, TITLE
from gaitval.reporting.ticks import Tick, round_ticks

INK: Final = "#000000"
_ASCENT, _DESCENT, _DIGIT = 0.69, 0.22, 0.676
"""Of a text, parts of its size: above and below its baseline, and the height of a number."""
_PAD, _LABEL, _TITLE = 3.5, 4.0, 6.0
"""Points: between mark and number, numbers and label, panel and title."""
_APART: Final = 8.0
"""Points between two panels, beyond what their texts need."""
_LEFT, _RIGHT, _BOTTOM, _DOWN = 0.55, 0.1, 0.4, 0.28
"""Inches beside, below and between rows of panels that are `placed`."""
_ROW: Final = 1.4
"""Height of a row of a legend, of the size of its texts."""
_MARGIN: Final = 0.05
_ORDER: Final = {
    "plot": 2.0, "axhline": 2.0, "axvline": 2.0, "text": 3.0, "annotate": 3.0,
}  # fmt: skip


@dataclass
class _Frame:
    """A panel in its place: its box, points from the upper left corner, what its axes show, and
    its ticks.
    """

    axes: SketchAxes
    x: tuple[float, float]
    y: tuple[float, float]
    left: float = 0.0
    top: float = 0.0
    wide: float = 1.0
    high: float = 1.0
    numbered: tuple[bool, bool] = (True, True)

    @property
    def bottom(self) -> float:
        return self.top + self.high

    def to_x(self, values: Any) -> Any:
        return self.left + (values - self.x[0]) * (self.wide / (self.x[1] - self.x[0]))

    def to_y(self, values: Any) -> Any:
        return self.bottom - (values - self.y[0]) * (self.high / (self.y[1] - self.y[0]))

    def placed(self, x: Any, y: Any, transform: str | None = None) -> tuple[Any, Any]:
        if transform == PARTS:
            return self.left + x * self.wide, self.bottom - y * self.high
        return self.to_x(x), self.bottom - y * self.high if transform == X_DATA else self.to_y(y)

    @property
    def shown(self) -> bool:
        return self.axes.last("axis") is None

    def xticks(self) -> list[Tick]:
        return self._ticks("set_xticks", self.x, self.wide / (3.0 * FONT))

    def yticks(self) -> list[Tick]:
        return self._ticks("set_yticks", self.y, self.high / (2.0 * FONT))

    def _ticks(self, name: str, ends: tuple[float, float], space: float) -> list[Tick]:
        if not self.shown:
            return []
        if (chosen := self.axes.last(name)) is not None:
            return [Tick(*each) for each in zip(*chosen.given, strict=True)]
        return round_ticks(*ends, space)


def svg(sketch: Sketch, name: str) -> str:
    """A `sketch` as an <svg> element whose identifiers begin with `name`."""
    return painted(sketch, name)


def painted(sketch: Sketch, name: str) -> str:
    """A `sketch` as an <svg> element."""
    wide, high = POINTS * sketch.width, POINTS * sketch.height
    frames = _frames(sketch)
    legend, below = _legend(sketch, wide)
    (_placed if sketch.placed else _fitted)(sketch, frames, below)
    parts = [
        part
        for line, row in enumerate(frames)
        for number, frame in enumerate(row)
        for part in _panel(frame, f"{name}-clip-{line}-{number}", name, sketch)
    ]
    if sketch.below:
        parts.append(
            _text(0.5 * wide, high - 4.0, sketch.below, 7.5, anchor="middle", fill="#606060")
        )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:g}pt" height="{high:g}pt" '
        f'viewBox="0 0 {wide:g} {high:g}" {SKETCHED}>{"".join([*parts, *legend])}</svg>'
    )


# ---- limits ------------------------------------------------------------------------------------


def _frames(sketch: Sketch) -> list[list[_Frame]]:
    """All panels with the limits of their axes, not yet in their places."""
    found = [[_Frame(axes, *_limits(axes)) for axes in row] for row in sketch.panels]
    share_x, share_y = sketch.shared
    every = [frame for row in found for frame in row]
    if share_x:
        ends = _union([frame.x for frame in every if frame.axes.calls])
        for frame in every:
            frame.x = ends
    for row in found:
        if share_y:
            ends = _union([frame.y for frame in row])
            for frame in row:
                frame.y = ends
    for number, row in enumerate(found):
        for column, frame in enumerate(row):
            frame.numbered = (
                not share_x or number == len(found) - 1, not share_y or column == 0
            )  # fmt: skip
    return found


def _union(ends: Sequence[tuple[float, float]]) -> tuple[float, float]:
    return min(low for low, _ in ends), max(high for _, high in ends)


def _limits(axes: SketchAxes) -> tuple[tuple[float, float], tuple[float, float]]:
    """What the axes show: as asked for, otherwise all that is drawn and a margin."""
    x: list[Array] = []
    y: list[Array] = []
    for call in axes.calls:
        for of, values in zip((x, y), _reach(call), strict=True):
            of.extend(values)
    free = {"x": _MARGIN, "y": _MARGIN}
    if (margins := axes.last("margins")) is not None:
        free |= margins.look
    return (
        _ends(x, free["x"], axes.last("set_xlim")),
        _ends(y, free["y"], axes.last("set_ylim")),
    )


def _reach(call: Call) -> tuple[list[Array], list[Array]]:
    """What a call draws: values of x and of y."""
    given = [np.atleast_1d(each) for each in call.given if not isinstance(each, str | list)]
    transform = call.look.get("transform")
    if call.name in ("plot", "fill"):
        return [given[0]], [given[1]] if transform is None else []
    if call.name == "fill_between":
        return [given[0]], given[1:]
    if call.name == "fill_betweenx":
        return given[1:], [given[0]]
    if call.name == "bar":
        x, height, wide, bottom = given
        return [x - 0.5 * wide, x + 0.5 * wide], [bottom, bottom + height]
    if call.name == "axhline":
        return [], given
    return (given, []) if call.name == "axvline" else ([], [])


def _ends(values: Sequence[Array], margin: float, asked: Call | None) -> tuple[float, float]:
    every = np.concatenate([np.asarray(each, dtype=float) for each in values] or [np.zeros(0)])
    every = every[np.isfinite(every)]
    low, high = (float(every.min()), float(every.max())) if len(every) else (0.0, 1.0)
    if high - low < 1e-12 * max(1.0, abs(low)):
        low, high = low - 0.05 * (abs(low) or 1.0), high + 0.05 * (abs(high) or 1.0)
    free = margin * (high - low) if len(every) else 0.0
    low, high = low - free, high + free
    if asked is not None:
        first, last = asked.given
        low, high = low if first is None else float(first), high if last is None else float(last)
    return low, high


# ---- places ------------------------------------------------------------------------------------


def _placed(sketch: Sketch, frames: list[list[_Frame]], below: float) -> None:
    """Panels of one size, whatever their texts need."""
    assert sketch.placed is not None
    top, across = sketch.placed
    rows, columns = len(frames), len(frames[0])
    wide = (sketch.width - _LEFT - _RIGHT - across * (columns - 1)) / columns
    high = (sketch.height - _BOTTOM - top - _DOWN * (rows - 1)) / rows
    for number, row in enumerate(frames):
        for column, frame in enumerate(row):
            frame.left = POINTS * (_LEFT + column * (wide + across))
            frame.top = POINTS * (top + number * (high + _DOWN))
            frame.wide, frame.high = POINTS * wide, POINTS * high


def _fitted(sketch: Sketch, frames: list[list[_Frame]], below: float) -> None:
    """Panels as large as the texts between them allow, in columns and rows, `below` the legend."""
    rows, columns = len(frames), len(frames[0])
    total = POINTS * sketch.width, POINTS * sketch.height
    foot = 14.0 if sketch.below else 3.0
    sizes = _Sizes([100.0] * columns, [70.0] * rows)
    for _ in range(2):  # numbers of an axis depend on its length, and it on their width
        for number, row in enumerate(frames):
            for column, frame in enumerate(row):
                frame.wide, frame.high = sizes.wide[column], sizes.high[number]
        needs = [[_need(frame) for frame in row] for row in frames]
        left = [max(row[i][0] for row in needs) for i in range(columns)]
        right = [max(row[i][1] for row in needs) for i in range(columns)]
        top, bottom = ([max(need[i] for need in row) for row in needs] for i in (2, 3))
        free = total[0] - sum(left) - sum(right) - _APART * (columns - 1) - 6.0
        share = sum(sketch.ratios)
        sizes.wide = [free * each / share for each in sketch.ratios]
        tall = total[1] - sum(top) - sum(bottom) - _APART * (rows - 1) - below - foot
        sizes.high = [tall / rows] * rows
    at_y = below
    for number, row in enumerate(frames):
        at_x, at_y = 3.0, at_y + top[number]
        for column, frame in enumerate(row):
            at_x += left[column]
            frame.left, frame.top = at_x, at_y
            frame.wide, frame.high = sizes.wide[column], sizes.high[number]
            at_x += frame.wide + right[column] + _APART
            if frame.axes.last("set_aspect") is not None:
                _equal(frame)
        at_y += sizes.high[number] + bottom[number] + _APART


@dataclass
class _Sizes:
    """Of panels: widths of columns and heights of rows."""

    wide: list[float]
    high: list[float]


def _equal(frame: _Frame) -> None:
    """Make a panel smaller, about its middle, until a unit is as long on both axes."""
    across, up = frame.x[1] - frame.x[0], frame.y[1] - frame.y[0]
    unit = min(frame.wide / across, frame.high / up)
    wide, high = unit * across, unit * up
    frame.left += 0.5 * (frame.wide - wide)
    frame.top += 0.5 * (frame.high - high)
    frame.wide, frame.high = wide, high


def _need(frame: _Frame) -> tuple[float, float, float, float]:
    """What the texts of a panel need to its left, right, above and below it, points."""
    title = frame.axes.last("set_title")
    top = 0.0 if title is None or not title.given[0] else TITLE + title.look.get("pad", _TITLE)
    if not frame.shown:
        return 0.0, 0.0, top, 0.0
    xticks, yticks = _xlabels(frame), _ylabels(frame)
    left = TICK + _PAD + max((width(each.label, FONT) for each in yticks), default=0.0)
    left += (_LABEL + FONT) * (frame.axes.last("set_ylabel") is not None)
    size = _tick_size(frame)
    lines = max((each.label.count("\n") + 1 for each in xticks), default=0)
    bottom = _mark(frame) + _PAD + 1.2 * size * lines
    bottom += (_LABEL + FONT) * (frame.axes.last("set_xlabel") is not None)
    right = 0.0
    if xticks and (last := xticks[-1]):
        beyond = 0.5 * max(width(line, size) for line in last.label.split("\n"))
        right = max(0.0, beyond - frame.wide * (frame.x[1] - last.at) / (frame.x[1] - frame.x[0]))
    return left, right, max(top, 0.4 * FONT), bottom


def _tick_size(frame: _Frame) -> float:
    """Points, of the numbers of the horizontal axis."""
    chosen = frame.axes.last("set_xticks")
    return float(FONT if chosen is None else chosen.look.get("fontsize", FONT))


def _mark(frame: _Frame) -> float:
    """Points, the length of the marks of the horizontal axis."""
    chosen = frame.axes.last("tick_params")
    return float(TICK if chosen is None else chosen.look.get("length", TICK))


def _xlabels(frame: _Frame) -> list[Tick]:
    return [Tick(at, label) for at, label in frame.xticks()] if frame.numbered[0] else []


def _ylabels(frame: _Frame) -> list[Tick]:
    return [Tick(at, label) for at, label in frame.yticks()] if frame.numbered[1] else []


# ---- what is painted ---------------------------------------------------------------------------


def _panel(frame: _Frame, clip: str, name: str, sketch: Sketch) -> Iterator[str]:
    """A panel: what is drawn in it in its order, its axes, and its texts."""
    parts: list[tuple[float, str]] = []
    for call in frame.axes.calls:
        order = float(call.look.get("zorder", _ORDER.get(call.name, 1.0)))
        found = "".join(_painted(frame, call))
        if found:
            inside = call.name in ("text", "annotate", "axhline", "axvline") or _within(frame, call)
            parts.append((order, found if inside else f'<g clip-path="url(#{clip})">{found}</g>'))
    if frame.shown:
        parts.append((2.5, _axes(frame, sketch.axes_line)))
    parts.sort(key=lambda part: part[0])
    box = box_path(frame.left, frame.top, frame.wide, frame.high)
    if any(f"#{clip})" in part for _, part in parts):
        yield f'<clipPath id="{clip}"><path d="{box}"/></clipPath>'
    if frame.axes.gid:  # the replay finds the panel by its frame
        yield f'<g id="{name}-{frame.axes.gid}"><path class="frame" d="{box}" style="fill: none"/>'
    yield from (part for _, part in parts)
    yield from _words(frame)
    if frame.axes.gid:
        yield "</g>"


def _within(frame: _Frame, call: Call) -> bool:
    """Whether all that a call draws lies within its panel."""
    if call.look.get("transform"):
        return True
    for values, (low, high) in zip(_reach(call), (frame.x, frame.y), strict=True):
        near = 1e-9 * (high - low)
        for each in values:
            known = each[np.isfinite(each)]
            if len(known) and (known.min() < low - near or known.max() > high + near):
                return False
    return True


def _axes(frame: _Frame, line: float) -> str:
    """Both axes with their marks, as one path."""
    left, right, bottom, mark = frame.left, frame.left + frame.wide, frame.bottom, _mark(frame)
    path = [f"M{left:.2f} {frame.top:.2f}L{left:.2f} {bottom:.2f}L{right:.2f} {bottom:.2f}"]
    if mark:
        ends = [(frame.to_x(at), bottom + mark) for at, _ in frame.xticks()]
        path += [f"M{x:.2f} {bottom:.2f}L{x:.2f} {end:.2f}" for x, end in ends]
    heights = [frame.to_y(at) for at, _ in frame.yticks()]
    path += [f"M{left:.2f} {y:.2f}L{left - TICK:.2f} {y:.2f}" for y in heights]
    look = f"fill: none; stroke: {INK}; stroke-width: {line:g}"
    return f'<path d="{"".join(path)}" style="{look}"/>'


def _words(frame: _Frame) -> Iterator[str]:
    """Title, numbers and labels of a panel."""
    middle = frame.left + 0.5 * frame.wide
    if (title := frame.axes.last("set_title")) is not None and title.given[0]:
        at_left = title.look.get("loc") == "left"
        yield _text(
            frame.left if at_left else middle,
            frame.top - title.look.get("pad", _TITLE),
            title.given[0],
            TITLE,
            anchor="start" if at_left else "middle",
        )
    if not frame.shown:
        return
    xlabels, ylabels = _xlabels(frame), _ylabels(frame)
    size, base = _tick_size(frame), frame.bottom + _mark(frame) + _PAD
    lines = 0
    for at, label in xlabels:
        split = label.split("\n")
        lines = max(lines, len(split))
        for number, each in enumerate(split):
            y = base + (_ASCENT + 1.2 * number) * size
            yield _text(frame.to_x(at), y, each, size, anchor="middle")
    for at, label in ylabels:
        y = frame.to_y(at) + 0.5 * _DIGIT * FONT
        yield _text(frame.left - TICK - _PAD, y, label, FONT, anchor="end")
    if (label_x := frame.axes.last("set_xlabel")) is not None:
        below = base + size * max(0.0, 1.2 * lines - 0.3) + _LABEL + _ASCENT * FONT
        yield _text(middle, below, label_x.given[0], FONT, anchor="middle")
    if (label_y := frame.axes.last("set_ylabel")) is not None:
        wide = max((width(each.label, FONT) for each in ylabels), default=0.0)
        at = frame.left - TICK - _PAD - wide - _LABEL - _DESCENT * FONT
        up = frame.top + 0.5 * frame.high
        yield _text(at, up, label_y.given[0], FONT, anchor="middle", turned=True)


def _painted(frame: _Frame, call: Call) -> Iterator[str]:
    """The elements of one call."""
    given, look = call.given, call.look
    if call.name == "plot":
        x, y = frame.placed(given[0], given[1], look.get("transform"))
        yield from line_elements(np.column_stack([x, y]), look)
    elif call.name in ("axhline", "axvline"):
        across = call.name == "axhline"
        at = frame.to_y(given[0]) if across else frame.to_x(given[0])
        path = (
            f"M{frame.left:.2f} {at:.2f}L{frame.left + frame.wide:.2f} {at:.2f}"
            if across
            else f"M{at:.2f} {frame.top:.2f}L{at:.2f} {frame.bottom:.2f}"
        )
        yield f'<path d="{path}" style="{stroke_style(look)}"/>'
    elif call.name in ("fill_between", "fill_betweenx"):
        along, low, high = given
        pair = (
            [(along, low), (along, high)]
            if call.name == "fill_between"
            else [(low, along), (high, along)]
        )
        first, second = (np.column_stack(frame.placed(*each)) for each in pair)
        yield from area_elements(first, second, look)
    elif call.name == "fill":
        points = np.column_stack(frame.placed(given[0], given[1]))
        yield from area_elements(points, points[:0], look)
    elif call.name == "bar":
        x, height, wide, bottom = given
        corners = np.array([[-0.5, 0], [0.5, 0], [0.5, 1], [-0.5, 1]]) * [wide, height]
        points = np.column_stack(frame.placed(x + corners[:, 0], bottom + corners[:, 1]))
        yield f'<path d="{path_of([points])}z" style="{fill_style(look)}"/>'
    elif call.name == "text":
        x, y = frame.placed(given[0], given[1], look.get("transform"))
        yield _placed_text(x, y, given[2], look)
    elif call.name == "annotate":
        x, y = frame.placed(*given[1])
        right, up = look["xytext"]
        yield _placed_text(x + right, y - up, given[0], look)


# ---- texts -------------------------------------------------------------------------------------


def _placed_text(x: float, y: float, text: str, look: dict[str, Any]) -> str:
    """A text in a panel, by its `ha` and `va`."""
    size = float(look.get("fontsize", FONT))
    down = {
        "top": _ASCENT, "center": 0.5 * (_ASCENT - _DESCENT), "bottom": -_DESCENT, "baseline": 0.0
    }[look.get("va", "baseline")]  # fmt: skip
    anchor = {"left": "start", "center": "middle", "right": "end"}[look.get("ha", "left")]
    return _text(x, y + down * size, text, size, anchor=anchor, fill=look.get("color", INK))


def _text(
    x: float,
    y: float,
    text: str,
    size: float,
    *,
    anchor: str,
    fill: str = INK,
    turned: bool = False,
    long: float | None = None,
) -> str:
    """A text; `long` is the width that it must keep, whatever its font."""
    place = f'transform="translate({x:.2f} {y:.2f}) rotate(-90)"' if turned else (
        f'x="{x:.2f}" y="{y:.2f}"'
    )  # fmt: skip
    ends = "" if anchor == "start" else f"; text-anchor: {anchor}"
    kept = "" if long is None else f' textLength="{long:.1f}" lengthAdjust="spacingAndGlyphs"'
    return (
        f'<text {place} font-size="{size:g}"{kept} style="fill: {fill}{ends}">{escape(text)}</text>'
    )


def _legend(sketch: Sketch, total: float) -> tuple[list[str], float]:
    """The elements of the legend above all panels, and what it needs, points."""
    keys = sketch.keys
    if not keys:
        return [], 3.0
    rows = -(-len(keys) // sketch.columns)
    columns = [keys[first : first + rows] for first in range(0, len(keys), rows)]
    font = sketch.font

    def widths(size: float) -> list[float]:
        return [size * 2.8 + max(width(each.label, size) for each in of) for of in columns]

    def whole(size: float) -> float:
        return sum(widths(size)) + 2.0 * size * (len(columns) - 1)

    font = min(font, 0.98 * font * total / whole(font))
    at, found = 0.5 * (total - whole(font)), list[str]()
    for wide, of in zip(widths(font), columns, strict=True):
        for number, key in enumerate(of):
            base = (0.4 + _ASCENT + _ROW * number) * font
            found += _sample(at, base - 0.5 * _DIGIT * font, font, key)
            found.append(
                _text(at + 2.8 * font, base, key.label, font, anchor="start",
                      long=width(key.label, font))
            )  # fmt: skip
        at += wide + 2.0 * font
    return found, (0.8 + _ROW * rows) * font


def _sample(x: float, y: float, font: float, key: LegendKey) -> Iterator[str]:
    """What an entry of a legend looks like, about its middle at the height `y`."""
    long = 2.0 * font
    if "facecolor" in key.look:
        half = 0.35 * font
        box = box_path(x, y - half, long, 2.0 * half)
        yield f'<path d="{box}" style="{fill_style(dict(key.look))}"/>'
        return
    look = dict(key.look)
    marker = look.pop("marker", None)
    yield from line_elements(np.array([[x, y], [x + long, y]]), look)
    if marker:
        yield marker_element(np.array([[x + 0.5 * long, y]]), marker, look)
