"""Texts, numbers and flags of an OpenSim element, and the safe parsing of its files."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np

from gaitval._internal.io import file_gate
from gaitval._internal.text.plain_numbers import plain_float
from gaitval.arrays import Array
from gaitval.errors import ModelError
from gaitval.model.safe_xml import parse_xml

LARGEST_FILE: Final = 50_000_000
"""Bytes; a full-body model with muscles has about 2,000,000."""


def read_document(path: Path) -> Element:
    """The root of the OpenSim file `path`: a model, a set-up, external loads. Raises ModelError if
    it cannot be read, is no OpenSim file, or is not safe to read.
    """
    path = Path(path)
    content = file_gate.read_bytes(path, ModelError, largest=LARGEST_FILE)
    return parse_xml(path, content, root="OpenSimDocument", kind="an OpenSim file")


def child(element: Element, kind: str, path: Path) -> Element:
    """The first `kind` inside `element`. Raises ModelError, with the file's `path`, without one."""
    found = element.find(kind)
    if found is None:
        seen = ", ".join(f"<{each.tag:.40}>" for each in list(element)[:5]) or "nothing"
        raise ModelError(f"{path}: contains no <{kind}>, but {seen}. Give another file.")
    return found


def text(element: Element, tag: str, default: str = "") -> str:
    """Stripped text of the child `tag` of `element`; the `default` if it is missing or empty."""
    return (element.findtext(tag) or "").strip() or default


def number(element: Element, tag: str, where: str, *, default: float | None = None) -> float:
    """A finite number in the child `tag` of `element`; the `default` if the child is missing.
    Raises ModelError, which says `where`, as `numbers` does.
    """
    found = numbers(element, tag, where, default=None if default is None else (default,))
    if len(found) != 1:
        raise ModelError(f"{where}: <{tag}> must be one number, but there are {len(found)}.")
    return float(found[0])


def numbers(
    element: Element,
    tag: str,
    where: str,
    *,
    count: int | None = None,
    default: Sequence[float] | None = None,
) -> Array:
    """Finite numbers in the child `tag` of `element`; the `default` if the child is missing.

    Raises ModelError, which says `where`, if there is no child and no default, a word is not a
    finite number, or there are not `count`.
    """
    written = element.findtext(tag)
    if written is None:
        if default is None:
            raise ModelError(f"{where}: <{tag}> is missing.")
        return np.array(default, dtype=float)
    words = written.replace(",", " ").split()
    try:
        found = np.array([plain_float(word) for word in words])
    except ValueError:
        found = np.array([np.nan])
    if not np.isfinite(found).all():
        raise ModelError(f"{where}: <{tag}> is {written.strip()!r:.80}, not finite numbers.")
    if count is not None and len(found) != count:
        raise ModelError(f"{where}: <{tag}> must be {count} numbers, but there are {len(found)}.")
    return found


def flag(element: Element, tag: str, *, default: bool = False) -> bool:
    """Whether the child `tag` of `element` says true; the `default` if it is missing."""
    written = text(element, tag).lower()
    return written in ("true", "1") if written else default


def objects(element: Element, tag: str) -> list[Element]:
    """Members of a set `tag` in `element`, such as `<BodySet>`; none if the set is missing."""
    found = element.find(f"{tag}/objects")
    return [] if found is None else list(found)
