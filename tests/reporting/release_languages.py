"""Every text of the pages is in each catalogue, and what stays English says so.

A text without a translation is shown in English, so this is looked at before a release
(`make translated`) and by no other run of the tests.
"""

import gettext
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import messages
import numpy as np
import pytest
from html_page import both_pages, only_html, unpainted, without_figures
from recording_summary import sample
from report_run import build_run

from gaitval.artefacts import read_json
from gaitval.configuration import LANGUAGES, ReportSettings
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.identification.body_words import _difference
from gaitval.importing.summary import changes_by
from gaitval.inverse.marker_placement import placement_checks
from gaitval.inverse.residual_reduction import MASS_GROUPS
from gaitval.metrics.learning_gain import LearningGain, Standing
from gaitval.metrics.recording_limits import CONSISTENT
from gaitval.metrics.tolerances import Spread, Verdict
from gaitval.metrics.verdicts import close_text, unjudged_text
from gaitval.prediction.known import QUANTITIES
from gaitval.reporting.catalogue import words
from gaitval.reporting.page import _environment
from gaitval.reporting.recording_report import write_recording_report
from gaitval.reporting.report import _failed_text as failed_text
from gaitval.reporting.report import write_report
from gaitval.reporting.translated import TranslatedWords

TRANSLATED = [language for language in LANGUAGES if language != "en"]
PARTS = re.compile(r"%\(\w+\)s|%%|</?\w+[^>]*>")
"""What a translation must repeat: values, per cent signs, elements."""


def texts_of(catalogue) -> set:
    return {message.id for message in catalogue if message.id}


def forms(text) -> tuple[str, ...]:
    return (text,) if isinstance(text, str) else tuple(text)


@pytest.mark.parametrize("language", TRANSLATED)
def test_no_text_is_missing_and_none_is_stale(language: str) -> None:
    """`python scripts/messages.py` brings the list up to date."""
    stored = messages.catalogue(messages.LANGUAGES / f"{language}.po")
    texts = texts_of(messages.all_texts())
    assert len(texts) > 600
    assert texts_of(stored) == texts
    untranslated = [one.id for one in stored if one.id and not all(forms(one.string))]
    assert untranslated == []
    assert not any(message.fuzzy for message in stored if message.id)


@pytest.mark.parametrize("language", TRANSLATED)
def test_translations_repeat_values_and_elements(language: str) -> None:
    for message in messages.catalogue(messages.LANGUAGES / f"{language}.po"):
        if message.id:
            for given, text in zip(forms(message.id), forms(message.string), strict=True):
                assert sorted(PARTS.findall(given)) == sorted(PARTS.findall(text)), given


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


@pytest.mark.parametrize("language", TRANSLATED)
def test_an_error_within_the_record_s_own_is_translated(language: str) -> None:
    rows = [
        SimpleNamespace(measure="angle_rmse", target=f"knee_angle_{side}", value=3.4, passed=False)
        for side in "rl"
    ]
    message = failed_text(rows, {"angle_knee_angle_r": 0.07, "angle_knee_angle_l": 0.08})
    translated = words(language).of(message)
    assert translated is not None
    assert "uncertainty" not in translated
    assert "3,4 (" in translated
    assert "± 4,6" in translated


@pytest.mark.parametrize("language", TRANSLATED)
@pytest.mark.parametrize("mean", [0.001, 0.012, -0.012])
@pytest.mark.parametrize("differ", [False, True])
def test_what_is_said_of_a_body_is_translated(language: str, mean: float, differ: bool) -> None:
    legs = SimpleNamespace(estimate=(mean, 0.004), differ=differ)
    message = f"Legs: 69.0 ± 1.3 cm, thigh and shank (scaled: 69.5 ± 1.7). {_difference(legs)}."
    known = words(language).of(message)
    assert known is not None
    assert "69,5 ± 1,7" in known
    for label in (
        "hip to knee",
        "knee to ankle",
        "left leg longer",
        "SDs of what was known before",
    ):
        assert words(language).of(label) not in (None, label)


def bracket_the_results(monkeypatch: pytest.MonkeyPatch) -> None:
    """What comes with the results in brackets, where the catalogue knows it."""
    known = TranslatedWords.of

    def of(self: TranslatedWords, text: str) -> str | None:
        found = known(self, text)
        return None if found is None else f"⟦{text}⟧" if re.search("[A-Za-z]", text) else found

    monkeypatch.setattr(TranslatedWords, "of", of)


