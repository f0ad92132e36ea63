"""The `gaitval` command: its root, and the table of its commands."""

from gaitval import library_texts
from gaitval.cli import recording, study
from gaitval.cli.commands import TABLE
from gaitval.terminal.app import LATER, app, main

LATER.update(TABLE)
library_texts.leave_out()

__all__ = ["app", "main", "recording", "study"]
