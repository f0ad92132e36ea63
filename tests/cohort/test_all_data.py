"""All data there is: what a folder of WBDS is good for, and what is missing."""

import csv
import re
import shutil

import numpy as np
import pytest

from gaitval.apps.cohort.all_data import virtual_people, wbds_studies
from gaitval.datasets import wbds_archive
from gaitval.datasets.subject_file import load_subject
from gaitval.datasets.wbds_archive import holdings, stride_time, trial_values
from gaitval.errors import ConfigurationError, RecordError
from gaitval.mocap.reading import read_recording

INFO = (
    "Subject", "FileName", "AgeGroup", "Age", "Height", "Mass", "Gender", "Dominance", "LegLength",
    "Static1", "Static2", "GaitSpeed(m/s)", "TreadHands",
)  # fmt: skip
"""Columns of WBDSinfo as published."""


def test_every_trial_of_the_folder_is_a_study(gait_data, tmp_path):
    found = wbds_studies(gait_data, tmp_path)
    names = [study.name for study in found.studies]
    processed = len(list((gait_data / "wbds" / "processed").glob("*ang.txt")))
    assert len(names) == processed + 1 == 15, "and the raw session"
    assert names[0] == "WBDS01-T01-raw"
    assert found.studies[0].recording["height"] == 1.725
    assert {"S05-T03", "S05-T05", "S05-T06", "S10-T02"} <= set(names)
    assert "15 of 336 treadmill trials of 42 people can be run" in found.missing[0]
    message = "\n".join(found.missing)
    assert "WBDS01 T02, T04, T06, T07, T08: no ang.txt, no knt.txt" in message
    assert "not there: WBDS03, WBDS04" in message
    assert "1 overground trials" in message


def test_some_trials_only(gait_data, tmp_path):
    found = wbds_studies(gait_data, tmp_path, trials=["T05"])
    assert [study.name for study in found.studies] == ["S01-T05", "S05-T05"]
    assert "2 of 42 treadmill trials" in found.missing[0]


