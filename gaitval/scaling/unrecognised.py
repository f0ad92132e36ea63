"""Messages about markers that fit no known marker set, or two nearly equally."""

import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import Final, NamedTuple

from gaitval.model.body import SEGMENTS
from gaitval.scaling.landmarks import LANDMARK_NAMES
from gaitval.scaling.marker_set import MarkerSet, Score, plain_name


@dataclass(frozen=True)
class LikenessLimits:
    """When a name is like another."""

    least_likeness: float = 0.8
    """Smallest likeness that is suggested (2 × letters in common / letters of both, without the
    side). One letter in four differs at 0.75, and that is how marker sets write different places:
    THLP and THLD, HEEL and HELL."""
    shortest_stem: int = 3
    """Letters beside the side that a name must have to be like another; of two letters one is
    half."""
    mostly: float = 0.8


LIKENESS: Final = LikenessLimits()

_OPPOSITES: Final = (
    (r"MED|INN?ER$|INT$|IN$|^M(?=KN|AN|EL|MA|FC|TP|EE|EK|M$|W$)", r"LAT|OUT|EXT$"),
    (r"ASI|ANT|FRONT|FRT|^F(?=HD|SH|WT)|^F$", r"PSI|POST|REAR|BACK|BCK|^B(?=HD|SH|WT|AK)|^P$"),
    (r"UP|SUP|PROX|HIGH|TOP", r"LOW|INF|DIST|BOT"),
    (r"RAD", r"ULN"),
)
"""Words of opposite places: medial, lateral; front, back; upper, lower; radial, ulnar."""

EXAMPLE: Final = """title = "My laboratory"
source = "who defined it"
[markers]
"R.ASIS" = { segment = "pelvis", landmark = "R.ASIS" }
"R.Thigh.1" = { segment = "thigh_r" }
"R.Knee.Medial" = { segment = "thigh_r", landmark = "R.Knee.Medial", static_only = true }"""


def undecided(
    one: tuple[MarkerSet, Score], other: tuple[MarkerSet, Score], uncertain: Sequence[str]
) -> str:
    """The message where the sets `one` and `other` fit nearly equally and mean different places by
    the names `uncertain`.
    """
    lines = ["the markers fit two marker sets nearly equally, which mean different places:"]
    lines += [f"  {fit.name} ({fit.title}): {score}" for fit, score in (one, other)]
    for name in uncertain:
        matches = []
        for fit, _ in (one, other):
            definition = fit.markers[fit.renamed([name])[name]]
            matches.append(f"{definition.landmark or 'no landmark'}, {definition.segment}")
        lines.append(f"  {name}: {' or '.join(matches)}")
    lines.append(f"Say which it is: --marker-set {one[0].name} or --marker-set {other[0].name}.")
    return "\n".join(lines)


UNLABELLED: Final = re.compile(
    r"(?i)(\*|u|c_|m|marker|markers|point|traj|trajectory|unlabell?ed|unidentified|uname|unnamed"
    r"|unknown|new)?[ _.*#-]*\d+|(unlabell?ed|unidentified|unnamed|unknown)(#\d+)?"
)
"""Names that programs give to trajectories that nobody labelled."""


def unlabelled(names: Sequence[str], least: float = LIKENESS.mostly) -> str:
    """What is said of `names` of which a share of `least` or more are of nobody's labelling; else
    empty.
    """
    bare = [name for name in names if UNLABELLED.fullmatch(name.rpartition(":")[2])]
    if not bare or len(bare) <= least * len(names):
        return ""
    which = "They" if len(bare) == len(names) else f"{len(bare)} of {len(names)}"
    some = bare[0] if len(bare) == 1 else f"{bare[0]} to {bare[-1]}"
    return (
        f" {which} are unlabelled: {some} is what programs call a trajectory that nobody named. "
        "Label the trial in the recording program and export it again; no marker set can tell "
        "which is which."
    )


def unknown(
    names: tuple[str, ...], nearest: MarkerSet, *, builtin: Sequence[str], least: float
) -> str:
    """The message where no set fits.

    Parameters
    ----------
    names : of the markers in the file.
    nearest : the set that fits best.
    builtin : names of the sets that there are.
    least : share of a set's required markers that the file must have.
    """
    score = nearest.score(names)
    likely = alike(
        [name for name in names if not nearest.present([name])],
        {marker: (marker, *nearest.markers[marker].aliases) for marker in score.missing},
    )
    twice = ", ".join(name[:-2] for name in names if name.endswith("#2"))
    matches = f" Several markers have one name: {twice}." if twice else ""
    matches += unlabelled(names)
    # character by character is what is wanted: names are no paths
    shared, joined, _ = os.path.commonprefix(names).rpartition("_")  # noqa: RUF071
    if joined and len(names) > 1:
        matches += (
            f" All names begin with {shared}_: if that is the person's name, export again without "
            f"it, or with a colon behind it ({shared}:)."
        )
    lines = [
        f"the {len(names)} markers match no known marker set ({', '.join(builtin)}).{matches}",
        f"  found: {', '.join(names) or 'none'}",
        f"  the nearest is {nearest.name} ({nearest.title}): {score.required - len(score.missing)} "
        f"of {score.required} required markers, at least {least:.0%} are needed; "
        f"its markers missing: {', '.join(score.missing)}",
    ]
    if likely:
        lines.append(
            "  perhaps: "
            + ", ".join(f"{like.name} for {like.marker} ({like.ratio:.0%})" for like in likely)
        )
    lines += [
        "Let `gaitval markers WALK --standing STAND` draft the set. Or describe it yourself in a "
        "TOML file and give it with --marker-set FILE, with a line for each marker, such as",
        *(f"  {line}" for line in EXAMPLE.splitlines()),
        f"Landmarks are {', '.join(LANDMARK_NAMES)}.",
        f"Segments are {', '.join(SEGMENTS)}.",
    ]
    return "\n".join(lines)


class Likeness(NamedTuple):
    """An unknown name, the marker that it may be, and how alike they are (0 to 1)."""

    name: str
    marker: str
    ratio: float


def alike(unknown: Iterable[str], missing: Mapping[str, Iterable[str]]) -> list[Likeness]:
    """Names in a file that no marker has (`unknown`) and that may be missing markers, at most one
    for each, in the markers' order; `missing` has names and aliases of each marker that the file
    lacks.

    A pair needs a likeness of `LIKENESS.least_likeness`, the same side, the same numbers, not the
    opposite of medial and lateral, front and back, upper and lower, radial and ulnar; and each of
    the two must be the other's only best.
    """
    unknown = tuple(unknown)
    pairs = [
        Likeness(name, marker, ratio)
        for marker, spellings in missing.items()
        for name in unknown
        for ratio in [max((_likeness(name, spelling) for spelling in spellings), default=0.0)]
        if ratio >= LIKENESS.least_likeness
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
    if min(len(stem), len(known_stem)) < LIKENESS.shortest_stem:
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
