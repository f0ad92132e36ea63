"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import recording, study, virtual
from gaitval.cli.app import main

__all__ = ["main", "recording", "study", "virtual"]
