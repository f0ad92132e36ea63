"""Marker sets as data: on which segment a marker sits and which anatomical landmark it marks.

A set is a TOML file (`markersets/*.toml`, or your own); the keys are explained at the top of
`markersets/wbds.toml`. Names are compared ignoring capitals, dots, blanks, "_" and "-", and
anything before a colon ("Subject:RASI").
"""

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Final, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gaitval.artefacts import parse_toml
from gaitval.errors import RecordError
from gaitval.model.body import SEGMENTS
from gaitval.scaling.landmarks import LANDMARK_NAMES
from gaitval.scaling.marker_names import alike, plain_name

_Point = TypeVar("_Point")

RECOGNISED_SHARE: Final = 0.75
"""Fraction of a set's markers (without optional ones and those removed after the standing trial)
that a recording must have to be recognised as this set. A few may be lost; two sets that use the
same names for the bony landmarks (WBDS and Rajagopal share 14 of 22) must not be confused."""

NEARLY_AS_MANY: Final = 0.9
"""A set with this fraction of the markers that the best set has in a recording fits nearly as well.
Where the two then mean different places by one name, neither is taken."""

EXAMPLE: Final = """title = "My laboratory"
source = "who defined it"
[markers]
"R.ASIS" = { segment = "pelvis", landmark = "R.ASIS" }
"R.Thigh.1" = { segment = "thigh_r" }
"R.Knee.Medial" = { segment = "thigh_r", landmark = "R.Knee.Medial", static_only = true }"""


