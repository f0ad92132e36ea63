"""A marker set: on which segment each marker sits, and which anatomical landmark it marks.

Names are compared ignoring capitals, dots, blanks, "_" and "-", and anything before a colon
("Subject:RASI").
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from gaitval.errors import RecordError

_Point = TypeVar("_Point")


def plain_name(name: str) -> str:
    """A name without what never matters: capitals, dots, blanks, "_", "-" and "Subject:"."""
    return re.sub(r"[\s._-]", "", name.rsplit(":", 1)[-1]).upper()


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

    def renamed(
        self, names: Iterable[str], alike: Callable[[str, str], bool] = lambda _, __: False
    ) -> dict[str, str]:
        """For each of `names` in a file, its name in this set; names of other markers are left out,
        and copies (`alike` says of two whether they have the same trajectory), of which the first
        is kept. Of two names of one marker, that is it which the set spells so: OpenCap's files
        have a "RKnee" of the video beside "r_knee_study". Raises RecordError if two that are not
        alike are the same marker, for example because two people were recorded.
        """
        known = self._known()
        found: dict[str, str] = {}
        for name in names:
            marker = known.get(plain_name(name))
            if marker is None:
                continue
            if marker in found.values():
                other = next(seen for seen, as_ in found.items() if as_ == marker)
                spelled = (marker, *self.markers[marker].aliases)
                here, there = (n.rsplit(":", 1)[-1] in spelled for n in (name, other))
                of_one = name.rpartition(":")[0] == other.rpartition(":")[0]
                if alike(other, name) or (of_one and there and not here):
                    continue
                if of_one and here and not there:
                    del found[other]
                    found[name] = marker
                    continue
                remedy = (
                    "Keep one of them."
                    if of_one
                    else "If they are of several people, which no option chooses from, export the "
                    "trials of each alone, with one subject active in the recording program; if "
                    "of one, keep one of them."
                )
                raise RecordError(
                    f"the markers {other!r} and {name!r} are both {marker} of the marker set "
                    f"{self.name}. {remedy}"
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
        known = self._known()
        return tuple(name for name in names if plain_name(name) not in known)

    def on_landmarks(self, points: Mapping[str, _Point]) -> dict[str, _Point]:
        """The points (given by marker of this set) that are on landmarks, by landmark."""
        return {
            landmark: points[marker]
            for landmark, marker in self.landmarks.items()
            if marker in points
        }


def _differ(one: MarkerDefinition, other: MarkerDefinition) -> bool:
    """Whether two definitions are of different places."""
    # A tracking marker and a landmark on one segment may be the same place.
    landmarks = {one.landmark, other.landmark} - {None}
    return one.segment != other.segment or len(landmarks) > 1


class MarkerSetFile(BaseModel):
    """A marker set as its TOML file has it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    source: str
    markers: dict[str, MarkerDefinition]

    def named(self, name: str) -> MarkerSet:
        """The set in this file, which is called `name`."""
        return MarkerSet(name, self.title, self.source, self.markers)
