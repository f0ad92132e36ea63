"""`python -m gaitval.cli` is the `gaitval` command."""

from gaitval.cli import main

main()
