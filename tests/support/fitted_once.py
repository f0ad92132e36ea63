"""References that tests fit again and again, and markers that they match to a body, are worked out
once in a session of tests.

A fit takes seconds, and most runs of a test are of the same few people and settings.
"""

import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import pytest

from gaitval.reference import dynamic_fit
from gaitval.scaling.markers import draft


def fit_once(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """The fit of equal inputs, to the last bit, is the first one's, kept in a folder that all
    workers share. What differs in anything, or fails, is worked out."""
    folder.mkdir(exist_ok=True)
    monkeypatch.setattr(dynamic_fit, "fitted", _remembering(dynamic_fit.fitted, folder))


def match_once(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """The same of matching markers by their places, which most drafts of a test file have alike."""
    folder.mkdir(exist_ok=True)
    monkeypatch.setattr(draft, "matched", _remembering(draft.matched, folder))


def _remembering(fit: Callable[..., object], folder: Path) -> Callable[..., object]:
    def known(*given: object) -> object:
        kept = folder / hashlib.sha256(pickle.dumps(given)).hexdigest()
        if not kept.exists():
            own = folder / f"{kept.name}.{os.getpid()}"
            own.write_bytes(pickle.dumps(fit(*given)))
            own.replace(kept)
        return pickle.loads(kept.read_bytes())

    return known
