"""The command that makes subjects of patients' strides, and walks them."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import added_command

if TYPE_CHECKING:
    from gaitval.apps.patients.records import Patient

StridesArgument = Annotated[
    Path,
    typer.Argument(
        metavar="STRIDES",
        help="CSV: group, subject, trial, side, angle, p0 to p100 in degrees.",
    ),
]
_FolderOut = Annotated[Path, typer.Option("--out", "-o", metavar="FOLDER", help="Folder to write.")]
PeopleOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--people",
        metavar="TABLE",
        help="CSV of sex, age, mass, stature and what else is known. May be repeated.",
    ),
]
_SpeedOption = Annotated[
    list[str] | None,
    typer.Option(
        "--speed",
        metavar="WHO=M/S",
        help="Walking speed of a group or a person, if the tables do not have it.",
    ),
]
HealthyOption = Annotated[
    list[str] | None,
    typer.Option("--healthy", metavar="GROUP", help="Group of healthy people."),
]
OnlyOption = Annotated[
    list[str] | None,
    typer.Option("--only", metavar="WHO", help="This group or person. May be repeated."),
]
WalkOption = Annotated[
    bool, typer.Option("--walk", help="Walk them by the general policy, without training.")
]


@added_command(
    "gaitval patients strides.csv --people people.csv --out runs/patients",
    "gaitval patients strides.csv --people people.csv --speed transfemoral_amputee=0.8 "
    "--out runs/patients --walk",
    "gaitval cohort runs/patients/table.csv --out runs/cohort   # then, the main job of each",
    after="subjects",
)
def patients(
    strides: StridesArgument,
    out: _FolderOut,
    people: PeopleOption = None,
    speed: _SpeedOption = None,
    healthy: HealthyOption = None,
    only: OnlyOption = None,
    walk: WalkOption = False,
    citation: Annotated[str, typer.Option("--citation", help="Of the strides.")] = "not given",
    licence: Annotated[str, typer.Option("--licence", help="Of the strides.")] = "not given",
) -> None:
    """Make subjects of one stride a side, of people of whom nothing else was recorded.

    Speed, stride time, stance and leg length that are not known are estimated, with intervals.
    Nothing is mirrored: a side that lacks an angle is refused. Writes OUT/subjects/NAME.toml,
    OUT/table.csv for `gaitval cohort`, and OUT/pages/NAME/ with scores and norms as page, JSON and
    CSV; with --walk also OUT/walks/NAME.json. The same command continues where it was interrupted.
    """
    from gaitval._internal.io.folder_lock import locked
    from gaitval.apps.patients.cohort import found_patients, written

    found = found_patients(
        strides,
        people or [],
        speed or [],
        healthy or [],
        only or [],
        citation=citation,
        licence=licence,
    )
    with locked(out):
        table = written(found, out)
        _say(found, people or [])
        walks = None
        if walk:
            from gaitval.apps.patients.cohort import walked

            walks = walked(found, out, display.messages.print)
            fallen = [each["name"] for each in walks if each["falls"]]
            display.plain(
                f"Walks without a fall from any start: {len(walks) - len(fallen)} of {len(walks)}"
                + (f"; not {', '.join(fallen)}" if fallen else "")
            )
        from gaitval.apps.patients.page import write_pages

        pages = write_pages(found, walks, out)
        display.plain(f"Subjects ({len(found)}): {table}; pages: {pages}")


def _say(found: "Sequence[Patient]", people: Sequence[Path]) -> None:
    """Who has no row, what may be wrong with the strides, and what was estimated."""
    from gaitval.apps.patients.strides import doubts
    from gaitval.subjects.plausible import unusual_build

    def say(text: str) -> None:
        display.messages.print(text, soft_wrap=True)

    nobody = [each.strides.subject for each in found if not each.person.table]
    if nobody and people:
        say(f"{', '.join(nobody)}: no row in the tables of people; body estimated.")
    for each in found:
        who = each.subject
        for warning in unusual_build(who.mass_kg, who.height_m, who.age_years):
            say(f"{each.strides.subject}: {warning.message}.")
    for doubt in doubts([each.strides for each in found]):
        say(f"Warning: {doubt}.")
    names = dict.fromkeys(
        name.replace("_", " ")
        for each in found
        for name, estimate in each.estimates.items()
        if estimate.sd > 0.0
    )
    say(f"Estimated of some or all, with intervals on the pages: {', '.join(names)}.")
