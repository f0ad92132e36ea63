"""The drafted set as a TOML file, which `gaitval import --marker-set` reads."""

from collections.abc import Iterator
from typing import Final

import tomli_w

from gaitval.scaling.markers.body import MIDDLE
from gaitval.scaling.markers.draft import DRAFT, Draft, Guess
from gaitval.scaling.markers.spines import CRESTS

WEIGHTS: Final = {"ASIS": 5, "PSIS": 5, "Sacrum": 5, "Ankle": 2, "Heel": 2, "MT2": 2}
"""Of the landmarks in inverse kinematics, as in the sets that come with gaitval; others have 1."""

SOFT: Final = {"thigh": 0.5, "torso": 0.5}
"""Of markers that only track these segments."""


UNRECOGNISED: Final = (
    "The body was not recognised, so nothing is used unseen: more than a tenth of the markers are "
    "on no known place, or the person does not stand on both feet."
)
"""Why a draft is only a proposal."""
MIRRORED: Final = (
    "The names agree with the places of the other side, so nothing is used unseen: left and right "
    "are exchanged in the names, or the file is mirrored (its axes are left-handed), which cannot "
    "be told from it. If the file is mirrored, correct it first, by the sign of one axis."
)
"""Likewise."""


def as_toml(draft: Draft, title: str, source: str) -> str:
    """The text of the file: guesses that are certain enough as lines, the others as comments."""
    sure = [guess for guess in draft.guesses if guess.used and guess.site and guess.site.use]
    unsure = [guess for guess in draft.guesses if not guess.used]
    left_out = [guess.name for guess in draft.guesses if guess.used and guess not in sure]
    lines = [
        "# Drafted by `gaitval markers`. Look at the picture beside this file; correct errors.",
        "# Keys: segment; landmark (without one a marker only tracks its segment); weight in",
        "# inverse kinematics; static_only: taken off after standing; optional: may be missing.",
        "",
        f"title = {_quoted(title)}",
        f"source = {_quoted(source)}",
        "",
        "[markers]",
        *(_line(guess, draft) for guess in _in_order(sure)),
    ]
    if unsure:
        why = (
            f"Below {DRAFT.certain:.0%} ({DRAFT.certain_by_name:.0%} where the name says the "
            "same place), or "
            "the name says another place: not used."
            if draft.recognised
            else MIRRORED
            if draft.mirrored
            else UNRECOGNISED
        )
        lines += [
            "",
            f"# {why} Take the # away from those that are right.",
            *(f"# {_line(guess, draft)}" for guess in _in_order(unsure)),
        ]
    if left_out or draft.computed:
        lines += [
            "",
            "# Left out, because gaitval's body has no such segment, or no marker is there:",
        ]
        # A name may have a line break, after which it would be no comment.
        others = [
            name if name.isprintable() else _quoted(name) for name in (*left_out, *draft.computed)
        ]
        lines += [f"# {', '.join(others)}"]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """As TOML, on one line."""
    return tomli_w.dumps({"text": text}).removeprefix("text = ").rstrip("\n")


def _line(guess: Guess, draft: Draft) -> str:
    site = guess.site
    if site is None:
        why = "only the walk has it" if guess.walking_only else "on no known place"
        return f'{_quoted(guess.name)} = {{ segment = "?" }}  # {why}'
    keys = [f"segment = {_quoted(site.segment)}"] if site.use else ['segment = "?"']
    landmark = site.label if draft.by_crests and site.label in CRESTS else site.landmark
    if landmark:
        keys.append(f"landmark = {_quoted(landmark)}")
    weight = WEIGHTS.get(site.name, 1) if site.landmark else SOFT.get(site.part, 1)
    if weight != 1:
        keys.append(f"weight = {weight}")
    if guess.static_only:
        keys.append("static_only = true")
    if site.part in ("torso", "upper_arm", "forearm"):
        keys.append("optional = true")
    name = _quoted(guess.name)
    return f"{name} = {{ {', '.join(keys)} }}  # {sentence_of(guess)}"


def sentence_of(guess: Guess) -> str:
    """The place and its certainty in words."""
    site = "on no known place" if guess.site is None else guess.site.label
    words = f"{site}, {guess.certainty:.0%}"
    if guess.second is not None and not guess.used:
        words += f"; or {guess.second.label}"
    return words + ("; its name says another place" if guess.named is False else "")


def _in_order(guesses: list[Guess]) -> Iterator[Guess]:
    """From the pelvis down and then up, the right side first."""
    parts = ["pelvis", "thigh", "shank", "ankle", "foot", *MIDDLE[1:], "upper_arm", "forearm"]

    def key(guess: Guess) -> tuple[int, int]:
        site = guess.site
        if site is None:
            return (9, 0)
        trunk = site.part in MIDDLE
        return (parts.index(site.part), 0 if trunk else "RL".find(site.side))

    yield from sorted(guesses, key=key)
