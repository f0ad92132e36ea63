"""Marker sets as data: those that come with gaitval, a user's own, and which one a recording has.

A set is a TOML file (`markersets/*.toml`, or your own); the keys are explained at the top of
`markersets/wbds.toml`.
"""

from collections.abc import Iterable, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Final

from gaitval.artefacts import parse_toml
from gaitval.errors import RecordError
from gaitval.scaling.marker_set import MarkerSet, MarkerSetFile

RECOGNISED_SHARE: Final = 0.75
"""Fraction of a set's markers (without optional ones and those removed after the standing trial)
that a recording must have to be recognised as this set. A few may be lost; two sets that use the
same names for the bony landmarks (WBDS and Rajagopal share 14 of 22) must not be confused."""

NEARLY_AS_MANY: Final = 0.9
"""A set with this fraction of the markers that the best set has in a recording fits nearly as well.
Where the two then mean different places by one name, neither is taken."""


def builtin_marker_sets() -> tuple[MarkerSet, ...]:
    """The marker sets that come with gaitval."""
    return tuple(_builtin(name) for name in _builtin_names())


def load_marker_set(name_or_path: str | Path) -> MarkerSet:
    """A built-in marker set by name, or one from a TOML file (`name_or_path`). Raises RecordError
    if there is no such set or file, or the file has problems (all are listed).
    """
    name = str(name_or_path)
    if name in _builtin_names():
        return _builtin(name)
    from gaitval.scaling.own_marker_set import own_marker_set

    return own_marker_set(name, builtin=_builtin_names())


def recognise(names: Iterable[str], sets: Sequence[MarkerSet] | None = None) -> MarkerSet:
    """The marker set of `sets` (the built-in ones when None) that a recording's marker `names`
    belong to.

    Of the sets with at least `RECOGNISED_SHARE` of their required markers among the names, it is
    the one with the most markers there. Raises RecordError if no set fits, or two fit nearly
    equally and mean different places by a name. The message lists what was found, what the nearest
    set is missing and which names may be those, and shows how to write your own set.
    """
    names = tuple(names)
    scored = sorted(
        (
            (candidate.score(names), candidate)
            for candidate in (builtin_marker_sets() if sets is None else sets)
        ),
        key=lambda pair: (pair[0].found, pair[0].share),
        reverse=True,
    )
    fitting = [(score, fit) for score, fit in scored if score.share >= RECOGNISED_SHARE]
    if not fitting:
        from gaitval.scaling.unrecognised import unknown

        nearest = max(scored, key=lambda pair: pair[0].share)[1]
        raise RecordError(unknown(names, nearest, builtin=_builtin_names(), least=RECOGNISED_SHARE))
    (best_score, best), *others = fitting
    for score, other in others:
        uncertain = best.disagreements(other, names)
        if uncertain and score.found >= NEARLY_AS_MANY * best_score.found:
            from gaitval.scaling.unrecognised import undecided

            raise RecordError(undecided((best, best_score), (other, score), uncertain)).with_way_on(
                f"--marker-set {best.name}", f"--marker-set {other.name}"
            )
    return best


@cache
def _builtin_names() -> tuple[str, ...]:
    folder = resources.files("gaitval.scaling") / "markersets"
    return tuple(
        sorted(file.name[: -len(".toml")] for file in folder.iterdir() if file.name[-5:] == ".toml")
    )


@cache
def _builtin(name: str) -> MarkerSet:
    file = resources.files("gaitval.scaling") / "markersets" / f"{name}.toml"
    # Without the checks of a user's file: tests make them of those that come with gaitval.
    stored = parse_toml(file.read_text(encoding="utf-8"), name, RecordError)
    return MarkerSetFile.model_validate(stored).named(name)
