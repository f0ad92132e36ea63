"""The table of a cohort: a row for each study, in CSV.

    name,subject,trial,seed,start,training.samples
    young,S01,,0,,
    young-slow,S01,T03,0,,1000000
    patient,lab/P01/subject.toml,,0,,

All columns but `subject` may be left out, and an empty cell is a value that is not given. A column
with a dot in its name is a setting, as for `--set`. Paths are relative to the table.
"""

from collections import Counter
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gaitval._internal.io import file_gate
from gaitval.errors import ConfigurationError

MOST: Final = 20_000
"""Studies of a cohort. Each takes minutes: so many are weeks of a machine."""


class Study(BaseModel):
    """One row: what a study is of, and how it is done.

    Attributes
    ----------
    name : of its folder.
    subject : number, name or path of the subject file.
    trial : of the subject that the study is of; its own if empty.
    start : what the first training starts from: the general policy, or nothing.
    settings : "section.key=value", as for `--set`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=120)]
    subject: str
    trial: str = ""
    start: Literal["general", "scratch"] = "general"
    settings: tuple[str, ...] = ()


def read_table(path: Path) -> tuple[Study, ...]:
    """The studies of the CSV file `path`. Raises ConfigurationError if it cannot be read, has no
    row or more than `MOST`, an unknown column or value, or two studies of one name.
    """
    rows = file_gate.csv_rows(path, ConfigurationError, largest=file_gate.SIZES.written)
    # A spreadsheet writes empty rows, too.
    filled = (
        (line, row) for line, row in rows if any(str(cell or "").strip() for cell in row.values())
    )
    studies = tuple(_study(path, line, row) for line, row in islice(filled, MOST + 1))
    if not 0 < len(studies) <= MOST:
        raise ConfigurationError(
            f"{path}: {'no study' if not studies else f'more than {MOST} studies'}. A cohort has a "
            "row for each study, below a header such as: subject,trial,seed"
        )
    doubled = [name for name, n in Counter(each.name for each in studies).items() if n > 1]
    if doubled:
        raise ConfigurationError(
            f"{path}: two studies are called {doubled[0]}. Give each its own in the column name."
        )
    return studies


def _study(path: Path, line: int, row: Mapping[str, str]) -> Study:
    if None in row or None in row.values():
        raise ConfigurationError(
            f"{path}, line {line}: not as many cells as the header has columns. Add or remove some."
        )
    given = {key.strip(): cell.strip() for key, cell in row.items() if cell.strip()}
    settings = [f"{key}={given.pop(key)}" for key in list(given) if "." in key]
    if "seed" in given:
        settings.append(f"seed={given['seed']}")
    if "subject" not in given:
        raise ConfigurationError(
            f"{path}, line {line}: no subject. Give a number, a name or a subject file in the "
            "column subject; columns are separated by commas."
        )
    given.setdefault("name", _name_of(given))
    given.pop("seed", None)
    if given["subject"].lower().endswith(".toml"):
        given["subject"] = str((path.parent / given["subject"]).resolve())
    try:
        return Study.model_validate({**given, "settings": settings})
    except ValidationError as error:
        problems = "; ".join(
            f"{'.'.join(map(str, each['loc']))}: {each['msg']} ({each['input']!r:.60})"
            for each in error.errors()
        )
        raise ConfigurationError(
            f"{path}, line {line}: {problems}. Columns: name, subject, trial, seed, start, and "
            "settings such as training.samples."
        ) from None


def _name_of(given: Mapping[str, str]) -> str:
    """A name from what the study is of: `S01-T03-s1`."""
    base = Path(given["subject"])
    # An import writes PERSON/subject.toml.
    stem = base.parent.name if base.name == "subject.toml" and base.parent.name else base.stem
    stem = f"S{int(stem):02d}" if stem.isdecimal() else stem
    seed = f"s{given['seed']}" if given.get("seed", "0") != "0" else ""
    return "-".join(part for part in (stem, given.get("trial", ""), seed) if part)
