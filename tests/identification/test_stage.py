"""What a study's report says of the body: from the run's record, kept as numbers, drawn later."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from body_result import MODEL, made_up

from gaitval._internal.io.artefacts import read_json, write_json
from gaitval.configuration import load_configuration
from gaitval.errors import ArtefactError
from gaitval.identification.body_report import bars, in_words
from gaitval.identification.body_words import AS_SCALED, sentences, walker_words
from gaitval.identification.default import WORDS
from gaitval.identification.offsets import offset_of
from gaitval.metrics.results import read_metrics
from gaitval.model.parameters import PARAMETERS, nominal_parameters
from gaitval.model.urdf import write_urdf
from gaitval.reporting.body_bars import draw
from gaitval.reporting.report import _parameters
from gaitval.reporting.run_files import read_body
from gaitval.study import body_stage
from gaitval.subjects.subject_file import load_subject

STORED = Path(__file__).resolve().parents[2] / "reports" / "S05" / "baseline" / "metrics.json"


@pytest.fixture
def written(tmp_path, monkeypatch):
    """A folder with the file of a made-up result."""
    found = made_up(0.5, 0.004)
    monkeypatch.setattr("gaitval.identification.shared_errors.identified", lambda *_: found)
    monkeypatch.setattr("gaitval.identification.begin.begin", lambda *_: (None, None))
    monkeypatch.setattr("gaitval.walk.reference.motion.ReferenceMotion.load", lambda _: None)
    write_urdf(MODEL, tmp_path / "model.urdf")
    body_stage.write(run_in(tmp_path, "rollouts"))
    return tmp_path, found


def run_in(folder, method):
    """A run of S05 in a folder, whose body is identified by a method."""
    configuration = load_configuration(settings=[f"identification.method={method}"])
    subject = load_subject("S05")
    message = SimpleNamespace(record=subject.record())
    return SimpleNamespace(
        folder=folder, subject=subject, configuration=configuration, known_record=lambda: message
    )


def test_the_report_has_the_sentences_and_a_bar_for_all_that_was_found(written):
    folder, found = written
    body = read_body(folder)
    assert body[:2] == (sentences(found, MODEL), "rollouts")
    assert [name for name, *_ in body.bars] == [name for name, *_ in bars(found, MODEL)]
    picture = draw(body.bars)
    for name, *_ in bars(found, MODEL):
        assert f">{name}<" in picture


def test_a_study_that_walks_with_this_posterior_says_what_it_identified(written, monkeypatch):
    folder, found = written
    monkeypatch.setattr(
        "gaitval.identification.shared_errors.identified", None
    )  # is not asked again
    (folder / body_stage.FOUND).parent.mkdir(parents=True)
    write_json(folder / body_stage.FOUND, {WORDS: in_words(found, MODEL, "shared")})
    before = read_body(folder).said
    used, nominal = folder / "identification.json", nominal_parameters().tolist()
    stored = read_json(STORED.parent / "identification.json")
    write_json(used, stored | {"identified": nominal, "nominal": nominal})
    body_stage.write(run_in(folder, "shared"))
    # no walk came nearer with the found body
    assert read_body(folder).said == f"{before} {AS_SCALED}"
    another = (0.99 * nominal_parameters()).tolist()
    write_json(used, stored | {"identified": another, "nominal": nominal})
    body_stage.write(run_in(folder, "shared"))
    body = read_body(folder)
    # and whose body the walker has, which is another's by another method
    said = f"{before} {walker_words(found=True, two_legs=False)}"
    assert body[:2] == (said, "shared")
    assert f">{bars(found, MODEL)[0][0]}<" in draw(body.bars)
    write_json(used, stored | {"identified": another, "nominal": nominal, "left_leg": 0.01})
    body_stage.write(run_in(folder, "shared"))
    said = f"{before} {walker_words(found=True, two_legs=True)}"
    assert read_body(folder).said == said


def test_the_table_of_the_report_expects_what_the_posterior_began_with():
    # S05's knee was expected 6 mm further forward than scaled, by other people's records. Measured
    # from the scaled body it would seem to move forward, while the picture shows it move back.
    found = read_metrics(STORED).identification
    shown = [(each["name"], each["mean"], each["sd"]) for each in found.words["bars"]]
    rows = {row.name: row for row in _parameters(found, shown)}
    offset, sd = offset_of(load_subject("S05")), found.prior_standard_deviation
    for i, name in enumerate(PARAMETERS):
        expected = found.nominal[i] + offset[i] * sd[i]
        assert rows[name.replace("_", " ")].prior_mean == pytest.approx(expected, abs=2e-5)
    assert rows["knee x"].prior_mean > 0.005
    assert rows["knee x"].prior_mean > rows["knee x"].mean > 0.0
    assert [row.prior_mean for row in _parameters(found)[:14]] == found.nominal


@pytest.mark.parametrize(
    "text", ["", "[]", '{"said": "x"}', '{"said": "", "method": "", "bars": [{"name": 1}]}']
)
def test_a_damaged_file_is_said_to_be_one(written, text):
    folder, _ = written
    (folder / body_stage.FILE).write_text(text)
    with pytest.raises(
        ArtefactError, match=r"body\.json: (is not what a study writes|cannot be read as JSON)"
    ):
        read_body(folder)
