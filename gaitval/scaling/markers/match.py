"""Which marker is on which place of a body: the likeliest assignment, and how certain it is.

The places of `body.py` have one joint normal distribution. An assignment's score is the logarithm
of its likelihood: of the positions under that distribution, of which places have a marker at all,
and of the names. A first assignment comes from each place's own distribution (Hungarian method,
Kuhn 1955) for every stature, direction and way to stand; changes of one marker, of two, or
of a left and right pair then raise the score until none does. A marker's certainty is the
probability of its place against all changes that were tried.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import linear_sum_assignment

from gaitval.arrays import Array, Index
from gaitval.scaling.markers.body import MIDDLE, Population, Site, populations
from gaitval.scaling.markers.forefeet import FOREFOOT, forefeet_excess
from gaitval.scaling.markers.frame import frames_of, middle_of
from gaitval.scaling.markers.nearby import Nearby

STATURES_M: Final = tuple(np.round(np.arange(0.85, 2.1, 0.1), 2))


@dataclass(frozen=True)
class MatchScores:
    """What likely and unlikely places of markers cost, and how long better ones are sought."""

    nowhere: float = -7.0
    """Log density, per m³, of a marker that is on none of the places, its rarity included."""
    crowd: int = 8
    """Most markers of one region, such as those of a cluster on a thigh."""
    another: float = -0.7
    """Log probability of one more marker in a region."""
    one_sided: float = -3.0
    """Log probability that a place has a marker on one side only."""
    temperature: float = 3.0
    """What a difference of scores is divided by for a certainty: real bodies differ from the drawn
    ones, so that the scores say too much."""
    hand_alone: float = -8.0
    """Log probability of markers on forearm or hand of an arm without one on the elbow: who follows
    the forearm marks the elbow, and a wand on a thigh is at the height of a hand that hangs."""
    above_m: float = 0.03
    above: float = -6.0
    """m, and log probability of a marker of the trunk that is further than this above the seventh
    cervical vertebra and both shoulders: what is there is on the head."""
    no_back: float = -4.0
    """Log probability of markers on the pelvis of which none is on a posterior spine or on the
    sacrum: without one of these a pelvis has no frame, and every built-in marker set has one."""
    hard_m: float = 0.008
    spread_m: float = 0.005
    """m. Standard deviation of the distance of two markers of one segment that skin and error
    explain (`SOFT_M`: on these segments), and how much more makes it less likely by a factor of
    e."""
    without: float = -4.0
    """Log probability of a marker on one of these places without the other, which no built-in
    marker set has."""
    facings: int = 6
    """Ways to face, with which axis is up, that are refined."""
    least: float = -10.0
    """Sum of the changes of the score, one marker at a time, from which a change of several is
    tried."""
    hopeless: float = 60.0
    """How far below the best so far an assignment may be after a few changes without being given
    up."""
    near: float = 18.0
    """Difference of scores beyond which a change of one marker alone is not part of a larger
    change."""


SCORES: Final = MatchScores()


SOFT_M: Final = {"thigh": 0.014, "torso": 0.016, "pelvi": 0.010, "upper": 0.012}

BESIDE: Final = {
    "Crest": "ASIS",
    "Fibula": "Knee",
    "Tuberosity": "Knee",
    "Patella": "Knee",
    "Knee.Medial": "Knee",
    "Ankle.Medial": "Ankle",
    "Elbow.Medial": "Elbow",
}
"""Places that have a marker only where another of the same side has one."""


TURNED: Final = float(np.radians(6.0))
"""rad. A person who faces further than this from where they were taken to is matched again."""


@dataclass(frozen=True)
class Match:
    """An assignment of N markers.

    Attributes
    ----------
    sites : all K places.
    chosen : (N,) index of each marker's place; -1: none.
    certainty : (N,) probability from 0 to 1.
    second : (N,) the next likely place; -1: none.
    points : (N, 3) m, axes forward, left, up, the lowest marker near the floor.
    score : logarithm of the likelihood.
    stature : m, of the person as far as the markers tell.
    """

    sites: tuple[Site, ...]
    chosen: Index
    certainty: Array
    second: Index
    points: Array
    score: float
    stature: float

    def site(self, marker: int) -> Site | None:
        """The place of a marker, or None."""
        return None if self.chosen[marker] < 0 else self.sites[self.chosen[marker]]


def matched(points: Array, names: Array | None = None, moves: Array | None = None) -> Match:
    """The likeliest assignment of markers at `points` (N, 3) m of a standing person, in any axes;
    NaN for a marker that was not seen. `names` (N, K) are logarithms of how likely each marker's
    name is for each place, or None; `moves` (N, N) m the standard deviation of the distances in
    walking (`frame.apart`), or None.
    """
    seen = np.flatnonzero(np.isfinite(points).all(axis=1))
    likelihood = None if names is None else names[seen]
    rigid = None if moves is None else moves[np.ix_(seen, seen)]
    starts = sorted(_starts(points[seen], likelihood), key=lambda start: start.cost)
    best: list[tuple[float, Index, _Search, _Start]] = []

    def refine(start: _Start) -> None:
        search = _Search(start.points, start.people, likelihood, rigid)
        so_far = max((each[0] for each in best), default=-np.inf)
        best.append((*search.refined(start.chosen, so_far), search, start))

    # The likeliest of each way to face; then every way to stand of the best, in all statures. Which
    # way that is may be open until then.
    facings = {start.frame: start for start in reversed(starts)}
    for start in sorted(facings.values(), key=lambda start: start.cost)[: SCORES.facings]:
        refine(start)
    top = max(each[0] for each in best)
    likely = {each[3].frame for each in best if each[0] > top - SCORES.hopeless / 2}
    tried = {(each[3].frame, each[3].chosen.tobytes()) for each in best}
    for start in starts:
        if start.stature not in STATURES_M[::2]:  # those between lead to the same bodies
            continue
        key = (start.frame, start.chosen.tobytes())
        if start.frame in likely and key not in tried:
            tried.add(key)
            refine(start)
    # With a foot turned or ahead nobody is a mirror image: what was found says how they face.
    _, chosen, search, started = max(best, key=lambda each: each[0])
    yaw = search.yaw(chosen)
    if abs(yaw) > TURNED:
        turned = started.rotation_by(yaw)
        again = sorted(
            _starts(points[seen], likelihood, [(turned, 0.0)]), key=lambda start: start.cost
        )
        for start in again[: SCORES.facings]:
            refine(start)
    score, chosen, search, _ = max(best, key=lambda each: each[0])
    certainty, second = search.certainties(score, chosen)
    # The same person, taken to face the other way or to hold the arms otherwise.
    for other_score, other_chosen, other, _ in best:
        if other is not search:
            chance = np.exp(min((other_score - score) / SCORES.temperature, 0.0))
            differ = search.outputs(chosen) != other.outputs(other_chosen)
            certainty = np.where(differ, certainty / (1.0 + chance * certainty), certainty)
            worse = differ & (chance > (1.0 - certainty) / 2)
            second = np.where(worse, other_chosen, second)
    count = len(points)
    whole = np.full(count, -1), np.zeros(count), np.full(count, -1), np.full((count, 3), np.nan)
    for all_of, some in zip(whole, (chosen, certainty, second, search.points), strict=True):
        all_of[seen] = some
    return Match(search.people.sites, *whole, score, search.stature(chosen))


@dataclass(frozen=True)
class _Start:
    """A first assignment: its cost, which frame, its rotation, way to stand and stature, the placed
    points, the people of that way, the place of each marker.
    """

    cost: float
    frame: int
    rotation: Array
    pose: str
    stature: float
    points: Array
    people: Population
    chosen: Index

    def rotation_by(self, yaw: float) -> Array:
        """The rotation of the frame of somebody who faces further to the left by `yaw`, rad."""
        cos, sin = np.cos(yaw), np.sin(yaw)
        return np.asarray(np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) @ self.rotation)


def _starts(
    points: Array, names: Array | None, frames: Sequence[tuple[Array, float]] = ()
) -> Iterator[_Start]:
    """First assignments, in given `frames` or in all that the points may have."""
    frames = frames or list(frames_of(points))
    least = min(misfit for _, misfit in frames)
    for number, (rotation, misfit) in enumerate(frames):
        if misfit > 2.0 * least + 0.03:
            continue
        turned = points @ rotation.T
        turned[:, 1] -= middle_of(turned[:, 1])
        tall = np.ptp(turned[:, 2])
        for pose, people in populations().items():
            for stature in STATURES_M:
                # The highest marker is on the pelvis or above, and below the crown.
                if not 0.5 * stature < tall < 1.25 * stature:
                    continue
                placed, mean, spread = _at_stature(turned, people, stature)
                cost, assigned = _first(placed, people, mean, spread, names)
                yield _Start(cost, number, rotation, pose, stature, placed, people, assigned)


def _at_stature(turned: Array, people: Population, stature: float) -> tuple[Array, Array, Array]:
    """Points put on the floor under a body of this stature, with its places' mean and spread."""
    shared = people.shared
    size = shared[-1, -1]
    gain = shared[:-1, -1] / size
    middle = 1.55
    mean = people.mean + (gain * (stature - middle)).reshape(-1, 3)
    index = np.arange(len(people.sites))
    blocks = shared[:-1, :-1].reshape(len(index), 3, len(index), 3)[index, :, index, :]
    spread = blocks - np.einsum("ki,kj->kij", gain.reshape(-1, 3), gain.reshape(-1, 3)) * size
    placed = turned.copy()
    placed[:, 2] += 0.016 * stature - np.sort(placed[:, 2])[:2].mean()
    low = placed[:, 2] < 0.08 * stature
    feet = [k for k, site in enumerate(people.sites) if site.part == "foot" and not site.many]
    placed[:, 0] += mean[feet, 0].mean() - placed[low, 0].mean()
    return placed, mean, spread + people.own


