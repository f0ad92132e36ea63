"""Curves of a walk against those of the record, and the hip centres that moments are about."""

from dataclasses import fields, replace

import numpy as np
import pytest
from synthetic_walk import MASS, perfect_walk, sharp_filter, synthetic_record

from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, mirrored
from gaitval.gait.cycle_curves import Curves, recorded_curves
from gaitval.gait.record import LowPass
from gaitval.metrics.comparison import compare_curve, hip_centres, low_pass_of, simulated_curves
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.epsilon import epsilon, mean_of
from gaitval.metrics.walk_quantities import found_quantities
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.hip_moments import about_record
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.skeleton import HumanSkeleton

RECORD = synthetic_record()
RECORDED = recorded_curves(RECORD)
WALK = perfect_walk(RECORD)
KINDS = tuple(field.name for field in fields(Curves))


def _simulated(walk: Rollout) -> Curves:
    return simulated_curves(
        walk, find_cycles(walk, sharp_filter()), mass=MASS, filters=LowPass(100.0, 100.0)
    )


def _rmse(walk: Rollout, kind: str) -> dict[str, float]:
    simulated, recorded = getattr(_simulated(walk), kind), getattr(RECORDED, kind)
    return {name: compare_curve(simulated[name], recorded[name]).rmse for name in recorded}


def test_moments_and_forces_pass_the_filter_that_the_record_passed():
    known = replace(RECORD, low_pass=LowPass(moments_hz=3.0, forces_hz=20.0))
    assert low_pass_of(known, 10.0) == LowPass(3.0, 20.0)
    assert low_pass_of(RECORD, 10.0) == LowPass(10.0, 10.0)
    cycles = find_cycles(WALK, sharp_filter())
    sharp, slow = (
        simulated_curves(WALK, cycles, mass=MASS, filters=LowPass(moments, 100.0))
        for moments in (100.0, 1.0)
    )
    for name, force in sharp.forces.items():
        np.testing.assert_array_equal(slow.forces[name], force)
    assert np.ptp(slow.moments["ankle_angle_r"]) < 0.9 * np.ptp(sharp.moments["ankle_angle_r"])


def test_a_body_weight_is_that_of_the_simulation():
    body = HumanSkeleton(scale_subject(load_subject("S05")).model, physics_step=0.001)
    np.testing.assert_array_equal(body.world.getGravity(), [0.0, 0.0, -GRAVITY])


def test_a_perfect_walk_has_no_error():
    assert max(_rmse(WALK, "angles").values()) < 1e-9
    # the filter leaves 1e-6 of the third harmonic, and rounds the 26 N step of a heel strike
    assert max(_rmse(WALK, "moments").values()) < 1e-5
    assert max(_rmse(WALK, "forces").values()) < 0.005


@pytest.mark.parametrize("side", ["r", "l"])
@pytest.mark.parametrize("name", ["hip_flexion", "knee_angle", "subtalar_angle"])
def test_an_offset_of_three_degrees_is_an_error_of_three_degrees(name, side):
    offset = np.deg2rad(-3.0)
    positions = WALK.positions.copy()
    positions[:, COORDINATES.index(f"{name}_{side}")] += offset
    simulated = _simulated(replace(WALK, positions=positions)).angles[f"{name}_{side}"]
    error = compare_curve(simulated, RECORDED.angles[f"{name}_{side}"])
    assert np.rad2deg(error.rmse) == pytest.approx(3.0)
    assert np.rad2deg(error.bias) == pytest.approx(-3.0)
    assert np.rad2deg(error.peak_error) == pytest.approx(-3.0)
    assert error.correlation == pytest.approx(1.0)
    others = _rmse(replace(WALK, positions=positions), "angles")
    assert sum(value > 1e-9 for value in others.values()) == 1


def test_exchanged_sides_are_detected_in_every_kind_of_curve():
    columns = [COORDINATES.index(mirrored(name)) for name in COORDINATES]
    joints = [ACTUATED.index(mirrored(name)) for name in ACTUATED]
    swapped = replace(
        WALK,
        positions=WALK.positions[:, columns],
        moments=WALK.moments[:, joints],
        ground_reaction=WALK.ground_reaction[:, ::-1] * [1.0, -1.0, 1.0],
    )
    joint_errors = {
        name: value for name, value in _rmse(swapped, "angles").items() if "pelvis" not in name
    }
    assert min(joint_errors.values()) > np.deg2rad(5)
    assert min(_rmse(swapped, "moments").values()) > 0.1


@pytest.mark.parametrize(("column", "side"), [(0, "r"), (1, "l")])
def test_a_hip_moment_is_about_the_record_s_centre_of_its_own_side(column, side):
    """A hip 2 cm further forward and 1 cm further outward than the model's: the vertical force of
    that foot, N/kg, has a lever of 2 cm more for flexion and 1 cm less for adduction."""
    centre = np.zeros((2, 2))
    centre[column] = 0.02, 0.01
    plain, moved = _simulated(WALK), _simulated(replace(WALK, hip_centre=centre))
    vertical = GRAVITY * plain.forces[f"vertical_{side}"]
    levers = {f"hip_flexion_{side}": 0.02, f"hip_adduction_{side}": -0.01}
    for name, moment in plain.moments.items():
        added = levers[name] * vertical if name in levers else 0.0
        np.testing.assert_allclose(moved.moments[name], moment + added, atol=1e-9)


