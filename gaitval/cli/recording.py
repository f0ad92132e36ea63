"""Commands of recorded data: the built-in subjects, and an import."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer
from rich.table import Table

from gaitval.cli import display
from gaitval.cli.app import ConfigOption, SetOption, command
from gaitval.errors import ConfigurationError

if TYPE_CHECKING:
    from gaitval.scaling.landmarks import Width
    from gaitval.session.halves import Halves
    from gaitval.session.importing import Imported
    from gaitval.session.request import HipCentre

Choice = TypeVar("Choice", bound=str)


@command("gaitval subjects", "gaitval subjects --build ../shared/data/wbds --out /tmp/subjects")
def subjects(
    build: Annotated[
        Path | None,
        typer.Option(
            "--build",
            metavar="FOLDER",
            help="Compute the subjects again from the WBDS files in FOLDER.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path,
        typer.Option("--out", "-o", help="Where --build writes the subjects."),
    ] = Path("subjects"),
) -> None:
    """List the built-in subjects, or compute them again from the WBDS dataset."""
    from gaitval.datasets.subject_file import builtin_subjects

    if build is not None:
        from gaitval.datasets.wbds import build_subjects

        build_subjects(build, out)
        display.output.print(f"Wrote the subjects to {out}", highlight=False)
        return
    table = Table(title="Built-in subjects (Fukuchi, Fukuchi & Duarte 2018, CC BY 4.0)")
    for name in ("subject", "person, trial", "sex", "age", "mass kg", "height m", "speed m/s"):
        table.add_column(name)
    for person in builtin_subjects():
        table.add_row(
            person.identifier,
            person.source,
            person.sex,
            "" if person.age_years is None else f"{person.age_years:g}",
            f"{person.mass_kg:g}",
            f"{person.height_m:g}",
            f"{person.walking_speed_m_s:g}",
        )
    display.output.print(table)


StaticOption = Annotated[
    Path | None,
    typer.Option(
        "--static",
        metavar="FILE",
        help="Standing trial: C3D, TRC. Left out, a standing pose is put together from the walk.",
        show_default=False,
    ),
]
StaticTimeOption = Annotated[
    str | None,
    typer.Option(
        "--static-time",
        metavar="BEGIN:END",
        help="Part of the standing trial that counts, s.",
        show_default=False,
    ),
]
FloorOption = Annotated[
    float,
    typer.Option(
        "--floor",
        metavar="M",
        help="Height of what the person stands on in the standing trial, m above the origin.",
    ),
]
FeetOption = Annotated[
    bool,
    typer.Option(
        "--feet-not-flat",
        help="The person stands on toes or heels: put the feet flat for scaling.",
    ),
]
TrialOption = Annotated[
    list[Path],
    typer.Option(
        "--trial",
        metavar="FILE",
        help="Walking trial: C3D, TRC, WBDS mkr.txt. May be repeated; the cycles are pooled.",
        show_default=False,
    ),
]
MassOption = Annotated[
    float | None,
    typer.Option(
        "--mass", help="Body mass, kg; left out if the C3D file knows it.", show_default=False
    ),
]
HeightOption = Annotated[
    float | None,
    typer.Option(
        "--height", help="Stature, m; left out if the C3D file knows it.", show_default=False
    ),
]
OutOption = Annotated[
    Path,
    typer.Option("--out", "-o", help="Folder; the subject is named after it.", show_default=False),
]
ForcesOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--forces",
        metavar="FILE",
        help="Ground reaction (MOT, STO, WBDS grf.txt) of a trial that has none in its own "
        "file; one for each --trial.",
        show_default=False,
    ),
]
MarkerSetOption = Annotated[
    str | None,
    typer.Option(
        "--marker-set",
        help="Name of a built-in set (an unknown name lists them) or a TOML file; found by marker "
        "names if left out.",
        show_default=False,
    ),
]
AxesOption = Annotated[
    str | None,
    typer.Option(
        "--axes",
        help='Axes of the laboratory, as "forward=+x up=+y"; found from the standing trial '
        "if left out.",
        show_default=False,
    ),
]
KneeWidthOption = Annotated[
    str | None,
    typer.Option(
        "--knee-width",
        metavar="M|M,M",
        help="Knee width, m, of both sides or right,left; without medial markers.",
        show_default=False,
    ),
]
AnkleWidthOption = Annotated[
    str | None,
    typer.Option(
        "--ankle-width",
        metavar="M|M,M",
        help="Ankle width, m, of both sides or right,left; without medial markers.",
        show_default=False,
    ),
]
ElbowWidthOption = Annotated[
    str | None,
    typer.Option(
        "--elbow-width",
        metavar="M|M,M",
        help="Elbow width, m, of both sides or right,left; without medial markers.",
        show_default=False,
    ),
]
FunctionalOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--functional",
        metavar="FILE",
        help="Range-of-motion trial of the same session: functional hip centres and knee axes are "
        "compared with those of the standing trial. May be repeated.",
        show_default=False,
    ),
]
HipCentreOption = Annotated[
    str,
    typer.Option(
        "--hip-centre",
        metavar="regression|functional",
        help="Use the functional hip centres of --functional where their error is small.",
    ),
]
AgeOption = Annotated[
    float | None, typer.Option("--age", help="Years; for the report.", show_default=False)
]
CitationOption = Annotated[
    str, typer.Option("--citation", help="Where the recording is published.")
]
LicenceOption = Annotated[str, typer.Option("--licence", help="Its licence.")]
ConsistentOption = Annotated[
    bool,
    typer.Option(
        "--consistent",
        help="Make the smallest change of motion and masses that lowers the residuals.",
    ),
]
KinematicsOnlyOption = Annotated[
    bool,
    typer.Option(
        "--kinematics-only",
        help="Use no forces. The subject walks with predicted moments and forces.",
    ),
]
MirrorOption = Annotated[
    bool,
    typer.Option(
        "--mirror",
        help="Fill in a side that no trial shows with the other one's mirror image. It stays "
        "marked as not recorded.",
    ),
]
NoPlateOption = Annotated[
    list[str] | None,
    typer.Option(
        "--no-plate",
        metavar="N",
        help="Leave out a force plate, by its number or name in the file. May be repeated.",
        show_default=False,
    ),
]
HalvesOption = Annotated[
    str | None,
    typer.Option(
        "--halves",
        metavar="odd-even|first-last",
        help="Make two trials of the gait cycles. The walk is told the first and compared with "
        "the second, too.",
        show_default=False,
    ),
]
SexOption = Annotated[
    str,
    typer.Option("--sex", metavar="F|M", help="Selects the segment tables.", show_default=False),
]


@command(
    "gaitval import --static stand.c3d --trial walk.c3d --mass 74.3 --height 1.725 --sex M "
    "--out reports/mine",
    "gaitval import --static stand.trc --trial walk.trc --forces walk_grf.mot --mass 85 "
    "--height 1.83 --sex M --out reports/theirs",
    "gaitval subject reports/mine/subject.toml      # then the main job, as for a built-in subject",
    name="import",
)
def import_command(
    trial: TrialOption,
    sex: SexOption,
    out: OutOption,
    static: StaticOption = None,
    mass: MassOption = None,
    height: HeightOption = None,
    forces: ForcesOption = None,
    static_time: StaticTimeOption = None,
    floor: FloorOption = 0.0,
    feet_not_flat: FeetOption = False,
    marker_set: MarkerSetOption = None,
    axes: AxesOption = None,
    knee_width: KneeWidthOption = None,
    ankle_width: AnkleWidthOption = None,
    elbow_width: ElbowWidthOption = None,
    functional: FunctionalOption = None,
    hip_centre: HipCentreOption = "regression",
    age: AgeOption = None,
    citation: CitationOption = "Own recording, not published",
    licence: LicenceOption = "not stated",
    consistent: ConsistentOption = False,
    kinematics_only: KinematicsOnlyOption = False,
    mirror: MirrorOption = False,
    no_plate: NoPlateOption = None,
    halves: HalvesOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Turn a laboratory's own recordings into a subject: OUT/subject.toml, OUT/recording.

    Finds the axes and the marker set, cleans the markers, scales the body and fits it to the
    standing and the walking trial, and works out joint angles (inverse kinematics), joint moments
    (inverse dynamics with the measured ground reaction) and the mean gait cycle. Prints what it
    decides. OUT/recording holds a page (recording.html, recording.pdf), tables (CSV, JSON) and
    the model, motion, moments and forces as OpenSim files.
    """
    from gaitval.configuration import load_configuration
    from gaitval.session.importing import import_files
    from gaitval.session.standing import parsed_window

    with display.live_view() as live:
        imported = import_files(
            static,
            trial,
            out,
            mass=mass,
            height=height,
            sex=sex,
            configuration=load_configuration(config, settings=settings or ()),
            tell=lambda step, text: live.say(f"{step}: {text}"),
            forces=forces,
            static_time=None if static_time is None else parsed_window(static_time),
            floor=floor,
            feet_flat=not feet_not_flat,
            marker_set=marker_set,
            axes=axes,
            knee_width=_width("--knee-width", knee_width),
            ankle_width=_width("--ankle-width", ankle_width),
            elbow_width=_width("--elbow-width", elbow_width),
            functional=functional,
            hip_centre=_hip_centre(hip_centre),
            age=age,
            citation=citation,
            licence=licence,
            consistent=consistent,
            kinematics_only=kinematics_only,
            mirror=mirror,
            no_plate=no_plate,
            halves=_halves(halves),
        )
    say_what_was_made(imported, out)


