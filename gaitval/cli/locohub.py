"""The command that makes subjects of a LocoHub file."""

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from gaitval.terminal import display
from gaitval.terminal.app import added_command

FileArgument = Annotated[
    Path,
    typer.Argument(metavar="FILE", help="DATASET_phase.parquet."),
]
_SubjectsOut = Annotated[
    Path,
    typer.Option("--out", "-o", metavar="FOLDER", help="Of the subjects."),
]
PersonOption = Annotated[
    list[str] | None,
    typer.Option("--subject", metavar="NAME", help="Only this one. May be repeated."),
]
FillOption = Annotated[
    bool,
    typer.Option(
        "--fill-missing",
        help="Let the mean of the built-in subjects stand in for angles that the file lacks.",
    ),
]


def _number(name: str, unit: str, text: str) -> object:
    return typer.Option(name, metavar=unit, help=text)


@added_command(
    "gaitval locohub umich_2021_phase.parquet --fill-missing --out subjects",
    "gaitval locohub gtech_2023_phase.parquet --subject GT23_AB01 --sex M --out subjects",
    after="subjects",
)
def locohub(
    file: FileArgument,
    out: _SubjectsOut,
    subject: PersonOption = None,
    task: Annotated[str, typer.Option("--task", help="LocoHub's name.")] = "level_walking",
    fill_missing: FillOption = False,
    mass: Annotated[float | None, _number("--mass", "KG", "Where the file has none.")] = None,
    height: Annotated[float | None, _number("--height", "M", "Likewise.")] = None,
    sex: Annotated[str | None, _number("--sex", "F|M", "Likewise.")] = None,
    age: Annotated[float | None, _number("--age", "YEARS", "Likewise.")] = None,
    leg_length: Annotated[
        float | None, _number("--leg-length", "M", "Hip to floor; else 0.53 of the stature.")
    ] = None,
    speed: Annotated[float | None, _number("--speed", "M/S", "Where the file has none.")] = None,
    stride_time: Annotated[
        float | None, _number("--stride-time", "S", "Where no velocities show it.")
    ] = None,
    stance: Annotated[
        float | None, _number("--stance", "FRACTION", "Of the cycle, without forces.")
    ] = None,
    citation: Annotated[str | None, _number("--citation", "TEXT", "Where it is published.")] = None,
    licence: Annotated[str | None, _number("--licence", "TEXT", "Of the data set.")] = None,
) -> None:
    """Turn the people of a LocoHub file into subjects: OUT/NAME.toml.

    Reads phase-indexed Parquet (150 points a cycle). Each person's settings become trials of one
    subject. Signs, units and sides are checked. Mass, stature, sex, speed and stride time come from
    the file where it has them. Who cannot be used is named with the reason; the exit code is 2 if
    nobody can.
    """
    from gaitval.datasets.locohub_subject import GivenFacts, write_subjects

    given = GivenFacts(
        mass, height, sex, age, leg_length, speed, stride_time, stance,
        **{k: v for k, v in (("citation", citation), ("licence", licence)) if v is not None},
    )  # fmt: skip
    written, refused = write_subjects(
        file, out, task=task, people=subject or (), given=given, fill_missing=fill_missing,
        notify=display.plain,
    )  # fmt: skip
    for name, reason in refused.items():
        display.plain(f"{name}: not used: {reason}")
    for path in written:
        display.plain(f"Subject: {path}; continue with: gaitval subject {quote(str(path))}")
    if not written:
        raise typer.Exit(2)
