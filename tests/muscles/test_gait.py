"""Muscles of whole gaits: pooled cycles, bands, lost joints, devices, files that others open."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from known_walk import HEIGHT, loaded_walk

from gaitval.apps.muscles.write import reserves
from gaitval.configuration import ContactSettings
from gaitval.coordinates import ACTUATED
from gaitval.errors import ArtefactError, ModelError, RecordError
from gaitval.gait.feet_on_plates import FEET
from gaitval.gait.foot_forces import settled
from gaitval.kinetics.musculature import share
from gaitval.kinetics.musculature.forces import FORCES, RecordedActivation
from gaitval.kinetics.musculature.gait import CONTACTS, muscles_of, part_of
from gaitval.kinetics.musculature.mapping import leg_loads, published_angles, sizes
from gaitval.kinetics.musculature.own_coordinates import own_lengths, plain_paths
from gaitval.kinetics.musculature.paths import COORDINATES, table
from gaitval.kinetics.musculature.strands import gait_poses, own_tendons
from gaitval.mocap.mot import read_storage
from gaitval.mocap.recording import FootForces
from gaitval.model.markers import MARKERS, save_markers
from gaitval.session.importing.stored_motions import _knees
from gaitval.session.loaded import known_spans
from gaitval.session.opensim.muscle_motion import write_storages
from gaitval.session.opensim.osim import write_osim
from gaitval.walk.simulation.mujoco_muscles import muscle_mjcf


@pytest.fixture(scope="module")
def motion():
    walk = loaded_walk()
    ((start, end),) = walk.cycles["right"]
    middle = (start + end) / 2
    cycles = {"right": [(start, middle), (middle, end)], "left": [(start, end)]}
    return replace(walk, cycles=cycles)


@pytest.fixture(scope="module")
def found(motion):
    return muscles_of([motion])


def test_cycles_are_pooled_and_a_side_alone_suffices(motion, found):
    assert {side: leg.cycles for side, leg in found.legs.items()} == {"right": 2, "left": 1}
    alone = muscles_of([replace(motion, cycles={"left": motion.cycles["left"]})])
    assert set(alone.legs) == {"left"}
    for name, curve in alone.legs["left"].contact.items():
        np.testing.assert_allclose(curve, found.legs["left"].contact[name], atol=1e-6)
    halves = [
        muscles_of([replace(motion, cycles={"right": [cycle]})]).legs["right"].contact["knee"]
        for cycle in motion.cycles["right"]
    ]
    mean = found.legs["right"].contact["knee"]
    # The rates at the ends of a span are one-sided, those within it are not.
    assert np.abs(np.mean(halves, axis=0) - mean).mean() < 0.02 * mean.max()


def test_what_is_known_without_a_cycle_is_shared_over_time(motion):
    start = float(motion.dynamics.time[0])
    part = replace(motion, cycles={}, spans={"right": [(start, start + 0.5)]})
    alone = muscles_of([part])
    assert not alone.legs
    ((_, _, piece),) = alone.pieces
    (remark,) = (each for each in alone.remarks if "no whole cycle" in each)
    assert f"{start:.2f} to {start + 0.5:.2f} s" in remark
    # What pads the span for rates is not known.
    assert start <= piece.time[0]
    assert piece.time[-1] <= start + 0.5
    assert len(piece.time) == len(piece.legs["right"].activation) > 30
    with pytest.raises(RecordError, match="the moments of no leg are known"):
        muscles_of([replace(motion, cycles={}, spans={})])


def test_frames_beside_unknown_forces_are_not_shared():
    """The low-pass spreads what made them unknown; the ends of a trial stay. Where the foot then is
    in the air, an event ends them that only markers show.
    """
    time = np.arange(200) / 100
    valid, vertical = np.ones((200, 2), dtype=bool), np.full((200, 2), 700.0)
    valid[60:70, 0] = False
    vertical[70:110, 0] = 0.0
    point = np.where(vertical[..., None] > 0.0, 0.0, np.nan) * np.ones(3)
    force = vertical[..., None] * [0.0, 0.0, 1.0]
    known = settled(FootForces(100.0, 0.0, force, point, 0.0 * force, valid))
    settling = round(100 * FEET.settling_seconds)
    assert np.flatnonzero(~known[:, 0]).tolist() == [*range(60 - settling, 70)]
    assert known[:, 1].all()
    spans = known_spans(time, known, vertical, 70.0, {"right": (), "left": ()})
    assert spans["left"] == [(0.0, 1.99)]
    first, second = spans["right"]
    assert first == (0.0, pytest.approx(0.59 - FEET.settling_seconds))
    assert second == (pytest.approx(0.70 + FEET.settling_seconds), 1.99)


def test_a_missing_foot_has_no_muscles(motion):
    lost = {"left": ("ankle_angle", "subtalar_angle")}
    found = muscles_of([replace(motion, lost=lost)])
    names = table().names
    leg = found.legs["left"]
    for name in ("soleus", "gasmed", "tibant"):
        assert not leg.present[names.index(name)]
        assert leg.force[names.index(name)].max() == 0.0
    assert "ankle" not in leg.contact
    assert "knee" in leg.contact
    assert leg.force[names.index("vaslat")].max() > 0.0
    assert reserves(found)["left"]["ankle_angle"] == 0.0
    whole = muscles_of([replace(motion, lost={"left": COORDINATES})])
    assert not whole.legs["left"].contact
    assert whole.legs["right"].contact.keys() == CONTACTS.keys()


def test_a_device_takes_off_what_it_makes(motion):
    """Half of the ankle's moment, made by a device: so much less is asked of the muscles."""
    moments = motion.dynamics.moments
    assist = np.zeros_like(moments)
    column = ACTUATED.index("ankle_angle_r")
    assist[:, column] = 0.5 * moments[:, column]
    before = leg_loads(motion.model, motion.positions, motion.dynamics, "r")
    torques = assist[:, [ACTUATED.index(f"{name}_r") for name in COORDINATES]]
    after = before.assisted(torques)
    ankle, subtalar = COORDINATES.index("ankle_angle"), COORDINATES.index("subtalar_angle")
    taken = before.moments - after.moments
    np.testing.assert_allclose(taken[:, :4], 0.0, atol=1e-12)
    # The oblique axis is 8 degrees off ours.
    np.testing.assert_allclose(taken[:, ankle], 0.978 * torques[:, 4], rtol=0.02, atol=1e-9)
    assert np.abs(taken[:, subtalar]).max() < 0.25 * np.abs(taken[:, ankle]).max()
    soleus = table().names.index("soleus")
    alone = muscles_of([motion]).legs["right"].force[soleus].max()
    helped = muscles_of([replace(motion, assist=assist)]).legs["right"].force[soleus].max()
    assert helped < 0.8 * alone


