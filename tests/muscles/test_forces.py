"""Muscle forces of a known walk balance its moments, and the joints carry what is left."""

from dataclasses import fields, replace

import numpy as np
import pytest
from known_walk import known_walk
from scipy.spatial.transform import Rotation

from gaitval.coordinates import ACTUATED, mirrored
from gaitval.errors import ModelError, RecordError
from gaitval.kinetics.inverse.inverse_dynamics import inverse_dynamics
from gaitval.kinetics.musculature import CRITERIA, bands, share
from gaitval.kinetics.musculature.bands import Spreads, draw
from gaitval.kinetics.musculature.contact import KNEE_CONTACT, contact
from gaitval.kinetics.musculature.curves import tendon_strain
from gaitval.kinetics.musculature.mapping import (
    BoneSizes,
    LegLoads,
    knee_aside,
    leg_loads,
    sizes,
    tibia_axes,
)
from gaitval.kinetics.musculature.paths import (
    COORDINATES,
    JOINTS,
    KNEE,
    MUSCLES,
    Geometry,
    geometry,
    table,
)
from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames


@pytest.fixture(scope="module")
def walk():
    return known_walk()


@pytest.fixture(scope="module")
def dynamics(walk):
    return inverse_dynamics(
        walk.model, walk.time, walk.positions, walk.force, walk.point, walk.free_moment,
        kinematics=walk.kinematics,
    )  # fmt: skip


@pytest.fixture(scope="module")
def found(walk, dynamics):
    return share(walk.model, walk.positions, dynamics, height=1.75)


def test_the_hip_moments_are_those_of_inverse_dynamics(walk, dynamics):
    """The same axes by another way: of the vector, in the mirror; about the body's centre."""
    for side in "rl":
        loads = leg_loads(walk.model, walk.positions, dynamics, side)
        about_the_body = loads.moments - loads.moment_per_shift @ loads.hip_shift
        for i, name in enumerate(("hip_flexion", "hip_adduction", "hip_rotation")):
            theirs = dynamics.moments[:, ACTUATED.index(f"{name}_{side}")]
            np.testing.assert_allclose(about_the_body[:, i], theirs, atol=1e-8)


def test_hip_moments_are_about_the_muscles_own_centre(walk, dynamics):
    """15 mm nearer to the middle, where the load has a shorter arm in single support."""
    for side in "rl":
        loads = leg_loads(walk.model, walk.positions, dynamics, side)
        assert -0.025 < loads.hip_shift[2] < -0.008
        force = loads.force[:, 0]
        moved = np.cross(-loads.hip_shift, force)
        # The first axis turns with nothing: flexion is about the pelvis' own.
        flexion = loads.moment[:, 0, 2] + moved[:, 2]
        np.testing.assert_allclose(loads.moments[:, 0], flexion, atol=1e-8)
        loaded = force[:, 1] < -0.6 * 9.81 * dynamics.mass_kg
        before = loads.moments - loads.moment_per_shift @ loads.hip_shift
        assert (np.abs(loads.moments[loaded, 1]) < np.abs(before[loaded, 1])).all()


def test_knee_and_ankle_moments_are_near_those_of_simple_joints(walk, dynamics):
    """The model's knee slides and its ankle is oblique: near, but not the same."""
    for side in "rl":
        loads = leg_loads(walk.model, walk.positions, dynamics, side)
        for name, most in (("knee_angle", 0.15), ("ankle_angle", 0.25)):
            theirs = dynamics.moments[:, ACTUATED.index(f"{name}_{side}")]
            off = loads.moments[:, COORDINATES.index(name)] - theirs
            assert np.abs(off).max() < most * np.abs(theirs).max()
            assert np.abs(off).max() > 1e-3


def test_the_foot_is_where_it_was(walk, dynamics):
    """Two turns about the model's axes nearly give the foot's orientation in the shank."""
    loads = leg_loads(walk.model, walk.positions, dynamics, "r")
    assert np.degrees(loads.unturned.max()) < 12.0
    dorsiflexion = walk.positions[:, 6 + ACTUATED.index("ankle_angle_r")]
    assert np.corrcoef(loads.angles[:, 4], dorsiflexion)[0, 1] > 0.97


