"""What every table of a device's file has in common."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, model_validator

Angle = Annotated[float, Field(ge=-3.2, le=3.2)]
"""rad; no joint turns further than half a turn."""
AtLeastZero = Annotated[float, Field(ge=0, le=1e6)]
AboveZero = Annotated[float, Field(gt=0, le=1e6)]
PartOfOne = Annotated[float, Field(ge=0, le=1)]


def _has_truth(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return any(_has_truth(each) for each in value)
    return isinstance(value, bool)


class Table(BaseModel):
    """A table: frozen; unknown keys, infinity, NaN, and true for a number refused."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True
    )

    @model_validator(mode="before")
    @classmethod
    def _numbers(cls, values: Any) -> Any:
        for name, value in values.items() if isinstance(values, dict) else ():
            field = cls.model_fields.get(name)
            if field is not None and field.annotation is not bool and _has_truth(value):
                raise ValueError(
                    f"{name}: true and false are for what is on or off; give a number."
                )
        return values
