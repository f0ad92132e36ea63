"""A study's devices, as another application knows them."""

import pytest
import quick_study

from gaitval.apps.cohort.answers import StudySummary
from gaitval.apps.cohort.device_studies import figures, identity_of, wearing
from gaitval.apps.cohort.identity import record_parts
from gaitval.apps.cohort.table import Study
from gaitval.apps.devices import results
from gaitval.artefacts import write_json
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ConfigurationError
from gaitval.study.stage_versions import STAGE_VERSIONS

PERSON = load_subject(5)


def study(*devices):
    return Study(name="a", subject="5", devices=devices)


def test_a_person_without_devices_stays_who_they_are(tmp_path):
    assert wearing(study(), PERSON) is PERSON
    assert figures(tmp_path, PERSON) == []


def test_figures_are_those_of_the_page_with_what_a_search_found(tmp_path):
    fitted = wearing(study("hip_exo", {"name": "afo", "sides": ["left"]}), PERSON)
    assert [each.name for each in fitted.devices] == ["hip_exo", "afo"]
    row = {"quantity": "speed", "of": "left, learned", "unit": "m/s", "value": 1.1}
    found = {"quantity": "hip_exo: work", "of": "without", "unit": "J/kg a stride", "value": 0.4}
    result = {"version": results.VERSION, "person": "S05", "walker": "5", "cycles": 20.0}
    folder = tmp_path / "hip_exo-afo"
    folder.mkdir()
    write_json(folder / "device.json", result | {"figures": [row], "searched": [found]})
    assert figures(tmp_path, fitted) == [row, found]
    # what a study sends is read like user input
    summary = quick_study.summary("a", "f" * 8, 1.0, 1)
    for devices in ([], [row, found]):
        assert len(StudySummary.model_validate(summary | {"devices": devices}).devices) == len(
            devices
        )
    with pytest.raises(ValueError, match="devices"):
        StudySummary.model_validate(summary | {"devices": [row | {"value": "high"}]})


def test_the_version_and_whole_tables_count(monkeypatch):
    named = identity_of(["hip_exo"])
    assert named == identity_of([{"name": "hip_exo"}])
    assert named["tables"][0]["hinges"]
    monkeypatch.setitem(STAGE_VERSIONS, "device", STAGE_VERSIONS["device"] + 1)
    assert identity_of(["hip_exo"]) != named
    with pytest.raises(ConfigurationError, match="no such device"):
        identity_of(["jetpack"])


@pytest.mark.slow
def test_devices_of_a_subjects_file_count_as_those_of_the_table(tmp_path):
    """What they are: another version of a shipped one is another study."""
    file = tmp_path / "person.toml"
    file.write_text(PERSON.to_toml())
    assert "devices" not in record_parts(Study(name="a", subject=str(file)))
    fitted = tmp_path / "worn.toml"
    fitted.write_text(PERSON.to_toml() + '\n[[devices]]\nname = "hip_exo"\n')
    assert record_parts(Study(name="a", subject=str(fitted)))["devices"] == identity_of(["hip_exo"])
