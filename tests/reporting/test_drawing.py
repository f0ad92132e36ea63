"""The style of figures."""

from typing import Any

import pytest
from matplotlib import font_manager

from gaitval.reporting.drawing import SETTINGS, know_fonts, new_figure, svg


def test_a_list_of_fonts_without_the_figures_own_is_completed(monkeypatch, caplog):
    """matplotlib's cache had lost all that it ships; every letter warned, and was another's."""
    others = [each for each in font_manager.fontManager.ttflist if "STIX" not in each.name]
    monkeypatch.setattr(font_manager.fontManager, "ttflist", others.copy())
    font = {"family": SETTINGS["font.family"]}
    know_fonts()
    found = font_manager.fontManager.findfont(font_manager.FontProperties(**font))
    assert found.endswith("STIXGeneral.ttf")
    assert "not found" not in caplog.text
    added = len(font_manager.fontManager.ttflist)
    know_fonts()
    assert len(font_manager.fontManager.ttflist) == added


WORDS = "10 gesunde Erwachsene, ± SD"


@pytest.mark.parametrize("placed", [True, False])
def test_a_legend_of_long_words_is_not_cut_off(placed):
    """That of the grids was 15 % wider than the page in German and in Portuguese."""
    with new_figure(2.0, placed=placed) as figure:
        axes = figure.subplots()
        for k in range(8):
            axes.plot([k], label=WORDS)
        handles, labels = axes.get_legend_handles_labels()
        where: Any = "upper center" if placed else "outside upper center"
        figure.legend(handles, labels, loc=where, ncols=4, fontsize=9.0)
        svg(figure, "a")
        (legend,) = figure.legends
        assert legend.get_window_extent().width <= figure.bbox.width
        assert [each.get_text() for each in legend.get_texts()] == [
            "10 gesunde Erwachsene, ± SD"
        ] * 8
        small = float(legend.get_texts()[0].get_fontsize())
        assert 6.0 < small < 9.0
        svg(figure, "a")  # one that fits stays as it is
        assert figure.legends == [legend]
