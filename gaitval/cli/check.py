"""`gaitval check`: a stored policy simulated again, and compared with its stored figures."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.cli.terminal import display
from gaitval.cli.terminal.app import added_command

if TYPE_CHECKING:
    from gaitval.apps.regression.regression import Row


@added_command(
    "gaitval check --baseline S05     # the one that comes with gaitval",
    "gaitval check --baseline reports/patient/baseline --junit accuracy.xml",
    "gaitval check --baseline S05 --quick --json accuracy.json",
    after="report",
)
def check(
    baseline: Annotated[
        str,
        typer.Option(
            "--baseline",
            metavar="FOLDER|SUBJECT",
            help="Folder of a stored baseline, or the metrics.json in it; or a built-in subject "
            "(S05), whose baseline comes with gaitval.",
        ),
    ],
    junit: Annotated[
        Path | None,
        typer.Option("--junit", metavar="FILE", help="Also write JUnit XML."),
    ] = None,
    json: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Also write every measure as JSON."),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Compare the curves only: about a minute; no long walks, no pushes."
        ),
    ] = False,
) -> None:
    """Simulate a stored policy again, and fail if accuracy was lost.

    Simulates and validates with the installed code and libraries, and compares every measure
    with the stored one. There are two verdicts: whether the walk depends on the same as then
    (code, libraries, record), and whether its figures are the same. Exit code 1 and a table of
    what moved if a measure got worse by more than its margin; 2 if the baseline is not as it was
    stored; otherwise 0. Measures that are newer than the baseline are named and fail nothing.
    """
    from gaitval.apps.regression.baseline import changed_inputs, stored_metrics, walk_again
    from gaitval.apps.regression.regression import LONG_MEASURES, compare
    from gaitval.apps.regression.seal import inputs_in_words
    from gaitval.apps.regression.stored_baselines import find_baseline
    from gaitval.cli.moved import judge_moved
    from gaitval.study.inputs import METRICS

    _prepare(junit, json)
    folder = find_baseline(baseline)
    stored = stored_metrics(folder / METRICS)
    display.messages.print(f"Baseline: {folder}", soft_wrap=True)
    with display.live_view() as live:
        now = walk_again(folder, live, quick=quick)
    rows = compare(stored, now, leave_out=LONG_MEASURES if quick else ())
    inputs = inputs_in_words(changed_inputs(folder, now))
    _write(rows, junit, json, about={"subject": now.subject.identifier, "inputs": inputs})
    try:
        judge_moved(rows, folder)
    finally:  # whether accuracy was lost comes first; what it may come from, after
        display.plain(f"Inputs: {inputs}")


def _prepare(junit: Path | None, json: Path | None) -> None:
    """Refuse what cannot be written, before minutes of walking."""
    from gaitval.apps.regression.regression import prepare

    for path, option in ((junit, "--junit"), (json, "--json")):
        if path is not None:
            prepare(path, option)


def _write(
    rows: "Sequence[Row]", junit: Path | None, json: Path | None, *, about: Mapping[str, str]
) -> None:
    from gaitval.apps.regression.regression import write_junit, write_rows

    if junit is not None:
        write_junit(rows, junit, about=about)
    if json is not None:
        write_rows(rows, json, about=about)
