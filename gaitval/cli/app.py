"""The `gaitval` command: one command per stage, and `subject` for all of them."""

import csv
import math
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    DownloadColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
    TransferSpeedColumn,
)
from rich.table import Table
from typer.core import TyperGroup

from gaitval import __version__
from gaitval.artefacts import read_json
from gaitval.configuration import Configuration, load_configuration
from gaitval.errors import GaitvalError, ToleranceError
from gaitval.study.baseline import store_baseline, walk_again
from gaitval.study.run import run_one, run_subject
from gaitval.study.stage import INTERRUPTED, Observer, Run, open_run

if TYPE_CHECKING:
    from gaitval.session.session import Import

STOPPED = 130
"""Exit code after Ctrl-C, as shells have it."""
INTERNAL = 70
"""Exit code after an error in gaitval itself (EX_SOFTWARE of sysexits.h)."""
PLAIN_SECONDS = 30.0
"""Time between lines of progress where the output is not a terminal."""

OVERVIEW = """Learn to walk as a recorded person walks, and report how accurate the walk is.

A body model is scaled to a person. A policy learns to walk with it as the person's gait
was recorded. Uncertain body parameters are identified, and the simulated walk is compared
with the record: joint angles, joint moments and ground reaction forces.

Each stage reads and writes files in a run folder (reports/S05). It is skipped when nothing
that it reads has changed, and resumes after Ctrl-C or a kill. A single stage keeps the
settings of its run folder; `subject` starts from the defaults.

Exit codes: 0 done, 1 a limit was failed (validate, check), 2 the input cannot be used,
130 interrupted.
"""

# Tables are not squeezed into 80 columns where there is no terminal.
output = Console(width=None if sys.stdout.isatty() else 120)
messages = Console(stderr=True)


