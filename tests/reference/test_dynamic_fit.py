"""The fitted reference: it obeys Newton's laws, stands on its feet and stays near the record.

The peer is DART: what forces and moments the motion needs is asked of the loader's skeleton.
"""

from dataclasses import replace

import numpy as np
import pytest
from reference_figures import figures, inference_figures, of_s05, same
from scipy.spatial.transform import Rotation
from simulation_fixtures import DartPeer, mirror_image, symmetric, task_of_subject

from gaitval.configuration import ContactSettings
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, SIDES
from gaitval.gait.accuracy import RecordAccuracy
from gaitval.gait.record import HARMONICS, periodic_through
from gaitval.model.body import SEGMENTS
from gaitval.model.rotations import pelvis_angles
from gaitval.model.tree import segment_frames, tree_arrays
from gaitval.walk.contact.law import contact_law
from gaitval.walk.reference.dynamic_fit import (
    DYNAMIC_FIT,
    Accuracy,
    _series,
    consistent_reference,
    fit_problem,
)
from gaitval.walk.reference.dynamic_fit import fitted as fit_of
from gaitval.walk.reference.hip_moments import HIP_SIGNS, about_record
from gaitval.walk.reference.motion import build_reference, side_phase
from gaitval.walk.reference.walking_laws import FOOT, FOOT_NUMBERS, POWER, walking_laws
from gaitval.walk.simulation.walker import Trajectory, Walker

GRAVITY = 9.81


MISSED = {"S01": 0.10}
"""Nm/kg. A known miss of the limit of 0.08: the residual moment that the fit leaves on the pelvis,
which DART puts on the hip's adduction, peaks at 0.096 in one stance of S01."""

MISSED_FORCE = {("S08", "vertical_l"): 2.6}
"""% of body weight. A known miss of the limit of 2.5: this fit ends at 2.52, one with slightly
other weights in another minimum, at 2.25."""

FITTED = ("S05",)
"""Whose references every run of the tests fits; CI also fits the two that come nearest to limits.
The other seven are fitted where baselines are made."""
PEOPLE = [
    pytest.param(each, marks=() if each in FITTED else pytest.mark.slow)
    for each in (*FITTED, "S01", "S08")
]


@pytest.fixture(
    scope="module",
    params=PEOPLE,
)
def fitted(request):
    """A built-in subject: its model, record and fitted reference."""
    task = task_of_subject(request.param)
    return task.model, task.record, task.reference


def own_phases(record, reference):
    return [np.mod(side_phase(record, side, reference.phase), 1.0) for side in SIDES]


def accelerations(reference):
    """Rates of the velocities (N, 31), by sixth-order central differences over the cycle."""
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    v = reference.velocities
    rates = sum(w * (np.roll(v, -n, 0) - np.roll(v, n, 0)) for n, w in weights.items())
    return rates * len(v) / reference.stride_time


def needed_forces(model, reference, rows, folder):
    """Generalised forces (len(rows), 31) that the motion needs without any ground, from DART."""
    peer = DartPeer(model, folder)
    second = accelerations(reference)
    found = []
    for t in rows:
        peer.set(reference.positions[t], reference.velocities[t])
        found.append(peer.mass_matrix() @ second[t] + peer.bias_forces())
    return np.array(found), peer


def test_the_centre_of_mass_moves_as_the_forces_say(fitted):
    """Newton: mass times acceleration is ground reaction and weight, to 1 % of the body weight
    root mean square. (OpenSim's checklist and Hicks et al. 2015 ask for 5 % of the peak force.)"""
    _, _, reference = fitted
    places = reference.centre_of_mass.copy()
    places[:, 0] -= reference.speed * reference.stride_time * reference.phase
    k = 2 * np.pi * np.fft.rfftfreq(len(places), 1 / len(places))[:, None] / reference.stride_time
    acceleration = np.fft.irfft(-(k**2) * np.fft.rfft(places, axis=0), len(places), axis=0)
    force = reference.ground_reaction.sum(axis=1) - [0.0, 0.0, 1.0]
    residual = force - acceleration / GRAVITY
    assert np.sqrt((residual**2).mean(axis=0)).max() < 0.01


