"""The linear model of a session: its data under faults that are all as small as usual.

data = expected + effect · faults + a person's own pattern + noise, Gaussian throughout. What each
fault would explain beside that, and which of them is there, is `estimate`'s. Something that nobody
thought of makes the pattern of a part of the data many times as large as that of a person.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import logsumexp

from gaitval.arrays import Array, Flags
from gaitval.consistency import WIDEST
from gaitval.session.measurement.balance import FALL, NEWTON, PRESSURE, Data
from gaitval.session.measurement.expected import (
    ACCELERATION,
    AMPLITUDES,
    LEAST_ACCELERATION,
    NUISANCE,
    OWN_BIN,
    SAME_FOOT,
    SAME_PERSON,
    STANCE_LENGTH,
    STRIDE_LENGTH,
    expected,
    spread,
)
from gaitval.session.measurement.kinds import KINDS, kind_of

ALL: Final = tuple(
    part
    for name, kind in KINDS.items()
    if kind.whose == "each plate or all"
    for part in kind.parts or (name,)
)
"""Effects of faults that all plates may have together."""
LEAST_SCALE: Final = 0.7
"""Of the covariance, where a session is more regular than others."""
SCALE_SD: Final = 0.3
"""SD of the logarithm of that scale above 1: 17 people with sound plates have 0.2 to 0.95."""


@dataclass(frozen=True)
class Balance:
    """The linear model of a session.

    Attributes
    ----------
    rest, factor : (N,) what is left of the data, and its covariance (of scipy's `cho_factor`).
    left : mean square of what no fault explains, over what is expected.
    order : place of each of the F faults that are looked for, by its name, in what follows.
    effects : (N, F) of each.
    precision, towards : (F, F) and (F,) of the likelihood of their sizes.
    prior, sound : (F,) sizes of real faults, and of those that everybody has.
    mean : (F,) of real faults.
    reach : m, of the plate that is farthest from the middle of them all.
    covariance, own : (N, N), in a person like others, and what of it is the person's own pattern.
    kind, group : (N,) of the data.
    """

    rest: Array
    factor: tuple[Array, bool]
    left: float
    order: Mapping[str, int]
    effects: Array
    precision: Array
    towards: Array
    prior: Array
    sound: Array
    mean: Array
    reach: float = 0.0
    covariance: Array = field(default_factory=lambda: np.eye(1))
    own: Array = field(default_factory=lambda: np.eye(1))
    kind: Sequence[str] = ()
    group: Sequence[str] = ()


def balance(
    data: Data, height_m: float, *, without: Sequence[str] = (), scaled: bool = True
) -> Balance:
    """The model of `data` of a person of `height_m`, with all faults as small as usual, but for
    those `without`; not `scaled` to what no fault explains, the covariance is that of everybody.
    """
    kinds = np.array(data.kind)
    mean = np.zeros(len(kinds))
    deviation = np.zeros(len(kinds))
    size = acceleration_of(data)
    for each in set(data.kind):
        mine = kinds == each
        mean[mine] = expected(each, data.phase[mine], height_m, size)
        deviation[mine] = spread(each, data.phase[mine], height_m)
    own = np.where(np.isin(kinds, PRESSURE), OWN_BIN * deviation, 0.0)
    pattern = _patterns(data, deviation) + np.diag(own**2)
    covariance = pattern + np.diag(data.noise**2)
    effects = {name: data.effect[:, i] for i, name in enumerate(data.names)}
    plates = [name.removeprefix("gain ") for name in data.names if name.startswith("gain ")]
    for fault in ALL:
        # no plate may have been stepped on
        effects[f"{fault} all"] = sum(
            (effects[f"{fault} {p}"] for p in plates), np.zeros(len(kinds))
        )
    reach = 0.0
    if plates:
        # The plates turn as one block, so each also moves.
        middle = np.mean([data.middles[p] for p in plates], axis=0)
        for p in plates:
            x, y, _ = data.middles[p] - middle
            reach = max(reach, float(np.hypot(x, y)))
            effects["rotation all"] = (
                effects["rotation all"] - y * effects[f"place x {p}"] + x * effects[f"place y {p}"]
            )
    for name, effect in effects.items():
        if name.endswith(" all"):
            continue
        size_of = NUISANCE[name] if name in NUISANCE else KINDS[kind_of(name)].sound
        if size_of == 0.0 or name in without:
            continue
        if name.startswith(AMPLITUDES):
            size_of *= max(ACCELERATION / size, 1.0)
        covariance += size_of**2 * np.outer(effect, effect)
    rest = data.value - mean
    open_ = covariance.copy()
    for name, effect in effects.items():
        if name not in NUISANCE:
            kind = KINDS[kind_of(name)]
            open_ += (kind.faulty**2 + kind.mean**2) * np.outer(effect, effect)
    left = float(rest @ cho_solve(cho_factor(open_, lower=True), rest)) / len(rest)
    scale = max(left, LEAST_SCALE) if scaled else 1.0
    usual = covariance.copy()
    covariance *= scales(data.kind, scale)
    factor = cho_factor(covariance, lower=True)
    names = [name for name in effects if name not in NUISANCE]
    table = np.stack([effects[name] for name in names], axis=1)
    solved = cho_solve(factor, table)
    usual_ = [KINDS[kind_of(name)] for name in names]
    return Balance(
        rest, factor, left, {name: i for i, name in enumerate(names)},
        effects=table, precision=table.T @ solved,
        towards=solved.T @ rest,
        prior=np.array([each.faulty for each in usual_]),
        sound=np.array(
            [0.0 if n.endswith(" all") or n in without else u.sound
             for n, u in zip(names, usual_, strict=True)]
        ) * np.sqrt(scale),
        mean=np.array([each.mean for each in usual_]),
        reach=reach,
        covariance=usual,
        own=pattern,
        kind=data.kind,
        group=data.group,
    )  # fmt: skip


def scales(kinds: Sequence[str], scale: float) -> Array:
    """(N, N) factors of a covariance of data of these `kinds`: what no fault explains is a person's
    own, larger than others' by the `scale`; how the rates of a file fall with the frequency is the
    laboratory's.
    """
    size = np.where(np.isin(kinds, FALL), 1.0, np.sqrt(scale))
    return np.outer(size, size)


def acceleration_of(data: Data) -> float:
    """Root mean square of the centre of mass's acceleration, over gravity; that of other sessions
    if the data do not show it.
    """
    kinds = np.array(data.kind)
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


SIZES: Final = np.geomspace(1.5, WIDEST, 7)
"""Times its usual size that a person's pattern is tried at."""


def log_sound(model: Balance, parts: Sequence[str] = (), scale: float | None = None) -> float:
    """Log of the probability density of the data of a `model` with the faults `parts` and no other,
    up to a constant; `scale` of its covariance if it is not its own.
    """
    scale = max(model.left, LEAST_SCALE) if scale is None else scale
    beside = _beside(model, parts)
    found = _log_density(model.rest, model.covariance * scales(model.kind, scale) + beside)
    return found - 0.5 * float(np.log(max(scale, 1.0)) / SCALE_SD) ** 2


def something_else(model: Balance, parts: Sequence[str] = ()) -> float:
    """Log of the probability of the data of a `model` where a part of them has a pattern larger
    than that of people, by a factor between 1 and `WIDEST`, beside the faults `parts`; over that of
    the data with no other fault than these.
    """
    calm = min(max(model.left, LEAST_SCALE), 1.0)
    usual = model.covariance * scales(model.kind, calm) + _beside(model, parts)
    logs = []
    for mine in _blocks(model):
        own = model.own * np.outer(mine, mine)
        logs += [_log_density(model.rest, usual + (size**2 - 1.0) * own) for size in SIZES]
    return float(logsumexp(logs) - np.log(len(logs))) - log_sound(model, parts)


def _beside(model: Balance, parts: Sequence[str]) -> Array:
    """(N, N) covariance of faults as large as real ones."""
    at = [model.order[part] for part in parts]
    effects = model.effects[:, at] * np.hypot(model.prior[at], model.mean[at])
    return np.asarray(effects @ effects.T)


def _blocks(model: Balance) -> list[Flags]:
    """Parts of the data that something which nobody thought of may concern: all, the forces, the
    moments, and the pressures under each foot.
    """
    kinds, groups = np.array(model.kind), np.array(model.group)
    newton, pressure = np.isin(kinds, NEWTON), np.isin(kinds, PRESSURE)
    found = [newton | pressure, newton, np.isin(kinds, NEWTON[:3]), np.isin(kinds, NEWTON[3:])]
    found += [pressure & (groups == group) for group in sorted({*groups[pressure]})]
    return [mine for mine in found if mine.any()]


def _log_density(rest: Array, covariance: Array) -> float:
    """Log probability density of `rest` (N,), up to a constant."""
    factor = cho_factor(covariance, lower=True)
    size = 2.0 * float(np.log(np.diag(factor[0])).sum())
    return -0.5 * (float(rest @ cho_solve(factor, rest)) + size)
