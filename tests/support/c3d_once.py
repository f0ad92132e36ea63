"""C3D files that tests read again and again are read once in each worker.

Reading one starts a process, an eighth of a second, and every import of a made-up or recorded
session reads the same standing trial.
"""

import hashlib
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path

import pytest

from gaitval.mocap import c3d, c3d_contents, c3d_person
from gaitval.mocap.c3d_contents import Contents

KEPT = 12
"""Files; a trial of half a minute has some MB."""

_known: dict[str, Contents] = {}


def read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Contents of a file with equal bytes are those of the first reading, as a copy. What cannot be
    read is tried again each time."""
    read = c3d_contents.read_contents
    for module in (c3d, c3d_person):
        monkeypatch.setattr(module, "read_contents", _remembering(read))


def _remembering(read: Callable[[Path], Contents]) -> Callable[[Path], Contents]:
    def known(path: Path) -> Contents:
        key = hashlib.sha256(path.read_bytes()).hexdigest()
        if key not in _known:
            if len(_known) == KEPT:
                del _known[next(iter(_known))]
            _known[key] = read(path)
        return deepcopy(_known[key])

    return known