def test_the_forces_carry_one_body_weight_on_average_and_push_nowhere(fitted):
    _, _, reference = fitted
    mean = reference.ground_reaction.sum(axis=1).mean(axis=0)
    np.testing.assert_allclose(mean, [0.0, 0.0, 1.0], atol=0.003)


def test_in_single_support_the_moments_are_those_that_dart_finds(fitted, tmp_path, request):
    """On one foot the root's six equations determine the ground reaction entirely: its force is
    the reference's, it acts on the sole, and with it the joints need the reference's moments."""
    model, record, reference = fitted
    weight = model.mass * GRAVITY
    own = own_phases(record, reference)
    tree = tree_arrays(model)
    for i, side in enumerate(SIDES):
        # Grid points of the fit where this foot stands alone.
        grid = np.round(
            np.arange(DYNAMIC_FIT.instants) * len(reference.phase) / DYNAMIC_FIT.instants
        ).astype(int)
        other = own[1 - i] > record.stance_fraction[SIDES[1 - i]] + 0.03
        rows = [t for t in grid if 0.15 < own[i][t] < 0.45 and other[t] and own[1 - i][t] < 0.97]
        assert len(rows) > 15
        needed, peer = needed_forces(model, reference, rows, tmp_path)
        frames = segment_frames(model, reference.positions[rows])
        for row, t in enumerate(rows):
            # The smooth contact law drags a foot that swings near the ground by a few newtons.
            swing = f"foot_{SIDES[1 - i][0]}"
            place = frames[row, SEGMENTS.index(swing), :3, 3] * [1.0, 1.0, 0.0]
            drag = weight * reference.ground_reaction[t, 1 - i]
            needed[row] -= peer_jacobian(peer, reference, t, swing, place)[:3].T @ drag
            force = needed[row, 3:6]
            np.testing.assert_allclose(force / weight, reference.ground_reaction[t, i], atol=0.03)
            moment = needed[row, :3]  # about the pelvis's origin
            origin = reference.positions[t, 3:6]
            # The point on the ground about which the moment has no horizontal part.
            arm_z = -origin[2]
            x = origin[0] + (arm_z * force[0] - moment[1]) / force[2]
            y = origin[1] + (moment[0] + arm_z * force[1]) / force[2]
            pressure = np.array([x, y, 0.0])
            sole = np.array(
                [
                    frames[row, tree.sphere_segment[n]] @ [*tree.sphere_position[n], 1.0]
                    for n in range(6 * i, 6 * i + 6)
                ]
            )[:, :2]
            assert (pressure[:2] > sole.min(axis=0) - 0.03).all()
            assert (pressure[:2] < sole.max(axis=0) + 0.03).all()
            jacobian = peer_jacobian(peer, reference, t, f"foot_{side[0]}", pressure)
            arm = pressure - origin
            free = moment - np.cross(arm, force)
            joint = needed[row] - jacobian[:3].T @ force - jacobian[3:].T @ free
            differences = (joint[6:] - reference.moments[t]) / model.mass
            places = [
                ACTUATED.index(f"{name}_{leg}")
                for leg in "rl"
                for name in ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle")
            ]
            person = request.node.callspec.params["fitted"]
            assert np.abs(differences[places]).max() < MISSED.get(person, 0.08)


def peer_jacobian(peer, reference, t, segment, place):
    """(6, 31): of the velocity of the foot's point now at `place`, and of the foot's turning."""
    peer.set(reference.positions[t], reference.velocities[t])
    linear = peer.point_jacobian(segment, place)
    body = peer.body(segment)
    angular = peer.skeleton.getAngularJacobian(body)[:, peer.order]
    return np.vstack([linear, angular])


