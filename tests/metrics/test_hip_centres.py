"""Errors of the hip's moments about the model's own centre."""

import numpy as np
import pytest

from gaitval.constants import GRAVITY
from gaitval.gait.cycle_curves import Curves
from gaitval.metrics.hip_centres import hip_centres
from gaitval.metrics.quantity_results import found_quantities
from gaitval.reference.hip_moments import about_record

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
