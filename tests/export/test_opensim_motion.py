"""Files of motion, moments and forces against what OpenSim and its tools make of them."""

from dataclasses import replace

import numpy as np
import opensim
import pytest
from known_walk import KnownWalk, known_walk
from opensim_motion import read_motion
from opensim_peer import (
    OpenSimModel,
    inverse_dynamics_tool,
    inverse_kinematics_tool,
    read_table,
    run,
)
from scipy.spatial.transform import Rotation

from gaitval.configuration import ContactSettings
from gaitval.coordinates import ACTUATED
from gaitval.kinetics.inverse.inverse_dynamics import inverse_dynamics
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.mocap.mot import read_storage
from gaitval.mocap.recording import FootForces, Recording
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames
from gaitval.session.opensim.coordinates import (
    OPENSIM_COORDINATES,
    TO_OPENSIM,
    forces_to_opensim,
    to_opensim,
)
from gaitval.session.opensim.motion import (
    write_external_loads,
    write_ground_reaction,
    write_markers,
    write_moments,
    write_motion,
)
from gaitval.session.opensim.osim import write_osim

RATE = 150.0
INSIDE = slice(10, -10)
"""OpenSim's natural splines have no third derivative at the ends, where a walk has one; ours are
not-a-knot. The difference falls to half with every frame: a thousandth after ten."""

LEGS = ("pelvis", *(f"{name}_{side}" for side in "rl" for name in ("thigh", "shank", "foot")))
HELD = {name: 0.0 for name in ACTUATED if name.startswith(("mtp", "lumbar", "arm", "elbow"))}


@pytest.fixture(scope="module")
def walk() -> KnownWalk:
    return known_walk(seconds=0.8, rate=RATE)


@pytest.fixture(scope="module")
def forces(walk) -> FootForces:
    return FootForces(
        rate=RATE,
        start=0.0,
        force=walk.force,
        centre_of_pressure=walk.point,
        free_moment=walk.free_moment,
        valid=np.ones(walk.force.shape[:2], dtype=bool),
    )


@pytest.fixture(scope="module")
def markers(walk) -> tuple[ModelMarker, ...]:
    """Four a segment, of weights from 1 to 4, not in one plane."""
    random = np.random.default_rng(3)
    return tuple(
        ModelMarker(
            f"{segment}.{i}",
            segment,
            walk.model[segment].centre_of_mass + random.uniform(-0.1, 0.1, 3),
            weight=float(i + 1),
        )
        for segment in LEGS
        for i in range(4)
    )


@pytest.fixture(scope="module")
def model_file(walk, markers, tmp_path_factory):
    path = tmp_path_factory.mktemp("opensim") / "model.osim"
    write_osim(path, walk.model, markers, ContactSettings(), 0.8, locked=HELD)
    return path


# ---- Motion. ----


def test_opensim_poses_the_model_by_the_motion_file(walk, model_file, tmp_path):
    write_motion(tmp_path / "walk.mot", walk.time, walk.positions)
    peer = OpenSimModel(model_file)
    processor = opensim.TableProcessor(str(tmp_path / "walk.mot"))
    table = processor.processAndConvertToRadians(peer.model)
    np.testing.assert_allclose(table.getIndependentColumn(), walk.time, atol=1e-9)
    for t in (0, 40, 119):
        for name in table.getColumnLabels():
            value = table.getDependentColumn(name)[t]
            peer.coordinates.get(name).setValue(peer.state, value, False)
        peer.model.realizePosition(peer.state)
        expected = segment_frames(walk.model, walk.positions[t : t + 1])[0]
        np.testing.assert_allclose(peer.frames(), expected, atol=1e-9)


# ---- Inverse kinematics. ----


