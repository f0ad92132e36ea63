"""Units that files name, as factors to SI."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from gaitval.errors import RecordError

METRES: Final[dict[str, float]] = {"in": 0.0254, "ft": 0.3048, "m": 1.0, "cm": 1e-2, "mm": 1e-3}
"""Units of length that files name, in metres."""

NEWTONS: Final[dict[str, float]] = {"n": 1.0, "kn": 1e3}
NEWTON_METRES: Final[dict[str, float]] = {"nm": 1.0, "ncm": 1e-2, "nmm": 1e-3, "knm": 1e3}


_SPELLINGS: Final = (
    (r"millimet(?:er|re)s?", "mm"),
    (r"centimet(?:er|re)s?", "cm"),
    (r"met(?:er|re?)s?|mete", "m"),
    (r"newtons?|nt", "n"),
    (r"inch(?:es)?", "in"),
    (r"f(?:oo|ee)t", "ft"),
)
"""Other spellings; the files of c3d.org have `nt`, `ntmm`, and `mete`, cut to four letters."""


def unit_name(text: str) -> str:
    """A unit `text` of a file, for example `Millimeters` or `N.mm`, as `METRES`, `NEWTONS` and
    `NEWTON_METRES` spell it.
    """
    # `N.mm`, `N*mm` and `N-mm` are all `nmm`.
    plain = re.sub(r"[\s.*·-]", "", text).lower()
    # In this order: millimetre contains metre.
    for written, short in _SPELLINGS:
        plain = re.sub(written, short, plain)
    return plain


def unit_factor(path: Path, text: str, units: Mapping[str, float], what: str) -> float:
    """Factor to SI of a unit as the file `path` writes it, the `text`, in any spelling of those
    that may be meant, `units`, for example `METRES`. Raises RecordError, which says `what` it is in
    the file, if it is missing or unknown.
    """
    plain = unit_name(text)
    if plain not in units:
        seen = f"is {text.strip()!r}, which is not a known unit" if plain else "is missing"
        raise RecordError(
            f"{path}: {what} {seen}, so the numbers have no meaning. Known units are "
            f"{', '.join(units)}: set the right one in the program that made the file, and export "
            "again."
        )
    return units[plain]
