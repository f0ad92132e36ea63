"""Options of a command from the fields of a pydantic model, which declares them once."""

import inspect
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Final

import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from gaitval.session.request import OptionDisplay

_TYPES: Final = {"boolean": bool, "number": float, "path": Path}
"""By the name or the format in a JSON schema; all else is text."""


def flag_of(model: type[BaseModel], name: str) -> str:
    """The command-line flag of the field `name` of `model`."""
    field = model.model_fields.get(name)
    return (field and _shown(field).flag) or f"--{name.replace('_', '-')}"


def with_fields(
    function: Callable[..., None], model: type[BaseModel], *names: str, may_lack: bool = False
) -> Callable[..., None]:
    """Give the command `function` an option for each field of `model` that is one of a command, or
    for each of `names`, in place of its `**options`. With `may_lack` none is required: the function
    says what it lacks.
    """
    signature = inspect.signature(function)
    own = [each for each in signature.parameters.values() if each.kind != each.VAR_KEYWORD]
    shown = [name for name, field in model.model_fields.items() if _shown(field).in_command]
    of_model = [_parameter(model, name, may_lack=may_lack) for name in names or shown]
    last = [each for each in own if each.name in ("config", "settings")]
    first = [each for each in own if each not in last]
    # the help shows options in this order; `sorted` is stable, so it is the model's within each
    # half
    required_first = sorted([*first, *of_model], key=lambda each: each.default is not each.empty)
    parameters = [
        each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in (*required_first, *last)
    ]

    @wraps(function)
    def complete(**values: Any) -> None:
        function(**values)

    vars(complete)["__signature__"] = signature.replace(parameters=parameters)
    return complete


def _shown(field: FieldInfo) -> OptionDisplay:
    """What a field says of how the command line shows it."""
    return next(
        (each for each in reversed(field.metadata) if isinstance(each, OptionDisplay)),
        OptionDisplay(),
    )


def _parameter(model: type[BaseModel], name: str, *, may_lack: bool) -> inspect.Parameter:
    """A field as typer takes it: a flag, a number, or text, which the model reads."""
    field, schema = model.model_fields[name], model.model_json_schema()["properties"][name]
    # an optional field is "anyOf" of its type and null
    kinds = [each for each in schema.get("anyOf", [schema]) if each["type"] != "null"]
    only = kinds[0] if len(kinds) == 1 else {}
    many, one = "items" in only, only.get("items", only)
    kind: Any = _TYPES.get(one.get("format", one.get("type", "")), str)
    annotation = list[kind] if many else kind
    default = None if field.default == () or field.is_required() else field.default
    if field.is_required() and not may_lack:
        default = inspect.Parameter.empty
    elif default is None:
        annotation = annotation | None
    option = typer.Option(
        flag_of(model, name),
        metavar=_shown(field).metavar or "|".join(only.get("enum", ())) or None,
        help=" ".join((field.description or "").split()) + (" May be repeated." if many else ""),
    )
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=default,
        annotation=Annotated[annotation, option],
    )
