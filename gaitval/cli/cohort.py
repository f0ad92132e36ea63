"""The command that runs many studies."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import INTERNAL, ConfigOption, SetOption, added_command
from gaitval.errors import GaitvalError, ToleranceError

if TYPE_CHECKING:
    from gaitval.apps.cohort.run import Outcome

TableArgument = Annotated[
    Path, typer.Argument(metavar="TABLE", help="CSV with a row for each study.")
]
_ReportOut = Annotated[
    Path, typer.Option("--out", "-o", help="Folder of the report, and of the studies.")
]
WorkersOption = Annotated[
    int | None,
    typer.Option(
        "--workers", min=1, metavar="N",
        help="Studies at once on this machine; by default one for each processor.",
    ),
]  # fmt: skip
ThreadsOption = Annotated[
    int, typer.Option("--threads", min=1, metavar="N", help="Threads of each study.")
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler", metavar="ADDRESS",
        help="Of a running Dask cluster; certificates come from Dask's own configuration.",
    ),
]  # fmt: skip


@added_command(
    "gaitval cohort table.csv --out runs/cohort",
    "gaitval cohort table.csv --out /shared/run --scheduler tls://10.0.0.5:8786",
    after="subjects",
)
def cohort(
    table: TableArgument,
    out: _ReportOut = Path("reports/cohort"),
    workers: WorkersOption = None,
    threads: ThreadsOption = 1,
    scheduler: SchedulerOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Run many studies side by side, and write one report of all.

    A table has a row for each study: `subject`, and perhaps name, trial, seed, start (general,
    scratch) and settings. A study that fails stops no other, and is listed with the reason. The
    same command resumes: stages that are up to date are skipped.

    Writes OUT/cohort.html, studies.csv and groups.csv, and for each study a folder with a report
    and a log. Exit code 2 if the input of a study was refused, 70 if one failed otherwise, else 1
    if the verdict on one lacks what decides: angles, moments or forces that were not recorded.
    """
    from gaitval.apps.cohort.run import run_cohort
    from gaitval.apps.cohort.table import read_table

    studies = [
        each.model_copy(update={"settings": (*(settings or ()), *each.settings)})
        for each in read_table(table)
    ]
    outcomes: list[Outcome] = []
    console = display.messages
    bar = Progress(
        "studies", BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        console=console, transient=True, disable=not console.is_terminal,
    )  # fmt: skip
    with bar:
        task = bar.add_task("studies", total=len(studies))
        for each in run_cohort(
            studies, out, scheduler=scheduler, workers=workers, threads=threads, config=config
        ):
            outcomes.append(each)
            bar.update(task, completed=len(outcomes))
            display.plain(f"[{len(outcomes)} of {len(studies)}] {_line(each)}", to=console)
    from gaitval.apps.cohort.report import unjudged, write_report

    page = write_report(out, studies, outcomes)
    failed = [each for each in outcomes if each.status != "finished"]
    display.plain(f"{len(outcomes) - len(failed)} of {len(outcomes)} studies finished: {page}")
    if failed:
        faults = any(each.status != "refused" for each in failed)
        raise typer.Exit(INTERNAL if faults else GaitvalError.exit_code)
    if without := unjudged(out, outcomes):
        raise ToleranceError("\n".join(f"{name}: {reason}" for name, reason in without.items()))


def _line(each: "Outcome") -> str:
    if each.status != "finished":
        return f"{each.name}: {each.status}: {each.reason}"
    return f"{each.name}: {display.duration(each.seconds)}, {each.peak_memory / 1e6:.0f} MB"
