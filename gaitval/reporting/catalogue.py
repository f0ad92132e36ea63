"""Translations of the texts of the pages: one file for each language, `languages/de.po`.

Numbers, figures, captions and what the run itself says stay English; the pages mark them so.
"""

import gettext
import io
from functools import cache
from importlib import resources

from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po

from gaitval.configuration import LANGUAGES

SOURCE = LANGUAGES[0]
"""The language that the templates are written in."""


@cache
def translations(language: str) -> gettext.NullTranslations:
    """What `_` says in a language; the text itself where the catalogue has none.

    Parameters
    ----------
    language : one of `gaitval.configuration.LANGUAGES`.
    """
    if language == SOURCE:
        return gettext.NullTranslations()
    file = resources.files("gaitval.reporting").joinpath("languages", f"{language}.po")
    binary = io.BytesIO()
    write_mo(binary, read_po(io.BytesIO(file.read_bytes())))
    binary.seek(0)
    return gettext.GNUTranslations(binary)
