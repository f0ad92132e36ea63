"""The linear model of a session: its data under faults that are all as small as usual.

data = expected + effect · faults + a person's own pattern + noise, Gaussian throughout. What each
fault would explain beside that, and which of them is there, is `estimate`'s.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from gaitval.arrays import Array
from gaitval.measurement.balance import FALL, NEWTON, PRESSURE, Data
from gaitval.measurement.expected import (
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

ALL: Final = ("place x", "place y", "rotation")
"""Faults that all plates may have together: the cameras' axes are not those of the plates."""
CLOSED: Final = "plate delay"
"""A fault that is too rare for what is left of a session to be measured beside it."""
LEAST_SCALE: Final = 0.7
"""Of the covariance, where a session is more regular than others."""


def kind_of(name: str) -> str:
    """The kind of a fault, of the names of `USUAL`."""
    return next(kind for kind in USUAL if name.startswith(kind))


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
    for kind in set(data.kind):
        mine = kinds == kind
        mean[mine] = expected(kind, data.phase[mine], height_m, size)
        deviation[mine] = spread(kind, data.phase[mine], height_m)
    own = np.where(np.isin(kinds, PRESSURE), OWN_BIN * deviation, 0.0)
    covariance = _patterns(data, deviation) + np.diag(data.noise**2 + own**2)
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
        usual = NUISANCE[name] if name in NUISANCE else USUAL[kind_of(name)].sound
        if usual == 0.0 or name in without:
            continue
        if name.startswith(AMPLITUDES):
            usual *= max(ACCELERATION / size, 1.0)
        covariance += usual**2 * np.outer(effect, effect)
    rest = data.value - mean
    open_ = covariance.copy()
    for name, effect in effects.items():
        if name not in NUISANCE and not name.startswith(CLOSED):
            open_ += USUAL[kind_of(name)].faulty ** 2 * np.outer(effect, effect)
    left = float(rest @ cho_solve(cho_factor(open_, lower=True), rest)) / len(rest)
    scale = max(left, LEAST_SCALE) if scaled else 1.0
    covariance *= scales(data.kind, scale)
    factor = cho_factor(covariance, lower=True)
    names = [name for name in effects if name not in NUISANCE]
    table = np.stack([effects[name] for name in names], axis=1)
    solved = cho_solve(factor, table)
    usual_ = [USUAL[kind_of(name)] for name in names]
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


def contradiction(data: Data, height_m: float, left: Array) -> float:
    """How much of the `data` is `left`: mean squares over the spread of people of `height_m`, the
    sum over the kinds of data.
    """
    kinds, total = np.array(data.kind), 0.0
    for kind in (*NEWTON, *PRESSURE):
        mine = kinds == kind
        if mine.any():
            usual = float(np.mean(spread(kind, data.phase[mine], height_m)))
            total += float((left[mine] ** 2).mean()) / usual**2
    return total
