"""The contact law against its published formula, and its forces against DART's Jacobians."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import expit
from simulation_fixtures import PREDSIM, mirror_image, random_state

from gaitval.configuration import ContactSettings
from gaitval.coordinates import COORDINATES
from gaitval.model.body import SEGMENTS
from gaitval.model.tree import segment_frames, tree_arrays
from gaitval.walk.contact.forces import ground_forces
from gaitval.walk.contact.law import contact_law, sphere_force

R = 0.032
LAW = contact_law(PREDSIM, 0.8)
SMOOTHING, PENETRATION_SLOPE, RATE_SLOPE = 1e-5, 300.0, 50.0  # cf, bd, bv as published


def published(contact: ContactSettings, friction: float, radius: float, height: float, velocity):
    """Serrancolí et al. 2019 and simbody's SmoothSphereHalfSpaceForce, written down anew, with
    expit(2 y) for 1/2 + 1/2 tanh(y), which has no digits left where it is small."""
    x, v = radius - height, -velocity[2]
    k = 0.5 * contact.stiffness ** (2 / 3)
    c = contact.dissipation
    fh = 4 / 3 * k * np.sqrt(radius * k) * np.sqrt(x**2 + SMOOTHING) ** 1.5
    fh *= expit(2 * PENETRATION_SLOPE * x)
    fn = fh * (1 + 1.5 * c * v) * expit(2 * RATE_SLOPE * (v + 2 / (3 * c)))
    vs = np.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + SMOOTHING)
    vt, us, ud = contact.transition_velocity, friction, friction * contact.dynamic_to_static
    ff = fn * (
        min(vs / vt, 1) * (ud + 2 * (us - ud) / (1 + (vs / vt) ** 2))
        + contact.viscous_friction * vs
    )
    return np.array([-ff * velocity[0] / vs, -ff * velocity[1] / vs, fn])


def force(law, height, velocity=(0.0, 0.0, 0.0)):
    out = np.full(3, np.nan)
    sphere_force(law, R, height, np.array(velocity, dtype=float), out)
    return out


def slopes(law, height, velocity=(0.0, 0.0, 0.0), radius=R):
    return sphere_force(law, radius, height, np.array(velocity, dtype=float), np.empty(3))


# ---- One sphere. ----


@settings(derandomize=True, deadline=None)  # the first call compiles
@given(
    depth=st.floats(-0.019, 0.04),
    velocity=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    stiffness=st.floats(1e5, 1e7),
    dissipation=st.floats(0.1, 3.0),
    ratio=st.floats(0.3, 1.0),
    viscous=st.floats(0.0, 1.0),
    friction=st.floats(0.2, 1.2),
)
def test_a_sphere_feels_the_published_force(
    depth, velocity, stiffness, dissipation, ratio, viscous, friction
):
    contact = ContactSettings(
        stiffness=stiffness,
        dissipation=dissipation,
        dynamic_to_static=ratio,
        viscous_friction=viscous,
    )
    seen = force(contact_law(contact, friction), R - depth, velocity)
    expected = published(contact, friction, R, R - depth, velocity)
    np.testing.assert_allclose(seen, expected, rtol=1e-12, atol=1e-12 * abs(expected[2]))


def test_a_deep_sphere_feels_the_hard_hunt_crossley_force():
    """f = 4/3 k sqrt(R k) x^1.5 (1 + 1.5 c v): the smoothing adds 3/4 cf / x² of it."""
    k = 0.5 * LAW.stiffness ** (2 / 3)
    for x in (0.015, 0.02, 0.03):
        for v in (0.0, 0.3, 1.0):
            hard = 4 / 3 * k * np.sqrt(R * k) * x**1.5 * (1 + 1.5 * LAW.dissipation * v)
            seen = force(LAW, R - x, (0.0, 0.0, -v))[2]
            assert 0.0 < seen / hard - 1.0 < SMOOTHING / x**2


def test_the_force_fades_above_the_ground():
    """The smooth form has a ghost of some newtons at the ground and none where it is cut off."""
    heights = R + np.linspace(0.0, 0.0199, 200)
    vertical = [force(LAW, height)[2] for height in heights]
    assert 5.0 < vertical[0] < 10.0
    assert np.all(np.diff(vertical) < 0.0)
    assert vertical[-1] < 0.002  # the step that cutting off makes, N
    np.testing.assert_array_equal(force(LAW, R + 0.0201, (1.0, 1.0, -5.0)), np.zeros(3))


def test_a_foot_that_leaves_is_let_go():
    """fn = fh u (1/2 + 1/2 tanh(bv u / (1.5 c))) with u = 1 + 1.5 c v, which is positive but for
    the smoothing: its minimum over u is -0.2785 (1.5 c) / (2 bv) fh, 0.8 % of fh here."""
    resting = force(LAW, R - 0.01)[2]
    vertical = np.array(
        [force(LAW, R - 0.01, (0.0, 0.0, up))[2] for up in np.linspace(0.0, 3.0, 3001)]
    )
    assert vertical.min() == pytest.approx(
        -0.2785 * 1.5 * LAW.dissipation / (2 * RATE_SLOPE) * resting, rel=1e-3
    )
    assert abs(vertical[-1]) < 1e-9 * resting


@pytest.mark.parametrize("friction", [0.4, 0.8, 1.1])
def test_fast_sliding_meets_the_friction_coefficient_times_the_load(friction):
    """Without viscous friction; cf leaves cf / (2 v²) of it."""
    law = contact_law(ContactSettings(viscous_friction=0.0, dynamic_to_static=1.0), friction)
    for speed in (0.25, 1.0, 5.0):
        x, _, load = force(law, R - 0.01, (speed, 0.0, 0.0))
        assert x == pytest.approx(-friction * load, rel=SMOOTHING / speed**2)


def test_friction_is_static_at_the_transition_and_dynamic_far_beyond_it():
    law = contact_law(ContactSettings(viscous_friction=0.0, dynamic_to_static=0.5), 0.8)

    def coefficient(speed):
        x, _, load = force(law, R - 0.01, (speed, 0.0, 0.0))
        return -x / load

    slow = law.transition_velocity
    assert coefficient(slow) == pytest.approx(0.8, rel=SMOOTHING / slow**2)
    assert coefficient(50.0) == pytest.approx(0.4, rel=1e-3)


def test_viscous_friction_grows_with_the_speed():
    law = contact_law(ContactSettings(viscous_friction=0.5, dynamic_to_static=1.0), 0.8)
    x, _, load = force(law, R - 0.01, (2.0, 0.0, 0.0))
    assert x == pytest.approx(-(0.8 + 0.5 * 2.0) * load, rel=1e-5)


def test_friction_opposes_slip_alike_in_all_directions():
    along = force(LAW, R - 0.01, (0.3, 0.0, 0.1))
    for angle in np.linspace(0.0, 2 * np.pi, 13):
        turn = np.array([np.cos(angle), np.sin(angle)])
        seen = force(LAW, R - 0.01, (*(0.3 * turn), 0.1))
        np.testing.assert_allclose(seen, [*(along[0] * turn), along[2]], atol=1e-10)
    assert along[0] < 0.0


def test_a_resting_sphere_is_not_pushed_sideways():
    np.testing.assert_array_equal(force(LAW, R - 0.01)[:2], [0.0, 0.0])


def test_no_jump_where_the_slip_reaches_the_transition_velocity():
    below, above = (
        force(LAW, R - 0.01, (LAW.transition_velocity * (1 + e), 0.0, 0.0)) for e in (-1e-9, 1e-9)
    )
    np.testing.assert_allclose(below, above, rtol=1e-7)


def test_slopes_are_those_of_the_force_at_rest():
    """Of the normal force in the penetration rate, and of friction in the slip; the smoothing of
    the release is over where a foot rests."""
    normal, friction = slopes(LAW, R - 0.01)
    h = 1e-6
    down, up = (force(LAW, R - 0.01, (0.0, 0.0, v))[2] for v in (-h, h))
    assert normal == pytest.approx((down - up) / (2 * h), rel=1e-5)
    right, left = (force(LAW, R - 0.01, (v, 0.0, 0.0))[0] for v in (h, -h))
    assert friction == pytest.approx((left - right) / (2 * h), rel=1e-5)
    assert slopes(LAW, R + 0.03) == (0.0, 0.0)


# ---- Twelve spheres on two feet. ----

PLAIN = np.zeros(2)


def on_the_ground(task, seed):
    """A random posture whose lowest sphere is 15 mm deep and moves like a foot that strikes."""
    q, qd = random_state(seed)
    q[:3] *= 0.2
    q[6:] *= 0.3
    qd *= 0.3
    soles = [sphere_place(task, q, sphere)[2] - sphere.radius for sphere in task.model.spheres]
    q[5] -= 0.015 + min(soles)
    return q, qd


def sphere_place(task, q, sphere):
    frame = segment_frames(task.model, q[None])[0, SEGMENTS.index(sphere.segment)]
    return (frame @ [*sphere.position, 1.0])[:3]


def ground(task, q, qd, lag=PLAIN, memory=None):
    """Generalised forces, feet and the spheres' forces; the plain law unless there is a lag."""
    generalised, feet = np.zeros(31), np.zeros((2, 6))
    memory = np.zeros((12, 3)) if memory is None else memory.copy()
    ground_forces(tree_arrays(task.model), LAW, q, qd, lag, memory, generalised, feet)
    return generalised, feet, memory


