"""References that tests fit again and again are fitted once in a session of tests.

Each takes seconds, and most studies of a test are of the same few people and settings.
"""

import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import pytest

from gaitval.walk.reference import dynamic_fit


def fit_once(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """The fit of equal inputs, to the last bit, is the first one's, kept in a folder that all
    workers share. What differs in anything, or fails, is worked out."""
    folder.mkdir(exist_ok=True)
    monkeypatch.setattr(dynamic_fit, "fitted", _remembering(dynamic_fit.fitted, folder))


def _key(given: tuple[object, ...], named: dict[str, object]) -> str:
    return hashlib.sha256(pickle.dumps((given, sorted(named.items())))).hexdigest()


def _remembering(fit: Callable[..., object], folder: Path) -> Callable[..., object]:
    def known(*given: object, **named: object) -> object:
        kept = folder / _key(given, named)
        if not kept.exists():
            own = folder / f"{kept.name}.{os.getpid()}"
            own.write_bytes(pickle.dumps(fit(*given, **named)))
            own.replace(kept)
        return pickle.loads(kept.read_bytes())

    return known
