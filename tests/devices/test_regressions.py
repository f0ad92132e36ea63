"""Published regressions, on powers whose ratios are known."""

import pytest
from made_curves import made_curves

from gaitval.apps.devices import regressions
from gaitval.apps.devices.regressions import REGRESSIONS, change, powers, predicted_power
from gaitval.apps.devices.study import DeviceOutcome
from gaitval.configuration import Configuration
from gaitval.model.devices.device import shipped_device

COM, JOINT, ANKLE = REGRESSIONS


@pytest.mark.parametrize("sides", [(0.5, 0.1), (0.1, 0.5)])
def test_powers_are_of_both_sides(sides):
    found = powers(made_curves(work=sides, negative=sides, power=sides, stride=2.0), 0.7)
    assert found["centre of mass"] == (0.7, 0.0)
    assert found["joints"] == pytest.approx((3 * 0.6 / 2.0, 3 * 0.6 / 2.0))
    assert found["device at the ankle"] == pytest.approx((0.6, 0.0))


def test_what_the_papers_measured_comes_out_again():
    before = powers(made_curves(), 0.0)
    loaded = powers(made_curves(), 1.40)
    message = change(COM, loaded, before)
    assert message.low == pytest.approx(7.6)
    assert message.high == pytest.approx(1.40 / 0.16)
    assert message.low < message.middle < message.high
    helped = powers(made_curves(power=0.23 / 2), 0.0)
    message = change(ANKLE, helped, before)
    assert message.middle == pytest.approx(-0.45)
    assert message.low < -0.45 - 0.07 < -0.45 + 0.07 < message.high + 0.01


def test_negative_work_costs_a_fifth_of_positive_work():
    before = powers(made_curves(), 0.0)
    more = powers(made_curves(work=0.3), 0.0)
    braked = powers(made_curves(negative=0.2), 0.0)
    assert change(JOINT, more, before).middle == pytest.approx(0.6 / 0.25)
    assert change(JOINT, braked, before).middle == pytest.approx(0.6 / 1.20)
    assert change(JOINT, before, before).middle == 0.0


def test_each_names_paper_and_people():
    for each in REGRESSIONS:
        assert "doi:10." in each.source
        assert each.low <= each.middle <= each.high
        assert each.people


@pytest.mark.parametrize(("name", "message"), [("afo", True), ("below_knee", False)])
def test_what_is_missing_at_a_prosthetic_joint_is_no_work_of_muscles(monkeypatch, name, message):
    monkeypatch.setattr(regressions, "com_work_rate", lambda *_: 0.0)
    outcomes = [
        DeviceOutcome(assumption, None, made_curves(work=work), 20.0, False, None)
        for assumption, work in (("without", 0.1), ("kinematics kept", 1.9), ("learned", 0.2))
    ]
    found = dict(predicted_power(outcomes, [shipped_device(name)], Configuration(), 65.0))
    kept, learned = found[JOINT]
    assert (kept is not None) is message
    assert learned is not None
    assert found[COM][0] is not None