@pytest.mark.parametrize("seed", range(5))
def test_generalised_forces_are_those_of_darts_jacobians(task, peer, seed):
    """Σ Jᵀ f over the spheres, each force at the middle of the overlap, where the slip is
    measured too; the feet's force and moment about the world's origin are the plain sums."""
    q, qd = on_the_ground(task, seed)
    peer.set(q, qd)
    expected, feet, loaded = np.zeros(31), np.zeros((2, 6)), 0
    for sphere in task.model.spheres:
        centre = sphere_place(task, q, sphere)
        depth = sphere.radius - centre[2]
        if depth < -0.02:
            continue
        point = np.array([centre[0], centre[1], -0.5 * depth])
        jacobian = peer.point_jacobian(sphere.segment, point)
        pushed = published(PREDSIM, 0.8, sphere.radius, centre[2], jacobian @ qd)
        expected += jacobian.T @ pushed
        side = 0 if sphere.segment.endswith("_r") else 1
        feet[side] += [*pushed, *np.cross(point, pushed)]
        loaded += 1
    assert loaded >= 1
    seen, seen_feet, _ = ground(task, q, qd)
    scale = np.abs(feet).max()
    np.testing.assert_allclose(seen, expected, atol=1e-11 * scale)
    np.testing.assert_allclose(seen_feet, feet, atol=1e-11 * scale)