@pytest.mark.slow
@pytest.mark.parametrize("heading", [0.0, 2.5])
def test_opensim_finds_the_same_motion_from_noisy_markers(
    walk, markers, model_file, tmp_path, heading
):
    """With 3 mm of noise and a marker that is not always seen; the model cannot fit it, so the
    weights, the hidden marker and the ranges all count."""
    random = np.random.default_rng(0)
    turn = Rotation.from_rotvec([0.0, 0.0, heading])
    positions = walk.positions[:40].copy()
    positions[:, :3] = (turn * Rotation.from_rotvec(positions[:, :3])).as_rotvec()
    positions[:, 3:6] = turn.apply(positions[:, 3:6])
    for name, value in HELD.items():
        positions[:, 6 + ACTUATED.index(name)] = value
    measured = marker_positions(walk.model, markers, positions)
    measured += random.normal(0.0, 0.003, measured.shape)
    measured[10:20, 5] = np.nan
    names = tuple(marker.name for marker in markers)
    trial = Recording("synthetic", "project", names, measured, RATE)
    write_markers(tmp_path / "walk.trc", trial)
    tool = inverse_kinematics_tool(
        model_file, markers, tmp_path / "walk.trc", tmp_path / "ik.mot", accuracy=1e-9
    )
    run(tool, tmp_path)
    time, theirs = read_motion(tmp_path / "ik.mot")
    ours = inverse_kinematics(walk.model, markers, measured, fixed=HELD)
    np.testing.assert_allclose(time, trial.time, atol=1e-8)
    np.testing.assert_allclose(
        segment_frames(walk.model, theirs), segment_frames(walk.model, ours.positions), atol=1e-5
    )
    np.testing.assert_allclose(ours.positions[:, 6:], theirs[:, 6:], atol=1e-5)


# ---- Inverse dynamics. ----


@pytest.fixture(scope="module")
def opensim_moments(walk, forces, model_file, tmp_path_factory):
    """OpenSim's inverse dynamics of our files."""
    folder = tmp_path_factory.mktemp("dynamics")
    write_motion(folder / "walk.mot", walk.time, walk.positions)
    write_ground_reaction(folder / "grf.mot", forces)
    write_external_loads(folder / "loads.xml", folder / "grf.mot")
    tool = inverse_dynamics_tool(
        model_file, folder / "walk.mot", folder / "loads.xml", folder / "id.sto"
    )
    run(tool, folder)
    return read_table(folder / "id.sto")


def test_opensim_finds_the_same_moments_and_residuals(walk, opensim_moments, tmp_path):
    dynamics = inverse_dynamics(walk.model, walk.time, walk.positions, *walk.wrenches)
    write_moments(tmp_path / "moments.sto", walk.positions, dynamics)
    ours = read_table(tmp_path / "moments.sto")
    assert set(ours) == set(opensim_moments)
    assert np.abs(ours["knee_angle_r_moment"]).max() > 10.0
    for name, values in opensim_moments.items():
        np.testing.assert_allclose(ours[name][INSIDE], values[INSIDE], atol=2e-3, err_msg=name)


@pytest.mark.parametrize("number", range(31))
def test_each_generalised_force_has_its_own_power(number) -> None:
    """In every pose, force by force: of a pelvis that is balanced, as above, nothing is seen."""
    random = np.random.default_rng(number)
    positions = random.normal(0.0, 0.5, (20, 31))
    velocity = random.normal(size=31)
    force = np.eye(31)[number] * np.ones((20, 1))
    half = 1e-6
    ends = []
    for step in (-half, half):
        moved = positions + step * velocity
        # the root's velocity is about world axes, and its position a rotation vector
        turned = Rotation.from_rotvec(step * velocity[:3])
        moved[:, :3] = (turned * Rotation.from_rotvec(positions[:, :3])).as_rotvec()
        ends.append(to_opensim(moved))
    rates = (ends[1] - ends[0]) / (2.0 * half)
    power = (forces_to_opensim(positions, force) * rates).sum(axis=1)
    np.testing.assert_allclose(power, velocity[number], atol=1e-6)


def test_a_residual_stands_at_the_pelvis_coordinate_that_it_turns(walk, tmp_path) -> None:
    """Upright and facing x: list is about x, tilt about OpenSim's z (to the right), rotation about
    what is up; forces go forward, up and to the right."""
    dynamics = inverse_dynamics(walk.model, walk.time, walk.positions, *walk.wrenches)
    count = len(walk.time)
    moment, force = np.tile([1.0, 2.0, 3.0], (count, 1)), np.tile([4.0, 5.0, 6.0], (count, 1))
    write_moments(
        tmp_path / "id.sto",
        np.zeros((count, 31)),
        replace(dynamics, residual_moment=moment, residual_force=force),
    )
    table = read_table(tmp_path / "id.sto")
    assert list(table)[1:] == [
        f"{name}_{'force' if name.startswith('pelvis_t') and name[-2] == 't' else 'moment'}"
        for name in OPENSIM_COORDINATES
    ]
    expected = {
        "pelvis_list_moment": 1.0, "pelvis_tilt_moment": -2.0, "pelvis_rotation_moment": 3.0,
        "pelvis_tx_force": 4.0, "pelvis_tz_force": -5.0, "pelvis_ty_force": 6.0,
    }  # fmt: skip
    for name, value in expected.items():
        np.testing.assert_allclose(table[name], value, atol=1e-9, err_msg=name)


