"""Numbers and texts of the results, in the language that the templates are written in."""

import re
from typing import Final

from babel.numbers import format_decimal

from gaitval.configuration import LANGUAGES

SOURCE: Final[str] = LANGUAGES[0]
"""The language that the templates are written in."""

_DEGREES: Final = re.compile(r"(?<=\d) deg\b")


class Words:
    """Texts of the results in the source language, which stay as they are."""

    language = SOURCE

    def of(self, text: str) -> str | None:
        """The `text` in this language; None where it is not known. Degrees have their sign."""
        return "°" if text == "deg" else _DEGREES.sub("°", text)

    def figures(self, text: str) -> str:
        """Figures in a `text` with the decimal mark and the thousands mark of this language."""
        return text

    def dated(self, text: str) -> str:
        """The dates in a `text`, year first, as this language has them in figures."""
        return text

    def count(self, value: float) -> str:
        """A whole number, `value`, with the thousands apart, as this language has them."""
        return format_decimal(round(value), locale=self.language)
