"""Which measurements there are: every function of this package that `@measurement` marks.

A measurement of the module TOPIC, or of one in the folder TOPIC, writes rows of `TOPIC.csv`; its
ROW of the command line is the function's name with hyphens. What there is, is read from the
sources, because some measurements import what few machines have: only those that run are imported.
"""

import ast
import importlib
import os
import re
import shlex
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from .sources import ROOT

if TYPE_CHECKING:
    from .rows import Row

    Measure = Callable[[Namespace], Row | list[Row]]

PACKAGE: Final = "evidence"
_options: dict[Any, tuple["Option", ...]] = {}


class Option(NamedTuple):
    """An option of measurements: its name, such as `--runs`, and what argparse knows of it."""

    name: str
    settings: dict[str, Any]

    @property
    def attribute(self) -> str:
        """Its name in the arguments that a measurement gets."""
        return str(self.settings.get("dest", self.name.removeprefix("--").replace("-", "_")))


def option(name: str, **settings: Any) -> Option:
    """An option of a measurement; `settings` are those of `ArgumentParser.add_argument`."""
    return Option(name, settings)


DATA: Final = option(
    "--data",
    type=Path,
    default=Path(os.environ.get("GAITVAL_DATA") or ROOT.parent / "shared" / "data"),
    help="folder of the raw data (default: GAITVAL_DATA, or ../shared/data)",
)


def measurement(*options: Option) -> Callable[["Measure"], "Measure"]:
    """Make a function a measurement: it takes the parsed options and returns its row or rows."""

    def marked(function: "Measure") -> "Measure":
        _options[function] = options
        return function

    return marked


class Measurement(NamedTuple):
    """What `python -m evidence TOPIC ROW` runs: a function, and what it says of itself."""

    topic: str
    row: str
    file: str
    function: str
    about: str

    def load(self) -> tuple["Measure", tuple[Option, ...]]:
        """The function and its options; imports its module."""
        module = importlib.import_module(self.file.removesuffix(".py").replace("/", "."))
        function = getattr(module, self.function)
        return function, _options[function]


@cache
def measurements() -> dict[tuple[str, str], Measurement]:
    """Every measurement by topic and row, in the order of the files."""
    found = {}
    for path in sorted((ROOT / PACKAGE).rglob("*.py")):
        inside = path.relative_to(ROOT / PACKAGE)
        topic = inside.parts[0].removesuffix(".py")
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and any(map(_marks, node.decorator_list)):
                about = (ast.get_docstring(node) or "").partition("\n\n")[0]
                row = node.name.replace("_", "-")
                found[topic, row] = Measurement(
                    topic,
                    row,
                    path.relative_to(ROOT).as_posix(),
                    node.name,
                    " ".join(about.split()),
                )
    return found


def _marks(decorator: ast.expr) -> bool:
    called = decorator.func if isinstance(decorator, ast.Call) else decorator
    return isinstance(called, ast.Attribute) and called.attr == measurement.__name__


def chosen(topic: str, rows: Sequence[str]) -> list[Measurement]:
    """The measurements of a topic, or those of its rows that are named.

    Raises
    ------
    SystemExit : there is none of that name; the message has those that there are.
    """
    of_topic = {each.row: each for each in measurements().values() if each.topic == topic}
    if not of_topic:
        topics = dict.fromkeys(each.topic for each in measurements().values())
        raise SystemExit(f"No topic is called {topic!r}. There are: {', '.join(topics)}.")
    if unknown := [row for row in rows if row not in of_topic]:
        raise SystemExit(f"{topic} has no {unknown[0]!r}. It has: {', '.join(of_topic)}.")
    return [of_topic[row] for row in rows] if rows else list(of_topic.values())


def parsed(each: Measurement, options: Sequence[Option], words: Sequence[str]) -> Namespace:
    """The options of a measurement from the words of the command line; others are refused."""
    parser = ArgumentParser(prog=f"python -m {PACKAGE} {each.topic} {each.row}",
                            description=each.about)  # fmt: skip
    for one in options:
        parser.add_argument(one.name, **one.settings)
    return parser.parse_args(words, Namespace(row=each.row))


def command_of(each: Measurement, words: Sequence[str]) -> str:
    """The line that makes a measurement."""
    return shlex.join(["python", "-m", PACKAGE, each.topic, each.row, *words])


def source_of(command: str) -> str | None:
    """The file of the project that a row's command runs, from the project's folder on."""
    if named := re.match(rf"python3? -m {PACKAGE} (\w+) ([\w-]+)", command):
        found = measurements().get((named[1], named[2]))
        return found.file if found else None
    if named := re.match(r"python3? -m ([\w.]+)", command):
        file = f"{named[1].replace('.', '/')}.py"
    elif named := re.match(r"python3? ([\w/]+\.py)\b", command):
        file = named[1]
    else:
        return None
    return file if (ROOT / file).is_file() else None
