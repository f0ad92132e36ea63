"""What the sources say of the fields of a model, below each: read when somebody asks.

pydantic would read them whenever a class is made, which takes a third of a second of every start.
"""

import ast
import inspect
import sys
from functools import cache
from itertools import zip_longest
from pathlib import Path

from pydantic import BaseModel


def field_texts(model: type[BaseModel]) -> dict[str, str]:
    """The text below each field of a `model`, or of what it inherits from, that has one."""
    found: dict[str, str] = {}
    for each in reversed(model.__mro__):
        source = getattr(sys.modules.get(each.__module__), "__file__", None)
        if issubclass(each, BaseModel) and each is not BaseModel and source is not None:
            # that of a generic class with its types is made from the class itself
            name = each.__qualname__.partition("[")[0]
            found |= _texts_in(Path(source)).get(name, {})
    return {name: text for name, text in found.items() if text and name in model.model_fields}


@cache
def _texts_in(source: Path) -> dict[str, dict[str, str]]:
    """The texts in a file, by class and field; empty for a field without one."""
    found: dict[str, dict[str, str]] = {}
    for each in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        if isinstance(each, ast.ClassDef):
            found[each.name] = {
                field.target.id: _text(below)
                for field, below in zip_longest(each.body, each.body[1:])
                if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
            }
    return found


def _text(below: ast.stmt | None) -> str:
    """What stands below a field, if that is a text; else it has none of its own."""
    if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
        return inspect.cleandoc(below.value.value) if isinstance(below.value.value, str) else ""
    return ""