@pytest.mark.parametrize("column", [0, 1])
def test_medial_force_is_positive_towards_the_midline_on_both_feet(column):
    ground = np.zeros_like(WALK.ground_reaction)
    ground[..., 2] = WALK.ground_reaction[..., 2]
    ground[:, column, 1] = MASS * GRAVITY * (0.1 if column == 0 else -0.1)
    simulated = _simulated(replace(WALK, ground_reaction=ground)).forces
    inner = simulated[f"medial_{'rl'[column]}"][:, 20:80]
    np.testing.assert_allclose(inner, 0.1, atol=1e-6)


@pytest.mark.parametrize(
    ("axis", "angle", "name"),
    [
        ((0.0, 1.0, 0.0), "pelvis_tilt", "r"),
        ((-1.0, 0.0, 0.0), "pelvis_list", "r"),  # right side up: backwards about x
        ((1.0, 0.0, 0.0), "pelvis_list", "l"),
        ((0.0, 0.0, 1.0), "pelvis_rotation", "r"),  # right side forward: to the left about z
        ((0.0, 0.0, -1.0), "pelvis_rotation", "l"),
    ],
)
def test_a_turned_pelvis_has_the_signs_of_the_record(axis, angle, name):
    positions = WALK.positions.copy()
    positions[:, :3] = 0.1 * np.array(axis)
    simulated = _simulated(replace(WALK, positions=positions)).angles
    np.testing.assert_allclose(simulated[f"{angle}_{name}"], 0.1, atol=1e-12)


def test_a_constant_curve_has_no_correlation():
    assert compare_curve(np.ones((3, 101)), np.linspace(0, 1, 101)).correlation is None


def test_without_cycles_there_is_nothing_to_compare():
    walk = perfect_walk(RECORD, cycles=0.4)
    simulated = _simulated(walk)
    for kind in KINDS:
        for name, curve in getattr(simulated, kind).items():
            assert curve.shape == (0, 101)
            assert compare_curve(curve, getattr(RECORDED, kind)[name]) is None
    assert epsilon(simulated, RECORDED) is None


def test_epsilon_of_a_perfect_walk_is_almost_zero_and_its_parts_add_up():
    found = epsilon(_simulated(WALK), RECORDED)
    assert found.total < 0.02  # the filtered step of the heel strikes
    assert found.total == pytest.approx(found.angles + found.moments + found.forces)


def test_epsilon_of_lying_still_is_the_record_itself():
    nothing = Curves(
        *({name: np.zeros((2, 101)) for name in getattr(RECORDED, kind)} for kind in KINDS)
    )
    found = epsilon(nothing, RECORDED)
    # the mean of a norm is at most its root mean square
    for part in (found.angles, found.moments, found.forces):
        assert 0.6 < part <= 1.0


def test_epsilon_of_one_offset_follows_the_equation():
    simulated = Curves(
        *(
            {name: np.tile(curve, (3, 1)) for name, curve in getattr(RECORDED, kind).items()}
            for kind in KINDS
        )
    )
    simulated.angles["knee_angle_r"] = simulated.angles["knee_angle_r"] + 0.3
    simulated.angles["knee_angle_l"] = simulated.angles["knee_angle_l"] - 0.4
    found = epsilon(simulated, RECORDED)
    assert found.angles_rad == pytest.approx(0.5)
    assert found.moments == found.forces == 0.0


def test_the_mean_epsilon_of_walks_is_none_if_one_of_them_fell():
    found = epsilon(_simulated(WALK), RECORDED)
    worse = found.model_copy(update={"angles": found.angles + 0.2, "total": found.total + 0.2})
    mean = mean_of([found, worse])
    assert mean.total == pytest.approx(found.total + 0.1)
    assert mean.angles + mean.moments + mean.forces == pytest.approx(mean.total)
    assert mean_of([found, None]) is None


def test_epsilon_pairs_the_cycles_of_feet_with_one_cycle_less():
    simulated = _simulated(WALK)
    full = epsilon(simulated, RECORDED)
    for name in list(simulated.angles):
        if name.endswith("_l"):
            simulated.angles[name] = simulated.angles[name][:-1]
    assert epsilon(simulated, RECORDED).angles == pytest.approx(full.angles, abs=1e-9)


