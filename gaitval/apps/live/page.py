"""A live walk from its first picture to Ctrl-C: session, server, browser and log together."""

import signal
import tempfile
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from gaitval.apps.live.log import Log, LogWriter, Replay
from gaitval.apps.live.person import LivePerson
from gaitval.apps.live.pictures import scene_of
from gaitval.apps.live.server import LiveServer, serving
from gaitval.apps.live.session import LiveSession
from gaitval.apps.live.walk import LiveWalk
from gaitval.artefacts import write_text
from gaitval.errors import ConfigurationError
from gaitval.partial_files import own_folder


@contextmanager
def served(
    person: LivePerson, walk: LiveWalk, log: Log | None = None, *, port: int = 0
) -> Iterator[LiveServer]:
    """The page of a `person` and their `walk`, in which nothing was walked yet, within the block;
    it walks while somebody looks. `log` is to walk again; None for a new walk, whose log is in
    `walks/` of the person's folder. `port` is 0 for one that is free; ConfigurationError if it is
    taken.
    """
    LiveWalk(person, walk.speed, walk.devices).act()  # compiles what was not used before
    scene = scene_of(person, walk, replay=log is not None)
    replay, writer = None, None
    if log is not None:
        replay = Replay(log, walk)
    else:
        path = person.folder / "walks" / f"{datetime.now():%Y-%m-%d_%H-%M-%S_%f}.jsonl"
        writer = LogWriter(path, person, walk)
    session = LiveSession(walk, writer=writer, replay=replay)
    try:
        server = LiveServer(session, scene, port=port)
    except OSError as error:
        if writer is not None:  # of a walk that never began
            writer.close()
            writer.path.unlink()
        raise ConfigurationError(
            f"--port {port}: cannot be listened on ({error.strerror}). Give another, or 0 for one "
            "that is free."
        ) from None
    end = serving(server)
    session.start()
    try:
        yield server
    finally:
        session.end()
        end()


def show(
    person: LivePerson,
    walk: LiveWalk,
    log: Log | None,
    *,
    port: int,
    browser: bool,
    say: Callable[[str], None],
) -> Path | None:
    """Serve the page until Ctrl-C; the log that was written, None for a replay. `person`, `walk`,
    `log` and `port` are as in `served`; `browser` says whether to open one, and `say` prints a line
    for the user.
    """
    with (
        own_folder(Path(tempfile.gettempdir()), "gaitval-live-") as private,
        served(person, walk, log, port=port) as server,
    ):
        say(f"{person.subject.identifier} walks at {server.address} (this machine only).")
        say("For teaching and first looks, never for verdicts. Ctrl-C ends it.")
        if browser:
            webbrowser.open(_leading(private, server.address).as_uri())
        # Ended from outside as by Ctrl-C: no command resumes this walk, but its log shows it again.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        with suppress(KeyboardInterrupt):
            server.session.over.wait()
        if server.session.failed is not None:
            raise server.session.failed
        return server.session.written


def _leading(folder: Path, address: str) -> Path:
    """A file in a folder of this user alone that leads a browser to an address: as an argument of a
    program every user of the machine could read it.
    """
    path = folder / "open.html"
    write_text(
        path,
        '<!doctype html><meta charset="utf-8"><title>gaitval live</title>'
        f'<meta http-equiv="refresh" content="0; url={address}"><a href="{address}">The walk</a>',
    )
    return path
