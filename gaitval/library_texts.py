"""Documentation that libraries write for themselves when they are imported, which no command shows.

scipy parses the texts of its functions to add a table to each, and matplotlib those of its classes:
a tenth of the time of a report. A program that imports gaitval as a library keeps them.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from gaitval import current_folder


class _AsItIs:
    """In the place of scipy's parsed text of a function: nothing is added to it."""

    def __init__(self, function: Any) -> None:
        self._text = f"\n{function.__doc__ or ''}"

    def __getitem__(self, part: str) -> list[str]:
        return []

    def __str__(self) -> str:
        return self._text


@contextmanager
def _scipy() -> Iterator[None]:
    yield
    module: Any = sys.modules["scipy._lib._array_api"]
    if hasattr(module, "FunctionDoc"):
        module.FunctionDoc = _AsItIs


@contextmanager
def _matplotlib() -> Iterator[None]:
    yield
    module: Any = sys.modules["matplotlib.artist"]
    name = "_update_set_signature_and_docstring"
    if hasattr(module.Artist, name):
        setattr(module.Artist, name, classmethod(lambda _: None))
        module.kwdoc = lambda _: ""


def leave_out() -> None:
    """Leave them out of what gaitval imports from now on in this process."""
    current_folder.IMPORTED["scipy._lib._array_api"] = _scipy
    current_folder.IMPORTED["matplotlib.artist"] = _matplotlib
