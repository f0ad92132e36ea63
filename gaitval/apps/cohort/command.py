"""The command that runs many studies."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from gaitval.errors import ConfigurationError, GaitvalError, ToleranceError, count_of
from gaitval.terminal import display
from gaitval.terminal.app import INTERNAL, ConfigOption, SetOption, added_command

if TYPE_CHECKING:
    from gaitval.apps.cohort.engine import CohortState
    from gaitval.apps.cohort.store import Store
    from gaitval.apps.cohort.table import Study

TABLE = "table.toml"
"""The studies of a cohort as they were run, in its folder."""


TableArgument = Annotated[
    Path | None,
    typer.Argument(metavar="[TABLE]", help="CSV or TOML, a row for each study."),
]
_ReportOut = Annotated[
    Path, typer.Option("--out", "-o", help="Folder of the report, and of the studies.")
]
AllDataOption = Annotated[
    Path | None,
    typer.Option(
        "--all-data",
        metavar="FOLDER",
        help="A study of every treadmill trial of WBDS in this folder, such as the one of "
        "`gaitval data fetch`.",
    ),
]
TrialsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--trials",
        metavar="T05",
        help="Of --all-data these treadmill trials only. May be repeated.",
    ),
]
VirtualOption = Annotated[
    int, typer.Option("--virtual", metavar="N", min=0, help="And N virtual people.")
]
TableOnlyOption = Annotated[
    bool, typer.Option("--table-only", help="Write OUT/table.toml, and run nothing.")
]
WorkersOption = Annotated[
    int | None,
    typer.Option(
        "--workers",
        min=1,
        metavar="N",
        help="Processes of this machine, or jobs; by default one for each processor.",
    ),
]
ThreadsOption = Annotated[
    int, typer.Option("--threads", min=1, metavar="N", help="Threads of each study.")
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="tls://… of a running Dask cluster, or slurm or pbs.",
    ),
]
StoreOption = Annotated[
    str | None,
    typer.Option(
        "--store",
        metavar="ADDRESS",
        help="Where studies are kept: a folder that every worker sees, or object storage "
        "(s3://…). By default OUT/studies.",
    ),
]
WithoutTlsOption = Annotated[
    bool,
    typer.Option(
        "--without-tls",
        help="Take a cluster at tcp://… too, where whoever reaches it can run programs as you.",
    ),
]
RetriesOption = Annotated[
    int,
    typer.Option(
        "--retries", min=0, metavar="N", help="How often a study is started again when it is lost."
    ),
]


@added_command(
    "gaitval cohort table.csv --out runs/cohort",
    "gaitval cohort --all-data ../shared/data --out runs/all   # every trial in a folder",
    "gaitval cohort --virtual 40 --out runs/virtual            # virtual people",
    "gaitval cohort table.csv --out runs/c --scheduler tls://10.0.0.5:8786",
    "gaitval cohort table.csv --out runs/c --scheduler slurm --workers 20",
    "gaitval cohort table.csv --out runs/c --store s3://bucket/cohort",
    after="subjects",
)
def cohort(
    table: TableArgument = None,
    out: _ReportOut = Path("reports/cohort"),
    all_data: AllDataOption = None,
    trials: TrialsOption = None,
    virtual: VirtualOption = 0,
    table_only: TableOnlyOption = False,
    workers: WorkersOption = None,
    threads: ThreadsOption = 1,
    scheduler: SchedulerOption = None,
    without_tls: WithoutTlsOption = False,
    store: StoreOption = None,
    retries: RetriesOption = 3,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Run many studies side by side, and write one report of all.

    A table has a row for each study: `subject` (or a recording to import, or a virtual person),
    and perhaps trial, seed, start (stored, general, scratch) and settings. Studies run on Dask:
    processes of this machine, a running cluster, or jobs of a batch system. A study that fails
    stops no other, and is listed with the reason. The same command resumes: a finished study whose
    inputs have not changed is not run again.

    Writes OUT/cohort.html, tables as CSV and Parquet, and a folder with a report and a log for each
    study. Exit code 2 if the input of a study was refused, 70 if one failed otherwise, else 1
    if the verdict on one lacks what decides: angles, moments or forces that were not recorded.
    """
    from gaitval.apps.cohort.engine import require

    require()
    studies = _studies(table, all_data, trials, virtual, config, settings, out)
    if table_only:
        display.plain(f"{out / TABLE}: {count_of(len(studies), 'study', 'studies')}")
        return
    from gaitval.apps.cohort.engine import run_cohort
    from gaitval.apps.cohort.store import Store

    def load() -> None:
        """Load the report of all, which takes 2 s."""
        import gaitval.apps.cohort.report  # noqa: F401

    address = store or str(out / "studies")
    with _shown() as notify:
        outcomes = run_cohort(
            studies,
            address,
            scheduler=scheduler,
            without_tls=without_tls,
            workers=workers,
            threads=threads,
            retries=retries,
            notify=notify,
            meanwhile=load,
        )
    from gaitval.apps.cohort.report import write_report

    page = write_report(out, Store(address), outcomes)
    failed = [each for each in outcomes if each["status"] != "finished"]
    for each in failed:
        display.plain(f"{each['name']}: {each['status']}: {each['reason']}")
    display.plain(f"{len(outcomes) - len(failed)} of {len(outcomes)} studies finished: {page}")
    if failed:
        faults = any(each["status"] != "refused" for each in failed)
        raise typer.Exit(INTERNAL if faults else GaitvalError.exit_code)
    if unjudged := _not_judged(Store(address), [each["name"] for each in outcomes]):
        raise ToleranceError("\n".join(f"{name}: {reason}" for name, reason in unjudged.items()))


