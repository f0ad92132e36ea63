"""How figures are drawn: by matplotlib, in one style, as SVG whose texts are letters.

Equal figures give equal bytes: no dates, and identifiers from a fixed salt.
"""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, Literal

import matplotlib
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from gaitval.coordinates import Side

WIDTH: Final = 7.1
"""Inches; the text width of an A4 page."""
FONT: Final = "STIXGeneral"
"""matplotlib ships it; the pages have it, too."""
SETTINGS: Final[Any] = {
    "svg.hashsalt": "gaitval",
    "svg.fonttype": "none",
    "font.family": FONT,
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
    "text.parse_math": False,  # a text from outside may have dollar signs
    "legend.fontsize": 8.5,
}
_LEFT, _RIGHT, _BOTTOM, _DOWN = 0.55, 0.1, 0.4, 0.28
"""Inches beside, below and between rows of panels of one size."""


@contextmanager
def new_figure(height: float, *, width: float = WIDTH, placed: bool = False) -> Iterator[Figure]:
    """A figure in the common style, `height` by `width` inches; it must be drawn within the block.
    matplotlib makes room for the texts of its panels, unless who draws it has `placed` them.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # whatever a file of the user's, or of a folder's, says
        matplotlib.rcParams.update(SETTINGS)
        # points, as in what is saved: it is placed by the sizes that its texts have there
        figure = Figure(figsize=(width, height), dpi=72, layout=None if placed else "constrained")
        FigureCanvasSVG(figure)
        yield figure


def panels_of_one_size(
    figure: Figure, rows: int, columns: int, *, above: float, between: float
) -> Any:
    """Axes (rows, columns) of a `placed` figure whose columns have one x, with so many inches
    `above` them for the legend and `between` columns.
    """
    width, height = figure.get_size_inches()
    wide = (width - _LEFT - _RIGHT - between * (columns - 1)) / columns
    high = (height - _BOTTOM - above - _DOWN * (rows - 1)) / rows
    place = {
        "left": _LEFT / width,
        "right": 1.0 - _RIGHT / width,
        "bottom": _BOTTOM / height,
        "top": 1.0 - above / height,
        "wspace": between / wide,
        "hspace": _DOWN / high,
    }
    return figure.subplots(rows, columns, squeeze=False, sharex=True, gridspec_kw=place)


def link(
    axes: Axes, kind: Literal["cycle", "stance"], side: Side | Literal["both"], number: int
) -> None:
    """Let the replay on the page (`replay.js`) show its moment in the panel `axes` of a `side`.

    The horizontal axis is 0 to 100 % of the gait cycle or of the stance of the foot of this side
    (`kind`); `number` is that of the panel among those of its figure, kind and side.
    """
    axes.set_gid(f"{kind}.{side}.{number}")


def keys_of(axes: Axes) -> list[Any]:
    """What a legend has for everything in `axes` that has a label, each once, and for any band."""
    handles, labels = axes.get_legend_handles_labels()
    keys = list(dict(zip(labels, handles, strict=True)).values())
    if axes.collections:
        keys.append(Patch(facecolor="#9a9a9a", alpha=0.35, label="± SD"))
    return keys


def legend_above(
    figure: Figure, keys: Sequence[Artist], *, columns: int, size: float = 8.5
) -> None:
    """Draw a legend of `keys`, which have labels, above all panels; where it would be wider than
    the `figure`, in smaller letters than of this `size`, points.
    """
    place: Any = "outside upper center" if figure.get_layout_engine() else "upper center"
    legend = figure.legend(
        handles=list(keys), loc=place, ncols=columns, fontsize=size, borderaxespad=0.2
    )
    part = figure.bbox.width / legend.get_window_extent().width
    if part < 1.0:
        legend.remove()
        legend_above(figure, keys, columns=columns, size=0.98 * part * size)


def svg(figure: Figure, name: str) -> str:
    """`figure` as an <svg> element whose identifiers begin with `name`."""
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")  # else all of it is drawn once more for the layout
    buffer = io.StringIO()
    # matplotlib writes date and version unless they are None
    metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figure.savefig(buffer, format="svg", metadata=metadata, transparent=True)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    # several figures share one page, where an identifier may occur only once
    for before in (' id="', 'href="#', "url(#"):
        text = text.replace(before, f"{before}{name}-")
    return text