def test_forces_are_added_to_what_is_there(task):
    q, qd = on_the_ground(task, 0)
    alone, _, memory = ground(task, q, qd)
    generalised, feet = np.arange(31.0), np.full((2, 6), np.nan)
    ground_forces(tree_arrays(task.model), LAW, q, qd, PLAIN, memory, generalised, feet)
    np.testing.assert_allclose(generalised, alone + np.arange(31.0), atol=1e-9)
    assert np.isfinite(feet).all()


def test_the_pelvis_feels_the_whole_force(task):
    q, qd = on_the_ground(task, 1)
    generalised, feet, _ = ground(task, q, qd)
    total = feet.sum(axis=0)
    np.testing.assert_allclose(generalised[3:6], total[:3], rtol=1e-12)
    moment = total[3:] - np.cross(q[3:6], total[:3])
    np.testing.assert_allclose(generalised[:3], moment, atol=1e-11 * np.abs(total).max())
    above = [COORDINATES.index(name) for name in ("lumbar_bending", "arm_add_l")]
    assert not generalised[above].any()


def test_right_and_left_are_mirror_images(task):
    """Subject 5's scaled model is symmetric: a mirrored state gives mirrored forces."""
    q, qd = on_the_ground(task, 2)
    generalised, feet, _ = ground(task, q, qd)
    other, other_feet, _ = ground(task, mirror_image(q), mirror_image(qd))
    np.testing.assert_allclose(other, mirror_image(generalised), atol=1e-8)
    flip = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    np.testing.assert_allclose(other_feet[::-1], feet * flip, atol=1e-8)
    assert np.abs(feet[0] - feet[1]).max() > 1.0