def _first(
    placed: Array, people: Population, mean: Array, spread: Array, names: Array | None
) -> tuple[float, Index]:
    """Cost and assignment by each place's own distribution."""
    inverse = np.linalg.inv(spread)
    apart = placed[:, None] - mean[None]
    log = -0.5 * np.einsum("nki,kij,nkj->nk", apart, inverse, apart)
    log = log - 0.5 * np.linalg.slogdet(spread)[1] - 1.5 * np.log(2 * np.pi)
    there = np.array([_presence(site) for site in people.sites])
    gain = log + there + (0.0 if names is None else names)
    columns = np.concatenate(
        [np.full(SCORES.crowd if site.many else 1, k) for k, site in enumerate(people.sites)]
    )
    table = np.hstack([gain[:, columns], np.full((len(placed), len(placed)), SCORES.nowhere)])
    row, column = linear_sum_assignment(-table)
    chosen = np.full(len(placed), -1)
    inside = column < len(columns)
    chosen[row[inside]] = columns[column[inside]]
    return -float(table[row, column].sum()), chosen


def _part(site: Site) -> str:
    """What moves as one body, with its side."""
    part = {"ankle": "shank"}.get(site.part, site.part)
    part = site.name if site.name == "Hand" else part
    return part if part in MIDDLE else f"{part}_{site.side}"


