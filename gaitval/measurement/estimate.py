"""Which fault explains what forces and markers of a session say of each other, and how large it is.

The model is linear and Gaussian: data = expected + effect · faults + a person's own pattern +
noise, with all faults small where nothing is wrong (`expected.USUAL`). A hypothesis gives one
fault, or two, the size of a real one; its evidence is the probability of the data under it, and the
sizes are those of the posterior. So a fault is named only if it explains more than others do, and
two are named where the data cannot separate them.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, product
from typing import Final
from zlib import crc32

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import cho_solve
from scipy.special import logsumexp

from gaitval.arrays import Array, Flags
from gaitval.coordinates import SIDES
from gaitval.gait.plate_contacts import USUAL_DELAY
from gaitval.measurement.balance import NEWTON, PRESSURE, Data, PlateTrial, data_of
from gaitval.measurement.expected import USUAL
from gaitval.measurement.likelihood import (
    ALL,
    LEAST_SCALE,
    Balance,
    balance,
    contradiction,
    kind_of,
)
from gaitval.measurement.standing import StandingForces

SUSPECTED: Final = 0.25
FURTHER: Final = 0.03
"""Probability before the data that one given fault is there, and that another is there beside it.
Before Basel was among the laboratories that constants are chosen on: of 12 sound recordings of
these, two have a false warning, from 0.2 to 0.4; of 116 faults planted in four of them (sizes drawn
by seed 7001) four are missed with 0.2, and two from 0.25 on. With a larger second one more causes
are named that are not there: of 42 faults planted in HC002D, four instead of two with 0.1 for
both."""
RARER: Final = {
    "forces low-passed": 0.1, "markers low-passed": 0.1, "rate": 0.15, "fore-aft gain": 0.05,
    "mirrored moment": 0.05, "plate delay": 0.05,
}  # fmt: skip
"""That a file was low-passed below 6 Hz: a setting that somebody chose, not an accident. That its
frame rate is wrong, which the cameras' own program writes; what soft tissue does to the body's
acceleration looks like it. That one channel of a plate is wrong, and its others are not: with 0.1,
one of 27 sound recordings has a false warning of it; of 48 such gains that are 20 % wrong, in 12
people of McGill and Stanford, 23 are named (40 with 0.25). That plates have clocks of their
own, where most laboratories read them with one converter."""
UNSOUND: Final = 0.01
"""Probability that nothing is wrong, below which something is, whatever it be: of 36 sound
recordings that have no warning of a cause, 0.12 at least."""
CERTAIN: Final = 0.5
"""Probability from which on there is a warning."""
DELAYS: Final = tuple(np.arange(-70, 71, 10) / 1000.0)
"""s, those that are tried: beyond, an import refuses the forces (`gait.plate_contacts`)."""
OWN_DELAY: Final = 0.003
"""s, standard deviation of `USUAL_DELAY` between sound recordings."""
LARGEST_LEFT: Final = 2.5
"""Of the covariance that no fault explains: beyond, something else is wrong (markers that jump),
and causes that cannot be distinguished are not named."""
WORSE: Final = 1.15
"""Times the squares of what is left, beyond which a fault is not there: without it, forces and
markers contradict each other more. Of faults planted in 10 recordings, those that were named
rightly leave at most 1.09 times as much, and frame rates that were called wrong in three recordings
with right ones 1.25 to 1.38."""
MOST: Final = 3
"""Faults of a session that are looked for together."""
BEST_PAIRS: Final = 10
"""Pairs of faults beside which a third is looked for."""
SHARED: Final = {
    "gain": "mass",
    "plate delay": "delay",
    "cross-talk": "tilt",
    "place": "place all",
    "rotation": "rotation all",
}
"""Faults of a plate, and what shows the same as that fault of every plate."""


@dataclass(frozen=True)
class Cause:
    """One hypothesis: the faults that are large together."""

    name: str
    parts: tuple[str, ...]

    def __hash__(self) -> int:
        """The same in every process, unlike that of a text: sums over sets of causes are made in
        this order, so an import gives the same bits again.
        """
        return crc32(self.name.encode())


@dataclass(frozen=True)
class FoundFault:
    """A fault that explains the data.

    Attributes
    ----------
    cause : the most probable one.
    values, deviations : of its parts, in the units of `expected.USUAL`.
    probability : that it, or one that cannot be distinguished from it, is there.
    others : what else explains the data nearly as well, with the probability relative to all.
    share : probability of `cause` among all causes.
    """

    cause: Cause
    values: Array
    deviations: Array
    probability: float
    share: float
    others: tuple[tuple[Cause, float], ...]
    matters: bool


@dataclass(frozen=True)
class Examined:
    """What was found of a session.

    Attributes
    ----------
    found : the faults, the most probable first.
    values, deviations : of every fault on its own, beside those found: what it would be.
    data : where the forces were shifted by `delay`.
    delay : s, by which the forces come later than they should.
    model : of `data`.
    lag : how late the forces are if nothing else is wrong.
    weighed : log of the probability of each set of causes, up to a constant.
    undone : axes (0 fore-aft, 1 sideways) of plates whose forces were reversed before, by the
        plates' names.
    """

    found: tuple[FoundFault, ...]
    data: Data
    model: Balance
    delay: float
    lag: "Lag"
    weighed: Mapping[frozenset["Cause"], float]
    undone: Mapping[str, frozenset[int]] = field(default_factory=dict)

    @property
    def sound(self) -> float:
        """Probability that no fault is there, by what was `weighed`."""
        total = float(logsumexp([*self.weighed.values()]))
        return float(np.exp(self.weighed[frozenset()] - total))

    @property
    def unexplained(self) -> tuple["Cause", ...]:
        """The most probable causes, the first first, where something is wrong and none was found
        that stands up; empty else.
        """
        if self.found or (self.sound >= UNSOUND and self.model.left <= LARGEST_LEFT):
            return ()
        best = sorted(self.weighed, key=lambda one: -self.weighed[one])[:BEST_PAIRS]
        named = dict.fromkeys(cause for some in best for cause in sorted(some, key=_name))
        return tuple(named)[:MOST]


def examined(
    trials: Sequence[PlateTrial],
    mass_kg: float,
    height_m: float,
    stood: StandingForces | None = None,
) -> Examined | None:
    """Look for faults in the `trials` of a person of `mass_kg` and `height_m`, who `stood` on
    plates before; None without forces of both feet.

    The effect of a delay is not linear over more than about 10 ms, because load passes from foot
    to foot in a tenth of a second: its evidence is that of a grid of delays. If no other fault
    explains as much, it is taken away and the rest is looked for beside it.
    """
    tried: dict[float, Data] = {}
    for delay in DELAYS:
        data = data_of(trials, mass_kg, later=delay, stood=stood)
        if data is not None:
            tried[delay] = data
    if 0.0 not in tried:
        return None
    among = causes(tried[0.0].names)
    lag = delay_of(tried, height_m)
    linear = balance(tried[0.0], height_m)
    later = data_of(trials, mass_kg, later=lag.value + USUAL_DELAY, stood=stood)
    late = None if later is None else balance(later, height_m)
    weighed = weigh(linear, among, None if late is None else (late, lag))
    if linear.left > LARGEST_LEFT:
        return Examined((), tried[0.0], linear, 0.0, lag, weighed)
    best = max(weighed, key=lambda one: weighed[one])
    if DELAY in best and late is not None and later is not None:
        found = faults_of(weighed, best, late, lag)
        if _left_by_delay(found, (later, late), (tried[0.0], linear), height_m):
            found = standing_up(found, later, late, height_m)
            return Examined(found, later, late, lag.value, lag, weighed)
        weighed = {one: log for one, log in weighed.items() if DELAY not in one}
        best = max(weighed, key=lambda one: weighed[one])
    found = standing_up(faults_of(weighed, best, linear, lag), tried[0.0], linear, height_m)
    return Examined(found, tried[0.0], linear, 0.0, lag, weighed)


@dataclass(frozen=True)
class Lag:
    """How late the forces come.

    Attributes
    ----------
    value, deviation : s.
    log_odds : of the data under a delay as large as real faults, to those under none.
    """

    value: float
    deviation: float
    log_odds: float


def delay_of(tried: Mapping[float, Data], height_m: float) -> Lag:
    """The delay of the forces by the probability of the data with each of those `tried`, s."""
    shared = set.intersection(*({*_keys(data)} for data in tried.values()))
    rows = {
        delay: _kept(data, np.array([key in shared for key in _keys(data)]))
        for delay, data in tried.items()
    }
    models = {
        delay: balance(data, height_m, without=("delay",), scaled=False)
        for delay, data in rows.items()
    }
    scale = max(min(model.left for model in models.values()), LEAST_SCALE)
    logs = []
    for model in models.values():
        lower = model.factor[0]
        size = 2.0 * float(np.log(np.diag(lower)).sum())
        square = float(model.rest @ cho_solve(model.factor, model.rest))
        logs.append(-0.5 * (square / scale + size))
    grid = np.array([*models])
    order = np.argsort(grid)
    fine = np.arange(grid.min(), grid.max() + 1e-9, 0.001)
    log = CubicSpline(grid[order], np.array(logs)[order])(fine)
    log -= log.max()
    usual = USUAL["delay"]
    beside = fine - USUAL_DELAY
    faulty = np.exp(log - 0.5 * (beside / usual.faulty) ** 2)
    sound = np.exp(log - 0.5 * (beside / usual.sound) ** 2)
    value = float((beside * faulty).sum() / faulty.sum())
    deviation = float(np.sqrt(((beside - value) ** 2 * faulty).sum() / faulty.sum()))
    odds = np.log(faulty.sum() / usual.faulty) - np.log(max(sound.sum(), 1e-300) / usual.sound)
    return Lag(value, float(np.hypot(deviation, OWN_DELAY)), float(odds))


def one_foot(data: Data) -> bool:
    """Whether one foot alone was on plates. How its pressure rolls is then the direction of its
    markers as well as that of the plate.
    """
    groups = zip(data.kind, data.group, strict=True)
    return len({group.split()[0] for kind, group in groups if kind in PRESSURE}) < len(SIDES)


def _keys(data: Data) -> list[tuple[str, str, float]]:
    return [*zip(data.kind, data.group, data.phase.round(6).tolist(), strict=True)]


def _kept(data: Data, rows: Flags) -> Data:
    return replace(
        data,
        kind=tuple(np.array(data.kind)[rows]),
        group=tuple(np.array(data.group)[rows]),
        phase=data.phase[rows],
        value=data.value[rows],
        noise=data.noise[rows],
        effect=data.effect[rows],
    )


DELAY: Final = Cause("delay", ("delay",))


def causes(names: Sequence[str]) -> tuple[Cause, ...]:
    """The hypotheses that the faults `names` of a session allow."""
    plates = [name.removeprefix("gain ") for name in names if name.startswith("gain ")]
    found = [
        Cause(n, (n,))
        for n in ("mass", "scale", "rate", "forces low-passed", "markers low-passed")
        if n in names
    ]
    found.append(Cause("tilt", ("tilt forward", "tilt left")))
    found.append(Cause("camera tilt", ("camera tilt left",)))
    for plate in plates:
        found += [
            Cause(f"place {plate}", (f"place x {plate}", f"place y {plate}")),
            Cause(f"rotation {plate}", (f"rotation {plate}",)),
            Cause(f"gain {plate}", (f"gain {plate}",)),
            Cause(f"fore-aft gain {plate}", (f"fore-aft gain {plate}",)),
            Cause(f"cross-talk {plate}", (f"cross-talk x {plate}", f"cross-talk y {plate}")),
            Cause(f"offset {plate}", tuple(f"offset {axis} {plate}" for axis in "xyz")),
            Cause(f"mirrored moment {plate}", (f"mirrored moment {plate}",)),
        ]
    if len(plates) > 1:
        found += [Cause(f"plate delay {p}", (f"plate delay {p}",)) for p in plates]
        found.append(Cause("place all", tuple(f"place {axis} all" for axis in "xy")))
        found.append(Cause("rotation all", ("rotation all",)))
    there = {*names, *(f"{fault} all" for fault in ALL)}
    return tuple(cause for cause in found if there.issuperset(cause.parts))


def standing_up(
    found: Sequence[FoundFault], data: Data, model: Balance, height_m: float
) -> tuple[FoundFault, ...]:
    """Those of the faults `found` in the `data` without which, beside the others, forces and
    markers do not contradict each other more.
    """

    def without(some: Iterable[FoundFault]) -> float:
        return contradiction(data, height_m, model.rest - _explained(some, model))

    whole = without(found)
    return tuple(
        each
        for each in found
        if each.cause is DELAY or whole <= WORSE * without(f for f in found if f is not each)
    )


def _explained(found: Iterable[FoundFault], model: Balance) -> Array:
    """(N,) what faults do to the data, other than a delay."""
    total = np.zeros(len(model.rest))
    for each in found:
        if each.cause is not DELAY:
            at = [model.order[name] for name in each.cause.parts]
            total += model.effects[:, at] @ each.values
    return total


def _left_by_delay(
    found: Sequence[FoundFault],
    shifted: tuple[Data, Balance],
    recorded: tuple[Data, Balance],
    height_m: float,
) -> bool:
    """Whether Newton's law, as it is and beside what everybody shows, holds as well with the forces
    `shifted` by a delay as `recorded`, each without the other faults that were `found`.
    """
    all_of_it, beside = [], []
    for data, model in (shifted, recorded):
        explained = _explained(found, model)
        own = np.where(np.isin(data.kind, NEWTON), data.value, model.rest)
        all_of_it.append(contradiction(data, height_m, own - explained))
        beside.append(contradiction(data, height_m, model.rest - explained))
    return all_of_it[0] <= all_of_it[1] and beside[0] <= WORSE * beside[1]


def weigh(
    model: Balance, among: Sequence[Cause], late: tuple[Balance, Lag] | None
) -> dict[frozenset[Cause], float]:
    """Log of the probability of each set of at most `MOST` causes, up to a constant.

    A delay of the forces is a cause whose evidence is that of the grid; others are weighed beside
    it where it is taken away (`late`).
    """
    weighed = _sets(model, among)
    if late is not None:
        beside, lag = late
        weighed |= {
            one | {DELAY}: lag.log_odds + log
            for one, log in _sets(beside, among).items()
            if len(one) < MOST
        }

    def odds(probability: float) -> float:
        return float(np.log(probability / (1.0 - probability)))

    def prior(some: frozenset[Cause]) -> float:
        if not some:
            return 0.0
        first = min(RARER.get(kind_of(cause.name), SUSPECTED) for cause in some)
        return odds(first) + odds(FURTHER) * (len(some) - 1)

    return {one: log + prior(one) for one, log in weighed.items()}


def faults_of(
    weighed: Mapping[frozenset[Cause], float], best: frozenset[Cause], model: Balance, lag: Lag
) -> tuple[FoundFault, ...]:
    """The faults of the `best` set that are certain, each with what could stand for it."""
    found = []
    causes_ = {cause for one in weighed for cause in one}
    for cause in best:
        without = best - {cause}
        odds = {
            other: float(np.exp(min(weighed[without | {other}] - weighed[without], 500.0)))
            for other in causes_
            if other not in without and without | {other} in weighed
        }
        total = sum(odds.values())
        if total / (1.0 + total) < CERTAIN:
            continue
        if cause is DELAY:
            values, errors = np.array([lag.value]), np.array([lag.deviation])
        else:
            rest = [p for c in without if c is not DELAY for p in c.parts]
            values, covariance = _sizes(model, [*rest, *cause.parts])
            count = len(cause.parts)
            values, errors = values[-count:], np.sqrt(np.diag(covariance)[-count:])
        others = sorted(((c, o / total) for c, o in odds.items() if c != cause), key=_second)
        found.append(
            FoundFault(
                cause, values, errors, total / (1.0 + total), odds[cause] / total,
                tuple(others[:3]), _matters(cause, values, model.reach),
            )
        )  # fmt: skip
    return tuple(sorted(found, key=lambda f: -weighed[frozenset({f.cause})]))


def _matters(cause: Cause, values: Array, reach: float) -> bool:
    """Whether a fault of this size matters: plates that turn as one block also move aside."""
    size = float(np.linalg.norm(values))
    aside = size * reach if cause.name == "rotation all" else 0.0
    return size > USUAL[kind_of(cause.name)].matters or aside > USUAL["place"].matters


def _second(pair: tuple[Cause, float]) -> float:
    return -pair[1]


def _name(cause: Cause) -> str:
    return cause.name


def _sets(model: Balance, among: Sequence[Cause]) -> dict[frozenset[Cause], float]:
    """The evidence of none, of each cause and pair, and of each of the best pairs with a third."""
    plates = sum(cause.name.startswith("gain ") for cause in among)

    def weighed(sets: Iterable[frozenset[Cause]]) -> dict[frozenset[Cause], float]:
        return {one: _of_set(model, one) for one in sets if _apart(one, plates)}

    found = {frozenset[Cause](): 0.0} | weighed(frozenset({cause}) for cause in among)
    pairs = weighed(frozenset(pair) for pair in combinations(among, 2))
    best = sorted(pairs, key=lambda pair: -pairs[pair])[:BEST_PAIRS]
    found |= pairs
    found |= weighed({pair | {cause} for pair in best for cause in among if cause not in pair})
    return found


def _apart(some: frozenset[Cause], plates: int) -> bool:
    """Whether none says what others say together: what all plates have is one cause, and an offset
    under load differs from a gain or from cross-talk only while the load comes and goes.
    """
    names = {cause.name for cause in some}
    for name in names:
        kind, _, plate = name.partition(" ")
        if kind in ("gain", "cross-talk") and f"offset {plate}" in names:
            return False
    for kind, common in SHARED.items():
        own = sum(cause.name.startswith(kind) and cause.name != common for cause in some)
        shared = common in names
        if own + shared > plates or own == plates > 1:
            return False
    return True


def _of_set(model: Balance, some: frozenset[Cause]) -> float:
    """The evidence of a set of causes, each along one axis or along all."""
    ways = [
        [(part,) for part in cause.parts] + ([cause.parts] if len(cause.parts) > 1 else [])
        for cause in some
    ]
    each = [_evidence(model, [p for parts in way for p in parts]) for way in product(*ways)]
    return float(logsumexp(each) - np.log(len(each)))


def _evidence(model: Balance, parts: Sequence[str]) -> float:
    """Log of the probability of the data with these faults as large as real ones, over that with
    none.
    """
    at = [model.order[name] for name in parts]
    prior, mean = model.prior[at], model.mean[at]
    precision = model.precision[np.ix_(at, at)]
    size = np.eye(len(at)) + precision * prior**2
    # about the mean, and of the mean itself
    beside = model.towards[at] - precision @ mean
    of_mean = float(mean @ (model.towards[at] - 0.5 * precision @ mean))
    return of_mean + 0.5 * float(
        (prior**2 * beside) @ np.linalg.solve(size, beside) - np.linalg.slogdet(size)[1]
    )


def _sizes(model: Balance, parts: Sequence[str]) -> tuple[Array, Array]:
    """Posterior mean and covariance of these faults, each with what sound sessions have of it."""
    at = [model.order[name] for name in parts]
    prior, sound = model.prior[at] ** 2, model.sound[at] ** 2
    precision, towards = model.precision[np.ix_(at, at)], model.towards[at]
    both = np.linalg.inv(np.diag(1.0 / prior) + precision)
    # the data's part of the covariance holds what is usual: both together have the prior `whole`
    whole = prior + sound
    seen = np.diag(1.0 / prior) - both / prior[:, None] / prior
    mean = model.mean[at]
    found = mean + whole / prior * (both @ (towards - precision @ mean))
    return found, np.diag(whole) - whole[:, None] * seen * whole


def alone(seen: Examined) -> dict[str, tuple[float, float]]:
    """What each fault would be in the most probable set that has it, with its standard deviation,
    in the units of `expected.USUAL`.
    """
    found: dict[str, tuple[float, float]] = {"delay": (seen.lag.value, seen.lag.deviation)}
    late = any(f.cause is DELAY for f in seen.found)
    for cause in causes(seen.data.names):
        sets = [one for one in seen.weighed if cause in one and (DELAY in one) == late]
        if not sets:  # it was not looked for
            continue
        best = max(sets, key=lambda one: seen.weighed[one])
        parts = [p for c in best if c is not DELAY for p in c.parts]
        values, covariance = _sizes(seen.model, parts)
        for i, name in enumerate(parts):
            if name in cause.parts:
                found[name] = float(values[i]), float(np.sqrt(covariance[i, i]))
    return found


CORRECTED: Final = 2.0
"""Standard deviations beyond which a fault that was not found is corrected where the user asks."""


def together(seen: Examined, kinds: Collection[str]) -> dict[str, float]:
    """Faults of these `kinds` as one set, which explains the session once, in the units of
    `expected.USUAL`: those that were found, and of a kind of which none was, those of each plate
    that are larger than twice their standard deviation. What `one_foot` shows turns no plate.
    """
    if one_foot(seen.data):
        kinds = [kind for kind in kinds if kind != "rotation"]
    found = [part for each in seen.found if each.cause is not DELAY for part in each.cause.parts]
    known = {kind_of(part) for part in found}
    parts = [
        *found,
        *(
            part
            for cause in causes(seen.data.names)
            for part in cause.parts
            if kind_of(part) in kinds and kind_of(part) not in known and not part.endswith(" all")
        ),
    ]
    sizes = {"delay": (seen.lag.value, seen.lag.deviation)}
    if parts:
        values, covariance = _sizes(seen.model, parts)
        sizes |= zip(parts, zip(values, np.sqrt(np.diag(covariance)), strict=True), strict=True)
    found += ["delay"] if any(each.cause is DELAY for each in seen.found) else []
    return {
        part: float(value)
        for part, (value, deviation) in sizes.items()
        if kind_of(part) in kinds and (part in found or abs(value) > CORRECTED * deviation)
    }


def likeness(seen: Examined) -> dict[str, tuple[str, float]]:
    """The fault that looks most like each, and the correlation of their errors, both free."""
    parts = [p for cause in (DELAY, *causes(seen.data.names)) for p in cause.parts]
    _, covariance = _sizes(seen.model, parts)
    size = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(size, size) - np.eye(len(parts))
    best = np.argmax(np.abs(correlation), axis=1)
    return {name: (parts[best[i]], float(correlation[i, best[i]])) for i, name in enumerate(parts)}
