"""What moved since a baseline was stored, for the terminal."""

from collections.abc import Sequence
from pathlib import Path

from rich.table import Table
from rich.text import Text

from gaitval.apps.regression.regression import Row, lost, new
from gaitval.errors import ToleranceError
from gaitval.terminal import display


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
            _number(row.baseline),
            _number(row.current),
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
    """Print which of `rows` moved; raise ToleranceError if accuracy of `baseline` was lost, which
    says how to make it `anew`.
    """
    print_moved(rows)
    if added := new(rows):
        names = ", ".join(dict.fromkeys(row.measure for row in added))
        display.plain(
            f"New: {len(added)} measures that {baseline} lacks, so a loss there would not be seen "
            f"({names}). To compare them from now on, {anew}."
        )
        rows = [row for row in rows if row.change != "new"]
    failures = lost(rows)
    if failures:
        raise ToleranceError(
            f"Figures: {len(failures)} of {len(rows)} measures are worse than in {baseline} by "
            f"more than their margin (table above). If the change is intended, {anew}."
        )
    kept = sum(row.change == "kept" for row in rows)
    improved = "" if kept == len(rows) else f", {len(rows) - kept} improved (table above)"
    display.output.print(
        f"Figures: {kept} of {len(rows)} measures within their margins of {baseline}{improved}"
    )


def _number(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.4g}"
