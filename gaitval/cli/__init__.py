"""The `gaitval` command: its root, its commands, and what they share (`terminal`)."""

from gaitval.cli import recording, study
from gaitval.cli.commands import TABLE
from gaitval.cli.terminal.app import LATER, app, main

LATER.update(TABLE)

__all__ = ["app", "main", "recording", "study"]
