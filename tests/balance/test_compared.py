"""What people did, as data, and how a walker is judged by it."""

import numpy as np
import pytest
from walking_pendulum import DT, HEIGHT, STEP_TIME, pendulum

from gaitval.apps.balance.compared import Pushes, published, sideways

EACH = round(STEP_TIME / DT)
ROWS = {each.quantity: each for each in published()}


@pytest.mark.parametrize(
    ("name", "value", "inside"),
    [
        ("foot_shift", 0.15, True),
        ("foot_shift", 0.25, False),
        ("foot_shift", -0.1, False),
        ("step_delay", 0.3, True),
        ("step_delay", 0.1, False),
        ("steps_to_recover", 0.0, True),
        ("steps_to_recover", 3.0, False),
        ("steps_to_recover", None, False),
        ("ankle_delay", 0.06, False),
        ("offset_change", 0.3, False),
    ],
)
def test_a_value_is_as_peoples_within_the_published_bounds(name, value, inside):
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
    found = sideways(kept)
    change = found["offset_change"]
    assert change.walker == pytest.approx(0.0, abs=1e-9)
    assert change.pendulum == pytest.approx(0.0, abs=1e-3)
    assert change.nothing > 0.05
    assert found["foot_shift"].walker == pytest.approx(found["foot_shift"].pendulum, rel=0.01)
    assert found["steps_to_recover"].walker == 0.0
    assert found.keys() == ROWS.keys()
    assert kept.plain.pendulum == HEIGHT


def test_falls_at_once_are_not_compared(kept):
    fallen = pendulum([(4 * EACH, 0.0, 1.0)], steps=5)
    fallen = type(fallen)(**{**vars(fallen), "fell": True})
    assert Pushes.of(kept.plain, [fallen], DT).walks == ()
    assert np.isfinite(kept.plain.extrapolated).all()
