"""Who walked: sex, age, mass, stature and what else a table of people says of them.

Laboratories name columns as they like, so headers are known by their words (`HEADERS`), and units
by the header or the size of the value. What a table does not say stays unknown; `estimates` fills
it in, with an interval.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final, Literal

from gaitval._internal.io import file_gate
from gaitval.coordinates import Side
from gaitval.errors import RecordError

HEADERS: Final[Mapping[str, str]] = {
    "subject": r"id|subject|subject code|subject id|participant|patient",
    "sex": r"sex|gender",
    "age": r"age ?(yrs|years|y)?",
    "mass": r"(body ?)?(mass|weight)",
    "height": r"(body ?)?(height|stature)",
    "leg_length": r"leg ?len(gth)?|leg_length_m",
    "right_leg": r"leg ?length \(?r(ight)?\)?|r(ight)? leg ?length|leg_length_right_m",
    "left_leg": r"leg ?length \(?l(eft)?\)?|l(eft)? leg ?length|leg_length_left_m",
    "speed": r"((gait|walking) ?)?(speed|velocity)|walking_speed_m_s|og_comf",
    "amputation": r"(amputation|prosthetic|prosthesis) side|amputated (side|leg|limb)|"
    r"side of (the )?(amputation|prosthesis)",
    "level": r"(amputation |amputated )?level|level of amputation",
    "affected": r"(on - |off - )?updrs-iii asymmetry|affected side|paretic side|side",
}
"""Headers, in lower case, of what is read; one of `_OF_HEADERS` may follow."""

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
_ONLY_AMPUTATIONS: Final = (
    r"(?i).*(trans[- ]?(tibial|femoral)|amput|\b([ab]k|t[tf])a?\b|\b[ab]/k\b).*"
)
"""Levels that say by themselves that there was one; a hip or a knee may be a joint that hurts."""
_RIGHT_OR_LEFT: Final[Mapping[Side, str]] = {
    "right": r"\b(r|rt|right|rechts)\b",
    "left": r"\b(l|lt|lft|left|links)\b",
}
_NO_AMPUTATION: Final = ("0", "n", "no", "control", "healthy", "intact")
_BOTH: Final = r"bi-?lateral.*|both.*|r(ight)?\W+(and )?l(eft)?|l(eft)?\W+(and )?r(ight)?|r/?l|l/?r"
"""An amputation on both sides, in lower case."""
_UNKNOWN: Final = (
    *("", "-", "–", "?", "na", "n/a", "n.a.", "nan", "none", "undetermined", "unknown"),
    *("not known", "not recorded"),
)
_SEXES: Final[Mapping[str, Literal["F", "M"]]] = {
    **dict.fromkeys(("f", "female", "w", "woman", "girl", "weiblich"), "F"),
    **dict.fromkeys(("m", "male", "man", "boy", "männlich"), "M"),
}
_LENGTHS: Final = ("height", "leg_length", "right_leg", "left_leg")
_UNITS: Final[Mapping[str, str]] = {
    "age": r"y|yrs?|years?( old)?",
    "mass": r"kg",
    "speed": r"m/s",
    **dict.fromkeys(_LENGTHS, r"m|cm|mm"),
}
"""What may follow a number, in lower case."""
_OF_HEADERS: Final[Mapping[str, Mapping[str, float]]] = {
    "mass": {r"kg": 1.0, r"lbs?|pounds?": 0.45359237},
    "age": {r"y|yrs?|years?": 1.0, r"months?": 1.0 / 12.0},
    "speed": {r"m/s": 1.0, r"cm/s": 0.01, r"km/h": 1.0 / 3.6},
    **{name: {r"m|cm|mm": 1.0, r"in|inch|inches": 0.0254} for name in _LENGTHS},
}
"""Units that a header may end in, and what they are of ours; metres and centimetres are told apart
by the size of the value."""


@dataclass(frozen=True)
class PersonRow:
    """A row of a table of people; what it does not say is None.

    Attributes
    ----------
    mass : kg. height, leg_length : m. speed : m/s. age : years.
    legs : m, of both sides, where both were measured.
    amputation : side of an above-knee prosthesis, or of one whose level is not said.
    below_knee : side of one that leaves the knee; it is no part of the body's model.
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
    below_knee: Side | None = None
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
    """The row of `people` for a `subject` of a table of strides, and the state in its name.

    "SUB01_off" is SUB01 in the state "off"; "WBDS05" is 5 where `people` is one table in which all
    are numbered. Of several tables, and of other subjects beside this one, `own_rows` knows.

    Of somebody without a row nothing is known but the name.
    """
    before, _, state = subject.partition("_")
    for name, of in ((subject, ""), (before, state)):
        if name in people:
            return people[name], of
    if (found := _by_number(people).get(_number_of(subject))) is not None:
        return found, state
    return PersonRow(before if state in STATES else subject), state if state in STATES else ""


