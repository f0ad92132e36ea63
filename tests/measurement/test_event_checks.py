"""Events of the forces that stray from those of the markers."""

import numpy as np
import pytest

from gaitval.findings import look
from gaitval.findings.clocks import Contacts, while_seen
from gaitval.mocap.recording import Event, FootForces, Recording


def contacts(forces, shown):
    return look(Contacts(forces, shown)).flags


def walk():
    """Ten strikes, right and left in turn, 0.55 s apart."""
    found = []
    for number in range(10):
        side = "right" if number % 2 == 0 else "left"
        found.append(Event(0.3 + 0.55 * number, side, "heel_strike"))
    return tuple(found)


def carried(late=0.0, known=True):
    """Forces of `walk`: each foot for 0.7 s, the fourth strike of all too late."""
    rate, strikes = 1000.0, walk()
    force = np.zeros((6000, 2, 3))
    for number, strike in enumerate(strikes):
        begin = strike.time + (late if number == 3 else 0.0)
        column = 0 if strike.side == "right" else 1
        force[round(begin * rate) : round((strike.time + 0.7) * rate), column, 2] = 700.0
    valid = np.full((6000, 2), known)
    return FootForces(rate, 0.0, force, np.zeros_like(force), np.zeros_like(force), valid)


@pytest.mark.parametrize("usual", [0.0, -0.03])
def test_a_strike_that_strays(usual):
    shown = [Event(e.time - usual, e.side, e.kind) for e in walk()]
    assert not list(contacts(carried(0.03), shown))
    (warning,) = contacts(carried(0.06), shown)
    assert (warning.where, warning.value) == ("left foot", pytest.approx(0.06, abs=0.002))
    assert "heel strikes is at 2.01 s, 60 ms later" in warning.message
    assert not list(contacts(carried(0.06, known=False), shown))


def test_an_event_beside_a_hidden_marker_is_none_of_the_markers():
    """A gap that ends in stance looks like a strike there."""
    markers = np.zeros((600, 4, 3))
    markers[190:240, 0] = np.nan  # 1.9 to 2.4 s
    names = ("RHEE", "RTOE", "LHEE", "LTOE")
    recording = Recording("walk", "project", names, markers, 100.0)
    landmarks = dict(zip(("R.Heel", "R.Toe", "L.Heel", "L.Toe"), names, strict=True))
    shown = [*while_seen(walk(), recording, landmarks)]
    hidden = [e.time for e in walk() if e not in shown]
    assert hidden == [e.time for e in walk() if e.side == "right" and 1.8 < e.time < 2.5]
