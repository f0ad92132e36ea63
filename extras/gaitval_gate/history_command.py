"""`gaitval history`: the figures of all checks over commits."""

from pathlib import Path
from typing import Annotated

import typer

from gaitval.cli import display
from gaitval.cli.app import added_command


@added_command(
    "gaitval check --baseline reports/S05/baseline --quick --history accuracy.db",
    "gaitval history accuracy.db",
    "gaitval history accuracy.db --add-benchmarks .benchmarks/times.json",
    after="baseline",
)
def history(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="A file that `gaitval check --history` has written.",
            show_default=False,
        ),
    ],
    benchmarks: Annotated[
        list[Path] | None,
        typer.Option(
            "--add-benchmarks",
            metavar="JSON",
            help="First add the times of this file of `pytest --benchmark-json`. May be repeated.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", help="Folder for the page; by default that of FILE.", show_default=False
        ),
    ] = None,
) -> None:
    """Draw the figures of checks over commits, and find the commits at which they took a step.

    Writes a page, HTML and PDF, with every figure that ever changed, and a CSV file with all
    values. A step is a change too large for the scatter before and after it; one that is worse by
    more than the margin of its measure is marked. With fewer than six checks nothing is looked for.
    """
    from gaitval_gate import history as histories
    from gaitval_gate.history_page import short, write_history

    checks = [histories.read_benchmarks(path) for path in benchmarks or ()]
    for path, check in zip(benchmarks or (), checks, strict=True):
        added = histories.add(file, check)
        display.plain(
            f"{path}: {len(check.figures)} times{'' if added else ', were there already'}"
        )
    kept = histories.read(file)
    folder = out or file.parent
    steps = write_history(folder, file.stem, kept)
    rows = [
        [short(step.revision), step.subject, f"{step.measure} {step.target}",
         f"{step.before:.4g}", f"{step.after:.4g}", step.unit, step.change]
        for step in steps
    ]  # fmt: skip
    if rows:
        header = ["commit", "subject", "figure", "before", "after", "unit", "change"]
        display.print_rows([header, *rows], "Commits at which a figure took a step")
    display.plain(
        f"{len(kept)} checks, {len(steps)} steps. Page: {folder / file.stem}.html, .pdf and .csv"
    )
