"""The command that pushes a walker, lets it slip and trip, and lays that beside people."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import gaitval
from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import WalkerArgument, added_command
from gaitval.errors import ConfigurationError

if TYPE_CHECKING:
    from gaitval.apps.balance.disturb import Disturbance
    from gaitval.apps.balance.results import PerturbResult
    from gaitval.coordinates import Side


DelayOption = Annotated[
    str | None,
    typer.Option(
        "--delay",
        metavar="MS[:MS:MS]",
        help="What it feels is old: joints and feet, balance organ, vision.",
    ),
]


@added_command(
    "gaitval perturb 5                               # all kinds",
    "gaitval perturb runs/S05 --slip 0.1:0.3 --trip 0.5:0.1 --step-down 0.05",
    "gaitval perturb 5 --pushes                      # only pushes",
    "gaitval perturb 5 --delay 50:90:150             # it feels its body late",
    after="report",
)
def perturb(
    walker: WalkerArgument,
    pushes: Annotated[
        bool, typer.Option("--pushes", help="Only pushes, and what else is asked for here.")
    ] = False,
    slip: Annotated[
        list[str] | None,
        typer.Option(
            "--slip", metavar="GRIP:METRES",
            help="Friction falls to a share under a landing foot, until it has slid so far.",
        ),
    ] = None,
    trip: Annotated[
        list[str] | None,
        typer.Option(
            "--trip", metavar="SWING:SECONDS",
            help="The foot is stopped at a share of its swing, for so long.",
        ),
    ] = None,
    step_down: Annotated[
        list[float] | None,
        typer.Option(
            "--step-down", metavar="METRES",
            help="The ground is lower from a step on.",
        ),
    ] = None,
    side: Annotated[
        str, typer.Option("--side", metavar="right|left", help="The foot on that ground.")
    ] = "right",
    delay: DelayOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="FOLDER",
            help="Folder of the page; by default beside the run: reports/S05-perturbed.",
        ),
    ] = None,
) -> None:  # fmt: skip
    """How a person's walker recovers from pushes, slips, trips and steps down, beside people.

    Where it places its feet from the extrapolated centre of mass, when, and what its ankles do,
    against a published experiment, one who does not react, and a pendulum. Writes perturb.html,
    perturb.pdf and perturb.json. A minute.
    """
    from gaitval._internal.io.folder_lock import locked
    from gaitval.apps.balance.disturb import usual_grounds
    from gaitval.apps.balance.stored import walker_of
    from gaitval.apps.balance.study import recoveries
    from gaitval.apps.balance.write import write_recoveries
    from gaitval.study.stored_policy import page_folder

    delays = None if delay is None else _delays(delay)
    asked = _grounds(slip or (), trip or (), step_down or (), side)
    grounds = asked if asked or pushes else usual_grounds(_side(side))
    policy = gaitval.load_policy(walker)
    identifier = policy.subject.identifier
    folder = out or page_folder(walker, identifier, "perturbed")
    with locked(folder):
        with display.live_view() as live:
            live.started("perturb", identifier)
            who = walker_of(policy, delays=delays)
            kinds: tuple[str, ...] = ("push", "slip", "trip", "step")
            if asked and not pushes:
                kinds = kinds[1:]
            found = recoveries(identifier, who, kinds=kinds, grounds=grounds, say=live.say)
        write_recoveries(found, who, folder)
    _say(found.result)
    display.plain(f"Page: {folder / 'perturb.html'}")


def _say(result: "PerturbResult") -> None:
    """Who stood and how much is as in people, then what is not."""
    for answer in result.answers():
        display.plain(answer)
    for row in result.quantities:
        if not row.inside:
            display.plain(f"Not as people: {row.words} ({row.source})")
    for each in result.grounds:
        stood = f"{sum(each.survived)} of {len(each.survived)} starts survived"
        display.plain(f"{each.kind} ({each.words()}): {stood}")


def _delays(text: str) -> tuple[float, float, float]:
    """s, of the three paths; one number is of all."""
    try:
        each = [1e-3 * float(part) for part in text.split(":")]
        first, second, third = each * 3 if len(each) == 1 else each
    except ValueError:
        raise ConfigurationError(
            f"--delay {text}: give milliseconds, one number for all or three with colons, such as "
            "50:100:150 (joints and feet, balance organ, vision)."
        ) from None
    if not all(0.0 <= one <= 1.0 for one in (first, second, third)):
        raise ConfigurationError(f"--delay {text}: give milliseconds from 0 to 1000.")
    return first, second, third


def _side(side: str) -> "Side":
    from gaitval.coordinates import SIDES

    for each in SIDES:
        if each == side.lower():
            return each
    raise ConfigurationError(f"--side {side}: give right or left.")


def _grounds(
    slips: Sequence[str], trips: Sequence[str], drops: Sequence[float], side: str
) -> "list[Disturbance]":
    from gaitval.apps.balance.disturb import Slip, StepDown, Trip, checked

    foot = _side(side)
    made: list[Disturbance] = [
        *(Slip(foot, *_two("--slip", each, "0.1:0.3")) for each in slips),
        *(Trip(foot, *_two("--trip", each, "0.5:0.1")) for each in trips),
        *(StepDown(foot, each) for each in drops),
    ]
    return [checked(each) for each in made]


def _two(option: str, text: str, example: str) -> tuple[float, float]:
    try:
        first, second = (float(each) for each in text.split(":"))
    except ValueError:
        raise ConfigurationError(
            f"{option} {text}: give two numbers with a colon, such as {example}."
        ) from None
    return first, second
