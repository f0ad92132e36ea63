"""The style of figures."""

from matplotlib import font_manager

from gaitval.reporting.drawing import SETTINGS, know_fonts


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
