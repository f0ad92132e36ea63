"""The command that drafts a marker set."""

import os
import shlex
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from gaitval.errors import RecordError, ScalingError
from gaitval.terminal import display
from gaitval.terminal.app import added_command

if TYPE_CHECKING:
    from gaitval.mocap.recording import Recording
    from gaitval.scaling.markers.draft import Draft

MOST: Final = 120
"""Points that are matched; more markers than anybody wears. With 144, most of them ends of muscles
that a program computed, the search did not end in ten minutes."""


@added_command(
    "gaitval markers walk.c3d --standing stand.c3d     # walk_markers.toml and .svg",
    "gaitval markers walk.trc --out my_laboratory.toml",
    after="subjects",
)
def markers(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="Walking trial, or any other."),
    ],
    standing: Annotated[
        Path | None,
        typer.Option("--standing", metavar="FILE", help="Standing trial of the person."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE.toml",
            help="Marker set to write; the picture goes beside it.",
        ),
    ] = None,
) -> None:
    """Draft a marker set: which marker lies where on the body.

    Guesses from the names (several languages and systems), from where the markers are on the
    standing person, and from which of them keep their distances in walking. Writes the set, a
    picture of the labelled body with each guess's certainty, and prints the command that goes on.
    A guess below 95 % (80 % where its name says the same place), or one that its name contradicts,
    is written as a comment for you to judge.
    """
    from gaitval._internal.io.artefacts import write_text
    from gaitval.scaling.markers.draft import draft_markers
    from gaitval.scaling.markers.files import as_toml
    from gaitval.scaling.markers.picture import draw

    target, picture = _new_files(out or Path(f"{file.stem}_markers.toml"))
    walking, still = _read(file, standing)
    with warnings.catch_warnings():
        # A marker that is never seen has no mean place: NaN, as it should be.
        warnings.simplefilter("ignore", category=RuntimeWarning)
        draft = draft_markers(walking, still)
    title = f"Markers of {(standing or file).name}"
    write_text(target, as_toml(draft, title, "drafted by gaitval markers"))
    draw(draft, picture, title)
    _say_guesses(draft)
    _say_whether_complete(draft, target)
    display.plain(f"Picture: {picture}")
    given = ["gaitval", "import", "--trial", str(file), "--marker-set", str(target)]
    if standing is not None:
        given[2:2] = ["--static", str(standing)]
    display.plain(
        f"Look at it, correct {target}, and go on with: {shlex.join(given)} --mass KG --height M "
        "--sex F|M --out FOLDER"
    )


def _new_files(target: Path) -> tuple[Path, Path]:
    """The marker set and its picture, of which neither may be there."""
    if target.suffix != ".toml":
        raise RecordError(f"--out {target}: the name of a marker set ends in .toml.")
    picture = target.with_suffix(".svg")
    for path in (target, picture):
        if os.path.exists(path):  # False also for a name that is too long
            raise RecordError(
                f"{path} is there, and may have been corrected by hand. Give another --out, or "
                "remove it."
            )
    return target, picture


def _read(file: Path, standing: Path | None) -> "tuple[Recording, Recording | None]":
    """The walking and the standing trial, of no more markers than anybody wears."""
    from gaitval.mocap.reading import read_recording

    walking = read_recording(file, plates=False)
    still = None if standing is None else read_recording(standing, plates=False)
    count = len((still or walking).names)
    if count > MOST:
        raise RecordError(
            f"{standing or file}: {count} points, more than the {MOST} that are matched to a body. "
            "Most must be what a program computed, such as joint centres or the ends of muscles: "
            "export the trial with its labelled markers only."
        )
    return walking, still


def _say_guesses(draft: "Draft") -> None:
    """How many guesses are used, which are not, and whether names and person helped."""
    from gaitval.scaling.markers.draft import DRAFT
    from gaitval.scaling.markers.files import MIRRORED, UNRECOGNISED, sentence_of
    from gaitval.scaling.unrecognised import unlabelled

    if without := unlabelled([guess.name for guess in draft.guesses]):
        display.plain(
            f"Warning:{without} Numbers go to other markers in the next file, and may change "
            "within one, so a set drafted from them is of this file alone.",
            "yellow",
        )
    if draft.mirrored:
        display.plain(MIRRORED)
    elif not draft.names_count and draft.names_agree == draft.names_agree:
        display.plain(
            f"Names: only {draft.names_agree:.0%} of those that say a place agree with where their "
            "markers are, so names were not used: labels may be exchanged."
        )
    if not (draft.recognised or draft.mirrored):
        display.plain(f"{UNRECOGNISED} Give a --standing in which the person does.")
    used = sum(guess.used for guess in draft.guesses)
    display.plain(
        f"{used} of {len(draft.guesses)} markers: at least {DRAFT.certain:.0%} certain, or "
        f"{DRAFT.certain_by_name:.0%} where the name says the same place; used. On arms and "
        "forefeet, "
        "and where the other side has none, only if the name says so."
    )
    for guess in draft.guesses:
        if not guess.used:
            display.plain(f"  not used: {guess.name}: {sentence_of(guess)}")


def _say_whether_complete(draft: "Draft", target: Path) -> None:
    """Whether the guesses that are used are enough to import with the set at `target`."""
    from gaitval.scaling.landmarks import landmarks_of
    from gaitval.scaling.markers.spines import spines_of

    sites = [(each.site, each.at) for each in draft.guesses if each.used]
    points = {site.landmark: at for site, at in sites if site and site.landmark}
    if draft.by_crests:
        spines = spines_of({site.label: at for site, at in sites if site})
        points |= {} if spines is None else spines.places
        display.plain(
            "No marker is on the anterior spines of the pelvis (ASIS): they are estimated from the "
            "crests and what is behind, and the tilt of the pelvis is uncertain by several degrees."
        )
    try:
        landmarks_of(points, None, None)
    except ScalingError as error:
        display.plain(
            f"Not to be imported yet: {str(error).partition('. ')[0]}. Take the # away from the "
            f"lines of {target} that are right; without medial markers give --knee-width and "
            "--ankle-width."
        )
