"""Axes whose ticks are drawn together, and curves of few points: the same picture by less work.

matplotlib makes five artists for each tick and asks each of them for its place in every pass of a
drawing. Ticks of one axis that look alike need one line of marks and one text, moved along.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis, Tick, XAxis, YAxis
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.ticker import Formatter, NullLocator
from matplotlib.transforms import Bbox

from gaitval.arrays import Array


class _Place(NamedTuple):
    """A tick in the place of matplotlib's: where it is on its axis, and its label."""

    at: float
    label: str


class LightFigure(Figure):
    """A figure whose Cartesian axes draw their ticks together while it is `painted`."""

    is_painted = False

    def add_subplot(self, *args: Any, **kwargs: Any) -> Any:
        """As matplotlib's, with light axes where no others are asked for."""
        if not {"projection", "polar", "axes_class"} & kwargs.keys() and not (
            args and isinstance(args[0], Axes)
        ):
            kwargs["axes_class"] = LightAxes
        return super().add_subplot(*args, **kwargs)

    def draw(self, renderer: Any) -> None:
        """Draw all of it, curves and bands by the points that are seen."""
        _thin_out(self)
        super().draw(renderer)


@contextmanager
def painted(figure: Figure) -> Iterator[None]:
    """Draw ticks together in the block; before and after it a `figure` answers as matplotlib's."""
    if isinstance(figure, LightFigure):
        figure.is_painted = True
    try:
        yield
    finally:
        if isinstance(figure, LightFigure):
            figure.is_painted = False


_NEAR: Final = 0.1
"""Points (35 µm on paper) that an outline with fewer points may be off."""
_FEW: Final = 10
"""Points that are all kept."""


def _thin_out(figure: Figure) -> None:
    """Leave out what nobody sees in curves and bands of a `figure`: points on the line between
    others, and the clipping of what does not reach beyond its axes. Each is written for page and
    paper, and read again to be laid out.
    """
    for axes in figure.axes:
        for line in axes.lines:
            path = line.get_path()
            points = np.asarray(path.vertices)
            if len(points) > _FEW and path.codes is None:
                path.simplify_threshold = _NEAR
                path.should_simplify = True
            if line.get_transform() == axes.transData:
                _unclip(line, axes, points)
        for area in axes.collections:
            if not isinstance(area, PolyCollection) or len(area.get_paths()) != 1:
                continue
            to_points = area.get_transform()
            if to_points != axes.transData or not to_points.is_affine:
                continue
            points = np.asarray(area.get_paths()[0].vertices)
            _unclip(area, axes, points)
            if len(points) > _FEW:
                whole = Path(points)  # without how it is closed: its end is its beginning
                whole.simplify_threshold = _NEAR
                thin = whole.cleaned(to_points, simplify=True)
                drawn_to = np.asarray(thin.vertices)[np.asarray(thin.codes) != Path.STOP]
                area.set_verts([to_points.inverted().transform(drawn_to)])


def _unclip(artist: Artist, axes: Axes, points: Array) -> None:
    """Do not clip an `artist` of such `points` (n, 2) if all of them are within its `axes`."""
    known = points[np.isfinite(points).all(axis=1)]
    if not len(known):
        return
    low, high = np.array(axes.viewLim.min), np.array(axes.viewLim.max)
    if (known >= low - 1e-9).all() and (known <= high + 1e-9).all():
        artist.set_clip_on(False)


