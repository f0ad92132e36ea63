"""Which extra of gaitval has a library that is not installed."""

import re
from importlib.metadata import requires
from importlib.util import find_spec

from gaitval.errors import ConfigurationError


def raise_named(error: ImportError) -> None:
    """Raise ConfigurationError with the extra to install where `error` is of a library of one."""
    name = (error.name or "").partition(".")[0].replace("_", "-")
    lines = "\n".join(requires("gaitval") or ())
    found = re.findall(rf"^{name}[^-\w].*extra == ['\"](\w+)", lines, re.MULTILINE)
    if name and found and isinstance(error, ModuleNotFoundError):
        # the smallest; wings ask for these two as wholes
        extra = next((e for e in ("pages", "study") if e in found), min(found, key=lines.count))
        raise ConfigurationError(
            f"{name} is not installed: it comes with gaitval[{extra}]. Install it: python -m pip "
            f"install 'gaitval[{extra}]', or, in a checkout, make setup."
        ) from None


def need(*libraries: str) -> None:
    """Raise ConfigurationError if one of `libraries`, of an extra, is not installed."""
    for name in libraries:
        if find_spec(name) is None:
            raise_named(ModuleNotFoundError(name, name=name))
