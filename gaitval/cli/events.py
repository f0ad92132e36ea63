"""The command that shows when the feet land and leave, by every method."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.errors import count_of
from gaitval.terminal import display
from gaitval.terminal.app import added_command


@added_command(
    "gaitval events walk.c3d --standing stand.c3d       # walk_events.svg",
    "gaitval events walk.trc --forces walk.mot --out landings.png",
    after="subjects",
)
def events(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Walking trial.")],
    standing: Annotated[
        Path | None,
        typer.Option("--standing", metavar="FILE", help="Standing trial of the person."),
    ] = None,
    forces: Annotated[
        Path | None,
        typer.Option(
            "--forces",
            metavar="FILE",
            help="Forces, if the trial's file has none.",
        ),
    ] = None,
    marker_set: Annotated[
        str | None,
        typer.Option("--marker-set", metavar="SET", help="Marker set, or its file."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE.svg", help="Picture."),
    ] = None,
) -> None:
    """Show when each foot lands and leaves, by plates, markers and the file, in one picture.

    Says where two of them are more than 40 ms apart. Where both feet are on one plate their forces
    cannot be divided, but the sum of all plates is shown, and the mass that it carries over every
    stride that is on plates as a whole.
    """
    import numpy as np

    from gaitval.checks.landings import disagreements, landings
    from gaitval.configuration import load_configuration
    from gaitval.errors import RecordError
    from gaitval.mocap.axes import detect_axes
    from gaitval.mocap.reading import read_recording
    from gaitval.reporting.landings_picture import draw
    from gaitval.scaling.marker_sets import load_marker_set, recognise
    from gaitval.session.read import named, prepared

    picture = out or Path(f"{file.stem}_events.svg")
    if picture.suffix not in (".svg", ".png", ".pdf"):
        raise RecordError(f"--out {picture}: the name of a picture ends in .svg, .png or .pdf.")
    walk = read_recording(file, forces=forces)
    still = walk if standing is None else read_recording(standing, plates=False)
    known = load_marker_set(marker_set) if marker_set else recognise(still.names)
    landmarks = dict(known.landmarks)
    axes = detect_axes(named(still, known), landmarks)
    processing = load_configuration().processing
    ready = prepared(named(walk, known).turned(axes.rotation), known, processing, file)
    found = landings(ready, landmarks, processing)
    draw(found, landmarks, picture, f"Events of {file.name}")
    apart = list(disagreements(found))
    count = ", ".join(f"{len(each)} by the {method}" for method, each in found.events.items())
    display.plain(f"Events: {count}; {len(apart)} on which two of them disagree.")
    for each in apart:
        display.plain(f"  {each}")
    if found.shared.any():
        seconds = float(found.shared.sum()) / ready.force_rate
        display.plain(f"Both feet are on one plate for {seconds:.1f} s: only their sum is known.")
    carried = found.carried()
    if carried:
        display.plain(
            f"Over {count_of(len(carried), 'stride')} on plates as a whole, these carry "
            f"{np.median(carried):.1f} kg (median; {min(carried):.1f} to {max(carried):.1f})."
        )
    elif len(found.time):
        display.plain(
            "No stride is on plates as a whole, so the mass that they carry is not known."
        )
    display.plain(f"Picture: {picture}")
