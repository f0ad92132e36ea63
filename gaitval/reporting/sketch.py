"""Figures of curves: what is in them, in the words of matplotlib's `Axes`.

A figure is a list of what was asked for; `painting` makes SVG of it. matplotlib takes ten times as
long, because it makes some thirty objects of each panel, each of which is asked for its place and
size. The words are its own, so that what is drawn here can be drawn by it, too (the tests compare).
Sizes are points, colours "#rrggbb".
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitval.arrays import Array
from gaitval.reporting.style import AXES_LINE, WIDTH


class Call(NamedTuple):
    """What was asked for: a method of matplotlib's `Axes`, and what it was given."""

    name: str
    given: tuple[Any, ...]
    look: dict[str, Any]


class LegendKey(NamedTuple):
    """An entry of a legend: a line, or a filled patch where it has a `facecolor`.

    Attributes
    ----------
    look : as of `Axes.plot`, or `facecolor` and `alpha`.
    """

    label: str
    look: Mapping[str, Any]


PARTS: Final = "parts"
"""A `transform`: places are parts of the panel, from its lower left corner."""
X_DATA: Final = "x data"
"""A `transform`: x as on the axis, y a part of the panel."""


class SketchAxes:
    """A panel. Methods are those of matplotlib's `Axes`, with what figures here need of them."""

    def __init__(self) -> None:
        self.calls: list[Call] = []
        self.gid = ""

    def _ask(self, name: str, *given: Any, **look: Any) -> None:
        self.calls.append(Call(name, given, look))

    def plot(self, x: ArrayLike, y: ArrayLike, **look: Any) -> None:
        """A line through `x` and `y` (n,), and its markers; NaN interrupts it."""
        self._ask("plot", _row(x), _row(y), **look)

    def fill_between(self, x: ArrayLike, low: ArrayLike, high: ArrayLike, **look: Any) -> None:
        """The area between `low` and `high` (n,) over `x`, without NaN."""
        self._ask("fill_between", _row(x), _row(low), _row(high), **look)

    def fill_betweenx(self, y: ArrayLike, left: ArrayLike, right: ArrayLike, **look: Any) -> None:
        """The area between `left` and `right` (n,) beside `y`."""
        self._ask("fill_betweenx", _row(y), _row(left), _row(right), **look)

    def fill(self, x: ArrayLike, y: ArrayLike, **look: Any) -> None:
        """The area within a closed line."""
        self._ask("fill", _row(x), _row(y), **look)

    def bar(self, x: float, height: float, width: float, bottom: float, **look: Any) -> None:
        """A column of this `height` from `bottom` on, about `x`."""
        self._ask("bar", x, height, width, bottom, **look)

    def axhline(self, y: float, **look: Any) -> None:
        """A line over the whole width."""
        self._ask("axhline", y, **look)

    def axvline(self, x: float, **look: Any) -> None:
        """A line over the whole height."""
        self._ask("axvline", x, **look)

    def text(self, x: float, y: float, text: str, **look: Any) -> None:
        """A `text` at a place."""
        self._ask("text", x, y, text, **look)

    def annotate(self, text: str, at: tuple[float, float], **look: Any) -> None:
        """A `text`, `xytext` points from a place."""
        self._ask("annotate", text, at, textcoords="offset points", **look)

    def set_title(self, text: str, **look: Any) -> None:
        """The title, above the panel: in its middle or at the `loc` "left"; `pad` points higher."""
        self._ask("set_title", text, **look)

    def set_xlabel(self, text: str) -> None:
        """What the horizontal axis is."""
        self._ask("set_xlabel", text)

    def set_ylabel(self, text: str) -> None:
        """What the vertical axis is."""
        self._ask("set_ylabel", text)

    def set_xlim(self, left: float | None = None, right: float | None = None) -> None:
        """From where to where; what is None follows from what is drawn."""
        self._ask("set_xlim", left, right)

    def set_ylim(self, bottom: float | None = None, top: float | None = None) -> None:
        """From where to where; what is None follows from what is drawn."""
        self._ask("set_ylim", bottom, top)

    def set_xticks(self, at: ArrayLike, labels: Sequence[str], **look: Any) -> None:
        """Where ticks are, and what they are called; a text may have several lines."""
        self._ask("set_xticks", _row(at), list(labels), **look)

    def set_yticks(self, at: ArrayLike, labels: Sequence[str], **look: Any) -> None:
        """Where ticks are, and what they are called."""
        self._ask("set_yticks", _row(at), list(labels), **look)

    def tick_params(self, **look: Any) -> None:
        """The `length` of the marks of an `axis`."""
        self._ask("tick_params", **look)

    def margins(self, **part: float) -> None:
        """What is left free beyond what is drawn, as parts of its size: `x`, `y`."""
        self._ask("margins", **part)

    def set_aspect(self, aspect: str) -> None:
        """With "equal" a unit is as long on both axes; the panel becomes smaller for it."""
        self._ask("set_aspect", aspect)

    def axis(self, shown: str) -> None:
        """With "off" neither axes nor ticks."""
        self._ask("axis", shown)

    def last(self, name: str) -> Call | None:
        """What was asked for last by this `name`."""
        return next((each for each in reversed(self.calls) if each.name == name), None)