@pytest.fixture
def archive(gait_data, tmp_path):
    """A folder as the whole archive is laid out, of a person whom the project does not know: made
    of WBDS14's curves and WBDS01's recordings, under the name of WBDS03."""
    wbds, folder = gait_data / "wbds", tmp_path / "archive"
    ascii_, c3d = folder / "WBDSascii", folder / "WBDSc3d"
    ascii_.mkdir(parents=True)
    c3d.mkdir()
    for trial in ("T03", "T05"):
        for kind in ("ang", "knt"):
            source = wbds / "processed" / f"WBDS14walk{trial}{kind}.txt"
            shutil.copy(source, ascii_ / f"WBDS03walk{trial}{kind}.txt")
    standing = read_recording(wbds / "raw" / "WBDS01static1.c3d")
    write_markers(ascii_ / "WBDS03static1.txt", standing)
    write_forces(ascii_ / "WBDS03walkT05grf.txt", wbds / "raw" / "WBDS01walkT01_grf.mot")
    shutil.copy(ascii_ / "WBDS03walkT05grf.txt", ascii_ / "WBDS03walkT03grf.txt")
    shutil.copy(wbds / "raw" / "WBDS01static1.c3d", c3d / "WBDS03static1.c3d")
    shutil.copy(wbds / "raw" / "WBDS01walkT01.c3d", c3d / "WBDS03walkT01.c3d")
    rows = [
        dict(zip(INFO, (3, f"WBDS03walk{trial}{end}", "Young", 31, 172.5, 74.3, "F", "R", 0.89, "",
                        "", speed, ""), strict=True))
        for trial, speed in (("T01", "0.49"), ("T03", "0.78"), ("T05", "1.12"), ("O01C", "--"))
        for end in (".c3d", "mkr.txt", "grf.txt")
    ]  # fmt: skip
    with (folder / "WBDSinfo.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, INFO)
        table.writeheader()
        table.writerows(rows)
    return folder


def write_markers(path, trial):
    columns = ["Time", *(f"{name}{axis}" for name in trial.names for axis in "XYZ")]
    lines = ["\t".join(columns)]
    for time, frame in zip(trial.time, trial.markers * 1000.0, strict=True):
        numbers = [f"{each:.3f}" for each in frame.ravel()]
        lines.append("\t".join([f"{time:.3f}", *numbers]))
    path.write_text("\n".join(lines) + "\n")


def write_forces(path, source):
    """The plates of a MOT file in the columns of `…grf.txt`: N, mm, Nmm, 300 Hz."""
    from gaitval.mocap.mot import read_ground_reaction

    rate, _, plates = read_ground_reaction(source)
    assert rate == pytest.approx(300.0, rel=0.01)
    names = [
        f"{name}{n}" for n in (1, 2) for name in ("Fx", "Fy", "Fz", "COPx", "COPy", "COPz", "Ty")
    ]
    lines = ["\t".join(["Time", *names])]
    for i in range(len(plates[0].force)):
        row = [str(i)]
        for plate in plates[:2]:
            point = np.nan_to_num(plate.centre_of_pressure[i]) * 1000.0
            row += [f"{each:.4f}" for each in (*plate.force[i], *point, plate.free_moment[i][1])]
        lines.append("\t".join(row))
    path.write_text("\n".join(lines) + "\n")


def test_the_files_of_the_archive_make_a_subject(archive, tmp_path):
    found = wbds_studies(archive, tmp_path / "subjects")
    assert [study.name for study in found.studies] == ["WBDS03-T01-raw", "WBDS03-T03", "WBDS03-T05"]
    subject = load_subject(found.studies[1].subject)
    assert (subject.sex, subject.age_years, subject.mass_kg) == ("F", 31.0, 74.3)
    assert subject.height_m == pytest.approx(1.725)
    assert subject.trial == "T03"
    at = subject.on_trial("T05")
    assert (subject.walking_speed_m_s, at.walking_speed_m_s) == (0.78, 1.12)
    # The forces are WBDS01's at T01, whose cadence the published table has: 67.8 steps a minute.
    assert at.stride_time_s == pytest.approx(120 / 67.7966, rel=0.01)
    builtin = load_subject(5)
    np.testing.assert_allclose(
        at.record().angles["knee_angle_r"](np.linspace(0, 1, 50)),
        builtin.record().angles["knee_angle_r"](np.linspace(0, 1, 50)),
        atol=1e-3,
    )


@pytest.mark.parametrize(
    ("file", "message"),
    [
        ("WBDSinfo.csv", r"WBDS03 T03, T05: no sex, mass, height and leg length \(WBDSinfo\), no"),
        ("WBDSascii/WBDS03walkT05knt.txt", r"WBDS03 T05: no knt\.txt"),
        ("WBDSascii/WBDS03walkT03grf.txt", r"WBDS03 T03: no speed and stride time"),
    ],
)
def test_what_is_missing_is_told(archive, tmp_path, file, message):
    (archive / file).unlink()
    try:
        lines = wbds_studies(archive, tmp_path / "s").missing
    except ConfigurationError as error:
        lines = (str(error),)
    assert re.search(message, "\n".join(lines))


def test_a_standing_trial_that_is_missing(archive, tmp_path):
    for path in archive.rglob("WBDS03static1.*"):
        path.unlink()
    with pytest.raises(ConfigurationError, match="T03, T05: no standing trial"):
        wbds_studies(archive, tmp_path / "s")


def test_an_excel_table_is_as_good(archive, tmp_path):
    import pandas as pd

    table = pd.read_csv(archive / "WBDSinfo.csv")
    table.to_excel(archive / "WBDSinfo.xlsx", index=False)
    (archive / "WBDSinfo.csv").unlink()
    assert len(wbds_studies(archive, tmp_path / "s").studies) == 3


def test_a_damaged_file_leaves_the_person_out_and_says_so(archive, tmp_path):
    path = archive / "WBDSascii" / "WBDS03walkT05ang.txt"
    path.write_text("\n".join(path.read_text().split("\n")[:50]))
    found = wbds_studies(archive, tmp_path / "s")
    assert [study.name for study in found.studies] == ["WBDS03-T01-raw"]
    assert any("must be 101" in line for line in found.missing)


@pytest.mark.parametrize("name", ["WBDS01walkT01.c3d", "WBDS01walkT01_grf.mot"])
def test_stride_time_is_that_of_the_published_cadence(gait_data, name):
    found = stride_time(gait_data / "wbds" / "raw" / name)
    assert found == pytest.approx(120 / 67.7966, rel=0.01)


def test_the_corrected_speed_comes_before_the_published_one(gait_data):
    """WBDS24 T07: the table of the archive has a misprint, which `stride_times.csv` corrects."""
    fixed = holdings(gait_data / "wbds")
    assert trial_values(fixed, "WBDS24", "T07")["walking_speed_m_s"] == 1.347


def test_strides_on_plates_that_were_not_zeroed():
    time = np.arange(0, 20, 1 / 300)
    force = 700.0 * (np.sin(2 * np.pi * time / 1.1) > 0.2) - 40.0
    force += 5.0 * np.random.default_rng(0).standard_normal(len(time))
    strikes = wbds_archive._strikes(force, 300.0)
    np.testing.assert_allclose(np.diff(strikes), 1.1, atol=0.01)
    assert not len(wbds_archive._strikes(force * 0.01, 300.0)), "an empty plate"


def test_a_folder_without_trials_is_refused(tmp_path):
    with pytest.raises(RecordError, match="no trial of WBDS here"):
        wbds_studies(tmp_path, tmp_path)
    with pytest.raises(RecordError, match="no such folder"):
        wbds_studies(tmp_path / "none", tmp_path)
    with pytest.raises(ConfigurationError, match="--trials O01: no treadmill trial"):
        wbds_studies(tmp_path, tmp_path, trials=["O01"])


def test_virtual_people_are_around_everybody_in_turn():
    found = virtual_people(40, seed=2)
    assert len({study.name for study in found}) == 40
    assert {study.virtual.around for study in found} == {f"S{n:02d}" for n in range(1, 11)}
    assert [study.virtual.by for study in found[:4]] == ["markers", "markers", "stature", "stature"]
