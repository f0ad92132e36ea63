"""Trunk and arms of a fit: the upper body's inertia, and what bends it by a given moment."""

from dataclasses import replace

import numpy as np
import pytest

from gaitval.coordinates import COORDINATES
from gaitval.model.body import SEGMENTS
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject
from gaitval.walk.reference.dynamic_fit import INFERENCE, Accuracy, _penalties
from gaitval.walk.reference.motion import MOTION
from gaitval.walk.reference.steady_trunk import (
    FROM_HZ,
    SHAKING,
    steady_amplitude,
    upper_body_inertia,
)


@pytest.fixture(scope="module")
def model():
    return scale_subject(load_subject("S02")).model


def _heavier(model, name, mass):
    """The body with a point mass added at the centre of a segment."""
    found = [replace(s, mass=s.mass + mass) if s.name == name else s for s in model.segments]
    return replace(model, segments=tuple(found))


def test_the_upper_body_is_all_that_hangs_on_the_back_and_no_leg(model):
    before = upper_body_inertia(model)
    for name in SEGMENTS:
        added = upper_body_inertia(_heavier(model, name, 1.0)) - before
        above = name.startswith(("torso", "upper_arm", "forearm"))
        assert (added > 1e-3) == above, name
    # The trunk's own, about its lower end, by hand.
    torso = model["torso"]
    added = upper_body_inertia(_heavier(model, "torso", 1.0)) - before
    assert added == pytest.approx(torso.centre_of_mass[0] ** 2 + torso.centre_of_mass[2] ** 2)


def test_an_amplitude_is_what_the_moment_bends(model):
    """A swing a sin(w t) of the inertia I takes I w² a. Slow ones are free."""
    rates = 2 * np.pi * FROM_HZ * np.arange(1.0, 4.0)
    assert np.isinf(steady_amplitude(model, 0.99 * rates[:1], 0.05)).all()
    moments = upper_body_inertia(model) * rates**2 * steady_amplitude(model, rates, 0.05)
    np.testing.assert_allclose(moments, 0.05 * model.mass)


@pytest.mark.parametrize("stride", [0.8, 1.0, 1.3])
def test_only_fast_turns_of_pelvis_trunk_and_arms_are_held(model, stride):
    """Fast in Hz, whatever harmonic of a stride that is."""
    series = np.zeros((4, 1 + 2 * MOTION.harmonics))
    rates = 2 * np.pi / stride * np.arange(1.0, MOTION.harmonics + 1)

    def roughness(accuracy):
        steady = steady_amplitude(model, rates, accuracy.convention.steady_moment)
        departure, flat = np.zeros((4, len(COORDINATES))), np.zeros((4, 2), dtype=bool)
        found, _ = _penalties(accuracy, departure, series, steady, flat)
        return found[:, len(series) :].diagonal(axis1=1, axis2=2)

    held, free = roughness(Accuracy()), roughness(INFERENCE)
    fast = rates >= 2 * np.pi * FROM_HZ
    columns = np.concatenate([[False], np.tile(fast, 2)])
    for k, name in enumerate(COORDINATES):
        if k in SHAKING:
            wanted = 1.0 / steady_amplitude(model, rates, 0.05)[fast]
            assert (held[k, columns] >= np.tile(wanted, 2) * (1 - 1e-12)).all(), name
        # of an identification nothing is held closer than it was calibrated with
        assert np.isfinite(free[k]).all(), name
    leg = COORDINATES.index("knee_angle_r")
    assert held[leg].max() < held[COORDINATES.index("lumbar_rotation")].max()
