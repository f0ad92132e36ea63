"""The command that puts devices on a person."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.terminal import display
from gaitval.terminal.app import added_command

if TYPE_CHECKING:
    from gaitval.apps.devices.study import DeviceOutcome

SAMPLES = 300_000
"""Samples of a learned adaptation, if nobody says otherwise."""


@added_command(
    "gaitval device 5 hip_exo",
    "gaitval device 5 my_orthosis.toml --out reports/orthosis",
    "gaitval device patient.toml                 # with the devices of the subject's file",
    "gaitval device 5 backpack --samples 0       # without learning",
    "gaitval device 5 --load 20 --samples 0      # a vest of 20 % of body mass",
    after="report",
)
def device(
    walker: Annotated[
        str,
        typer.Argument(
            metavar="SUBJECT_OR_RUN",
            help="A subject with a stored policy (5, S05), a finished run folder, or a subject's "
            "file, which walks with the general policy.",
        ),
    ],
    devices: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="DEVICE",
            help="Names of shipped devices (hip_exo, knee_exo, ankle_exo, ankle_spring, "
            "below_knee, above_knee, afo, backpack, foot_2kg, ...) or TOML files of devices.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FOLDER",
            help="Folder of the report; by default beside the run: reports/S05-hip_exo.",
        ),
    ] = None,
    load: Annotated[
        float | None,
        typer.Option(
            "--load", metavar="PERCENT", help="A vest of so much of body mass, up to 40 %.",
        ),
    ] = None,
    samples: Annotated[
        int,
        typer.Option(
            "--samples", metavar="N", min=0, max=10_000_000,
            help="Samples of the learned adaptation; 0: none.",
        ),
    ] = SAMPLES,
) -> None:  # fmt: skip
    """What exoskeletons, prostheses, orthoses or loads would do to a person.

    The person walks without and with the devices, by three assumptions on how people adapt: the
    motion is kept, the control is kept, or walking is learned anew. Nobody knows which is right;
    the report shows all: moments, work, loads and metabolic rate without and with. One to two
    minutes.
    """
    from gaitval._internal.io.folder_lock import locked
    from gaitval.apps.devices.page import write_report
    from gaitval.apps.devices.study import outcomes, wearer
    from gaitval.model.devices.device import load_devices
    from gaitval.model.devices.loads import trunk_load
    from gaitval.study.stored_policy import page_folder

    # Wrong devices are refused before the person is made, which takes seconds.
    given = [each for name in devices or () for each in load_devices(name)]
    person = wearer(walker, given)
    if load is not None:
        given.append(trunk_load(load, person.task.model.mass))
    fitted = [*person.own, *given]
    names = "-".join(each.name for each in fitted)
    folder = out or page_folder(walker, person.name, names)
    # Held before anybody walks: where it cannot be written to, nothing would be kept.
    with locked(folder):
        with display.live_view() as live:
            live.started("device", f"{person.name}, {names}")
            found, policy = outcomes(person, fitted, samples=samples, say=_say)
        write_report(folder, person, fitted, found, policy)
    _say_found(found)
    display.plain(f"Report: {folder / 'device.html'}")


def _say(line: str) -> None:
    display.messages.print(line)


def _say_found(found: Sequence["DeviceOutcome"]) -> None:
    """A line for each assumption, and why a change of metabolic rate is not among them."""
    from gaitval.apps.devices.costs import cost_changes, rate_in_words, unknown_in_words

    rates = {each.assumption: rate_in_words(each) for each in cost_changes(found)}
    for outcome in found:
        walked = "fell after" if outcome.fell else "walked"
        pushes = "" if outcome.survived is None else f"; survived {outcome.survived} of 24 pushes"
        rate = rates.get(outcome.assumption)
        cost = f"; metabolic rate {rate}" if rate else ""
        display.plain(
            f"{outcome.assumption}: {walked} {outcome.cycles:.0f} gait cycles{pushes}{cost}"
        )
    if not rates:
        display.plain(f"Change of metabolic rate {unknown_in_words(found)}.")