class _Commands(TyperGroup):
    """Turns the errors that a user can mend into a message and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except GaitvalError as error:
            messages.print(f"[bold red]{ctx.invoked_subcommand}:[/]", end=" ")
            messages.print(str(error), style="red", markup=False, highlight=False, soft_wrap=True)
            raise typer.Exit(error.exit_code) from None
        except KeyboardInterrupt:
            messages.print("interrupted; the same command resumes", style="yellow")
            raise typer.Exit(STOPPED) from None


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    epilog="Start with [bold]gaitval subject 5[/]; `gaitval COMMAND --help` has examples.",
)

SubjectArgument = Annotated[
    str,
    typer.Argument(
        metavar="SUBJECT",
        help="Number (5), name (S05, WBDS14), or path of your own subject's TOML file.",
        show_default=False,
    ),
]
OutOption = Annotated[
    Path | None,
    typer.Option(
        "--out", "-o", help="Run folder; by default reports/S05 for S05.", show_default=False
    ),
]
ConfigOption = Annotated[
    Path | None,
    typer.Option(
        "--config",
        "-c",
        help="TOML file with settings; all others keep their values. `paper` gives the "
        "paper's own state and reward (docs/learning.md says which limits they fail).",
        show_default=False,
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        "-s",
        metavar="SECTION.KEY=VALUE",
        help="One setting, for example training.samples=500000. May be repeated.",
        show_default=False,
    ),
]
ForceOption = Annotated[
    bool, typer.Option("--force", help="Run even if nothing that it reads has changed.")
]
RoundOption = Annotated[int, typer.Option("--round", min=1, help="Round of Algorithm 1.")]
ScratchOption = Annotated[
    bool, typer.Option("--scratch", help="Train from nothing, without a stored policy.")
]


# --- progress ----------------------------------------------------------------------------


class _Live(Observer):
    """Tells of stages and their progress: a bar on a terminal, else a line now and then.

    `console` may be a terminal or not.
    """

    def __init__(self, console: Console) -> None:
        self.console = console
        self.stage = ""
        self._bar: Progress | None = None
        self._task = TaskID(0)
        self._begun = self._last_line = monotonic()
        self._first_done = 0.0

    def say(self, message: str) -> None:
        self.console.print(message, markup=False, highlight=False, soft_wrap=True)

    def skipped(self, stage: str) -> None:
        self.say(f"{stage}: up to date")

    def started(self, stage: str, reason: str) -> None:
        self.stage = stage
        self._begun = self._last_line = monotonic()
        self._first_done = -1.0
        self.say(f"{stage}: {'resumes' if reason == INTERRUPTED else 'starts'} ({reason})")

    def progress(self, values: Mapping[str, float]) -> None:
        """Show how far a stage is.

        Parameters
        ----------
        values : `total` and one of `samples`, `generation`, `rounds` or `pushes` count the work;
            all others (`reward`, `cycles`, ...) are shown beside it.
        """
        unit = next(
            name for name in ("samples", "generation", "rounds", "pushes") if name in values
        )
        done, total = values[unit], values["total"]
        rest = "  ".join(
            f"{_label(name)} {value:.3g}"
            for name, value in values.items()
            if name not in (unit, "total")
        )
        if self._first_done < 0:
            self._first_done = done
        if self.console.is_terminal:
            self._show_bar(unit, done, total, rest)
        elif monotonic() - self._last_line >= PLAIN_SECONDS:
            self._last_line = monotonic()
            self.say(
                f"{self.stage}: {done:,.0f} of {total:,.0f} {unit}  {rest}  "
                f"{self._time_left(done, total)}"
            )

    def finished(self, stage: str, seconds: float) -> None:
        self.close()
        self.say(f"{stage}: done in {_duration(seconds)}")

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()
            self._bar = None

    def _show_bar(self, unit: str, done: float, total: float, rest: str) -> None:
        if self._bar is None:
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                TaskProgressColumn(),
                TextColumn("{task.completed:,.0f} {task.fields[unit]}  {task.fields[rest]}"),
                TimeElapsedColumn(),
                TextColumn("left"),
                # Rates differ between learning and evaluation, so look at minutes, not seconds.
                TimeRemainingColumn(elapsed_when_finished=False),
                console=self.console,
                speed_estimate_period=180.0,
                transient=True,
            )
            self._task = self._bar.add_task(
                self.stage, total=total, completed=int(done), unit=unit, rest=rest
            )
            self._bar.start()
        self._bar.update(self._task, completed=done, total=total, rest=rest)

    def _time_left(self, done: float, total: float) -> str:
        progressed = done - self._first_done
        if progressed <= 0:
            return ""
        seconds = (monotonic() - self._begun) * (total - done) / progressed
        return f"{_duration(seconds)} left"


def _label(name: str) -> str:
    return "cycles walked" if name == "cycles" else name.replace("_", " ")


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    if minutes >= 60:
        return f"{minutes // 60} h {minutes % 60:02d} min"
    return f"{minutes} min {rest:02d} s" if minutes else f"{seconds:.1f} s"


# --- what all stage commands share -------------------------------------------------------


def _configuration(
    config: Path | None, settings: list[str] | None, stored: Path | None
) -> Configuration:
    """Settings of a command; a stage alone keeps those its run folder was made with."""
    if config is None and stored is not None and stored.is_file():
        config = stored
    return load_configuration(config, settings=settings or ())


@contextmanager
def _opened(
    subject: str,
    out: Path | None,
    config: Path | None,
    settings: list[str] | None,
    *,
    keep_settings: bool,
) -> Iterator[Run]:
    from gaitval.datasets.subject import load_subject

    person = load_subject(subject)
    folder = out or Path("reports") / person.identifier
    stored = folder / "configuration.toml" if keep_settings else None
    live = _Live(messages)
    try:
        with open_run(person, _configuration(config, settings, stored), folder, live) as run:
            yield run
    finally:
        live.close()


def _stage(
    name: str,
    subject: str,
    out: Path | None,
    config: Path | None,
    settings: list[str] | None,
    force: bool,
    *,
    round_number: int = 1,
    scratch: bool = False,
) -> Path:
    """Run one stage; the run folder."""
    with _opened(subject, out, config, settings, keep_settings=True) as run:
        run_one(run, name, round_number=round_number, scratch=scratch, force=force)
        return run.folder


def _print_csv(path: Path, title: str) -> None:
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    table = Table(title=title)
    for name in header:
        table.add_column(name.replace("_", " "), overflow="fold")
    for row in rows:
        table.add_row(*(_short(cell) for cell in row))
    output.print(table)


def _short(cell: str) -> str:
    try:
        return f"{float(cell):.4g}"
    except ValueError:
        return cell


def _print_tolerances(metrics: Mapping[str, Any]) -> None:
    """Verdicts of `metrics.json`, those that failed in red."""
    table = Table(title=f"{metrics['subject']['identifier']}: accuracy against the record")
    for name in ("measure", "of", "value", "limit", "goal", "unit", "status", "verdict"):
        table.add_column(name)
    for row in metrics["tolerances"]:
        value = "not measured" if row["value"] is None else f"{row['value']:.3g}"
        limit = f"{row['limit'].replace('_', ' ')} {row['tolerance']:g}"
        verdict = "goal" if row["reached"] else "pass" if row["passed"] else "[red]fail[/]"
        table.add_row(
            row["measure"],
            row["target"],
            value,
            limit,
            "" if row["goal"] is None else f"{row['goal']:g}",
            row["unit"],
            row["status"],
            verdict,
        )
    output.print(table)


def _print_pushes(recovery: Mapping[str, Any]) -> None:
    """Largest push survived by phase and direction; left is positive."""
    table = Table(title="Largest push survived, N (degrees from straight ahead, left positive)")
    table.add_column("phase")
    for direction in recovery["directions"]:
        table.add_column(f"{direction:g}", justify="right")
    for phase, forces in zip(recovery["phases"], recovery["largest"], strict=True):
        table.add_row(f"{phase:g}", *(f"{force:g}" for force in forces))
    output.print(table)


def _print_import(found: "Import") -> None:
    """Published limits of an import, and what was measured of the walk."""
    from gaitval.session.summary import limit_rows, scaling_methods, spatiotemporal_rows

    table = Table(title=f"{found.request.identifier}: the recording against published limits")
    for name in ("measure", "value", "at most", "unit", "verdict"):
        table.add_column(name)
    for row in limit_rows(found):
        value = "not measured" if row.value is None else f"{row.value:.3g}"
        verdict = "pass" if row.passed else "[red]fail[/]"
        table.add_row(row.name, value, f"{row.limit:g}", row.unit, verdict)
    output.print(table)
    table = Table(title="Distance of measured and model markers in walking")
    for name in ("scaling", "RMS cm", "largest cm", ""):
        table.add_column(name)
    for method in scaling_methods(found):
        table.add_row(
            method.name,
            f"{100 * method.trial_rms:.2f}",
            f"{100 * method.trial_largest:.2f}",
            "used" if method.chosen else "",
        )
    output.print(table)
    table = Table(title="Gait")
    for name in ("parameter", "right", "left", "unit"):
        table.add_column(name)
    for entry in spatiotemporal_rows(found.trials):
        sides = [_mean_and_deviation(pair, entry.digits) for pair in (entry.right, entry.left)]
        table.add_row(entry.name, *sides, entry.unit)
    output.print(table)


def _mean_and_deviation(pair: tuple[float, float] | None, digits: int) -> str:
    if pair is None:
        return "not measured"
    mean, deviation = pair
    spread = "" if math.isnan(deviation) else f" ± {deviation:.{digits}f}"
    return f"{mean:.{digits}f}{spread}"


# --- commands ----------------------------------------------------------------------------


def _paragraphs(text: str) -> str:
    """One line a paragraph, for the terminal to break."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def _command(
    *examples: str, name: str | None = None
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Register a command; its help is the docstring, with the examples below."""

    def register(function: Callable[..., None]) -> Callable[..., None]:
        shown = "\n".join(f"  {example}" for example in examples)
        text = _paragraphs(function.__doc__ or "")
        # \b keeps the lines of the examples.
        app.command(name, help=f"{text}\n\n\b\nExamples:\n{shown}")(function)
        return function

    return register


def _version(wanted: bool) -> None:
    if wanted:
        output.print(f"gaitval {__version__}", highlight=False)
        raise typer.Exit


@app.callback(help=_paragraphs(OVERVIEW))
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Options of `gaitval` itself."""


