"""The command that makes a subject of mean curves."""

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import CommandFunction, added_command
from gaitval.errors import ConfigurationError

CurveFilesArgument = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="FILE...",
        help="Mean curves of one trial: CSV, or WBDS ang.txt and knt.txt. With "
        "--template, the CSV file to write (means.csv).",
    ),
]
TemplateOption = Annotated[
    bool,
    typer.Option(
        "--template",
        help="Write a CSV file with all columns, their units, and the curves of S05, to fill in.",
    ),
]
_SpeedOption = Annotated[
    float | None,
    typer.Option("--speed", metavar="M/S", help="Walking speed."),
]
StrideTimeOption = Annotated[
    float | None,
    typer.Option("--stride-time", metavar="S", help="Mean stride time."),
]
SubjectFileOption = Annotated[
    Path | None, typer.Option("--out", "-o", help="Subject's file to write.")
]
ToOption = Annotated[
    Path | None,
    typer.Option("--to", help="Subject's file to add the trial to, instead."),
]
TrialNameOption = Annotated[str, typer.Option("--trial-name", help="Of the trial.")]
OptionalMassOption = Annotated[float | None, typer.Option("--mass", help="Body mass, kg.")]
OptionalHeightOption = Annotated[float | None, typer.Option("--height", help="Stature, m.")]
LegLengthOption = Annotated[
    float | None, typer.Option("--leg-length", help="From hip to floor, m.")
]
OptionalSexOption = Annotated[
    str | None,
    typer.Option("--sex", metavar="F|M", help="Selects segment tables."),
]
TapeOption = Annotated[
    list[str] | None,
    typer.Option(
        "--tape",
        metavar="LENGTH=M",
        help="hip_height, thigh, shank, ankle_height, foot or pelvis_width by tape measure; "
        "those not given follow from stature. May be repeated.",
    ),
]
AngleUnitOption = Annotated[
    str,
    typer.Option("--angle-unit", metavar="deg|rad", help="Of angles whose columns do not say it."),
]
StanceOption = Annotated[
    float | None,
    typer.Option("--stance", help="Stance fraction of the cycle, without forces."),
]


def _with_person_options(function: CommandFunction) -> CommandFunction:
    from gaitval.cli.terminal.model_options import with_fields
    from gaitval.session.request import ImportOptions

    about = ("person", "laboratory", "age", "citation", "licence")
    return with_fields(function, ImportOptions, *about)


@added_command(
    "gaitval curves --template     # writes means.csv, to fill in",
    "gaitval curves WBDS03walkT05ang.txt WBDS03walkT05knt.txt --speed 1.2 --stride-time 1.08 "
    "--mass 70 --height 1.75 --leg-length 0.9 --sex M --trial-name T05 --out wbds03.toml",
    "gaitval curves means.csv --speed 1.2 --stride-time 1.08 --mass 70 --height 1.75 "
    "--leg-length 0.9 --sex F --tape thigh=0.41 --tape shank=0.40 --out mine.toml",
    "gaitval curves slow.csv --speed 0.8 --stride-time 1.3 --trial-name slow --to mine.toml",
    after="subjects",
    complete=_with_person_options,
)
def curves(
    files: CurveFilesArgument = None,
    speed: _SpeedOption = None,
    stride_time: StrideTimeOption = None,
    template: TemplateOption = False,
    out: SubjectFileOption = None,
    to: ToOption = None,
    trial_name: TrialNameOption = "walk",
    mass: OptionalMassOption = None,
    height: OptionalHeightOption = None,
    leg_length: LegLengthOption = None,
    sex: OptionalSexOption = None,
    tape: TapeOption = None,
    angle_unit: AngleUnitOption = "deg",
    stance: StanceOption = None,
    **about: Any,
) -> None:
    """Turn mean curves into a subject, or into a further trial of one.

    Tables have 101 rows, 0 to 100 % of each side's own gait cycle, and columns named by kind and
    coordinate: angle_hip_flexion_r (degrees), moment_knee_angle_l (Nm/kg, internal), force_up_r
    (body weights). Signs are flexion, dorsiflexion, adduction, inversion, internal rotation,
    anterior tilt, own side up and own side forward; moments are positive where they increase the
    angle; forces of the ground on the foot forward, left, up. docs/how-to/own-subject.md has all
    names. Signs, units and sides are checked. Without moments and forces the walk predicts them.
    """
    from gaitval.subjects.curve_subject import PersonDetails, add_trial, new_subject

    if template:
        _write_template(files or [])
        return
    if not files or speed is None or stride_time is None:
        needed = (("a FILE", files), ("--speed", speed), ("--stride-time", stride_time))
        missing = ", ".join(name for name, value in needed if not value)
        raise ConfigurationError(
            f"{missing}: missing. `gaitval curves --template` writes a FILE to fill in."
        )
    if (out is None) == (to is None):
        raise ConfigurationError("give one of --out (a new subject) and --to (a further trial).")
    trial = {
        "name": trial_name,
        "speed": speed,
        "stride_time": stride_time,
        "stance": stance,
        "angle_unit": angle_unit,
        "notify": display.plain,
    }
    if to is not None:
        path = add_trial(files, to, **trial)
    else:
        assert out is not None
        person = PersonDetails(mass, height, leg_length, sex, tape=tape or (), **about)
        path = new_subject(files, out, person, **trial)
    display.plain(f"Subject: {path}; continue with: gaitval subject {quote(str(path))}")


def _write_template(files: Sequence[Path]) -> None:
    """Write the table to fill in, and print the next step."""
    from gaitval._internal.io.artefacts import write_text
    from gaitval.subjects.curve_template import curve_template
    from gaitval.subjects.subject_file import load_subject

    if len(files) > 1:
        raise ConfigurationError("--template writes one FILE.")
    path = files[0] if files else Path("means.csv")
    if path.exists():
        raise ConfigurationError(f"{path}: exists. Give another name.")
    if path.suffix.lower() != ".csv":
        raise ConfigurationError(f"{path}: give the name of a .csv file for the template.")
    person = load_subject("S05")
    write_text(path, curve_template(person))
    display.plain(
        f"Template: {path} (names, units and the curves of {person.identifier}). Fill in your own, "
        f"then: gaitval curves {quote(str(path))} --speed {person.walking_speed_m_s:g} "
        f"--stride-time {person.stride_time_s:g} --mass {person.mass_kg:g} "
        f"--height {person.height_m:g} --leg-length {person.leg_length_m:g} --sex {person.sex} "
        "--out mine.toml"
    )
