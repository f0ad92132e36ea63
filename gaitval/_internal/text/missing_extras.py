"""Which extra of gaitval has a library that is not installed."""

import re
from importlib.metadata import requires
from importlib.util import find_spec
from typing import Final

from gaitval.errors import ConfigurationError

EXTRAS: Final = ("study", "cohort")
"""Extras of who uses gaitval, each after those that it asks for: the first that has a library is
named. Those of pyproject.toml (tested); in the metadata each lists the libraries of the others too.
"""


def raise_named(error: ImportError) -> None:
    """Raise ConfigurationError with the extra to install where `error` is of a library of one."""
    name = (error.name or "").partition(".")[0].replace("_", "-")
    lines = "\n".join(requires("gaitval") or ())
    found = re.findall(rf"^{name}[^-\w].*extra == ['\"](\w+)", lines, re.MULTILINE)
    if name and found and isinstance(error, ModuleNotFoundError):
        extra = next((each for each in EXTRAS if each in found), found[0])
        raise ConfigurationError(
            f"{name} is not installed: it comes with gaitval[{extra}]. Install it: python -m pip "
            f"install 'gaitval[{extra}]', or, in a checkout, make setup FOR={extra}."
        ) from None


def need(*libraries: str) -> None:
    """Raise ConfigurationError if one of `libraries`, of an extra, is not installed."""
    for name in libraries:
        if find_spec(name) is None:
            raise_named(ModuleNotFoundError(name, name=name))
