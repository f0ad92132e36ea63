"""What the command line shows: live progress of stages, and tables."""

import csv
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, get_args

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import (
    BarColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.segment import Segment
from rich.table import Column, Table
from rich.text import Text

from gaitval._internal.io import file_gate
from gaitval._internal.io.text_tables import shown
from gaitval.errors import ArtefactError
from gaitval.study.stage import BESIDE, INTERRUPTED, Observer, in_words

if TYPE_CHECKING:
    from gaitval.metrics.results import Metrics, PushRecovery
    from gaitval.metrics.tolerances import Verdict
    from gaitval.session.session import Import

VERDICT_ROWS = 10
"""Most rows at the end of a command; all are in metrics.json and the report."""

PLAIN_SECONDS = 30.0
"""Time between lines of progress if the output is not a terminal."""


class Terminal(Console):
    """Shows names and texts from files as they are: no markup or emoji in them is followed, and no
    control character reaches the terminal, which could be a command to it.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, highlight=False, **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """As `Console.render`; rich's own control codes have segments of their own."""
        for each in super().render(renderable, options):
            yield each if each.control else each._replace(text=shown(each.text))

    def on_broken_pipe(self) -> None:
        """Go on without words: who closed the pipe (`| head -1`) has read enough. Neither the work
        nor the exit code, which is a verdict, ends with it, as they would with `Console`.
        """
        self.quiet = True
        os.dup2(os.open(os.devnull, os.O_WRONLY), self.file.fileno())


# Tables are not squeezed into 80 columns without a terminal.
output = Terminal(width=None if sys.stdout.isatty() else 120)
messages = Terminal(stderr=True)


class Live(Observer):
    """Shows stages and their progress: a bar on a terminal, else occasional lines.

    `console` may be a terminal or not.
    """

    def __init__(self, console: Console) -> None:
        self.console = console
        self.stage = ""
        self._bar: Progress | None = None
        self._last_line = monotonic()

    def say(self, message: str) -> None:
        """Print a line as it is."""
        plain(message, to=self.console)

    def skipped(self, stage: str) -> None:
        """Say that a stage was up to date."""
        self.say(f"{stage}: up to date")

    def started(self, stage: str, reason: str) -> None:
        """Say that a stage runs or resumes, and why."""
        self.stage = stage
        self._last_line = monotonic()
        self.close()
        how = {INTERRUPTED: "resumes", BESIDE: "continues"}.get(reason, "starts")
        self.say(f"{in_words(stage)}: {how} ({reason})")
        if self.console.is_terminal:
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                TextColumn("{task.fields[count]}"),
                TimeElapsedColumn(),
                # rates differ between learning and evaluation, so look at minutes, not seconds
                TimeRemainingColumn(elapsed_when_finished=False),
                console=self.console,
                speed_estimate_period=180.0,
                transient=True,
            )
            self._bar.add_task(stage, total=None, count="")
            self._bar.start()

    def progress(self, values: Mapping[str, float]) -> None:
        """Show the progress of a stage: of its `values`, `total` and one of `samples`,
        `generation`, `steps`, `pushes` or `walks` count; all others (`reward`, `cycles`, ...) are
        shown beside it.
        """
        units = ("samples", "generation", "steps", "pushes", "walks")
        unit = next(name for name in units if name in values)
        rest = "  ".join(
            f"{'cycles walked' if name == 'cycles' else name.replace('_', ' ')} {value:.3g}"
            for name, value in values.items()
            if name not in (unit, "total")
        )
        count = f"{values[unit]:,.0f} of {values['total']:,.0f} {unit}  {rest}"
        if self._bar is not None:
            task = self._bar.tasks[0].id
            if self._bar.tasks[0].total is None:  # what is done by now was done by an earlier call
                self._bar.reset(task, total=values["total"], completed=int(values[unit]))
            self._bar.update(task, completed=values[unit], count=count)
        elif monotonic() - self._last_line >= PLAIN_SECONDS:
            self._last_line = monotonic()
            self.say(f"{self.stage}: {count}")

    def finished(self, stage: str, seconds: float) -> None:
        """Say how long a stage took."""
        self.close()
        self.say(f"{stage}: done in {duration(seconds)}")

    def close(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None


@contextmanager
def live_view() -> Iterator[Live]:
    """Show the stages of a command on `messages` within the block."""
    live = Live(messages)
    try:
        yield live
    finally:
        live.close()


def plain(text: str, style: str = "", to: Console | None = None) -> None:
    """Print a line of `text` with paths in it, unwrapped and as it is, in one `style`: to `output`,
    or to the console `to`.
    """
    (to or output).print(text, style=style, soft_wrap=True)


def duration(seconds: float) -> str:
    """`seconds` in words: 2 min 05 s."""
    minutes, rest = divmod(round(seconds), 60)
    if minutes >= 60:
        return f"{minutes // 60} h {minutes % 60:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{seconds:.1f} s"


def print_csv(path: Path, title: str) -> None:
    """Print the CSV file `path` as a table with a `title`, numbers to four digits."""
    text = file_gate.read_text(path, ArtefactError, largest=file_gate.SIZES.table)
    header, *rows = csv.reader(text.splitlines())
    print_rows([header, *([_short(cell) for cell in row] for row in rows)], title)


def print_rows(rows: Sequence[Sequence[str]], title: str) -> None:
    """Print `rows`, the header first, as a table with a `title`."""
    header, *others = rows
    columns = (Column(name.replace("_", " "), overflow="fold") for name in header)
    table = Table(*columns, title=title)
    for row in others:
        table.add_row(*map(Text, row))
    output.print(table)


def _short(cell: str) -> str:
    try:
        return f"{float(cell):.4g}"
    except ValueError:
        return cell


def print_report(folder: Path) -> None:
    """Print where the report of a run `folder` is."""
    pdf = " and report.pdf" if (folder / "report.pdf").is_file() else ""
    output.print(f"Report: {folder / 'report.html'}{pdf}")


def print_verdict(metrics: "Metrics", where: str = "") -> None:
    """Print the verdict of `metrics` in a sentence (`where` as there), then each failed limit once
    with its worst value and its remedy: at most `VERDICT_ROWS` rows, acceptance before context.
    """
    from gaitval.metrics.learned import learned_text
    from gaitval.metrics.verdicts import (
        close_text,
        counted_limits,
        failed_limits,
        sentence,
        spread_text,
        target_text,
        value_text,
    )

    def of(row: "Verdict") -> str:
        where = target_text(row.target)
        return f" ({where})" if where else ""

    plain(f"\n{sentence(metrics, where)}")
    if said := learned_text(metrics):
        plain(said)
    failed = failed_limits(metrics)
    shown = failed or counted_limits(metrics, "acceptance")
    for each in shown[:VERDICT_ROWS]:
        count = f"{len(each.failed)} of {len(each.rows)}"
        message = "passed" if each.passed else f"{count} {each.state}"
        details = [
            f"limit {each.limit_text()}",
            *filter(None, (each.reason_text(), message)),
        ]
        plain(
            f"  {each.first.role:<11}{each.first.title}: {each.value_text()}{of(each.worst)}, "
            + ", ".join(details)
            + ("" if each.passed else f". {each.remedy}")
        )
    narrow = [row for each in counted_limits(metrics, "acceptance") for row in each.close]
    for row in narrow[: max(VERDICT_ROWS - len(shown), 0)]:
        plain(
            f"  {'narrow':<11}{row.title}: {value_text(row)}{of(row)}, {spread_text(row)}, "
            f"{close_text(row)}"
        )
    if len(shown) > VERDICT_ROWS:
        more = len(shown) - VERDICT_ROWS
        plain(f"  and {more} more, in the report and `gaitval stage validate SUBJECT --all`")


def print_tolerances(metrics: "Metrics") -> None:
    """Print every verdict of `metrics`, a row for each limit and target, failed ones in red."""
    from gaitval.metrics.verdicts import bound_text, spread_text, target_text, value_text

    table = Table(
        *("limit", "of", "value", "in repeats", "limit is", "role", "status", "missed"),
        "verdict",
        title=f"{metrics.subject.identifier}: every limit and value",
    )
    for row in metrics.tolerances:
        missed = Text("not shown" if row.state == "not shown" else "fail", style="red")
        verdict = "pass" if row.passed else missed
        table.add_row(
            row.title,
            target_text(row.target),
            value_text(row),
            spread_text(row),
            bound_text(row, row.tolerance),
            row.role,
            row.status,
            ", ".join(row.failed_by),
            verdict,
        )
    output.print(table)


def print_errors(metrics: "Metrics") -> None:
    """Print the error of every recorded curve in `metrics`, before and after the correction of the
    plates, beside that of the best prediction without a model.
    """
    from gaitval._internal.text.number_text import unit_sign
    from gaitval.metrics.verdicts import target_text

    words = {"moments": " moment", "forces": "", "angles": ""}
    where = f"{metrics.subject.identifier} ({metrics.subject.source})"
    title = f"{where}: RMSE, mean of both sides"
    columns = ("as measured", "corrected", "own hips", "best prediction")
    table = Table(
        "curve", *(Column(name, justify="right") for name in columns), "unit", title=title
    )
    for row in metrics.summary.errors:
        hip = row.own_hips if row.of_hip else None
        values = (row.as_measured, row.corrected, hip, row.prediction)
        cells = ["" if value is None else f"{value:.3g}" for value in values]
        name = target_text(row.curve).strip() + words[row.kind]
        table.add_row(name, *cells, unit_sign(row.unit))
    if metrics.summary.errors:
        output.print(table)


def print_pushes(recovery: "PushRecovery") -> None:
    """Print the largest push survived in `recovery` by phase and direction; left is positive."""
    title = "Largest push survived, N (degrees from straight ahead, left positive)"
    directions = (Column(f"{each:g}", justify="right") for each in recovery.directions)
    table = Table("phase", *directions, title=title)
    for phase, forces in zip(recovery.phases, recovery.largest, strict=True):
        table.add_row(f"{phase:g}", *(f"{force:g}" for force in forces))
    output.print(table)


def print_import(found: "Import") -> None:
    """Print the published limits of the import `found`."""
    from gaitval._internal.text.number_text import unit_sign
    from gaitval.session.importing.summary import limit_rows

    title = f"{found.request.identifier}: the recording against published limits"
    table = Table("measure", "value", "at most", "unit", "verdict", title=title)
    for row in limit_rows(found):
        value = "not measured" if row.value is None else f"{row.value:.3g}"
        verdict = Text(row.state, style="red" if row.failed else "")
        table.add_row(row.name, value, f"{row.limit:g}", unit_sign(row.unit), verdict)
    output.print(table)


def print_import_verdict(found: "Import") -> None:
    """Print the last lines of the import `found`: what the plates carried, and failed limits."""
    from gaitval.metrics.recording_limits import WHY_NOT_JUDGED, State, failure
    from gaitval.session.importing.summary import limit_rows, not_judged, unseen_residuals

    rows = limit_rows(found)
    if found.weight_ratio is not None:
        plain(
            f"The plates carried {100 * found.weight_ratio:.1f} % of the body weight over whole "
            "gait cycles."
        )
    counts = {state: sum(row.state == state for row in rows) for state in get_args(State)}
    why = f" ({WHY_NOT_JUDGED})" if counts["not judged"] else ""
    plain(
        f"Limits: {counts['passed']} passed, {counts['FAILED']} FAILED, {counts['not judged']} not "
        f"judged{why}."
    )
    for reason in filter(None, (not_judged(found), unseen_residuals(found))):
        plain(f"NOT JUDGED: {reason}.", "yellow")
    for row in rows:
        if row.failed:
            text = failure(row.name, row.value, row.limit, row.unit, row.remedy)
            plain(f"FAILED: {text}.", "red")


def print_warnings(found: "Import") -> None:
    """Print the warnings of the import `found`."""
    for trial, warning in found.warnings:
        plain(f"Warning: {trial}: {warning}.", "yellow")
