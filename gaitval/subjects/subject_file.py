"""Read subjects: from a TOML file, or one of the ten that are built in."""

import os
import re
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Final

from gaitval._internal.io.artefacts import parse_toml, read_toml
from gaitval.errors import SubjectError
from gaitval.subjects.identity import with_identity
from gaitval.subjects.subject import Subject, make_subject

BUILTIN: Final[dict[str, tuple[str, str]]] = {
    "S01": ("WBDS01", "T05"),
    "S02": ("WBDS02", "T06"),
    "S03": ("WBDS12", "T06"),
    "S04": ("WBDS21", "T04"),
    "S05": ("WBDS14", "T05"),
    "S06": ("WBDS24", "T07"),
    "S07": ("WBDS26", "T03"),
    "S08": ("WBDS29", "T01"),
    "S09": ("WBDS31", "T03"),
    "S10": ("WBDS39", "T02"),
}
"""The paper's ten subjects: person and treadmill trial of the WBDS dataset."""
SUBJECT: Final = "subject.toml"
"""The file of the subject in the folder of a run, an import or a baseline."""


def parse_subject(text: str, where: str) -> Subject:
    """Read a subject from TOML `text`; `where` names the file in messages.

    A file of an earlier gaitval says neither person nor laboratory: `Subject.guessed` says what was
    taken for them. Raises SubjectError for invalid TOML, or with the problems that `make_subject`
    lists.
    """
    return make_subject(with_identity(parse_toml(text, where, SubjectError)), where)


@cache  # a study asks for all ten half a dozen times
def _read_builtin(identifier: str) -> Subject:
    file = resources.files("gaitval.subjects") / "builtin" / f"{identifier}.toml"
    return parse_subject(file.read_text(encoding="utf-8"), f"{identifier}.toml")


def builtin_subjects() -> tuple[Subject, ...]:
    """The paper's ten subjects, S01 to S10."""
    return tuple(_read_builtin(identifier) for identifier in BUILTIN)


def builtin_name(name: str) -> str | None:
    """The built-in subject that a `name` means ("S05" for "5", "S05" and "WBDS14"); None for
    others.
    """
    if match := re.fullmatch(r"[Ss]?0*([1-9]\d*)", name):
        identifier = f"S{int(match[1]):02d}"
        return identifier if identifier in BUILTIN else None
    if match := re.fullmatch(r"WBDS0*([1-9]\d*)", name.upper()):
        known = f"WBDS{int(match[1]):02d}"
        return next((key for key, (person, _) in BUILTIN.items() if person == known), None)
    return None


def load_subject(name_or_path: str | int | Path) -> Subject:
    """Load a built-in subject or a subject file: `name_or_path` is 5, "5", "S05", the dataset's
    name "WBDS14", or a path to a .toml file. Raises SubjectError if there is no such subject, or
    the file has problems (all are listed).
    """
    name = str(name_or_path).strip()
    if builtin_name(name) is None and os.path.isfile(inside := Path(name) / SUBJECT):
        raise SubjectError(
            f"{name}: is the folder of a run or an import, but a subject is a file or a number "
            f"here. Give {inside}."
        )
    if name.lower().endswith(".toml") or "/" in name:
        values = read_toml(Path(name), SubjectError, "Check the path of the subject file")
        return make_subject(with_identity(values), str(Path(name)))
    if (identifier := builtin_name(name)) is not None:
        # what the caller changes in its tables stays the caller's
        return _read_builtin(identifier).model_copy(deep=True)
    valid = ", ".join(f"{key} ({person})" for key, (person, _) in BUILTIN.items())
    raise SubjectError(
        f"{name!r}: no such subject. The built-in ones are {valid}; or give the path of a .toml "
        "file."
    )
