"""The `gaitval` command: its root, and the table of its commands."""

from gaitval.cli import recording, study
from gaitval.cli.commands import TABLE
from gaitval.terminal.app import LATER, app, main

LATER.update(TABLE)

__all__ = ["app", "main", "recording", "study"]
