"""Where this machine keeps what is computed once for all runs."""

import os
from pathlib import Path

from gaitval.errors import ConfigurationError


def cache_home() -> Path:
    """The folder for caches: `XDG_CACHE_HOME`, else `.cache` in the home folder. Raises
    ConfigurationError if there is none that can be written to, as for a user without a home folder
    in a container.
    """
    given = os.environ.get("XDG_CACHE_HOME")
    try:
        base = Path(given) if given else Path.home() / ".cache"
    except RuntimeError:  # neither HOME nor an entry for the user
        base = Path("/nonexistent")
    there = next(folder for folder in (base, *base.parents) if folder.exists())
    if not os.access(there, os.W_OK):
        raise ConfigurationError(
            f"{base}: compiled code cannot be kept there, for the folder cannot be made or written "
            "to. Set XDG_CACHE_HOME to one that can, such as XDG_CACHE_HOME=/tmp/cache."
        )
    return base