@_command("gaitval subjects", "gaitval subjects --build ../shared/data/wbds --out /tmp/subjects")
def subjects(
    build: Annotated[
        Path | None,
        typer.Option(
            "--build",
            metavar="FOLDER",
            help="Compute the subjects again from the WBDS files in FOLDER.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path,
        typer.Option("--out", "-o", help="Where --build writes the subjects."),
    ] = Path("subjects"),
) -> None:
    """List the built-in subjects, or compute them again from the WBDS dataset."""
    from gaitval.datasets.subject import builtin_subjects

    if build is not None:
        from gaitval.datasets.wbds import build_subjects

        build_subjects(build, out)
        output.print(f"Wrote the subjects to {out}", highlight=False)
        return
    table = Table(title="Built-in subjects (Fukuchi, Fukuchi & Duarte 2018, CC BY 4.0)")
    for name in ("subject", "person, trial", "sex", "age", "mass kg", "height m", "speed m/s"):
        table.add_column(name)
    for person in builtin_subjects():
        table.add_row(
            person.identifier,
            person.source,
            person.sex,
            "" if person.age_years is None else f"{person.age_years:g}",
            f"{person.mass_kg:g}",
            f"{person.height_m:g}",
            f"{person.walking_speed_m_s:g}",
        )
    output.print(table)


SexOption = Annotated[
    str,
    typer.Option("--sex", metavar="F|M", help="Selects the segment tables.", show_default=False),
]


@_command(
    "gaitval import --static stand.c3d --trial walk.c3d --mass 74.3 --height 1.725 --sex M "
    "--out reports/mine",
    "gaitval import --static stand.trc --trial walk.trc --forces walk_grf.mot --mass 85 "
    "--height 1.83 --sex M --out reports/theirs",
    "gaitval subject reports/mine/subject.toml      # then the main job, as for a built-in subject",
    name="import",
)
def import_command(
    static: Annotated[
        Path,
        typer.Option(
            "--static", metavar="FILE", help="Standing trial: C3D, TRC.", show_default=False
        ),
    ],
    trial: Annotated[
        list[Path],
        typer.Option(
            "--trial",
            metavar="FILE",
            help="Walking trial: C3D, TRC, WBDS mkr.txt. May be repeated; the cycles are pooled.",
            show_default=False,
        ),
    ],
    mass: Annotated[float, typer.Option("--mass", help="Body mass, kg.", show_default=False)],
    height: Annotated[float, typer.Option("--height", help="Stature, m.", show_default=False)],
    sex: SexOption,
    out: Annotated[
        Path,
        typer.Option(
            "--out", "-o", help="Folder to write; its name names the subject.", show_default=False
        ),
    ],
    forces: Annotated[
        list[Path] | None,
        typer.Option(
            "--forces",
            metavar="FILE",
            help="Ground reaction (MOT, STO, WBDS grf.txt) of a trial whose own file has none: "
            "one file for each --trial.",
            show_default=False,
        ),
    ] = None,
    marker_set: Annotated[
        str | None,
        typer.Option(
            "--marker-set",
            help="wbds, plug_in_gait, rajagopal, or a TOML file; recognised by marker names "
            "if left out.",
            show_default=False,
        ),
    ] = None,
    axes: Annotated[
        str | None,
        typer.Option(
            "--axes",
            help='Axes of the laboratory, as "forward=+x up=+y"; found from the standing trial '
            "if left out.",
            show_default=False,
        ),
    ] = None,
    knee_width: Annotated[
        float | None,
        typer.Option(
            "--knee-width", help="Knee width, m, without medial markers.", show_default=False
        ),
    ] = None,
    ankle_width: Annotated[
        float | None,
        typer.Option("--ankle-width", help="Ankle width, m.", show_default=False),
    ] = None,
    elbow_width: Annotated[
        float | None,
        typer.Option("--elbow-width", help="Elbow width, m.", show_default=False),
    ] = None,
    age: Annotated[
        float | None, typer.Option("--age", help="Years; for the report.", show_default=False)
    ] = None,
    citation: Annotated[
        str, typer.Option("--citation", help="Where the recording is published.")
    ] = "Own recording, not published",
    licence: Annotated[str, typer.Option("--licence", help="Its licence.")] = "not stated",
    consistent: Annotated[
        bool,
        typer.Option(
            "--consistent",
            help="Make the smallest change of motion and masses that lowers the residuals.",
        ),
    ] = False,
    kinematics_only: Annotated[
        bool,
        typer.Option("--kinematics-only", help="Use no forces: model, angles and cycles only."),
    ] = False,
    config: ConfigOption = None,
    settings: SetOption = None,
) -> None:
    """Turn a laboratory's own recordings into a subject: OUT/subject.toml, OUT/recording.

    Finds the axes and the marker set, cleans the markers, scales the body and fits it to the
    standing and the walking trial, and works out joint angles (inverse kinematics), joint moments
    (inverse dynamics with the measured ground reaction) and the mean gait cycle. Prints what it
    decides. OUT/recording holds a page (recording.html, recording.pdf), tables (CSV, JSON) and
    the model, motion, moments and forces as OpenSim files.
    """
    from gaitval.session.request import Request
    from gaitval.session.session import work_out
    from gaitval.session.subject import check_person, subject_of
    from gaitval.session.write import FOLDER, check_folder, write_import, write_subject

    configuration = load_configuration(config, settings=settings or ())
    check_folder(out)
    request = Request(
        static=static,
        trials=tuple(trial),
        forces=tuple(forces or ()),
        identifier=_identifier(out),
        mass_kg=mass,
        height_m=height,
        sex=check_person(mass, height, sex),
        marker_set=marker_set,
        axes=axes,
        knee_width_m=knee_width,
        ankle_width_m=ankle_width,
        elbow_width_m=elbow_width,
        without_forces=kinematics_only,
        consistent=consistent,
    )
    live = _Live(messages)
    found = work_out(
        request, configuration.processing, lambda step, text: live.say(f"{step}: {text}")
    )
    subject = None
    if not kinematics_only:
        subject = subject_of(found, age_years=age, citation=citation, licence=licence)
    written = write_import(out, found, configuration)
    _print_import(found)
    page = out / FOLDER / "recording.html"
    output.print(
        f"Page: {page} ({len(written)} files beside it)",
        markup=False,
        highlight=False,
        soft_wrap=True,
    )
    if subject is not None:
        path = write_subject(out, subject)
        output.print(
            f"Subject: {path}; go on with: gaitval subject {path}",
            markup=False,
            highlight=False,
            soft_wrap=True,
        )


def _identifier(out: Path) -> str:
    """A subject's name from the name of its folder."""
    name = re.sub(r"[^A-Za-z0-9_-]+", "_", out.resolve().name).strip("_")
    return name or "subject"


@_command("gaitval scale 5", "gaitval scale my_patient.toml --out runs/patient")
def scale(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
) -> None:
    """Scale the body model to the subject: model.urdf, scaling.csv.

    Segment lengths come from the markers of the standing trial, masses and inertias from de
    Leva (1996). Prints each length with its mass, its ratio to the population mean, its source.
    """
    folder = _stage("scale", subject, out, config, settings, force)
    _print_csv(folder / "scaling.csv", f"Body model in {folder / 'model.urdf'}")


@_command("gaitval reference 5")
def reference(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
) -> None:
    """Build the reference motion from the recorded gait: reference.npz."""
    _stage("reference", subject, out, config, settings, force)


@_command(
    "gaitval train 5",
    "gaitval train 5 --scratch --set training.samples=500000 --set seed=1",
    "tensorboard --logdir reports/S05",
)
def train(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
    round_number: RoundOption = 1,
    scratch: ScratchOption = False,
) -> None:
    """Train a walking policy (PPO): rounds/1/policy.

    The longest stage. Interrupt it when you like: the same command resumes. It starts from
    the stored policy of the same body where there is one, else from the general policy.
    """
    _stage(
        "train",
        subject,
        out,
        config,
        settings,
        force,
        round_number=round_number,
        scratch=scratch,
    )


@_command("gaitval identify 5", "gaitval identify 5 --set identification.generations=30")
def identify(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
    round_number: RoundOption = 1,
) -> None:
    """Identify the 14 body parameters mu (CMA-ES): identification.json.

    Rolls the policy out at fixed mu, and looks for the joint damping, friction, lengths and
    joint locations at which it walks most like the record.
    """
    _stage("identify", subject, out, config, settings, force, round_number=round_number)


@_command("gaitval correct 5", "gaitval correct 5 --set correction.rounds=0")
def correct(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
) -> None:
    """Correct the reference of the trained policy: correction.json.

    Walks, compares with the record, and changes the reference motion by a degree or so, so that
    the walk comes closer to the record (iterative learning control).
    """
    _stage("correct", subject, out, config, settings, force)


@_command("gaitval simulate 5", "gaitval simulate 5 --set validation.cycles=50")
def simulate(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
) -> None:
    """Walk with the trained policy, without pushes: rollouts/.

    The identified body walks a hundred gait cycles from every start phase. The nominal body walks
    from the first one, for the cycles that are compared.
    """
    _stage("simulate", subject, out, config, settings, force)


@_command("gaitval push 5", "gaitval push 5 --set pushes.directions=24")
def push(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
) -> None:
    """Push the walker, and find which pushes it survives: push.json.

    Horizontal pushes of 50 ms at the pelvis, from all directions, at phases of the right gait
    cycle. Prints the largest force up to which every tested push was survived.
    """
    folder = _stage("push", subject, out, config, settings, force)
    _print_pushes(read_json(folder / "push.json")["recovery"])


@_command("gaitval validate 5")
def validate(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
) -> None:
    """Compare the walks with the record and the limits: metrics.json.

    Prints what passed and what failed. Exit code 1 if a limit that decides the verdict
    is failed. To hold a policy to its earlier accuracy, use `gaitval check`.
    """
    folder = _stage("validate", subject, out, config, settings, force)
    metrics = read_json(folder / "metrics.json")
    _print_tolerances(metrics)
    refused = metrics["summary"]["refused"]
    if refused:
        raise ToleranceError(
            f"{refused} of {refused + metrics['summary']['accepted']} acceptance limits were "
            f"failed (table above). All errors are in {folder / 'metrics.json'}; `gaitval report` "
            "shows the curves."
        )


@_command("gaitval report 5")
def report(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
) -> None:
    """Write the report: report.html and report.pdf."""
    folder = _stage("report", subject, out, config, settings, force)
    output.print(f"Report: {folder / 'report.html'} and report.pdf", highlight=False)


@_command(
    "gaitval subject 5               # from the stored policy: 3 minutes",
    "gaitval subject 5 --scratch     # from nothing: 6 minutes",
    "gaitval subject my_patient.toml --out runs/patient",
    "gaitval subject 5 --out /tmp/S05 --set seed=1 --set validation.cycles=50",
    name="subject",
)
def subject_command(
    subject: SubjectArgument,
    out: OutOption = None,
    config: ConfigOption = None,
    settings: SetOption = None,
    force: ForceOption = False,
    scratch: ScratchOption = False,
) -> None:
    """Run the main job: all stages, from the recorded gait to the report.

    Alternates training and identification until epsilon is below identification.kappa or
    identification.rounds are done (Algorithm 1). Stages that are up to date are skipped.
    """
    with _opened(subject, out, config, settings, keep_settings=False) as run:
        run_subject(run, scratch=scratch, force=force)
    _print_tolerances(read_json(run.folder / "metrics.json"))
    output.print(f"Report: {run.folder / 'report.html'} and report.pdf", highlight=False)


data_app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="List and download published data sets.",
)
app.add_typer(data_app, name="data")

