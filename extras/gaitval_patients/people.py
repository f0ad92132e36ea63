"""Who walked: sex, age, mass, stature and what else a table of people says of them.

Laboratories name columns as they like, so headers are known by their words (`HEADERS`), and units
by the header or the size of the value. What cannot be read stays unknown; `estimates` fills it in,
with an interval.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from gaitval import file_gate
from gaitval.coordinates import Side
from gaitval.errors import RecordError

HEADERS: Final[Mapping[str, str]] = {
    "subject": r"id|subject|subject code|subject id|participant|patient",
    "sex": r"sex|gender",
    "age": r"age|age ?\(?(yrs|years|y)\)?|age_years",
    "mass": r"mass|weight|body ?mass|(mass|weight) ?\(kg\)|mass_kg|weight_kg",
    "height": r"height|stature|(height|stature) ?\((m|cm|mm)\)|height_m|height_cm",
    "leg_length": r"leg ?len(gth)?|leg ?length ?\((m|cm)\)|leg_length_m",
    "right_leg": r"(leg ?length right|right leg ?length) ?(\((m|cm)\))?|leg_length_right_m",
    "left_leg": r"(leg ?length left|left leg ?length) ?(\((m|cm)\))?|leg_length_left_m",
    "speed": r"speed|gait ?speed|walking ?speed|speed ?\(m/s\)|walking_speed_m_s|og_comf",
    "amputation": r"amputation side|amputated side|prosthetic side",
    "level": r"(amputation |amputated )?level|level of amputation",
    "affected": r"(on - |off - )?updrs-iii asymmetry|affected side|paretic side|side",
}
"""Headers, in lower case, of what is read."""

STATES: Final = ("off", "on", "pre", "post")
"""What a name may end in, after an underscore, that is no part of the person's name."""
_BELOW_KNEE: Final = r"(?i).*(trans-?tibial|below|\b(tt|bk|ttka)\b|syme|ankle|foot).*"
"""Levels of an amputation that leave the knee."""
_UNKNOWN: Final = ("", "-", "na", "n/a", "nan", "none", "undetermined", "unknown")


@dataclass(frozen=True)
class Person:
    """A row of a table of people; what it does not say is None.

    Attributes
    ----------
    mass : kg. height, leg_length : m. speed : m/s. age : years.
    legs : m, of both sides, where both were measured.
    amputation : side of an above-knee prosthesis, or of one whose level is not said.
    below_knee : side of one that leaves the knee; it is no part of the body's model.
    affected : by state ("on", "off", or "" where the table has no states), the side that moves
        worse.
    """

    identifier: str
    sex: Literal["F", "M"] | None = None
    age: float | None = None
    mass: float | None = None
    height: float | None = None
    leg_length: float | None = None
    legs: Mapping[Side, float] | None = None
    speed: float | None = None
    amputation: Side | None = None
    below_knee: Side | None = None
    affected: Mapping[str, Side] | None = None


def read_people(path: Path) -> dict[str, Person]:
    """The people of a CSV table, by identifier; empty rows are left out. Raises RecordError if it
    has no column of identifiers, or a person stands in it twice with other values.
    """
    found: dict[str, Person] = {}
    for line, cells in file_gate.csv_rows(path, RecordError, largest=file_gate.WRITTEN):
        known = _columns(name for name in cells if name is not None)
        if "subject" not in known.values():
            raise RecordError(
                f"{path}: no column says who a row is of; its header has {', '.join(cells)}. Name "
                "one of them Subject."
            )
        person = _person({name: (cells[name] or "").strip() for name in known}, known)
        if person is None:
            continue
        if found.get(person.identifier, person) != person:
            raise RecordError(
                f"{path}, line {line}: {person.identifier} is there a second time with other "
                "values. Keep one row."
            )
        found[person.identifier] = person
    return found


def person_of(subject: str, people: Mapping[str, Person]) -> tuple[Person, str]:
    """The row of `people` for a `subject` of a table of strides, and the state in its name.

    "SUB01_off" is SUB01 in the state "off"; "WBDS05" is 5 where people are numbered.

    Of somebody without a row nothing is known but the name.
    """
    before, _, state = subject.partition("_")
    number = re.sub(r"^\D*0*", "", before)
    for name, of in ((subject, ""), (before, state), (number, state)):
        if name and name in people:
            return people[name], of
    return Person(before if state in STATES else subject), state if state in STATES else ""


def _columns(headers: Iterable[str]) -> dict[str, str]:
    """What each header means; those that are not known are left out."""
    found = {}
    for header in headers:
        plain = re.sub(r"\s+", " ", header.strip().lower())
        for meaning, pattern in HEADERS.items():
            if re.fullmatch(pattern, plain):
                found[header] = meaning
                break
    return found


def _person(cells: Mapping[str, str], known: Mapping[str, str]) -> Person | None:
    values: dict[str, Any] = {}
    affected: dict[str, Side] = {}
    below = False
    for header, meaning in known.items():
        text = cells[header]
        if text.lower() in _UNKNOWN:
            continue
        if meaning == "affected":
            side = _side(text)
            if side is not None:
                state = re.match(r"(on|off) - ", header.strip().lower())
                affected[state[1] if state else ""] = side
        elif meaning == "amputation":
            values[meaning] = _side(text)
        elif meaning == "level":
            below = re.fullmatch(_BELOW_KNEE, text) is not None
        elif meaning == "sex":
            letter = text[:1].upper()
            values[meaning] = letter if letter in ("F", "M") else None
        elif meaning == "subject":
            values[meaning] = re.sub(r"\.0$", "", text)
        else:
            number = _number(text)
            lengths = ("height", "leg_length", "right_leg", "left_leg")
            if number is not None and meaning in lengths:
                # No leg or stature is 3 m, and none is 3 cm.
                number = next((number / by for by in (1.0, 100.0, 1000.0) if number / by < 3.0), 0)
            values[meaning] = number
    if not values.get("subject"):
        return None
    if below and (side := values.pop("amputation", None)):
        values["below_knee"] = affected[""] = side
    right, left = values.pop("right_leg", None), values.pop("left_leg", None)
    if right and left:
        legs: Mapping[Side, float] = {"right": right, "left": left}
        values |= {"legs": legs, "leg_length": values.get("leg_length") or (right + left) / 2}
    return Person(values.pop("subject"), affected=affected or None, **values)


def _side(text: str) -> Side | None:
    first = text[:1].lower()
    return "right" if first == "r" else "left" if first == "l" else None


def _number(text: str) -> float | None:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return None
