"""How figures are drawn: their style, their size, and SVG."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from gaitval.coordinates import Side
from gaitval.reporting.light_axes import LightFigure, painted
from gaitval.reporting.sketch import PARTS, X_DATA, Sketch
from gaitval.reporting.style import WIDTH

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


def know_fonts() -> None:
    """Make sure of the figures' font. matplotlib ships it, but reads the list of fonts from its
    cache, and that lacks those that could not be read when it was made: on a full disk, say.
    """
    if not any(each.name == SETTINGS["font.family"] for each in fontManager.ttflist):
        for path in sorted(Path(matplotlib.get_data_path(), "fonts", "ttf").glob("*.ttf")):
            fontManager.addfont(path)


know_fonts()


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


def link(
    axes: Axes, kind: Literal["cycle", "stance"], side: Side | Literal["both"], number: int
) -> None:
    """Let the replay on the page (`replay.js`) show its moment in the panel `axes` of a `side`.

    The horizontal axis is 0 to 100 % of the gait cycle or of the stance of the foot of this side
    (`kind`); `number` is that of the panel among those of its figure, kind and side.
    """
    axes.set_gid(f"{kind}.{side}.{number}")


def by_matplotlib(sketch: Sketch) -> Figure:
    """A `sketch` as matplotlib draws what was asked for: for files of another kind, and to
    compare.
    """
    rows, columns = len(sketch.panels), len(sketch.panels[0])
    figure = Figure(figsize=(sketch.width, sketch.height), dpi=72, layout="constrained")
    share_x, share_y = sketch.shared
    every = figure.subplots(
        rows, columns, squeeze=False, sharex=share_x, sharey="row" if share_y else False,
        width_ratios=sketch.ratios,
    )  # fmt: skip
    for ours, theirs in zip(sketch.axes, every.flat, strict=True):
        places = {PARTS: theirs.transAxes, X_DATA: theirs.get_xaxis_transform()}
        for name, given, look in ours.calls:
            at = {"transform": places[look["transform"]]} if "transform" in look else {}
            getattr(theirs, name)(*given, **look | at)
        if ours.gid:
            theirs.set_gid(ours.gid)
    handles: list[Any] = [
        (Patch if "facecolor" in key.look else partial(Line2D, [], []))(label=key.label, **key.look)
        for key in sketch.keys
    ]
    if handles:
        figure.legend(
            handles=handles, loc="outside upper center", ncols=sketch.columns, fontsize=sketch.font
        )
    if sketch.below:
        figure.supxlabel(sketch.below)
    return figure


def _fit_legends(figure: Figure) -> None:
    """Draw a legend that is wider than its `figure`, smaller."""
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
    """`figure` as an <svg> element whose identifiers begin with `name`."""
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
