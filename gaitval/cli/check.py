"""`gaitval check`: a stored policy simulated again, and compared with its stored figures."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitval.errors import ConfigurationError
from gaitval.missing_extras import need
from gaitval.terminal import display
from gaitval.terminal.app import added_command

if TYPE_CHECKING:
    from gaitval.apps.regression.history import Commit

HistoryOption = Annotated[
    Path | None,
    typer.Option(
        "--history",
        metavar="FILE",
        envvar="GAITVAL_HISTORY",
        help="Also keep the figures, with commit, time and machine, in this file, for `gaitval "
        "history`.",
    ),
]


@added_command(
    "gaitval check --baseline S05     # the one that comes with gaitval",
    "gaitval check --baseline reports/patient/baseline --junit accuracy.xml",
    "gaitval check --baseline S05 --quick --history accuracy.db",
    "gaitval check --baseline reports/S05-hip_exo      # a result of gaitval device",
    after="report",
)
def check(
    baseline: Annotated[
        str,
        typer.Option(
            "--baseline",
            metavar="FOLDER|SUBJECT",
            help="Folder of a stored baseline, or the metrics.json in it; or a built-in subject "
            "(S05), whose baseline comes with gaitval; or a folder of `gaitval device`.",
        ),
    ],
    junit: Annotated[
        Path | None,
        typer.Option("--junit", metavar="FILE", help="Also write JUnit XML."),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Compare the curves only: about a minute; no long walks, no pushes."
        ),
    ] = False,
    history: HistoryOption = None,
) -> None:
    """Simulate a stored policy again, and fail if accuracy was lost.

    Simulates and validates with the installed code and libraries, and compares every measure
    with the stored one. There are two verdicts: whether the walk depends on the same as then
    (code, libraries, record), and whether its figures are the same. Exit code 1 and a table of
    what moved if a measure got worse by more than its margin; 2 if the baseline is not as it was
    stored; otherwise 0. Measures that are newer than the baseline are named and fail nothing.
    """
    from gaitval.apps.regression import device_results
    from gaitval.apps.regression import history as histories
    from gaitval.apps.regression.baseline import changed_inputs, stored_metrics, walk_again
    from gaitval.apps.regression.moved import judge_moved
    from gaitval.apps.regression.regression import (
        LONG_MEASURES,
        compare,
        write_junit,
    )
    from gaitval.apps.regression.seal import inputs_in_words
    from gaitval.apps.regression.stored_baselines import find_baseline
    from gaitval.study.inputs import METRICS

    if device_results.is_result(Path(baseline)):
        _check_result(Path(baseline), junit, history)
        return
    if not quick:
        need("mujoco")  # the second engine: before minutes of walking
    folder = find_baseline(baseline)
    stored = stored_metrics(folder / METRICS)
    display.messages.print(f"Baseline: {folder}", soft_wrap=True)
    commit = _prepared(junit, history)
    with display.live_view() as live:
        now = walk_again(folder, live, quick=quick)
    rows = compare(stored, now, leave_out=LONG_MEASURES if quick else ())
    inputs = inputs_in_words(changed_inputs(folder, now))
    if junit is not None:
        write_junit(rows, junit, about={"inputs": inputs})
    if history is not None:
        histories.keep(history, rows, now.subject.identifier, commit=commit)
    try:
        judge_moved(rows, folder)
    finally:  # whether accuracy was lost comes first; what it may come from, after
        display.plain(f"Inputs: {inputs}")


def _prepared(junit: Path | None, history: Path | None) -> "Commit | None":
    """Refuse what cannot be written, before minutes of walking; the commit that is checked out,
    which may be another one afterwards, for a history.
    """
    from gaitval.apps.regression import history as histories
    from gaitval.apps.regression.regression import prepare_junit

    if junit is not None:
        prepare_junit(junit)
    if history is None:
        return None
    histories.prepare(history)
    return histories.current_commit()


def _check_result(folder: Path, junit: Path | None, history: Path | None) -> None:
    """The same for a result of `gaitval device`."""
    from gaitval.apps.devices import results
    from gaitval.apps.regression import device_results
    from gaitval.apps.regression.moved import judge_moved
    from gaitval.apps.regression.regression import write_junit

    if history is not None:
        raise ConfigurationError(
            f"--history {history}: {folder} is a result of `gaitval device`, whose figures are "
            "neither better nor worse than others, so a history cannot say what was lost. Leave "
            "--history out (and unset GAITVAL_HISTORY)."
        )
    _prepared(junit, None)
    figures = device_results.check(folder, results)
    if junit is not None:
        write_junit(figures, junit, about={})
    judge_moved(figures, folder, "make the result again with `gaitval device`")