FolderOption = Annotated[
    Path | None,
    typer.Option(
        "--folder", help="Folder of the data; by default the user's cache.", show_default=False
    ),
]


@data_app.command(
    "list",
    help="List the data sets that can be fetched, and which parts are on this machine."
    "\n\n\b\nExamples:\n  gaitval data list",
)
def data_list(folder: FolderOption = None) -> None:
    """List the data sets."""
    from gaitval.datasets.archive import datasets

    for state in datasets(folder):
        dataset = state.dataset
        missing = f"missing: {', '.join(state.missing)}" if state.missing else "complete"
        output.print(f"[bold]{dataset.name}[/]  {dataset.title}", highlight=False)
        output.print(
            f"  {dataset.size / 1e9:.2f} GB, {dataset.licence}, doi:{dataset.doi}\n"
            f"  {dataset.citation}\n  {state.folder}: {missing}",
            highlight=False,
            markup=False,
        )


@data_app.command(
    "fetch",
    help="Download a data set by its DOI, verify it and unpack it. The same command resumes."
    "\n\n\b\nExamples:\n  gaitval data fetch wbds\n  gaitval data fetch wbds --folder /data",
)
def data_fetch(
    name: Annotated[str, typer.Argument(help="Name of the data set, see `gaitval data list`.")],
    folder: FolderOption = None,
) -> None:
    """Download a data set."""
    from gaitval.datasets.archive import fetch

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        DownloadColumn(),
        TransferSpeedColumn(),
        TimeRemainingColumn(),
        console=messages,
    )
    tasks: dict[str, TaskID] = {}

    def show(file: str, done: int, total: int | None) -> None:
        if file not in tasks:
            tasks[file] = bar.add_task(file, total=total)
        bar.update(tasks[file], completed=done, total=total)

    with bar:
        files = fetch(name, folder, on_progress=show)
    for file in files:
        how = "downloaded" if file.downloaded else "was here"
        if file.resumed_from:
            how += f", continued from {file.resumed_from / 1e6:.0f} MB"
        output.print(
            f"{file.path}: {how}; MD5 {file.md5} as stated by the {file.hash_from}",
            highlight=False,
            soft_wrap=True,
        )


