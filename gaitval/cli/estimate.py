"""The command that estimates the kinetics of a finished run that did not know them."""

from pathlib import Path
from typing import Annotated, Final

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import added_command
from gaitval.errors import ConfigurationError

INSOLE_ERROR: Final = 5.0
"""% of body weight. Peaks by one make of insoles were up to 4 % and impulses 4 to 6 % off in eleven
healthy people (Cramer et al. 2022, Sensors 22:2203, abstract)."""
INSOLE_COLUMNS: Final = ("force_right", "force_left")


@added_command(
    "gaitval estimate reports/S05-kinematics",
    "gaitval estimate reports/mine --insoles walk.csv   # vertical forces that insoles measured",
    after="report",
)
def estimate(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="Folder of a finished run that knew no forces."),
    ],
    insoles: Annotated[
        Path | None,
        typer.Option(
            help="Forces by insoles in this walk: CSV with a column time (s), MOT or STO.",
            metavar="FILE",
        ),
    ] = None,
    insole_columns: Annotated[
        tuple[str, str],
        typer.Option(help="Their vertical forces, N.", metavar="RIGHT LEFT"),
    ] = INSOLE_COLUMNS,
    insole_error: Annotated[
        float,
        typer.Option(
            help="What insoles are off, standard deviation, % of body weight.",
            metavar="PERCENT",
            min=0.5,
            max=30.0,
        ),
    ] = INSOLE_ERROR,
) -> None:
    """Estimate the moments and forces of a person without force plates, with bands.

    An answer, not a walk: expectation and mechanics are combined with weights from other people. A
    run of such a person has it already; this makes it for a run of before, or with forces that
    insoles measured, which it keeps: delete RUN/estimate/insoles.json to do without them again.
    Writes RUN/estimate/estimate.csv and estimate.html.
    """
    from gaitval.configuration import load_configuration
    from gaitval.gait.insoles import read_insoles
    from gaitval.study.estimate_stage import PAGE, check, keep_insoles, stage
    from gaitval.study.stage import open_run, run_stage
    from gaitval.subjects.subject_file import load_subject

    if insoles is None and (insole_columns, insole_error) != (INSOLE_COLUMNS, INSOLE_ERROR):
        raise ConfigurationError(
            "--insole-columns and --insole-error say something of a file of insoles, and there is "
            "none. Give it with --insoles, or leave them out."
        )
    subject = load_subject(str(run / "subject.toml"))
    configuration = load_configuration(run / "configuration.toml")
    with display.live_view() as live, open_run(subject, configuration, run, live) as opened:
        check(opened)
        if insoles is not None:
            read = read_insoles(
                insoles,
                mass=subject.mass_kg,
                stride_time=subject.stride_time_s,
                error=insole_error / 100.0,
                columns=insole_columns,
            )
            keep_insoles(opened, read)
            display.plain(
                f"Insoles: {read.strides[0]} right and {read.strides[1]} left strides, forces "
                f"divided by {read.gain:.3f}, so that both feet carry the weight in a stride."
            )
        run_stage(stage(opened), run, observer=live)
    display.plain(f"Estimate: {run / PAGE}")
