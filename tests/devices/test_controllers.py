import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from gaitval.apps.devices.walking import DeviceWalker, with_devices
from gaitval.coordinates import COORDINATES
from gaitval.model.devices.controllers import (
    GravityCompensation,
    Impedance,
    Measured,
    PhaseSpline,
    ProportionalMoment,
    VirtualConstraint,
)
from gaitval.model.devices.device import CARRIED, Device
from gaitval.model.tree import segment_frames

MOTOR = {
    "torque": 200.0,
    "speed": 10.0,
    "power": 500.0,
    "bandwidth": 15.0,
    "delay": 0.0,
    "noise": 0.0,
}
CARRIER = {"share": 1.0, "mass": 3.85, "arm": 0.25}


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
        "inclination": 0.0,
        "forward": 1.0,
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
        VirtualConstraint(angles=(0.1, 0.2, 0.3, 0.2), stiffness=10.0, damping=0.0),
        Impedance(stages=({"until": 1.0, "stiffness": 1.0, "damping": 0.0, "rest": 1.0},)),
    ],
)
def test_no_torque_while_the_phase_is_not_known(controller):
    assert controller.torque(measured(phase=math.nan)) == 0.0


def test_proportional_helps_in_its_direction_only():
    helper = ProportionalMoment(gain=0.3, direction="down")
    assert helper.torque(measured(moment=-80.0)) == pytest.approx(-24.0)
    assert helper.torque(measured(moment=80.0)) == 0.0
    assert ProportionalMoment(gain=0.3).torque(measured(moment=80.0)) == pytest.approx(24.0)


def test_gravity_compensation_lifts_what_is_inclined_forward_in_swing():
    carrier = GravityCompensation(share=0.5, mass=10.0, arm=0.4)
    lifting = carrier.torque(measured(loaded=False, inclination=0.5))
    assert lifting == pytest.approx(0.5 * 10.0 * 9.80665 * 0.4 * math.sin(0.5))
    assert carrier.torque(measured(loaded=True, inclination=0.5)) == 0.0


@pytest.mark.parametrize("joint", CARRIED)
@pytest.mark.parametrize("knee", [5.0, 60.0])
def test_gravity_compensation_pushes_as_the_weight_below_pulls(person, joint, knee):
    """On both sides: against the derivative of the body's potential energy by the joint."""
    hinge = {"joint": joint, "motor": MOTOR, "controller": {"kind": "gravity", **CARRIER}}
    device = Device(name="carrier", source="here", hinges=[hinge])
    walker = DeviceWalker(with_devices(person.task, (device,)))
    pose = np.zeros(len(COORDINATES))
    for side in "rl":
        pose[COORDINATES.index(f"hip_flexion_{side}")] = np.radians(40.0)
        pose[COORDINATES.index(f"knee_angle_{side}")] = np.radians(knee)
    walker.reset(pose, np.zeros(len(COORDINATES)), 0.0)
    for fitted, state in zip(walker.fitted, walker.hinges, strict=True):
        seen = walker._measured(fitted, walker._estimates[id(fitted.device), fitted.side], state)
        small = 1e-6 * (np.arange(len(COORDINATES)) == COORDINATES.index(fitted.name))
        energy = [_potential_energy(person.task.model, pose + step) for step in (small, -small)]
        needed = (energy[0] - energy[1]) / 2e-6
        torque = fitted.controller.torque(replace(seen, loaded=False))
        assert torque * needed > 0.0, fitted.name


def test_gravity_compensation_at_a_foot_is_refused():
    hinge = {"joint": "ankle_angle", "motor": MOTOR, "controller": {"kind": "gravity", **CARRIER}}
    with pytest.raises(ValidationError, match="what hangs below hip_flexion or knee_angle"):
        Device(name="carrier", source="here", hinges=[hinge])


def _potential_energy(model, pose):
    frames = segment_frames(model, pose[None])[0]
    return sum(
        each.mass * 9.80665 * (frame[:3, 3] + frame[:3, :3] @ each.centre_of_mass)[2]
        for each, frame in zip(model.segments, frames, strict=True)
    )


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


def test_a_virtual_constraint_is_met_without_torque():
    angles = tuple(0.3 * np.sin(2 * np.pi * np.arange(40) / 40))
    hold = VirtualConstraint(angles=angles, stiffness=100.0, damping=2.0)
    for phase in (0.1, 0.77):
        angle, rate = 0.3 * np.sin(2 * np.pi * phase), 0.3 * 2 * np.pi * np.cos(2 * np.pi * phase)
        on_it = measured(phase=phase, angle=angle, speed=rate / 1.2, stride_time=1.2)
        assert hold.torque(on_it) == pytest.approx(0.0, abs=0.05)
        behind = measured(phase=phase, angle=angle - 0.1, speed=rate / 1.2, stride_time=1.2)
        assert hold.torque(behind) == pytest.approx(10.0, abs=0.05)
