"""The person of a session: what the user says, and what the files know.

What the user says wins; a file that says otherwise is told. What no one says is an error only if it
is needed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gaitval.datasets.plausible import mass_and_height_problems
from gaitval.errors import SubjectError
from gaitval.mocap.c3d_person import PersonFacts, read_person
from gaitval.scaling.anthropometry import Sex
from gaitval.scaling.landmarks import Width
from gaitval.session.request import Tell

_DIFFERS: Final = 0.02
"""Relative difference from which on two values contradict each other."""


@dataclass(frozen=True)
class Person:
    """Body mass kg, stature m, sex, and widths of the joints in m; see `landmarks.Width`."""

    mass_kg: float
    height_m: float
    sex: Sex
    knee_width_m: Width
    ankle_width_m: Width
    elbow_width_m: Width


def check_said(mass_kg: float | None, height_m: float | None, sex: str) -> Sex:
    """Refuse what the user says of a body that cannot be, before any file is read.

    Raises
    ------
    SubjectError : another sex than F or M, or swapped or wrong units.
    """
    mass = 70.0 if mass_kg is None else mass_kg
    problems = [
        problem.replace("mass_kg =", "--mass").replace("height_m =", "--height")
        for problem in mass_and_height_problems(mass, 1.7 if height_m is None else height_m)
    ]
    if sex not in ("F", "M"):
        problems.append(f"--sex {sex}: give F or M, which choose the segment tables.")
    if problems:
        raise SubjectError("\n".join(problems))
    return "F" if sex == "F" else "M"


def person_of_session(
    files: Sequence[Path],
    *,
    mass_kg: float | None,
    height_m: float | None,
    sex: str,
    widths: dict[str, Width],
    tell: Tell,
) -> Person:
    """The person, from what the user says and from the files, the standing trial first.

    Parameters
    ----------
    widths : of knee, ankle and elbow, as the user gives them.

    Raises
    ------
    SubjectError : mass or stature is nowhere, or cannot be.
    RecordError : a file is damaged.
    """
    said = check_said(mass_kg, height_m, sex)
    facts = [read_person(path) for path in files if path.is_file()]
    for each in facts[:1]:
        if each.name or each.system:
            words = [each.name or "no name", *([f"made by {each.system}"] if each.system else [])]
            tell("person", f"{each.source}: {', '.join(words)}")
        if measured := _measured(each):
            tell("person", f"{each.source} also says {measured}: the markers are used instead")
    mass = _one(facts, lambda each: each.mass_kg, mass_kg, "--mass", "kg", tell)
    height = _one(facts, lambda each: each.height_m, height_m, "--height", "m", tell)
    missing = [
        f"{option} ({unit})"
        for option, unit, value in (("--mass", "kg", mass), ("--height", "m", height))
        if value is None
    ]
    if mass is None or height is None:
        raise SubjectError(
            f"no {' and no '.join(missing)}, and no file of the session says it "
            "(PROCESSING:Bodymass, PROCESSING:Height in C3D). The body is scaled by them: give "
            f"{' and '.join(missing)}."
        )
    check_said(mass, height, sex)
    return Person(
        mass_kg=mass,
        height_m=height,
        sex=said,
        knee_width_m=_width(facts, "knee", widths.get("knee"), tell),
        ankle_width_m=_width(facts, "ankle", widths.get("ankle"), tell),
        elbow_width_m=_width(facts, "elbow", widths.get("elbow"), tell),
    )


def _measured(facts: PersonFacts) -> str:
    """What a file says of the person that scaling takes from the markers, in words."""
    right, left = facts.leg_length_m
    said = {
        "leg lengths (right, left)": None
        if right is None or left is None
        else f"{right:.4g}, {left:.4g} m",
        "distance of the ASIS": None
        if facts.asis_distance_m is None
        else f"{facts.asis_distance_m:.4g} m",
        "marker diameter": None
        if facts.marker_diameter_m is None
        else f"{1000 * facts.marker_diameter_m:.3g} mm",
    }
    return ", ".join(f"{what} {value}" for what, value in said.items() if value is not None)


def _one(
    facts: Sequence[PersonFacts],
    of: Callable[[PersonFacts], float | None],
    said: float | None,
    option: str,
    unit: str,
    tell: Tell,
) -> float | None:
    """What the user says, else the first file that says something."""
    used = said
    for each in facts:
        found = of(each)
        if found is None:
            continue
        if used is None:
            used = found
            tell("person", f"{option} {found:.4g} {unit}: from {each.source}")
        elif abs(found - used) > _DIFFERS * used:
            tell("person", f"{each.source} says {found:.4g} {unit}; {option} {used:.4g} is used")
    return used


def _width(facts: Sequence[PersonFacts], joint: str, said: Width, tell: Tell) -> Width:
    """Width of a joint by side, as `_one`."""
    used = said
    for each in facts:
        right, left = getattr(each, f"{joint}_width_m")
        if right is None or left is None:
            continue
        if used is None:
            used = (right, left)
            tell(
                "person",
                f"--{joint}-width {right:.4g},{left:.4g} m (right, left): from {each.source}, used "
                "where a side has no medial marker",
            )
            continue
        ours = used if isinstance(used, tuple) else (used, used)
        if max(abs(right - ours[0]), abs(left - ours[1])) > _DIFFERS * max(ours):
            tell(
                "person",
                f"{each.source} says {joint} widths of {right:.4g} and {left:.4g} m (right, left); "
                f"{ours[0]:.4g} and {ours[1]:.4g} are used",
            )
    return used
