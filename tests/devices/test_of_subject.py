"""Devices of a subject's file, and of `gaitval subject --device`."""

import subprocess
import sys

import pytest
from quick_settings import QUICK

from gaitval._internal.io.artefacts import read_json
from gaitval.apps.devices import of_subject
from gaitval.apps.devices.sound_leg import check_side
from gaitval.configuration import Configuration
from gaitval.errors import ConfigurationError
from gaitval.study.stage import Observer, Run, open_run
from gaitval.subjects.subject_file import load_subject

EXO = """
[[devices]]
name = "hip_exo"
"""


def test_a_subject_file_has_devices_and_is_written_with_them(tmp_path):
    path = tmp_path / "patient.toml"
    path.write_text(load_subject(5).to_toml() + EXO, encoding="utf-8")
    found = load_subject(path)
    assert [each.name for each in found.devices] == ["hip_exo"]
    whole = of_subject.wearing(found, ["below_knee"])
    for each in (found, whole):
        each.save(tmp_path / "again.toml")
        assert load_subject(tmp_path / "again.toml") == each
    assert load_subject(5).devices == ()
    assert "devices" not in load_subject(5).to_toml()


def test_devices_are_added_by_name_file_and_table(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('[[devices]]\nname = "afo"\nsides = ["left"]\n', encoding="utf-8")
    found = of_subject.wearing(load_subject(5), ["hip_exo", str(path), {"name": "backpack"}])
    assert of_subject.folder_of(found) == "hip_exo-afo-backpack"
    assert found.devices[1].sides == ("left",)
    assert load_subject(5).devices == ()
    with pytest.raises(ConfigurationError, match="no such device"):
        of_subject.wearing(load_subject(5), ["jetpack"])
    with pytest.raises(ConfigurationError, match=r"device jetpack: .*no such device"):
        of_subject.wearing(load_subject(5), [{"name": "jetpack"}])


def test_its_stage_runs_again_if_the_device_is_another(tmp_path):
    def stage(*devices):
        subject = of_subject.wearing(load_subject(5), devices)
        return of_subject.stage(Run(tmp_path, subject, Configuration()))

    one, other = stage("hip_exo"), stage({"name": "hip_exo", "sides": ["right"]})
    assert one.values != other.values
    assert one.values == stage("hip_exo").values


def test_the_main_job_is_of_the_person_without(tmp_path):
    subject = of_subject.wearing(load_subject(5), ["hip_exo"])
    with open_run(subject, Configuration(), tmp_path, Observer()) as run:
        assert run.subject.devices
    assert load_subject(tmp_path / "subject.toml").devices == ()


def test_a_wrong_device_is_refused_before_any_work(tmp_path):
    words = ("subject", "5", "--device", "jetpack", "--out", str(tmp_path / "run"))
    done = subprocess.run(
        [sys.executable, "-P", "-m", "gaitval", *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "no such device" in done.stderr
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_the_main_job_walks_with_a_device_then_and_links_its_page(tmp_path, monkeypatch):
    from gaitval.cli import main

    words = ["gaitval", "subject", "5", "--device", "ankle_spring", "--out", str(tmp_path)]
    for setting in QUICK:
        words += ["--set", setting]
    for _ in range(2):
        monkeypatch.setattr(sys, "argv", words)
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code in (0, None)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'href="./ankle_spring/device.html"' in page
    result = read_json(tmp_path / "ankle_spring" / "device.json")
    assert result["walker"] == str(tmp_path.resolve())
    stages = read_json(tmp_path / "stages.json")
    assert stages["device-ankle_spring"]["outputs"]


@pytest.mark.parametrize("name", ["above_knee", "below_knee"])
def test_a_device_in_place_of_a_leg_is_on_the_side_of_the_prosthesis(name):
    right = of_subject.devices_of({"devices": [{"name": name, "sides": ["right"]}]}, "x")
    patient = load_subject(5).model_copy(update={"prosthesis": "left"})
    with pytest.raises(ConfigurationError, match=r'on the left.*right leg.*sides = \["left"\]'):
        check_side(patient, right)
    with pytest.raises(ConfigurationError, match="on the left"):
        of_subject.wearing(patient, [{"name": name, "sides": ["right"]}])  # cohort
    both = of_subject.devices_of({"devices": [{"name": name, "sides": ["left", "right"]}]}, "x")
    with pytest.raises(ConfigurationError, match="left and right leg"):
        check_side(patient, both)
    left = of_subject.devices_of({"devices": [{"name": name, "sides": ["left"]}]}, "x")
    check_side(patient, left)
    check_side(load_subject(5), right)  # what a device would do to a healthy person
    exo = of_subject.devices_of({"devices": [{"name": "hip_exo"}]}, "x")
    check_side(patient, exo)