def unknown_texts(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A list that fills with every text of a page, or of a figure, that the catalogue lacks."""
    found: list[str] = []
    inner = [0]
    known = TranslatedWords.of

    def of(self: TranslatedWords, text: str) -> str | None:
        inner[0] += 1
        message = known(self, text)
        inner[0] -= 1
        if message is None and not inner[0]:  # not a part of a text that is looked up whole
            found.append(text)
        return message

    monkeypatch.setattr(TranslatedWords, "of", of)
    return found


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    build_run(folder)
    return folder


@pytest.mark.parametrize("language", ["de", pytest.param("pt", marks=pytest.mark.slow)])
def test_the_catalogue_knows_every_text_of_a_report(
    run_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, language: str
) -> None:
    """Titles and notes of limits, captions, labels of figures, rows of tables, credibility. Those
    that are missing here go into `gaitval/reporting/texts.txt`; then run `scripts/messages.py`."""
    only_html(monkeypatch)
    unpainted(monkeypatch)
    folder = Path(shutil.copytree(run_folder, tmp_path / "run"))
    unknown = unknown_texts(monkeypatch)
    write_report(folder, [f"report.language={language}"])
    metrics = read_json(folder / "metrics.json")
    from_outside = {metrics["subject"][name] for name in ("source", "licence")}
    assert sorted({*unknown} - from_outside) == []


def test_nothing_else_on_a_german_report_is_english(
    run_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With every known text in brackets, what is left are numbers and names; what is marked as
    English are citations, licences, versions and the project's own evidence. No number has a
    decimal point."""
    only_html(monkeypatch)
    without_figures(monkeypatch)  # their texts are outlines; the test above reads them
    folder = Path(shutil.copytree(run_folder, tmp_path / "run"))
    write_report(folder, ["report.language=de"])
    german = Unmarked()
    german.feed(both_pages(folder))
    plain = " ".join(german.found)
    points = set(re.findall(r"(?<![\w./])\d+\.\d+(?![\w./])", plain))
    assert points <= {"2.000"}, "thousands"
    assert "% BW" not in plain
    _environment.cache_clear()  # it has the German texts
    monkeypatch.setattr("gaitval.reporting.page.translations", lambda language: Bracketed())
    bracket_the_results(monkeypatch)
    write_report(folder, ["report.language=de"])
    page = Unmarked()
    page.feed(both_pages(folder))
    outside = " ".join(page.found)
    while "⟦" in outside:  # texts have others as parts
        outside = re.sub(r"⟦[^⟦⟧]*⟧", " ", outside)
    outside = re.sub(r"\S*[/.]\S*", " ", outside)  # files, and places in them
    assert not re.findall(r"\b[a-z]{4,} [a-z]{3,}\b", outside)


def _unrecorded(missing: dict) -> dict:
    """The origin of each quantity; recorded but for those given."""
    return {
        quantity: {side: missing.get((quantity, side), "recorded") for side in SIDES}
        for quantity in QUANTITIES
    }


@pytest.mark.parametrize("language", TRANSLATED)
@pytest.mark.parametrize("origin", ["mirrored", "expected", "predicted"])
def test_every_reason_not_to_judge_is_known(language: str, origin: str) -> None:
    for sides in (("left",), SIDES):
        for count in range(1, len(QUANTITIES) + 1):
            missing = {(name, side): origin for name in QUANTITIES[:count] for side in sides}
            text = unjudged_text(_unrecorded(missing)).strip()
            assert words(language).of(text), text


def standing(falls: int, survived: int, epsilon: float | None, scatter: float | None) -> Standing:
    """Of 8 walks and 21 pushes."""
    return Standing(
        walks=8, falls=falls, pushes=21, survived=survived,
        weakest_phase=50.0, epsilon=epsilon, scatter=scatter,
    )  # fmt: skip


def test_what_learning_gave_is_said_in_each_language() -> None:
    start = standing(1, 17, 0.2847, 0.001)
    none = standing(8, 0, None, None)
    better = standing(0, 18, 0.2738, 0.001)
    assert words("de").of(LearningGain.of(503808, start, better).in_words()) == (
        "Was 503.808 Stichproben brachten: vorher Epsilon 0,2847, 17 von 21 Stößen überstanden, "
        "1 von 8 Gängen endeten mit einem Sturz, nachher Epsilon 0,2738, 18 von 21 Stößen "
        "überstanden; die trainierte Strategie wird weitergegeben."
    )
    untrained = LearningGain.none_needed(better, 80.0).in_words()
    assert words("de").of(untrained).startswith("Es war kein Training nötig: Epsilon 0,2738, 18")
    for language in TRANSLATED:
        assert words(language).of(untrained)
        for before in (None, start, none, better):
            for after in (start, none, better):
                text = LearningGain.of(2000, before, after).in_words()
                assert words(language).of(text), text


@pytest.mark.parametrize("language", TRANSLATED)
def test_every_reason_why_a_value_passes_narrowly_is_known(language: str) -> None:
    for measure, kept in (("push_survival", 6), ("angle_rmse", 7), ("angle_rmse", 8)):
        row = Verdict.model_construct(
            measure=measure, spread=Spread(repeats=8, kept=kept, low=None, high=None, close=True)
        )
        assert words(language).of(close_text(row)), close_text(row)


def test_no_listed_text_is_stale() -> None:
    """Each line of `texts.txt` still stands in the code or a template, phrase by phrase."""
    root = Path(messages.TEMPLATES).parent
    sources = [path for end in ("py", "j2", "toml") for path in root.rglob(f"*.{end}")]
    written = "".join(path.read_text(encoding="utf-8") for path in sources)
    written = re.sub(r'"\s*\n\s*f?"', "", written).lower()  # texts over several lines
    lines = (messages.TEMPLATES / messages.TEXTS).read_text(encoding="utf-8").splitlines()
    stale = [
        line
        for line in lines
        if line and not line.startswith("#")
        and not all(
            piece.strip() in written or piece.strip().replace(" ", "_") in written
            for piece in re.split(r"%\(\w+\)s|[,;:.()]", line.lower().replace("%%", "%"))
        )
    ]  # fmt: skip
    assert stale == []


def test_nothing_else_on_the_page_is_an_english_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With every translated text in brackets, what is outside them and not marked `lang="en"` are
    numbers, units, and names of files and markers.
    """
    only_html(monkeypatch)
    without_figures(monkeypatch)
    monkeypatch.setattr("gaitval.reporting.page.translations", lambda language: Bracketed())
    bracket_the_results(monkeypatch)
    write_recording_report(tmp_path, sample(), ReportSettings(language="de"))
    html = (tmp_path / "recording.html").read_text(encoding="utf-8")
    assert '<html lang="de">' in html
    assert '<figure role="group" aria-label="⟦Joint angles⟧"' in html
    page = Unmarked()
    page.feed(html)
    outside = "\n".join(page.found)
    while "⟦" in outside:
        outside = re.sub(r"⟦[^⟦⟧]*⟧", " ", outside)
    assert not re.findall(r"\b[a-z]{4,} [a-z]{3,}\b", outside)
    assert html.count("⟦") > 80


@pytest.mark.parametrize("language", ["de", "pt"])
def test_what_a_prediction_has_for_the_checklist_is_translated(language: str) -> None:
    """The quantities that it did not know, and limits that it does not judge; a true minus."""
    for text in ("of this trial: angles, timing, moments, forces, stance", "−0.834"):
        assert words(language).of(text)
    assert words(language).of("this run does not judge it")


@pytest.mark.parametrize("language", ["de", "pt"])
def test_what_was_made_consistent_is_translated(language: str) -> None:
    left = SimpleNamespace(force_rms=1.0, force_peak=1.0, moment_rms=1.0, moment_peak=1.0)
    changed = SimpleNamespace(
        marker_change_rms=0.001,
        marker_change_max=0.002,
        coordinate_change=dict.fromkeys(COORDINATES, 0.01),
        mass_factors=dict.fromkeys(MASS_GROUPS, 1.01),
    )
    rows = changes_by(changed, left, left)  # type: ignore[arg-type]
    assert len(rows) == 6 + len(COORDINATES) + len(MASS_GROUPS)
    names = [*(row.name for row in rows), f"walk.c3d{CONSISTENT}"]
    assert [name for name in names if words(language).of(name) is None] == []


@pytest.mark.parametrize("language", ["de", "pt"])
def test_angles_in_standing_and_what_was_measured_are_translated(language: str) -> None:
    distances = {"R.ASIS": 0.001}
    checks = placement_checks(np.zeros(len(COORDINATES)), 0.0, distances)
    names = [check.name for check in checks if check.unit == "deg"]  # the others are limits, too
    found = words(language)
    assert [name for name in (*names, "standing", "plates") if found.of(name) is None] == []