def test_activations_change_no_faster_than_muscles_can(motion):
    rows = np.arange(len(motion.dynamics.time))[::3]
    given = part_of(motion.dynamics, rows)
    options = {"height": HEIGHT, "criterion": "squares", "sides": ("right",)}
    free, slow = (
        share(motion.model, motion.positions[rows], given, dynamics_of_activation=on, **options)
        .legs["right"].activation
        for on in (False, True)
    )  # fmt: skip
    step = float(np.median(np.diff(given.time)))
    fall, rise = np.exp(-step / FORCES.fall), -np.expm1(-step / FORCES.rise)
    assert (free[1:] < fall * free[:-1] - 1e-3).any()
    assert (slow[1:] >= fall * slow[:-1] - 1e-9).all()
    assert (slow[1:] <= slow[:-1] + rise * (1.0 - slow[:-1]) + 1e-9).all()


def test_recorded_activations_are_stayed_near(motion):
    rows = np.arange(len(motion.dynamics.time))[::4]
    given, at = part_of(motion.dynamics, rows), table().names.index("recfem")
    activation = np.zeros((len(rows), 40))
    weight = np.zeros_like(activation)
    activation[:, at], weight[:, at] = 0.3, 100.0
    options = {"height": HEIGHT, "sides": ("right",)}
    seen = {"right": RecordedActivation(activation, weight)}
    free = share(motion.model, motion.positions[rows], given, criterion="contact", **options)
    near = share(
        motion.model, motion.positions[rows], given, criterion="contact", recorded=seen, **options
    )
    off = [np.abs(x.legs["right"].activation[:, at] - 0.3).mean() for x in (free, near)]
    assert off[1] < 0.1 < off[0]
    assert (near.legs["right"].reserve_share()[:5] < 0.03).all()
    with pytest.raises(ModelError, match="cubes"):
        share(motion.model, motion.positions[rows], given, criterion="cubes", recorded=seen,
              **options)  # fmt: skip


@pytest.mark.slow
def test_bands_hold_the_mean(motion):
    found = muscles_of([replace(motion, cycles={"right": motion.cycles["right"][:1]})], draws=30)
    leg = found.legs["right"]
    for name, curve in leg.contact.items():
        low, high = leg.contact_band[name]
        assert (low <= high).all()
        assert ((low <= curve + 0.3) & (curve <= high + 0.3)).mean() > 0.8, name


# --- paths in other programs ---------------------------------------------------------------------


def test_our_coordinates_are_those_of_the_published_model(motion):
    """The same angles as of the motion's own frames, mirrored or not."""
    for side in "rl":
        loads = leg_loads(motion.model, motion.positions, motion.dynamics, side)
        own = motion.positions[:, [6 + ACTUATED.index(f"{name}_{side}") for name in COORDINATES]]
        np.testing.assert_allclose(published_angles(own), loads.angles, atol=1e-6)


