"""`gaitval compare`: many walks in one report, and what changed between two versions."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.cli import display
from gaitval.cli.app import added_command
from gaitval.errors import ConfigurationError, ToleranceError

if TYPE_CHECKING:
    from gaitval_gate.versions import Flip


@added_command(
    "gaitval compare reports                  # all runs and baselines below reports/",
    "gaitval compare reports/S05 runs/patient --out comparison",
    "gaitval compare runs/new --before runs/old --strict",
    after="predict",
)
def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Run folders, stored baselines, or folders that contain some; or folders of "
            "`gaitval device`.",
            show_default=False,
        ),
    ],
    before: Annotated[
        list[Path] | None,
        typer.Option(
            "--before",
            metavar="FOLDER",
            help="The same of an earlier version, matched by subject. May be repeated.",
            show_default=False,
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
    from gaitval_gate import device_results
    from gaitval_gate.collect import collect, collect_versions
    from gaitval_gate.comparison_page import write_comparison
    from gaitval_gate.moved import print_moved
    from gaitval_gate.regression import lost
    from gaitval_gate.versions import matched

    if strict and not before:
        raise ConfigurationError("--strict needs an earlier version: add --before FOLDER.")
    worn = [run for run in runs if device_results.is_result(run)]
    if worn:
        earlier = [each for each in before or () if device_results.is_result(each)]
        moved = device_results.compare(out, worn, earlier)
        display.plain(f"{len(worn)} results of devices. Report: {out / 'devices.html'}, .pdf, .csv")
        print_moved(moved)
        if strict and lost(moved):
            raise ToleranceError(
                f"{len(lost(moved))} figures of devices moved by more than their margin (table "
                "above). If the change is intended, compare with results of the new version."
            )
        runs = [run for run in runs if run not in worn]
        before = [each for each in before or () if each not in earlier]
        if not runs:
            return
    walks = collect(runs)
    versions = matched(*collect_versions(before, walks)) if before else None
    write_comparison(out, "comparison", walks, versions)
    display.plain(f"{len(walks)} walks. Report: {out / 'comparison.html'}, .pdf and .csv")
    if versions is None:
        return
    for subject, flip in versions.flipped():
        display.plain(_flip_line(subject, flip))
    worse, improved = versions.lost(), versions.improved()
    print_moved([row for _, row in (*worse, *improved)])
    missing = versions.only_before
    told = f"{len(worse)} measures got worse by more than their margin, {len(improved)} better"
    told += f"; no walk now of {', '.join(missing)}" if missing else ""
    if strict and (worse or missing):
        raise ToleranceError(
            f"{told}. The report in {out} says which; if the change is intended, compare with a "
            "baseline of the new version."
        )
    display.plain(told)


def _flip_line(subject: str, flip: "Flip") -> str:
    """A limit that is no longer kept, or is kept again."""
    kind = "limit" if flip.decides else "limit for context"
    verdict = f"{kind} {'is kept now' if flip.kept else 'is no longer kept'}"
    before, now = ("–" if value is None else f"{value:.4g}" for value in (flip.before, flip.now))
    of = "" if flip.target == "walk" else f", {flip.target}"
    limit = f"{flip.limit.replace('_', ' ')} {flip.tolerance:g}"
    unit = "" if flip.unit == "1" else f" {flip.unit}"
    return f"{subject}: {verdict}: {flip.title}{of}: {before} → {now}{unit} ({limit})"
