"""LocoHub's Parquet becomes subjects: what `gaitval export` writes, and other data sets."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from locohub_files import PERSON, PHASE, data_set
from typer.testing import CliRunner

from gaitval.coordinates import SIDES
from gaitval.datasets.locohub import read_locohub_trials, resampled
from gaitval.datasets.locohub_subject import GivenFacts, mean_curves, write_subjects
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import RecordError
from gaitval.gait.record import REQUIRED_ANGLES
from gaitval.gait.sampling import SAMPLES


def assert_is_subject_5(path: Path, tolerance: float = 1e-6) -> None:
    (trial,) = read_locohub_trials(path)
    record, found = PERSON.record(), trial.curves(PERSON.mass_kg)
    for name in REQUIRED_ANGLES:
        np.testing.assert_allclose(
            found[f"angle_{name}"], record.angles[name](PHASE), atol=tolerance, err_msg=name
        )
    for name, curve in record.moments.items():
        if f"moment_{name}" in found:
            expected = curve(PHASE)
            np.testing.assert_allclose(found[f"moment_{name}"], expected, atol=10 * tolerance)
    for side in SIDES:
        force = record.ground_reaction(side, PHASE % 1.0)
        for axis, name in enumerate(("forward", "left", "up")):
            np.testing.assert_allclose(
                found[f"force_{name}_{side[0]}"], force[:, axis], atol=100 * tolerance
            )


@pytest.mark.parametrize("raw", [False, True], ids=["per mass", "in N and Nm"])
def test_both_feet_with_names_units_and_signs(tmp_path, raw) -> None:
    assert_is_subject_5(data_set(tmp_path / "a_phase.parquet", "right", "left", "right", raw=raw))


@pytest.mark.parametrize("side", SIDES)
def test_the_other_foots_cycle_is_found_from_its_strike(tmp_path, side) -> None:
    """To the nearest of 150 points, so angles agree to a hundredth of their rate."""
    (trial,) = read_locohub_trials(data_set(tmp_path / "a_phase.parquet", side))
    record, found = PERSON.record(), trial.curves()
    for name in REQUIRED_ANGLES:
        expected = record.angles[name](PHASE)
        off = 0.02 * np.abs(record.angles[name].derivative(PHASE)).max() + 1e-6
        np.testing.assert_allclose(found[f"angle_{name}"], expected, atol=off, err_msg=name)


def test_a_steps_number_may_come_again(tmp_path) -> None:
    path = data_set(tmp_path / "a_phase.parquet", "right", "right", "left")
    frame = pd.read_parquet(path)
    frame.assign(step=1).to_parquet(path)
    (trial,) = read_locohub_trials(path)
    assert trial.count == 3
    assert_is_subject_5(path)


def test_stride_time_is_that_of_the_velocities(tmp_path) -> None:
    (trial,) = read_locohub_trials(data_set(tmp_path / "a_phase.parquet", "right", "left"))
    assert trial.stride_time() == pytest.approx(PERSON.stride_time_s, rel=1e-3)
    assert trial.value("speed_m_s") == pytest.approx(1.12)


def test_a_subject_is_written_and_is_the_same_person(tmp_path) -> None:
    path = data_set(tmp_path / "md23_phase.parquet", "right", "left")
    (file,), refused = write_subjects(path, tmp_path / "out")
    assert not refused
    subject = load_subject(str(file))
    assert (subject.person, subject.laboratory, subject.sex) == ("MD23_AB01", "LocoHub MD23", "F")
    assert subject.stride_time_s == pytest.approx(PERSON.stride_time_s, rel=1e-3)
    assert subject.left_phase == pytest.approx(PERSON.left_phase, abs=2e-3)
    ours, theirs = PERSON.record(), subject.record()
    phase = np.linspace(0.0, 1.0, SAMPLES)
    for name in REQUIRED_ANGLES:
        off = np.degrees(theirs.angles[name](phase) - ours.angles[name](phase))
        assert np.abs(off).max() < 1.0, name
    assert "stands in" not in subject.source


def test_speeds_are_trials_and_cycles_of_nearly_one_speed_are_one(tmp_path) -> None:
    parts = []
    for speed in ("1.10", "1.13", "1.60"):
        data_set(tmp_path / "a.parquet", "right", "left", info=f"speed_m_s:{speed}")
        part = pd.read_parquet(tmp_path / "a.parquet")
        part["step"] += 2 * len(parts)
        if speed == "1.60":  # others walk faster with other curves
            knees = [name for name in part.columns if name.startswith("knee_flexion")]
            part[knees] *= 1.05
        parts.append(part)
    pd.concat(parts).to_parquet(tmp_path / "b_phase.parquet")
    slow, fast = read_locohub_trials(tmp_path / "b_phase.parquet")
    assert (slow.count, fast.count) == (4, 2)
    assert slow.value("speed_m_s") == pytest.approx(1.115)
    (file,), refused = write_subjects(tmp_path / "b_phase.parquet", tmp_path / "out")
    assert not refused
    subject = load_subject(str(file))
    assert subject.trial.startswith("level-1p1")
    assert [each.name for each in subject.trials] == ["level-1p60-2"]


def test_what_is_missing_stands_in_only_if_asked_for(tmp_path) -> None:
    path = data_set(tmp_path / "a_phase.parquet", "right", "left")
    frame = pd.read_parquet(path)
    lacking = [name for name in frame.columns if "eversion" in name or "adduction_moment" in name]
    frame.drop(columns=lacking).to_parquet(path)
    (trial,) = read_locohub_trials(path)
    with pytest.raises(RecordError, match=r"subtalar_angle_r.*--fill-missing"):
        mean_curves(trial, PERSON.mass_kg, False)
    curves, notes = mean_curves(trial, PERSON.mass_kg, True)
    assert not curves.moments
    assert "subtalar_angle not recorded" in notes[0]
    assert "hip_adduction_r" in notes[1]
    (file,), _ = write_subjects(path, tmp_path / "out", fill_missing=True)
    assert "stands in" in load_subject(str(file)).source


def test_a_foot_that_is_not_said_is_the_right_one_and_said_to_be(tmp_path) -> None:
    path = data_set(tmp_path / "a_phase.parquet", "right", message=False)
    (trial,) = read_locohub_trials(path)
    assert set(trial.cycles) == {"right"}
    (file,), _ = write_subjects(path, tmp_path / "out")
    assert "right foot" in (load_subject(str(file)).guessed or "")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: f.drop(columns="phase_ipsi"), "phase_ipsi missing"),
        (lambda f: f.iloc[:-1], "149 points"),
        (lambda f: f.assign(task="run"), "there are run"),
        (lambda f: f.assign(phase_ipsi=f["phase_ipsi"] / 100.0), "does not go evenly"),
        (lambda f: f.assign(grf_vertical_ipsi_BW=1e200), "up to 1e+200"),
        (lambda f: f.assign(pelvis_sagittal_angle_rad=[np.nan, *[0.1] * 149] * 2), "without gaps"),
    ],
)
def test_what_is_not_locohubs_is_refused(tmp_path, change, words) -> None:
    path = data_set(tmp_path / "a_phase.parquet", "right", "left")
    change(pd.read_parquet(path)).to_parquet(path)
    with pytest.raises(RecordError, match=re.escape(words)):
        read_locohub_trials(path)
    path.write_text("no Parquet")
    with pytest.raises(RecordError, match=r"cannot be read as Parquet.*give a phase-indexed"):
        read_locohub_trials(path)


@pytest.mark.parametrize(
    ("metadata", "info", "words"),
    [
        ("", "speed_m_s:1.1", "Give --mass, --height, --sex"),
        ("sex:F,height_m:1.53,weight_kg:65", "", "Give --speed"),
    ],
)
def test_what_nobody_says_is_asked_for(tmp_path, metadata, info, words) -> None:
    path = data_set(tmp_path / "a_phase.parquet", "right", "left", metadata=metadata, info=info)
    written, refused = write_subjects(path, tmp_path / "out")
    assert not written
    assert words in refused["MD23_AB01"]
    given = GivenFacts(mass=64.95, height=1.53, sex="F", speed=1.12)
    assert write_subjects(path, tmp_path / "out", given=given)[0]


def test_a_sign_that_no_gait_has_is_refused(tmp_path) -> None:
    path = data_set(tmp_path / "a_phase.parquet", "right", "left")
    frame = pd.read_parquet(path)
    for name in ("angle_ipsi_rad", "velocity_ipsi_rad_s"):
        frame[f"knee_flexion_{name}"] *= -1.0
    frame.to_parquet(path)
    _, refused = write_subjects(path, tmp_path / "out")
    assert "Knee flexion is positive" in refused["MD23_AB01"]
    assert "Correct the columns in the file." in refused["MD23_AB01"]


def test_the_command(tmp_path) -> None:
    from gaitval.cli import app

    path = data_set(tmp_path / "a_phase.parquet", "right", "left")
    done = CliRunner().invoke(app, ["locohub", str(path), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "out" / "MD23_AB01.toml").exists()


def test_curves_keep_their_shape_when_resampled() -> None:
    curve = PERSON.record().angles["knee_angle_r"]
    again = resampled(curve(PHASE), SAMPLES)
    np.testing.assert_allclose(again, curve(np.linspace(0, 1, SAMPLES)), atol=2e-4)