def departures(model, record, reference):
    """RMS departures from the record: angles in degrees, moments Nm/kg, forces body weights."""
    seen = np.rad2deg(pelvis_angles(Rotation.from_rotvec(reference.positions[:, :3]).as_matrix()))
    found = {}
    for i, side in enumerate(SIDES):
        own = side_phase(record, side, reference.phase)
        for name in ("hip_flexion", "knee_angle", "ankle_angle", "hip_adduction", "hip_rotation"):
            key = f"{name}_{side[0]}"
            angle = np.rad2deg(reference.positions[:, COORDINATES.index(key)])
            found["angle", key] = angle - np.rad2deg(record.angles[key](own))
        for column, name in enumerate(("tilt", "list", "rotation")):
            sign = 1.0 if name == "tilt" or side == "right" else -1.0
            recorded = np.rad2deg(record.angles[f"pelvis_{name}_{side[0]}"](own))
            found["angle", f"pelvis_{name}_{side[0]}"] = sign * seen[:, column] - recorded
        for name in ("hip_flexion", "knee_angle", "ankle_angle"):
            key = f"{name}_{side[0]}"
            moment = reference.moments[:, ACTUATED.index(key)] / model.mass
            vertical = reference.ground_reaction[:, i, 2] * GRAVITY
            moment = about_record(moment, name, reference.hip_centre[i], vertical)
            found["moment", key] = moment - record.moments[key](own)
        force = reference.ground_reaction[:, i] - record.ground_reaction(side, np.mod(own, 1.0))
        for column, name in enumerate(("forward", "sideways", "vertical")):
            found["force", f"{name}_{side[0]}"] = 100 * force[:, column]
    return {key: float(np.sqrt(np.mean(value**2))) for key, value in found.items()}


def walked(task, start, seconds):
    """Vertical forces (T, 2), body weights, of a walker that starts on the reference and follows it
    without a policy, and those of the reference at the same phases."""
    walker, reference = Walker(task), task.reference
    row = round(start * len(reference.phase))
    position = reference.positions[row].copy()
    walker.reset(position, reference.velocities[row], start)
    actions = round(seconds / walker.action_seconds)
    trajectory = Trajectory(actions * walker.steps_per_action)
    for _ in range(actions):
        walker.step(np.zeros(25), np.zeros(6), trajectory)
    closed = np.concatenate([reference.ground_reaction[..., 2]] * 2)
    places = np.arange(len(closed)) / len(reference.phase)
    expected = [np.interp(trajectory.phase % 1.0, places, closed[:, side]) for side in (0, 1)]
    return trajectory.feet[:, :, 2] / walker.weight, np.stack(expected, axis=1)


@pytest.mark.parametrize("name", PEOPLE)
@pytest.mark.parametrize("start", [0.9, 0.4])
def test_a_body_on_it_carries_itself_without_a_policy(name, start):
    """Through a heel strike and the loading of each foot, for a quarter of a cycle, with forces
    within 4 % of body weight root mean square; later the unstable walk drifts away from it. What
    remains is the simulation's step and the lag of its friction."""
    task = task_of_subject(name)
    force, expected = walked(task, start, 0.25 * task.reference.stride_time)
    assert np.sqrt(((force - expected) ** 2).mean(axis=0)).max() < 0.04


def test_it_stays_within_the_aims_of_the_project(fitted, request):
    """Goals and limits of the walks bound what they imitate. Adduction of the hip gives way to its
    moment, where they contradict each other; the correction of the walk takes it back within 3°.
    Its rotation gives way to the foot on the ground."""
    limits = {"angle": 3.0, "moment": 0.15}
    forces = {"forward": 1.5, "sideways": 1.2, "vertical": 2.5}
    for (kind, name), value in departures(*fitted).items():
        limit = limits[kind] if kind != "force" else forces[name[:-2]]
        if kind == "angle" and name.startswith(("hip_adduction", "hip_rotation")):
            limit = 5.0  # of the walks
        limit = MISSED_FORCE.get((request.node.callspec.params["fitted"], name), limit)
        assert value < limit, (kind, name, value)


@pytest.mark.slow
def test_the_foot_on_the_ground_does_not_slide(fitted):
    """In the flat phase a foot drifts less than OpenSim's checklist allows a marker: 2 cm root
    mean square and 4 cm at most."""
    model, record, reference = fitted
    frames = segment_frames(model, reference.positions)
    for i, side in enumerate(SIDES):
        ankle = frames[:, SEGMENTS.index(f"foot_{side[0]}"), :3, 3].copy()
        own = own_phases(record, reference)[i]
        ankle[:, 0] -= reference.speed * reference.stride_time * (reference.phase - own)
        flat = (own > 0.15) & (own < 0.40)
        drift = ankle[flat] - ankle[flat].mean(axis=0)
        assert np.abs(drift).max() < 0.04
        assert np.sqrt((drift**2).sum(axis=1).mean()) < 0.02


