"""The walk for pyomeca: its own library finds the same body in the same places."""

import locale
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulation_fixtures import mujoco_mass_matrix

from gaitval.apps.export.biomod import FILES, _with_root_angles, coordinate_names, write_biomod
from gaitval.apps.export.virtual_markers import virtual_markers
from gaitval.apps.export.walked import ExportedWalk
from gaitval.coordinates import ACTUATED
from gaitval.inverse.marked_body import marker_positions
from gaitval.model.measured_ranges import MEASURED_RANGES
from gaitval.simulation.mujoco_body import MujocoBody

biorbd = pytest.importorskip("biorbd", reason="biorbd has no build for this Python")


@pytest.fixture(scope="module")
def folder(walked: ExportedWalk, tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("biomod")
    assert [path.name for path in write_biomod(found, walked)] == list(FILES)
    return found


@pytest.fixture(scope="module")
def walk(folder: Path) -> dict[str, np.ndarray]:
    with np.load(folder / "walk.npz") as stored:
        return dict(stored)


@pytest.fixture(scope="module")
def peer(folder: Path):
    before = locale.setlocale(locale.LC_ALL)
    model = biorbd.Model(str(folder / "person.bioMod"))
    # it reads numbers in the locale "C", and leaves it so: other tests would read ASCII
    locale.setlocale(locale.LC_ALL, before)
    return model


FRAMES = (0, 137, 411)


def test_rates_of_the_pelvis_angles_are_their_derivatives() -> None:
    """The world's angular velocity of a pelvis that tumbles, as rates of three turns."""
    step, time = 1e-5, np.arange(7.0)
    angles = np.stack([0.5 * np.sin(time), 0.4 * np.cos(time), 0.3 * time - 0.8], axis=1)
    spin = np.stack([np.cos(2 * time), 0.5 * np.sin(time), 1.0 - 0.1 * time], axis=1)
    now = Rotation.from_euler("XYZ", angles)
    later = Rotation.from_rotvec(step * spin) * now
    positions, velocities = np.zeros((2, 7, 31))
    positions[:, :3], velocities[:, :3] = now.as_rotvec(), spin
    q, rates = _with_root_angles(positions, velocities)
    np.testing.assert_allclose(q[:, :3], angles, atol=1e-12)
    slope = (later.as_euler("XYZ") - angles) / step
    np.testing.assert_allclose(rates[:, :3], slope, atol=1e-4)


def test_it_has_the_same_coordinates_in_the_same_order(peer, walk) -> None:
    names = [each.to_string() for each in peer.nameDof()]
    assert len(names) == peer.nbQ() == len(coordinate_names()) == 31
    assert list(walk["names"]) == coordinate_names()
    kinds = {"RotX": 0, "RotY": 1, "RotZ": 2, "TransX": 0, "TransY": 1, "TransZ": 2}
    for theirs, ours in zip(names[:6], coordinate_names(), strict=False):
        segment, kind = theirs.rsplit("_", 1)
        assert segment == "pelvis"
        assert "xyz"[kinds[kind]] == ours[-1]


def test_the_walk_stays_within_the_ranges_of_the_file(peer, walk) -> None:
    limits = [each for n in range(peer.nbSegment()) for each in peer.segment(n).QRanges()][6:]
    assert len(limits) == 25
    widths = {round(each.max() - each.min(), 9) for each in limits}
    assert widths == {round(high - low, 9) for low, high in MEASURED_RANGES.values()}
    q = walk["q"][6:]
    inside = [
        (each.min() <= row).all() and (row <= each.max()).all()
        for each, row in zip(limits, q, strict=True)
    ]
    assert np.mean(inside) > 0.9  # a wrong sign or order would leave many


def test_masses_and_places_are_those_of_the_walk(walked: ExportedWalk, peer, walk) -> None:
    assert peer.mass() == pytest.approx(walked.body.mass, rel=1e-12)
    positions = walked.walk.positions[walked.rows]
    for frame in FRAMES:
        markers = virtual_markers(walked)
        places = marker_positions(walked.body, markers, positions[frame : frame + 1])[0]
        ours = {each.name: place for each, place in zip(markers, places, strict=True)}
        theirs = {
            name.to_string(): place.to_array()
            for name, place in zip(
                peer.markerNames(), peer.markers(walk["q"][:, frame]), strict=True
            )
        }
        assert set(theirs) == set(ours)
        for name, place in ours.items():
            np.testing.assert_allclose(theirs[name], place, atol=1e-9, err_msg=name)


def test_its_energy_is_that_of_the_walk(walked: ExportedWalk, peer, walk) -> None:
    """Masses, inertia, axes, signs and rates at once, against MuJoCo."""
    mujoco = MujocoBody(walked.body)
    positions = walked.walk.positions[walked.rows]
    velocities = walked.walk.velocities[walked.rows]
    for frame in FRAMES:
        mujoco.set(positions[frame], velocities[frame])
        mujoco.accelerations(np.zeros(31))
        rates = velocities[frame]
        expected = 0.5 * rates @ mujoco_mass_matrix(mujoco) @ rates
        found = peer.KineticEnergy(walk["q"][:, frame], walk["qdot"][:, frame])
        assert found == pytest.approx(expected, rel=1e-9)


def test_joint_powers_are_those_of_the_walk(walked: ExportedWalk, walk) -> None:
    """Of each: a sign that is missing in a moment or a rate would turn its power."""
    acting = walked.walk.moments[walked.rows]
    ours = acting * walked.walk.velocities[walked.rows, 6:]
    theirs = dict(zip(walk["names"], walk["tau"] * walk["qdot"], strict=True))
    for column, name in enumerate(ACTUATED):
        np.testing.assert_allclose(theirs[name], ours[:, column], atol=1e-9, err_msg=name)
    assert np.abs(ours.sum(axis=1)).max() > 50.0


def test_rates_are_slopes_of_the_coordinates_over_its_time_in_seconds(walked, walk) -> None:
    """Central differences: a rate is the mean of those of the steps before and after its row."""
    steps = np.diff(walk["time"])
    np.testing.assert_allclose(steps, walked.environment.walker.physics_step, rtol=1e-9)
    slopes = np.diff(walk["q"], axis=1) / steps
    slopes, rates = 0.5 * (slopes[:, 1:] + slopes[:, :-1]), walk["qdot"][:, 1:-1]
    for name, slope, rate in zip(walk["names"], slopes, rates, strict=True):
        assert np.sqrt(np.mean((slope - rate) ** 2)) < 0.05 * np.std(rate) + 1e-9, name
