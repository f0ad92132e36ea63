"""Results of applications as files: JSON, tables, page and schema from one typed result."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, ClassVar, Self, get_args

from pydantic import BaseModel

from gaitval._internal.io.artefacts import versions, write_json, write_text
from gaitval._internal.io.text_tables import csv_text
from gaitval.metrics.typed import Result, schema, tidy
from gaitval.reporting.page import write_html, write_page


class Written(Result):
    """A result that is a file `NAME`.json, with its tables and its page.

    Attributes
    ----------
    NAME : of the files, without ending.
    TEMPLATE : of the page, "package:file".
    TABLES : by the name of a CSV file, without ending, the field or property whose rows it has,
        and what they are: a column is a field of it.
    """

    NAME: ClassVar[str]
    TEMPLATE: ClassVar[str]
    TABLES: ClassVar[Mapping[str, tuple[str, type[Result]]]] = {}

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
    def file_schema(cls) -> dict[str, Any]:
        """The JSON schema of the file."""
        return schema(cls, name=cls.NAME, version=cls.version())

    def write(
        self,
        folder: Path,
        *,
        page: bool = True,
        paper: bool = True,
        scripts: Sequence[str] = (),
        **shown: Any,
    ) -> list[Path]:
        """Write the JSON file, the tables and, unless `page` is False, the page into `folder`, on
        `paper` (PDF), too; returns their paths. The template gets the `result` and what else is
        `shown`; `scripts` are as `write_page` takes them. Raises ArtefactError.
        """
        write_json(folder / f"{self.NAME}.json", self.as_dict())
        for file, (field, model) in self.TABLES.items():
            write_text(folder / f"{file}.csv", table_text(getattr(self, field), model))
        context = {"result": self, **shown}
        if page and paper:
            write_page(folder, self.NAME, self.TEMPLATE, context, scripts=scripts)
        elif page:
            write_html(folder, self.NAME, self.TEMPLATE, context)
        endings = ["json", *(["html"] if page else []), *(["pdf"] if page and paper else [])]
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
    return value


def taken(model: type[Result], source: object, **more: Any) -> dict[str, Any]:
    """The fields of a `model` as the attributes of `source` have them, but for those in `more`."""
    names = (name for name in model.model_fields if name not in more)
    return {name: getattr(source, name) for name in names} | more


def table_text(rows: Sequence[Result], model: type[Result]) -> str:
    """`rows` of a `model` as CSV, a column for each field."""
    columns = list(model.model_fields)
    return csv_text([columns, *([getattr(row, name) for name in columns] for row in rows)])