def test_a_body_in_the_air_is_left_alone(task):
    q, qd = random_state(3)
    q[5] += 5.0
    generalised, feet, _ = ground(task, q, qd)
    assert not generalised.any()
    assert not feet.any()


# ---- Linearly implicit in the velocity. ----


@pytest.mark.parametrize("seed", range(3))
def test_forces_with_a_lag_are_the_stated_mean_of_now_and_before(task, peer, seed):
    """f = (f(v) + a f') / (1 + a), a = lag x the slopes of all spheres of the foot, normal force
    and friction apart; generalised forces and feet are of these forces."""
    q, qd = on_the_ground(task, seed)
    lag = np.array([1e-3, 2e-3])
    before = np.random.default_rng(seed).uniform(-50.0, 50.0, (12, 3))
    _, _, plain = ground(task, q, qd)
    generalised, feet, after = ground(task, q, qd, lag, before)
    peer.set(q, qd)
    slope, expected_forces = np.zeros((2, 2)), np.zeros(31)
    points, sides = [], []
    for sphere in task.model.spheres:
        centre = sphere_place(task, q, sphere)
        point = np.array([centre[0], centre[1], 0.5 * (centre[2] - sphere.radius)])
        jacobian = peer.point_jacobian(sphere.segment, point)
        sides.append(0 if sphere.segment.endswith("_r") else 1)
        slope[sides[-1]] += slopes(LAW, centre[2], jacobian @ qd, sphere.radius)
        points.append((point, jacobian))
    a = (lag[:, None] * slope)[sides]
    weights = a[:, [1, 1, 0]]
    expected = (plain + weights * before) / (1.0 + weights)
    np.testing.assert_allclose(after, expected, atol=1e-9)
    for (_, jacobian), pushed in zip(points, expected, strict=True):
        expected_forces += jacobian.T @ pushed
    np.testing.assert_allclose(generalised, expected_forces, atol=1e-9)
    for side in (0, 1):
        total = sum(f for f, s in zip(expected, sides, strict=True) if s == side)
        np.testing.assert_allclose(feet[side, :3], total, atol=1e-9)


def test_a_constant_force_is_left_as_it_is(task):
    q, qd = on_the_ground(task, 1)
    _, _, plain = ground(task, q, qd)
    lag = np.full(2, 1e-3)
    _, _, same = ground(task, q, qd, lag, plain)
    np.testing.assert_allclose(same, plain, atol=1e-10)
    memory = np.zeros((12, 3))
    for _ in range(200):  # from nothing it is reached too
        _, _, memory = ground(task, q, qd, lag, memory)
    np.testing.assert_allclose(memory, plain, atol=1e-8)


def test_a_foot_in_the_air_forgets_its_force(task):
    q, qd = random_state(3)
    q[5] += 5.0
    _, feet, memory = ground(task, q, qd, np.full(2, 1e-3), np.full((12, 3), 100.0))
    assert not feet.any()
    assert not memory.any()
