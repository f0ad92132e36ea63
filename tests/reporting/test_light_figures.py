"""A figure for the PDF is the figure of the page."""

import re
from xml.etree import ElementTree

import numpy as np
from matplotlib.patches import Patch
from painted import drawn

from gaitval.reporting.drawing import new_figure, svg
from gaitval.reporting.light_figures import light
from gaitval.reporting.page import _with_letters


def made() -> str:
    """A figure with all that ours have: curves, bands, ticks, texts, a legend, markers."""
    x = np.linspace(0.0, 1.0, 101)
    with new_figure(2.0) as figure:
        for axes in figure.subplots(1, 2, sharex=True):
            axes.plot(x, np.sin(7.0 * x), dashes=(3, 1), label="sine")
            axes.fill_between(x, x, x**2, color="#d9d9d9", alpha=0.5)
            axes.plot(x[::20], x[::20], "o", color="#d96b0a")
            axes.axvline(0.123456, linestyle=(0, (1, 1.5)))
            axes.set_title("limit 0.125678")
            axes.axes.get_yaxis().set_ticks_position("none")
        figure.legend(handles=[Patch(label="band")])
        return _with_letters(svg(figure, "made"))


def test_the_light_figure_paints_the_same_in_the_same_order() -> None:
    whole = made()
    before, after = drawn(whole), drawn(light(whole))
    assert len(before) > 30
    assert "<use" in whole
    for one, other in zip(before, after, strict=True):
        assert other[0] == one[0]
        assert np.abs(other[1] - one[1]).max() <= 0.0101
        assert other[2:] == one[2:]


def test_it_is_much_smaller_and_has_no_reference_left_but_clips() -> None:
    whole = made()
    other = light(whole)
    assert "<use" not in other
    groups = [node for node in ElementTree.fromstring(other).iter() if node.tag.endswith("}g")]
    assert all(set(node.attrib) - {"id"} for node in groups)
    assert set(re.findall(r"url\(#([^)]*)", other)) <= set(re.findall(r' id="([^"]*)', other))


def test_what_is_referred_to_and_what_is_said_stay() -> None:
    whole = (
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">'
        '<g id="a"><text>0.98765 m</text></g><g id="b"/><use xlink:href="#a" x="1" y="2" style=""/>'
        '<g><path d="M 0.123456 1"/></g></svg>'
    )
    assert light(whole) == whole.replace('<g id="b"/>', "").replace("0.123456", "0.12").replace(
        "<g><path", "<path"
    ).replace("/></g></svg>", "/></svg>")
