"""Messages about markers that fit no known marker set, or two nearly equally."""

import os
import re
from collections.abc import Sequence
from typing import Final

from gaitval.scaling.marker_set import MarkerSet, Score

MOSTLY: Final = 0.8
"""Share of the names from which on a file is unlabelled."""


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


def unlabelled(names: Sequence[str]) -> str:
    """What is said of `names` that are mostly of nobody's labelling; else empty."""
    bare = [name for name in names if UNLABELLED.fullmatch(name.rpartition(":")[2])]
    if not bare or len(bare) <= MOSTLY * len(names):
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
    return (
        f"the {len(names)} markers match no known marker set ({', '.join(builtin)}).{matches}\n"
        f"  found: {', '.join(names) or 'none'}\n"
        f"  the nearest is {nearest.name} ({nearest.title}): {score.required - len(score.missing)} "
        f"of {score.required} required markers, at least {least:.0%} are needed; "
        f"its markers missing: {', '.join(score.missing)}\n"
        "Let `gaitval markers FILE` draft a set from the names, correct it, and give it with "
        "--marker-set FILE."
    )
