"""Sessions of OpenCap and Pose2Sim as `gaitval import` takes them."""

from pathlib import Path

import numpy as np
import pytest
from format_files import opencap_folder, pose2sim_folder

from gaitval.errors import GaitvalError
from gaitval.mocap.reading import read_recording
from gaitval.session.importing.batch_imports import read_batch
from gaitval.session.importing.batch_person import BatchPerson


@pytest.fixture
def opencap(session, standing, tmp_path) -> Path:
    walk = read_recording(session.walking)
    return opencap_folder(tmp_path / "OpenCapData_f2", standing, walk, session.forces)


@pytest.fixture
def pose2sim(session, standing, tmp_path) -> Path:
    return pose2sim_folder(tmp_path / "S00_P00", standing, read_recording(session.walking))


def one(folder: Path) -> BatchPerson:
    (person,) = read_batch([folder])
    assert (person.mass, person.height, person.sex) == (63.2, 1.66, "F")
    return person


def test_an_opencap_session(opencap, session) -> None:
    person = one(opencap)
    assert person.name == "OpenCapData_f2"
    assert person.static == opencap / "MarkerData" / "neutral.trc"
    assert person.trials == (opencap / "MarkerData" / "walk1.trc",)
    assert person.forces == (opencap / "ForceData" / "walk1.mot",)
    assert not person.kinematics_only
    read = read_recording(person.trials[0], forces=person.forces[0])
    written = read_recording(session.walking, forces=session.forces)
    np.testing.assert_allclose(read.markers, written.markers, atol=1e-6)
    assert len(read.plates) == 2


def test_the_scaled_model_of_a_session_is_shown_beside_ours(opencap, pose2sim) -> None:
    assert one(opencap).scaled_model is None
    models = opencap / "OpenSimData" / "Model"
    models.mkdir(parents=True)
    for name in ("Lai_scaled_no_patella.osim", "Lai_scaled.osim"):
        (models / name).touch()
    found = one(opencap)
    assert found.scaled_model == models / "Lai_scaled.osim"
    assert found.joint_centres == "harrington"
    (pose2sim / "kinematics").mkdir()
    (pose2sim / "kinematics" / "walk.osim").touch()
    assert one(pose2sim).scaled_model == pose2sim / "kinematics" / "walk.osim"


def test_sessions_below_a_folder_and_without_forces(opencap) -> None:
    (opencap / "ForceData" / "walk1.mot").unlink()
    (person,) = read_batch([opencap.parent])
    assert person.kinematics_only
    assert person.forces == ()


def test_a_pose2sim_participant(pose2sim, session) -> None:
    person = one(pose2sim)
    assert person.name == "S00_P00"
    assert person.kinematics_only
    assert person.static is not None
    assert "StaticTrial" in person.static.name
    (walk,) = person.trials
    assert walk.name.endswith("LSTM.trc")  # the augmented markers
    np.testing.assert_allclose(
        read_recording(walk).markers, read_recording(session.walking).markers, atol=1e-6
    )


def test_pose2sim_has_its_settings_in_the_session_too(pose2sim) -> None:
    (pose2sim / "Config.toml").replace(pose2sim.parent / "Config.toml")
    assert one(pose2sim).trials
    assert one(pose2sim.parent).trials


def test_several_people_in_one_trial_of_pose2sim(pose2sim) -> None:
    """Their numbers are behind the trial's name, which may have a P of its own."""
    place = pose2sim / "P00_T01_Walk" / "pose-3d"
    (augmented,) = place.glob("*LSTM.trc")
    first = augmented.rename(place / "S00_P00_T01_Walk_P1_0-100_LSTM.trc")
    assert one(pose2sim).trials == (first,)
    (place / "S00_P00_T01_Walk_P2_0-100_LSTM.trc").write_bytes(first.read_bytes())
    with pytest.raises(GaitvalError, match=r"2 people \(.*_P1_.*, .*_P2_.*Move the others'"):
        read_batch([pose2sim])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass_kg: 63.2", "mass_kg: heavy", ("mass_kg is 'heavy'", "Write it")),
        ("height_m: 1.66\n", "", ("height_m is 'missing'", "cannot be scaled")),
        ("gender_mf: f", "gender_mf: o", ("gender_mf is 'o'", "f and m only")),
    ],
)
def test_metadata_of_opencap(opencap, old, new, words) -> None:
    _refused(opencap, opencap / "sessionMetadata.yaml", old, new, words)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("participant_mass = 63.2", "participant_mass = 'auto'", ("participant_mass is 'auto'",)),
        ("participant_sex = 'F' # of ours\n", "", ("participant_sex", "Write participant_sex")),
        ("[project]", "[project", ("Config.toml",)),
    ],
)
def test_settings_of_pose2sim(pose2sim, old, new, words) -> None:
    _refused(pose2sim, pose2sim / "Config.toml", old, new, words)


def _refused(folder: Path, file: Path, old: str, new: str, words: tuple[str, ...]) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(GaitvalError) as caught:
        read_batch([folder])
    for word in (file.name, *words):
        assert word in str(caught.value)


def test_a_folder_without_walks_or_with_forces_of_some(opencap) -> None:
    walk = opencap / "MarkerData" / "walk1.trc"
    walk.with_name("walk2.trc").write_bytes(walk.read_bytes())
    with pytest.raises(GaitvalError, match=r"1 of 2 trials, none of walk2.trc.*Add walk2.mot"):
        read_batch([opencap])
    walk.unlink()
    walk.with_name("walk2.trc").unlink()
    with pytest.raises(GaitvalError, match="nobody walks"):
        read_batch([opencap])


def test_a_folder_of_nothing(tmp_path) -> None:
    with pytest.raises(GaitvalError, match=r"no session\.toml"):
        read_batch([tmp_path])
