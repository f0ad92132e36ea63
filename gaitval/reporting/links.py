"""How a panel of a figure states what it shows, for the replay on the page."""

from typing import Literal

from matplotlib.axes import Axes

from gaitval.coordinates import Side


def link(
    axes: Axes, kind: Literal["cycle", "stance"], side: Side | Literal["both"], number: int
) -> None:
    """Let the replay on the page (`replay.js`) show its moment in the panel `axes` of a `side`.

    Parameters
    ----------
    kind : what the horizontal axis is, 0 to 100 % of the gait cycle or of the stance of the foot of
        this side.
    number : of the panel, among those of its figure, kind and side.
    """
    axes.set_gid(f"{kind}.{side}.{number}")
