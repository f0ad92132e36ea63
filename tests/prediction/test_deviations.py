"""Deviations from what is expected of anybody, and the stored fits of the built-in people."""

import numpy as np
import pytest

from experiments.estimate_fits import whole_numbers
from gaitval.subjects.prediction.deviations import (
    UNIT,
    deviation,
    deviations,
    learned_from,
    stored_fits,
)
from gaitval.subjects.subject_file import builtin_subjects, load_subject


def test_every_trial_of_the_built_in_people_has_a_fit():
    wanted = {
        f"{each.identifier} {name}"
        for each in builtin_subjects()
        for name in (each.trial, *(trial.name for trial in each.trials))
    }
    assert set(stored_fits()) == wanted


def test_two_equal_people_among_equals_do_not_deviate():
    one = learned_from(load_subject("5"), builtin_subjects())[0][:1]
    for person in deviations([one, one, one, one]):
        moved = np.abs(person[0].kinetics).max()
        # but for the asymmetry, which nobody expects
        assert moved < 0.2
        assert np.allclose(person[0].kinetics.sum(axis=0), 0.0, atol=1e-12)
        assert person[0].stride_time == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
def test_the_stored_fits_are_those_of_this_code():
    now = UNIT * np.array(whole_numbers(load_subject("7")), float)
    assert np.abs(now - stored_fits()["S07 T03"]).max() < 0.002


def test_a_wider_step_is_a_share_and_a_wider_pelvis_is_in_metres():
    one = learned_from(load_subject("5"), builtin_subjects())[0][0]
    others = [[one._replace(step_width=0.10, pelvic_width=0.24)]] * 4
    found = deviation(one._replace(step_width=0.12, pelvic_width=0.27), others)
    assert found.step_width == pytest.approx(0.2)
    assert found.pelvic_width == pytest.approx(0.03)
    unknown = deviation(one._replace(step_width=np.nan, pelvic_width=np.nan), others)
    assert (unknown.step_width, unknown.pelvic_width) == (0.0, 0.0)
