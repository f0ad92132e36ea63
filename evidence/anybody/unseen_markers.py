"""Marker sets drafted of people whose recordings nobody had looked at before they were measured.

As `markers.py`, which has the ways to take names away, and on no account to choose anything on.
`evidence/anybody/unseen_markers.toml` lists the recordings.
"""

import tomllib
from argparse import Namespace
from dataclasses import replace
from typing import Final

import numpy as np

import evidence
from evidence import ROOT
from evidence.anybody.markers import (
    CLONES,
    SEED,
    judged,
    only_markers,
    recorded,
    renamed,
    variants,
)
from gaitval_markers.draft import draft_of, places_of

LIST: Final = ROOT / "evidence" / "anybody" / "unseen_markers.toml"
MEASURES = {
    "*": {
        "code": ("evidence/anybody/markers.py", "extras/gaitval_markers/*.py"),
        "data": ("evidence/anybody/unseen_markers.toml", "extras/gaitval_markers/*.toml"),
        "allowed": 1,
        "why": "where the help shows the command",
    }
}
"""What the rows depend on; see evidence/stale.py."""


@evidence.measurement(CLONES)
def unseen_markers(arguments: Namespace) -> list[evidence.Row]:
    """Markers drafted right, of people never looked at before."""
    found: dict[str, list[tuple[int, int, int]]] = {}
    listed = tomllib.loads(LIST.read_text(encoding="utf-8"))["unseen"]
    for number, entry in enumerate(listed):
        _, standing, truth = recorded(entry, arguments.clones)
        standing = only_markers(standing)
        number_of = {name: f"M{i:02d}" for i, name in enumerate(standing.names)}
        # What places alone say does not depend on the names: it is worked out once.
        places = places_of(renamed(standing, number_of))
        name_of = {each: name for name, each in number_of.items()}
        for kind, new in variants(standing.names, truth, SEED + number):
            named = tuple(new[name_of[each]] for each in places.names)
            draft = draft_of(replace(places, names=named))
            told = {new[name]: where for name, where in truth.items() if name in new}
            right, count, used, wrong = judged(draft, told)
            found.setdefault(kind, []).append((right, count, used))
            back = {other: name for name, other in new.items()}
            said = [f"{back[each.split(' as ')[0]]} {each}" for each in wrong]
            print(
                f"{entry['standing']}, {kind}: {right} of {count}", *said, sep="\n   ", flush=True
            )
    rows = []
    for kind, each in found.items():
        right, count, used = (int(value) for value in np.sum(each, axis=0))
        what = f"markers of people never looked at drafted, {kind}"
        rows += [
            evidence.Row(f"{what}: right", 100 * right / count, "%", ">=", 98, 92, count),
            evidence.none_may(f"{what}: wrong ones used unseen", used, "markers", count),
        ]
    return rows