def test_muscles_and_reserves_make_the_moments(found):
    for leg in found.legs.values():
        assert leg.solved.all()
        made = np.einsum("tmj,tm->tj", leg.arms, leg.force)
        np.testing.assert_allclose(made + leg.reserves, leg.moments, atol=1e-8)
        # Not the subtalar one: the forces of this walk act under the ankle, with free moments that
        # no floor exerts.
        assert (leg.reserve_share()[:5] < 0.01).all()
        assert leg.activation.min() >= 0.0
        assert leg.activation.max() <= 1.0
        assert (leg.force >= leg.passive - 1e-9).all()
        assert (leg.passive >= 0.0).all()


def test_the_shank_is_in_equilibrium(walk, dynamics, found):
    """All forces on what is beyond the knee, in world axes: the joint's contact, the muscles' pull
    and what inverse dynamics says they must be together."""
    leg = found.legs["right"]
    paths = geometry(leg.loads.angles)
    knee = JOINTS.index("knee")
    pull = np.einsum("tm,tmk->tk", leg.force, paths.pull[:, :, knee])
    thigh = segment_frames(walk.model, walk.positions)[:, SEGMENTS.index("thigh_r"), :3, :3]
    to_leg = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    turn = Rotation.from_rotvec(
        leg.loads.angles[:, [COORDINATES.index("knee_angle")]] * [[0.0, 0.0, -1.0]]
    )
    contact = turn.apply(leg.contact.knee)
    together = np.einsum("tij,tj->ti", thigh, (contact + pull) @ to_leg)
    np.testing.assert_allclose(together, dynamics.joint_force[:, 0, 1], atol=1e-6)


def test_the_plateaus_carry_the_compression(found):
    contact = found.legs["right"].contact
    np.testing.assert_allclose(contact.medial + contact.lateral, contact.compression, atol=1e-9)
    pressed = contact.compression > 0
    assert (contact.medial[pressed] >= -1e-9).all()
    assert (contact.lateral[pressed] >= -1e-9).all()
    # In stance a person's foot is medial of the knee: the medial side carries more.
    assert contact.medial.max() > contact.lateral.max()


def test_joints_carry_more_than_the_body_weighs(found):
    for joint in ("hip", "knee", "ankle"):
        assert 1.5 < found.legs["right"].contact.size(joint).max() / found.body_weight < 9.0


def test_the_mirrored_walk_has_the_mirrored_muscles(walk, dynamics, found):
    mirror = np.array([1.0, -1.0, 1.0])
    order = [ACTUATED.index(mirrored(name)) for name in ACTUATED]
    signs = np.array(
        [-1.0 if n in ("lumbar_bending", "lumbar_rotation") else 1.0 for n in ACTUATED]
    )
    positions = walk.positions.copy()
    positions[:, :3] *= [-1.0, 1.0, -1.0]
    positions[:, 3:6] *= mirror
    positions[:, 6:] = signs * walk.positions[:, 6:][:, order]
    other = replace(
        dynamics,
        joint_force=dynamics.joint_force[:, ::-1] * mirror,
        joint_moment=dynamics.joint_moment[:, ::-1] * [-1.0, 1.0, -1.0],
    )
    turned = share(walk.model, positions, other, height=1.75)
    theirs, ours = turned.legs["left"], found.legs["right"]
    np.testing.assert_allclose(theirs.moments, ours.moments, atol=1e-6)
    np.testing.assert_allclose(theirs.activation, ours.activation, atol=1e-4)
    np.testing.assert_allclose(theirs.contact.lateral, ours.contact.lateral, atol=1.0)


