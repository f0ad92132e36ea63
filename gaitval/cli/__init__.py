"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import data, history, imports, recording, screen, study, virtual
from gaitval.cli.app import main

__all__ = ["data", "history", "imports", "main", "recording", "screen", "study", "virtual"]
