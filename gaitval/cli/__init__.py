"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import imports, recording, screen, study, virtual
from gaitval.cli.app import main

__all__ = ["imports", "main", "recording", "screen", "study", "virtual"]