def test_a_flat_foot_turns_on_the_ground_as_the_recorded_one(fitted):
    """The model's leg turns about its axis at the hip alone. With hips held to the recorded
    rotation within a degree, feet of S05 turned by 3.7 and 4.6 degrees; as recorded by 2.8."""
    model, record, reference = fitted
    frames = segment_frames(model, reference.positions)
    for i, side in enumerate(SIDES):
        forward = frames[:, SEGMENTS.index(f"foot_{side[0]}"), :2, 0]
        own = own_phases(record, reference)[i]
        flat = (own > 0.12) & (own < 0.42)
        recorded = record.angles[f"foot_progression_{side[0]}"](own[flat])
        turned = np.ptp(np.arctan2(forward[flat, 1], forward[flat, 0]))
        # Recorded feet of the ten turn by 0.4 to 5 degrees.
        assert np.rad2deg(turned) < max(2.0, np.rad2deg(np.ptp(recorded))) + 1.0, side


def test_the_swinging_foot_clears_the_ground_and_the_standing_one_touches_it(fitted):
    model, record, reference = fitted
    tree, contact = tree_arrays(model), ContactSettings()
    k = 0.5 * contact.stiffness ** (2 / 3)
    law = 4 / 3 * k * np.sqrt(tree.sphere_radius[0] * k)
    deepest = (model.mass * GRAVITY / law) ** (2 / 3)
    frames = segment_frames(model, reference.positions)[:, tree.sphere_segment]
    centres = np.einsum("tkij,kj->tki", frames[..., :3, :3], tree.sphere_position)
    soles = centres[..., 2] + frames[..., 2, 3] - tree.sphere_radius
    for i, side in enumerate(SIDES):
        own = own_phases(record, reference)[i]
        lowest = soles[:, 6 * i : 6 * i + 6].min(axis=1)
        stance = record.stance_fraction[side]
        assert lowest[(own > stance + 0.08) & (own < 0.92)].min() > -0.002
        standing = (own > 0.08) & (own < stance - 0.08)
        assert (lowest[standing] < 0.001).all()
        # A sphere with a whole body weight on it sinks the deepest.
        assert (lowest[standing] > -deepest).all()


def test_velocities_are_the_rates_of_the_positions(fitted):
    _, _, reference = fitted
    positions = reference.positions.copy()
    positions[:, 3] -= reference.speed * reference.stride_time * reference.phase
    weights = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
    rates = sum(
        w * (np.roll(positions, -n, 0) - np.roll(positions, n, 0)) for n, w in weights.items()
    )
    rates *= len(positions) / reference.stride_time
    rates[:, 3] += reference.speed
    np.testing.assert_allclose(reference.velocities[:, 3:], rates[:, 3:], atol=1e-5)


@pytest.mark.slow
def test_a_symmetric_person_gets_a_symmetric_reference(task):
    """To the accuracy at which the search stops: 1e-3 of the sum of squares."""
    model, record = symmetric(task.model, task.record)
    reference = consistent_reference(record, model)
    half = len(reference.phase) // 2
    positions = reference.positions.copy()
    positions[:, 3] -= reference.speed * reference.stride_time * reference.phase
    later = np.roll(positions, -half, axis=0)
    assert np.abs(later - mirror_image(positions)).max() < 1e-3


@pytest.mark.slow  # two fits
def test_a_stiffer_ground_carries_the_feet_higher(task):
    soft = consistent_reference(task.record, task.model, ContactSettings(stiffness=1e6))
    stiff = consistent_reference(task.record, task.model, ContactSettings(stiffness=1e7))
    assert 0.001 < (stiff.positions[:, 5] - soft.positions[:, 5]).mean() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("fitted", PEOPLE[:2], indirect=True)  # two more fits each
