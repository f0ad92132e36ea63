"""What the functions for Python refuse before they compute: arguments of another kind or size."""

import os
from pathlib import Path

from gaitval.errors import ConfigurationError


def expect(name: str, value: object, kind: type | tuple[type, ...], give: str) -> None:
    """Raise ConfigurationError if the `value` of argument `name` is of no `kind`; `give` says how
    to make one.
    """
    if not isinstance(value, kind):
        raise ConfigurationError(
            f"{name} is {value!r:.60}, of type {type(value).__name__}. Give {give}."
        )


def as_path(name: str, value: object, give: str) -> Path:
    """The path that the `value` of argument `name` is. Raises as `expect`."""
    expect(name, value, (str, os.PathLike), give)
    return Path(value)  # type: ignore[arg-type]


def number(name: str, value: object, least: float, most: float, give: str) -> None:
    """Raise ConfigurationError if the `value` of argument `name` is no number from `least` to
    `most`; `give` says what to give.
    """
    is_number = hasattr(value, "__float__") and not isinstance(value, bool)
    if not (is_number and least <= float(value) <= most):  # type: ignore[arg-type]
        raise ConfigurationError(f"{name} is {value!r:.60}. Give {give}.")
