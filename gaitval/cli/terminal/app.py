"""The root of the `gaitval` command: its help, its errors, and what commands share."""

import inspect
import io
import os
import shlex
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, MutableMapping
from contextlib import suppress
from functools import cached_property, partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from gaitval import __version__, plugins
from gaitval.cli.terminal import display, signals
from gaitval.errors import ConfigurationError, GaitvalError

STOPPED = 128 + signal.SIGINT
"""Exit code after Ctrl-C, as in shells."""
INTERNAL = 70
"""Exit code after an error in gaitval itself (EX_SOFTWARE of sysexits.h)."""

OVERVIEW = """Learn to walk as a recorded person walks, and report how accurate the walk is.

A body model is scaled to a person. A policy learns to walk with it as the person's gait
was recorded. Uncertain body parameters are identified, and the simulated walk is compared
with the record: joint angles, joint moments and ground reaction forces.

Each stage reads and writes files in a run folder (reports/S05). It is skipped when nothing
that it reads has changed, and resumes after Ctrl-C or a kill. `stage` runs one alone, with
the settings of its run folder; `subject` starts from the defaults.

Exit codes: 0 done, also where a limit failed that a page shows; 1 a limit failed (validate,
check, compare --strict, judge --strict), what decides could not be judged (any of these, subject,
import, cohort); 2 the input cannot be used, in import and cohort that of one person; 70 a fault of
gaitval, 130 interrupted.
"""


PANELS = {
    "Main jobs": ("subject", "import", "report", "stage"),
    "More ways in, and many people": ("subjects",),
    "Stored accuracy": ("baseline",),
}
"""Commands of the core in the order in which the help shows them, by heading."""

_NUMBERS = {"float_parsing": "number", "int_parsing": "whole number"}
"""By what pydantic calls its refusal."""


def panel_of(name: str) -> str:
    """The heading under which the help shows the command `name`."""
    return next(panel for panel, names in PANELS.items() if name in names)


def _no_type(ctx: Any) -> None:
    """A flag's column for its type is empty."""


def _plain_flags(parameters: Iterable[Any]) -> None:
    """Show flags as such: typer writes `<bool>` behind them, as if they took a value."""
    for parameter in parameters:
        if getattr(parameter, "is_flag", False):
            parameter.display_type_rich = _no_type


class Command(TyperCommand):
    """A command whose flags look and behave as flags."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Arguments and options, flags without a type."""
        found: list[Any] = super().get_params(ctx)
        _plain_flags(found)
        return found

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Refuse no value behind an option, and two, in words that help."""
        known = self.get_params(ctx)
        # a file or folder without a name would be the current folder
        takes_value = (
            each
            for each in known
            if each.param_type_name == "option" and not getattr(each, "is_flag", False)
        )
        for name in _names(takes_value):
            if f"{name}=" in args or (name, "") in pairwise(args):
                ctx.fail(f"{name} is empty: a shell variable that is not set? Give a value.")
        if all(each.param_type_name == "option" for each in known):
            _refuse_values_alone(ctx, args, known)
        try:
            rest: list[str] = super().parse_args(ctx, args)
        except typer.BadParameter as error:
            # typer says what pydantic says, without what was given: 1,3 or 70kg
            for problem in getattr(error.__cause__, "errors", list)():
                kind = _NUMBERS.get(problem["type"])
                if kind is not None:
                    error.message = (
                        f"{problem['input']!r} is no {kind}. Write digits, with a point for "
                        "decimals, and no unit."
                    )
            raise
        return rest


def _names(parameters: Iterable[Any]) -> set[str]:
    return {name for each in parameters for name in each.opts}


def _refuse_values_alone(ctx: Any, args: list[str], known: Iterable[Any]) -> None:
    """Of a command that takes options only: refuse `walk.c3d` without one, and `--trial *.c3d`,
    which the shell turns into one option with many values.
    """
    many = _names(each for each in known if getattr(each, "multiple", False))
    for option, value, another in zip(args, args[1:], args[2:], strict=False):
        if option in many and not (value.startswith("-") or another.startswith("-")):
            ctx.fail(f"{another} has no option: write {option} {value} {option} {another}.")
    if args and not args[0].startswith("-"):
        names = sorted(each.opts[0] for each in known if each.required)
        there = f"There must be {', '.join(names)}, each with a value." if names else "Give one."
        ctx.fail(f"{args[0]} has no option. {there}")


class LaterCommand(Command):
    """A command with options from the fields of a model, which is loaded when one of them is
    needed, so that `gaitval --help` does not wait for it.
    """

    complete: Callable[[], Callable[..., None]]
    """Gives the function with all of its options."""

    @cached_property
    def _whole(self) -> Any:
        alone = typer.Typer(add_completion=False)
        alone.command(self.name, cls=Command)(type(self).complete())
        return typer.main.get_command(alone)

    @property
    def params(self) -> list[Any]:
        """Arguments and options."""
        found: list[Any] = self._whole.params
        return found

    @params.setter
    def params(self, found: list[Any]) -> None:
        """Those of the function that stands in for it are not used."""

    @property
    def callback(self) -> Any:
        """What the command does."""
        return self._whole.callback

    @callback.setter
    def callback(self, found: Any) -> None:
        """As `params`."""


class Group(TyperGroup):
    """Commands of one word, whose help shows flags as flags."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Arguments and options, flags without a type."""
        found: list[Any] = super().get_params(ctx)
        _plain_flags(found)
        return found


