"""Every text of the templates is in each catalogue, and what stays English says so."""

import gettext
import re
from html.parser import HTMLParser
from pathlib import Path

import messages
import pytest
from html_page import only_html
from recording_summary import sample

from gaitval.configuration import LANGUAGES, ReportSettings, load_configuration
from gaitval.errors import ConfigurationError
from gaitval.reporting.catalogue import translations
from gaitval.reporting.page import _environment
from gaitval.reporting.recording_report import write_recording_report

TRANSLATED = [language for language in LANGUAGES if language != "en"]
PARTS = re.compile(r"%\(\w+\)s|%%|</?\w+[^>]*>")
"""What a translation must repeat: values, per cent signs, elements."""


def texts_of(catalogue) -> set:
    return {message.id for message in catalogue if message.id}


def forms(text) -> tuple[str, ...]:
    return (text,) if isinstance(text, str) else tuple(text)


def test_there_are_german_and_portuguese() -> None:
    assert {"de", "pt"} <= set(TRANSLATED)


@pytest.mark.parametrize("language", TRANSLATED)
def test_no_text_is_missing_and_none_is_stale(language: str) -> None:
    """`python scripts/messages.py` brings the list up to date."""
    stored = messages.catalogue(messages.LANGUAGES / f"{language}.po")
    templates = texts_of(messages.template_texts())
    assert len(templates) > 300
    assert texts_of(stored) == templates
    untranslated = [one.id for one in stored if one.id and not all(forms(one.string))]
    assert untranslated == []
    assert not any(message.fuzzy for message in stored if message.id)


@pytest.mark.parametrize("language", TRANSLATED)
def test_translations_repeat_values_and_elements(language: str) -> None:
    for message in messages.catalogue(messages.LANGUAGES / f"{language}.po"):
        if message.id:
            for given, said in zip(forms(message.id), forms(message.string), strict=True):
                assert sorted(PARTS.findall(given)) == sorted(PARTS.findall(said)), given


def test_a_catalogue_is_read_with_its_plurals() -> None:
    german = translations("de")
    one, many = (
        "%(count)s gait cycle left out of the means:",
        "%(count)s gait cycles left out of the means:",
    )
    assert "Gangzyklus ist" in german.ngettext(one, many, 1)
    assert "Gangzyklen sind" in german.ngettext(one, many, 2)
    assert german.gettext("Joint angles") == "Gelenkwinkel"
    assert german.gettext("no such text") == "no such text"


class Unmarked(HTMLParser):
    """Text of a page that no element marks as English."""

    VOID = frozenset({"meta", "img", "br", "path", "use"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[tuple[str, bool]] = []
        self.found: list[str] = []

    def handle_starttag(self, tag, attributes):
        if tag not in self.VOID:
            english = dict(attributes).get("lang") == "en" or tag in ("style", "script", "code")
            self.open.append((tag, english))

    def handle_startendtag(self, tag, attributes):
        pass

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            self.open.pop()

    def handle_data(self, data):
        if not any(english for _, english in self.open):
            self.found.append(data)


@pytest.fixture(autouse=True)
def own_templates():
    """Templates are kept with their translations; some tests here have others."""
    _environment.cache_clear()
    yield
    _environment.cache_clear()


class Bracketed(gettext.NullTranslations):
    def gettext(self, message):
        return f"⟦{message}⟧"

    def ngettext(self, one, many, count):
        return f"⟦{one if count == 1 else many}⟧"


def test_nothing_else_on_the_page_is_an_english_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With every translated text in brackets, what is outside them and not marked `lang="en"` are
    numbers, units, and names of files and markers.
    """
    only_html(monkeypatch)
    monkeypatch.setattr("gaitval.reporting.page.translations", lambda language: Bracketed())
    write_recording_report(tmp_path, sample(), ReportSettings(language="de"))
    html = (tmp_path / "recording.html").read_text(encoding="utf-8")
    assert '<html lang="de">' in html
    assert '<figure role="group" lang="en"' in html
    page = Unmarked()
    page.feed(html)
    outside = re.sub(r"⟦[^⟧]*⟧", " ", "\n".join(page.found))
    assert not re.findall(r"\b[a-z]{4,} [a-z]{3,}\b", outside)
    assert html.count("⟦") > 80


def test_a_page_in_portuguese(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    only_html(monkeypatch)
    write_recording_report(tmp_path, sample(), ReportSettings(language="pt"))
    html = (tmp_path / "recording.html").read_text(encoding="utf-8")
    assert '<html lang="pt">' in html
    assert "<h2>Ângulos articulares</h2>" in html
    assert "Joint angles</h2>" not in html


def test_a_language_without_catalogue_is_refused_with_those_there_are() -> None:
    with pytest.raises(ConfigurationError, match="'fr' has no catalogue; there are en, de, pt"):
        load_configuration(settings=["report.language=fr"])
