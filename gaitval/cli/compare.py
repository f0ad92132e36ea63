"""`gaitval compare`: many walks in one report, and what changed between two versions."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import added_command
from gaitval.errors import ConfigurationError, ToleranceError


@added_command(
    "gaitval compare reports                  # all runs and baselines below reports/",
    "gaitval compare reports/S05 runs/patient --out comparison",
    "gaitval compare runs/new --before runs/old --strict",
    after="report",
)
def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Run folders, stored baselines, or folders that contain some.",
        ),
    ],
    before: Annotated[
        list[Path] | None,
        typer.Option(
            "--before",
            metavar="FOLDER",
            help="The same of an earlier version, matched by subject. May be repeated.",
        ),
    ] = None,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict",
            help="Exit code 1 if a measure got worse by more than its margin, or if a subject of "
            "--before has no walk now.",
        ),
    ] = False,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the report.")] = Path(
        "comparison"
    ),
) -> None:
    """Put many walks into one report: comparison.html, comparison.pdf, and tables as CSV.

    Tables by subject, each curve of all people side by side, and, with --before, what improved and
    what got worse. A change counts only beyond the margin of its measure, which is that of a stored
    baseline where --before is one. Nothing is simulated.
    """
    from gaitval.apps.regression.collect import collect, collect_versions
    from gaitval.apps.regression.comparison_page import write_comparison
    from gaitval.apps.regression.versions import matched
    from gaitval.cli.moved import print_moved

    if strict and not before:
        raise ConfigurationError("--strict needs an earlier version: add --before FOLDER.")
    walks = collect(runs)
    versions = matched(*collect_versions(before, walks)) if before else None
    write_comparison(out, "comparison", walks, versions)
    display.plain(f"Walks: {len(walks)}. Report: {out / 'comparison.html'}, .pdf and .csv")
    if versions is None:
        return
    worse, improved = versions.lost(), versions.improved()
    print_moved([row for _, row in (*worse, *improved)])
    missing = versions.only_before
    count = sum(len(pair.rows) for pair in versions.pairs)
    message = f"{len(worse)} of {count} measures got worse "
    message += f"by more than their margin, {len(improved)} better"
    message += f"; no walk now of {', '.join(missing)}" if missing else ""
    other = [pair.now.subject for pair in versions.pairs if not pair.same_record]
    message += f"; compared with another record than before: {', '.join(other)}" if other else ""
    if not strict or not (worse or missing):
        display.plain(message)
        return
    raise ToleranceError(
        f"{message}. The report in {out} says which; if the change is intended, compare with a "
        "baseline of the new version."
    )
