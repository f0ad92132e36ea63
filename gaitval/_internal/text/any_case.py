"""Names that people write as they like: `A4` is `a4`, `Left` is `left`."""

from collections.abc import Iterable, Iterator
from typing import Any, Literal, TypeVar, get_args, get_origin

_Given = TypeVar("_Given")


def as_known(given: _Given, names: Iterable[str]) -> _Given | str:
    """The one of `names` that was `given`, in capitals or not; else what was given."""
    if not isinstance(given, str):
        return given
    return next((name for name in names if name.casefold() == given.casefold()), given)


def literals_of(annotation: Any) -> Iterator[str]:
    """The texts that a field of this `annotation` takes, where it takes none but some."""
    if get_origin(annotation) is Literal:
        yield from (each for each in get_args(annotation) if isinstance(each, str))
    elif get_origin(annotation) is not tuple:
        for part in get_args(annotation):
            yield from literals_of(part)
