"""What the name of a marker says: on which side, and on which places it may be.

Names are read in English, German, French, Italian, Spanish and Portuguese, and in the abbreviations
of Plug-in Gait, CGM2, Davis (BTS), Helen Hayes, Cleveland, IOR (Rizzoli), CAST, ISB, HBM, Qualisys
and OpenSim's models. Which letters mean right and left is taken from the whole file: those with
which most names have a partner.
"""

import re
import tomllib
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.scaling.markers.body import Site

NAMED: Final = 12.0
"""Log of how much likelier a name is for one of the places that it means than for another: names
are mistaken in one marker of several hundred; a figure between that and what positions say."""

SIDES: Final = (
    *(("RIGHT", "LEFT"), ("RECHTS", "LINKS"), ("RE", "LI"), ("DROITE", "GAUCHE")),
    *(("DROIT", "GAUCHE"), ("DESTRA", "SINISTRA"), ("DESTRO", "SINISTRO"), ("DX", "SX")),
    *(("DERECHA", "IZQUIERDA"), ("DERECHO", "IZQUIERDO"), ("DER", "IZQ")),
    *(("DIREITA", "ESQUERDA"), ("DIREITO", "ESQUERDO"), ("DIR", "ESQ"), ("RT", "LT")),
    *(("RX", "LX"), ("R", "L"), ("D", "G"), ("D", "E"), ("D", "I"), ("D", "S")),
)
"""Words and letters for right and left; of those with equally many partners, the first."""

COMPUTED: Final = re.compile(
    r"[HKASEW]JC|JC$|^MID(?:[AP]SIS?|HIPS?|PELVIS|KNEES?|ANKLES?|TOP|BOTTOM)|GROUND$|CENT(?:RE|ER)OF|^COM$|HIPCENT|"
    r"ANGLES?$|MOMENTS?$|FORCES?$|POWERS?$|"
    r"PROJ$|^USERMO|^[LR](?:CVM|VWM|MWP|HO)$|^(?:HC|OT|C7O|MIDFH|MIDFRONT)$"
)
"""Names of points that a program computed: joint centres, middles, results; projections on the
floor; those with which Plug-in Gait builds arms, head and thorax, and what Nexus gives for its
user's models."""

AXES: Final = ("OALP", "XYZ")
"""Last letters of the points that draw the axes of a segment: of Vicon, all four; of others."""


MIDDLE: Final = {"PSIS": "Sacrum"}
"""Where the marker is whose name is that of a place on both sides, and says no side: two markers do
not have one name."""


@dataclass(frozen=True)
class ParsedName:
    """What a name says: the side ("R", "L"; "" where it says none) and the places, if any."""

    side: str
    places: tuple[str, ...]

    def fits(self, site: Site) -> bool:
        """Whether a place is one of these."""
        return site.name in self.places and (
            not (self.side and site.side) or site.side == self.side
        )


def plain(name: str) -> str:
    """A name in capitals without accents and signs, and without "Subject:"."""
    own = name.rsplit(":", 1)[-1].replace("ß", "ss")
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue")):
        own = own.replace(umlaut, letters).replace(umlaut.upper(), letters.upper())
    bare = unicodedata.normalize("NFKD", own).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9]", "", bare).upper()


def computed(names: Sequence[str]) -> frozenset[str]:
    """Those of the names in a file that are of computed points."""
    known = {plain(name) for name in names}
    return frozenset(
        name
        for name in names
        for own in [plain(name)]
        if COMPUTED.search(own)
        or any(own[-1:] in ends and {own[:-1] + end for end in ends} <= known for ends in AXES)
    )


NUMBERED: Final = re.compile(r"#\d+$")
"""The end of a name that more than one marker of a file has (`mocap.reading`)."""
BOTH_SIDES_OF: Final = ("Knee", "Ankle")
"""Joints of which both markers may have the one name."""


def read_names(names: Sequence[str]) -> list[ParsedName]:
    """What each of the names of a file says; of two markers with one name on a joint, that either
    is on either side of it.
    """
    right, left = _sides_of([plain(name) for name in names])
    found = []
    for name in names:
        own = NUMBERED.sub("", name)
        parsed = _parsed(plain(own), right, left)
        if own != name:
            medial = [f"{place}.Medial" for place in parsed.places if place in BOTH_SIDES_OF]
            parsed = replace(parsed, places=tuple(dict.fromkeys([*parsed.places, *medial])))
        found.append(parsed)
    return found


def likelihoods(parsed: Sequence[ParsedName], sites: Sequence[Site]) -> Array:
    """(N, K) logarithm of how likely each name is for each place, relative to a place it means."""
    return np.array(
        [
            [0.0 if not each.places or each.fits(site) else -NAMED for site in sites]
            for each in parsed
        ]
    )


def _sides_of(names: Sequence[str]) -> tuple[str, str]:
    """The letters for right and left of a file."""
    known = set(names)

    def partners(pair: tuple[str, str]) -> int:
        right, left = pair
        return sum(
            any(
                left + rest in known or rest + left in known
                for rest in (_without(name, right, first=True), _without(name, right, first=False))
                if rest
            )
            for name in names
        )

    # A longer word wins against a letter of it: "RIGHT" begins with "R".
    best = max(SIDES, key=partners)
    return best if partners(best) else ("R", "L")


def _without(name: str, side: str, *, first: bool) -> str:
    if first:
        return name.removeprefix(side) if name.startswith(side) else ""
    return name.removesuffix(side) if name.endswith(side) else ""


def _parsed(name: str, right: str, left: str) -> ParsedName:
    found: list[ParsedName] = []
    for first in (True, False):
        for side, word in (("R", right), ("L", left)):
            rest = _without(name, word, first=first)
            places = _places(rest) if rest else ()
            if places:
                found.append(ParsedName(side, places))
    if found:
        return found[0]
    for side, word in (("R", right), ("L", left)):
        # In the middle, as in FRTHI.
        for at in [match.start() for match in re.finditer(word, name[1:-1])]:
            places = _places(name[: at + 1] + name[at + 1 + len(word) :]) if len(word) == 1 else ()
            if places and not _places(name):
                return ParsedName(side, places)
    return ParsedName("", tuple(MIDDLE.get(place, place) for place in _places(name)))


def _places(stem: str) -> tuple[str, ...]:
    found: dict[str, None] = {}
    for pattern, places in _meanings():
        if pattern.fullmatch(stem):
            found |= dict.fromkeys(places)
    return tuple(found)


@cache
def _meanings() -> tuple[tuple[re.Pattern[str], tuple[str, ...]], ...]:
    """Patterns of names and the places that they mean, of `names.toml`."""
    file = resources.files("gaitval.scaling.markers") / "names.toml"
    content = tomllib.loads(file.read_text(encoding="utf-8"))
    found = []
    for meaning in content["meanings"]:
        pattern = meaning["names"]
        for word, spellings in content["words"].items():
            pattern = pattern.replace(f"{{{word}}}", spellings)
        found.append((re.compile(pattern), tuple(meaning["places"])))
    return tuple(found)


def agreement(parsed: Sequence[ParsedName], chosen: Mapping[int, Site | None]) -> float:
    """Share of the names that say a place, whose marker is there; NaN without such names."""
    known = [
        parsed[i].fits(site) for i, site in chosen.items() if parsed[i].places and site is not None
    ]
    return float(np.mean(known)) if known else float("nan")
