"""Marker sets as data: those that come with gaitval, a user's own, and which one a recording has.

A set is a TOML file (`markersets/*.toml`, or your own); the keys are explained at the top of
`markersets/wbds.toml`.
"""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from gaitval._internal.io import file_gate
from gaitval._internal.io.artefacts import parse_toml
from gaitval._internal.text.any_case import as_known
from gaitval.errors import RecordError
from gaitval.model.body import SEGMENTS
from gaitval.scaling.landmarks import LANDMARK_NAMES
from gaitval.scaling.marker_set import MarkerDefinition, MarkerSet, MarkerSetFile, plain_name

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
    name = as_known(str(name_or_path), _builtin_names())
    if name in _builtin_names():
        return _builtin(name)
    return own_marker_set(name, builtin=_builtin_names())


def recognise(names: Iterable[str], sets: Sequence[MarkerSet] | None = None) -> MarkerSet:
    """The marker set of `sets` (the built-in ones when None) that a recording's marker `names`
    belong to.

    Of the sets with at least `RECOGNISED_SHARE` of their required markers among the names, it is
    the one with the most markers there. Raises RecordError if no set fits, or two fit nearly
    equally and mean different places by a name. The message lists what was found, what the nearest
    set is missing, and how to draft your own.
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


def own_marker_set(name: str, *, builtin: Sequence[str]) -> MarkerSet:
    """The marker set in the TOML file `name`. Raises RecordError if it cannot be read, is perhaps
    meant as one of the names of the `builtin` sets, or has problems (all are listed).
    """
    try:
        parsed = MarkerSetFile.model_validate(
            parse_toml(_text_of(name, builtin), name, RecordError)
        )
    except ValidationError as error:
        from gaitval._internal.text.refused_values import in_marker_set

        problems = [in_marker_set(MarkerSetFile, MarkerDefinition, item) for item in error.errors()]
    else:
        problems = problems_of(parsed.markers)
        if not problems:
            return parsed.named(name)
    raise RecordError(
        f"{name}: {len(problems)} problem{'s' if len(problems) > 1 else ''} in the marker set\n"
        + "\n".join(f"  - {problem}" for problem in problems)
    )


def problems_of(markers: Mapping[str, MarkerDefinition]) -> list[str]:
    """What is wrong with the `markers` of a set, a sentence each."""
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


def _text_of(name: str, builtin: Sequence[str]) -> str:
    path = Path(name)
    if not name.endswith(".toml") and not path.is_file():
        near = difflib.get_close_matches(name.lower(), builtin, n=1)
        raise RecordError(
            f"{name!r}: no such marker set"
            + (f", did you mean {near[0]}? " if near else ". ")
            + f"The built-in sets are {', '.join(builtin)}; or give the path of a TOML "
            "file."
        )
    try:
        return file_gate.read_text(path, RecordError, largest=file_gate.SIZES.written)
    except UnicodeDecodeError as error:
        raise RecordError(
            f"{path}: the marker set cannot be read ({error}). Check the path; a marker set is "
            "a UTF-8 TOML file."
        ) from None
