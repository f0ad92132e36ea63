"""Laws of load transfer, of `experiments/load_transfer.py`."""

import numpy as np
import pytest

from experiments.load_transfer import PHASES, divided, errors, forces_of, learned, smooth, transfers
from gaitval.arrays import Array
from gaitval.datasets.subject_file import load_subject
from gaitval.gait.record import GaitRecord


@pytest.fixture(scope="module")
def record() -> GaitRecord:
    return load_subject("S05").record()


def test_the_smooth_transition_begins_at_the_force_and_ends_without() -> None:
    begin, middle, end = smooth(np.array([0.0, 0.5, 1.0]))
    assert begin == pytest.approx(1.0)
    assert middle[2] == pytest.approx(np.exp(-1.0))
    assert end == pytest.approx(0.0, abs=4e-4)


def test_both_feet_together_have_the_total(record: GaitRecord) -> None:
    def total(phases: Array) -> Array:
        return np.asarray(forces_of(record, phases).sum(axis=0))

    for law in (smooth, learned([record])):
        found = divided(record, total, law)
        assert found.sum(axis=0) == pytest.approx(total(PHASES))


def test_what_is_learned_of_the_record_itself_gives_it_back(record: GaitRecord) -> None:
    def total(phases: Array) -> Array:
        return np.asarray(forces_of(record, phases).sum(axis=0))

    vertical = errors(divided(record, total, learned([record])), record)[1, 2]
    assert vertical < 1.5  # both sides have one law, so what differs between them is left
    assert errors(divided(record, total, smooth), record)[1, 2] > 2.0 * vertical


def test_a_foot_is_behind_from_the_other_ones_strike_to_its_own_end(record: GaitRecord) -> None:
    first, second = transfers(record)
    assert (first.behind, second.behind) == (1, 0)
    assert second.begin == record.left_phase
    assert second.end == record.stance_fraction["right"]
    assert 0.08 < first.end < 0.16
