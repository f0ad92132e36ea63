"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import (
    cohort,
    compare,
    curves,
    data,
    history,
    imports,
    judge,
    recording,
    screen,
    study,
    virtual,
)
from gaitval.cli.app import main

__all__ = [
    "cohort",
    "compare",
    "curves",
    "data",
    "history",
    "imports",
    "judge",
    "main",
    "recording",
    "screen",
    "study",
    "virtual",
]
