"""The walk in real time: a thread that acts, takes what visitors do, and shows what is seen."""

import queue
import threading
from collections.abc import Callable
from pathlib import Path
from time import monotonic
from typing import Final, NamedTuple

import numpy as np

from gaitval.apps.live.doing import FULL, Clock, Doing, PushPelvis
from gaitval.apps.live.log import EVERY, LogWriter, Replay
from gaitval.apps.live.walk import LiveWalk, Seen
from gaitval.arrays import Array

PICTURES: Final = 60.0
"""A second: no screen that this is for shows more."""
MOST_BEHIND: Final = 0.1
"""s by which the walk may be behind real time; what is more is given up."""


class PageUpdate(NamedTuple):
    """What a page is sent.

    Attributes
    ----------
    seen : the walk.
    rate : of real time, that is asked for.
    pushes : whose force has acted so far.
    push : (2,) N, forward and left, of the last of them. It acts for a shorter time than a picture
        may take on a busy machine, which must show it all the same.
    received : monotonic time, s, at which the last push came in; 0 before the first.
    acted : likewise, at which its force first acted.
    """

    seen: Seen
    rate: float
    pushes: int
    push: Array
    received: float
    acted: float


class LiveSession:
    """A walk that goes on while somebody looks at it.

    Parameters
    ----------
    walk : of which nothing was walked yet.
    writer : of its log; None for a replay.
    replay : that does what is done; then visitors can only pause and slow down.
    clock : monotonic seconds.

    Attributes
    ----------
    over : set when it walks no further.
    failed : what ended it, if nobody did.
    """

    def __init__(
        self,
        walk: LiveWalk,
        *,
        writer: LogWriter | None = None,
        replay: Replay | None = None,
        clock: Callable[[], float] = monotonic,
    ) -> None:
        self.walk = walk
        self.replay = replay
        self._writer = writer
        self._clock = clock
        self._rate = FULL
        self._doings: queue.SimpleQueue[tuple[Doing, float] | None] = queue.SimpleQueue()
        self._watched = threading.Condition()
        self._visitors = 0
        self._started, self._received, self._acted = 0, 0.0, 0.0
        self._pushes, self._push = 0, np.zeros(2)
        self._ended = False
        self.over = threading.Event()
        self.failed: Exception | None = None
        self.shown = self._show()
        self._thread = threading.Thread(target=self._run, name="walk", daemon=True)

    def start(self) -> None:
        """Begin to walk as soon as somebody looks."""
        self._thread.start()

    def end(self) -> None:
        """Walk no further, and close the log."""
        self._ended = True
        self._doings.put(None)
        with self._watched:
            self._watched.notify_all()
        self._thread.join()
        if self._writer is not None:
            if self.failed is None:
                self._writer.at(self.walk)
            self._writer.close()

    @property
    def written(self) -> Path | None:
        """The log."""
        return None if self._writer is None else self._writer.path

    @property
    def ended(self) -> bool:
        """Whether it walks no further."""
        return self._ended

    def do(self, doing: Doing) -> None:
        """Let something happen as soon as the action that is computed now is over."""
        self._doings.put((doing, self._clock()))

    def watch(self, comes: bool) -> None:
        """Somebody looks from now on, or no longer. The walk stands still while nobody does."""
        with self._watched:
            self._visitors += 1 if comes else -1
            self._watched.notify_all()

    def next_shown(self, after: PageUpdate | None, seconds: float) -> PageUpdate:
        """What is shown next, or still after so many seconds."""
        with self._watched:
            self._watched.wait_for(lambda: self.shown is not after or self._ended, seconds)
            return self.shown

    def _show(self) -> PageUpdate:
        return PageUpdate(
            self.walk.see(), self._rate, self._pushes, self._push, self._received, self._acted
        )

    def _publish(self) -> None:
        shown = self._show()
        with self._watched:
            self.shown = shown
            self._watched.notify_all()

    def _run(self) -> None:
        try:
            self._walk_on()
        except Exception as error:  # for who waits: a thread's own error is only printed
            self.failed, self._ended = error, True
            with self._watched:
                self._watched.notify_all()
        self.over.set()

    def _walk_on(self) -> None:
        last, owed = self._clock(), 0.0  # s of walking that real time is ahead by
        while not self._ended:
            with self._watched:
                if not self._visitors:
                    self._watched.wait_for(lambda: self._visitors or self._ended)
                    last = self._clock()
            hurried = self._wait(last + 1.0 / PICTURES)
            now = self._clock()
            # A machine that is busy walks later, not faster: what it cannot make up is given up.
            owed = min(owed + (now - last) * self._rate, MOST_BEHIND)
            last = now
            actions = max(int(owed / self.walk.seconds), int(hurried and self._rate > 0.0))
            for _ in range(actions):
                self._act()
            owed -= actions * self.walk.seconds
            self._publish()

    def _wait(self, until: float) -> bool:
        """Take what visitors do until it is time for the next picture, or until they push, which
        is then not to wait; whether they did.
        """
        while True:
            try:
                taken = self._doings.get(timeout=max(until - self._clock(), 0.0))
            except queue.Empty:
                return False
            if taken is None:
                return False
            self._take(*taken)
            if isinstance(taken[0], PushPelvis) and self.replay is None:
                return True

    def _take(self, doing: Doing, received: float) -> None:
        if self.replay is not None and not isinstance(doing, Clock):
            return
        self._enter(doing, received)

    def _enter(self, doing: Doing, received: float) -> None:
        if self._writer is not None:
            self._writer.did(self.walk.step, doing)
        if isinstance(doing, Clock):
            self._rate = doing.rate
            return
        self.walk.do(doing)
        if isinstance(doing, PushPelvis):
            self._started += 1
            self._received, self._acted = received, 0.0

    def _act(self) -> None:
        walk = self.walk
        if self.replay is not None:
            for doing in self.replay.due():
                if not isinstance(doing, Clock):
                    self._enter(doing, self._clock())
            if self.replay.over:
                return
        walk.act()
        if self._acted == 0.0 and self._received:
            self._acted = self._clock()
            self._pushes, self._push = self._started, walk.see().push
        if self._writer is not None and walk.step % EVERY == 0:
            self._writer.at(walk)
