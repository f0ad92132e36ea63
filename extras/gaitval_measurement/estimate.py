"""Which fault explains what forces and markers of a session say of each other, and how large it is.

The model is linear and Gaussian: data = expected + effect · faults + a person's own pattern +
noise, with all faults small where nothing is wrong (`expected.USUAL`). A hypothesis gives one
fault, or two, the size of a real one; its evidence is the probability of the data under it, and the
sizes are those of the posterior. So a fault is named only if it explains more than others do, and
two are named where the data cannot separate them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import cho_factor, cho_solve

from gaitval.arrays import Array, Flags
from gaitval.model.body import BodyModel
from gaitval.session.trial import WalkingTrial
from gaitval_measurement.balance import NEWTON, PRESSURE, Data, data_of, trials_of
from gaitval_measurement.expected import (
    ACCELERATION,
    AMPLITUDES,
    LEAST_ACCELERATION,
    NUISANCE,
    OWN_BIN,
    SAME_FOOT,
    SAME_PERSON,
    STANCE_LENGTH,
    STRIDE_LENGTH,
    USUAL,
    expected,
    spread,
)

SUSPECTED: Final = 0.15
"""Probability before the data that one given fault is there."""
CERTAIN: Final = 0.8
"""Probability from which on there is a warning."""
ALL: Final = ("place x", "place y", "rotation")
"""Faults that all plates may have together: the cameras' axes are not those of the plates."""
DELAYS: Final = tuple(np.arange(-70, 71, 10) / 1000.0)
"""s, those that are tried: beyond, an import refuses the forces (`gait.plate_contacts`)."""
USUAL_DELAY: Final = 0.003
OWN_DELAY: Final = 0.003
"""s. The forces of sound recordings come this much later than the markers (mean and SD; soft tissue
moves before the bones, and force channels have filters)."""
LEAST_SCALE: Final = 0.6
"""Of the covariance, where a session is more regular than others."""
LARGEST_LEFT: Final = 2.5
"""Of the covariance that no fault explains: beyond, something else is wrong (markers that jump),
and what cannot be told apart is not named."""
MOST: Final = 3
"""Faults of a session that are looked for."""


@dataclass(frozen=True)
class Cause:
    """One hypothesis: the faults that are large together."""

    name: str
    parts: tuple[str, ...]


@dataclass(frozen=True)
class Found:
    """A fault that explains the data.

    Attributes
    ----------
    cause : the most probable one.
    values, deviations : of its parts, in the units of `expected.USUAL`.
    probability : that it, or one of those it cannot be told from, is there.
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
    """

    found: tuple[Found, ...]
    data: Data
    model: "Balance"
    delay: float
    lag: "Lag"


def examined(
    model: BodyModel, walks: Sequence[WalkingTrial], mass_kg: float, height_m: float
) -> Examined | None:
    """Look for faults in the trials (`walks`) of a person of `mass_kg` and `height_m` on their
    `model`; None without forces of both feet.

    The effect of a delay is not linear over more than about 10 ms, because load passes from foot
    to foot in a tenth of a second: its evidence is that of a grid of delays. If no other fault
    explains as much, it is taken away first and the rest is looked for.
    """
    trials = trials_of(model, walks)
    tried: dict[float, Data] = {}
    for delay in DELAYS:
        data = data_of(trials, mass_kg, later=delay)
        if data is not None:
            tried[delay] = data
    if 0.0 not in tried:
        return None
    among = causes(tried[0.0].names)
    lag = delay_of(tried, height_m)
    linear = balance(tried[0.0], height_m)
    if linear.left > LARGEST_LEFT:
        return Examined((), tried[0.0], linear, 0.0, lag)
    found = search(linear, among, lag=lag)
    if not found or found[0].cause.name != "delay":
        return Examined(tuple(found), tried[0.0], linear, 0.0, lag)
    data = data_of(trials, mass_kg, later=lag.value + USUAL_DELAY)
    if data is None:
        return Examined(tuple(found), tried[0.0], linear, 0.0, lag)
    linear = balance(data, height_m)
    rest = search(linear, among, most=MOST - 1)
    return Examined((found[0], *rest), data, linear, lag.value, lag)


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


