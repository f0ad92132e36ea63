"""`python -P -m gaitval` is the `gaitval` command."""

from gaitval.cli import main

main()