NEXT: Final = frozenset(
    tuple(pair.split())
    for pair in (
        "pelvis thigh",
        "thigh shank",
        "shank foot",
        "pelvis torso",
        "torso upper_arm",
        "upper_arm forearm",
        "torso head",
        "forearm Hand",
    )
)
"""Neighbours, of which a marker near the joint belongs to either by its distances."""


def _far(one: str, other: str) -> bool:
    """Whether two parts are not the same and not neighbours of one side."""
    (first, _, side), (second, _, across) = (
        (each, "", "") if "_" not in each else each.rpartition("_") for each in (one, other)
    )
    if one == other:
        return False
    neighbours = (first, second) in NEXT or (second, first) in NEXT
    return not (neighbours and (side == across or "" in (side, across)))


def _presence(site: Site) -> float:
    return SCORES.another if site.many else float(np.log(site.there / (1.0 - site.there)))


class _Search:
    """Changes of an assignment of placed points until none raises its score."""

    def __init__(
        self, points: Array, people: Population, names: Array | None, moves: Array | None
    ) -> None:
        self.points = points
        self.people = people
        self.names = np.zeros((len(points), len(people.sites))) if names is None else names
        count = len(people.sites)
        self.many = np.array([site.many for site in people.sites])
        self.presence = np.array([_presence(site) for site in people.sites])
        labels = {site.label: k for k, site in enumerate(people.sites)}
        self.mirror = np.array(
            [labels.get(site.mirrored, k) for k, site in enumerate(people.sites)]
        )
        self.shared = people.shared[:-1, :-1].reshape(count, 3, count, 3)
        self.size = people.shared[-1, :-1].reshape(count, 3)
        self.tried: dict[bytes, float] = {}
        parts = [_part(site) for site in people.sites]
        self.same = np.array([[one == other for other in parts] for one in parts])
        self.far = np.array([[_far(one, other) for other in parts] for one in parts])
        self.loose = np.array([SOFT_M.get(part[:5], SCORES.hard_m) for part in parts])
        self.moves = None if moves is None else np.where(np.isfinite(moves), moves, -1.0)
        if self.moves is not None:
            self.known = (self.moves >= 0.0) & ~np.eye(len(points), dtype=bool)
        self.arms = [
            (
                np.array([site.side == side and site.part == "forearm" for site in people.sites]),
                np.array([site.label == f"{side}.Elbow" for site in people.sites]),
            )
            for side in "RL"
        ]
        top = ("C7", "R.Acromion", "L.Acromion")
        self.top = np.array([site.label in top for site in people.sites])
        self.trunk = np.array([site.name == "Torso" for site in people.sites])
        back = ("R.PSIS", "L.PSIS", "Sacrum")
        self.back = np.array([site.label in back for site in people.sites])
        self.pelvis = np.array([site.name in ("ASIS", "Pelvis") for site in people.sites])
        self.beside = np.array(
            [
                (k, labels[f"{site.side}.{BESIDE[site.name]}"])
                for k, site in enumerate(people.sites)
                if site.name in BESIDE
            ]
        )
        self.fore = np.zeros((2, count), dtype=np.int64)
        for number, name in enumerate(FOREFOOT):
            for side in range(2):
                self.fore[side, labels[f"{'RL'[side]}.{name}"]] = 1 << number
        self.forefoot = forefeet_excess(self.presence[self.fore[0] > 0])
        outputs = [(site.segment, site.landmark) for site in people.sites]
        kinds = {each: number for number, each in enumerate(dict.fromkeys([*outputs, ("", None)]))}
        self.kind = np.array([*(kinds[each] for each in outputs), kinds["", None]])

    def outputs(self, chosen: Index) -> Index:
        """(N,) a number for each marker's segment and landmark."""
        return np.asarray(self.kind[chosen])

    def stature(self, chosen: Index) -> float:
        """m, conditional mean."""
        who = np.flatnonzero(chosen >= 0)
        factor, off = self._gauss(who, chosen[who])
        return float(1.55 + self.size[chosen[who]].ravel() @ cho_solve(factor, off))

    def yaw(self, chosen: Index) -> float:
        """rad, by how much the markers on places of one marker are turned to the left from where
        those places are on average.
        """
        who = np.flatnonzero((chosen >= 0) & ~self.many[chosen])
        mean = self.people.mean[chosen[who], :2]
        mean, at = (each - each.mean(axis=0) for each in (mean, self.points[who, :2]))
        across = mean[:, 0] * at[:, 1] - mean[:, 1] * at[:, 0]
        return float(np.arctan2(across.sum(), (mean * at).sum()))

    def _gauss(self, who: Index, where: Index) -> tuple[tuple[Array, bool], Array]:
        covariance = self.shared[where][:, :, where, :].copy()
        index = np.arange(len(where))
        covariance[index, :, index, :] += self.people.own[where]
        size = 3 * len(where)
        off = (self.points[who] - self.people.mean[where]).ravel()
        return cho_factor(
            covariance.reshape(size, size), lower=True, overwrite_a=True, check_finite=False
        ), off

    def nearby(self, chosen: Index) -> Nearby:
        """Densities near an assignment."""
        who = np.flatnonzero(chosen >= 0)
        return Nearby(self.points, self.people, chosen, *self._gauss(who, chosen[who]))

    def score(self, chosen: Index, near: Nearby | None = None) -> float:
        """Log likelihood of an assignment, `near` another if given."""
        key = chosen.tobytes()
        if key not in self.tried:
            who = np.flatnonzero(chosen >= 0)
            where = chosen[who]
            fit = self._density(who, where) if near is None else near.log_density(chosen)
            named = self.names[who, where].sum() + SCORES.nowhere * (len(chosen) - len(who))
            prior = self.presence[where].sum() + self._sided(where) + self._above(who, where)
            self.tried[key] = float(fit + named + prior + self._rigid(who, where))
        return self.tried[key]

    def _density(self, who: Index, where: Index) -> float:
        """Log density of the positions of markers on places."""
        factor, off = self._gauss(who, where)
        fit = -0.5 * off @ cho_solve(factor, off, check_finite=False)
        return float(fit - np.log(np.diag(factor[0])).sum() - 0.5 * len(off) * np.log(2 * np.pi))

    def _rigid(self, who: Index, where: Index) -> float:
        """Log likelihood of the distances: fixed within a segment, and only there."""
        if self.moves is None:
            return 0.0
        if len(who) == len(self.moves):
            moves, known = self.moves, self.known
        else:
            moves, known = self.moves[np.ix_(who, who)], self.known[np.ix_(who, who)]
        same = self.same[where[:, None], where] & known
        excess = np.clip((moves - self.loose[where][:, None]) / SCORES.spread_m, 0.0, 6.0) * same
        within = excess.sum(axis=1) / np.maximum(same.sum(axis=1), 1)
        far = self.far[where[:, None], where] & known & (moves < SCORES.hard_m)
        return float(-within.sum() - 1.5 * np.minimum(far.sum(axis=1), 2).sum())

    def _sided(self, where: Index) -> float:
        used = np.zeros(len(self.presence), dtype=bool)
        used[where[~self.many[where]]] = True
        found = SCORES.one_sided * float((used & ~used[self.mirror]).sum())
        there = np.zeros(len(self.presence), dtype=bool)
        there[where] = True
        place, other = self.beside.T
        found += SCORES.without * float((there[place] & ~there[other]).sum())
        for side in self.fore:
            found += float(self.forefoot[int(side[there].sum())])
        for hand, arm in self.arms:
            if (there & hand).any() and not (there & arm).any():
                found += SCORES.hand_alone
        if there[self.pelvis].any() and not there[self.back].any():
            found += SCORES.no_back
        return found

    def _above(self, who: Index, where: Index) -> float:
        """Log probability of markers of the trunk above the neck."""
        top = self.points[who[self.top[where]], 2]
        high = self.points[who[self.trunk[where]], 2]
        return SCORES.above * float((high > top.max() + SCORES.above_m).sum()) if len(top) else 0.0

    def alone(self, near: Nearby) -> Array:
        """(N, K + 1) log likelihood of each marker on each place, all others as they are; last: on
        none. Without what depends on the places of the others: presence only.
        """
        found = np.full((len(self.points), len(self.people.sites) + 1), SCORES.nowhere)
        for marker, named in enumerate(self.names):
            found[marker, :-1] = near.everywhere(marker) + named + self.presence
        return found

    def changes(self, near: Nearby, least: float = SCORES.least) -> Iterator[Index]:
        """Assignments that differ from that of `near` by a plausible change: one that would raise
        the score by `least` or more if each of its markers were changed alone.
        """
        chosen = near.chosen
        alone = self.alone(near)
        for changed in self._changes(chosen, alone):
            moved = np.flatnonzero(changed != chosen)
            gain = alone[moved, changed[moved]] - alone[moved, chosen[moved]]
            if gain.sum() > least:
                yield changed

    def _changes(self, chosen: Index, alone: Array) -> Iterator[Index]:
        now = alone[np.arange(len(chosen)), chosen]
        holder = {int(k): i for i, k in enumerate(chosen) if k >= 0 and not self.many[k]}
        plausible = [
            np.flatnonzero(row > here - SCORES.near) for row, here in zip(alone, now, strict=True)
        ]

        def free(marker: int, taken: set[int]) -> int:
            """The best place of a marker whose own was taken."""
            for k in np.argsort(-alone[marker]):
                place = int(k) if k < len(self.presence) else -1
                if place < 0 or self.many[place] or (place not in holder and place not in taken):
                    return place
            return -1

        def put(pairs: Mapping[int, int]) -> Index:
            changed = chosen.copy()
            for marker, place in pairs.items():
                changed[marker] = place
            return changed

        def other_side(marker: int) -> int | None:
            place = int(chosen[marker])
            if place < 0 or self.many[place] or self.mirror[place] == place:
                return None
            return holder.get(int(self.mirror[place]))

        for marker in range(len(chosen)):
            old = int(chosen[marker])
            for k in plausible[marker]:
                place = int(k) if k < len(self.presence) else -1
                if place == old:
                    continue
                taker = holder.get(place) if place >= 0 else None
                moves: dict[int, int] = {marker: place}
                if taker is not None:
                    yield put(moves | {taker: old})
                    elsewhere = free(taker, {place})
                    if elsewhere != old:
                        yield put(moves | {taker: elsewhere})
                else:
                    yield put(moves)
                twin = other_side(marker)
                if twin is None or twin == taker or place < 0:
                    continue
                across = int(self.mirror[place])
                both = moves | {twin: across}
                if taker is not None:
                    both |= {taker: old}
                kept = holder.get(across) if not self.many[across] else None
                if kept is not None and kept not in both:
                    both |= {kept: int(chosen[twin])}
                yield put(both)
                if taker is not None or kept is not None:
                    gone = {
                        each: free(each, {place, across})
                        for each in (taker, kept)
                        if each is not None and each not in (marker, twin)
                    }
                    yield put(both | gone)

    def refined(self, chosen: Index, best: float) -> tuple[float, Index]:
        """The best assignment that changes lead to, with its score; given up where it stays far
        below the score `best`.
        """
        score = self.score(chosen)
        for turn in range(40):
            if turn > 3 and score < best - SCORES.hopeless:
                break
            near = self.nearby(chosen)
            better = sorted(
                (
                    (found, each)
                    for each in self.changes(near)
                    for found in [self.score(each, near)]
                    if found > score + 1e-6
                ),
                key=lambda pair: -pair[0],
            )
            if not better:
                break
            # All improvements that still are one after those before them.
            start = chosen
            for _, each in better:
                together = chosen.copy()
                changed = each != start
                if (chosen[changed] != start[changed]).any():
                    continue
                together[changed] = each[changed]
                if self._twice(together):
                    continue
                found = self.score(together)
                if found > score:
                    score, chosen = found, together
        return score, chosen

    def _twice(self, chosen: Index) -> bool:
        """Whether a place for one marker has two."""
        single = chosen[chosen >= 0]
        single = single[~self.many[single]]
        return len(np.unique(single)) < len(single)

    def certainties(self, score: float, chosen: Index) -> tuple[Array, Index]:
        """(N,) probability of each marker's segment and landmark, and its next likely place."""
        mine = self.outputs(chosen)
        odds = np.zeros(len(chosen))
        top = np.full(len(chosen), -np.inf)
        second = np.full(len(chosen), -1, dtype=np.int64)
        weight: dict[tuple[int, int], float] = {}
        near = self.nearby(chosen)
        for each in self.changes(near, -SCORES.near):
            gap = self.score(each, near) - score
            for marker in np.flatnonzero(self.outputs(each) != mine):
                key = (int(marker), int(self.outputs(each)[marker]))
                weight[key] = max(weight.get(key, -np.inf), gap)
                if gap > top[marker]:
                    top[marker] = gap
                    second[marker] = int(each[marker])
        for (which, _), gap in weight.items():
            odds[which] += np.exp(gap / SCORES.temperature)
        return 1.0 / (1.0 + odds), second
