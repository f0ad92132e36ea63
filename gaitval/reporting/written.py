"""Results of applications as files: JSON, tables, page and schema from one typed result."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, ClassVar, Self, get_args

import numpy as np
from pydantic import BaseModel

from gaitval._internal.io.artefacts import versions, write_json, write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval.metrics.typed import Result, schema, tidy
from gaitval.reporting.page import write_page


class Written(Result):
    """A result that is a file `NAME`.json, with its tables and its page.

    Attributes
    ----------
    NAME : of the files, without ending.
    TEMPLATE : of the page, "package:file".
    TABLES : by the name of a CSV file, without ending, the field whose rows it has.
    """

    NAME: ClassVar[str]
    TEMPLATE: ClassVar[str]
    TABLES: ClassVar[Mapping[str, str]] = {}

    schema_version: int
    """Of the file; a subclass says which, as a `Literal`."""
    versions: dict[str, str]
    """Of gaitval and of the libraries that made it."""

    @classmethod
    def version(cls) -> int:
        """Of the schema."""
        found: int = get_args(cls.model_fields["schema_version"].annotation)[0]
        return found

    @classmethod
    def made(cls, **values: Any) -> Self:
        """The result of these `values`: models, dataclasses, named tuples and arrays among them.
        Numbers are as the file has them, six digits, None where not finite.
        """
        about = {"schema_version": cls.version(), "versions": versions()}
        return cls.model_validate(tidy(plain(about | values)))

    @classmethod
    def schema(cls) -> dict[str, Any]:
        """The JSON schema of the file."""
        return schema(cls, name=cls.NAME, version=cls.version())

    def write(
        self, folder: Path, *, page: bool = True, scripts: Sequence[str] = (), **shown: Any
    ) -> list[Path]:
        """Write the JSON file, the tables and, unless `page` is False, the page and its PDF into
        `folder`; returns their paths. The template gets the `result` and what else is `shown`;
        `scripts` are as `write_page` takes them. Raises ArtefactError.
        """
        write_json(folder / f"{self.NAME}.json", self.as_dict())
        for file, field in self.TABLES.items():
            write_text(folder / f"{file}.csv", table_text(getattr(self, field)))
        if page:
            write_page(folder, self.NAME, self.TEMPLATE, {"result": self, **shown}, scripts=scripts)
        endings = ["json", *(["html", "pdf"] if page else [])]
        files = [f"{self.NAME}.{each}" for each in endings] + [
            f"{each}.csv" for each in self.TABLES
        ]
        return [folder / each for each in files]


def plain(value: Any) -> Any:
    """A copy of `value` of dictionaries and lists, without models, dataclasses or named tuples."""
    if isinstance(value, BaseModel):
        return plain({name: getattr(value, name) for name in value.model_fields_set})
    if is_dataclass(value) and not isinstance(value, type):
        return {each.name: plain(getattr(value, each.name)) for each in fields(value)}
    if isinstance(value, Mapping):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return plain(value._asdict())
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def taken(model: type[Result], source: object, **more: Any) -> dict[str, Any]:
    """The fields of a `model` as the attributes of `source` have them, but for those in `more`."""
    names = (name for name in model.model_fields if name not in more)
    return {name: getattr(source, name) for name in names} | more


def table_text(rows: Sequence[Result]) -> str:
    """`rows` of one model as CSV, a column for each field; columns of no row are left out."""
    columns = list(dict.fromkeys(name for row in rows for name in type(row).model_fields))
    cells: Iterable[list[object]] = ([getattr(row, name, None) for name in columns] for row in rows)
    return csv_text([columns, *cells])