def test_criteria_differ_where_they_should(walk, dynamics, found):
    """Weights on gastrocnemius and hamstrings, or on the knee's force itself, unload the knee."""
    plain = found.legs["right"].contact.compression.mean()
    for name in ("spared knee", "contact"):
        spared = share(walk.model, walk.positions, dynamics, height=1.75, criterion=name)
        assert spared.legs["right"].contact.compression.mean() < 0.9 * plain
    assert {"squares", "cubes", "volume"} <= CRITERIA.keys()


def test_a_weak_muscle_works_less_and_the_others_more(walk, dynamics, found):
    weak = share(walk.model, walk.positions, dynamics, height=1.75, strength={"soleus": 0.3})
    names = found.legs["right"].muscles.names
    soleus, gasmed = names.index("soleus"), names.index("gasmed")
    before, after = found.legs["right"].force, weak.legs["right"].force
    assert after[:, soleus].max() < 0.9 * before[:, soleus].max()
    assert after[:, gasmed].max() > before[:, gasmed].max()


def test_a_tendon_that_stretches_is_in_equilibrium(found):
    """The fibre is as long as its tendon leaves it."""
    leg = found.legs["right"]
    m = leg.muscles
    stretched = m.tendon_slack * (
        1 + np.where(m.elastic, tendon_strain(leg.force / m.max_force), 0)
    )
    along = np.sqrt(
        (leg.fibre * m.optimal_fibre) ** 2 - (m.optimal_fibre * np.sin(m.pennation)) ** 2
    )
    off = (stretched + along - leg.length)[:, m.elastic]
    assert np.abs(off).max() < 1e-3


@pytest.mark.slow
def test_bands_hold_the_result_and_grow_with_what_is_not_known(found, monkeypatch):
    monkeypatch.setattr(bands, "CRITERIA_OF_BANDS", ("squares",))
    small = Spreads(
        0.02, 0.02, 0.005, 0.01, 0.001, 0.006, tone=0.0, model_share=0.01, model_force=0.01
    )
    narrow = draw(found, "right", draws=20, spreads=small)
    wide = draw(found, "right", draws=20)
    low, high = narrow.band("compression")
    width = np.subtract(*wide.band("compression")[::-1]).mean()
    assert width > 3 * (high - low).mean()
    centre = found.legs["right"].contact.compression
    assert ((centre > low - 0.1 * width) & (centre < high + 0.1 * width)).mean() > 0.8
    again = draw(found, "right", draws=20)
    np.testing.assert_array_equal(wide.compression, again.compression)


def test_moments_per_kilogram_are_refused(walk, dynamics):
    per_kg = replace(
        dynamics,
        joint_force=dynamics.joint_force / dynamics.mass_kg,
        joint_moment=dynamics.joint_moment / dynamics.mass_kg,
    )
    with pytest.raises(RecordError, match="per kilogram"):
        share(walk.model, walk.positions, per_kg, height=1.75)


def test_missing_moments_are_refused(walk, dynamics):
    moments = dynamics.moments.copy()
    moments[3] = np.nan
    with pytest.raises(RecordError, match="not known at"):
        share(walk.model, walk.positions, replace(dynamics, moments=moments), height=1.75)


def test_nothing_is_said_where_the_force_on_a_foot_is_not_known(walk, dynamics, found):
    """Whatever the moments are there, NaN or wrong, they change nothing elsewhere."""
    unknown = np.zeros(len(walk.time), dtype=bool)
    unknown[20:35] = True
    wrong = dynamics.moments.copy()
    wrong[unknown, ACTUATED.index("hip_flexion_r")] += 300.0
    foot_known = np.stack([~unknown, np.ones_like(unknown)], axis=1)
    marked = share(
        walk.model, walk.positions, replace(dynamics, moments=wrong, foot_known=foot_known),
        height=1.75,
    )  # fmt: skip
    leg, whole = marked.legs["right"], found.legs["right"]
    for values in (leg.activation, leg.force, leg.moments, leg.contact.hip, leg.contact.medial):
        assert np.isnan(values[unknown]).all()
        assert np.isfinite(values[~unknown]).all()
    np.testing.assert_array_equal(leg.length, whole.length)
    # Rates next to the gap are one-sided.
    away = np.ones_like(unknown)
    away[16:39] = False
    np.testing.assert_allclose(leg.contact.hip[away], whole.contact.hip[away], atol=2.0)
    np.testing.assert_array_equal(marked.legs["left"].contact.hip, found.legs["left"].contact.hip)
    assert np.isfinite(leg.reserve_share()).all()
    (remark,) = (each for each in marked.remarks() if "not known" in each)
    assert f"{walk.time[20]:.2f} to {walk.time[34]:.2f} s" in remark
    drawn = draw(marked, "right", draws=2)
    assert np.isnan(drawn.hip[:, unknown]).all()
    assert np.isfinite(drawn.hip[:, ~unknown]).all()


