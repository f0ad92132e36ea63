"""Moments of a device apart from the person's: by virtual work, on the axis of its joint."""

from types import SimpleNamespace

import numpy as np
import pytest
from made_up_session import SHORT, made_up_session
from quick_settings import WITH_WORDS
from typer.testing import CliRunner

from gaitval import cli
from gaitval.coordinates import ACTUATED, COORDINATES
from gaitval.kinetics.inverse.device_moments import device_moments, turning_axis
from gaitval.mocap.formats import with_forces
from gaitval.mocap.mot import read_storage
from gaitval.mocap.mot_writing import StorageTable, write_storage
from gaitval.mocap.reading import read_recording
from gaitval.mocap.recording import DeviceTorque
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames
from gaitval.session.opensim.coordinates import TO_OPENSIM
from gaitval.session.opensim.of_import import write_devices


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return made_up_session(tmp_path_factory.mktemp("session"), noise=1e-4, **SHORT)


@pytest.mark.parametrize(
    ("name", "joint"),
    [
        ("exo_hip_r", ("hip", "r")),
        ("left_knee_brace", ("knee", "l")),
        ("ankleExoR".lower(), None),
        ("exo_r", None),
        ("hip_knee_r", None),
        ("exo_ankle_right", ("ankle", "r")),
    ],
)
def test_the_joint_is_that_of_the_name(name, joint):
    assert DeviceTorque(name, np.zeros((1, 3))).joint == joint


def test_the_power_of_a_device_is_its_couple_on_both_segments(session):
    """τ · (ω of the distal less that of the proximal segment) = Σ moment · rate, for any couple."""
    model, motion = session.person.model, session.walk.kinematics
    positions, rates = motion.positions[::15], motion.velocities[::15]
    random = np.random.default_rng(0)
    for device, joints, distal, proximal in (
        ("exo_hip_r", ("hip_flexion_r", "hip_adduction_r", "hip_rotation_r"), "thigh_r", "pelvis"),
        ("exo_knee_l", ("knee_angle_l",), "shank_l", "thigh_l"),
        ("exo_ankle_r", ("ankle_angle_r", "subtalar_angle_r"), "foot_r", "shank_r"),
    ):
        torque = random.normal(0.0, 10.0, (len(positions), 3))
        found = device_moments(model, positions, [DeviceTorque(device, torque)])
        assert set(found) == set(joints)
        step = 1e-6
        ahead = positions.copy()
        for name in joints:
            place = COORDINATES.index(name)
            ahead[:, place] += step * rates[:, place]
        spins = []
        for segment in (distal, proximal):
            place = SEGMENTS.index(segment)
            before, after = (
                segment_frames(model, each)[:, place, :3, :3] for each in (positions, ahead)
            )
            turn = (after - before) @ before.transpose(0, 2, 1) / step
            spins.append(np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=1))
        power = np.einsum("ti,ti->t", torque, spins[0] - spins[1])
        summed = sum(found[name] * rates[:, COORDINATES.index(name)] for name in joints)
        np.testing.assert_allclose(summed, power, atol=1e-3)


