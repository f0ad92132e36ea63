"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import recording, study
from gaitval.terminal.app import main

__all__ = ["main", "recording", "study"]
