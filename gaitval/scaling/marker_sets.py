"""Marker sets as data: those that come with gaitval, a user's own, and which one a recording has.

A set is a TOML file (`markersets/*.toml`, or your own); the keys are explained at the top of
`markersets/wbds.toml`. Names are compared ignoring capitals, dots, blanks, "_" and "-", and
anything before a colon ("Subject:RASI").
"""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict, ValidationError

from gaitval.artefacts import parse_toml
from gaitval.errors import RecordError
from gaitval.model.body import SEGMENTS
from gaitval.scaling.landmarks import LANDMARK_NAMES
from gaitval.scaling.marker_set import MarkerDefinition, MarkerSet, plain_name

RECOGNISED_SHARE: Final = 0.75
"""Fraction of a set's markers (without optional ones and those removed after the standing trial)
that a recording must have to be recognised as this set. A few may be lost; two sets that use the
same names for the bony landmarks (WBDS and Rajagopal share 14 of 22) must not be confused."""

NEARLY_AS_MANY: Final = 0.9
"""A set with this fraction of the markers that the best set has in a recording fits nearly as well.
Where the two then mean different places by one name, neither is taken."""


class _File(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    source: str
    markers: dict[str, MarkerDefinition]


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
    from gaitval.scaling.unrecognised import text_of

    return _parsed(text_of(name, builtin=_builtin_names()), name)


def recognise(names: Iterable[str], sets: Sequence[MarkerSet] | None = None) -> MarkerSet:
    """The marker set of `sets` (the built-in ones when None) that a recording's marker `names`
    belong to.

    Of the sets with at least `RECOGNISED_SHARE` of their required markers among the names, it is
    the one with the most markers there. Raises RecordError if two names are the same marker; no set
    fits, or two fit nearly equally and mean different places by a name. The message lists what was
    found, what the nearest set is missing and which names may be those, and shows how to write your
    own set.
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
        doubtful = best.disagreements(other, names)
        if doubtful and score.found >= NEARLY_AS_MANY * best_score.found:
            from gaitval.scaling.unrecognised import undecided

            raise RecordError(undecided((best, best_score), (other, score), doubtful)).with_way_on(
                f"--marker-set {best.name}", f"--marker-set {other.name}"
            )
    # For its error, if two names are one marker.
    best.renamed(names)
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
    return _parsed(file.read_text(encoding="utf-8"), name)


def _parsed(text: str, name: str) -> MarkerSet:
    try:
        parsed = _File.model_validate(parse_toml(text, name, RecordError))
    except ValidationError as error:
        from gaitval.refused_values import in_marker_set

        problems = [in_marker_set(_File, MarkerDefinition, item) for item in error.errors()]
    else:
        problems = _problems(parsed.markers)
        if not problems:
            return MarkerSet(name, parsed.title, parsed.source, parsed.markers)
    raise RecordError(
        f"{name}: {len(problems)} problem{'s' if len(problems) > 1 else ''} in the marker set\n"
        + "\n".join(f"  - {problem}" for problem in problems)
    )


def _problems(markers: Mapping[str, MarkerDefinition]) -> list[str]:
    problems = [] if markers else ["no markers. Add a line for each to the table [markers]."]
    names: dict[str, str] = {}
    landmarks: dict[str, str] = {}
    for marker, definition in markers.items():
        for what, value, known in (
            ("segment", definition.segment, SEGMENTS),
            ("landmark", definition.landmark, LANDMARK_NAMES),
        ):
            if value is not None and value not in known:
                lower = {name.lower(): name for name in known}
                near = difflib.get_close_matches(value.lower(), lower, n=1)
                hint = f", did you mean {lower[near[0]]}?" if near else ""
                problems.append(
                    f"{marker}: unknown {what} {value!r}"
                    + (hint or f"; known: {', '.join(known)}.")
                )
        for name in (marker, *definition.aliases):
            other = names.setdefault(plain_name(name), marker)
            if other != marker:
                problems.append(f"{marker}: its name {name!r} is also one of {other}.")
        if definition.landmark is not None:
            other = landmarks.setdefault(definition.landmark, marker)
            if other != marker:
                problems.append(f"{marker}: its landmark {definition.landmark} is that of {other}.")
    return problems