@pytest.mark.parametrize(("side", "outwards"), [("right", -1.0), ("left", 1.0)])
def test_recorded_curves_go_over_each_sides_own_cycle(side, outwards):
    """At 100 % the force is again that of the heel strike; medial is towards the other foot."""
    end = side[0]
    for percent in (0, 37, 100):
        for name in ("knee_angle", "pelvis_list"):
            curve = RECORDED.angles[f"{name}_{end}"]
            assert len(curve) == 101
            assert curve[percent] == pytest.approx(RECORD.angles[f"{name}_{end}"](percent / 100))
        moment = RECORD.moments[f"hip_flexion_{end}"](percent / 100)
        assert RECORDED.moments[f"hip_flexion_{end}"][percent] == pytest.approx(moment)
        forward, left, up = RECORD.ground_reaction(side, np.array([percent / 100 % 1.0]))[0]
        found = [
            RECORDED.forces[f"{name}_{end}"][percent] for name in ("forward", "medial", "vertical")
        ]
        np.testing.assert_allclose(found, [forward, -outwards * left, up], atol=1e-12)


ROUND = np.linspace(0.0, 1.0, 101)


def curves(offset):
    """Made-up curves; hip flexion moments off by an offset times the vertical force."""
    vertical = np.clip(np.sin(np.pi * ROUND / 0.6), 0.0, None)
    moments = {f"hip_adduction_{side}": -0.5 * vertical for side in "rl"}
    moments |= {f"hip_flexion_{side}": np.cos(ROUND) + offset * GRAVITY * vertical for side in "rl"}
    return Curves({}, moments, {f"vertical_{side}": vertical for side in "rl"})


def test_the_error_about_the_model_s_hip_is_that_of_the_lever():
    """Walked moments that equal the record's about its centre, 2 cm in front, miss it by 2 cm times
    the force about the model's."""
    places = np.array([[0.02, 0.0], [0.01, 0.0]])
    found = hip_centres(places, curves(0.0), curves(0.0))
    assert found is not None
    force = curves(0.0).forces["vertical_r"] * GRAVITY
    own = found.right.rmse_about_model
    assert own["hip_flexion"] == pytest.approx(0.02 * np.sqrt(np.mean(force**2)))
    assert own["hip_adduction"] == pytest.approx(0.0, abs=1e-12)
    assert found.left.rmse_about_model["hip_flexion"] == pytest.approx(0.5 * own["hip_flexion"])
    assert (found.right.forward, found.left.outward) == (0.02, 0.0)


def test_a_walk_about_the_model_s_own_hips_has_nothing_to_say():
    assert hip_centres(np.zeros((2, 2)), curves(0.0), curves(0.0)) is None


def test_a_walk_without_a_cycle_has_nothing_to_say():
    assert hip_centres(np.full((2, 2), 0.01), Curves({}, {}, {}), curves(0.0)) is None


def test_moments_about_the_record_s_centres_go_back_to_those_about_the_model_s():
    """Both joints' axes, on both sides: what was moved there is moved back."""
    places, own = np.array([[0.02, -0.015], [-0.01, 0.03]]), curves(0.01)
    walked = Curves({}, dict(own.moments), own.forces)
    for place, side in zip(places, "rl", strict=True):
        for name in ("hip_flexion", "hip_adduction"):
            force = own.forces[f"vertical_{side}"] * GRAVITY
            moved = about_record(own.moments[f"{name}_{side}"], name, place, force)
            assert np.abs(moved - own.moments[f"{name}_{side}"]).max() > 0.05
            walked.moments[f"{name}_{side}"] = moved
    found = hip_centres(places, walked, own)
    for one in (found.right, found.left):
        assert list(one.rmse_about_model.values()) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_what_a_walk_costs_is_about_its_own_hips():
    """Whose hips the record has elsewhere costs as much as without a record; joint power is like
    the record's, about its hips, on both sides."""
    places, own = np.array([[0.02, -0.015], [-0.01, 0.03]]), curves(0.01)
    bent = 0.4 * np.cos(2.0 * np.pi * ROUND)
    others = ("knee_angle", "ankle_angle")
    angles = {f"{name}_{side}": bent for name in ("hip_flexion", *others) for side in "rl"}
    still = {f"{name}_{side}": 0.0 * bent for name in others for side in "rl"}
    own = Curves(angles, own.moments | still, own.forces)
    there = dict(own.moments)
    for place, side in zip(places, "rl", strict=True):
        name, force = f"hip_flexion_{side}", own.forces[f"vertical_{side}"] * GRAVITY
        there[name] = about_record(there[name], "hip_flexion", place, force)
    walked, times = Curves(angles, there, own.forces), {"r": 1.0, "l": 1.0}
    alone = found_quantities(own, times, speed=1.2)
    moved = found_quantities(walked, times, speed=1.2, hip_centre=places)
    forgotten = found_quantities(walked, times, speed=1.2)
    for side in "rl":
        gross = [f["metabolic_joints"].figures["gross"][f"body_{side}"] for f in (alone, moved)]
        assert gross[0] == pytest.approx(gross[1])
        assert forgotten["metabolic_joints"].figures["gross"][f"body_{side}"] != pytest.approx(
            gross[0], rel=1e-3
        )
        hips = [f["power"].curves[f"hip_flexion_{side}"] for f in (alone, moved)]
        assert not np.allclose(*hips, atol=1e-3)