def test_slopes_in_our_coordinates_are_those_of_the_lengths():
    angles, factors = gait_poses()[:12], np.array([1.0, 0.9, 1.1, 1.0])
    _, slopes = own_lengths(angles, factors)
    for i in range(6):
        aside = np.zeros(6)
        aside[i] = 1e-4
        ends = [own_lengths(angles + sign * aside, factors)[0] for sign in (1, -1)]
        np.testing.assert_allclose((ends[0] - ends[1]) / 2e-4, slopes[:, :, i], atol=2e-5)


def test_plain_polynomials_have_our_lengths(motion):
    factors = sizes(motion.model, "r").factors
    angles = gait_poses()[::2]
    lengths, _ = own_lengths(angles, factors)
    for number, path in enumerate(plain_paths(factors)):
        x = angles[:, [COORDINATES.index(name) for name in path.coordinates]]
        off = np.abs(path.lengths(x) - lengths[:, number])
        assert np.quantile(off, 0.95) < 0.8e-3
        assert path.arm_error < 4e-3


def test_opensim_opens_the_model_and_has_our_lengths_and_arms(motion, tmp_path):
    osim = pytest.importorskip("opensim")
    osim.Logger.setLevelString("Off")
    write_osim(tmp_path / "m.osim", motion.model, (), ContactSettings(), 0.8, height=HEIGHT,
               lost={"left": ("ankle_angle", "subtalar_angle")})  # fmt: skip
    model = osim.Model(str(tmp_path / "m.osim"))
    state = model.initSystem()
    present = {model.getMuscles().get(i).getName() for i in range(model.getMuscles().getSize())}
    assert {"soleus_r", "vaslat_l"} <= present
    assert "soleus_l" not in present
    angles = np.radians([[25.0, -3.0, 4.0, 15.0, 5.0, 2.0], [-10.0, 4.0, -5.0, 8.0, 12.0, -4.0]])
    lengths, slopes = own_lengths(angles, sizes(motion.model, "r").factors)
    for k, pose in enumerate(angles):
        for name, value in zip(COORDINATES, pose, strict=True):
            model.getCoordinateSet().get(f"{name}_r").setValue(state, value)
        model.realizeVelocity(state)
        for i, muscle in enumerate(table().muscles):
            path = model.getMuscles().get(f"{muscle.name}_r").getPath()
            assert path.getLength(state) == pytest.approx(lengths[k, i], abs=0.8e-3)
            for c in muscle.coordinates:
                coordinate = model.getCoordinateSet().get(f"{COORDINATES[c]}_r")
                arm = path.computeMomentArm(state, coordinate)
                assert arm == pytest.approx(-slopes[k, i, c], abs=4e-3)


@pytest.mark.slow
def test_tendons_of_mujoco_are_as_long_as_our_muscles(motion):
    """1 mm over gait, in 95 % of poses and muscles."""
    mujoco = pytest.importorskip("mujoco")
    text = ElementTree.tostring(muscle_mjcf(motion.model, height=HEIGHT), encoding="unicode")
    model = mujoco.MjModel.from_xml_string(text)
    assert model.nu == 80
    data, names = mujoco.MjData(model), table().names
    angles = gait_poses()[::4]
    for side in "rl":
        lengths, _ = own_lengths(angles, sizes(motion.model, side).factors)
        off = []
        for k, pose in enumerate(angles):
            for name, value in zip(COORDINATES, pose, strict=True):
                data.qpos[model.joint(f"{name}_{side}").qposadr[0]] = value
            mujoco.mj_fwdPosition(model, data)
            made = [data.ten_length[model.tendon(f"{name}_{side}").id] for name in names]
            off.append(np.array(made) - lengths[k])
        assert np.quantile(np.abs(off), 0.95) < 1e-3
        assert np.abs(off).max() < 5e-3
    own = own_tendons(sizes(motion.model, "r").factors)["soleus"]
    assert own.error < 1e-3
    mujoco.mj_resetData(model, data)
    data.ctrl[:] = 0.3
    for _ in range(100):
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    assert data.actuator_force.min() < -100.0
    assert data.actuator_force.max() <= 0.0


def test_storage_files_are_read_again(found, tmp_path):
    path = next(path for path in write_storages(tmp_path, found) if "force" in path.name)
    read = read_storage(path)
    piece = found.pieces[0][2]
    np.testing.assert_allclose(
        read.column("soleus_r"), piece.legs["right"].force[:, table().names.index("soleus")],
        rtol=1e-9,
    )  # fmt: skip


def test_where_knees_are_is_read_from_the_folder(tmp_path):
    path = tmp_path / MARKERS
    save_markers(path, (), "wbds", knees={"left": -0.014})
    assert _knees(path) == {"left": -0.014}
    save_markers(path, (), "wbds")  # as older versions
    assert _knees(path) == {}
    path.write_text(path.read_text().replace('"markers"', '"knees": {"left": "aside"}, "markers"'))
    with pytest.raises(ArtefactError, match=r"knees.*aside.*Import the session again") as found:
        _knees(path)
    assert str(path) in str(found.value)