def test_the_walk_leaves_no_residual_in_opensim(opensim_moments, walk):
    """Its ground reaction was made to balance it."""
    of_pelvis = {name: v for name, v in opensim_moments.items() if name.startswith("pelvis")}
    assert len(of_pelvis) == 6
    for name, values in of_pelvis.items():
        assert np.abs(values[INSIDE]).max() < 1e-3 * walk.model.mass * 9.81, name


def test_external_loads_find_their_file_beside_them(walk, forces, model_file, tmp_path):
    """A folder with the files can be moved."""
    write_motion(tmp_path / "walk.mot", walk.time, walk.positions)
    write_ground_reaction(tmp_path / "grf.mot", forces)
    write_external_loads(tmp_path / "loads.xml", "grf.mot")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    tool = inverse_dynamics_tool(
        model_file, tmp_path / "walk.mot", tmp_path / "loads.xml", tmp_path / "id.sto"
    )
    run(tool, elsewhere)
    residual = read_table(tmp_path / "id.sto")["pelvis_ty_force"]
    assert np.abs(residual[INSIDE]).max() < 1e-3 * walk.model.mass * 9.81


# ---- Ground reaction. ----


def test_forces_stand_in_opensims_columns_and_axes(forces, tmp_path):
    write_ground_reaction(tmp_path / "grf.mot", replace(forces, start=0.5))
    table = read_table(tmp_path / "grf.mot")
    assert table["time"][0] == 0.5
    on_ground = np.isfinite(forces.centre_of_pressure[:, 0, 0])
    assert 0 < on_ground.sum() < len(on_ground)
    for columns, vectors in (
        ("ground_force_r_v", forces.force),
        ("ground_force_r_p", forces.centre_of_pressure),
        ("ground_torque_r_", forces.free_moment),
    ):
        seen = np.column_stack([table[columns + axis] for axis in "xyz"])
        expected = vectors[:, 0] @ TO_OPENSIM.T
        np.testing.assert_allclose(seen[on_ground], expected[on_ground], atol=1e-8)


def test_a_foot_in_the_air_has_no_force_and_its_point_does_not_jump(forces, tmp_path):
    """OpenSim interpolates between samples: a jump to the origin would be a moment of hundreds
    of Nm for part of a step."""
    noisy = replace(forces, force=forces.force + 3.0)  # what a plate shows without a foot
    write_ground_reaction(tmp_path / "grf.mot", noisy)
    table = read_table(tmp_path / "grf.mot")
    for i, side in enumerate("rl"):
        air = np.isnan(forces.centre_of_pressure[:, i, 0])
        assert air.any()
        for axis in "xyz":
            assert not table[f"ground_force_{side}_v{axis}"][air].any()
            assert not table[f"ground_torque_{side}_{axis}"][air].any()
        ahead = table[f"ground_force_{side}_px"]
        assert np.abs(np.diff(ahead)).max() < 0.1


def test_a_foot_that_is_never_on_the_ground_has_no_force(forces, tmp_path):
    point = forces.centre_of_pressure.copy()
    point[:, 1] = np.nan
    write_ground_reaction(tmp_path / "grf.mot", replace(forces, centre_of_pressure=point))
    table = read_table(tmp_path / "grf.mot")
    assert not any(table[name].any() for name in table if "_l_" in name)


def test_what_the_plates_did_not_show_has_no_moments(walk, tmp_path):
    dynamics = inverse_dynamics(walk.model, walk.time, walk.positions, *walk.wrenches)
    shown = np.ones((len(walk.time), 2), dtype=bool)
    shown[10:30, 1] = False
    write_moments(tmp_path / "moments.sto", walk.positions, dynamics, shown=shown)
    write_moments(tmp_path / "all.sto", walk.positions, dynamics)
    table, known = read_storage(tmp_path / "moments.sto"), read_storage(tmp_path / "all.sto")
    for name in table.columns:
        unknown = np.isnan(table.column(name))
        of_leg = "_l_" in name and not name.startswith(("arm", "elbow"))
        lost = of_leg or name.startswith("pelvis")
        np.testing.assert_array_equal(unknown, ~shown[:, 1] if lost else False)
        np.testing.assert_array_equal(table.column(name)[~unknown], known.column(name)[~unknown])
