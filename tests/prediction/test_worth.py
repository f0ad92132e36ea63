"""What insoles would be worth to an estimate."""

import numpy as np
import pytest

from gaitval.subjects.prediction.worth import MissedPerson, left_by_insoles


@pytest.mark.parametrize(("arm_is_missed", "least", "most"), [(False, 0.0, 0.3), (True, 0.8, 1.0)])
def test_insoles_say_what_is_missed_by_the_force_and_not_by_its_arm(arm_is_missed, least, most):
    rng, percent = np.random.default_rng(84), np.arange(100) / 100
    stance = np.where(percent < 0.6, np.sin(np.pi * percent / 0.6), 0.0)
    people = []
    for _ in range(6):
        vertical = stance * (1.0 + 0.2 * rng.normal(size=(2, 1)))
        apart = 0.6 * rng.normal(size=(2, 6, 1)) * arm_is_missed
        arms = 0.1 * (1.0 + apart)
        truth = np.concatenate([arms * vertical[:, None], vertical[:, None]], axis=1)
        guess = np.concatenate([np.tile(0.1 * stance, (2, 6, 1)), np.tile(stance, (2, 1, 1))], 1)
        people.append(MissedPerson(truth - guess, truth))
    left = left_by_insoles(people)
    assert left[-1] == 0.0
    assert (left[:-1] >= least).all()
    assert (left[:-1] <= most).all()
