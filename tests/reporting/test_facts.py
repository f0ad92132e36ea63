"""Figures of a run that the report says in words."""

import pytest

from gaitval.metrics.recorded import consistency, recorded_part
from gaitval.reporting.facts import measured_force
from gaitval.subjects.subject_file import load_subject


@pytest.mark.parametrize("name", ["S01", "S05", "S10"])
def test_the_force_that_is_called_measured_is_that_before_the_correction(name: str) -> None:
    """The correction makes the mean one body weight, so that afterwards it says nothing."""
    subject = load_subject(name)
    corrected = recorded_part(subject.record(), subject)
    before = consistency(subject.measured()).mean_force.vertical
    assert corrected.consistency.mean_force.vertical == pytest.approx(1.0, abs=2e-3)
    assert measured_force(corrected) == pytest.approx(before, abs=2e-3)
    assert before < 0.985