class Added(NamedTuple):
    """A command that is loaded when it is called: of the table of `gaitval.cli`, or of another
    distribution, which registers it as an entry point of `plugins.COMMANDS`.

    Attributes
    ----------
    app : Typer application of this command alone.
    after : the command of `PANELS` behind which the help shows it.
    """

    app: typer.Typer
    after: str


LATER: Final[dict[str, Callable[[], Added]]] = {}
"""What loads each command of the table of `gaitval.cli`, by its name."""


class _Commands(Group):
    """Orders the commands, and turns errors that a user can fix into a message and an exit code.

    A command of `LATER` is loaded when it is called, or when all are asked for.
    """

    @property
    def commands(self) -> MutableMapping[str, Any]:
        """All that can be loaded, in the order of the help."""
        order = [name for names in PANELS.values() for name in names]
        for name in self._later() - set(self._loaded):
            with suppress(ConfigurationError, ModuleNotFoundError):  # said when it is called
                self._load(name)
        # in reverse, so that those inserted behind one command end up in alphabetical order
        for name in sorted(self._after, reverse=True):
            order.insert(order.index(self._after[name]) + 1, name)
        return {name: self._loaded[name] for name in order}

    @commands.setter
    def commands(self, core: MutableMapping[str, Any]) -> None:
        self._loaded = core
        self._after: dict[str, str] = {}

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command by its name; None if there is none."""
        if cmd_name not in self._loaded and cmd_name in self._later():
            self._load(cmd_name)
        return self._loaded.get(cmd_name)

    @staticmethod
    def _later() -> set[str]:
        return {*LATER, *plugins.names(plugins.COMMANDS)}

    def _load(self, name: str) -> None:
        added = LATER[name]() if name in LATER else plugins.load(plugins.COMMANDS, name)
        self._loaded[name] = get_command(added.app)
        self._loaded[name].name = name
        self._loaded[name].rich_help_panel = panel_of(added.after)  # a group has none of its own
        self._after[name] = added.after

    def invoke(self, ctx: Any) -> Any:
        try:
            try:
                return super().invoke(ctx)
            except ModuleNotFoundError as error:
                from gaitval._internal.text.missing_extras import raise_named

                raise_named(error)
                raise
        except GaitvalError as error:
            # Without one, where the command itself could not be loaded.
            of = ctx.invoked_subcommand or "gaitval"
            display.messages.print(f"{of}:", style="bold red", end=" ")
            display.plain(str(error), "red", display.messages)
            for option in error.goes_on:
                line = shlex.join(["gaitval", *sys.argv[1:]])
                display.plain(f"To continue without it: {line} {option}", to=display.messages)
            raise typer.Exit(error.exit_code) from None
        except OSError as error:
            from gaitval._internal.io.disk_errors import FAILED, why_unwritable

            if (message := why_unwritable(error)) is None:
                raise
            display.plain(
                f"{error.filename or 'a file of the run, or a temporary one'}: cannot be "
                f"{'read or ' * (error.errno in FAILED)}written: {message}, or give another folder "
                "with --out. Finished work is kept.",
                "red",
                display.messages,
            )
            raise typer.Exit(GaitvalError.exit_code) from None
        except KeyboardInterrupt:
            raise typer.Exit(_interrupted()) from None


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
    ),
]
WalkerArgument = Annotated[
    str,
    typer.Argument(
        metavar="SUBJECT_OR_RUN",
        help="A subject with a stored policy (5, S05), or a finished run folder.",
    ),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", "-o", help="Run folder; by default reports/S05 for S05."),
]
ConfigOption = Annotated[
    Path | None,
    typer.Option(
        "--config",
        "-c",
        help="TOML file with some of the settings; the others keep their values. `paper`: the "
        "paper's own state and reward, to compare with; its walks fall (docs/learning.md).",
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        "-s",
        metavar="SECTION.KEY=VALUE",
        help="One setting, for example training.samples=500000. May be repeated.",
    ),
]
PaperOption = Annotated[
    str | None,
    typer.Option(
        "--paper",
        metavar="a4|letter",
        help="Sheets of the PDF. Short for --set report.paper=letter.",
    ),
]


ExtensorOption = Annotated[
    bool | None,
    typer.Option(
        "--extensor-positive/--flexor-positive",
        help="Draw moments of extensors, plantarflexors and abductors positive, as clinical "
        "reports do; CSV and JSON keep their sign. Short for --set report.extensor_positive=true.",
    ),
]


def with_looks(
    settings: list[str] | None, paper: str | None = None, *, extensor_positive: bool | None = None
) -> list[str]:
    """`settings` with the `paper` of the pages and the sign of moments, where these are given."""
    return [
        *(settings or ()),
        *([] if paper is None else [f"report.paper={paper}"]),
        *(
            []
            if extensor_positive is None
            else [f"report.extensor_positive={str(extensor_positive).lower()}"]
        ),
    ]


ForceOption = Annotated[
    bool, typer.Option("--force", help="Run even if nothing that it reads has changed.")
]
RoundOption = Annotated[int, typer.Option("--round", min=1, max=1000, help="Round of Algorithm 1.")]
ScratchOption = Annotated[
    bool, typer.Option("--scratch", help="Train from nothing, and not from the general policy.")
]
TrainOption = Annotated[
    bool,
    typer.Option(
        "--train",
        help="Train for this person even if the policy that it starts from needs no training "
        "(training.samples=full).",
    ),
]
StartOption = Annotated[
    Path | None,
    typer.Option(
        "--start",
        metavar="FOLDER",
        help="Train from the policy in this folder (policy.json, policy.safetensors): a general "
        "one, or one of the same body. Not given: from the general one.",
    ),
]

UseOption = Annotated[
    str | None,
    typer.Option(
        "--use",
        metavar="all|kinematics",
        help="What the run may know of the record: all of it, or angles, speed and timing only. "
        "Not given: as in the settings (record.use), else all.",
    ),
]


def _paragraphs(text: str) -> str:
    """One line per paragraph, for the terminal to wrap."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


