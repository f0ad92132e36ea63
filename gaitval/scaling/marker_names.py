"""Names of markers: which unknown name may be a known one.

A likeness is only ever suggested in a message; nothing is renamed by it.
"""

import re
from collections.abc import Iterable, Mapping
from difflib import SequenceMatcher
from typing import Final, NamedTuple

from gaitval.scaling.marker_set import plain_name

LEAST_LIKENESS: Final = 0.8
"""Smallest likeness that is suggested (2 × letters in common / letters of both, without the side).
One letter in four differs at 0.75, and that is how marker sets write different places: THLP and
THLD, HEEL and HELL."""

SHORTEST_STEM: Final = 3
"""Letters beside the side that a name must have to be like another; of two letters one is half."""

_OPPOSITES: Final = (
    (r"MED|INN?ER$|INT$|IN$|^M(?=KN|AN|EL|MA|FC|TP|EE|EK|M$|W$)", r"LAT|OUT|EXT$"),
    (r"ASI|ANT|FRONT|FRT|^F(?=HD|SH|WT)|^F$", r"PSI|POST|REAR|BACK|BCK|^B(?=HD|SH|WT|AK)|^P$"),
    (r"UP|SUP|PROX|HIGH|TOP", r"LOW|INF|DIST|BOT"),
    (r"RAD", r"ULN"),
)
"""Words of opposite places: medial, lateral; front, back; upper, lower; radial, ulnar."""


class Likeness(NamedTuple):
    """An unknown name, the marker that it may be, and how alike they are (0 to 1)."""

    name: str
    marker: str
    ratio: float


def alike(unknown: Iterable[str], missing: Mapping[str, Iterable[str]]) -> list[Likeness]:
    """Names in a file that no marker has (`unknown`) and that may be missing markers, at most one
    for each, in the markers' order; `missing` has names and aliases of each marker that the file
    lacks.

    A pair needs a likeness of `LEAST_LIKENESS`, the same side, the same numbers, not the opposite
    of medial and lateral, front and back, upper and lower, radial and ulnar; and each of the two
    must be the other's only best.
    """
    unknown = tuple(unknown)
    pairs = [
        Likeness(name, marker, ratio)
        for marker, spellings in missing.items()
        for name in unknown
        for ratio in [max((_likeness(name, spelling) for spelling in spellings), default=0.0)]
        if ratio >= LEAST_LIKENESS
    ]
    return [pair for pair in pairs if _only_best(pair, pairs)]


def _only_best(pair: Likeness, pairs: list[Likeness]) -> bool:
    """Whether no other pair of the same name or the same marker is as good."""
    return all(
        other.ratio < pair.ratio
        for other in pairs
        if other is not pair and (other.name == pair.name or other.marker == pair.marker)
    )


def _likeness(name: str, spelling: str) -> float:
    """Likeness of two names without their side; 0 if they say different places."""
    (side, stem), (known_side, known_stem) = _side_and_stem(name), _side_and_stem(spelling)
    if side != known_side or not _same_place(stem, known_stem):
        return 0.0
    if min(len(stem), len(known_stem)) < SHORTEST_STEM:
        return 0.0
    # A side may also stand within a name, as in FLTHI and FRTHI.
    if stem != known_stem and stem.replace("L", "R") == known_stem.replace("L", "R"):
        return 0.0
    return SequenceMatcher(None, stem, known_stem, autojunk=False).ratio()


def _side_and_stem(name: str) -> tuple[str, str]:
    """The side that a name begins or ends with ("R", "L" or ""), and the rest, both plain."""
    own = name.rsplit(":", 1)[-1]
    # A side at the end counts only after a separator: many names end in L or R by chance.
    last = re.search(r"[\s._-](R|L|RIGHT|LEFT)$", own, re.IGNORECASE)
    if last:
        return last[1][0].upper(), plain_name(own[: last.start()])
    plain = plain_name(name)
    first = re.match(r"RIGHT|LEFT|R|L", plain)
    return (first[0][0], plain[first.end() :]) if first else ("", plain)


def _same_place(stem: str, other: str) -> bool:
    """Whether two names do not say different places; lateral and front may go unsaid, medial not.

    A marker on the outer side often has no word for it (R.Knee), so what is not called medial is
    lateral.
    """
    numbers = r"\d+"
    if re.findall(numbers, stem) != re.findall(numbers, other):
        return False
    medial = _OPPOSITES[0][0]
    if bool(re.search(medial, stem)) != bool(re.search(medial, other)):
        return False
    return not any(
        (re.search(one, stem) and re.search(opposite, other))
        or (re.search(opposite, stem) and re.search(one, other))
        for one, opposite in _OPPOSITES
    )
