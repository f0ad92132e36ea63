"""A marker set drafted from the names in a file, as the TOML that `--marker-set` reads."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

import tomli_w

from gaitval.model.body import SEGMENTS
from gaitval.scaling.landmarks import LANDMARK_NAMES
from gaitval.scaling.marker_set import MarkerDefinition
from gaitval.scaling.markers.names import ParsedName, meanings, read_names


@dataclass(frozen=True)
class Draft:
    """What the names of a file say.

    Attributes
    ----------
    sure : definition of each marker whose name says one place.
    unsure : of each other marker, all that its name may mean; nothing where it is silent, or of the
        head or a hand, of which gaitval's body has none.
    """

    sure: Mapping[str, MarkerDefinition]
    unsure: Mapping[str, tuple[MarkerDefinition, ...]]

    def as_toml(self, title: str, source: str) -> str:
        """The text of the file: sure markers as lines, the others as comments."""
        keys = (
            "Drafted by `gaitval markers`, from names alone. Correct it. Keys: segment; landmark "
            "(without one a marker only tracks its segment); weight in inverse kinematics; "
            "optional: may be missing in a trial; static_only: taken off after standing.",
            f"Segments are {', '.join(SEGMENTS)}.",
            f"Landmarks are {', '.join(LANDMARK_NAMES)}.",
        )
        lines = [f"# {line}" for text in keys for line in wrap(text, 96)]
        lines += ["", f"title = {_quoted(title)}", f"source = {_quoted(source)}", "", "[markers]"]
        lines += [_line(name, definition) for name, definition in self.sure.items()]
        if self.unsure:
            lines += [
                "",
                "# Not used: the name says no place, no side, or that of another marker too. Take",
                "# away the # in front of those that you have corrected.",
                *(f"# {_unsure(name, means)}" for name, means in self.unsure.items()),
            ]
        return "\n".join(lines) + "\n"


def draft_of(names: Sequence[str]) -> Draft:
    """The draft of a file with these `names` of markers."""
    parsed = dict(zip(names, read_names(names), strict=True))
    found = {name: _definitions(word) for name, word in parsed.items()}
    on = Counter(means[0].landmark for means in found.values() if len(means) == 1)
    sure = {
        name: means[0]
        for name, means in found.items()
        if len(means) == 1 and (means[0].landmark is None or on[means[0].landmark] == 1)
    }
    return Draft(sure, {n: means for n, means in found.items() if n not in sure})


def _definitions(word: ParsedName) -> tuple[MarkerDefinition, ...]:
    """All that a name may mean; where it says no side, on both."""
    found = []
    for name in word.places:
        place = dict(meanings()["places"][name])
        segment, landmark = place.pop("segment"), place.pop("landmark", False)
        if not segment:
            continue
        for side in word.side or "RL":
            sided = f"{side}.{name}" in LANDMARK_NAMES
            part = segment if segment in SEGMENTS else f"{segment}_{side.lower()}"
            at = (f"{side}.{name}" if sided else name) if landmark else None
            found.append(MarkerDefinition(segment=part, landmark=at, **place))
    return tuple(dict.fromkeys(found))


def _unsure(name: str, means: Sequence[MarkerDefinition]) -> str:
    if not means:
        return f'{_quoted(name)} = {{ segment = "?" }}'
    others = [each.landmark or each.segment for each in means[1:]]
    return _line(name, means[0]) + (f"  # or {', '.join(others)}" if others else "")


def _line(name: str, definition: MarkerDefinition) -> str:
    keys = tomli_w.dumps(definition.model_dump(exclude_defaults=True)).splitlines()
    return f"{_quoted(name)} = {{ {', '.join(keys)} }}"


def _quoted(text: str) -> str:
    """As TOML, on one line."""
    return tomli_w.dumps({"text": text}).removeprefix("text = ").rstrip("\n")
