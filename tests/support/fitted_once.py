"""References that tests fit again and again are fitted once in a session of tests.

A fit takes seconds, and most runs of a test are of the same few people and settings.
"""

import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import pytest

from gaitval.reference import dynamic_fit
from gaitval.reference.motion import ReferenceMotion


def fit_once(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """The fit of equal inputs, to the last bit, is the first one's, kept in a folder that all
    workers share. What differs in anything, or fails, is worked out."""
    folder.mkdir(exist_ok=True)
    monkeypatch.setattr(dynamic_fit, "fitted", _remembering(dynamic_fit.fitted, folder))


def _remembering(fit: Callable[..., ReferenceMotion], folder: Path) -> Callable[..., object]:
    def known(*given: object) -> object:
        kept = folder / hashlib.sha256(pickle.dumps(given)).hexdigest()
        if not kept.exists():
            own = folder / f"{kept.name}.{os.getpid()}"
            own.write_bytes(pickle.dumps(fit(*given)))
            own.replace(kept)
        return pickle.loads(kept.read_bytes())

    return known