def own_rows(
    subjects: Sequence[str], tables: Iterable[Mapping[str, PersonRow]]
) -> dict[str, dict[str, PersonRow]]:
    """The row of each of the `subjects`, by a name with which `person_of` finds it; empty if there
    is none.

    A whole name is looked for in all `tables`, a number only where everybody is numbered, for 3 may
    be anybody's: if one prefix alone (the WBDS of WBDS03) may mean the numbers. One that a table
    writes out may not, even if this person is not in it.
    """
    named: dict[str, PersonRow] = {}
    numbers: dict[int | None, PersonRow] = {}
    written_out = set()
    for table in tables:
        named |= table
        if by_number := _by_number(table):
            numbers |= by_number
        else:
            written_out |= {_prefix(name) for name in table}
    numbered = {each for each in subjects if _number_of(each) in numbers}
    prefixes = {_prefix(each) for each in numbered} - written_out
    found = {}
    for subject in subjects:
        before = subject.partition("_")[0]
        rows = {name: named[name] for name in (subject, before) if name in named}
        if not rows and subject in numbered and prefixes == {_prefix(subject)}:
            rows = {before: numbers[_number_of(subject)]}
        found[subject] = rows
    return found


def _by_number(table: Mapping[str, PersonRow]) -> dict[int | None, PersonRow]:
    """The people of a table in which all are numbered, each once; empty of any other."""
    if not all(re.fullmatch(r"[0-9]+", name) for name in table):
        return {}
    found: dict[int | None, PersonRow] = {int(name): person for name, person in table.items()}
    return found if len(found) == len(table) else {}


def _number_of(subject: str) -> int | None:
    """The number that a name ends in, before its state; None if it does not end in one."""
    found = re.fullmatch(r"[^0-9]*([0-9]+)", subject.partition("_")[0])
    return int(found[1]) if found else None


def _prefix(subject: str) -> str:
    """What comes before the number of a name: "sub" of SUB03, Sub-3 and SUB03_off."""
    before = re.split(r"[0-9]", subject.partition("_")[0])[0]
    return re.sub(r"\W", "", before).lower()


def _columns(headers: Iterable[str]) -> dict[str, tuple[str, float]]:
    """What each header means, and its unit in ours; those that are not known are left out."""
    meant = {header: _meaning(header) for header in headers}
    return {header: meaning for header, meaning in meant.items() if meaning is not None}


@cache  # every row of a table has the same headers
def _meaning(header: str) -> tuple[str, float] | None:
    """What a header means, and its unit in ours; None if it is not known."""
    plain = re.sub(r"\s+", " ", header.strip().lower())
    for name, like in HEADERS.items():
        if re.fullmatch(like, plain):
            return name, 1.0
        for unit, size in _OF_HEADERS.get(name, {}).items():
            if re.fullmatch(rf"({like})( in |[ _]|(?=[(\[]))[(\[]?({unit})[)\]]?", plain):
                return name, size
    return None


