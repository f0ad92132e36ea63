"""A person of a session file, which has many people's recordings (`gaitval import`).

A session file is TOML with a table for each person; paths are relative to the file:

    [[people]]
    name = "P01"
    sex = "F"
    static = "P01/stand.c3d"
    trials = ["P01/walk1.c3d", "P01/walk2.c3d"]
    mass = 63.2                 # left out if the C3D file knows it; likewise height
    knee_width = [0.101, 0.102] # right and left, m

and any other field of `ImportOptions`, also those that are no option of `gaitval import`.
"""

from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field

from gaitval.errors import ConfigurationError
from gaitval.session.request import ImportOptions, checked

Options = TypeVar("Options", bound=ImportOptions)


class BatchPerson(ImportOptions):
    """One person of a session file, with the options of `gaitval import`."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    """Of the folder, and of the person where `person` is not given."""


def below(folder: Path, options: Options) -> Options:
    """The same `options`, with paths, also that of a marker set, relative to a `folder`."""

    def placed(value: object) -> object:
        if isinstance(value, tuple):
            return tuple(placed(each) for each in value)
        return folder / value if isinstance(value, Path) else value

    changed = {name: placed(value) for name, value in options}
    if options.marker_set and options.marker_set.lower().endswith(".toml"):
        changed["marker_set"] = str(folder / options.marker_set)
    return options.model_copy(update=changed)


def person_of(file: Path, where: str, table: Any) -> BatchPerson:
    """A person from a `table` of the file `file`; paths in it are relative to the file.

    Messages say `where` in the file the table is. Raises ConfigurationError if a key is unknown or
    missing, or a value is of the wrong type.
    """
    if not isinstance(table, dict):
        raise ConfigurationError(f"{file}: {where}: not a table. Write [[people]] before it.")
    try:
        return below(file.parent, checked(BatchPerson, table))
    except ConfigurationError as error:
        raise ConfigurationError(f"{file}: {where}: {error} See docs/how-to/cohort.md.") from None
