"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import (
    curves,
    data,
    imports,
    recording,
    screen,
    study,
    virtual,
)
from gaitval.cli.app import main

__all__ = [
    "curves",
    "data",
    "imports",
    "main",
    "recording",
    "screen",
    "study",
    "virtual",
]