def test_a_hip_centre_that_the_laboratory_has_elsewhere_is_found(fitted):
    """Moments of the right leg as if its hip centre were 12 mm further back and 8 mm further
    outward: the fit finds most of that (its prior is 20 mm about the model's), on that side alone,
    and moves less else than without the unknown."""
    model, record, reference = fitted
    phase = np.arange(400) / 400
    vertical = record.ground_reaction("right", phase)[:, 2] * STANDARD_GRAVITY
    moved = np.array([-0.012, 0.008])
    moments = dict(record.moments)
    for name in HIP_SIGNS:
        about = about_record(moments[f"{name}_r"](phase), name, moved, vertical)
        moments[f"{name}_r"] = periodic_through(about, HARMONICS.harmonics_cap)
    there = consistent_reference(replace(record, moments=moments), model)
    found = there.hip_centre - reference.hip_centre
    assert found[0, 0] == pytest.approx(moved[0], rel=0.25)
    assert 0.3 * moved[1] < found[0, 1] < moved[1]
    assert np.abs(found[1]).max() < 0.001
    fixed = RecordAccuracy(hip_centre=0.0)
    without = consistent_reference(replace(record, moments=moments), model, accuracy=fixed)
    assert np.abs(without.hip_centre).max() < 1e-6

    def change(other):
        return np.abs(other.positions - reference.positions)[:, 6:18].mean()

    assert change(there) < change(without)


def test_the_series_rates_are_their_derivatives():
    """Of a function of the phase, by time: against complex exponentials."""
    phase, time = np.linspace(0.0, 1.0, 23), 1.3
    values, rates, second = _series(phase, time)
    harmonics = (values.shape[1] - 1) // 2
    rate = 2j * np.pi * np.arange(harmonics + 1) / time
    wave = np.exp(np.outer(phase * time, rate))
    for found, factor in ((values, 1.0), (rates, rate), (second, rate**2)):
        expected = wave * factor
        np.testing.assert_allclose(found[:, : harmonics + 1], expected.real, atol=1e-9)
        np.testing.assert_allclose(found[:, harmonics + 1 :], expected.imag[:, 1:], atol=1e-9)


@pytest.mark.slow
def test_a_foot_swings_from_after_its_toe_off_until_before_its_heel_strike():
    task = task_of_subject("S05")
    problem = fit_problem(
        task.reference, task.record, task.model, ContactSettings(), Accuracy(), shift_sd=0.0
    )
    for i, side in enumerate(SIDES):
        own = np.mod(
            np.arange(DYNAMIC_FIT.instants) / DYNAMIC_FIT.instants
            - (task.record.left_phase if i else 0.0),
            1.0,
        )
        toe_off = task.record.stance_fraction[side]
        expected = (own > toe_off + 0.04) & (own < 0.96)
        np.testing.assert_array_equal(problem.swinging[:, i], expected)


@pytest.fixture(scope="module")
def problem_of_s05():
    record, model, built = of_s05()
    problem = fit_problem(built, record, model, ContactSettings(), Accuracy(), shift_sd=0.0)
    return problem, record, model


@pytest.mark.parametrize("i", [0, 1])
def test_toes_are_expected_to_resist_as_peoples_when_the_heel_rises(problem_of_s05, i):
    problem, record, model = problem_of_s05
    own = np.mod(
        side_phase(record, SIDES[i], np.arange(DYNAMIC_FIT.instants) / DYNAMIC_FIT.instants), 1.0
    )
    toe_off = record.stance_fraction[SIDES[i]]
    moment = problem.target[:, COORDINATES.index(f"mtp_angle_{SIDES[i][0]}")] / model.mass
    assert moment.min() == pytest.approx(-0.13)
    # "at pre-swing" (Kim et al. 2012): in the last third of stance; none before the heel rises
    assert 0.67 * toe_off < own[moment.argmin()] < toe_off
    assert np.abs(moment[(own < 0.2) | (own > toe_off + 0.02)]).max() < 0.01


@pytest.mark.parametrize("i", [0, 1])
def test_a_turning_foot_weighs_the_same_whatever_it_carries(problem_of_s05, i):
    """Friction's moment is in proportion to the load: so is the twist of one weight. A foot that
    lands or leaves may slide."""
    problem, _, model = problem_of_s05
    load = problem.target[:, FOOT + FOOT_NUMBERS * i + 2] / (model.mass * GRAVITY)
    weight = problem.weight[:, FOOT + FOOT_NUMBERS * i + 7]
    loaded = load > 0.3
    np.testing.assert_allclose(np.ptp((weight * load)[loaded]), 0.0, atol=1e-12)
    assert load[loaded].max() > 2.0 * load[loaded].min()
    assert not weight[~loaded].any()