CommandFunction = Callable[..., None]


def command(
    *examples: str,
    name: str | None = None,
    complete: Callable[[CommandFunction], CommandFunction] | None = None,
) -> Callable[[CommandFunction], CommandFunction]:
    """Register a command of the core; its help is the docstring, with the `examples` below.

    Its `name` is the function's by default. `complete` gives the function options in place of its
    `**options` when they are first needed.
    """

    def register(function: CommandFunction) -> CommandFunction:
        panel = panel_of(name or function.__name__)
        _register(app, function, examples, panel=panel, name=name, complete=complete)
        return function

    return register


def added_command(
    *examples: str, after: str, complete: Callable[[CommandFunction], CommandFunction] | None = None
) -> Callable[[CommandFunction], Added]:
    """Make a command that is loaded later of a function, shown in the help behind the command
    `after`; `complete` as `command` takes it.
    """

    def make(function: CommandFunction) -> Added:
        alone = typer.Typer(
            add_completion=False, pretty_exceptions_enable=False, rich_markup_mode="rich"
        )
        _register(alone, function, examples, panel=panel_of(after), complete=complete)
        return Added(alone, after)

    return make


def _register(
    to: typer.Typer,
    function: CommandFunction,
    examples: Iterable[str],
    *,
    panel: str,
    name: str | None = None,
    complete: Callable[[CommandFunction], CommandFunction] | None = None,
) -> None:
    shown = "\n".join(f"  {example}" for example in examples)
    text = _paragraphs(inspect.getdoc(function) or "")
    # a class per command, since typer takes a class and not an instance
    later = complete and {"complete": staticmethod(partial(complete, function))}
    to.command(
        name or function.__name__,
        cls=type("_Later", (LaterCommand,), later) if later else Command,
        help=f"{text}\n\n\b\nExamples:\n{shown}",  # \b keeps the lines of the examples
        rich_help_panel=panel,
    )((lambda: None) if later else function)


def _version(wanted: bool) -> None:
    if wanted:
        display.output.print(f"gaitval {__version__}")
        raise typer.Exit


@app.callback(help=_paragraphs(OVERVIEW))
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Options of `gaitval` itself."""


def main() -> None:
    """Entry point of the `gaitval` command."""
    signals.end_in_order()
    # Processes that are started here take no modules from the folder that this one is run in, where
    # others may have put some.
    os.environ["PYTHONSAFEPATH"] = "1"
    for stream in (sys.stdout, sys.stderr):  # a terminal of another language shows a ? for a letter
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        app()
    except KeyboardInterrupt:
        sys.exit(_interrupted())
    except Exception as error:
        if os.environ.get("GAITVAL_TRACEBACK"):
            traceback.print_exc()
        display.plain(
            f"internal error: {type(error).__name__}: {error}\nThis is a fault of gaitval, or "
            "memory ran out (take fewer processes: --set training.workers=1); it is not of your "
            "input. Set GAITVAL_TRACEBACK=1 and run the same command again to see where it "
            "happens; finished work is kept.",
            "red",
            display.messages,
        )
        sys.exit(INTERNAL)


def _interrupted() -> int:
    """Say that Ctrl-C ended the command; returns the exit code."""
    display.messages.print("interrupted; the same command resumes", style="yellow")
    return STOPPED
