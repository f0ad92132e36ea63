"""The table of a cohort: a row for each study, in CSV or TOML.

A CSV table has a header and a row for each study. All columns but one of `subject`, `static` with
`trials`, and `virtual` may be left out, and an empty cell is a value that is not given:

    name,subject,trial,seed,start,training.samples
    young,S01,,0,,
    young-slow,S01,T03,0,general,500000

A column with a dot in its name is a setting, `section.key`; one with the name of an option of
`gaitval import` is that of a recording, with a semicolon between files. In TOML the same is

    [settings]                    # of every study
    training.samples = 500000

    [[studies]]
    subject = "S01"
    trial = "T03"
    seeds = [0, 1, 2]             # a study for each
    start = "scratch"             # or, of a folder: policy = "../my_walkers"
    settings.identification.method = "none"

    [[studies]]
    name = "P01"
    recording = { static = "P01/stand.c3d", trials = ["P01/walk.c3d"], sex = "F", mass = 63.2 }

`recording` takes what a person of `gaitval import` takes. With the column `device`, names or files
with a semicolon between them, the person then walks with these; `search` is what the torque of the
first is searched for before, a joint and a quantity: `hip_flexion work`. In TOML that is

    devices = [{ name = "hip_exo", search = { joint = "hip_flexion", quantity = "work" } }, "afo"]

Paths are relative to the table.
"""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gaitval import file_gate
from gaitval.artefacts import read_toml, write_text
from gaitval.errors import ConfigurationError
from gaitval.importing.batch_person import person_of
from gaitval.session.request import FILES, ImportOptions

_Start = Literal["general", "scratch"]

MOST: Final = 20_000
"""Studies of a cohort. Each takes minutes: so many are weeks of a machine."""

_VIRTUAL: Final = {"virtual": "number", "virtual_seed": "seed", "around": "around", "by": "by"}
"""Columns of a CSV table that are those of a virtual person, by the key that they have in TOML."""


class Virtual(BaseModel):
    """A virtual person, as `gaitval virtual` makes it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    number: int = Field(0, ge=0)
    seed: int = Field(0, ge=0)
    around: str = "5"
    by: Literal["markers", "stature"] = "markers"


class Study(BaseModel):
    """One row of a table: what one study is of, and how it is done.

    Attributes
    ----------
    name : of its folder.
    subject : number, name or path of the subject file; None for a recording or a virtual person.
    recording : to import first: the options of `gaitval import`, without the name.
    virtual : to make first.
    trial : of the subject that the study is of; its own if empty.
    start : what the first training starts from: the general policy, or nothing.
    policy : folder of another policy that it starts from.
    devices : shipped ones' names, files, or tables of `[[devices]]`, that the person then wears.
    config : file of settings, or the name of a built-in one.
    settings : "section.key=value", as for `--set`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]+$", max_length=120)]
    subject: str | None = None
    recording: dict[str, Any] | None = None
    virtual: Virtual | None = None
    trial: str = ""
    start: _Start = "general"
    policy: str | None = None
    devices: tuple[str | dict[str, Any], ...] = ()
    config: str | None = None
    settings: tuple[str, ...] = ()


