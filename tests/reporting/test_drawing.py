"""The style of figures, and the SVG that they become."""

import re

import pytest
from matplotlib.patches import Patch

from gaitval.reporting.drawing import keys_of, legend_above, link, new_figure, svg

WORDS = "10 healthy adults at this speed or their nearest to it, ± SD"


@pytest.mark.parametrize("placed", [True, False])
def test_a_legend_of_long_words_is_not_cut_off(placed):
    with new_figure(2.0, placed=placed) as figure:
        axes = figure.subplots()
        axes.plot([1.0], label="line")
        legend_above(figure, [Patch(label=WORDS) for _ in range(8)], columns=4, size=9.0)
        svg(figure, "a")
        (legend,) = figure.legends
        assert legend.get_window_extent().width <= figure.bbox.width
        assert [each.get_text() for each in legend.get_texts()] == [WORDS] * 8
        assert 3.0 < float(legend.get_texts()[0].get_fontsize()) < 9.0


def test_a_legend_that_fits_keeps_its_size_and_names_each_line_once():
    with new_figure(2.0) as figure:
        axes = figure.subplots()
        for values in ([0.0, 1.0], [1.0, 2.0]):
            axes.plot(values, label="walk")
        axes.fill_between([0.0, 1.0], [0.0, 1.0], [1.0, 2.0])
        legend_above(figure, keys_of(axes), columns=2, size=8.0)
        (legend,) = figure.legends
        assert [each.get_text() for each in legend.get_texts()] == ["walk", "± SD"]
        assert legend.get_texts()[0].get_fontsize() == 8.0


def made() -> str:
    with new_figure(2.0) as figure:
        left, right = figure.subplots(1, 2)
        left.plot([0.0, 50.0, 100.0], [-1.0, 1.0, 0.5], color="#00558f")
        right.set_title("a <b>")
        link(right, "cycle", "both", 1)
        return svg(figure, "name")


def test_texts_are_letters_with_a_true_minus_and_no_markup():
    found = made()
    texts = re.findall(r"<text [^>]*>([^<]*)</text>", found)
    assert "a &lt;b&gt;" in texts
    assert "−1.0" in texts
    assert not [each for each in texts if each.startswith("-")]


def test_identifiers_begin_with_the_name_and_all_references_are_known():
    found = made()
    identifiers = re.findall(r' id="([^"]*)"', found)
    assert len(identifiers) == len(set(identifiers))
    assert all(each.startswith("name-") for each in identifiers)
    assert "name-cycle.both.1" in identifiers
    assert {*re.findall(r'(?:href="|url\()#([^")]*)', found)} <= {*identifiers}


def test_equal_figures_are_equal_bytes_whatever_the_users_settings_say(tmp_path, monkeypatch):
    import matplotlib

    before = made()
    monkeypatch.setitem(matplotlib.rcParams, "lines.linewidth", 9.0)
    assert made() == before
    assert matplotlib.rcParams["lines.linewidth"] == 9.0