def test_a_leg_whose_forces_are_never_known_is_refused(walk, dynamics):
    never = np.stack([np.ones(len(walk.time), dtype=bool), np.zeros(len(walk.time), bool)], axis=1)
    with pytest.raises(RecordError, match="left foot"):
        share(walk.model, walk.positions, replace(dynamics, foot_known=never), height=1.75)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"criterion": "effort"}, "squares"),
        ({"strength": {"calf": 0.5}}, "calf"),
        ({"height": 175.0}, "175"),
    ],
)
def test_what_is_not_known_is_refused(walk, dynamics, options, message):
    with pytest.raises(ModelError, match=message):
        share(walk.model, walk.positions, dynamics, **{"height": 1.75, **options})


def test_what_a_reader_must_know_is_remarked(walk, dynamics, found):
    assert not [
        message for message in found.remarks() if "no muscle" in message and "hip" in message
    ]
    weak = share(walk.model, walk.positions, dynamics, height=1.75, strength=0.15)
    message = " ".join(weak.remarks())
    assert "right ankle angle" in message
    assert "Nm" in message
    assert "soleus" in message


def test_a_pose_that_no_path_reaches_is_refused(walk, dynamics):
    bent = walk.positions.copy()
    bent[10:20, 6 + ACTUATED.index("knee_angle_l")] = np.radians(130.0)
    with pytest.raises(RecordError, match=r"knee_angle of the left leg is 13\d deg"):
        share(walk.model, bent, dynamics, height=1.75)


def test_a_knee_further_inside_loads_its_outer_half(walk, dynamics):
    """By the load's arm: force across the shift, over the distance of the plateaus."""
    inside = 0.01
    in_line, shifted = (
        share(
            walk.model, walk.positions, dynamics, height=1.75, sides=("right",),
            knees={"right": aside},
        ).legs["right"]
        for aside in (0.0, -inside)
    )  # fmt: skip
    np.testing.assert_array_equal(in_line.contact.compression, shifted.contact.compression)
    np.testing.assert_array_equal(in_line.activation, shifted.activation)
    kept = ~(in_line.contact.lifted | shifted.contact.lifted)
    kept &= in_line.contact.compression > 500.0
    assert kept.sum() > 10
    force = shifted.loads.force[:, JOINTS.index("knee")]
    # About the axis forward of the tibia, into which the femur's turns with the knee.
    turned = np.einsum(
        "tji,tj->ti",
        tibia_axes(shifted.loads.angles[:, KNEE]),
        np.cross([0.0, 0.0, inside], force),
    )
    expected = turned[:, 0] / (KNEE_CONTACT.plateaus * shifted.muscles.sizes.tibia)
    gained = shifted.contact.lateral - in_line.contact.lateral
    np.testing.assert_allclose(gained[kept], expected[kept], atol=1e-6)
    assert gained[kept & (force[:, 1] < -300.0)].min() > 0.0


def test_where_no_marker_shows_the_knee_the_usual_place_counts(walk, dynamics):
    given = {"height": 1.75, "sides": ("left",)}
    unseen, usual = (
        share(walk.model, walk.positions, dynamics, knees=knees, **given).legs["left"]
        for knees in (None, {"left": KNEE_CONTACT.aside * sizes(walk.model, "l").tibia})
    )
    np.testing.assert_allclose(unseen.contact.medial, usual.contact.medial, atol=1e-9)


