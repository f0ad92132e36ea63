"""What people did, as data, and how a walker is judged by it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from walking_pendulum import DT, HEIGHT, RATE, STEP_TIME, pendulum

from gaitval.apps.balance.compared import Pushes, on_ground, published, sideways
from gaitval.apps.balance.disturb import Slip
from gaitval.apps.balance.experiment import DisturbedWalk
from gaitval.metrics.foot_placement import linear_map

EACH = round(STEP_TIME / DT)
ROWS = {each.quantity: each for each in published() if each.quantity}


def test_every_row_says_of_whom_what_where():
    assert len(published()) > 30
    for row in published():
        assert row.kind in ("push", "slip", "trip", "step")
        assert row.of, row.words
        assert row.source, row.locator
        for low, high in ((row.low, row.value), (row.value, row.high), (row.low, row.high)):
            assert low is None or high is None or low <= high
    compared = [each for each in published() if each.quantity]
    assert len({each.quantity for each in compared}) == len(compared)
    assert sum(each.kind == "push" for each in compared) >= 12
    assert sum(each.kind != "push" for each in compared) >= 6


@pytest.mark.parametrize(
    ("name", "value", "sign", "inside"),
    [
        ("foot_shift", 0.15, True, True),
        ("foot_shift", 0.25, True, False),
        ("foot_shift", -0.1, False, True),
        ("gain_length_on_side", -0.5, True, None),
        ("gain_length_on_side", 0.5, False, None),
        ("steps_to_recover", 0.0, True, True),
        ("steps_to_recover", 3.0, True, False),
        ("steps_to_recover", None, False, False),
        ("ankle_delay", 0.06, True, False),
        ("offset_change", 0.3, True, False),
        ("trip_early_elevates", 0.1, True, None),
    ],
)
def test_a_value_is_as_peoples_by_sign_and_bounds(name, value, sign, inside):
    assert ROWS[name].right_sign(value) is sign or ROWS[name].right_sign(value) == sign
    assert ROWS[name].inside(value) is inside


@pytest.fixture(scope="module")
def kept():
    """Pushes of a pendulum that keeps its feet's distance."""
    plain = pendulum(steps=10)
    walks = [
        pendulum([(4 * EACH + row, 0.0, left)], steps=10)
        for row in range(4, EACH, 12)
        for left in (0.15, -0.15)
    ]
    return Pushes.of(plain, walks, DT)


def test_a_pendulum_is_as_its_own_guess_and_unlike_who_does_not_react(kept):
    found = sideways(kept, None, linear_map(kept.walks))
    change = found["offset_change"]
    assert change.walker == pytest.approx(0.0, abs=1e-9)
    assert change.pendulum == pytest.approx(0.0, abs=1e-3)
    assert change.nothing > 0.05
    assert found["foot_shift"].walker == pytest.approx(found["foot_shift"].pendulum, rel=0.01)
    assert found["steps_to_recover"].walker == 0.0
    # from the middle of stance the foot follows pelvis and velocity as it falls
    grow = math.exp(0.5 * RATE * STEP_TIME)
    assert found["gain_sideways"].pendulum == pytest.approx(grow, rel=0.01)
    assert found["gain_velocity_sideways"].pendulum == pytest.approx(grow / RATE, rel=0.01)
    assert found["step_width_by_outward"].walker > 0.0
    assert kept.plain.pendulum == HEIGHT


def test_every_named_quantity_of_pushes_is_measured(kept):
    named = {name for name, row in ROWS.items() if row.kind == "push"}
    assert named == set(sideways(kept, None, None))


def test_a_body_that_rolls_towards_an_outward_push_has_the_published_sign(kept):
    def rolling(walk, rate):
        spin = np.zeros_like(walk.spin)
        spin[walk.onset :, 0] = rate  # to the right
        return replace(walk, spin=spin)

    values = []
    for walk in kept.walks:
        left = walk.velocity[walk.onset + 1, 1] > kept.plain.velocity[walk.onset + 1, 1]
        one = Pushes(kept.plain, (rolling(walk, -2.0 if left else 2.0),), ((),))
        values.append(sideways(one, None, None)["spin_by_outward"].walker)
    outward = [each for each in values if each is not None]  # None of a push inward
    assert 0 < len(outward) < len(values)
    assert outward == pytest.approx([2.0] * len(outward))


def test_a_hip_that_rises_in_a_slip_does_not_drop(kept):
    def slipped(drop):
        pelvis = kept.plain.pelvis.copy()
        pelvis[4 * EACH + 5 :, 2] -= drop
        walk, plain = (replace(kept.plain, onset=4 * EACH, pelvis=each)
                       for each in (pelvis, kept.plain.pelvis))  # fmt: skip
        still = np.zeros(len(plain.time))
        slip = DisturbedWalk(Slip("right"), walk, plain, plain.steps[0], 0.1, 0.1, None, still,
                             still)  # fmt: skip
        return on_ground([slip])["slip_hip_drop"].walker

    assert slipped(0.02) == pytest.approx(0.02)
    assert slipped(-0.02) == pytest.approx(-0.02)


def test_falls_at_once_are_not_compared(kept):
    fallen = pendulum([(4 * EACH, 0.0, 1.0)], steps=5)
    fallen = type(fallen)(**{**vars(fallen), "fell": True})
    assert Pushes.of(kept.plain, [fallen], DT).walks == ()
    assert np.isfinite(kept.plain.extrapolated).all()
