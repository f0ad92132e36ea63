"""What the name of a marker says: on which side, and on which places it may be.

Names are read in English, German, French, Italian, Spanish and Portuguese, and in the abbreviations
of Plug-in Gait, CGM2, Davis (BTS), Helen Hayes, Cleveland, IOR (Rizzoli), CAST, ISB, HBM, Qualisys
and OpenSim's models. Which letters mean right and left is taken from the whole file: those with
which most names have a partner.
"""

import re
import tomllib
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Final

SIDES: Final = (
    *(("RIGHT", "LEFT"), ("RECHTS", "LINKS"), ("RE", "LI"), ("DROITE", "GAUCHE")),
    *(("DROIT", "GAUCHE"), ("DESTRA", "SINISTRA"), ("DESTRO", "SINISTRO"), ("DX", "SX")),
    *(("DERECHA", "IZQUIERDA"), ("DERECHO", "IZQUIERDO"), ("DER", "IZQ")),
    *(("DIREITA", "ESQUERDA"), ("DIREITO", "ESQUERDO"), ("DIR", "ESQ"), ("RT", "LT")),
    *(("RX", "LX"), ("R", "L"), ("D", "G"), ("D", "E"), ("D", "I"), ("D", "S")),
)
"""Words and letters for right and left; of those with equally many partners, the first."""


@dataclass(frozen=True)
class ParsedName:
    """What a name says: the side ("R", "L"; "" where it says none) and the places of `names.toml`
    that it may mean, if any.
    """

    side: str
    places: tuple[str, ...]


def read_names(names: Sequence[str]) -> list[ParsedName]:
    """What each of the names of a file says."""
    plain = [_plain(name) for name in names]
    right, left = _sides_of(plain)
    return [_parsed(name, right, left) for name in plain]


@cache
def meanings() -> dict[str, Any]:
    """The content of `names.toml`."""
    file = resources.files("gaitval.scaling.markers") / "names.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


def _plain(name: str) -> str:
    """A name in capitals without accents and signs, and without "Subject:"."""
    own = name.rsplit(":", 1)[-1].replace("ß", "ss")
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue")):
        own = own.replace(umlaut, letters).replace(umlaut.upper(), letters.upper())
    bare = unicodedata.normalize("NFKD", own).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9]", "", bare).upper()


def _sides_of(names: Sequence[str]) -> tuple[str, str]:
    """The letters for right and left of a file."""
    known = set(names)

    def partners(pair: tuple[str, str]) -> int:
        right, left = pair
        return sum(
            any(name[: at.start()] + left + name[at.end() :] in known for at in ends)
            for name in names
            for ends in [re.finditer(f"^{right}|{right}$", name)]
        )

    # A longer word wins against a letter of it: "RIGHT" begins with "R".
    best = max(SIDES, key=partners)
    return best if partners(best) else ("R", "L")


def _without(name: str, side: str, *, first: bool) -> str:
    if first:
        return name.removeprefix(side) if name.startswith(side) else ""
    return name.removesuffix(side) if name.endswith(side) else ""


def _parsed(name: str, right: str, left: str) -> ParsedName:
    for first in (True, False):
        for side, word in (("R", right), ("L", left)):
            places = _places(_without(name, word, first=first))
            if places:
                return ParsedName(side, places)
    return ParsedName("", _places(name))


def _places(stem: str) -> tuple[str, ...]:
    found: dict[str, None] = {}
    for pattern, places in _patterns():
        if pattern.fullmatch(stem):
            found |= dict.fromkeys(places)
    return tuple(found)


@cache
def _patterns() -> tuple[tuple[re.Pattern[str], tuple[str, ...]], ...]:
    """Patterns of names and the places that they mean."""
    found = []
    for meaning in meanings()["meanings"]:
        pattern = meaning["names"]
        for word, spellings in meanings()["words"].items():
            pattern = pattern.replace(f"{{{word}}}", spellings)
        found.append((re.compile(pattern), tuple(meaning["places"])))
    return tuple(found)