@_command("gaitval baseline 5")
def baseline(
    subject: SubjectArgument,
    out: OutOption = None,
    target: Annotated[
        Path | None,
        typer.Option(
            "--to", help="Folder for it; by default RUN FOLDER/baseline.", show_default=False
        ),
    ] = None,
) -> None:
    """Store the policy, mu and metrics of a finished run, for `gaitval check`.

    Commit the folder that this writes. It is small, and holds all that `check` needs.
    """
    from gaitval.datasets.subject import load_subject

    identifier = load_subject(subject).identifier
    folder = out or Path("reports") / identifier
    target = target or folder / "baseline"
    store_baseline(folder, target)
    output.print(f"Stored {target}", highlight=False)


@_command(
    "gaitval check --baseline reports/S05/baseline/metrics.json",
    "gaitval check --baseline reports/S05/baseline/metrics.json --junit accuracy.xml",
)
def check(
    baseline: Annotated[
        Path,
        typer.Option(
            "--baseline",
            metavar="FILE",
            help="metrics.json of a stored baseline, with the policy beside it.",
            show_default=False,
        ),
    ],
    junit: Annotated[
        Path | None,
        typer.Option("--junit", metavar="FILE", help="Also write JUnit XML.", show_default=False),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Compare the curves only: seconds; no long walks, no pushes."),
    ] = False,
) -> None:
    """Simulate a stored policy again, and fail if accuracy was lost.

    Simulates and validates with the installed code and libraries, and compares every measure
    with the stored one. Exit code 1 and a table of what moved if a measure got worse by
    more than its margin; otherwise 0.
    """
    from gaitval.metrics.regression import LONG_MEASURES, compare, lost, write_junit

    stored = read_json(baseline)
    live = _Live(messages)
    try:
        now = walk_again(baseline.parent, live, quick=quick)
        rows = compare(stored, now, leave_out=LONG_MEASURES if quick else ())
    finally:
        live.close()
    if junit is not None:
        write_junit(rows, junit)
    moved = [row for row in rows if row.change != "kept"]
    if moved:
        table = Table(title="What moved by more than its margin")
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
                "[red]lost[/]" if row.change == "lost" else row.change,
            )
        output.print(table)
    failures = lost(rows)
    if failures:
        raise ToleranceError(
            f"{len(failures)} of {len(rows)} measures are worse than in {baseline} by more than "
            "their margin (table above). If the change is meant, store a new baseline with "
            "`gaitval baseline SUBJECT`."
        )
    output.print(f"{len(rows)} measures within their margins of {baseline}", highlight=False)


def _number(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.4g}"


def main() -> None:
    """Entry point of the `gaitval` command."""
    try:
        app()
    except Exception as error:
        if os.environ.get("GAITVAL_TRACEBACK"):
            traceback.print_exc()
        messages.print(
            f"internal error: {type(error).__name__}: {error}\nThis is a fault of gaitval or of "
            "this machine (disk full, memory?), not of your input. Set GAITVAL_TRACEBACK=1 and "
            "run the same command again to see where it happens; finished work is kept.",
            style="red",
            markup=False,
            highlight=False,
            soft_wrap=True,
        )
        sys.exit(INTERNAL)
