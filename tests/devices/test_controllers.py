import math

import numpy as np
import pytest
from pydantic import ValidationError

from gaitval.model.devices.controllers import Impedance, Measured, PhaseSpline


def measured(**given):
    values = {
        "time": 1.0,
        "side": "right",
        "phase": 0.3,
        "stride_time": 1.0,
        "loaded": True,
        "angle": 0.0,
        "speed": 0.0,
        "torque": 0.0,
        "moment": 0.0,
        "mass": 70.0,
    }
    return Measured(**(values | given))


def test_a_bump_has_its_peak_its_ends_and_no_steps():
    spline = PhaseSpline(bumps=((0.5, 0.3, 0.1, -40.0),))
    phases = np.linspace(0.0, 1.0, 2001)
    torque = np.array([spline.torque(measured(phase=p)) for p in phases])
    assert torque.min() == pytest.approx(-40.0)
    assert phases[torque.argmin()] == pytest.approx(0.5)
    assert np.abs(torque[(phases < 0.2) | (phases > 0.6)]).max() == 0.0
    # The steepest slope of the cubic is 1.5 times the mean one, 40 Nm in 0.1.
    assert np.abs(np.diff(torque)).max() <= 1.5 * 40.0 / 0.1 * 0.0005 * 1.001
    assert spline.largest == 40.0
    # Half of the peak in the middle of the long rise and of the short fall.
    for phase in (0.35, 0.55):
        assert spline.torque(measured(phase=phase)) == pytest.approx(-20.0)


def test_a_bump_may_run_over_the_end_of_the_cycle():
    spline = PhaseSpline(bumps=((0.95, 0.1, 0.2, 10.0),))
    assert spline.torque(measured(phase=0.05)) == pytest.approx(5.0)


@pytest.mark.parametrize(("rise", "fall"), [(0.6, 0.2), (0.2, 0.6), (0.6, 0.6)])
def test_a_rise_or_fall_longer_than_half_a_cycle_has_no_steps(rise, fall):
    spline = PhaseSpline(bumps=((0.3, rise, fall, 10.0),))
    torque = np.array([spline.torque(measured(phase=p)) for p in np.linspace(0.0, 2.0, 4001) % 1.0])
    assert torque.max() >= 10.0
    steepest = 1.5 * 10.0 * (1.0 / rise + 1.0 / fall)
    assert np.abs(np.diff(torque)).max() <= steepest * 0.0005


@pytest.mark.parametrize(
    "controller",
    [
        PhaseSpline(bumps=((0.5, 0.3, 0.1, -40.0),)),
        Impedance(stages=({"until": 1.0, "stiffness": 1.0, "damping": 0.0, "rest": 1.0},)),
    ],
)
def test_no_torque_while_the_phase_is_not_known(controller):
    assert controller.torque(measured(phase=math.nan)) == 0.0


def test_impedance_is_that_of_the_stage():
    stages = (
        {"until": 0.4, "stiffness": 30.0, "damping": 0.5, "rest": 0.1},
        {"until": 1.0, "stiffness": 5.0, "damping": 0.0, "rest": 0.0},
    )
    controller = Impedance(stages=stages)
    at = controller.torque(measured(phase=0.2, angle=0.3, speed=2.0))
    assert at == pytest.approx(30.0 * -0.2 - 1.0)
    assert controller.torque(measured(phase=0.9, angle=0.3)) == pytest.approx(-1.5)
    # the phase waits at 1 for a strike that is late
    assert controller.torque(measured(phase=1.0, angle=0.3)) == pytest.approx(-1.5)
    with pytest.raises(ValidationError, match="end with 1"):
        Impedance(stages=stages[:1])
