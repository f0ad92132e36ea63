"""What a study's fingerprint depends on."""

import pytest

from gaitval.apps.cohort import identity
from gaitval.apps.cohort.identity import (
    configuration_of,
    fingerprint,
    record_hash,
    settings_hash,
)
from gaitval.apps.cohort.table import Study, Virtual
from gaitval.errors import ConfigurationError, SubjectError
from gaitval.study.stage_versions import STAGE_VERSIONS


def of(**values):
    return fingerprint(Study(name="a", **values))


def test_equal_studies_have_one_fingerprint_whatever_their_names():
    assert of(subject="5") == fingerprint(Study(name="b", subject="S05"))


@pytest.mark.parametrize(
    "other",
    [
        {"subject": "6"},
        {"subject": "5", "trial": "T03"},
        {"subject": "5", "settings": ("seed=1",)},
        {"subject": "5", "start": "scratch"},
    ],
)
def test_another_record_setting_or_start_is_another_study(other):
    assert of(**other) != of(subject="5")


def test_the_policy_that_is_named_counts(tmp_path):
    for name in ("policy.json", "policy.safetensors"):
        (tmp_path / name).write_text("one")
    first = of(subject="5", policy=str(tmp_path))
    assert first != of(subject="5", start="scratch")
    (tmp_path / "policy.safetensors").write_text("another")
    assert of(subject="5", policy=str(tmp_path)) != first
    with pytest.raises(ConfigurationError, match=r"nowhere/policy\.\w+: no such file"):
        of(subject="5", policy="nowhere")


def test_the_files_of_a_recording_count_and_not_their_place(tmp_path):
    def of_files(folder, text):
        folder.mkdir()
        (folder / "s.c3d").write_text("standing")
        (folder / "w.c3d").write_text(text)
        paths = {"static": str(folder / "s.c3d"), "trials": [str(folder / "w.c3d")]}
        return of(recording={**paths, "sex": "F"})

    first = of_files(tmp_path / "a", "walking")
    assert of_files(tmp_path / "b", "walking") == first
    assert of_files(tmp_path / "c", "running") != first


@pytest.mark.parametrize("option", ["scaled_model.osim", "marker_set.toml"])
def test_a_file_that_says_how_to_read_the_others_counts_and_not_its_place(tmp_path, option):
    (tmp_path / "w.c3d").write_text("walking")

    def of_file(folder, text):
        folder.mkdir()
        (folder / option).write_text(text)
        given = {option.partition(".")[0]: str(folder / option)}
        return of(recording={"trials": [str(tmp_path / "w.c3d")], "sex": "F", **given})

    first = of_file(tmp_path / "a", "one")
    assert of_file(tmp_path / "b", "one") == first
    assert of_file(tmp_path / "c", "another") != first


def test_seeds_are_of_one_record_with_the_same_settings(tmp_path):
    """So are those of a recording, whose subject has the name of the study."""
    for name in ("s.c3d", "w.c3d"):
        (tmp_path / name).write_text(name)
    recording = {
        "static": str(tmp_path / "s.c3d"), "trials": [str(tmp_path / "w.c3d")], "sex": "F",
    }  # fmt: skip
    for about in ({"subject": "5"}, {"recording": recording}, {"virtual": Virtual(number=1)}):
        one = Study(name="a", settings=("training.samples=5000", "seed=1"), **about)
        other = Study(name="b", settings=("seed=2", "training.samples=5000"), **about)
        assert record_hash(one) == record_hash(other)
        assert settings_hash(one) == settings_hash(other)
        for change in ({"start": "scratch"}, {"settings": ()}, {"devices": ("hip_exo",)}):
            assert settings_hash(one.model_copy(update=change)) != settings_hash(one)
    by_trial = {record_hash(Study(name="a", subject="5", trial=name)) for name in ("T03", "T05")}
    assert len(by_trial) == 2


def test_virtual_people_differ():
    assert of(virtual=Virtual(number=1)) != of(virtual=Virtual(number=2))


def test_the_versions_of_stages_and_study_count(monkeypatch):
    before = of(subject="5")
    with monkeypatch.context() as patch:
        patch.setitem(STAGE_VERSIONS, "train", STAGE_VERSIONS["train"] + 1)
        assert of(subject="5") != before
    monkeypatch.setattr(identity, "VERSION", identity.VERSION + 1)
    assert of(subject="5") != before


def test_processes_make_no_difference():
    study = Study(name="a", subject="5")
    assert configuration_of(study, 1).training.workers == 1
    assert configuration_of(study, 4).training.workers == 4


def test_what_is_wrong_is_told_before_anything_runs(tmp_path):
    with pytest.raises(SubjectError, match="no trial 'T09'"):
        of(subject="5", trial="T09")
    with pytest.raises(ConfigurationError, match=r"nothing\.c3d: no such file"):
        of(recording={"static": str(tmp_path / "nothing.c3d"), "trials": [], "sex": "F"})
    with pytest.raises(ConfigurationError, match=r"training\.colour"):
        of(subject="5", settings=("training.colour=1",))


def test_a_device_and_its_search_make_another_study_and_a_wrong_one_is_refused():
    exo = {"name": "hip_exo", "search": {"joint": "hip_flexion"}}
    found = [
        of(subject="5", devices=devices) for devices in ((), ("hip_exo",), ("ankle_exo",), (exo,))
    ]
    assert len(set(found)) == 4
    assert of(subject="5", devices=({"name": "hip_exo"},)) == found[1]
    with pytest.raises(ConfigurationError, match="no such device"):
        of(subject="5", devices=("jetpack",))
