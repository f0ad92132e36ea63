"""A marker set drafted for a recording: which marker lies where, from its name and its place."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording
from gaitval.scaling.marker_set import plain_name
from gaitval.scaling.markers.body import Site, sites
from gaitval.scaling.markers.forefeet import FOREFOOT
from gaitval.scaling.markers.frame import apart, stands, stood
from gaitval.scaling.markers.match import Match, matched
from gaitval.scaling.markers.names import ParsedName, agreement, computed, likelihoods, read_names
from gaitval.scaling.markers.spines import CRESTS, SPINES, rear_of


@dataclass(frozen=True)
class DraftLimits:
    """When a guess at a marker set is used unseen."""

    certain: float = 0.95
    """Least certainty of a guess that is used unseen. Chosen on marker sets that no test and no
    table of results contains, so that none of their wrong guesses reaches it."""
    certain_by_name: float = 0.8
    """The same where the name says the place and not the next likely one; of the sets on which it
    was chosen all such guesses between the two are right."""
    names_count: float = 0.6
    """Share of the names that must say what the places of their markers say; below it the labels
    are taken to be exchanged or to mean something else, and only the places count."""
    as_likely: float = 15.0
    """How much less likely by its places, as a logarithm, the body of the names may be than the
    likeliest."""
    nowhere_share: float = 0.1
    """Share of the markers on no known place above which the body was not recognised: the person
    may not stand, and nothing is used unseen."""
    of_every_set: float = 0.95
    """Share of marker sets with a marker on a place from which on a body is not recognised without
    one: ASIS (or crests, and what is behind), knee, ankle and heel of both sides, which gaitval
    needs."""
    fewest: int = 8
    """Markers without which a body is not recognised: those of legs that gaitval can use."""


DRAFT: Final = DraftLimits()


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
    recognised : whether the whole body was: of few markers nothing is known.
    alone : whether the place is one of a side and the other side's has no marker.
    rivalled : whether the name says nothing that tells the place from the next likely one.
    """

    name: str
    site: Site | None
    second: Site | None
    certainty: float
    named: bool | None
    at: Array
    static_only: bool = False
    walking_only: bool = False
    recognised: bool = True
    alone: bool = False
    rivalled: bool = True

    @property
    def used(self) -> bool:
        """Whether it is used without having been looked at.

        One that is on no known place never is, nor one whose name does not say so on an arm, on the
        forefoot, or on a place that the other side has no marker on: arms are held in any way, and
        a whole arm may be taken for a shorter or a longer one; a marker on the forefoot may be on
        any metatarsal, as shoes are wide or narrow; and sets of markers are of both sides.
        """
        known = self.recognised and self.named is not False
        least = DRAFT.certain_by_name if self.named and not self.rivalled else DRAFT.certain
        if self.site is None or not known or self.certainty < least:
            return False
        unclear = self.site.part in ("upper_arm", "forearm") or self.site.name in FOREFOOT
        return self.named is True or not (unclear or self.alone)


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
    mirrored : whether all names would agree with the other side's places: the labels of the sides
        are exchanged, or the file is a mirror image, which nothing in it tells apart.
    """

    guesses: tuple[Guess, ...]
    computed: tuple[str, ...]
    names_agree: float
    stature: float
    moved: bool
    mirrored: bool = False

    @property
    def recognised(self) -> bool:
        """Whether the whole body was."""
        return all(guess.recognised for guess in self.guesses)

    @property
    def by_crests(self) -> bool:
        """Whether the anterior spines have no marker, and the crests stand for them."""
        labels = {guess.site.label for guess in self.guesses if guess.site is not None}
        return not labels & set(SPINES) and set(CRESTS) <= labels

    @property
    def names_count(self) -> bool:
        """Whether the names were used."""
        return bool(self.names_agree >= DRAFT.names_count)


@dataclass(frozen=True)
class Places:
    """The markers of a recording, matched to a body by their places alone.

    Attributes
    ----------
    names : of the markers, without computed points.
    computed : names of these.
    points : (N, 3) m in standing, in the axes of the file.
    moves : (N, N) m, how much their distances change in the walk; None without a walk.
    stood : whether somebody stands in the trial that the points are from.
    match : the assignment.
    static_only, walking_only : names of markers that only one of the two trials has.
    """

    names: tuple[str, ...]
    computed: tuple[str, ...]
    points: Array
    moves: Array | None
    stood: bool
    match: Match
    static_only: frozenset[str]
    walking_only: tuple[str, ...]


def draft_markers(walking: Recording, standing: Recording | None = None) -> Draft:
    """Guess the place of every marker of a walking trial, and of its standing trial.

    Raises RecordError if there are too few markers for a body.
    """
    return draft_of(places_of(walking, standing))


def places_of(walking: Recording, standing: Recording | None = None) -> Places:
    """Match the markers to a body by their places alone; raises as `draft_markers`."""
    still = walking if standing is None else standing
    walk, stand = ({plain_name(n): n for n in each.names} for each in (walking, still))
    at = stood(still)
    sums = computed([*still.names, *walking.names])
    kept = [
        i for i, name in enumerate(still.names) if name not in sums and np.isfinite(at[i]).all()
    ]
    names = tuple(still.names[i] for i in kept)
    if len(names) < DRAFT.fewest:
        raise RecordError(
            f"{len(names)} markers are seen, which is too few to recognise a body: "
            f"{', '.join(names) or 'none'}. At least {DRAFT.fewest} are needed, of pelvis, "
            "knees, ankles "
            "and feet."
        )
    moves = _moves([plain_name(name) for name in names], walking)
    return Places(
        names,
        tuple(name for name in still.names if name in sums),
        at[kept],
        moves,
        stands(still),
        matched(at[kept], None, moves),
        frozenset(name for name in names if plain_name(name) not in walk),
        # What only the walk has cannot be placed on the standing body.
        tuple(n for plain, n in walk.items() if plain not in stand and n not in sums),
    )


def draft_of(places: Places) -> Draft:
    """The draft: the names count if a body that they describe is as likely as the one without."""
    parsed = read_names(places.names)
    match, agree = _match(parsed, places)
    guesses = []
    taken = {match.sites[place].label for place in match.chosen if place >= 0}
    # Of a pelvis whose spines have no marker, crests and what is behind tell as much.
    taken |= set(SPINES) if set(CRESTS) <= taken and rear_of(taken) else set()
    whole = all(site.label in taken for site in match.sites if site.there >= DRAFT.of_every_set)
    # The mean of a walk is not a standing person, nor is one known whose knee is not: then names
    # must agree.
    recognised = bool(np.mean(match.chosen < 0) <= DRAFT.nowhere_share) and (
        (places.stood and whole) or agree >= DRAFT.names_count
    )
    on_other_side = {site.label: site for site in match.sites}
    others = {i: site and on_other_side.get(site.mirrored) for i, site in _sites(parsed, match)}
    mirrored = agree < DRAFT.names_count <= agreement(parsed, others)
    recognised = recognised and not mirrored
    for number, (name, word) in enumerate(zip(places.names, parsed, strict=True)):
        site = match.site(number)
        silent = not word.places or agree < DRAFT.names_count
        second = int(match.second[number])
        guesses.append(
            Guess(
                name,
                site,
                None if second < 0 else match.sites[second],
                float(match.certainty[number]),
                None if silent else site is not None and word.fits(site),
                match.points[number],
                static_only=name in places.static_only,
                recognised=recognised,
                alone=site is not None and site.mirrored not in taken,
                rivalled=silent or (second >= 0 and word.fits(match.sites[second])),
            )
        )
    nowhere = np.full(3, np.nan)
    guesses += [
        Guess(name, None, None, 0.0, None, nowhere, walking_only=True)
        for name in places.walking_only
    ]
    moved = places.moves is not None
    return Draft(tuple(guesses), places.computed, agree, match.stature, moved, mirrored)


def _match(parsed: Sequence[ParsedName], places: Places) -> tuple[Match, float]:
    """The assignment, with the names if they agree with it, and the share of those that do."""
    alone = places.match
    agree = _agreement(parsed, alone)
    if np.isnan(agree):
        return alone, agree
    likelihood = likelihoods(parsed, sites())
    if agree >= DRAFT.names_count:
        return matched(places.points, likelihood, places.moves), agree
    # Places alone may have led astray: is the body of the names as likely?
    named = matched(places.points, likelihood, places.moves)
    where = np.flatnonzero(named.chosen >= 0)
    by_places = named.score - float(likelihood[where, named.chosen[where]].sum())
    if _agreement(parsed, named) >= DRAFT.names_count and by_places > alone.score - DRAFT.as_likely:
        return named, _agreement(parsed, named)
    return alone, agree


def _agreement(parsed: Sequence[ParsedName], match: Match) -> float:
    return agreement(parsed, dict(_sites(parsed, match)))


def _sites(parsed: Sequence[ParsedName], match: Match) -> list[tuple[int, Site | None]]:
    return [(i, match.site(i)) for i in range(len(parsed))]


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