class MarkerDefinition(BaseModel):
    """One marker of a set.

    Attributes
    ----------
    segment : one of `model.body.SEGMENTS`.
    landmark : one of `joint_centres.LANDMARK_NAMES`, or None for a marker that only tracks.
    weight : weight of its squared distance in inverse kinematics, relative to the others.
    aliases : other names of the marker.
    static_only : removed after the standing trial.
    optional : a recording without it is still of this set.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    segment: str
    landmark: str | None = None
    weight: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 1.0
    aliases: tuple[str, ...] = ()
    static_only: bool = False
    optional: bool = False

    @property
    def role(self) -> Literal["anatomical", "tracking"]:
        """Whether the marker lies on a landmark from which joint centres are found."""
        return "tracking" if self.landmark is None else "anatomical"


@dataclass(frozen=True)
class Score:
    """How well the names in a file fit a marker set.

    Attributes
    ----------
    required : number of markers that a recording of walking has.
    missing : those of them that the file lacks.
    found : number of all markers of the set in the file, also optional ones and those that are
        removed after the standing trial.
    """

    required: int
    missing: tuple[str, ...]
    found: int

    @property
    def share(self) -> float:
        """Fraction of the required markers that are there."""
        return 1.0 - len(self.missing) / self.required if self.required else 0.0

    def __str__(self) -> str:
        there = self.required - len(self.missing)
        lacking = f" (without {', '.join(self.missing)})" if self.missing else ""
        return (
            f"{there} of {self.required} required markers{lacking}, {self.found - there} other "
            "markers of the set"
        )


class _File(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    source: str
    markers: dict[str, MarkerDefinition]


@dataclass(frozen=True)
class MarkerSet:
    """A marker set.

    Attributes
    ----------
    name : of a built-in set, or the path of the file.
    title, source : what it is and who defined it.
    markers : definition of each marker, in the order of the file.
    """

    name: str
    title: str
    source: str
    markers: Mapping[str, MarkerDefinition]

    @property
    def landmarks(self) -> dict[str, str]:
        """Marker on each landmark."""
        return {d.landmark: name for name, d in self.markers.items() if d.landmark is not None}

    @property
    def segments(self) -> dict[str, str]:
        """Segment that each marker is on."""
        return {name: d.segment for name, d in self.markers.items()}

    @property
    def essential(self) -> tuple[str, ...]:
        """Markers that are on the person in walking and not optional."""
        return tuple(n for n, d in self.markers.items() if not (d.static_only or d.optional))

    def renamed(self, names: Iterable[str]) -> dict[str, str]:
        """For each of `names` in a file, its name in this set; names of other markers are left out.
        Raises RecordError if two are the same marker, for example because two people were recorded.
        """
        known = self._known()
        found: dict[str, str] = {}
        for name in names:
            marker = known.get(plain_name(name))
            if marker is None:
                continue
            if marker in found.values():
                other = next(seen for seen, as_ in found.items() if as_ == marker)
                raise RecordError(
                    f"the markers {other!r} and {name!r} are both {marker} of the marker set "
                    f"{self.name}. Keep one of them; if several people were recorded, keep one "
                    "person."
                )
            found[name] = marker
        return found

    def _known(self) -> dict[str, str]:
        """Marker of each plain name and alias."""
        return {
            plain_name(name): marker
            for marker, definition in self.markers.items()
            for name in (marker, *definition.aliases)
        }

    def present(self, names: Iterable[str]) -> frozenset[str]:
        """Markers of this set that the names refer to."""
        known = self._known()
        return frozenset(known[plain] for plain in map(plain_name, names) if plain in known)

    def score(self, names: Iterable[str]) -> Score:
        """How well the names in a file fit this set."""
        found = self.present(names)
        essential = self.essential
        missing = tuple(marker for marker in essential if marker not in found)
        return Score(len(essential), missing, len(found))

    def disagreements(self, other: "MarkerSet", names: Iterable[str]) -> tuple[str, ...]:
        """Names that this and another set put on different landmarks or segments."""
        mine, theirs = self._known(), other._known()
        return tuple(
            name
            for name in names
            for plain in [plain_name(name)]
            if plain in mine and plain in theirs
            if _differ(self.markers[mine[plain]], other.markers[theirs[plain]])
        )

    def ignored(self, names: Iterable[str]) -> tuple[str, ...]:
        """Names of a file that do not belong to this set, such as computed joint centres."""
        names = tuple(names)
        found = self.renamed(names)
        return tuple(name for name in names if name not in found)

    def on_landmarks(self, points: Mapping[str, _Point]) -> dict[str, _Point]:
        """The points (given by marker of this set) that are on landmarks, by landmark."""
        return {
            landmark: points[marker]
            for landmark, marker in self.landmarks.items()
            if marker in points
        }


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
    path = Path(name_or_path)
    if not name.endswith(".toml") and not path.is_file():
        near = difflib.get_close_matches(name.lower(), _builtin_names(), n=1)
        raise RecordError(
            f"{name!r}: no such marker set"
            + (f", did you mean {near[0]}? " if near else ". ")
            + f"The built-in sets are {', '.join(_builtin_names())}; or give the path of a TOML "
            "file."
        )
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordError(
            f"{path}: the marker set cannot be read ({error}). Check the path; a marker set is "
            "a UTF-8 TOML file."
        ) from None
    return _parsed(text, name)


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
        raise RecordError(_unknown(names, max(scored, key=lambda pair: pair[0].share)[1]))
    (best_score, best), *others = fitting
    for score, other in others:
        doubtful = best.disagreements(other, names)
        if doubtful and score.found >= NEARLY_AS_MANY * best_score.found:
            raise RecordError(_undecided((best, best_score), (other, score), doubtful)).with_way_on(
                f"--marker-set {best.name}", f"--marker-set {other.name}"
            )
    # For its error, if two names are one marker.
    best.renamed(names)
    return best


def _differ(one: MarkerDefinition, other: MarkerDefinition) -> bool:
    """Whether two definitions are of different places."""
    # A tracking marker and a landmark on one segment may be the same place.
    landmarks = {one.landmark, other.landmark} - {None}
    return one.segment != other.segment or len(landmarks) > 1


def _undecided(
    one: tuple[MarkerSet, Score], other: tuple[MarkerSet, Score], doubtful: Sequence[str]
) -> str:
    lines = ["the markers fit two marker sets nearly equally, which mean different places:"]
    lines += [f"  {fit.name} ({fit.title}): {score}" for fit, score in (one, other)]
    for name in doubtful:
        said = []
        for fit, _ in (one, other):
            definition = fit.markers[fit.renamed([name])[name]]
            said.append(f"{definition.landmark or 'no landmark'}, {definition.segment}")
        lines.append(f"  {name}: {' or '.join(said)}")
    lines.append(f"Say which it is: --marker-set {one[0].name} or --marker-set {other[0].name}.")
    return "\n".join(lines)


def _unknown(names: tuple[str, ...], nearest: MarkerSet) -> str:
    score = nearest.score(names)
    likely = alike(
        [name for name in names if not nearest.present([name])],
        {marker: (marker, *nearest.markers[marker].aliases) for marker in score.missing},
    )
    lines = [
        f"the {len(names)} markers match no known marker set ({', '.join(_builtin_names())}).",
        f"  found: {', '.join(names) or 'none'}",
        f"  the nearest is {nearest.name} ({nearest.title}): {score.required - len(score.missing)} "
        f"of {score.required} required markers, at least {RECOGNISED_SHARE:.0%} are needed; "
        f"its markers missing: {', '.join(score.missing)}",
    ]
    if likely:
        lines.append(
            "  perhaps: "
            + ", ".join(f"{like.name} for {like.marker} ({like.ratio:.0%})" for like in likely)
        )
    lines += [
        "Describe your own set in a TOML file and give it with --marker-set FILE, with a line "
        "for each marker, such as",
        *(f"  {line}" for line in EXAMPLE.splitlines()),
        f"Landmarks are {', '.join(LANDMARK_NAMES)}.",
        f"Segments are {', '.join(SEGMENTS)}.",
    ]
    return "\n".join(lines)


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
        problems = [_problem(item["loc"], item["type"], item["msg"]) for item in error.errors()]
    else:
        problems = _problems(parsed.markers)
        if not problems:
            return MarkerSet(name, parsed.title, parsed.source, parsed.markers)
    raise RecordError(
        f"{name}: {len(problems)} problem{'s' if len(problems) > 1 else ''} in the marker set\n"
        + "\n".join(f"  - {problem}" for problem in problems)
    )


def _problem(place: Sequence[int | str], kind: str, message: str) -> str:
    where = ".".join(str(key) for key in place)
    if kind != "extra_forbidden":
        return f"{where}: {message}."
    known = MarkerDefinition.model_fields if len(place) > 1 else _File.model_fields
    near = difflib.get_close_matches(str(place[-1]), known, n=1)
    return f"{where}: unknown key" + (
        f", did you mean {near[0]}?" if near else f"; known: {', '.join(known)}."
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
