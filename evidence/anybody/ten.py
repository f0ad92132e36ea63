"""The ten built-in people before anybody else walked, and today: no limit may be lost.

Their stored baselines in `reports/` are read as they were at a commit and as they are; nothing is
walked. What other issues changed meanwhile is in them, too.
"""

import json
from argparse import Namespace
from collections.abc import Mapping
from typing import Any, Final

import evidence
from evidence import option
from evidence.fitted import stored_baselines
from evidence.rows import git

START: Final = "7ac11c342"
"""The last commit before the first of events of markers against plates."""
MEASURES = {"*": {"code": (), "data": ("reports/S??/baseline/metrics.json",)}}
"""What the rows depend on; see evidence/stale.py."""

Limits = Mapping[tuple[str, str], tuple[str, bool]]


def limits_of(metrics: Mapping[str, Any]) -> Limits:
    """Role ("acceptance", "context") of each limit and whether it is kept, by its name and what of
    the walk it is of.
    """
    return {
        (each["id"], each["target"]): (each["role"], bool(each["passed"]))
        for each in metrics["tolerances"]
    }


def lost(before: Limits, now: Limits, role: str) -> tuple[int, list[tuple[str, str]]]:
    """How many limits of a `role` were kept before, and those of them that are not today."""
    kept = [name for name, (of, passed) in before.items() if of == role and passed]
    return len(kept), [name for name in kept if not now.get(name, (role, False))[1]]


@evidence.measurement(option("--before", default=START, help="the commit to compare with"))
def ten(arguments: Namespace) -> list[evidence.Row]:
    """The ten before and after: limits that were kept then and are missed today."""
    found: dict[str, list[tuple[int, int]]] = {"acceptance": [], "context": []}
    for person, today in enumerate(stored_baselines(), start=1):
        file = f"reports/S{person:02d}/baseline/metrics.json"
        before = limits_of(json.loads(git("show", f"{arguments.before}:{file}")))
        now = limits_of(today)
        for role, counts in found.items():
            kept, gone = lost(before, now, role)
            counts.append((kept, len(gone)))
            for name, of in gone:
                print(f"S{person:02d}, {role}: {name}, {of} was kept")
    rows = []
    for role, words in (("acceptance", "of acceptance"), ("context", "of context")):
        kept, missed = (sum(each) for each in zip(*found[role], strict=True))
        what = f"the ten before and after: limits {words} kept before and missed today"
        rows.append(evidence.none_may(what, missed, "limits", kept))
    return rows
