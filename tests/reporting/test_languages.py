"""Pages in other languages: words, numbers, plurals. release_languages.py has what is missing."""

import re
import shutil
from pathlib import Path

import messages
import pytest
from html_page import only_html, without_figures
from recording_summary import sample
from report_run import build_run
from verdict_words import PINNED, says
from verdict_words import sides as sides_of

from gaitval.configuration import LANGUAGES, ReportSettings, load_configuration
from gaitval.coordinates import SIDES
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ConfigurationError
from gaitval.metrics.recording_limits import _REMEDIES, remedy
from gaitval.metrics.verdicts import unjudged_text
from gaitval.prediction.known import QUANTITIES
from gaitval.reporting.catalogue import translations, words
from gaitval.reporting.page import _environment
from gaitval.reporting.recording_report import GateRow, write_recording_report
from gaitval.reporting.report import write_report

TRANSLATED = [language for language in LANGUAGES if language != "en"]


def test_there_are_german_and_portuguese() -> None:
    assert {"de", "pt"} <= set(TRANSLATED)


def forms(text) -> tuple[str, ...]:
    """Singular and plural of an entry of a catalogue, or its only text."""
    return tuple(text) if isinstance(text, tuple | list) else (text,)


@pytest.mark.parametrize("language", TRANSLATED)
def test_the_words_of_verdicts_mean_what_they_say(language: str) -> None:
    """Each by its meaning; sentences keep or fail a limit, and name sides, as the English do."""
    stored = messages.catalogue(messages.LANGUAGES / f"{language}.po")
    texts = {text: translations(language).gettext(text) for text in PINNED[language]}
    assert texts == PINNED[language]
    judged = 0
    for message in stored:
        if message.id:
            for given, here in zip(forms(message.id), forms(message.string), strict=True):
                assert sides_of(here, language) == sides_of(given, "en"), given
                if len(given) < 150 and says(given, "en"):
                    judged += 1
                    assert says(here, language) == says(given, "en"), given
    assert judged >= 15


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


@pytest.fixture(autouse=True)
def own_templates():
    """Templates are kept with their translations; some tests here have others."""
    _environment.cache_clear()
    yield
    _environment.cache_clear()


def test_a_standard_deviation_is_dp_in_portuguese() -> None:
    assert words("pt").of("2.31 SD") == "2,31 DP"
    assert words("de").of("≤ 2 SD") == "≤ 2 SD"
    stored = messages.catalogue(messages.LANGUAGES / "pt.po")
    assert [one.string for one in stored if re.search(r"\bSD\b", str(one.string))] == []


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    build_run(folder)
    return folder


@pytest.mark.parametrize(
    ("language", "message"),
    [
        ("en", "31 years, prosthesis on the left, with crutches"),
        ("de", "31 Jahre, Prothese links, mit Gehstützen"),
        pytest.param(
            "pt", "31 anos, prótese no lado esquerdo, com muletas", marks=pytest.mark.slow
        ),  # as "de"
    ],
)
def test_a_prosthesis_and_an_aid_stand_beside_the_persons_data(
    run_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, language: str, message: str
) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    folder = Path(shutil.copytree(run_folder, tmp_path / "run"))
    about = {"prosthesis": "left", "aid": "crutches", "age_years": 31.0}
    person = load_subject("S05").model_copy(update=about)
    person.save(folder / "subject.toml")
    write_report(folder, [f"report.language={language}"])
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert message in re.sub(r"<[^>]*>", "", html)


@pytest.mark.parametrize(
    ("text", "german"),
    [
        ("≤ 2.5 % BW", "≤ 2,5 % KG"),
        ("0.0779 Nm/kg", "0,0779 Nm/kg"),
        ("right hip flexion: -0.0986; and 3 more", "Hüftflexion rechts: -0,0986; und 3 weitere"),
        ("right medial force", "mediale Kraft rechts"),
        ("left vertical force", "Vertikalkraft links"),
        ("the person's T06 at 1.29 m/s", "T06 der Person bei 1,29 m/s"),
        ("54.8–96.7 %, 6 of 7 pushes", "54,8–96,7 %, 6 von 7 Stößen"),
        ("0.351–0.565 % of cycle, 8 of 8 walks", "0,351–0,565 % Zyklus, 8 von 8 Gängen"),
        ("As for its RMS. Of somebody.", None),
        ("Left hip of somebody", None),
        ("", ""),
    ],
)
def test_what_comes_with_the_results_is_known_whole_or_by_its_parts(
    text: str, german: str | None
) -> None:
    assert words("de").of(text) == german
    assert words("en").of(text) == text


