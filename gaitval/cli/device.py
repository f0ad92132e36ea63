"""The command that puts devices on a person."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import added_command


@added_command(
    "gaitval device 5 hip_exo",
    "gaitval device 5 my_orthosis.toml --out reports/orthosis",
    "gaitval device patient.toml                 # with the devices of the subject's file",
    "gaitval device 5 --load 20                  # a vest of 20 % of body mass",
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
) -> None:  # fmt: skip
    """What exoskeletons, prostheses, orthoses or loads would do to a person.

    The person walks without and with the devices, with the same control and at the same speed; the
    report shows torque and power of the devices, moments, work, loads and metabolic rate. A minute.
    """
    from gaitval._internal.io.folder_lock import locked
    from gaitval.apps.devices.answer import answer
    from gaitval.apps.devices.costs import UNKNOWN, cost_change
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
            without, worn = outcomes(person, fitted, say=display.messages.print)
        write_report(folder, person, fitted, without, worn)
    display.plain(answer(without, worn))
    change = cost_change(without, worn)
    display.plain(f"Metabolic rate: {UNKNOWN if change is None else change.words()}")
    display.plain(f"Report: {folder / 'device.html'}")
