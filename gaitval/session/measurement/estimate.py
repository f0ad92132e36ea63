"""Which fault explains what forces and markers of a session say of each other, and how large it is.

The model is linear and Gaussian: data = expected + effect · faults + a person's own pattern +
noise, with all faults small where nothing is wrong (`kinds.KINDS`). A set of faults gives each the
size of a real one; its evidence is the probability of the data under it, and the sizes are those of
the posterior. Each fault of the most probable set is weighed beside the others of that set against
every other fault in its place, "none" and "something else" (`gaitval.consistency`).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import cho_solve
from scipy.special import logsumexp

from gaitval.arrays import Array, Flags
from gaitval.consistency import OTHER, SOUND, Change, Verdict, verdict_of
from gaitval.gait.plate_contacts import CONTACTS
from gaitval.session.measurement.balance import PRESSURE, Data, PlateTrial, data_of
from gaitval.session.measurement.kinds import KINDS, Fault, faults, kind_of
from gaitval.session.measurement.likelihood import (
    LEAST_SCALE,
    Balance,
    balance,
    log_sound,
    something_else,
)
from gaitval.session.measurement.standing import StandingForces

DELAYS: Final = tuple(np.arange(-70, 71, 10) / 1000.0)
"""s, those that are tried: beyond, an import refuses the forces (`gait.plate_contacts`)."""
OWN_DELAY: Final = 0.003
"""s, standard deviation of `CONTACTS.usual_delay` between sound recordings."""
MOST: Final = 3
"""Faults of a session that are looked for together."""
BEAM: Final = 10
"""Most probable sets to which one more fault is added."""

LIKELY: Final = 0.65
"""Probability from which on a fault is named though others are not much less probable."""
TOGETHER: Final = 0.7
"""Probability from which on two or three faults are named, of which one is likely."""
FARTHEST: Final = 4.0
"""Standard deviations of real faults, beyond which a size is none of them."""

_Set = frozenset[Fault]
_NOTHING: Final = _Set()


@dataclass(frozen=True)
class FoundFault:
    """What is wrong, beside the other faults of a session.

    Attributes
    ----------
    fault : the most probable one; None for something else.
    values, deviations : of its parts, in the units of `kinds.KINDS`.
    verdict : of it and of all that could stand for it.
    matters : whether it is large enough to speak of.
    """

    fault: Fault | None
    values: Array
    deviations: Array
    verdict: Verdict
    matters: bool

    @property
    def parts(self) -> dict[str, float]:
        """Its sizes by the names of its effects; a delay has one."""
        if self.fault is None:
            return {}
        return dict(zip(self.fault.parts or ("delay",), self.values.tolist(), strict=True))


@dataclass(frozen=True)
class Lag:
    """How late the forces come.

    Attributes
    ----------
    value, deviation : s.
    log_odds : of the data under a delay as large as real faults, to those under none.
    beyond : log odds of the data with the delay undone to those as recorded, beyond `log_odds`.
    """

    value: float
    deviation: float
    log_odds: float
    beyond: float = 0.0


@dataclass(frozen=True)
class Examined:
    """What was found of a session.

    Attributes
    ----------
    found : the faults, the most probable first; what is wrong and is none of them, too.
    data, model : of the session, with the forces shifted by a delay that was found.
    lag : how late the forces are if nothing else is wrong.
    faults : that were looked for.
    weighed : log of the probability of each set of faults, up to a constant.
    """

    found: tuple[FoundFault, ...]
    data: Data
    model: Balance
    lag: Lag
    faults: tuple[Fault, ...]
    weighed: Mapping[_Set, float]


def examined(
    trials: Sequence[PlateTrial],
    mass_kg: float,
    height_m: float,
    stood: StandingForces | None = None,
    legs: float | None = None,
) -> Examined | None:
    """Look for faults in the `trials` of a person of `mass_kg` and `height_m`, who `stood` on
    plates before, and whose `legs` are this long over those expected of the stature; None without
    forces of both feet.

    The effect of a delay is not linear over more than about 10 ms, because load passes from foot
    to foot in a tenth of a second: its evidence is that of a grid of delays, and other faults are
    weighed beside it where it is taken away.
    """
    tried: dict[float, Data] = {}
    for delay in DELAYS:
        data = data_of(trials, mass_kg, later=delay, stood=stood, legs=legs)
        if data is not None:
            tried[delay] = data
    if 0.0 not in tried:
        return None
    lag = delay_of(tried, height_m)
    recorded, shifted = (
        data_of(trials, mass_kg, later=later, stood=stood, legs=legs)
        for later in (CONTACTS.usual_delay, lag.value + CONTACTS.usual_delay)
    )
    if recorded is None:
        return None
    at_once, late = balance(recorded, height_m), None
    if shifted is not None:
        late = balance(shifted, height_m)
        more = _more_than_linear(recorded, shifted, height_m)
        lag = replace(lag, beyond=max(more - lag.log_odds, 0.0))
    search = Search(faults(recorded.names, _feet(recorded)), at_once, late, lag)
    found = search.found()
    delayed = any(each.fault is not None and each.fault.shifts for each in found)
    if delayed and shifted is not None and late is not None:
        return Examined(found, shifted, late, lag, search.faults, search.weighed)
    return Examined(found, recorded, at_once, lag, search.faults, search.weighed)


def _feet(data: Data) -> list[str]:
    """The feet under which a pressure is shown."""
    groups = zip(data.kind, data.group, strict=True)
    return sorted({group.split()[0] for kind, group in groups if kind in PRESSURE})


class Search:
    """Sets of `faults`, weighed by the data as `recorded` and, if one of them is a delay, by those
    in which it is taken away (`late`).
    """

    def __init__(
        self, faults: Sequence[Fault], recorded: Balance, late: Balance | None, lag: Lag
    ) -> None:
        self.faults = tuple(each for each in faults if late is not None or not each.shifts)
        self.recorded, self.late, self.lag = recorded, late, lag
        self.plates = sum(each.kind == "gain" for each in faults)
        self.log_none = float(np.log(1.0 - OTHER.prior - sum(each.prior for each in self.faults)))
        self.weighed = self._weighed()
        other = something_else(recorded) - lag.beyond
        self.other = other + float(np.log(OTHER.prior)) - self.log_none
        self.best = max(self.weighed, key=lambda some: self.weighed[some])
        if self.other > self.weighed[self.best]:
            self.best = _NOTHING

    def _weighed(self) -> dict[_Set, float]:
        """Log of the probability of no fault, of each, and of the most probable sets of more, up to
        a constant.
        """
        found = {_NOTHING: 0.0}
        ahead = [_NOTHING]
        for _ in range(MOST):
            longer = {
                some | {each}
                for some in ahead for each in self.faults
                if each not in some and self.apart(some | {each})
            }  # fmt: skip
            of_longer = {some: self.weight(some) for some in sorted(longer, key=_order)}
            found |= of_longer
            ahead = sorted(of_longer, key=lambda some: -of_longer[some])[:BEAM]
        return found

    def model(self, some: _Set) -> Balance:
        """Of the data without the delay of `some`."""
        delayed = any(each.shifts for each in some)
        return self.late if delayed and self.late is not None else self.recorded

    def weight(self, some: _Set) -> float:
        """Log of the probability of a set over that of none."""
        odds = sum(np.log(each.prior) - self.log_none for each in some)
        for each in some:
            if each.shifts:
                wrong_way = {"late": self.lag.value < 0.0, "early": self.lag.value > 0.0}
                odds += -np.inf if wrong_way.get(each.shifts) else self.lag.log_odds
        found = float(odds) + _of_set(self.model(some), some)
        return found if found < 0.0 or self._plausible(some) else -np.inf

    def _plausible(self, some: _Set) -> bool:
        """Whether all sizes are those of real faults, and what is there whole or not at all is
        there by more than a half.
        """
        parts = _parts(some)
        if not parts:
            return True
        values, _ = _sizes(self.model(some), parts)
        for part, value in zip(parts, values, strict=True):
            kind = KINDS[kind_of(part)]
            if abs(value - kind.mean) > FARTHEST * np.hypot(kind.faulty, kind.sound):
                return False
            if kind.mean and value < kind.matters:
                return False
        return True

    def apart(self, some: _Set) -> bool:
        """Whether none says what others say together: a plate has one wrong channel, what all
        plates have is one fault, and forces have one delay.
        """
        channels = [each.whose for each in some if KINDS[each.kind].channel]
        if len(channels) > 1 and (len(channels) > len({*channels}) or "all" in channels):
            return False
        names = {each.name for each in some}
        for common in {KINDS[each.kind].common for each in some} - {""}:
            own = sum(KINDS[each.kind].common == common and each.name != common for each in some)
            if own + (common in names) > self.plates or own == self.plates > 1:
                return False
        return sum(bool(each.shifts) for each in some) <= 1

    def found(self) -> tuple[FoundFault, ...]:
        """What is wrong: each fault of the best set, or one, by the probabilities of all sets."""
        slots: list[Fault | None] = [*sorted(self.best, key=lambda one: one.name)] or [None]
        some = [self._in_place_of(each) for each in slots]
        known = [each for each in some if each is not None]
        return tuple(sorted(known, key=lambda each: -each.verdict.named[0].probability))

    def _in_place_of(self, fault: Fault | None) -> FoundFault | None:
        """What is wrong in the place of a `fault` of the best set; None if that is not certain.

        Every set counts once: for the fault if it has it, for none if it has only others of the
        best set, and else for that of its further faults which is the most probable alone.
        """
        sets: dict[Fault | None, list[float]] = {}
        for some, log in self.weighed.items():
            further = sorted(some - self.best, key=lambda one: (-self._alone(one), one.name))
            which = fault if fault in some else next(iter(further), None)
            sets.setdefault(which, []).append(log)
        sizes = {
            each: self.size(each, self.best - {fault, each}) for each in sets if each is not None
        }
        logs = [
            (SOUND if each is None else _change(each, *sizes[each]), float(logsumexp(log)))
            for each, log in sets.items()
        ]
        verdict = verdict_of([*logs, (OTHER, self.other)])
        if not verdict.named or _vague(verdict):
            return None
        name = verdict.named[0].change.name
        likeliest = next((each for each in sizes if each.name == name), None)
        if likeliest is None:
            return FoundFault(None, np.empty(0), np.empty(0), verdict, matters=True)
        values, deviations = sizes[likeliest]
        return FoundFault(likeliest, values, deviations, verdict, self._matters(likeliest, values))

    def _alone(self, fault: Fault) -> float:
        return self.weighed[frozenset({fault})]

    def size(self, fault: Fault, others: _Set) -> tuple[Array, Array]:
        """Sizes of the parts of a `fault` beside `others`, and their standard deviations."""
        if not fault.parts:
            return np.array([self.lag.value]), np.array([self.lag.deviation])
        values, covariance = _sizes(self.model(others | {fault}), [*_parts(others), *fault.parts])
        count = len(fault.parts)
        return values[-count:], np.sqrt(np.diag(covariance)[-count:])

    def _matters(self, fault: Fault, values: Array) -> bool:
        """Whether it is large: plates that turn as one block also move aside."""
        size = float(np.linalg.norm(values))
        aside = size * self.recorded.reach if fault.name == "rotation all" else 0.0
        return size > KINDS[fault.kind].matters or aside > KINDS["place"].matters


def _vague(verdict: Verdict) -> bool:
    """Whether many faults are each a little probable, and no few of them explain the data."""
    first, *_ = verdict.named
    return first.probability < LIKELY and sum(each.probability for each in verdict.named) < TOGETHER


def _change(fault: Fault, values: Array, deviations: Array) -> Change:
    kind = KINDS[fault.kind]
    said = fault.said(values, deviations)
    return Change(fault.name, said, fault.prior, kind.remedy, kind.corrected)


def _order(some: _Set) -> list[str]:
    return sorted(each.name for each in some)


def _parts(some: _Set) -> list[str]:
    """The effects of a set, in one order in every process."""
    return [part for each in sorted(some, key=lambda one: one.name) for part in each.parts]


def delay_of(tried: Mapping[float, Data], height_m: float) -> Lag:
    """The delay of the forces by the probability of the data with each of those `tried`, s."""
    models = {
        delay: balance(data, height_m, without=("delay",), scaled=False)
        for delay, data in zip(tried, _alike([*tried.values()]), strict=True)
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
    beside, usual = fine - CONTACTS.usual_delay, KINDS["delay"]
    faulty = np.exp(log - log.max() - 0.5 * (beside / usual.faulty) ** 2)
    sound = np.exp(log - log.max() - 0.5 * (beside / usual.sound) ** 2)
    value = float((beside * faulty).sum() / faulty.sum())
    deviation = float(np.sqrt(((beside - value) ** 2 * faulty).sum() / faulty.sum()))
    odds = np.log(faulty.sum() / usual.faulty) - np.log(max(sound.sum(), 1e-300) / usual.sound)
    return Lag(value, float(np.hypot(deviation, OWN_DELAY)), float(odds))


def _more_than_linear(recorded: Data, shifted: Data, height_m: float) -> float:
    """Log of the probability of the data where they are `shifted` over that as `recorded`: a model
    that is linear in the delay explains less.
    """
    one, other = (balance(data, height_m) for data in _alike([recorded, shifted]))
    scale = max(min(one.left, other.left), LEAST_SCALE)
    return log_sound(other, scale=scale) - log_sound(one, scale=scale)


def _alike(some: Sequence[Data]) -> list[Data]:
    """The data that all of them have."""
    shared = set.intersection(*({*_keys(data)} for data in some))
    return [_kept(data, np.array([key in shared for key in _keys(data)])) for data in some]


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


def _of_set(model: Balance, some: _Set) -> float:
    """The evidence of a set of faults, each along one axis or along all."""
    ways = [
        [(part,) for part in fault.parts] + ([fault.parts] if len(fault.parts) > 1 else [])
        for fault in sorted(some, key=lambda one: one.name)
        if fault.parts
    ]
    each = [_evidence(model, [p for parts in way for p in parts]) for way in product(*ways)]
    return float(logsumexp(each) - np.log(len(each)))


def _evidence(model: Balance, parts: Sequence[str]) -> float:
    """Log of the probability of the data with these faults as large as real ones, over that with
    none.
    """
    if not parts:
        return 0.0
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


def alone(seen: Examined) -> dict[str, tuple[Fault, float, float, float]]:
    """What each part of each fault would be in the most probable set that has it, with its standard
    deviation, in the units of `kinds.KINDS`, and the probability of that fault.
    """
    total = float(logsumexp([*seen.weighed.values()]))
    found = {}
    for fault in seen.faults:
        sets = {some: log for some, log in seen.weighed.items() if fault in some}
        if not sets:  # it was not looked for
            continue
        share = float(np.exp(logsumexp([*sets.values()]) - total))
        best = max(sets, key=lambda one: sets[one])
        values, errors = np.array([seen.lag.value]), np.array([seen.lag.deviation])
        parts = _parts(best)
        if parts and fault.parts:
            of_all, covariance = _sizes(seen.model, parts)
            at = [parts.index(part) for part in fault.parts]
            values, errors = of_all[at], np.sqrt(np.diag(covariance)[at])
        for name, value, error in zip(fault.parts or ("delay",), values, errors, strict=True):
            found[name] = fault, float(value), float(error), share
    return found


def together(seen: Examined, kinds: Collection[str]) -> dict[str, float]:
    """Sizes of the faults of these `kinds` that were found, in the units of `kinds.KINDS`."""
    return {
        part: value
        for each in seen.found if each.fault is not None and each.fault.kind in kinds
        for part, value in each.parts.items()
    }  # fmt: skip