def _not_judged(store: "Store", names: Sequence[str]) -> dict[str, str]:
    """Why the verdict on a study is none, of those of `names` in `store` whose is none."""
    found = {name: (store.summary(name) or {}).get("verdicts", {}) for name in names}
    return {name: each["not_judged"] for name, each in found.items() if each.get("not_judged")}


def _studies(
    table: Path | None,
    all_data: Path | None,
    trials: list[str] | None,
    virtual: int,
    config: Path | None,
    settings: list[str] | None,
    out: Path,
) -> "tuple[Study, ...]":
    """The studies that are asked for, written to `out`/table.toml."""
    from gaitval.apps.cohort.all_data import virtual_people, wbds_studies
    from gaitval.apps.cohort.table import (
        check_number,
        read_table,
        with_settings,
        without_doubles,
        write_table,
    )

    if table is None and all_data is None and not virtual:
        raise ConfigurationError("nothing to run. Give a TABLE, --all-data FOLDER or --virtual N.")
    if trials and all_data is None:
        raise ConfigurationError("--trials chooses from --all-data FOLDER. Give that too.")
    studies = () if table is None else read_table(table)
    if all_data is not None:
        found = wbds_studies(all_data, out / "subjects", trials=trials or ())
        for line in found.missing:
            display.messages.print(line, soft_wrap=True)
        studies += found.studies
    check_number(len(studies) + virtual, str(table or all_data or f"--virtual {virtual}"))
    studies += virtual_people(virtual)
    wanted = with_settings(studies, settings or (), None if config is None else str(config))
    wanted = without_doubles(wanted, str(table or all_data or "--virtual"))
    write_table(out / TABLE, wanted)
    return wanted


@contextmanager
def _shown() -> "Iterator[Any]":
    """Shows how far a cohort is: a bar on a terminal, a line for each study that is done."""
    console = display.messages
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[told]}"),
        TimeElapsedColumn(), console=console, transient=True, disable=not console.is_terminal,
    )  # fmt: skip
    task = bar.add_task("studies", total=None, told="")
    dashboards: set[str] = set()

    def notify(state: "CohortState") -> None:
        if state.dashboard and state.dashboard not in dashboards:
            dashboards.add(state.dashboard)
            display.messages.print(f"Dask's dashboard: {state.dashboard}", soft_wrap=True)
        if state.looked:
            console.print(f"{state.looked} of {state.total} studies looked at", soft_wrap=True)
        message = progress_line(state)
        bar.update(task, total=state.total, completed=state.done, told=message)
        if state.outcome is not None or (state.found and not state.workers):
            console.print(outcome_line(state), soft_wrap=True)

    with bar:
        yield notify


def progress_line(state: "CohortState") -> str:
    """How many studies are done in `state`, and when the others will be."""
    failed = f", {state.failed} failed" if state.failed else ""
    left = "" if state.left is None else f", about {display.duration(state.left)} left"
    return f"{state.done} of {state.total}{failed}, {count_of(state.workers, 'worker')}{left}"


def outcome_line(state: "CohortState") -> str:
    """What has just become of a study in `state`, and how far the cohort is."""
    each = state.outcome
    if each is None:
        finished = state.found - state.refused
        known = [f"{finished} of {state.total} studies are finished already"] if finished else []
        known += [f"{state.refused} of {state.total} are refused"] if state.refused else []
        return "; ".join(known)
    what = (
        f"{display.duration(each['seconds'])}, {each['peak_memory'] / 1e6:.0f} MB"
        if each["status"] == "finished"
        else f"{each['status']}: {each['reason']}"
    )
    return f"{each['name']}: {what} ({progress_line(state)})"
