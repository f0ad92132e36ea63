"""What is said of values that pydantic refuses: where, what was seen, how to fix it.

Each kind of file has words of its own; loaded when a value is refused.
"""

import difflib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

_Problem = Mapping[str, Any]
"""One of the errors of a `pydantic.ValidationError`."""


def in_subject(subject: type[BaseModel], problems: Sequence[_Problem]) -> list[str]:
    """The `problems` of a subject file, whose model is `subject`, one line each: a key that is
    missing because it is misspelt is one.
    """
    meant = {
        (*problem["loc"][:-1], near[0])
        for problem in problems
        if problem["type"] == "extra_forbidden" and (near := _near(subject, problem))
    }
    return [
        _in_subject(subject, problem)
        for problem in problems
        if problem["type"] != "missing" or problem["loc"] not in meant
    ]


def _near(subject: type[BaseModel], problem: _Problem) -> list[str]:
    key = str(problem["loc"][-1])
    return difflib.get_close_matches(key, [*_keys(subject)], n=1, cutoff=0.75)


def _in_subject(subject: type[BaseModel], problem: _Problem) -> str:
    where = ".".join(str(key) for key in problem["loc"])
    if problem["type"] == "missing":
        return f"{where}: missing. Add it."
    if problem["type"] == "extra_forbidden":
        near = _near(subject, problem)
        return f"{where}: unknown key" + (f", did you mean {near[0]}?" if near else ". Remove it.")
    if problem["type"] == "value_error":
        return f"{where}: {problem['ctx']['error']}"
    return f"{where} = {problem['input']!r}: {problem['msg']}."


def _keys(annotation: Any) -> Iterator[str]:
    """The fields of a model and of all models inside it."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        for name, field in annotation.model_fields.items():
            yield name
            yield from _keys(field.annotation)
    else:
        for part in get_args(annotation):
            yield from _keys(part)


def in_options(model: type[BaseModel], problem: _Problem, shown: Callable[[str], str]) -> str:
    """A `problem` of the options of an import, whose class is `model`; `shown` says from an
    option's name what the user calls it.
    """
    name = str(problem["loc"][0])
    where, seen = shown(name), problem["input"]
    if problem["type"] == "missing":
        about = model.model_fields[name].description
        return f"{where}: missing. Give it" + (f": {about}" if about else ".")
    if problem["type"] == "extra_forbidden":
        near = difflib.get_close_matches(name, model.model_fields, n=1, cutoff=0.6)
        return f"{where}: unknown" + (
            f", did you mean {shown(near[0])}?" if near else ". Remove it."
        )
    if problem["type"] == "value_error":
        return f"{where} {seen}: {problem['ctx']['error']}"
    if problem["type"] == "literal_error":
        return f"{where} {seen}: give {problem['ctx']['expected'].replace(chr(39), '')}."
    return f"{where} = {seen!r}: {problem['msg'][0].lower()}{problem['msg'][1:]}."


def in_marker_set(file: type[BaseModel], marker: type[BaseModel], problem: _Problem) -> str:
    """A `problem` of a marker set, of the models of its `file` and of a `marker`."""
    place = problem["loc"]
    where = ".".join(str(key) for key in place)
    if problem["type"] != "extra_forbidden":
        return f"{where}: {problem['msg']}."
    known = marker.model_fields if len(place) > 1 else file.model_fields
    near = difflib.get_close_matches(str(place[-1]), known, n=1)
    return f"{where}: unknown key" + (
        f", did you mean {near[0]}?" if near else f"; known: {', '.join(known)}."
    )


def in_configuration(error: ValidationError, default: BaseModel) -> str:
    """The lines on an `error` in a configuration, whose `default` is valid."""
    lines = []
    problems = error.errors()
    for problem in problems:
        place = [str(part) for part in problem["loc"]]
        where = ".".join(place)
        if problem["type"] == "extra_forbidden":
            known: type[BaseModel] = type(default)
            for part in place[:-1]:
                annotation = known.model_fields[part].annotation
                assert isinstance(annotation, type)
                known = annotation
            names = ", ".join(known.model_fields)
            lines.append(f"{where}: unknown; the known ones are {names}.")
        elif problem["type"] == "value_error":  # in our words, which say how to fix it
            lines.append(f"{where}: {problem['ctx']['error']}.".removeprefix(": "))
        # pydantic reports a list and the number in it: the number is enough
        elif any(
            len(other["loc"]) > len(place) and other["loc"][: len(place)] == problem["loc"]
            for other in problems
        ):
            continue  # a list is too short only because a number in it is refused
        else:
            # what it is if it is not given; a section has no default
            value: Any = default
            for part in place[:2]:
                value = getattr(value, part, None)
            has_default = value is not None and not isinstance(value, BaseModel)
            usual = list(value) if isinstance(value, tuple) else value
            lines.append(
                f"{where}: {problem['msg']}, but it is {problem['input']!r:.80}."
                + (f" The default is {usual!r}." if has_default else "")
            )
    return "\n".join(lines)