def _row(values: ArrayLike) -> Array:
    return np.atleast_1d(np.asarray(values, dtype=float))


@dataclass
class Sketch:
    """A figure.

    Attributes
    ----------
    height, width : inches.
    panels : rows of axes; `ratios` are the widths of the columns.
    shared : whether the axes of a column have one x, and those of a row one y.
    placed : inches above the panels, for the legend, and between columns, if all are placed
        alike; otherwise each has what its texts need.
    keys, columns, font : of the legend above.
    below : a text below all panels.
    axes_line : points; the width of the axes' lines.
    """

    height: float
    width: float = WIDTH
    axes_line: float = AXES_LINE
    panels: list[list[SketchAxes]] = field(default_factory=list)
    ratios: Sequence[float] = ()
    shared: tuple[bool, bool] = (False, False)
    placed: tuple[float, float] | None = None
    keys: Sequence[LegendKey] = ()
    columns: int = 1
    font: float = 8.5
    below: str = ""

    def subplots(
        self,
        rows: int = 1,
        columns: int = 1,
        *,
        sharex: bool = False,
        sharey: bool = False,
        width_ratios: Sequence[float] = (),
    ) -> list[list[SketchAxes]]:
        """Panels in `rows` and `columns`."""
        self.panels = [[SketchAxes() for _ in range(columns)] for _ in range(rows)]
        self.shared, self.ratios = (sharex, sharey), width_ratios or (1.0,) * columns
        return self.panels

    def legend(self, keys: Sequence[LegendKey], *, ncols: int, fontsize: float = 8.5) -> None:
        """A legend above all panels, in columns."""
        self.keys, self.columns, self.font = tuple(keys), ncols, fontsize

    @property
    def axes(self) -> list[SketchAxes]:
        """All panels, row by row."""
        return [each for row in self.panels for each in row]


def link(axes: SketchAxes, kind: str, side: str, number: int) -> None:
    """Let the replay on the page (`replay.js`) show its moment in the panel `axes` of a `side`, or
    of "both".

    The horizontal axis is 0 to 100 % of the gait "cycle" or of the "stance" of the foot of this
    side (`kind`); `number` is that of the panel among those of its figure, kind and side.
    """
    axes.gid = f"{kind}.{side}.{number}"


def keys_of(*panels: SketchAxes) -> list[LegendKey]:
    """Entries of a legend for everything in `panels` that has a label, each once, and any band."""
    calls = [each for axes in panels for each in axes.calls]
    found: dict[str, LegendKey] = {}
    for each in calls:
        if label := each.look.get("label"):
            look = {key: value for key, value in each.look.items() if key != "label"}
            if each.name in ("bar", "fill_between"):
                look = {"facecolor": look["color"], "alpha": look.get("alpha", 1.0)}
            found.setdefault(label, LegendKey(label, look))
    if any(each.name.startswith("fill_between") for each in calls):
        found["± SD"] = LegendKey("± SD", {"facecolor": "#9a9a9a", "alpha": 0.35})
    return list(found.values())
