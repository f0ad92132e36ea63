"""The sample recording: an import finds what is known of it; a recorded person is what it says."""

import csv
from pathlib import Path

import numpy as np
import pytest

from gaitval.artefacts import read_json
from gaitval.configuration import load_configuration
from gaitval.coordinates import COORDINATES, SIDES
from gaitval.errors import ArchiveError
from gaitval.inverse.motion_rates import cardan_coordinates
from gaitval.mocap.c3d import read_c3d
from gaitval.model.body import SEGMENTS
from gaitval.session.importing import Imported, import_files
from gaitval.session.request import ImportOptions
from gaitval_curves.sample import SAMPLE, copy_sample

BELT = 1.14
"""m/s; flat feet show 3 % less, see `RecordedPerson.belt`."""
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
        belt=BELT,
    )
    return import_files(options, sample.parent / "imported", configuration=load_configuration())


def truth(sample: Path) -> dict[str, np.ndarray]:
    with (sample / "truth.csv").open() as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


def test_it_is_small_and_comes_whole(sample: Path) -> None:
    assert {path.name for path in sample.iterdir()} == set(SAMPLE)
    assert sum(path.stat().st_size for path in sample.iterdir()) < 500_000
    copy_sample(sample)  # again, over itself
    (sample.parent / "other").mkdir()
    (sample.parent / "other" / "truth.csv").write_text("mine")
    with pytest.raises(ArchiveError, match=r"truth\.csv: is there already"):
        copy_sample(sample.parent / "other")
    assert [path.name for path in (sample.parent / "other").iterdir()] == ["truth.csv"]


def test_an_import_of_it_ends_in_a_subject_with_forces(imported: Imported) -> None:
    assert imported.subject.gait.forces is not None
    assert imported.subject.gait.moments
    assert imported.subject.walking_speed_m_s == pytest.approx(BELT, abs=0.005)
    (walk,) = imported.found.trials
    assert walk.belt == BELT
    assert not walk.doubts
    for side in SIDES:
        assert sum(not cycle.reasons for cycle in walk.cycles[side]) >= 2


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


def test_it_finds_the_lengths(sample: Path, imported: Imported) -> None:
    known = read_json(sample / "truth.json")["lengths"]
    leg = imported.found.body.chosen.right
    assert leg.thigh == pytest.approx(known["thigh_m"], abs=LENGTH)
    assert leg.shank == pytest.approx(known["shank_m"], abs=LENGTH)
    model = imported.found.body.model
    hips = model.segments[SEGMENTS.index("thigh_l")].joint_position
    assert 2.0 * abs(hips[1]) == pytest.approx(known["hips_m"], abs=LENGTH)


def test_its_plates_carry_the_person(sample: Path) -> None:
    """Over whole strides the mean vertical force is the weight."""
    recording = read_c3d(sample / "walking.c3d")
    weight = 9.80665 * read_json(sample / "truth.json")["mass_kg"]
    up = sum(plate.force[:, 2] for plate in recording.plates)
    stride = round(recording.force_rate * 1.0146)
    means = np.convolve(up, np.ones(stride) / stride, mode="valid")
    np.testing.assert_allclose(means / weight, 1.0, atol=FORCE)
