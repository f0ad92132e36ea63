"""The `gaitval` command: root, options, commands, tables and the live view."""

from gaitval.cli import data, imports, judge, recording, screen, study, virtual
from gaitval.cli.app import main

__all__ = ["data", "imports", "judge", "main", "recording", "screen", "study", "virtual"]
