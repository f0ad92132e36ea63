"""The person of a session: what the user says, and what the files know.

What the user says wins; a file that says otherwise is reported. What no one says is an error only
if it is needed.
"""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Final, NamedTuple, TypeVar

import numpy as np

from gaitval.errors import RecordError, SubjectError
from gaitval.mocap.c3d_person import PersonFacts, read_person
from gaitval.scaling.anthropometry import Sex
from gaitval.scaling.landmarks import Width
from gaitval.session.request import FILES, ImportOptions, Notify, Request
from gaitval.subjects.identity import line_of_text
from gaitval.subjects.plausible import value_problems

_Known = TypeVar("_Known", float | None, Width)
_DIFFERS: Final = 0.02
"""Relative difference from which on two values contradict each other."""
_NOBODY: Final = ("patient", "new patient", "subject", "new subject", "unnamed")
"""Names that a recording program gives to everybody."""


class SessionPerson(NamedTuple):
    """What an import needs to know of a person, by the names of its options: kg, m."""

    mass: float
    height: float
    sex: Sex
    age: float | None
    knee_width: Width
    ankle_width: Width
    elbow_width: Width
    recorded_name: tuple[str, str]
    """The person's name in a recording, and the name of that file; empty where none says it."""


def check_given(
    mass: float | None, height: float | None, sex: str, age: float | None = None
) -> Sex:
    """Refuse `mass` (kg), `height` (m), `sex` and `age` (years) of a body that cannot be, before
    any file is read; returns the sex.

    Raises SubjectError for another sex than F or M, and for swapped or wrong units.
    """
    problems = [
        problem.replace("mass_kg =", "--mass")
        .replace("height_m =", "--height")
        .replace("age_years =", "--age")
        for problem in value_problems({"mass_kg": mass, "height_m": height, "age_years": age})
    ]
    if sex not in ("F", "M"):
        problems.append(f"--sex {sex}: give F or M, which choose the segment tables.")
    if problems:
        raise SubjectError("\n".join(problems))
    return "F" if sex == "F" else "M"


def check_there(files: Iterable[Path]) -> None:
    """Raise RecordError, which names all of the `files` that are missing."""
    missing = [str(path) for path in dict.fromkeys(files) if not path.exists()]
    if missing:
        raise RecordError(
            f"{', '.join(missing)}: no such file{'s' if len(missing) > 1 else ''}. Check the "
            f"{'paths' if len(missing) > 1 else 'path'}."
        )


def check_texts(request: Request) -> None:
    """Refuse names of files, or texts about the person, that no table or page can show, for the
    results carry them (a `request`). Raises RecordError.
    """
    files = [request.static, *(path for name in FILES for path in getattr(request, name))]
    names = [path.name for path in files] + [*map(request.called, range(len(request.trials)))]
    person, laboratory, _ = request.who
    texts = [*names, person, laboratory, request.citation, request.licence]
    for text in dict.fromkeys(texts):
        try:
            line_of_text(text)
        except ValueError as error:
            what = "a file, or a folder, is called" if text in names else "the files or options say"
            raise RecordError(f"{what} {error}") from None


def person_of_session(options: ImportOptions, notify: Notify) -> SessionPerson:
    """The person, from what the user says (`options`) and from the files, the standing trial first;
    `notify` is called with what the files say.

    Raises SubjectError if mass or stature is nowhere, or cannot be, and RecordError if all files
    are damaged: of several, those that can be read are used.
    """
    sex = check_given(options.mass, options.height, options.sex, options.age)
    files = [options.trials[0] if options.static is None else options.static, *options.trials]
    facts, damaged = list[PersonFacts](), list[RecordError]()
    for path in dict.fromkeys(files):
        try:
            facts += [read_person(path)] if path.is_file() else []
        except RecordError as error:
            damaged.append(error)
    if damaged and not facts:
        raise damaged[0]
    for each in facts[:1]:
        if each.name or each.system:
            words = [each.name or "no name", *([f"made by {each.system}"] if each.system else [])]
            notify("person", f"{each.source}: {', '.join(words)}")
    mass = _one(facts, lambda each: each.mass_kg, options.mass, "--mass", "kg", notify)
    height = _one(facts, lambda each: each.height_m, options.height, "--height", "m", notify)
    missing = [
        f"{option} ({unit})"
        for option, unit, value in (("--mass", "kg", mass), ("--height", "m", height))
        if value is None
    ]
    if mass is None or height is None:
        check_there(files)
        raise SubjectError(
            f"no {' and no '.join(missing)}, and no file of the session says it "
            "(PROCESSING:Bodymass, SUBJECTS:A_Height_mm or the like in C3D). The body is scaled "
            f"by them: give {' and '.join(missing)}."
        )
    check_given(mass, height, sex)
    return SessionPerson(
        mass=mass,
        height=height,
        sex=sex,
        age=_one(facts, lambda each: each.age_years, options.age, "--age", "years", notify),
        knee_width=_one(facts, _width("knee"), options.knee_width, "--knee-width", "m", notify),
        ankle_width=_one(facts, _width("ankle"), options.ankle_width, "--ankle-width", "m", notify),
        elbow_width=_one(facts, _width("elbow"), None, "elbow width", "m", notify),
        recorded_name=next((found for each in facts if (found := _name(each))[0]), ("", "")),
    )


def _name(facts: PersonFacts) -> tuple[str, str]:
    """The person's name in a file, and the file's; empty where what it says names nobody.

    Cortex writes the marker set there: all people of a laboratory would be one.
    """
    names_nobody = facts.system == "Cortex" or facts.name.lower() in _NOBODY
    return ("", "") if names_nobody else (facts.name, Path(facts.source).name)


def _one(
    facts: Sequence[PersonFacts],
    of: Callable[[PersonFacts], _Known],
    given: _Known,
    option: str,
    unit: str,
    notify: Notify,
) -> _Known:
    """What the user says (`given`), else the first file that says something; of a width, right and
    left.
    """
    used = given
    for each in facts:
        found = of(each)
        if found is None:
            continue
        if used is None:
            used = found
            notify("person", f"{option} {_text(found)} {unit}: from {each.source}")
        elif np.max(np.abs(np.subtract(found, used))) > _DIFFERS * np.max(used):
            notify(
                "person",
                f"{each.source} says {_text(found)} {unit}; {option} {_text(used)} is used",
            )
    return used


def _text(value: float | tuple[float, float]) -> str:
    return ",".join(f"{each:.4g}" for each in np.atleast_1d(value))


def _width(joint: str) -> Callable[[PersonFacts], Width]:
    """Where a file has the width of a joint, of both sides."""

    def of(facts: PersonFacts) -> Width:
        right, left = getattr(facts, f"{joint}_width_m")
        return None if right is None or left is None else (right, left)

    return of
