"""What draws a figure, and the language in which it is drawn."""

from collections.abc import Callable
from contextvars import ContextVar
from typing import Final

from gaitval.reporting.catalogue import words
from gaitval.reporting.words import SOURCE

Draw = Callable[[], str]
"""Draws a figure, as SVG."""

_language: Final[ContextVar[str]] = ContextVar("language", default=SOURCE)


def drawn(draw: Draw, language: str = SOURCE) -> str:
    """The figure of `draw` as SVG, its words in `language`."""
    before = _language.set(language)
    try:
        return draw()
    finally:
        _language.reset(before)


def language() -> str:
    """That in which figures are drawn now."""
    return _language.get()


def said(text: str) -> str:
    """A `text` of a figure in this language; unchanged where the catalogue does not know it."""
    if language() == SOURCE or not text:
        return text
    found = words(language()).of(text)
    return text if found is None else found