def read_table(path: Path) -> tuple[Study, ...]:
    """The studies of a table, the CSV or TOML file `path`. Raises ConfigurationError if it is
    missing or of another kind, has an unknown key or more than `MOST` studies, lacks what a study
    is of, or two studies have one name.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".csv", ".toml"):
        raise ConfigurationError(
            f"{path}: a table is a .csv or a .toml file, not {kind or 'a file without an ending'}."
        )
    rows = _csv_rows(path) if kind == ".csv" else _toml_rows(path)
    studies = tuple(_study(path, where, values) for where, values in islice(rows, MOST + 1))
    check_number(len(studies), str(path))
    if not studies:
        raise ConfigurationError(f"{path}: no study in this table. Write a row for each.")
    return without_doubles(studies, str(path))


def check_number(studies: int, origin: str) -> None:
    """Refuse more than `MOST` studies, which their `origin` holds. Raises ConfigurationError."""
    if studies > MOST:
        raise ConfigurationError(
            f"{origin}: more than {MOST} studies, the most that one cohort takes: its report holds "
            "all of them at once. Divide it into several tables, each with an --out of its own."
        )


def without_doubles(studies: tuple[Study, ...], origin: str) -> tuple[Study, ...]:
    """The same `studies`, if each has a name of its own; raises ConfigurationError, which names
    their `origin`, otherwise.
    """
    counts = Counter(study.name for study in studies)
    twice = [name for name, count in counts.items() if count > 1]
    if twice:
        raise ConfigurationError(
            f"{origin}: {', '.join(twice)}: more than one study of this name, whose "
            "files would be written over each other. Give each a `name` of its own."
        )
    return studies


def with_settings(
    studies: Iterable[Study], settings: Iterable[str], config: str | None = None
) -> tuple[Study, ...]:
    """The studies with settings ("section.key=value") for all, which those of a study's own row
    override; `config` is for studies that name none.
    """
    common = tuple(settings)
    return tuple(
        study.model_copy(
            update={"settings": (*common, *study.settings), "config": study.config or config}
        )
        for study in studies
    )


def write_table(path: Path, studies: Iterable[Study]) -> None:
    """Write `studies` to `path` as a TOML table that `read_table` reads; its paths are absolute."""
    rows = []
    for study in studies:
        values = study.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
        rows.append(values)
    write_text(path, tomli_w.dumps({"studies": rows}))


def _csv_rows(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    for line, row in file_gate.csv_rows(path, ConfigurationError, largest=file_gate.WRITTEN):
        where = f"line {line}"
        if not any(cell.strip() for cell in row.values() if isinstance(cell, str)):
            continue  # a spreadsheet's empty row
        if None in row or None in row.values():
            raise ConfigurationError(
                f"{path}, {where}: not as many cells as the header has columns. Add or remove some."
            )
        yield where, _from_cells({key.strip(): cell.strip() for key, cell in row.items()})


def _from_cells(cells: Mapping[str, str]) -> dict[str, Any]:
    """The values of a row of a CSV table as they would stand in TOML."""
    given = {key: cell for key, cell in cells.items() if cell}
    values: dict[str, Any] = {"settings": []}
    for key, cell in given.items():
        if "." in key:
            values["settings"].append(f"{key}={cell}")
        elif key in ImportOptions.model_fields:
            split: Any = [each.strip() for each in cell.split(";")] if key in FILES else cell
            values.setdefault("recording", {})[key] = split
        elif key in _VIRTUAL:
            values.setdefault("virtual", {})[_VIRTUAL[key]] = cell
        elif key == "seed":
            values["seeds"] = [cell]
        elif key == "device":
            values["devices"] = [each.strip() for each in cell.split(";")]
        else:
            values[key] = cell
    return values


def _toml_rows(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    values = read_toml(path, ConfigurationError)
    tables, common = values.pop("studies", None), values.pop("settings", {})
    if not isinstance(tables, list) or not isinstance(common, dict) or values:
        raise ConfigurationError(
            f"{path}: a table has [[studies]] and perhaps [settings], and nothing else; this one "
            f"has {', '.join(values) or 'no list of studies'}."
        )
    for number, table in enumerate(tables, start=1):
        where = f"study {number}"
        if not isinstance(table, dict):
            raise ConfigurationError(f"{path}: {where}: not a table. Write [[studies]] before it.")
        own = table.get("settings", {})
        listed = own if isinstance(own, list) else _flat(own)
        seeds = table.pop("seeds", None) or [table.pop("seed", None)]
        for seed in seeds:
            row = {**table, "settings": [*_flat(common), *listed]}
            yield where, row if seed is None else {**row, "seeds": [seed], "several": len(seeds)}


def _flat(values: Any, before: str = "") -> list[str]:
    """Settings of nested tables as "section.key=value"."""
    if not isinstance(values, dict):
        return [f"{before}={json.dumps(values)}"]
    found = []
    for key, value in values.items():
        found += _flat(value, f"{before}.{key}" if before else str(key))
    return found


def _study(path: Path, where: str, row: dict[str, Any]) -> Study:
    values = dict(row)
    seeds, several = values.pop("seeds", []), values.pop("several", 1)
    seeded = [f"seed={seed}" for seed in seeds]
    values["settings"] = [*values.get("settings", ()), *seeded]
    kinds = [name for name in ("subject", "recording", "virtual") if values.get(name) is not None]
    if len(kinds) != 1:
        none = f"none, but {', '.join(map(str, row))}"
        raise ConfigurationError(
            f"{path}, {where}: give one of subject, recording (in CSV: static and trials) and "
            f"virtual; this one has {' and '.join(kinds) or none}. Columns of a CSV table are "
            "separated by commas."
        )
    if kinds != ["subject"] and not isinstance(values[kinds[0]], dict):
        raise ConfigurationError(
            f"{path}, {where}: {kinds[0]}: not a table. Write {kinds[0]} = {{ … }}."
        )
    named = str(values.get("name") or _name_of(values, seeds))
    values["name"] = f"{named}-s{seeds[0]}" if several > 1 and values.get("name") else named
    if kinds == ["subject"]:
        values["subject"] = _subject_path(path.parent, str(values["subject"]))
    if values.get("policy"):
        values["policy"] = str((path.parent / str(values["policy"])).resolve())
    if kinds == ["recording"]:
        values["recording"] = _recording(path, where, values)
    if "devices" in values or "search" in values:
        values["devices"] = _devices(path, where, values)
    try:
        return Study.model_validate(values)
    except ValidationError as error:
        problems = "; ".join(
            f"{'.'.join(map(str, each['loc']))}: {each['msg'][:1].lower()}{each['msg'][1:]} "
            f"({each['input']!r:.60})"
            for each in error.errors()
        )
        raise ConfigurationError(
            f"{path}, {where}: {problems}. See gaitval cohort --help."
        ) from None


def _devices(path: Path, where: str, values: dict[str, Any]) -> list[Any]:
    """The devices of a row, paths from the table's folder, the first with the row's search."""
    devices, search = values.get("devices"), values.pop("search", None)
    if not isinstance(devices, list) or not devices:
        raise ConfigurationError(
            f"{path}, {where}: {'a search without a device' if search else 'devices: not a list'}. "
            'Write device = hip_exo into the row, or in TOML devices = ["hip_exo"].'
        )
    found = [
        str(path.parent / each) if isinstance(each, str) and each.endswith(".toml") else each
        for each in devices
    ]
    if search is not None:
        words = str(search).split()
        if len(words) not in (1, 2) or not isinstance(found[0], str):
            raise ConfigurationError(
                f"{path}, {where}: search {search!r} is no joint and quantity of the first device. "
                "Write a joint, or a joint and a quantity, such as hip_flexion work."
            )
        wanted = dict(zip(("joint", "quantity"), words, strict=False))
        found[0] = {"name": found[0], "search": wanted}
    return found


def _recording(path: Path, where: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a recording, checked; its paths are absolute."""
    about = {**values["recording"], "name": values["name"]}
    person = person_of(path.resolve(), where, about)
    found: dict[str, Any] = person.model_dump(mode="json", exclude={"name"}, exclude_defaults=True)
    return found


def _name_of(values: Mapping[str, Any], seeds: list[Any]) -> str:
    """A name from what the study is of: `S01-T03-s1`."""
    virtual = values.get("virtual")
    if virtual is not None:
        base = f"V{virtual.get('seed', 0)}_{virtual.get('number', 0)!s:0>3}"
    elif values.get("recording") is not None:
        base = Path(str(values["recording"].get("static", "recording"))).stem
    else:
        base = Path(str(values["subject"])).stem
    base = f"S{int(base):02d}" if base.isdigit() else base
    seed = f"s{seeds[0]}" if seeds and str(seeds[0]) != "0" else ""
    return "-".join(part for part in (base, str(values.get("trial") or ""), seed) if part)


def _subject_path(folder: Path, subject: str) -> str:
    """A subject file relative to the table; a built-in subject's name as it is."""
    if subject.lower().endswith(".toml"):
        return str(folder / subject)
    return subject
