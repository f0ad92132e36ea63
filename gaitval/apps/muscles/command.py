"""The command that shares the moments of a gait to muscles."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.terminal import display
from gaitval.terminal.app import added_command


@added_command(
    "gaitval muscles mine                        # an import",
    "gaitval muscles reports/S05 --bands         # a run",
    "gaitval muscles mine --criterion squares --strength 0.8 --out mine/weak",
    after="report",
)
def muscles(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER",
            help="Of an import, whole or refused for want of a gait cycle, or of a run.",
            show_default=False,
        ),
    ],
    criterion: Annotated[
        str,
        typer.Option(
            "--criterion", help="What is kept small: contact, squares, cubes, volume, spared knee."
        ),
    ] = "contact",
    bands: Annotated[
        bool, typer.Option("--bands", help="Bands of 90 % by 200 draws, and what makes them.")
    ] = False,
    side: Annotated[
        str | None,
        typer.Option("--side", metavar="right|left", help="One leg only.", show_default=False),
    ] = None,
    strength: Annotated[
        float, typer.Option("--strength", help="Factor on the strength of all muscles.")
    ] = 1.0,
    activation_dynamics: Annotated[
        bool,
        typer.Option(
            "--activation-dynamics", help="Activations rise and fall no faster than muscles can."
        ),
    ] = False,
    height: Annotated[
        float | None,
        typer.Option(
            "--height", help="Stature, m, where an import was refused.", show_default=False
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Folder to write; FOLDER/muscles.", show_default=False),
    ] = None,
) -> None:
    """Muscle activations and forces, what hip, knee, patella and ankle carry, what walking costs.

    Static optimisation over 40 muscles a leg, from the moments of the import or the walk. One cycle
    of one side suffices. Writes muscles.html, muscles.pdf, curves.csv, muscles.json, and for each
    stretch activations, forces and contact forces over time as .sto, which OpenSim opens, with the
    person as an OpenSim model with muscles.
    """
    from gaitval.apps.muscles.sources import motions_in
    from gaitval.apps.muscles.write import PAGE, RESULT, write_muscles
    from gaitval.coordinates import SIDES
    from gaitval.errors import ConfigurationError
    from gaitval.folder_lock import locked
    from gaitval.musculature.gait import muscles_of
    from gaitval.quantities.metabolic_cost import metabolic_cost

    if side is not None and side not in SIDES:
        raise ConfigurationError(f"--side {side}: give right or left, or leave it out for both.")
    if not 0.05 <= strength <= 5.0:
        raise ConfigurationError(
            f"--strength {strength:g}: a factor from 0.05 to 5; 1 is that of healthy adults of "
            "this size."
        )
    motions = motions_in(folder, height=height)
    found = muscles_of(
        motions,
        criterion=criterion,
        sides=SIDES if side is None else (side,),
        strength=strength,
        dynamics_of_activation=activation_dynamics,
        draws=200 if bands else 0,
    )
    cost = metabolic_cost(motions, found)
    target = folder / "muscles" if out is None else out
    about = {"strength": strength, "activation_dynamics": activation_dynamics}
    with locked(target):
        written = write_muscles(target, found, about, motions[0], cost)
    rows = [["contact force, BW", "side", "peak", "at, %", *(["90 %"] if bands else [])]]
    for leg_side, leg in found.legs.items():
        for name, curve in leg.contact.items():
            at = int(curve.argmax())
            row = [name, leg_side, f"{curve[at]:.2f}", str(at)]
            if bands:
                low, high = leg.contact_band[name][:, at]
                row.append(f"{low:.2f} to {high:.2f}")
            rows.append(row)
    if found.legs:
        display.print_rows(rows, found.title())
    else:
        display.plain(f"{found.title()}: over time only, for no gait cycle is whole.")
    if cost is not None:
        display.plain(cost.title())
    for remark in found.remarks:
        display.plain(remark)
    page = target / (f"{PAGE}.html" if found.legs else RESULT)
    display.plain(f"{page} and {len(written) - 1} more files")
