"""What a sketch paints is where matplotlib would put it, and a report does not load that."""

import re
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator, ScalarFormatter

from gaitval.reporting.drawing import by_matplotlib, new_figure
from gaitval.reporting.font_widths import width
from gaitval.reporting.painting import svg
from gaitval.reporting.sketch import X_DATA, LegendKey, Sketch, keys_of, link
from gaitval.reporting.ticks import round_ticks

X = np.linspace(0.0, 100.0, 101)


class Space:
    """An axis with space for so many intervals."""

    def __init__(self, space: int) -> None:
        self.get_tick_space = lambda: space


def test_ticks_are_where_matplotlib_has_them() -> None:
    chance = np.random.default_rng(0)
    for _ in range(500):
        low = chance.normal() * 10.0 ** chance.uniform(-2, 3)
        high = low + 10.0 ** chance.uniform(-2, 3)
        space = int(chance.integers(1, 12))
        locator = AutoLocator()
        locator.set_axis(Space(space))
        theirs = [each for each in locator.tick_values(low, high) if low <= each <= high]
        np.testing.assert_allclose([at for at, _ in round_ticks(low, high, space)], theirs)


@pytest.mark.parametrize("ends", [(-0.31, 0.52), (-110.0, 20.0), (0.0, 1.0), (0.02, 0.031)])
def test_numbers_have_the_digits_of_matplotlib_and_a_true_minus(ends) -> None:
    ours = round_ticks(*ends, 5)
    axes = Figure().subplots()
    axes.set_ylim(*ends)
    formatter = ScalarFormatter()
    formatter.set_axis(axes.yaxis)
    assert [label for _, label in ours] == formatter.format_ticks([at for at, _ in ours])


def test_texts_are_as_wide_as_matplotlib_finds_them() -> None:
    texts = ("record, right", "± SD of the cycles", "−0.25", "% of gait cycle", "Müde Hüfte")
    with new_figure(2.0) as figure:
        for text in texts:
            theirs = figure.text(0, 0, text, fontsize=8.5).get_window_extent().width
            assert width(text, 8.5) == pytest.approx(theirs, abs=0.5)


def made() -> Sketch:
    figure = Sketch(3.0)
    panels = figure.subplots(2, 2, sharex=True)
    for number, axes in enumerate(figure.axes):
        axes.plot(X, 20.0 * np.sin(X / 15.0 + number) * 10.0**number, color="#00558f", label="a")
        axes.fill_between(X, X, X + 30.0, color="#d9d9d9")
        axes.axvline(61.5, color="#707070")
        axes.plot((5.0, 9.0), (0.1, 0.1), color="#606060", transform=X_DATA)
        axes.set_ylabel("moment, Nm/kg")
        axes.margins(y=0.14)
    panels[1][0].set_ylim(-5.0, 5.0)  # cuts its curve
    link(panels[1][1], "cycle", "both", 3)
    figure.legend([*keys_of(*figure.axes), LegendKey("<b>", {"facecolor": "#d9d9d9"})], ncols=3)
    return figure


def test_curves_are_where_their_axes_have_them_and_clipped_where_they_leave_them() -> None:
    sketch = made()
    theirs = by_matplotlib(sketch)
    text = svg(sketch, "a")
    found = re.findall(
        r'(<g clip[^>]*>)?<path d="M([^"a-z]*)" style="fill: none; stroke: #00558f', text
    )
    curves = [np.array(re.split("[ L]", each), dtype=float).reshape(-1, 2) for _, each in found[:4]]
    assert [bool(clip) for clip, _ in found] == [False, False, True, False, False]  # and the legend
    boxes = re.findall(
        r'd="M([\d.]+) ([\d.]+)L[\d.]+ ([\d.]+)L([\d.]+) [^"]*" style="[^"]*#000000', text
    )
    for curve, axes, box in zip(curves, theirs.axes, boxes, strict=True):
        left, top, bottom, right = map(float, box)
        assert axes.get_ylim()[0] < axes.get_ylim()[1]  # which sets the limits
        assert axes.get_xlim()[0] < axes.get_xlim()[1]
        part = axes.transLimits.transform(axes.lines[0].get_xydata())
        whole = np.column_stack(
            [left + part[:, 0] * (right - left), bottom - part[:, 1] * (bottom - top)]
        )
        at = np.interp(whole[:, 0], curve[:, 0], curve[:, 1])
        step = np.maximum(1.0, np.abs(np.gradient(whole[:, 1], whole[:, 0])))
        assert (np.abs(at - whole[:, 1]) / step).max() < 0.15
        assert len(curve) < 101


def test_what_is_no_number_is_in_no_path_and_leaves_a_gap() -> None:
    """A viewer of PDF draws nothing of a page behind it."""
    high = np.where((X > 20.0) & (X < 30.0), np.nan, X + 30.0)
    for unknown, parts in ((np.full(len(X), np.nan), 0), (high, 2), (X + 30.0, 1)):
        figure = Sketch(3.0, 2.0)
        axes = figure.subplots(1, 1)[0][0]
        axes.plot(X, X, color="#00558f")
        axes.fill_between(X, X, unknown, color="#d9d9d9")
        axes.fill_between(X, unknown, X, color="#123456", alpha=0.2)
        text = svg(figure, "a")
        assert "nan" not in text
        for colour in ("#d9d9d9", "#123456"):
            found = re.findall(rf'<path d="([^"]*)" style="fill: {colour}', text)
            assert sum(each.count("M") for each in found) == parts
            assert sum(each.count("z") for each in found) == parts


def test_texts_are_escaped_said_once_and_found_by_the_replay() -> None:
    text = svg(made(), "a")
    assert text.count(">a<") == 1
    assert "&lt;b&gt;" in text
    assert re.search(r'<g id="a-cycle.both.3"><path class="frame"', text)
    assert len(re.findall('<clipPath id="a-clip-1-0"', text)) == 1


def test_a_report_loads_no_library_that_draws_or_prints_and_none_it_does_not_need() -> None:
    """Each of them took between a seventh and a half of a second of what a report takes."""
    heavy = ("matplotlib", "weasyprint", "torch", "pandas", "gymnasium")
    program = f"import gaitval.reporting.report, sys; print({{*{heavy!r}}} & {{*sys.modules}} or 0)"
    found = subprocess.run(
        [sys.executable, "-P", "-c", program], capture_output=True, text=True, check=True
    )
    assert found.stdout.strip() == "0"
