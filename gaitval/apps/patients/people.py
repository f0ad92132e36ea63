"""People of a table of strides: sex, age, mass, lengths and side, whatever the columns are called.

What a table does not say stays unknown; `estimates` fills it in, with an interval.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal

from gaitval._internal.io import file_gate
from gaitval.coordinates import Side
from gaitval.errors import RecordError
from gaitval.units import AGE, BODY_MASS, LENGTH, STATURE, WALKING_SPEED, Quantity, unit_of

HEADERS: Final[Mapping[str, str]] = {
    "subject": r"id|subject|subject code|subject id|participant|patient",
    "sex": r"sex|gender",
    "age": r"age",
    "mass": r"(body ?)?(mass|weight)",
    "height": r"(body ?)?(height|stature)",
    "leg_length": r"leg ?len(gth)?",
    "right_leg": r"leg ?length ?[(_]?r(ight)?\)?|r(ight)? leg ?length",
    "left_leg": r"leg ?length ?[(_]?l(eft)?\)?|l(eft)? leg ?length",
    "speed": r"((gait|walking) ?)?(speed|velocity)|walking_speed|og_comf",
    "amputation": r"(amputation|prosthetic|prosthesis) side|amputated (side|leg|limb)|"
    r"side of (the )?(amputation|prosthesis)",
    "level": r"(amputation |amputated )?level|level of amputation",
    "affected": r"(on - |off - )?updrs-iii asymmetry|affected side|paretic side|side",
}
"""Headers, in lower case, of what is read; a unit may follow."""

STATES: Final = ("off", "on", "pre", "post")
"""What a name may end in, after an underscore, that is no part of the person's name."""
_BELOW_KNEE: Final = (
    r"(?i).*(trans[- ]?tibial|below|\b(tt|bk|bt)[ap]?\b|\bb/k\b|\bttka\b|syme|ankle|foot|chopart|"
    r"lisfranc|lower leg|shank|unterschenkel).*"
)
"""Levels of an amputation that leave the knee."""
_ABOVE_KNEE: Final = (
    r"(?i).*(trans[- ]?femoral|above|\b(tf|ak|kd|hd)[ap]?\b|\ba/k\b|knee|gritti|hip|thigh|"
    r"oberschenkel).*"
)
"""Those that do not, where none of the words of `_BELOW_KNEE` is there."""
_NO_AMPUTATION: Final = ("0", "n", "no", "control", "healthy", "intact")
_UNKNOWN: Final = (
    *("", "-", "–", "?", "na", "n/a", "n.a.", "nan", "none", "undetermined", "unknown"),
    *("not known", "not recorded"),
)
_SEXES: Final[Mapping[str, Literal["F", "M"]]] = {
    **dict.fromkeys(("f", "female", "w", "woman", "girl", "weiblich"), "F"),
    **dict.fromkeys(("m", "male", "man", "boy", "männlich"), "M"),
}
_LEG: Final = Quantity("the length of a leg", LENGTH.units, 0.35, 1.4)
_QUANTITIES: Final[Mapping[str, Quantity]] = {
    "age": AGE,
    "mass": BODY_MASS,
    "speed": WALKING_SPEED,
    "height": STATURE,
    **dict.fromkeys(("leg_length", "right_leg", "left_leg"), _LEG),
}


