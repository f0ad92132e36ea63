"""Numbers and texts of the results, in the language that the templates are written in."""

from typing import Final

import numpy as np
from babel.numbers import format_decimal

from gaitval.configuration import LANGUAGES

SOURCE: Final[str] = LANGUAGES[0]
"""The language that the templates are written in."""


def number(value: float | None, digits: int = 2) -> str:
    """`value` as text with `digits` decimals and a true minus sign; a dash if not measured."""
    if value is None or not np.isfinite(value):
        return "–"
    text = f"{value:.{digits}f}"
    # a small negative value rounds to "-0.00"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")


class Words:
    """Texts of the results in the source language, which stay as they are."""

    language = SOURCE

    def of(self, text: str) -> str | None:
        """The `text` in this language; None where it is not known."""
        return text

    def figures(self, text: str) -> str:
        """Figures in a `text` with the decimal mark and the thousands mark of this language."""
        return text

    def count(self, value: float) -> str:
        """A whole number, `value`, with the thousands apart, as this language has them."""
        return format_decimal(round(value), locale=self.language)
