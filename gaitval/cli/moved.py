"""What moved since a baseline was stored, for the terminal."""

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table
from rich.text import Text

from gaitval.apps.regression.regression import Row, lost, new, shown, traded
from gaitval.cli.terminal import display
from gaitval.errors import ToleranceError
from gaitval.metrics.tolerances import load_registry


def print_moved(rows: Sequence[Row]) -> None:
    """Print the `rows` of measures that moved by more than their margin, if there are any."""
    moved = [row for row in rows if row.change in ("lost", "improved")]
    if not moved:
        return
    table = Table(title="Measures that moved by more than their margin")
    for name in ("measure", "of", "baseline", "now", "margin", "unit", "change"):
        table.add_column(name)
    for row in moved:
        table.add_row(
            row.measure,
            row.target,
            shown(row.baseline),
            shown(row.current),
            f"{row.margin:g}",
            row.unit,
            Text("lost", style="red") if row.change == "lost" else row.change,
        )
    display.output.print(table)


def judge_moved(
    rows: Sequence[Row],
    baseline: Path,
    anew: str = "store a new baseline with `gaitval baseline SUBJECT`",
) -> None:
    """Print whether accuracy of `baseline` was lost, then which of `rows` moved. Raises
    ToleranceError if it was, or was not judged; it says how to make the baseline `anew`.
    """
    compared = [row for row in rows if row.change != "new"]
    # What the baseline did not measure cannot have become worse, and is no measure that was kept.
    judged = [row for row in compared if row.baseline is not None]
    failures = lost(compared)
    kept = sum(row.change == "kept" for row in judged)
    unseen = sorted({row.measure for row in compared if row.measure in _deciding()})
    unseen = [name for name in unseen if name not in {row.measure for row in judged}]
    problem = ""
    if failures:
        answer = (
            f"{len(failures)} of {len(compared)} measures are worse than in {baseline} by more "
            "than their margin"
        )
        problem = f"If the change is intended, {anew}."
    elif not judged:
        answer = (
            f"not judged. None of the {len(compared)} measures has a value in {baseline}, so "
            "nothing can be lost or kept"
        )
        problem = f"To have values, {anew}."
    elif unseen:
        answer = (
            f"not judged. {baseline} has no value of {', '.join(unseen)}, which decides: whether "
            f"it was lost is not known; {len(judged)} others are not worse"
        )
        problem = f"To have one, {anew}."
    else:
        improved = "" if kept == len(judged) else f", {len(judged) - kept} improved (table below)"
        rest = len(compared) - len(judged)
        unjudged = f"; {rest} not judged, which it has not" if rest else ""
        answer = (
            f"{kept} of {len(judged)} measures within their margins of {baseline}{improved}"
            f"{unjudged}"
        )
    display.output.print(f"Figures: {answer}{'.' if problem else ''}")
    print_moved(rows)
    if changed := traded(rows):
        display.plain("Mean errors of both sides that changed by more than 3 %:")
        for error, (before, now) in changed.items():
            display.plain(f"  {error.changed(before, now)}")
    if added := new(rows):
        names = ", ".join(dict.fromkeys(row.measure for row in added))
        display.plain(
            f"New: {len(added)} measures that {baseline} lacks, so a loss there would not be seen "
            f"({names}). To compare them from now on, {anew}."
        )
    if problem:
        raise ToleranceError(f"Figures: {answer}. {problem}")


def _deciding() -> set[str]:
    """Measures of the limits that decide a verdict."""
    return {each.measure for each in load_registry().tolerance if each.role == "acceptance"}