class _LightAxis(Axis):
    """An axis; its ticks are drawn together unless they look different."""

    axis_name: str
    _places: tuple[object, list[_Place]] | None = None

    def _is_light(self) -> bool:
        return bool(getattr(self.get_figure(root=True), "is_painted", False)) and self._alike()

    def _alike(self) -> bool:
        if not isinstance(self.get_minor_locator(), NullLocator):
            return False
        looks = {_look(tick) for tick in self.majorTicks}
        first = self.majorTicks[0]
        others = (first.tick2line, first.label2, first.gridline)
        return len(looks) == 1 and not any(each.get_visible() for each in others)

    def _update_ticks(self) -> list[Any]:
        if not self._is_light():
            found: list[Any] = super()._update_ticks()  # type: ignore[misc]
            return found
        low, high = sorted(self.get_view_interval())
        of = (low, high, self.get_tick_space(), self.get_major_locator(), self.major.formatter)
        if self._places is None or self._places[0] != of:
            near = 1e-10 * (high - low)
            places = np.atleast_1d(self.get_majorticklocs()).tolist()
            pairs = zip(places, self._formatter().format_ticks(places), strict=True)
            shown = [_Place(*each) for each in pairs if low - near <= each[0] <= high + near]
            self._places = of, shown
        return list(self._places[1])

    def _get_ticklabel_bboxes(self, ticks: list[Any], renderer: Any) -> tuple[Any, Any]:
        if not ticks or not isinstance(ticks[0], _Place):
            boxes: tuple[Any, Any] = super()._get_ticklabel_bboxes(ticks, renderer)  # type: ignore[misc]
            return boxes
        label = self.majorTicks[0].label1
        if not label.get_visible() or not label.get_in_layout():
            return [], []
        found: list[Bbox] = []
        for each in ticks:
            self._move(each)
            found.append(label.get_window_extent(renderer))
        return found, []

    def _formatter(self) -> Formatter:
        found = self.major.formatter
        assert found is not None
        return found

    def _move(self, place: _Place) -> None:
        """Put the label of the one tick to a `place`."""
        label = self.majorTicks[0].label1
        label.set_text(place.label)
        if self.axis_name == "x":
            label.set_x(place.at)
        else:
            label.set_y(place.at)

    def draw(self, renderer: Any) -> None:
        """Draw marks and labels; as matplotlib's where ticks look different."""
        if not self._is_light():
            super().draw(renderer)
            return
        if not self.get_visible():
            return
        renderer.open_group(__name__, gid=self.get_gid())
        places = self._update_ticks()
        tick = self.majorTicks[0]
        at, zeros = [each.at for each in places], [0.0] * len(places)
        tick.tick1line.set_data(*((at, zeros) if self.axis_name == "x" else (zeros, at)))
        tick.tick1line.draw(renderer)
        if tick.label1.get_visible():
            for each in places:
                self._move(each)
                tick.label1.draw(renderer)
        boxes, none = self._get_ticklabel_bboxes(places, renderer)
        self._update_label_position(renderer)  # type: ignore[attr-defined]
        self.label.draw(renderer)
        self._update_offset_text_position(boxes, none)  # type: ignore[attr-defined]
        self.offsetText.set_text(self._formatter().get_offset())
        self.offsetText.draw(renderer)
        renderer.close_group(__name__)
        self.stale = False


def _look(tick: Tick) -> tuple[object, ...]:
    """What one tick may have other than the next."""
    label, mark = tick.label1, tick.tick1line
    return (
        label.get_visible(), label.get_fontsize(), label.get_rotation(), label.get_color(),
        label.get_horizontalalignment(), label.get_verticalalignment(), label.get_alpha(),
        label.get_fontweight(), label.get_fontstyle(),
        mark.get_visible(), mark.get_markersize(), mark.get_markeredgewidth(),
        mark.get_color(),
    )  # fmt: skip


class _LightXAxis(_LightAxis, XAxis):
    pass


class _LightYAxis(_LightAxis, YAxis):
    pass


class LightAxes(Axes):
    """Cartesian axes with light ticks."""

    def _init_axis(self) -> None:
        self.xaxis = _LightXAxis(self, clear=False)
        self.yaxis = _LightYAxis(self, clear=False)
        for side, axis in zip(
            ("bottom", "top", "left", "right"),
            (self.xaxis, self.xaxis, self.yaxis, self.yaxis),
            strict=True,
        ):
            self.spines[side].register_axis(axis)
