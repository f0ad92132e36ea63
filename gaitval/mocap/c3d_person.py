"""What a C3D file contains about the person, in the groups that laboratories have for it.

Plug-in Gait stores in PROCESSING what was measured on the person, kg and mm; Qualisys in SUBJECTS,
as text whose name has the unit (`A_Height_mm`); Luxembourg in SUBJECT, as LABELS and VALUES. Only
what can be a person's is taken over: a length of 0 means that it was not measured.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gaitval._internal.text.plain_numbers import plain_float
from gaitval.mocap.c3d_contents import Contents, check_size, labels_of, read_contents
from gaitval.units import (
    AGE,
    ANKLE_WIDTH,
    BODY_MASS,
    ELBOW_WIDTH,
    KNEE_WIDTH,
    STATURE,
    Quantity,
    unit_of,
)

SideValues = tuple[float | None, float | None]
"""Right and left; None where it was not measured."""

_GROUPS: Final = ("PROCESSING", "SUBJECTS", "SUBJECT")
_WORDS: Final = (
    *((r"^a(?=[^a-z])", ""), (r" (kg|mm|cm|m|years)$", ""), (r"[^a-z]", "")),
    *((r"^right", "r"), (r"^left", "l"), (r"^body(?=mass|weight|height)", "")),
    *((r"^weight$", "mass"), (r"^stature$", "height")),
)
"""What makes one name of the names of a parameter: `A_Right_KneeWidth_mm`, `R_kneeWidth` and
`RKneeWidth` are `rkneewidth`."""


@dataclass(frozen=True)
class PersonFacts:
    """What a file contains about a person; None or empty where it has nothing.

    Attributes
    ----------
    source : the file.
    name : of the person in the recording program.
    system : the program that made the file.
    knee_width_m, ankle_width_m, elbow_width_m : right and left, m.
    """

    source: str
    name: str = ""
    system: str = ""
    mass_kg: float | None = None
    height_m: float | None = None
    age_years: float | None = None
    knee_width_m: SideValues = (None, None)
    ankle_width_m: SideValues = (None, None)
    elbow_width_m: SideValues = (None, None)


def read_person(path: Path) -> PersonFacts:
    """What a recording `path` contains about the person; nothing if it is not C3D. Raises
    RecordError if it is damaged.
    """
    if path.suffix.lower() != ".c3d":
        return PersonFacts(str(path))
    check_size(path)
    return person_of(str(path), read_contents(path))


def _stored(contents: Contents) -> dict[str, list[str]]:
    """Numbers about the person as text, by their plain names, the first group's first."""
    found: dict[str, list[str]] = {}
    for group in _GROUPS:
        pairs = [(name, contents.text(group, name)) for name in contents.parameters.get(group, {})]
        values = contents.get(group, "VALUES")
        pairs += [*zip(labels_of(contents, group, "LABELS"), map(str, values), strict=False)]
        for name, text in pairs:
            plain = name.lower().replace("_", " ")
            for pattern, word in _WORDS:
                plain = re.sub(pattern, word, plain)
            if re.fullmatch(r"[+]?\d+(\.\d*)?(e[+-]?\d+)?", text):
                found.setdefault(plain, []).append(text)
    return found


def person_of(source: str, contents: Contents) -> PersonFacts:
    """What the parameters of a C3D file, the `contents` of `source`, contain about the person, in
    SI units. A program that does not say in which unit means the one that makes it a person's;
    what is none in any, or in several but not in SI units, is left out.
    """
    stored = _stored(contents)

    def one(name: str, quantity: Quantity) -> float | None:
        for value in map(plain_float, stored.get(name, ())):
            # A length of 0, which was not measured, is outside every range.
            units = unit_of(quantity, size=value).candidates
            if units[:1] == quantity.units[:1] or len(units) == 1:
                return units[0].factor * value
        return None

    def both(name: str, quantity: Quantity) -> SideValues:
        return one(f"r{name}", quantity), one(f"l{name}", quantity)

    # Cortex writes Company and Software, Vicon COMPANY and SOFTWARE
    made = {name.upper(): name for name in contents.parameters.get("MANUFACTURER", {})}
    # The program is worth more to a reader than its maker, which is taken if it is all there is.
    system = [
        contents.text("MANUFACTURER", made.get(name, name)) for name in ("SOFTWARE", "COMPANY")
    ]
    return PersonFacts(
        source=source,
        name=contents.text("SUBJECTS", "NAMES"),
        system=next((name for name in system if name), ""),
        mass_kg=one("mass", BODY_MASS),
        height_m=one("height", STATURE),
        age_years=one("age", AGE),
        knee_width_m=both("kneewidth", KNEE_WIDTH),
        ankle_width_m=both("anklewidth", ANKLE_WIDTH),
        elbow_width_m=both("elbowwidth", ELBOW_WIDTH),
    )
