"""Steps from forces."""

import numpy as np

from gaitval.metrics.balance_walk import steps_of


def test_steps_are_heel_strikes_of_both_feet_in_order():
    vertical = np.zeros((1000, 2))
    for first in (0, 500):
        vertical[first + 100 : first + 400, 0] = 700.0
        vertical[max(0, first - 150) : first + 150, 1] = 700.0
        vertical[first + 350 : first + 500, 1] = 700.0
    found = steps_of(vertical, step=0.002, threshold=20.0)
    assert [(each.side, each.strike) for each in found] == [
        ("right", 100), ("left", 350), ("right", 600), ("left", 850)
    ]  # fmt: skip
    assert [each.lift for each in found] == [0, 150, 400, 650]
    assert [each.column for each in found] == [0, 1, 0, 1]
