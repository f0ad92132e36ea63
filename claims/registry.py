"""Which measurements there are: every function of this package that `@measured` marks.

What there is, is read from the sources: some measurements import what few machines have, and only
those that run are imported.
"""

import ast
import importlib
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from .given import ROOT, Given

if TYPE_CHECKING:
    from .rows import Claim

    Measure = Callable[[Given], Claim | list[Claim]]


class Needs(NamedTuple):
    """What `measured` says of a measurement.

    Attributes
    ----------
    folders : names of the folders of `Given` that have to be there.
    stored : results of earlier runs that it reads, as git's path patterns; its rows carry the
        commit of these. None if it measures the code of today.
    """

    folders: tuple[str, ...]
    stored: tuple[str, ...]


class LackingError(Exception):
    """A file of public or raw data that a measurement reads is not there; it says how to get it."""


_needs: dict[Any, Needs] = {}


def measured(*folders: str, stored: Sequence[str] = ()) -> Callable[["Measure"], "Measure"]:
    """Make a function a measurement; see `Needs`."""

    def marked(function: "Measure") -> "Measure":
        _needs[function] = Needs(folders, tuple(stored))
        return function

    return marked


class RegisteredMeasurement(NamedTuple):
    """A function of this package that measures, and what it says of itself."""

    name: str
    module: str
    function: str
    about: str

    def load(self) -> tuple["Measure", Needs]:
        """The function and what it needs; imports its module."""
        function = getattr(importlib.import_module(self.module), self.function)
        return function, _needs[function]


@cache
def measurements() -> dict[str, RegisteredMeasurement]:
    """Every measurement by its name, TOPIC.NAME, in the order of the files."""
    found = {}
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        inside = path.relative_to(Path(__file__).parent)
        topic = inside.parts[0].removesuffix(".py")
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and any(map(_marks, node.decorator_list)):
                about = " ".join((ast.get_docstring(node) or "").partition("\n\n")[0].split())
                name = f"{topic}.{node.name}"
                found[name] = RegisteredMeasurement(name, module, node.name, about)
    return found


def _marks(decorator: ast.expr) -> bool:
    called = decorator.func if isinstance(decorator, ast.Call) else decorator
    return ast.unparse(called).rpartition(".")[2] == measured.__name__


def chosen(names: Sequence[str]) -> list[RegisteredMeasurement]:
    """The measurements of some topics or names; all if none is named.

    Raises
    ------
    SystemExit : there is none of that name; the message has those that there are.
    """
    every = measurements()
    found: dict[str, RegisteredMeasurement] = {} if names else dict(every)
    for name in names:
        of_it = {each: every[each] for each in every if name in (each, each.partition(".")[0])}
        if not of_it:
            topics = ", ".join(dict.fromkeys(each.partition(".")[0] for each in every))
            raise SystemExit(
                f"There is no claim {name!r}. Topics are {topics}; `python -m claims --list` has "
                "the names below them."
            )
        found |= of_it
    return list(found.values())
