"""Many people's recordings, from one session file.

A session file is TOML with a table for each person; paths are relative to the file:

    [[people]]
    name = "P01"
    sex = "F"
    static = "P01/stand.c3d"
    trials = ["P01/walk1.c3d", "P01/walk2.c3d"]
    mass = 63.2                 # left out if the C3D file knows it; likewise height
    knee_width = [0.101, 0.102] # right and left, m

and any other option of `gaitval import`.
"""

from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field

from gaitval import wings
from gaitval.artefacts import read_toml
from gaitval.errors import ConfigurationError
from gaitval.session.request import OLD_KEYS, ImportOptions, Tell, checked, silent

Options = TypeVar("Options", bound=ImportOptions)


class BatchPerson(ImportOptions):
    """One person of a session file, with the options of `gaitval import`."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    """Of the folder, and of the person where `person` is not given."""


def read_batch(path: Path, tell: Tell = silent) -> tuple[BatchPerson, ...]:
    """The people of the session file `path`; of a folder, of every `session.toml` in or below it,
    else of the program that wrote it, if a wing reads its folders.

    `tell` is called with a sentence for each key of an earlier gaitval: what it is read as. Raises
    ConfigurationError if a file is missing or not TOML, has unknown or missing keys, or if two
    people have one name.
    """
    path = Path(path)
    files = sorted(path.rglob("session.toml")) if path.is_dir() else [path]
    people = [person for file in files for person in _read(file, tell)]
    for name in wings.names(wings.SESSIONS) if path.is_dir() and not files else ():
        for about, tables in wings.load(wings.SESSIONS, name)(path):
            people += [person_of(about, f"read as {name}", table, tell) for table in tables]
    if not people:
        raise ConfigurationError(
            f"{path}: no session.toml in this folder or below it. Write one with a table "
            "[[people]] for each person (gaitval imports --help)."
        )
    names = [person.name for person in people]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ConfigurationError(
            f"{path}: {', '.join(twice)}: more than one person of this name, whose files would be "
            "written over each other. Give each a name of their own."
        )
    return tuple(people)


def _read(file: Path, tell: Tell) -> list[BatchPerson]:
    values = read_toml(file, ConfigurationError, "Check the name and the folder")
    tables = values.get("people")
    if not isinstance(tables, list) or not tables or set(values) != {"people"}:
        raise ConfigurationError(
            f"{file}: a session file has a table [[people]] for each person, and nothing else; "
            f"this one has {', '.join(values) or 'nothing'}."
        )
    return [
        person_of(file, f"person {number}", table, tell)
        for number, table in enumerate(tables, start=1)
    ]


def below(folder: Path, options: Options) -> Options:
    """The same `options`, with paths that are relative to a `folder`."""

    def placed(value: object) -> object:
        if isinstance(value, tuple):
            return tuple(placed(each) for each in value)
        return folder / value if isinstance(value, Path) else value

    return options.model_copy(update={name: placed(value) for name, value in options})


def person_of(file: Path, where: str, table: Any, tell: Tell = silent) -> BatchPerson:
    """A person from a `table` of the file `file`; paths in it are relative to the file.

    Messages say `where` in the file the table is; `tell` is called for keys of an earlier gaitval.
    Raises ConfigurationError if a key is unknown or missing, or a value is of the wrong type.
    """
    if not isinstance(table, dict):
        raise ConfigurationError(f"{file}: {where}: not a table. Write [[people]] before it.")
    values = dict(table)
    for old, opposite in OLD_KEYS.items():
        if isinstance(values.get(old), bool):
            values[opposite] = not values.pop(old)
            said = f"{opposite} = {str(values[opposite]).lower()}"
            tell("session", f"{file}: {where}: {old} is read as {said}; write that")
    try:
        return below(file.parent, checked(BatchPerson, values))
    except ConfigurationError as error:
        raise ConfigurationError(f"{file}: {where}: {error} See gaitval imports --help.") from None
