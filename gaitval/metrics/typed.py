"""The base of results that are written as JSON: strict models that are also the schema.

A number must be a number: texts, booleans, NaN and infinity are refused. A model that is read from
a file and written again gives the same bytes.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, Self

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, Strict, ValidationError

from gaitval.errors import ArtefactError

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"

Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Size = Annotated[float, Strict(), Field(allow_inf_nan=False, ge=0)]
Positive = Annotated[float, Strict(), Field(allow_inf_nan=False, gt=0)]
Count = Annotated[int, Strict(), Field(ge=0)]
Flag = Annotated[bool, Strict()]
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class Result(BaseModel):
    """A part of a result. Unknown keys are refused; values that were not given are not written."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    def as_dict(self) -> dict[str, Any]:
        """To be written as JSON."""
        values: dict[str, Any] = self.model_dump(mode="json", exclude_unset=True, by_alias=True)
        return values

    @classmethod
    def read(cls, values: Any, origin: str, *, file: str, mend: str) -> Self:
        """The model from values that were read from a file.

        Parameters
        ----------
        values : JSON.
        origin : where they come from, for the message.
        file : the kind of file, such as `metrics.json`.
        mend : what to do if they cannot be used.

        Raises
        ------
        ArtefactError : they do not match the schema; the message says where, and what was seen.
        """
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            first = error.errors()[0]
            place = "/".join(map(str, first["loc"])) or "the top level"
            seen = "" if first["type"] == "missing" else f", not {first['input']!r:.80}"
            raise ArtefactError(
                f"{origin}: does not match the schema of {file}: at {place}, "
                f"{first['msg']}{seen}. It is damaged or from another version of gaitval; {mend}."
            ) from None


class OpenResult(Result):
    """A part of a result to which other versions may have added keys; they are kept."""

    model_config = ConfigDict(extra="allow")


def same_version(values: Any, origin: str, *, file: str, version: int, mend: str) -> None:
    """Raise ArtefactError if a file states another version of its schema."""
    found = values.get("schema_version") if isinstance(values, Mapping) else None
    if isinstance(found, int) and found != version:
        raise ArtefactError(
            f"{origin}: has version {found} of the schema of {file}, but this gaitval reads "
            f"version {version}. {mend}"
        )


def named(names: Sequence[str]) -> tuple[Any, Any]:
    """Annotations of a dictionary with exactly these keys: for the keys, and for the whole."""

    def check(values: dict[str, Any]) -> dict[str, Any]:
        wrong = sorted(set(names) ^ set(values))
        if wrong:
            missing = [name for name in wrong if name not in values]
            raise ValueError(f"{'missing' if missing else 'unknown'}: {(missing or wrong)[0]}")
        return values

    key = Field(json_schema_extra={"enum": list(names)})
    whole = Field(json_schema_extra={"minProperties": len(names)})
    return key, (whole, AfterValidator(check))


def schema(model: type[Result], *, name: str, version: int) -> dict[str, Any]:
    """The JSON schema of a file, `name` without `.json`."""
    found = model.model_json_schema()
    title = f"gaitval {name}.json"
    return {"$schema": DIALECT, "$id": f"urn:gaitval:{name}:{version}", **found, "title": title}


def tidy(value: Any) -> Any:
    """JSON-serialisable copy: floats to six significant digits, non-finite values as null.

    So the file does not depend on the last bits of the floating-point arithmetic.
    """
    if isinstance(value, Mapping):
        return {str(key): tidy(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return tidy(value.tolist())
    if isinstance(value, list | tuple):
        return [tidy(item) for item in value]
    if isinstance(value, np.generic):
        return tidy(value.item())
    if isinstance(value, float):
        return float(f"{value:.6g}") + 0.0 if math.isfinite(value) else None
    return value
