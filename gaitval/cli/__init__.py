"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import imports, recording, study
from gaitval.cli.app import main

__all__ = [
    "imports",
    "main",
    "recording",
    "study",
]