@pytest.mark.parametrize(("side", "out"), [("r", -1.0), ("l", 1.0)])
def test_the_middle_of_a_knee_is_between_its_markers(walk, side, out):
    """On the thigh or the shank; y is to the left."""
    knee = walk.model[f"shank_{side}"].joint_position
    lateral = ModelMarker("a", f"thigh_{side}", knee + np.array([0.0, 0.050 * out, 0.0]))
    medial = ModelMarker("b", f"shank_{side}", np.array([0.0, -0.070 * out, 0.0]))
    assert knee_aside(walk.model, side, [lateral, medial]) == pytest.approx(-0.010)


def test_bands_know_less_of_a_knee_without_markers(found, monkeypatch):
    """And of its halves more than of both together: a plateau errs by itself, too."""
    monkeypatch.setattr(bands, "CRITERIA_OF_BANDS", ("squares",))
    only = {each.name: 0.0 for each in fields(Spreads)} | {"moment_time": 0.1}
    few = replace(
        found,
        time=found.time[::10],
        legs={"right": found.legs["right"].part(np.arange(len(found.time))[::10])},
    )
    seen = replace(few.legs["right"], loads=replace(few.legs["right"].loads, knee_aside=-0.007))
    spreads = Spreads(**only | {"knee": 0.005, "knee_unseen": 0.010})

    def spread(leg):
        drawn = draw(replace(few, legs={"right": leg}), "right", draws=40, spreads=spreads)
        assert np.ptp(drawn.compression, axis=0).max() < 1e-6
        return drawn.medial.std(axis=0).max()

    assert spread(few.legs["right"]) == pytest.approx(2.0 * spread(seen), rel=0.25)


def test_weights_of_contact_are_drawn_only_where_the_cost_is_in_doubt(found, monkeypatch):
    monkeypatch.setattr(bands, "CRITERIA_OF_BANDS", ("contact",))
    rows = np.arange(len(found.time))[::10]
    few = replace(found, time=found.time[rows], legs={"right": found.legs["right"].part(rows)})
    none = {each.name: 0.0 for each in fields(Spreads)} | {"moment_time": 0.1}
    for weights, varies in ((0.0, False), (1.0, True)):
        spreads = Spreads(**none | {"weights": weights})
        drawn = draw(few, "right", draws=4, spreads=spreads)
        assert (np.ptp(drawn.compression, axis=0).max() > 1.0) == varies


def test_every_muscle_is_called_by_its_name_in_words():
    assert tuple(MUSCLES) == table().names


def test_a_moment_that_tilts_the_knee_shifts_the_load_by_its_arm_of_40_millimetres():
    """1000 N and 4 Nm that lifts the inner side, without muscles: 500 N each, and 100 N over."""
    force, moment = np.zeros((2, 1, 4, 3))
    knee = JOINTS.index("knee")
    force[0, knee, 1], moment[0, knee, 0] = -1000.0, 4.0
    nothing = np.zeros((1, 6))
    loads = LegLoads(
        nothing, nothing, np.zeros((1, 6, 3)), np.zeros(3), force, moment, np.zeros(1), 0.0
    )
    paths = Geometry(
        np.zeros((1, 40, 4)), np.zeros((1, 40, 6, 4)), np.zeros((1, 40, 4, 3)),
        np.zeros((1, 40, 3)), np.zeros((1, 6), dtype=bool),
    )  # fmt: skip
    found = contact(loads, paths, np.zeros((1, 40)), BoneSizes(np.ones(4)))
    assert found.compression[0] == pytest.approx(1000.0)
    assert found.medial[0] == pytest.approx(400.0)
    assert found.lateral[0] == pytest.approx(600.0)
    # 100 N outwards act 19 mm above the plateaus: 1.9 Nm, or 47.5 N at 40 mm
    force[0, knee, 2] = 100.0
    pushed = contact(loads, paths, np.zeros((1, 40)), BoneSizes(np.ones(4)))
    assert pushed.lateral[0] == pytest.approx(647.5)
