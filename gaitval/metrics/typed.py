"""The base of results that are written as JSON: strict models that are also the schema.

A number must be a number: texts, booleans, NaN and infinity are refused. A model that is read from
a file and written again gives the same bytes.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, Generic, Self, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Strict,
    ValidationError,
)

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.errors import ArtefactError

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"

Number = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Size = Annotated[float, Strict(), Field(allow_inf_nan=False, ge=0)]
Share = Annotated[float, Strict(), Field(allow_inf_nan=False, ge=0, le=1)]
StrictPositive = Annotated[float, Strict(), Field(allow_inf_nan=False, gt=0)]
Count = Annotated[int, Strict(), Field(ge=0)]
Flag = Annotated[bool, Strict()]
Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Curve = Annotated[list[Number | None], Field(min_length=101, max_length=101)]
"""0 to 100 % of a side's gait cycle; null where not finite."""

T = TypeVar("T")
R = TypeVar("R", bound="Result")


def number(value: float | None) -> float | None:
    """`value` as a plain float, as results have it; None for what is missing or not finite."""
    return float(value) if value is not None and math.isfinite(value) else None


def numbers(values: Array) -> list[float | None]:
    """The curve `values` (n,) as results have it: all digits, None where it is not finite."""
    return [number(each) for each in values.tolist()]


def array(curve: Sequence[float | None]) -> Array:
    """The `curve` of a result as an array (n,), NaN where it has no value."""
    return np.array(curve, dtype=float)


class Result(BaseModel):
    """A part of a result. Unknown keys are refused; values that were not given are not written."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    def as_dict(self) -> dict[str, Any]:
        """To be written as JSON."""
        values: dict[str, Any] = self.model_dump(mode="json", exclude_unset=True, by_alias=True)
        return values

    @classmethod
    def read(cls, values: Any, origin: str, *, file: str, fix: str) -> Self:
        """The model from JSON `values` of the file `origin`. Raises ArtefactError if they do not
        match the schema, which says where, what was seen, which kind of `file` it is, such as
        `metrics.json`, and what can be done (`fix`).
        """
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            first = error.errors()[0]
            place = "/".join(map(str, first["loc"])) or "the top level"
            seen = "" if first["type"] == "missing" else f", not {first['input']!r:.80}"
            raise ArtefactError(
                f"{origin}: does not match the schema of {file}: at {place}, "
                f"{first['msg']}{seen}. It is damaged or from another version of gaitval; {fix}."
            ) from None


class Sides(Result, Generic[T]):
    """Something of both sides."""

    right: T
    left: T

    def of(self, side: Side) -> T:
        """That of a side."""
        return self.right if side == "right" else self.left


class OpenResult(Result):
    """A part of a result to which other versions may have added keys; they are kept."""

    model_config = ConfigDict(extra="allow")


def rounded(result: R) -> R:
    """The `result` as its file has it (`tidy`)."""
    return type(result).model_validate(tidy(result.model_dump(exclude_unset=True)))


def as_version(version: int, *earlier: int) -> BeforeValidator:
    """Of `schema_version`: a file of one of the `earlier` versions is read as one of `version`, in
    which only keys have other names (`AliasChoices` of the field).
    """
    return BeforeValidator(lambda found: version if found in earlier else found)


def same_version(
    values: Any, origin: str, *, file: str, version: int, fix: str, also: Sequence[int] = ()
) -> None:
    """Raise ArtefactError if the file `origin` (of kind `file`) states in `values` another schema
    than `version` or one that is read `also`; `fix` says what to do.
    """
    found = values.get("schema_version") if isinstance(values, Mapping) else None
    if isinstance(found, int) and found not in (version, *also):
        raise ArtefactError(
            f"{origin}: has version {found} of the schema of {file}, but this gaitval reads "
            f"version {version}. {fix}"
        )


def named(names: Sequence[str]) -> tuple[Any, Any]:
    """Annotations, of the keys and of the whole, of a dictionary that has exactly the keys `names`.
    The dictionary's check raises ValueError, from which pydantic makes its error.
    """

    def check(values: dict[str, Any]) -> dict[str, Any]:
        wrong = sorted(set(names) ^ set(values))
        if wrong:
            missing = [name for name in wrong if name not in values]
            raise ValueError(f"{'missing' if missing else 'unknown'}: {(missing or wrong)[0]}")
        return values

    # a type cannot require a set of keys: the schema states it here, and `check` enforces it
    key = Field(json_schema_extra={"enum": list(names)})
    whole = Field(json_schema_extra={"minProperties": len(names)})
    return key, (whole, AfterValidator(check))


def sided(names: Sequence[str]) -> tuple[str, ...]:
    """Each of `names` with `_r` and with `_l`."""
    return tuple(f"{name}_{side}" for name in names for side in "rl")


def schema(model: type[Result], *, name: str, version: int) -> dict[str, Any]:
    """The JSON schema of the file `name`.json that holds a `model`, with its `version`."""
    found = model.model_json_schema()
    title = f"gaitval {name}.json"
    return {"$schema": DIALECT, "$id": f"urn:gaitval:{name}:{version}", **found, "title": title}


def tidy(value: Any) -> Any:
    """JSON-serialisable copy of `value`: floats to six significant digits, non-finite values as
    null. So a file does not depend on the last bits of the arithmetic.
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
        # adding 0 turns -0.0 into 0.0
        return float(f"{value:.6g}") + 0.0 if math.isfinite(value) else None
    return value
