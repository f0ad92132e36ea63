"""Messages about markers that fit no known marker set, or two nearly equally."""

from collections.abc import Sequence

from gaitval.scaling.marker_set import MarkerSet, Score


def undecided(
    one: tuple[MarkerSet, Score], other: tuple[MarkerSet, Score], uncertain: Sequence[str]
) -> str:
    """The message where the sets `one` and `other` fit nearly equally and mean different places by
    the names `uncertain`.
    """
    lines = ["the markers fit two marker sets nearly equally, which mean different places:"]
    lines += [f"  {fit.name} ({fit.title}): {score}" for fit, score in (one, other)]
    lines.append(f"They differ in {', '.join(uncertain)}.")
    lines.append(f"Say which it is: --marker-set {one[0].name} or --marker-set {other[0].name}.")
    return "\n".join(lines)


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
    return (
        f"the {len(names)} markers match no known marker set ({', '.join(builtin)}).\n"
        f"  found: {', '.join(names) or 'none'}\n"
        f"  the nearest is {nearest.name} ({nearest.title}): {score.required - len(score.missing)} "
        f"of {score.required} required markers, at least {least:.0%} are needed; "
        f"its markers missing: {', '.join(score.missing)}\n"
        "If nobody labelled them, or two have one name, or all have the person's name in front "
        "without a colon, label them in the recording program and export again. Else let `gaitval "
        "markers FILE` draft a set from the names, correct it, and give it with --marker-set FILE."
    )
