"""The texts of the pages in a language: that of the templates, or one with a translation."""

import gettext
from functools import cache

from gaitval.reporting.words import SOURCE, Words


@cache
def translations(language: str) -> gettext.NullTranslations:
    """The gettext translations of a `language` (one of `gaitval.configuration.LANGUAGES`), which
    return a text itself where the catalogue has none.
    """
    if language == SOURCE:
        return gettext.NullTranslations()
    from gaitval.reporting.translated import read_translations

    return read_translations(language)


@cache
def words(language: str) -> Words:
    """The words of a `language` for texts that come with the results."""
    if language == SOURCE:
        return Words()
    from gaitval.reporting.translated import read_words

    return read_words(language)
