"""Events that a file stores are compared with those found; contradictions are doubted."""

import numpy as np
import pytest

from gaitval.findings import look
from gaitval.findings.clocks import Contacts, while_seen
from gaitval.gait.stored_events import event_warnings, stored_events
from gaitval.mocap.recording import Event, FootForces, Recording


def contacts(forces, shown):
    return look(Contacts(forces, shown)).flags


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
    assert not list(event_warnings([compared]))
    (alone,) = stored_events(walk()[:1], walk(late=0.02))
    assert alone.mean_s == pytest.approx(0.02)
    assert np.isnan(alone.sd_s), "of one there is no deviation"


def test_a_file_without_events():
    assert stored_events((), walk()) == ()


def test_events_of_the_wrong_foot():
    compared = stored_events(walk(swapped=True), walk())
    assert compared[0].other_foot == 10
    (warning,) = event_warnings(compared)
    assert "right and left are exchanged" in warning.message


def test_events_on_another_clock():
    (warning,) = event_warnings(stored_events(walk(late=-0.1), walk()))
    assert warning.value == pytest.approx(0.1)


def test_an_event_that_was_not_found_does_not_match():
    (compared,) = stored_events(walk(), walk()[:4])
    assert (compared.matched, compared.other_foot) == (4, 0)


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


@pytest.mark.parametrize(
    ("slower", "says"), [(0.006, "later and later"), (-0.006, "earlier and earlier")]
)
def test_clocks_that_drift(slower, says):
    # over the 4.95 s from the first strike to the last
    shown = [Event(e.time * (1.0 - slower), e.side, e.kind) for e in walk()]
    (warning,) = contacts(carried(), shown)
    assert warning.check == "clocks"
    assert warning.value == pytest.approx(4.95 * abs(slower), abs=0.002)
    assert says in warning.message
    shown = [Event(e.time * (1.0 - 0.3 * slower), e.side, e.kind) for e in walk()]
    assert not list(contacts(carried(), shown))


def test_strikes_that_scatter_do_not_drift():
    scatter = np.random.default_rng(39).normal(0.0, 0.012, 10)
    shown = [Event(e.time + by, e.side, e.kind) for e, by in zip(walk(), scatter, strict=True)]
    assert not list(contacts(carried(), shown))


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
