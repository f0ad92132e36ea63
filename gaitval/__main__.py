"""`python -m gaitval` is the `gaitval` command."""

import os
import sys

# With -m, Python looks for modules in the current folder first. Nothing more is taken from there.
if not sys.flags.safe_path and sys.path and sys.path[0] in ("", os.getcwd()):
    del sys.path[0]

from gaitval.cli import main

main()