def motion_of(problem):
    return np.hstack(problem.path)


def test_twist_is_the_free_moment_where_friction_grows_with_slip(problem_of_s05):
    """Friction that needs a slip of 100 m/s is -(μ / vt + viscous) f v at every sphere, and so is
    its moment about the centre of pressure."""
    problem, _, model = problem_of_s05
    contact = ContactSettings(transition_velocity=100.0)
    out = walking_laws(tree_arrays(model), contact_law(contact, 0.8), motion_of(problem))
    for place in (FOOT, FOOT + FOOT_NUMBERS):
        x, y, z, mx, my, mz = out[:, place : place + 6].T
        free = mz - (-my * y - mx * x) * z / (z**2 + 20.0**2)
        slope = 0.8 / contact.transition_velocity + contact.viscous_friction
        assert np.abs(free).max() > 1.0
        # the wrench has its centre of pressure on the ground, millimetres above where spheres touch
        np.testing.assert_allclose(free, -slope * out[:, place + 7], atol=5e-3 * np.ptp(free))


def test_twist_is_the_same_whatever_friction_gives_for_it(problem_of_s05):
    problem, _, model = problem_of_s05
    twists = []
    for friction in (0.05, 0.8):
        law = contact_law(ContactSettings(), friction)
        out = walking_laws(tree_arrays(model), law, motion_of(problem))
        twists.append(out[:, [FOOT + 7, FOOT + FOOT_NUMBERS + 7]])
    np.testing.assert_array_equal(*twists)


@pytest.mark.parametrize("i", [0, 1])
def test_toes_of_a_flat_foot_lie_on_the_ground(problem_of_s05, i):
    """To 5 degrees; to 10 while the heel is up and in swing."""
    problem, record, _ = problem_of_s05
    toes = COORDINATES.index(f"mtp_angle_{SIDES[i][0]}")
    own = np.mod(
        side_phase(record, SIDES[i], np.arange(DYNAMIC_FIT.instants) / DYNAMIC_FIT.instants).round(
            9
        ),
        1.0,
    )
    held = 1.0 / (problem.penalty[toes, : DYNAMIC_FIT.instants, 0] * np.sqrt(DYNAMIC_FIT.instants))
    toe_off = record.stance_fraction[SIDES[i]]
    np.testing.assert_allclose(np.rad2deg(held[(own > 0.02) & (own < 0.4 * toe_off)]), 5.0)
    np.testing.assert_allclose(np.rad2deg(held[own > 0.9 * toe_off]), 10.0)
    knee = problem.penalty[COORDINATES.index("knee_angle_r"), : DYNAMIC_FIT.instants, 0]
    assert np.ptp(knee) == 0.0


@pytest.mark.parametrize("times", [0.3, 1.0, 0.0])
def test_power_of_the_ankles_is_held_to_a_share_of_it(problem_of_s05, times):
    """Whoever pushes a third as much is held to a third of it, and nobody to nothing."""
    _, record, model = problem_of_s05
    moments = dict(record.moments)
    for name in ("ankle_angle_r", "ankle_angle_l"):
        moment = moments[name](np.arange(128) / 128)
        moments[name] = periodic_through(times * moment, HARMONICS.harmonics_cap)
    weaker = replace(record, moments=moments)
    built = build_reference(weaker, model)
    problem = fit_problem(built, weaker, model, ContactSettings(), Accuracy(), shift_sd=0.0)
    power = np.sqrt(np.mean(problem.target[:, POWER] ** 2))
    held = 1.0 / (problem.weight[:, POWER] * np.sqrt(DYNAMIC_FIT.instants))
    np.testing.assert_allclose(held, 0.11 * max(power, 0.03 * model.mass))
    assert (power > 0.1 * model.mass) == (times > 0.0)


def test_no_number_of_a_fit_changes():
    """Of the walker's reference and of the identification's; a change that is meant is written by
    `tests/support/reference_figures.py`."""
    record, model, built = of_s05()
    same(figures(fit_of(built, record, model, ContactSettings())), "fitted")
    same(inference_figures(record, model, built), "inference")