def kind_of(name: str) -> str:
    """The kind of a fault, of the names of `USUAL`."""
    return next(kind for kind in USUAL if name.startswith(kind))


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
    for plate in plates:
        found += [
            Cause(f"place {plate}", (f"place x {plate}", f"place y {plate}")),
            Cause(f"rotation {plate}", (f"rotation {plate}",)),
            Cause(f"gain {plate}", (f"gain {plate}",)),
            Cause(f"cross-talk {plate}", (f"cross-talk x {plate}", f"cross-talk y {plate}")),
            Cause(f"offset {plate}", tuple(f"offset {axis} {plate}" for axis in "xyz")),
        ]
    if len(plates) > 1:
        found.append(Cause("place all", tuple(f"place {axis} all" for axis in "xy")))
        found.append(Cause("rotation all", ("rotation all",)))
    there = {*names, *(f"{fault} all" for fault in ALL)}
    return tuple(cause for cause in found if there.issuperset(cause.parts))


@dataclass(frozen=True)
class Balance:
    """The linear model of a session: what is left of the data, its covariance, and the effects."""

    rest: Array
    factor: tuple[Array, bool]
    effects: Mapping[str, Array]
    left: float


def balance(
    data: Data, height_m: float, *, without: Sequence[str] = (), scaled: bool = True
) -> Balance:
    """The model of `data` of a person of `height_m`, with all faults as small as usual, but for
    those `without`; not `scaled` to what no fault explains, the covariance is that of everybody.
    """
    kinds = np.array(data.kind)
    mean = np.zeros(len(kinds))
    deviation = np.zeros(len(kinds))
    size = _acceleration(data, kinds)
    for kind in set(data.kind):
        mine = kinds == kind
        mean[mine] = expected(kind, data.phase[mine], height_m, size)
        deviation[mine] = spread(kind, data.phase[mine], height_m)
    own = np.where(np.isin(kinds, PRESSURE), OWN_BIN * deviation, 0.0)
    covariance = _patterns(data, deviation) + np.diag(data.noise**2 + own**2)
    effects = {name: data.effect[:, i] for i, name in enumerate(data.names)}
    plates = [name.removeprefix("gain ") for name in data.names if name.startswith("gain ")]
    for fault in ALL:
        effects[f"{fault} all"] = np.sum([effects[f"{fault} {p}"] for p in plates], axis=0)
    if plates:
        # The plates turn as one block, so each also moves.
        middle = np.mean([data.middles[p] for p in plates], axis=0)
        for p in plates:
            x, y, _ = data.middles[p] - middle
            effects["rotation all"] = (
                effects["rotation all"] - y * effects[f"place x {p}"] + x * effects[f"place y {p}"]
            )
    for name, effect in effects.items():
        if name.endswith(" all"):
            continue
        usual = NUISANCE[name] if name in NUISANCE else USUAL[kind_of(name)].sound
        if usual == 0.0 or name in without:
            continue
        if name.startswith(AMPLITUDES):
            usual *= max(ACCELERATION / size, 1.0)
        covariance += usual**2 * np.outer(effect, effect)
    rest = data.value - mean
    open_ = covariance.copy()
    for name, effect in effects.items():
        if name not in NUISANCE:
            open_ += USUAL[kind_of(name)].faulty ** 2 * np.outer(effect, effect)
    left = float(rest @ cho_solve(cho_factor(open_, lower=True), rest)) / len(rest)
    # What no fault explains is a person's own, larger than others'.
    if scaled:
        covariance *= max(left, LEAST_SCALE)
    return Balance(rest, cho_factor(covariance, lower=True), effects, left)


def _acceleration(data: Data, kinds: Array) -> float:
    """Root mean square of the centre of mass's acceleration, over gravity; that of other sessions
    if the data do not show it.
    """
    if "rate" not in data.names or not np.isin(kinds, NEWTON[:3]).any():
        return ACCELERATION
    # a rate that is wrong by a half adds the acceleration once more
    walk = 0.5 * data.effect[:, data.names.index("rate")]
    parts = [(walk[kinds == kind] ** 2).mean() for kind in NEWTON[:3] if (kinds == kind).any()]
    return max(float(np.sqrt(np.sum(parts))), LEAST_ACCELERATION)


