"""A user's own marker set: read and checked."""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import ValidationError

from gaitval import file_gate
from gaitval.artefacts import parse_toml
from gaitval.errors import RecordError
from gaitval.model.body import SEGMENTS
from gaitval.scaling.landmarks import LANDMARK_NAMES
from gaitval.scaling.marker_set import MarkerDefinition, MarkerSet, MarkerSetFile, plain_name


def own_marker_set(name: str, *, builtin: Sequence[str]) -> MarkerSet:
    """The marker set in the TOML file `name`. Raises RecordError if it cannot be read, is perhaps
    meant as one of the names of the `builtin` sets, or has problems (all are listed).
    """
    try:
        parsed = MarkerSetFile.model_validate(
            parse_toml(_text_of(name, builtin), name, RecordError)
        )
    except ValidationError as error:
        from gaitval.refused_values import in_marker_set

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
        return file_gate.read_text(path, RecordError, largest=file_gate.WRITTEN)
    except UnicodeDecodeError as error:
        raise RecordError(
            f"{path}: the marker set cannot be read ({error}). Check the path; a marker set is "
            "a UTF-8 TOML file."
        ) from None
