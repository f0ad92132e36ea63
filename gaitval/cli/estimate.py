"""The command that estimates the kinetics of a finished run that did not know them."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.terminal import display
from gaitval.terminal.app import added_command


@added_command("gaitval estimate reports/S05-kinematics", after="report")
def estimate(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="Folder of a finished run that knew no forces.", show_default=False
        ),
    ],
) -> None:
    """Estimate the moments and forces of a person without force plates, with bands.

    An answer, not a walk: expectation and mechanics are combined with weights from other people. A
    run of such a person has it already; this makes it for a run of before. Writes RUN/estimate/
    estimate.csv and estimate.html.
    """
    from gaitval.configuration import load_configuration
    from gaitval.datasets.subject_file import load_subject
    from gaitval.study.estimate_stage import PAGE, check, stage
    from gaitval.study.stage import open_run, run_stage

    subject = load_subject(str(run / "subject.toml"))
    configuration = load_configuration(run / "configuration.toml")
    with display.live_view() as live, open_run(subject, configuration, run, live) as opened:
        check(opened)
        run_stage(stage(opened), run, observer=live)
    display.plain(f"Estimate: {run / PAGE}")