def _patterns(data: Data, deviation: Array) -> Array:
    """Covariance of what is a person's own."""
    kinds, groups = np.array(data.kind), np.array(data.group)
    apart = np.abs(data.phase[:, None] - data.phase)
    newton = np.isin(kinds, NEWTON)
    round_trip = np.minimum(apart, 1.0 - apart)
    length = np.where(newton[:, None], STRIDE_LENGTH, STANCE_LENGTH)
    distance = np.where(newton[:, None], round_trip, apart)
    alike = np.exp(-0.5 * (distance / length) ** 2)
    alike *= kinds[:, None] == kinds
    sides = np.array([group.partition(" ")[0] for group in data.group])
    alike *= np.where(sides[:, None] == sides, 1.0, SAME_PERSON)
    alike *= np.where(
        groups[:, None] == groups, 1.0, np.where(sides[:, None] == sides, SAME_FOOT, 1.0)
    )
    return np.asarray(alike * np.outer(deviation, deviation))


def search(
    model: Balance, among: Sequence[Cause], *, lag: Lag | None = None, most: int = MOST
) -> list[Found]:
    """The faults of a session, the most probable first: each is looked for beside those found
    before. A delay (`lag`) is looked for in the first place only; the search ends with it.
    """
    found: list[Found] = []
    taken: list[Cause] = []
    while len(found) < most:
        base, _, _ = _evidence(model, [p for c in taken for p in c.parts])
        rows = []
        for cause in among:
            if cause in taken or any(set(cause.parts) & set(other.parts) for other in taken):
                continue
            parts = [p for c in (*taken, cause) for p in c.parts]
            log, values, covariance = _evidence(model, parts)
            rows.append((log - base, cause, values, covariance))
        if lag is not None and not found:
            late = np.array([[lag.deviation**2]])
            rows.append((lag.log_odds, DELAY, np.array([lag.value]), late))
        odds = SUSPECTED / (1.0 - SUSPECTED) * np.exp(np.minimum([row[0] for row in rows], 500.0))
        probability = float(odds.sum() / (1.0 + odds.sum()))
        order = np.argsort(-odds)
        log, cause, values, covariance = rows[order[0]]
        if probability < CERTAIN:
            break
        count = len(cause.parts)
        own, errors = values[-count:], np.sqrt(np.diag(covariance)[-count:])
        size = float(np.linalg.norm(own))
        others = tuple((rows[i][1], float(odds[i] / odds.sum())) for i in order[1:4])
        found.append(
            Found(
                cause,
                own,
                errors,
                probability,
                float(odds[order[0]] / odds.sum()),
                others,
                size > USUAL[kind_of(cause.name)].matters,
            )
        )
        taken.append(cause)
        if cause is DELAY:
            break
    return found


def _evidence(model: Balance, parts: Sequence[str]) -> tuple[float, Array, Array]:
    """Log of the probability of the data with these faults as large as real ones, up to a constant;
    their posterior mean and covariance.
    """
    if not parts:
        return 0.0, np.zeros(0), np.zeros((0, 0))
    effect = np.stack([model.effects[name] for name in parts], axis=1)
    prior = np.array([USUAL[kind_of(name)].faulty for name in parts])
    solved = cho_solve(model.factor, effect)
    precision = effect.T @ solved
    towards = solved.T @ model.rest
    posterior: Array = np.asarray(np.linalg.inv(precision + np.diag(prior**-2.0)), dtype=float)
    values = posterior @ towards
    _, size = np.linalg.slogdet(np.eye(len(parts)) + precision @ np.diag(prior**2))
    return float(0.5 * towards @ values - 0.5 * size), values, posterior


def alone(seen: Examined) -> dict[str, tuple[float, float]]:
    """What each fault would be beside those found, with its standard deviation, in the units of
    `expected.USUAL`.
    """
    taken = [p for f in seen.found if f.cause is not DELAY for p in f.cause.parts]
    found: dict[str, tuple[float, float]] = {"delay": (seen.lag.value, seen.lag.deviation)}
    for cause in causes(seen.data.names):
        parts = [*(p for p in taken if p not in cause.parts), *cause.parts]
        _, values, covariance = _evidence(seen.model, parts)
        for i, name in enumerate(parts):
            if name in cause.parts:
                found[name] = float(values[i]), float(np.sqrt(covariance[i, i]))
    return found


def likeness(seen: Examined) -> dict[str, tuple[str, float]]:
    """The fault that looks most like each, and the correlation of their errors, both free."""
    parts = [p for cause in (DELAY, *causes(seen.data.names)) for p in cause.parts]
    _, _, covariance = _evidence(seen.model, parts)
    size = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(size, size) - np.eye(len(parts))
    best = np.argmax(np.abs(correlation), axis=1)
    return {name: (parts[best[i]], float(correlation[i, best[i]])) for i, name in enumerate(parts)}
