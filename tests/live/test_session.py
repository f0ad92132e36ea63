"""Real time, by a clock of the test."""

import time

import pytest

from gaitval.apps.live.doing import Clock, PushPelvis
from gaitval.apps.live.log import LogWriter, Replay, read_log
from gaitval.apps.live.session import MOST_BEHIND, LiveSession
from gaitval.errors import ArtefactError


class Watched:
    """A session that somebody looks at within the block."""

    def __init__(self, walk, **options):
        self.session = LiveSession(walk, **options)

    def __enter__(self):
        self.session.start()
        self.session.watch(True)
        return self.session

    def __exit__(self, *_):
        self.session.end()


def until(true, seconds=10.0):
    """Wait for something that takes a moment, longer on a busy machine."""
    began = time.monotonic()
    while not true():
        assert time.monotonic() - began < seconds, "it did not happen"
        time.sleep(0.005)


def test_it_is_never_faster_than_real_time(walk):
    began = time.monotonic()
    with Watched(walk) as session:
        until(lambda: walk.step > 30)
        steps, passed = walk.step, time.monotonic() - began
        assert steps * walk.seconds <= passed + MOST_BEHIND
        assert session.shown.seen.step > 0


def test_it_stands_still_while_it_is_paused(walk):
    with Watched(walk) as session:
        until(lambda: walk.step > 5)
        session.do(Clock(0.0))
        until(lambda: session.shown.rate == 0.0)
        stood = walk.step
        time.sleep(0.1)
        assert walk.step == stood
        session.do(Clock(1.0))
        until(lambda: walk.step > stood + 5)


def test_a_push_while_it_is_paused_waits(walk):
    with Watched(walk) as session:
        session.do(Clock(0.0))
        until(lambda: session.shown.rate == 0.0)
        session.do(PushPelvis(50.0, 0.0))
        stood = walk.step
        time.sleep(0.1)
        assert (walk.step, session.shown.pushes) == (stood, 0)
        session.do(Clock(1.0))
        until(lambda: session.shown.pushes == 1)
        assert session.shown.acted > 0.0
        assert walk.step > stood


def test_a_push_is_shown_to_who_looks_after_it_acted(walk):
    """A busy machine takes longer for a picture than a push acts."""
    with Watched(walk) as session:
        session.do(PushPelvis(50.0, -20.0))
        until(lambda: session.shown.pushes == 1 and not session.shown.seen.push.any())
        assert session.shown.push.tolist() == [50.0, -20.0]


def test_a_visitor_of_a_replay_does_nothing_but_stop_the_clock(person, walk, tmp_path):
    from gaitval.apps.live.walk import LiveWalk

    writer = LogWriter(tmp_path / "log.jsonl", person, walk)
    for step in range(50):
        if step == 20:
            writer.did(walk.step, PushPelvis(0.0, 60.0))
            walk.do(PushPelvis(0.0, 60.0))
        walk.act()
    writer.at(walk)
    writer.close()
    again = LiveWalk(person, person.speeds[1])
    replay = Replay(read_log(writer.path), again)
    with Watched(again, replay=replay) as session:
        session.do(PushPelvis(0.0, 1000.0))
        until(lambda: replay.over)
        assert session.shown.pushes <= 1
    assert again.step == 50
    assert replay.differs is None
    assert replay.checked == 1
    assert again.digest == walk.digest


def test_an_ended_session_answers_those_who_wait(walk):
    with Watched(walk) as session:
        shown = session.shown
    assert session.ended
    assert session.next_shown(session.shown, 5.0) is not None
    assert shown.seen.step == 0 or shown.seen.step <= walk.step


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.1, 0.5])
def test_slow_motion_is_slow(walk, rate):
    with Watched(walk) as session:
        session.do(Clock(rate))
        until(lambda: session.shown.rate == rate)
        began, before = time.monotonic(), walk.step
        until(lambda: walk.step > before + 5)
        passed = time.monotonic() - began
        assert (walk.step - before) * walk.seconds <= rate * (passed + MOST_BEHIND) + walk.seconds


def test_an_error_ends_the_walk_and_is_there_for_who_waits(walk, monkeypatch):
    def failing():
        raise ArtefactError("no space")

    with Watched(walk) as session:
        monkeypatch.setattr(walk, "act", failing)
        assert session.over.wait(5.0)
        assert session.ended
        assert str(session.failed) == "no space"
