"""The command that lets a person walk now, in a local page."""

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.errors import ConfigurationError, RecordError, ToleranceError
from gaitval.terminal import display
from gaitval.terminal.app import added_command

if TYPE_CHECKING:
    from gaitval.apps.live.log import Log
    from gaitval.apps.live.person import LivePerson
    from gaitval.apps.live.walk import LiveWalk
    from gaitval.datasets.subject import Subject

_DeviceOption = Annotated[
    list[str] | None,
    typer.Option(
        "--device",
        metavar="DEVICE",
        help="A shipped device's name or a file, that is put on and taken off in the page. May be "
        "repeated.",
    ),
]


@added_command(
    "gaitval live 5                                       # opens a page",
    "gaitval live my_patient.toml --no-browser            # prints its address only",
    "gaitval live --replay reports/S05-live/walks/LOG.jsonl          # looks at it again",
    "gaitval live --replay reports/S05-live/walks/LOG.jsonl --check  # walks it without a page",
    "gaitval live 5 --device hip_exo",
    after="report",
)
def live(
    subject: Annotated[
        str | None,
        typer.Argument(metavar="[SUBJECT]", help="1 to 10, S05, or a subject file."),
    ] = None,
    replay: Annotated[
        Path | None,
        typer.Option(
            "--replay",
            metavar="LOG",
            help="Walk what is in a log again, bit for bit.",
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="With --replay: no page; fails if the walk differs.")
    ] = False,
    policy: Annotated[
        Path | None,
        typer.Option(
            "--policy",
            metavar="FOLDER",
            help="A policy of this person, such as reports/S05-range/policy; by default the "
            "general one walks.",
        ),
    ] = None,
    device: _DeviceOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FOLDER",
            help="Folder of the references and the logs; by default reports/S05-live.",
        ),
    ] = None,
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, help="Of the page; 0: one that is free.")
    ] = 0,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Open no browser; only say where the page is.")
    ] = False,
) -> None:
    """Let a person walk now, in a page of this machine, pushed by the mouse.

    Walking speed, the 14 body parameters and slow motion have sliders; devices are put on and taken
    off.

    For teaching and first looks, never for verdicts: speeds are predicted, and nothing is compared
    with a record. The policy has not learned to walk with a device: with a prosthesis it falls. The
    first start takes half a minute, for references at six speeds, and minutes of who has a
    prosthesis. What is done is logged, and can be walked again. Ctrl-C ends it.
    """
    from gaitval.apps.live.person import folder_of, prepared

    person, log = _who_walks(subject, replay, device or [], check=check)
    folder = out or folder_of(person)
    with (
        display.live_view() as view,
        prepared(person, folder, view, policy=policy) as found,
    ):
        from gaitval.apps.live.page import show

        walk = _walk(found, person, log, replay)
        if check and log is not None and replay is not None:
            _check(log, walk, replay)
            return
        written = show(found, walk, log, port=port, browser=not no_browser, say=_say)
    if written is not None:
        again = quote(str(written))
        display.plain(f"What was done: {written}. Walk it again: gaitval live --replay {again}")


def _who_walks(
    subject: str | None, replay: Path | None, devices: Sequence[str], *, check: bool
) -> "tuple[Subject, Log | None]":
    """The person with its devices, and the log where one is walked again."""
    from gaitval.apps.live.log import read_log
    from gaitval.datasets.subject_file import load_subject

    if (subject is None) == (replay is None):
        raise ConfigurationError("give one of SUBJECT, who walks, and --replay, a log.")
    if check and replay is None:
        raise ConfigurationError("--check: walks a log again. Give it, with --replay.")
    if devices and replay is not None:
        raise ConfigurationError("--device: the log says what was worn. Leave it out.")
    log = None if replay is None else read_log(replay)
    person = load_subject(str(subject)) if log is None else log.subject
    if devices:
        from gaitval.apps.devices.of_subject import wearing

        person = wearing(person, devices)
    return person, log


def _walk(
    found: "LivePerson", subject: "Subject", log: "Log | None", replay: Path | None
) -> "LiveWalk":
    """A new walk of a person (`found`, the `subject`), or the one of a log, at `replay`."""
    from gaitval.apps.live.log import check_person
    from gaitval.apps.live.walk import LiveWalk

    if log is None or replay is None:
        from gaitval.model.devices.device import tables_of

        return LiveWalk(found, devices=tables_of(subject.devices))
    check_person(log, found, replay)
    return LiveWalk(found, log.speed, log.devices)


def _say(text: str) -> None:
    """Print a line at once, also where a program reads it: the walk goes on until Ctrl-C."""
    display.plain(text)
    display.output.file.flush()


def _check(log: "Log", walk: "LiveWalk", path: Path) -> None:
    """Walk a log without a page, and say whether it was equal."""
    from gaitval.apps.live.log import walk_again

    found = walk_again(log, walk)
    if found.differs is not None:
        raise ToleranceError(
            f"{path}: the walk is not that of the log, at the latest from action {found.differs} "
            "on. It was walked on another machine, or with other libraries."
        )
    if not found.checked:
        raise RecordError(
            f"{path}: has no hash, so nothing could be compared. A walk that was killed in its "
            "first seconds leaves none. Give the log of a longer walk."
        )
    rest = walk.step - found.equal
    display.plain(
        f"{path}: {found.equal} actions walked again, equal bit for bit ({found.checked} hashes)."
        + (f" Of the {rest} that follow nothing is known: the log was cut off." if rest else "")
    )