def _unrecorded(missing: dict) -> dict:
    """The origin of each quantity; recorded but for those given."""
    return {
        quantity: {side: missing.get((quantity, side), "recorded") for side in SIDES}
        for quantity in QUANTITIES
    }


@pytest.mark.parametrize(
    ("missing", "german"),
    [
        (
            {("angles", "left"): "mirrored"},
            "Nicht aufgezeichnet, darum nicht beurteilt: Winkel links "
            "(von der anderen Seite gespiegelt).",
        ),
        (
            {
                ("angles", "left"): "mirrored",
                ("moments", "left"): "mirrored",
                ("forces", "right"): "expected",
                ("forces", "left"): "expected",
            },
            "Nicht aufgezeichnet, darum nicht beurteilt: Winkel links und Momente links "
            "(von der anderen Seite gespiegelt); Kräfte (nur erwartet).",
        ),
    ],
)
def test_what_is_not_judged_is_said_in_each_language(missing: dict, german: str) -> None:
    text = unjudged_text(_unrecorded(missing)).strip()
    assert words("de").of(text) == german
    assert words("pt").of(text)


def test_versions_and_places_keep_their_points() -> None:
    german = words("de")
    assert german.figures("1.5 and 3.11.7, doi 10.7717/peerj.4640") == (
        "1,5 and 3.11.7, doi 10.7717/peerj.4640"
    )
    assert german.figures("503,808 samples of 1,234 at 0.5") == "503.808 samples of 1.234 at 0,5"
    assert german.figures("0,100 and 1,5 and 12,34") == "0,100 and 1,5 and 12,34"
    assert german.count(2000.0) == "2.000"
    assert words("en").count(2000) == "2,000"


@pytest.mark.parametrize(
    ("language", "text"), [("en", "2026-11-09"), ("de", "09.11.2026"), ("pt", "09/11/2026")]
)
def test_dates_are_those_of_the_language(language: str, text: str) -> None:
    assert words(language).dated("2026-11-09 15:59 UTC") == f"{text} 15:59 UTC"


def test_a_page_in_portuguese(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    only_html(monkeypatch)
    without_figures(monkeypatch)
    write_recording_report(tmp_path, sample(), ReportSettings(language="pt"))
    html = (tmp_path / "recording.html").read_text(encoding="utf-8")
    assert '<html lang="pt">' in html
    assert '<h2 id="angulos-articulares">Ângulos articulares</h2>' in html
    assert "Joint angles</h2>" not in html


def test_the_limits_of_a_recording_are_translated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a trial's name behind them they stayed English, though every title has its German."""
    only_html(monkeypatch)
    without_figures(monkeypatch)
    title = "Residual force over the peak ground reaction"
    gate = GateRow(title, 3.1, 5.0, "%", True, "gaitval", target="walk.c3d")
    write_recording_report(tmp_path, sample(gates=[gate]), ReportSettings(language="de"))
    html = (tmp_path / "recording.html").read_text(encoding="utf-8")
    shown = re.sub(r"<[^>]*>", "", html)
    assert "Residualkraft relativ zur Spitze der Bodenreaktion (walk.c3d)" in shown
    assert gate.name == f"{title} (walk.c3d)"


def test_a_language_without_catalogue_is_refused_with_those_there_are() -> None:
    with pytest.raises(ConfigurationError, match="'fr' has no catalogue; there are en, de, pt"):
        load_configuration(settings=["report.language=fr"])


def test_what_to_do_about_a_failed_limit_is_in_each_language() -> None:
    """It is the first that the page of a recording says."""
    said = {remedy(each, reduced=False) for each in (*_REMEDIES, "residual-force")}
    said.add(remedy("residual-force", reduced=True))
    for code in ("de", "pt"):
        assert not [each for each in said if words(code).of(each) is None]