def _person(
    cells: Mapping[str, str], known: Mapping[str, tuple[str, float]], table: str, where: str
) -> PersonRow | None:
    """The person of a row; `where` it is, for messages. Raises RecordError as `read_people`."""
    values: dict[str, Any] = {}
    affected: dict[str, Side] = {}
    level: Literal["above", "below"] | None = None
    not_understood: str | None = None
    amputated = False
    filled = {name: text for name, text in cells.items() if text.lower() not in _UNKNOWN}
    if not any(known[name][0] == "subject" for name in filled):
        return None
    for header, text in filled.items():
        meaning, unit = known[header]
        if meaning == "affected":
            side = _side(text)
            if side is not None:
                state = re.match(r"(on|off) - ", header.strip().lower())
                affected[state[1] if state else ""] = side
        elif meaning == "amputation":
            values[meaning] = _amputated(text, f"{where}: {header}")
            level = level or _level(text)
        elif meaning == "level":
            stated = _level(text)
            level = stated or level
            amputated = "amput" in header.lower() or bool(re.fullmatch(_ONLY_AMPUTATIONS, text))
            not_understood = None if stated else f"{where}: {header} is {text!r}"
        elif meaning == "sex":
            values[meaning] = _SEXES.get(text.lower())
            if values[meaning] is None:
                raise RecordError(
                    f"{where}: {header} is {text!r}, which says neither F nor M. Write F or M, or "
                    "leave the cell empty."
                )
        elif meaning == "subject":
            values[meaning] = re.sub(r"\.0$", "", text)
        else:
            # A column in our own unit comes before one in another (years, and months beside them).
            number = _number(text, meaning, f"{where}: {header}", unit)
            values[meaning] = number if unit == 1.0 else values.get(meaning, number)
    if not_understood and values.get("amputation"):
        raise RecordError(
            f"{not_understood}, which is no level of a leg's amputation that is understood. Write "
            "transtibial or transfemoral."
        )
    if level and amputated and "amputation" not in values:
        # The one side of the row is that of the amputation, whatever its column is called.
        values["amputation"] = affected.get("")
    if level == "below" and (side := values.pop("amputation", None)):
        values["below_knee"] = affected[""] = side
    right, left = values.pop("right_leg", None), values.pop("left_leg", None)
    measured = [leg for leg in (right, left) if leg]
    if measured:
        values["leg_length"] = values.get("leg_length") or sum(measured) / len(measured)
    if right and left:
        values["legs"] = {"right": right, "left": left}
    return PersonRow(values.pop("subject"), affected=affected or None, table=table, **values)


def _side(text: str) -> Side | None:
    first = text[:1].lower()
    return "right" if first == "r" else "left" if first == "l" else None


def _amputated(text: str, where: str) -> Side | None:
    """The side of an amputation; None if there was none. Raises RecordError as `read_people`."""
    plain = text.lower()
    sides = [side for side, like in _RIGHT_OR_LEFT.items() if re.search(like, plain)]
    if re.fullmatch(_BOTH, plain) or len(sides) > 1:
        raise RecordError(
            f"{where} is {text!r}, but the body has a prosthesis on one side at most. Leave the "
            "cell empty, and read the walk as one of two own legs; or leave the row out."
        )
    if not sides and plain not in _NO_AMPUTATION:
        raise RecordError(
            f"{where} is {text!r}, which names no side. Write right, left or none, or leave the "
            "cell empty."
        )
    return sides[0] if sides else None


def _level(text: str) -> Literal["above", "below"] | None:
    """Whether an amputation is above the knee or leaves it; None if the words are not known."""
    if re.fullmatch(_BELOW_KNEE, text):
        return "below"
    return "above" if re.fullmatch(_ABOVE_KNEE, text) else None


def _number(text: str, meaning: str, where: str, unit: float = 1.0) -> float:
    """The number of a cell, with or without its unit; lengths in m. One without is in `unit`."""
    number = r"(\d+([.,]\d*)?(e[+-]?\d+)?)"
    found = re.fullmatch(rf"{number}\s*(({_UNITS[meaning]})\.?)?", text.lower())
    if found is None:
        raise RecordError(
            f"{where} is {text!r}, which is not understood. Write only the number, or leave the "
            "cell empty."
        )
    value = float(found[1].replace(",", ".")) * (1.0 if found[4] else unit)
    if meaning in _LENGTHS:
        # No leg or stature is 3 m, and none is 3 cm.
        value = next((value / by for by in (1.0, 100.0, 1000.0) if value / by < 3.0), 0.0)
    return value
