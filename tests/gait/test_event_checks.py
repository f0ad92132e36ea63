"""Events that a file stores are compared with those found; contradictions are doubted."""

import numpy as np
import pytest

from gaitval.gait.event_checks import event_doubts, stored_events
from gaitval.mocap.recording import Event

OTHER = {"right": "left", "left": "right"}


def walk(late=0.0, jitter=(0.0,), swapped=False):
    """Ten strikes, right and left in turn, 0.55 s apart."""
    found = []
    for number in range(10):
        side = "right" if number % 2 == 0 else "left"
        time = 0.3 + 0.55 * number + late + jitter[number % len(jitter)]
        found.append(Event(time, OTHER[side] if swapped else side, "heel_strike"))
    return tuple(found)


def test_differences_are_found_less_stored():
    (compared,) = stored_events(walk(), walk(late=0.02, jitter=(0.01, -0.01)))
    assert (compared.stored, compared.matched, compared.other_foot) == (10, 10, 0)
    assert compared.mean_s == pytest.approx(0.02)
    assert compared.sd_s == pytest.approx(0.01 * np.sqrt(10 / 9))
    assert "10 of the file's 10 heel strikes were found, +20 ms" in str(compared)
    assert not list(event_doubts([compared]))


def test_a_file_without_events():
    assert stored_events((), walk()) == ()


def test_events_of_the_wrong_foot():
    compared = stored_events(walk(swapped=True), walk())
    assert compared[0].other_foot == 10
    (doubt,) = event_doubts(compared)
    assert "right and left are exchanged" in doubt.message


def test_events_on_another_clock():
    (doubt,) = event_doubts(stored_events(walk(late=-0.1), walk()))
    assert doubt.value == pytest.approx(0.1)


def test_an_event_that_was_not_found_does_not_match():
    (compared,) = stored_events(walk(), walk()[:4])
    assert (compared.matched, compared.other_foot) == (4, 0)
