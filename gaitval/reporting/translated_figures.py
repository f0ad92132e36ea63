"""Figures in another language than they were drawn in."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import Formatter

from gaitval.reporting.catalogue import words


class _Spoken(Formatter):
    """Labels of an axis in another language, with its decimal mark."""

    def __init__(self, inner: Formatter, language: str) -> None:
        self._inner, self._language = inner, language

    def format_ticks(self, values: Any) -> list[str]:
        return [_in_words(label, self._language) for label in self._inner.format_ticks(values)]

    def __call__(self, x: float, pos: int | None = None) -> str:
        return _in_words(self._inner(x, pos), self._language)

    def get_offset(self) -> str:
        return self._inner.get_offset()


def _in_words(text: str, language: str) -> str:
    """The `text` of a figure in a `language`; unchanged where the catalogue does not know it."""
    found = words(language).of(text)
    return text if found is None else found


def translate(figure: Figure, language: str) -> None:
    """Put every text of a `figure` into a `language`, wherever it was drawn."""
    for axes in figure.findobj(Axes):
        for axis in axes._axis_map.values():
            axis.set_major_formatter(_Spoken(axis.get_major_formatter(), language))
    # tick labels are made anew by their formatter at each drawing, so the formatter is replaced
    # above
    for text in figure.findobj(Text):
        text.set_text(_in_words(text.get_text(), language))