def say_what_was_made(imported: "Imported", out: Path) -> None:
    """The tables, where the files are, how to go on, the doubts, and what failed."""
    from gaitval.session.write import FOLDER

    display.print_import(imported.found)
    page = out / FOLDER / "recording.html"
    display.plain(f"Page: {page} ({len(imported.files)} files beside it)")
    path = imported.subject_file
    display.plain(f"Subject: {path}; go on with: gaitval subject {path}")
    display.print_doubts(imported.found)
    if imported.subject.gait.not_recorded:
        display.plain(f"To fill the side in: {shlex.join(['gaitval', *sys.argv[1:]])} --mirror")
    display.print_import_verdict(imported.found)


def _width(option: str, text: str | None) -> "Width":
    """A width of both sides, or of right and left."""
    if text is None:
        return None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) == 1:
        return numbers[0]
    if len(numbers) == 2:
        return numbers[0], numbers[1]
    raise ConfigurationError(
        f"{option} {text}: not a width. Give metres, of both sides (0.1) or right,left (0.1,0.102)."
    )


def _hip_centre(wanted: str) -> "HipCentre":
    from gaitval.session.request import HIP_CENTRES

    return _one_of("--hip-centre", wanted, HIP_CENTRES)


def _halves(wanted: str | None) -> "Halves | None":
    from gaitval.session.halves import HALVES

    return None if wanted is None else _one_of("--halves", wanted, HALVES)


def _one_of(option: str, wanted: str, known: Sequence[Choice]) -> Choice:
    for each in known:
        if wanted == each:
            return each
    raise ConfigurationError(f"{option} {wanted}: give {' or '.join(known)}.")