@dataclass(frozen=True)
class PersonRow:
    """A row of a table of people; what it does not say is None.

    Attributes
    ----------
    mass : kg. height, leg_length : m. speed : m/s. age : years.
    legs : m, of both sides, where both were measured.
    amputation : side of an above-knee prosthesis, or of one whose level is not said; one that
        leaves the knee is no part of the body's model.
    affected : by state ("on", "off", or "" where the table has no states), the side that moves
        worse.
    table : name of the file that the row is in; empty for somebody without a row.
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
    affected: Mapping[str, Side] | None = None
    table: str = field(default="", compare=False)


def read_people(path: Path) -> dict[str, PersonRow]:
    """The people of a CSV table `path`, by identifier; empty rows are left out. Raises RecordError
    if it has no column of identifiers, a person stands in it twice with other values, or a sex or a
    number cannot be understood.
    """
    found: dict[str, PersonRow] = {}
    for line, cells in file_gate.csv_rows(path, RecordError, largest=file_gate.SIZES.written):
        if {"angle", "p0", "p100"} <= cells.keys():
            raise RecordError(
                f"{path}: this is a table of strides. Give it first, the people's with --people."
            )
        known = _columns(name for name in cells if name is not None)
        if "subject" not in (meaning for meaning, _ in known.values()):
            header = ", ".join(filter(None, cells))  # None: cells beyond it
            raise RecordError(
                f"{path}: no column says who a row is of; its header has {header}. Name one of "
                "them Subject."
            )
        row = {name: (cells[name] or "").strip() for name in known}
        person = _person(row, known, path.name, f"{path}, line {line}")
        if person is None:
            continue
        if found.get(person.identifier, person) != person:
            raise RecordError(
                f"{path}, line {line}: {person.identifier} is there a second time with other "
                "values. Keep one row."
            )
        found[person.identifier] = person
    return found


def person_of(subject: str, people: Mapping[str, PersonRow]) -> tuple[PersonRow, str]:
    """The row of `people` for a `subject` of a table of strides, and the state in its name:
    "SUB01_off" is SUB01 in the state "off". Of somebody without a row nothing is known but the
    name.
    """
    before, _, state = subject.partition("_")
    for name, of in ((subject, ""), (before, state)):
        if name in people:
            return people[name], of
    return PersonRow(before if state in STATES else subject), state if state in STATES else ""


def _columns(headers: Iterable[str]) -> dict[str, tuple[str, str]]:
    """What each header means, and the word of its unit; those that are not known are left out."""
    meant = {header: _meaning(header) for header in headers}
    return {header: meaning for header, meaning in meant.items() if meaning is not None}


@cache  # every row of a table has the same headers
def _meaning(header: str) -> tuple[str, str] | None:
    """What a header means, and the word of its unit, if it has one; None if it is not known."""
    plain = re.sub(r"\s+", " ", header.strip().lower())
    for name, like in HEADERS.items():
        if re.fullmatch(like, plain):
            return name, ""
        found = re.fullmatch(
            rf"({like})( in |[ _]|(?=[(\[]))[(\[]?(?P<unit>[^()\[\]]+)[)\]]?", plain
        )
        if found and name in _QUANTITIES and _QUANTITIES[name].named(found["unit"]):
            return name, found["unit"]
    return None


def _person(
    cells: Mapping[str, str], known: Mapping[str, tuple[str, str]], table: str, where: str
) -> PersonRow | None:
    """The person of a row; `where` it is, for messages. Raises RecordError as `read_people`."""
    values: dict[str, Any] = {}
    affected: dict[str, Side] = {}
    levels, stated = list[str](), ""
    filled = {name: text for name, text in cells.items() if text.lower() not in _UNKNOWN}
    if not any(known[name][0] == "subject" for name in filled):
        return None
    for header, text in filled.items():
        meaning, unit = known[header]
        place = f"{where}: {header} is {text!r}"
        if meaning == "affected":
            if (side := _side(text)) is not None:
                state = re.match(r"(on|off) - ", header.strip().lower())
                affected[state[1] if state else ""] = side
        elif meaning == "amputation":
            if text.lower() not in _NO_AMPUTATION:
                levels.append(text)
                values[meaning] = _side(text)
                if values[meaning] is None:
                    raise RecordError(
                        f"{place}, but a prosthesis is on one side. Write right, left or none; or "
                        "leave the row out."
                    )
        elif meaning == "sex":
            values[meaning] = _SEXES.get(text.lower())
            if values[meaning] is None:
                raise RecordError(f"{place}. Write F or M, or leave the cell empty.")
        elif meaning == "subject":
            values[meaning] = re.sub(r"\.0$", "", text)
        elif meaning == "level":
            levels.append(text)
            stated = text
        else:
            values.setdefault(meaning, _number(text, _QUANTITIES[meaning], place, unit))
    if values.get("amputation"):
        if re.fullmatch(_BELOW_KNEE, " ".join(levels)):
            affected[""] = values.pop("amputation")
        elif stated and not re.fullmatch(_ABOVE_KNEE, stated):
            raise RecordError(
                f"{where}: {stated!r} is no level of a leg's amputation. Write transtibial or "
                "transfemoral."
            )
    right, left = values.pop("right_leg", None), values.pop("left_leg", None)
    measured = [leg for leg in (right, left) if leg]
    if measured:
        values["leg_length"] = values.get("leg_length") or sum(measured) / len(measured)
    if right and left:
        values["legs"] = {"right": right, "left": left}
    return PersonRow(values.pop("subject"), affected=affected or None, table=table, **values)


def _side(text: str) -> Side | None:
    """The one side that a cell names; None if it names none, or both."""
    plain = text.lower()
    right = bool(re.search(r"\b(r|rt|right|rechts)\b", plain))
    left = bool(re.search(r"\b(l|lt|lft|left|links)\b", plain))
    return ("right" if right else "left") if right != left else None


def _number(text: str, quantity: Quantity, place: str, unit: str) -> float:
    """The number of a cell in the first unit of its `quantity`: by the cell's own unit, that of the
    header, `unit`, or, where neither says one, the only one in which it is plausible.
    """
    found = re.fullmatch(r"(\d+([.,]\d*)?(e[+-]?\d+)?)\s*(.*?)\.?", text.lower())
    word = (found[4] or unit).removesuffix(" old") if found else ""
    stated = quantity.named(word) if word else None
    if found is None or (word and stated is None):
        raise RecordError(f"{place}. Write only the number, or leave the cell empty.")
    value = float(found[1].replace(",", "."))
    if stated is None and quantity in (STATURE, _LEG):
        stated = unit_of(quantity, size=value).unit
    return round(value * (stated.factor if stated else 1.0), 9)
