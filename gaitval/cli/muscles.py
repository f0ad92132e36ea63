"""The command that shares the moments of a gait to muscles."""

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import added_command

if TYPE_CHECKING:
    from gaitval.apps.muscles.sharing import SharedMotions


FolderArgument = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER",
        help="Of an import, whole or refused for want of a gait cycle, or of a run.",
    ),
]
CriterionOption = Annotated[
    str,
    typer.Option(
        "--criterion",
        help="What is kept small: contact, contact by volume, squares, cubes, volume, spared knee.",
    ),
]
EmgOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--emg",
        metavar="FILE",
        help="C3D or STO with electromyograms, called as the trial: what was computed is "
        "compared with them. Once for each trial.",
    ),
]
EmgSideOption = Annotated[
    str | None,
    typer.Option(
        "--emg-side",
        metavar="right|left",
        help="Leg of channels whose names do not say it.",
    ),
]
HeightOption = Annotated[
    float | None,
    typer.Option("--height", help="Stature, m, where an import was refused."),
]


@added_command(
    "gaitval muscles mine                        # an import",
    "gaitval muscles reports/S05 --bands         # a run",
    "gaitval muscles mine --criterion squares --strength 0.8 --out mine/weak",
    after="report",
)
def muscles(
    folder: FolderArgument,
    criterion: CriterionOption = "contact by volume",
    bands: Annotated[
        bool, typer.Option("--bands", help="Bands of 90 % by 200 draws, and what makes them.")
    ] = False,
    side: Annotated[
        str | None,
        typer.Option("--side", metavar="right|left", help="One leg only."),
    ] = None,
    strength: Annotated[
        float, typer.Option("--strength", help="Factor on the strength of all muscles.")
    ] = 1.0,
    activation_dynamics: Annotated[
        bool,
        typer.Option(
            "--activation-dynamics/--no-activation-dynamics",
            help="Activations rise and fall no faster than muscles can.",
        ),
    ] = True,
    height: HeightOption = None,
    emg: EmgOption = None,
    emg_side: EmgSideOption = None,
    emg_weight: Annotated[
        float,
        typer.Option("--emg-weight", help="Stay near the electromyograms, such as 10; 0 compares."),
    ] = 0.0,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Folder to write; FOLDER/muscles."),
    ] = None,
) -> None:
    """Muscle activations and forces, what hip, knee, patella and ankle carry, what walking costs.

    Static optimisation over 40 muscles a leg, from the moments of the import or the walk. One cycle
    of one side suffices. Writes muscles.html, muscles.pdf, curves.csv, muscles.json, and for each
    stretch activations, forces and contact forces over time as .sto, which OpenSim opens, with the
    person as an OpenSim model with muscles.
    """
    from gaitval._internal.io.folder_lock import locked
    from gaitval.apps.muscles.sharing import MuscleSettings, shared_motions
    from gaitval.apps.muscles.sources import motions_in
    from gaitval.apps.muscles.write import write_muscles
    from gaitval.quantities.metabolic_cost import metabolic_cost

    settings = MuscleSettings(
        criterion=criterion,
        side=side and side.lower(),  # type: ignore[arg-type]
        strength=strength,
        bands=bands,
        activation_dynamics=activation_dynamics,
        emg=tuple(emg or ()),
        emg_side=emg_side and emg_side.lower(),  # type: ignore[arg-type]
        emg_weight=emg_weight,
    )
    target = folder / "muscles" if out is None else out
    motions = motions_in(folder, height=height)
    with locked(folder if out is None else out):
        shared = shared_motions(motions, settings)
        found = shared.muscles
        cost = metabolic_cost(motions, found)
        written = write_muscles(target, shared, settings, motions[0], cost)
    if found.legs:
        display.print_rows(_contact_rows(shared), found.title())
    else:
        display.plain(f"{found.title()}: over time only, for no gait cycle is whole.")
    if shared.seen:
        display.print_rows(_seen_rows(shared), "Beside electromyograms")
    if cost is not None:
        display.plain(cost.title())
    for remark in found.remarks:
        display.plain(remark)
    page = target / ("muscles.html" if found.legs else "muscles.json")
    display.plain(f"{page} and {len(written) - 1} more files")


def _contact_rows(shared: "SharedMotions") -> list[list[str]]:
    """Peaks of contact forces, with their bands if there are any."""
    found = shared.muscles
    bands = any(leg.contact_band for leg in found.legs.values())
    rows = [["contact force, BW", "side", "peak", "at, %", *(["90 %"] if bands else [])]]
    for side, leg in found.legs.items():
        for name, curve in leg.contact.items():
            at = int(curve.argmax())
            row = [name, side, f"{curve[at]:.2f}", str(at)]
            if bands:
                low, high = leg.contact_band[name][:, at]
                row.append(f"{low:.2f} to {high:.2f}")
            rows.append(row)
    return rows


def _seen_rows(shared: "SharedMotions") -> list[list[str]]:
    """Every electromyogram beside what was computed."""
    several = len({each.trial for each in shared.seen}) > 1
    heads = ["electromyogram", "side", "correlation", "on and off agree", "by chance"]
    rows = [[*(["trial"] if several else []), *heads]]
    for each in shared.seen:
        shares = [f"{100 * share:.0f} %" for share in (each.agrees, each.by_chance)]
        near = f"{each.correlation:.2f}" if isfinite(each.correlation) else "–"
        row = [each.channel, each.side, near, *shares]
        rows.append([each.trial, *row] if several else row)
    return rows
