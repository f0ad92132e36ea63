"""Many people's recordings, from one session file, one import after the other.

A session file is TOML with a table for each person; paths are relative to the file:

    [[people]]
    name = "P01"
    sex = "F"
    static = "P01/stand.c3d"
    trials = ["P01/walk1.c3d", "P01/walk2.c3d"]
    mass = 63.2                 # left out if the C3D file knows it; likewise height
    knee_width = [0.101, 0.102] # right and left, m

and any other option of `gaitval import`. An import that is refused does not stop the others.
"""

import csv
import io
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Final, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gaitval.artefacts import write_text
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.errors import ConfigurationError, GaitvalError
from gaitval.metrics.recording_limits import State, failure
from gaitval.scaling.landmarks import Width
from gaitval.session.halves import Halves
from gaitval.session.importing import Imported, import_files
from gaitval.session.request import HipCentre, Tell, silent
from gaitval.session.summary import limit_rows
from gaitval.session.trial import valid_cycles
from gaitval.session.write import FOLDER

TABLE: Final = "batch.csv"


class Person(BaseModel):
    """One person of a session file, with the options of `gaitval import`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$")]
    sex: str
    static: Path | None = None
    trials: Annotated[tuple[Path, ...], Field(min_length=1)]
    forces: tuple[Path, ...] = ()
    mass: float | None = None
    height: float | None = None
    marker_set: str | None = None
    axes: str | None = None
    knee_width: Width = None
    ankle_width: Width = None
    elbow_width: Width = None
    functional: tuple[Path, ...] = ()
    hip_centre: HipCentre = "regression"
    age: float | None = None
    citation: str = "Own recording, not published"
    licence: str = "not stated"
    consistent: bool = False
    kinematics_only: bool = False
    mirror: bool = False
    static_time: tuple[float, float] | None = None
    floor: float = 0.0
    feet_flat: bool = True
    no_plate: tuple[str, ...] = ()
    halves: Halves | None = None


@dataclass(frozen=True)
class Outcome:
    """What became of one person; empty where it was not reached.

    Attributes
    ----------
    trials : used, of those given.
    cycles : for moments and forces, or for angles if there are no forces; right and left.
    reason : the first line of why it was refused.
    page : to read.
    limits : how many passed, failed and were not judged.
    failed : those that failed, with value and limit.
    """

    name: str
    made: bool
    trials: str
    cycles: str
    reason: str
    page: str
    limits: str = ""
    failed: str = ""


def read_batch(path: Path) -> tuple[Person, ...]:
    """The people of a session file; of a folder, of every `session.toml` in or below it.

    Raises
    ------
    ConfigurationError : a file is missing or not TOML, has unknown or missing keys, or two people
        have one name.
    """
    path = Path(path)
    files = sorted(path.rglob("session.toml")) if path.is_dir() else [path]
    if not files:
        raise ConfigurationError(
            f"{path}: no session.toml in this folder or below it. Write one with a table "
            "[[people]] for each person (gaitval imports --help)."
        )
    people = [person for file in files for person in _read(file)]
    names = [person.name for person in people]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ConfigurationError(
            f"{path}: {', '.join(twice)}: more than one person of this name, whose files would be "
            "written over each other. Give each a name of their own."
        )
    return tuple(people)


def _read(file: Path) -> list[Person]:
    try:
        values = tomllib.loads(file.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ConfigurationError(
            f"{file}: cannot be read ({error.strerror}). Check the name and the folder."
        ) from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigurationError(f"{file}: not TOML ({error}). Mend the file.") from None
    tables = values.get("people")
    if not isinstance(tables, list) or not tables or set(values) != {"people"}:
        raise ConfigurationError(
            f"{file}: a session file has a table [[people]] for each person, and nothing else; "
            f"this one has {', '.join(values) or 'nothing'}."
        )
    return [
        person_of(file, f"person {number}", table) for number, table in enumerate(tables, start=1)
    ]


def person_of(file: Path, where: str, table: Any) -> Person:
    """A person from a table of a file; paths in it are relative to the file.

    Parameters
    ----------
    where : of the file the table is, for messages.

    Raises
    ------
    ConfigurationError : a key is unknown or missing, or a value is of the wrong type.
    """
    try:
        person = Person.model_validate(table)
    except ValidationError as error:
        problems = [
            f"{'.'.join(map(str, item['loc']))}: {item['msg'].lower()}" for item in error.errors()
        ]
        raise ConfigurationError(
            f"{file}: {where}: " + "; ".join(problems) + ". See gaitval imports --help."
        ) from None
    here = file.parent
    return person.model_copy(
        update={
            "static": None if person.static is None else here / person.static,
            "trials": tuple(here / each for each in person.trials),
            "forces": tuple(here / each for each in person.forces),
            "functional": tuple(here / each for each in person.functional),
        }
    )


def import_batch(
    people: Sequence[Person],
    out: Path,
    configuration: Configuration,
    *,
    tell: Callable[[str, str, str], None] | None = None,
) -> list[Outcome]:
    """Import people one after the other, each into a folder of their name; writes a table.

    Parameters
    ----------
    tell : called with each decision: the person, the step, and a sentence.
    """
    outcomes = []
    for person in people:

        def told(step: str, text: str, name: str = person.name) -> None:
            if tell is not None:
                tell(name, step, text)

        outcomes.append(_one(person, Path(out), configuration, told if tell else silent))
        _write(Path(out) / TABLE, outcomes)
    return outcomes


def _one(person: Person, out: Path, configuration: Configuration, tell: Tell) -> Outcome:
    options = person.model_dump(
        exclude={"name", "sex", "static", "trials", "mass", "height"}, exclude_none=True
    )
    try:
        imported = import_files(
            person.static,
            person.trials,
            out / person.name,
            mass=person.mass,
            height=person.height,
            sex=person.sex,
            configuration=configuration,
            tell=tell,
            **options,
        )
    except GaitvalError as error:
        tell("refused", str(error))
        pages = [out / person.name / FOLDER / f"{name}.html" for name in ("recording", "refused")]
        page = next((str(each) for each in pages if each.exists()), "")
        first = re.sub(r"\s+", " ", str(error).strip().split("\n")[0])
        return Outcome(person.name, False, f"0 of {len(person.trials)}", "", first, page)
    return _made(person, imported, out)


def _made(person: Person, imported: Imported, out: Path) -> Outcome:
    found = imported.found
    kinetics = bool(found.forces)
    counts = [
        sum(len(valid_cycles(walk, side, kinetics=kinetics)) for walk in found.trials)
        for side in SIDES
    ]
    rows = limit_rows(found)
    states = Counter(row.state for row in rows)
    return Outcome(
        name=person.name,
        made=True,
        trials=f"{len(found.trials)} of {len(person.trials)}",
        cycles=f"{counts[0]} right, {counts[1]} left",
        reason="",
        page=str(out / person.name / FOLDER / "recording.html"),
        limits=", ".join(f"{states[state]} {state}" for state in get_args(State)),
        failed="; ".join(
            failure(row.name, row.value, row.limit, row.unit) for row in rows if row.failed
        ),
    )


def _write(path: Path, outcomes: Sequence[Outcome]) -> None:
    text = io.StringIO()
    table = csv.DictWriter(text, [field.name for field in fields(Outcome)], lineterminator="\n")
    table.writeheader()
    table.writerows(asdict(outcome) for outcome in outcomes)
    write_text(path, text.getvalue())
