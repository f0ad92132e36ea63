"""A marker set drafted for a recording: which marker lies where, from its name and its place."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_set import plain_name
from gaitval_markers.body import Site, sites
from gaitval_markers.frame import apart, stood
from gaitval_markers.match import Match, matched
from gaitval_markers.names import agreement, computed, likelihoods, read_names

CERTAIN: Final = 0.95
"""Least certainty of a guess that is used unseen. Chosen on marker sets that no test and no table of
results contains, so that none of their wrong guesses reaches it."""

NAMES_COUNT: Final = 0.6
"""Share of the names that must say what the places of their markers say; below it the labels are
taken to be exchanged or to mean something else, and only the places count."""

FEWEST: Final = 8
"""Markers without which a body is not recognised: those of legs that gaitval can use."""


@dataclass(frozen=True)
class Guess:
    """What one marker is taken for.

    Attributes
    ----------
    name : of the marker in the file.
    site, second : its place on the body and the next likely one; None: none of those known.
    certainty : probability of its segment and landmark, 0 to 1.
    named : whether its name says the same; None where the name says nothing.
    at : (3,) m in standing, forward, left, up.
    static_only, walking_only : whether only the standing, or only the walking trial has it.
    """

    name: str
    site: Site | None
    second: Site | None
    certainty: float
    named: bool | None
    at: Array
    static_only: bool = False
    walking_only: bool = False

    @property
    def used(self) -> bool:
        """Whether it is used without having been looked at."""
        return self.certainty >= CERTAIN and self.named is not False


@dataclass(frozen=True)
class Draft:
    """A drafted marker set.

    Attributes
    ----------
    guesses : of each marker, in the order of the file; without computed points.
    computed : names of points that a program computed, which are left out.
    names_agree : share of the names that agree with the places; NaN where they say nothing.
    stature : m, of the person, as far as the markers tell.
    moved : whether a walk helped to tell the segments apart.
    """

    guesses: tuple[Guess, ...]
    computed: tuple[str, ...]
    names_agree: float
    stature: float
    moved: bool

    @property
    def names_count(self) -> bool:
        """Whether the names were used."""
        return bool(self.names_agree >= NAMES_COUNT)


def draft_markers(walking: Recording, standing: Recording | None = None) -> Draft:
    """Guess the place of every marker of a walking trial, and of its standing trial.

    Raises RecordError if there are too few markers for a body.
    """
    still = walking if standing is None else standing
    names = list(still.names)
    own = {plain_name(name): name for name in walking.names}
    static_only = {name for name in names if plain_name(name) not in own}
    places = stood(still)
    # What only the walk has cannot be placed on the standing body.
    extra = [n for n in walking.names if plain_name(n) not in {plain_name(name) for name in names}]
    points = [i for i, name in enumerate(names) if not computed(name) and np.isfinite(places[i]).all()]
    if len(points) < FEWEST:
        raise RecordError(
            f"{len(points)} markers are seen, which is too few to recognise a body: "
            f"{', '.join(names[i] for i in points) or 'none'}. At least {FEWEST} are needed, of pelvis, "
            "knees, ankles and feet."
        )
    moves = _moves([plain_name(names[i]) for i in points], walking)
    known = [names[i] for i in points]
    match, agree = _match(known, places[points], moves)
    said = read_names(known)
    guesses = []
    for number, name in enumerate(known):
        site = match.site(number)
        word = said[number]
        named = None if not word.places or agree < NAMES_COUNT else site is not None and word.fits(site)
        second = int(match.second[number])
        guesses.append(
            Guess(
                name,
                site,
                None if second < 0 else match.sites[second],
                float(match.certainty[number]),
                named,
                match.points[number],
                static_only=name in static_only,
            )
        )
    guesses += [
        Guess(name, None, None, 0.0, None, np.full(3, np.nan), walking_only=True)
        for name in extra
        if not computed(name)
    ]
    return Draft(
        tuple(guesses),
        tuple(name for name in names if computed(name)),
        agree,
        match.stature,
        moves is not None,
    )


def _match(names: Sequence[str], places: Array, moves: Array | None) -> tuple[Match, float]:
    """The assignment, with the names if they agree with the places, and how far they do."""
    alone = matched(places, None, moves)
    said = read_names(names)
    agree = agreement(said, {i: alone.site(i) for i in range(len(names))})
    if not agree >= NAMES_COUNT:
        return alone, agree
    return matched(places, likelihoods(said, sites()), moves), agree


def _moves(names: Sequence[str], walking: Recording) -> Array | None:
    """How much the distances of the markers change in the walk, NaN for those that it lacks."""
    found = apart(walking)
    if found is None:
        return None
    column = {plain_name(name): i for i, name in enumerate(walking.names)}
    both = [(i, column[name]) for i, name in enumerate(names) if name in column]
    moves = np.full((len(names), len(names)), np.nan)
    rows, columns = ([pair[k] for pair in both] for k in (0, 1))
    moves[np.ix_(rows, rows)] = found[np.ix_(columns, columns)]
    return moves