def test_two_devices_at_a_joint_add_up_and_a_nameless_one_is_left_out(session):
    model, positions = session.person.model, session.walk.kinematics.positions[:5]
    torque = np.tile([0.0, -8.0, 0.0], (5, 1))
    one = device_moments(model, positions, [DeviceTorque("a_hip_r", torque)])
    both = device_moments(
        model,
        positions,
        [DeviceTorque(name, torque) for name in ("a_hip_r", "b_hip_r", "exo")],
    )
    np.testing.assert_allclose(both["hip_flexion_r"], 2 * one["hip_flexion_r"])
    axis = turning_axis(model, positions, "hip_flexion_r", "thigh_r")
    np.testing.assert_allclose(np.linalg.norm(axis, axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(one["hip_flexion_r"], axis @ [0.0, -8.0, 0.0], atol=1e-9)


def with_exoskeleton(session, path, name="exo_hip_r"):
    """The forces of the session and 10 Nm of a device about the lateral axis of OpenSim (z)."""
    table = read_storage(session.forces)
    columns = [f"{name}_force_{kind}{x}" for kind in "vp" for x in "xyz"]
    columns += [f"{name}_torque_{x}" for x in "xyz"]
    values = np.zeros((len(table.time), 9))
    values[:, 8] = 10.0 * np.sin(2 * np.pi * table.time)
    write_storage(
        path,
        StorageTable(
            (*table.columns, *columns),
            table.time,
            np.hstack([table.values, values]),
            in_degrees=True,
        ),
    )
    return path


def test_a_file_of_forces_gives_its_devices_at_the_times_of_the_markers(session, tmp_path):
    path = with_exoskeleton(session, tmp_path / "grf.mot")
    with pytest.warns(UserWarning, match="person and device apart"):
        walk = with_forces(read_recording(session.walking), path)
    (device,) = walk.devices
    assert device.joint == ("hip", "r")
    np.testing.assert_allclose(device.torque[:, 2], 10 * np.sin(2 * np.pi * walk.time), atol=0.02)
    assert len(walk.plates) == 2
    # Cut and turned as the markers are.
    part = walk.between((0.5, 1.0), "--trial-time")
    assert len(part.devices[0].torque) == len(part.markers)
    np.testing.assert_allclose(part.devices[0].torque[0], device.torque[walk.time >= 0.5][0])
    turned = walk.turned(TO_OPENSIM.T)
    np.testing.assert_allclose(turned.devices[0].torque[:, 1], -device.torque[:, 2])


def test_person_and_device_are_written_apart(session, tmp_path):
    """Their sum is the joint's moment, where it is known."""
    model, motion = session.person.model, session.walk.kinematics.positions
    walk = session.walk
    torque = np.tile([0.0, -8.0, 1.0], (len(motion), 1))
    valid = np.ones((len(motion), 2), dtype=bool)
    valid[:10] = False
    recording = SimpleNamespace(devices=(DeviceTorque("exo_hip_r", torque),), time=walk.time)
    moments = np.random.default_rng(1).normal(0.0, 30.0, (len(motion), len(ACTUATED)))
    trial = SimpleNamespace(
        recording=recording,
        motion=motion,
        loads=SimpleNamespace(valid=valid),
        moments=SimpleNamespace(moments=moments, foot_known=valid),
    )
    assert write_devices(tmp_path / "d.sto", model, trial)
    table = read_storage(tmp_path / "d.sto")
    device, person = (table.column(f"hip_flexion_r_{who}_moment") for who in ("device", "person"))
    assert np.isnan(person[:10]).all()
    total = moments[:, ACTUATED.index("hip_flexion_r")]
    np.testing.assert_allclose((device + person)[10:], total[10:], atol=1e-3)
    assert np.abs(device).max() > 6.0
    # In OpenSim's axes: what is to the left here is -z there.
    np.testing.assert_allclose(table.column("exo_hip_r_torque_z"), 8.0)
    recording.devices = (DeviceTorque("exo_hip_r", torque[1:]),)
    assert not write_devices(tmp_path / "no.sto", model, trial)


@pytest.mark.slow
def test_an_import_keeps_the_record_of_a_device(session, tmp_path):
    path = with_exoskeleton(session, tmp_path / "grf.mot")
    request = session.request
    words = [
        "import", "--static", str(request.static), "--trial", str(request.trials[0]),
        "--forces", str(path), "--mass", str(request.mass_kg), "--height", str(request.height_m),
        "--sex", request.sex, "--out", str(tmp_path / "out"), *WITH_WORDS,
    ]  # fmt: skip
    done = CliRunner().invoke(cli.app, words)
    assert done.exit_code == 0, done.output
    table = read_storage(tmp_path / "out/recording/trial1_devices.sto")
    moments = read_storage(tmp_path / "out/recording/trial1_id.sto")
    device, person = (table.column(f"hip_flexion_r_{who}_moment") for who in ("device", "person"))
    assert 9.0 < np.abs(device).max() < 10.1
    total = np.interp(table.time, moments.time, moments.column("hip_flexion_r_moment"))
    seen = np.isfinite(total) & np.isfinite(person)
    np.testing.assert_allclose((device + person)[seen], total[seen], atol=0.01)
