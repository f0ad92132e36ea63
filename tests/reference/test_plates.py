"""Shifts of force plates, found from the motion."""

import numpy as np
import pytest

from experiments.plate_corrections import (
    CLEAR,
    SCALE_SD,
    SHIFT_SD,
    PlateEvidence,
    common_shift,
    plate_corrections,
    plate_evidence,
)
from gaitval.gait.plate_correction import PlateCorrection, corrected
from gaitval.scaling.scaling import scale_subject
from gaitval.subjects.subject_file import load_subject


def evidence(right, left, sd=0.01, force=1.0):
    return PlateEvidence(force, np.array([right, left]), sd**2 * np.eye(2))


@pytest.mark.parametrize("planted", [(-0.01, 0.025), (0.02, 0.0)])
@pytest.mark.slow  # two fits for each
def test_a_planted_shift_is_found_within_its_standard_deviation(planted):
    """On top of what the record of subject 5 has; less the tenth that prior knowledge takes."""
    subject = load_subject("S05")
    model, record = scale_subject(subject).model, subject.measured()
    before = plate_evidence(record, model)
    worse = corrected(record, PlateCorrection(shift_right=-planted[0], shift_left=-planted[1]))
    after = plate_evidence(worse, model)
    sd = np.sqrt(np.diag(before.covariance))
    assert (np.abs(after.shift - before.shift - planted) < 0.6 * sd).all()
    assert (sd > 0.003).all()
    assert (sd < 0.5 * SHIFT_SD).all()


def test_one_record_alone_says_what_it_says():
    one = evidence(0.02, -0.01)
    shift, covariance = common_shift([one])
    np.testing.assert_allclose(shift, one.shift)
    np.testing.assert_allclose(covariance, one.covariance)


def test_many_records_say_it_more_surely_and_what_was_known_before_counts_once():
    shift, covariance = common_shift([evidence(0.02, -0.01)] * 9)
    own = 1.0 / 0.01**2 - 1.0 / SHIFT_SD**2
    precision = 9 * own + 1.0 / SHIFT_SD**2
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), precision**-0.5)
    np.testing.assert_allclose(shift, np.array([0.02, -0.01]) * 9 / 0.01**2 / precision)


def test_what_is_not_clear_is_left_alone():
    within = 0.9 * CLEAR
    sound = evidence(0.01 * within, 0.0, force=1.0 + within * SCALE_SD)
    assert plate_corrections([sound]) == [None]


def test_a_clear_scale_is_corrected_without_the_shifts_and_the_other_way_round():
    (scaled,) = plate_corrections([evidence(0.0, 0.0, force=0.95)])
    assert scaled is not None
    assert scaled.scale == pytest.approx(1 / 0.95)
    assert scaled.shift == {"right": 0.0, "left": 0.0}
    (shifted,) = plate_corrections([evidence(0.03, 0.0)])
    assert shifted is not None
    assert shifted.scale == 1.0
    assert shifted.shift_right == pytest.approx(0.03)


def test_two_small_shifts_apart_are_clear_by_their_difference():
    assert plate_corrections([evidence(0.018, -0.018)])[0] is not None
    assert plate_corrections([evidence(0.018, 0.018)])[0] is None


@pytest.mark.parametrize(("correlation", "clear"), [(0.9, True), (-0.9, False)])
def test_a_difference_of_the_shifts_is_as_sure_as_their_errors_are_alike(correlation, clear):
    """What is wrong with both plates alike says nothing against their difference."""
    sd = 0.01
    covariance = sd**2 * np.array([[1.0, correlation], [correlation, 1.0]])
    apart = 0.9 * CLEAR * sd * np.array([0.5, -0.5])
    found = plate_corrections([PlateEvidence(1.0, apart, covariance)])
    assert (found[0] is not None) == clear
