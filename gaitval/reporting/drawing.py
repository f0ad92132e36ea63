"""How figures are drawn: their style, their size, and SVG."""

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, Final, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from numpy.typing import NDArray

from gaitval.coordinates import Side
from gaitval.reporting.light_axes import LightFigure, painted
from gaitval.reporting.words import SOURCE

SETTINGS: Final[Any] = {
    "svg.hashsalt": "gaitval",
    "svg.fonttype": "path",
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.labelsize": 8.5,
    "axes.titley": 1.0,  # else every drawing asks all ticks for their place: a fifth of its time
    "axes.linewidth": 0.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
}

WIDTH: Final = 7.1
"""Inches; the text width of an A4 page."""

Draw = Callable[[], str]
"""Draws a figure, as SVG. Worker processes may do it, so it must be possible to pickle it."""


def know_fonts() -> None:
    """Make sure of the figures' font. matplotlib ships it, but reads the list of fonts from its
    cache, and that lacks those that could not be read when it was made: on a full disk, say.
    """
    if not any(each.name == SETTINGS["font.family"] for each in fontManager.ttflist):
        for path in sorted(Path(matplotlib.get_data_path(), "fonts", "ttf").glob("*.ttf")):
            fontManager.addfont(path)


know_fonts()

_language: ContextVar[str] = ContextVar("language", default=SOURCE)


@contextmanager
def new_figure(
    height: float,
    *,
    width: float = WIDTH,
    axes_line: float = SETTINGS["axes.linewidth"],
    placed: bool = False,
) -> Iterator[Figure]:
    """A figure in the common style, `height` by `width` inches, with axes' lines of `axes_line`
    points; it must be drawn within the block. Axes that are not `placed` by who draws it are placed
    by matplotlib, which draws all of it once more for that.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # whatever a file of the user's, or of a folder's, says
        matplotlib.rcParams.update(SETTINGS | {"axes.linewidth": axes_line})
        # points, as in what is saved: it is placed by the sizes that its texts have there
        figure = LightFigure(
            figsize=(width, height), dpi=72, layout=None if placed else "constrained"
        )
        FigureCanvasSVG(figure)
        yield figure


def placed_axes(
    figure: Figure, rows: int, columns: int, *, top: float, across: float
) -> NDArray[np.object_]:
    """Axes (rows, columns) of curves over the same percents in a figure that is `placed`: below a
    legend of `top` inches, `across` inches apart.
    """
    width, height = figure.get_size_inches()
    left, right, bottom, down = 0.55, 0.1, 0.4, 0.28
    wide = (width - left - right - across * (columns - 1)) / columns
    high = (height - bottom - top - down * (rows - 1)) / rows
    figure.subplots_adjust(
        left / width, bottom / height, 1.0 - right / width, 1.0 - top / height,
        across / wide, down / high,
    )  # fmt: skip
    return figure.subplots(rows, columns, sharex=True, squeeze=False)


def link(
    axes: Axes, kind: Literal["cycle", "stance"], side: Side | Literal["both"], number: int
) -> None:
    """Let the replay on the page (`replay.js`) show its moment in the panel `axes` of a `side`.

    The horizontal axis is 0 to 100 % of the gait cycle or of the stance of the foot of this side
    (`kind`); `number` is that of the panel among those of its figure, kind and side.
    """
    axes.set_gid(f"{kind}.{side}.{number}")


def drawn(draw: Draw, language: str = SOURCE) -> str:
    """The figure of `draw` as SVG, its words in `language` (`svg`)."""
    spoken = _language.set(language)
    try:
        return draw()
    finally:
        _language.reset(spoken)


def _fit_legends(figure: Figure) -> None:
    """Draw a legend that is wider than its `figure`, as in a language of long words, smaller."""
    for legend in tuple(figure.legends):
        part = figure.bbox.width / legend.get_window_extent().width
        if part < 1.0:
            own: dict[str, Any] = vars(legend)
            legend.remove()
            figure.legend(
                [each for each in legend.legend_handles if each is not None],
                [each.get_text() for each in legend.get_texts()],
                loc="outside upper center" if figure.get_layout_engine() else "upper center",
                ncols=own["_ncols"],
                fontsize=0.98 * part * float(legend.get_texts()[0].get_fontsize()),
                borderaxespad=own["borderaxespad"],
            )


def svg(figure: Figure, name: str) -> str:
    """`figure` as an <svg> element whose identifiers begin with `name`, its texts in the language
    that `drawn` was asked for.
    """
    if _language.get() != SOURCE:
        from gaitval.reporting.translated_figures import translate

        translate(figure, _language.get())
    _fit_legends(figure)
    buffer = io.StringIO()
    with painted(figure):
        if (engine := figure.get_layout_engine()) is not None:
            engine.execute(figure)  # all of it would be drawn once more for this
            figure.set_layout_engine("none")
        # matplotlib writes date and version unless they are None: equal data give equal bytes
        metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(buffer, format="svg", metadata=metadata, transparent=True)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    # several figures share one page, where an identifier may occur only once
    for before in (' id="', 'href="#', "url(#"):
        text = text.replace(before, f"{before}{name}-")
    return text
