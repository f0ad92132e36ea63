"""`gaitval history`: the figures of all checks over commits."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.errors import count_of
from gaitval.terminal import display
from gaitval.terminal.app import added_command

if TYPE_CHECKING:
    from gaitval.apps.regression.history_page import FoundStep


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
        ),
    ],
    benchmarks: Annotated[
        list[Path] | None,
        typer.Option(
            "--add-benchmarks",
            metavar="JSON",
            help="First add the times of this file of `pytest --benchmark-json`. May be repeated.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Folder for the page; by default that of FILE."),
    ] = None,
) -> None:
    """Draw the figures of checks over commits, and find the commits at which they took a step.

    Writes a page, HTML and PDF, with every figure that ever changed, and a CSV file with all
    values. A step is a change too large for the scatter before and after it; one that is worse by
    more than the margin of its measure is marked. With fewer than six checks nothing is looked for
    but figures that could no longer be measured.
    """
    from gaitval.apps.regression import history as histories
    from gaitval.apps.regression.history_page import write_history

    folder = out or file.parent
    histories.check_outputs(file, folder)
    checks = [histories.read_benchmarks(path) for path in benchmarks or ()]
    for path, check in zip(benchmarks or (), checks, strict=True):
        added = histories.add(file, check)
        display.plain(
            f"{path}: {count_of(len(check.figures), 'time')}{'' if added else ', there already'}"
        )
    kept = histories.read(file)
    steps = write_history(folder, file.stem, kept)
    _print_steps(steps)
    display.plain(
        f"{count_of(len(kept), 'check')}, {count_of(len(steps), 'step')}. "
        f"Page: {folder / file.stem}.html, .pdf and .csv"
    )


def _print_steps(steps: "Sequence[FoundStep]") -> None:
    """Print the commits at which a figure took a step, if there are any."""
    from gaitval.apps.regression.history_page import short
    from gaitval.apps.regression.regression import shown

    if not steps:
        return
    rows = [["commit", "subject", "figure", "before", "after", "unit", "change"]]
    for step in steps:
        figure = f"{step.measure} {step.target}"
        values = shown(step.before), shown(step.after), step.unit, step.change
        rows.append([short(step.revision), step.subject, figure, *values])
    display.print_rows(rows, "Commits at which a figure took a step")
