"""The bands of an import with a change of each kind, in place of one for every landmark and axis.

All of them are two thirds of the time of an import, and few tests read a band.
"""

from pathlib import Path

import pytest

from gaitval.session.measurement import bands

WHOLE = (
    "measurement/test_bands.py",
    "measurement/test_page.py",
)
"""Files of tests that read bands."""
EVERY = bands._Chain.changes


def reads_bands(path: Path, tests: Path) -> bool:
    """Whether the tests in the file `path` need every change."""
    return path.relative_to(tests).as_posix() in WHOLE


def few_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    """One landmark, the hip centres and one segment's soft tissue are moved, each along one axis:
    all that works out a band runs, and may fail as it would."""

    def few(chain: bands._Chain) -> list[bands._Change]:
        kinds = {change.source.split()[0]: change for change in reversed(EVERY(chain))}
        return list(kinds.values())

    monkeypatch.setattr(bands._Chain, "changes", few)


def every_change(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a process of its own."""
    monkeypatch.setattr(bands._Chain, "changes", EVERY)
