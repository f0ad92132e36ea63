"""Translations of the texts of the pages: one file for each language, `languages/de.po`.

Texts of the templates are looked up as gettext does. Texts that come with the results (titles of
limits, names of curves, labels of figures: English in `metrics.json` and in the code) are listed in
`texts.txt` and found by `TranslatedWords`, as they are or as a pattern. Some texts stay English and
are marked so: citations, licences, names from outside, the rows that quote the project's evidence,
and what an import decided and found.
"""

import gettext
import io
import re
from collections.abc import Mapping, Sequence
from datetime import date
from functools import cache
from importlib import resources
from typing import Final

from babel.dates import format_date, get_date_format
from babel.messages.catalog import Catalog
from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po
from babel.numbers import get_decimal_symbol, get_group_symbol

from gaitval.reporting.words import Words

_PLACE: Final = re.compile(r"%\((\w+)\)s")
_NEUTRAL: Final = re.compile(
    r"[^A-Za-z]*|[HKA]\d(_[rl])?|[LR]|[0-9a-f]{64}"
    r"|[^A-Za-z]*(m|s|m/s|N|Nm|Nm/kg|W/kg|J/kg|mm|cm|kg|Hz|rad|RMSE|RMS|GPS|MAP)"
)
"""Numbers, units and symbols: the same in all languages but for the decimal mark."""
_FIGURE: Final = re.compile(
    r"(?<![\w.,])(?P<thousands>[1-9]\d{0,2}(?:,\d{3})+)(?!\w|[.,]\d)"
    r"|(?<![\w.])(?P<whole>\d+)\.(?P<part>\d+)(?![\w/]*\.?[\w/])"
)
"""Whole numbers with their thousands apart, and those with a decimal point."""
_DATE: Final = re.compile(r"\b\d{4}-\d\d-\d\d\b")
TEXTS: Final = "texts.txt"
"""What comes with the results, a text a line (scripts/messages.py)."""
_SENTENCES: Final = re.compile(r"(?<=[.!?]) (?=[A-Z])")
_JOINTS: Final = ("; ", ": ", ", ")
"""What parts of a text that are known one by one are joined with."""


@cache
def _catalogue(language: str) -> Catalog:
    file = resources.files("gaitval.reporting").joinpath("languages", f"{language}.po")
    return read_po(io.BytesIO(file.read_bytes()))


def read_translations(language: str) -> gettext.NullTranslations:
    """The gettext translations of a `language`, from its catalogue."""
    binary = io.BytesIO()
    write_mo(binary, _catalogue(language))
    binary.seek(0)
    return gettext.GNUTranslations(binary)


def read_words(language: str) -> "TranslatedWords":
    """The words of a `language` for texts that come with the results, from its catalogue."""
    found = [
        one
        for one in _catalogue(language)
        if isinstance(one.id, str) and one.id and isinstance(one.string, str) and one.string
    ]
    patterns = {
        str(one.id): str(one.string)
        for one in found
        if _PLACE.search(str(one.id)) and any(file == TEXTS for file, _ in one.locations)
    }
    plain = {str(one.id): str(one.string) for one in found if not _PLACE.search(str(one.id))}
    return TranslatedWords(language, plain, patterns)


class TranslatedWords(Words):
    """Texts of the results in a language other than that of the templates.

    Parameters
    ----------
    language : one with a catalogue.
    plain : translation of each text, `%%` for a per cent sign.
    patterns : of texts with parts: in both, `%(part)s` stands for one that is translated in its
        turn, and `%(name)s` for one from outside, such as the name of a trial, which stays.
    """

    def __init__(
        self, language: str, plain: Mapping[str, str], patterns: Mapping[str, str]
    ) -> None:
        self.language = language
        self._decimal = get_decimal_symbol(language)
        self._group = get_group_symbol(language)
        self._plain = {_percent(text): _percent(translation) for text, translation in plain.items()}
        # the one that leaves least open first
        longest = sorted(patterns.items(), key=lambda pair: -len(_PLACE.sub("", pair[0])))
        self._patterns = [(_pattern(text), translation) for text, translation in longest]

    def of(self, text: str) -> str | None:
        """The `text` in this language; None where it is not known."""
        if not text:
            return text
        if text in self._plain:
            return self._plain[text]
        if _NEUTRAL.fullmatch(text):
            return self.figures(text)
        return self._by_pattern(text) or self._by_parts(text)

    def _by_pattern(self, text: str) -> str | None:
        for pattern, translation in self._patterns:
            found = pattern.fullmatch(text)
            if found:
                parts = {
                    name: part if name.startswith("name") else self.of(part)
                    for name, part in found.groupdict().items()
                }
                if None not in parts.values():
                    return translation % parts
        return None

    def _by_parts(self, text: str) -> str | None:
        sentences = _SENTENCES.split(text)
        if len(sentences) > 1:
            return self._joined(sentences, " ")
        if text.endswith("."):
            found = self.of(text[:-1])
            return None if found is None else f"{found}."
        # the loosest joint first: a list may be part of a clause, never the other way round
        for joint in _JOINTS:
            if joint in text:
                found = self._joined(text.split(joint), joint)
                if found is not None:
                    return found
        return None

    def _joined(self, parts: Sequence[str], joint: str) -> str | None:
        translation = [self.of(part) for part in parts]
        return (
            None
            if None in translation
            else joint.join(part for part in translation if part is not None)
        )

    def figures(self, text: str) -> str:
        """Figures in a text with the decimal mark and the thousands mark of this language."""
        return _FIGURE.sub(self._figure, text)

    def dated(self, text: str) -> str:
        """The dates in a text, "2026-11-29", as this language has them in figures."""

        def local(found: re.Match[str]) -> str:
            day = date.fromisoformat(found[0])
            pattern = get_date_format("short", self.language).pattern
            return format_date(day, re.sub("y+", "y", pattern), self.language)

        return _DATE.sub(local, text)

    def _figure(self, found: re.Match[str]) -> str:
        if found["thousands"]:
            return found["thousands"].replace(",", self._group)
        return f"{found['whole']}{self._decimal}{found['part']}"


def _percent(text: str) -> str:
    return text.replace("%%", "%")


def _pattern(text: str) -> re.Pattern[str]:
    """What a text with places for its parts matches."""
    pieces = _PLACE.split(text)  # text, name, text, name, ... text
    written, seen = "", set()
    for index, piece in enumerate(pieces):
        if index % 2 == 0:
            written += re.escape(_percent(piece))
        else:
            # a part from outside may be anything; others end where the next one begins
            anything = "." if piece.startswith("name") else "[^;:]"
            # a part named twice must be the same text in both places
            written += f"(?P={piece})" if piece in seen else f"(?P<{piece}>{anything}+?)"
            seen.add(piece)
    return re.compile(written, re.DOTALL)
