"""The sample recording: an import finds what is known of it; a recorded person is what it says."""

import csv
from pathlib import Path

import numpy as np
import pytest

from gaitval.apps.virtual import recording as made
from gaitval.artefacts import read_json
from gaitval.configuration import load_configuration
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.datasets.sample import SAMPLE, copy_sample
from gaitval.datasets.subject_file import load_subject
from gaitval.errors import ArchiveError
from gaitval.importing.importing import Imported, import_files
from gaitval.inverse.motion_rates import cardan_coordinates
from gaitval.mocap.c3d import read_c3d
from gaitval.mocap.recording import Recording
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import centres_of_mass, tree_arrays
from gaitval.session.request import ImportOptions
from gaitval.study.stored_policy import general_walker
from gaitval.text_tables import without_unit

ANGLE, LENGTH, FORCE = 1.0, 0.005, 0.03
"""Degrees and metres, as in tests/workflows/test_import_truth.py with noise; body weights."""


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("copied") / "sample"
    copy_sample(folder)
    return folder


@pytest.fixture(scope="module")
def imported(sample: Path) -> Imported:
    about = read_json(sample / "truth.json")
    options = ImportOptions(
        static=sample / "standing.c3d",
        trials=(sample / "walking.c3d",),
        mass=about["mass_kg"],
        height=about["height_m"],
        sex=about["sex"],
        belt=about["belt_m_s"],
    )
    return import_files(options, sample.parent / "imported", configuration=load_configuration())


def truth(sample: Path) -> dict[str, np.ndarray]:
    with (sample / "truth.csv").open() as file:
        header, *rows = csv.reader(file)
    names = [without_unit(name)[0] if name != "time_s" else name for name in header]
    return dict(zip(names, np.array(rows, dtype=float).T, strict=True))


def test_it_is_small_and_comes_whole(sample: Path) -> None:
    assert {path.name for path in sample.iterdir()} == set(SAMPLE)
    assert sum(path.stat().st_size for path in sample.iterdir()) < 500_000
    copy_sample(sample)  # again, over itself
    (sample.parent / "other").mkdir()
    (sample.parent / "other" / "truth.csv").write_text("mine")
    with pytest.raises(ArchiveError, match=r"truth\.csv: is there already"):
        copy_sample(sample.parent / "other")
    assert [path.name for path in (sample.parent / "other").iterdir()] == ["truth.csv"]


@pytest.mark.slow
def test_an_import_of_it_ends_in_a_subject_with_forces(sample: Path, imported: Imported) -> None:
    assert imported.subject.gait.forces is not None
    assert imported.subject.gait.moments
    belt = read_json(sample / "truth.json")["belt_m_s"]
    assert imported.subject.walking_speed_m_s == pytest.approx(belt, abs=0.005)
    (walk,) = imported.found.trials
    assert walk.belt == belt
    assert not walk.warnings
    for side in SIDES:
        assert sum(not cycle.reasons for cycle in walk.cycles[side]) >= 2


@pytest.mark.slow
def test_it_finds_the_angles(sample: Path, imported: Imported) -> None:
    known = truth(sample)
    (walk,) = imported.found.trials
    found = np.degrees(cardan_coordinates(walk.positions))
    np.testing.assert_allclose(walk.recording.time, known["time_s"], atol=1e-9)
    inside = slice(20, -20)  # more than a period of the slowest filter
    pelvis = dict(zip(("pelvis_tilt", "pelvis_list", "pelvis_rotation"), range(3), strict=True))
    names = [name.removeprefix("angle_") for name in known if name.startswith("angle_")]
    assert len(names) == 15
    for name in names:
        column = pelvis[name] if name in pelvis else COORDINATES.index(name)
        off = (found[:, column] - known[f"angle_{name}"])[inside]
        assert np.sqrt(np.mean(off**2)) < ANGLE, name


@pytest.mark.slow
def test_it_finds_the_lengths(sample: Path, imported: Imported) -> None:
    known = read_json(sample / "truth.json")["lengths"]
    leg = imported.found.body.chosen.right
    assert leg.thigh == pytest.approx(known["thigh_m"], abs=LENGTH)
    assert leg.shank == pytest.approx(known["shank_m"], abs=LENGTH)
    model = imported.found.body.model
    hips = model.segments[SEGMENTS.index("thigh_l")].joint_position
    assert 2.0 * abs(hips[1]) == pytest.approx(known["hips_m"], abs=LENGTH)


def total_force(recording: Recording) -> np.ndarray:
    """(T, 3) N of both plates."""
    return np.sum([plate.force for plate in recording.plates], axis=0)


def test_its_plates_carry_the_person(sample: Path) -> None:
    """Over whole strides the mean vertical force is the weight."""
    recording = read_c3d(sample / "walking.c3d")
    weight = 9.80665 * read_json(sample / "truth.json")["mass_kg"]
    up = total_force(recording)[:, 2]
    stride = round(recording.force_rate * 1.0146)
    means = np.convolve(up, np.ones(stride) / stride, mode="valid")
    np.testing.assert_allclose(means / weight, 1.0, atol=FORCE)


@pytest.mark.slow
def test_markers_and_plates_are_of_the_same_instants(monkeypatch: pytest.MonkeyPatch) -> None:
    """Force is mass times the acceleration of the centre of mass, at each instant."""
    monkeypatch.setattr(made, "CAMERA_STEPS", 1)
    for noise in ("CAMERA_NOISE", "FORCE_NOISE", "MOMENT_NOISE"):
        monkeypatch.setattr(made, noise, 0.0)
    configuration = load_configuration()
    walker = general_walker(configuration.environment)
    person = made.recorded_person(2, 0, load_subject("S02"), walker, configuration)
    force = total_force(person.walking)
    tree = tree_arrays(person.body)
    path = centres_of_mass(tree, person.positions)
    step = person.time[1]
    acceleration = np.diff(path, 2, axis=0) / step**2
    expected = person.body.mass * (acceleration + np.array([0.0, 0.0, 9.80665]))
    # forward is the laboratory's y, left its -x
    seen = np.stack([force[:, 1], -force[:, 0], force[:, 2]], axis=1)
    # 20 N a step of 2 ms apart
    assert np.sqrt(np.mean((seen[1:-1] - expected) ** 2)) < 3.0
