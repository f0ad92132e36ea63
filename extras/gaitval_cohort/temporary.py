"""Folders among the system's temporary files, which a cohort that was killed does not leave."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gaitval.partial_files import in_use, remove_abandoned


@contextmanager
def temporary_folder(prefix: str) -> Iterator[str]:
    """A folder whose name begins with `prefix`, removed when the block ends.

    Those of this name that killed processes have left are removed first: nobody holds their lock.
    """
    remove_abandoned(Path(tempfile.gettempdir()), prefix, "")
    with (
        tempfile.TemporaryDirectory(prefix=prefix) as folder,
        # Windows opens no folder
        in_use(os.open(folder if os.name == "posix" else os.devnull, os.O_RDONLY)),
    ):
        yield folder
