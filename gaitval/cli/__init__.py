"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import cohort, data, imports, recording, screen, study, virtual
from gaitval.cli.app import main

__all__ = ["cohort", "data", "imports", "main", "recording", "screen", "study", "virtual"]
