"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import recording, screen, study, virtual
from gaitval.cli.app import main

__all__ = ["main", "recording", "screen", "study", "virtual"]
