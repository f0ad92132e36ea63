"""References that tests fit again and again, moments that they share to muscles, and markers that
they match to a body, are worked out once in a session of tests.

Each takes about a second or more, and most runs of a test are of the same few people and settings.
"""

import hashlib
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import pytest

from gaitval.musculature import gait
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


KEPT = 6
"""Of what is shared to muscles, in the memory of a worker: 9 MB for a leg of a walk."""


def share_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same of muscles, which are more than half of the time of comparing a walk; only the last
    few, for most are those of the test before."""
    share, last = gait.share, dict[str, bytes]()

    def known(*given: object, **named: object) -> object:
        key = _key(given, named)
        if key not in last:
            last[key] = pickle.dumps(share(*given, **named))
            if len(last) > KEPT:
                del last[next(iter(last))]
        return pickle.loads(last[key])

    monkeypatch.setattr(gait, "share", known)


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
