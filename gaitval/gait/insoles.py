"""Vertical forces by insoles: a file over time, and each foot's mean over its own gait cycle.

A MOT or STO file, or a CSV with a header. One column is the time, s; two are the vertical forces on
the right and the left foot, N. Their clock may be another one than the markers': landings are taken
from the forces, and what is used are mean curves over the gait cycle.
"""

import csv
import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from gaitval._internal.io.text_tables import MISSING, text_table
from gaitval.arrays import Array
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES
from gaitval.errors import RecordError
from gaitval.gait.cycles import CYCLES
from gaitval.gait.events import foot_contacts
from gaitval.mocap.mot import read_storage
from gaitval.mocap.text_table import numbers_of, sample_rate, text_lines


@dataclass(frozen=True)
class InsoleLimits:
    """Which strides of pressure insoles count."""

    loaded: float = 0.05
    """Body weights from which a foot is on the ground. Convention: insoles are not quite empty in a
    shoe whose foot is in the air."""
    unloaded: float = 0.03
    """Body weights in swing from which an insole was not zeroed."""
    fewest: int = 3
    """Strides of each foot of which a mean is taken."""
    slowest_hz: float = 40.0
    """A double support of 0.1 s has four samples."""
    largest_gain: float = 0.2
    """By which what both feet carry in a stride may differ from the weight. Calibrated insoles are
    4 to 6 % off (Cramer et al. 2022, Sensors 22:2203, abstract), others 30 to 50 % (39 people,
    PMC6453056, abstract): beyond it, another person, or insoles that have to be calibrated."""
    same_stride: float = 0.1
    """Share by which the strides may be longer or shorter than those of the markers in one walk."""


INSOLES: Final = InsoleLimits()


class InsoleForces(NamedTuple):
    """Mean vertical forces of both feet by insoles.

    Attributes
    ----------
    source : the file's name.
    vertical : (2, n) body weights, right and left, at n even times of each foot's own cycle from
        its landing on; scaled so that in a stride both carry the weight, as in steady walking.
    gain : what both carried in a stride before that, body weights.
    strides : of each foot.
    stride_time : s.
    error : standard deviation of `vertical`, body weights.
    """

    source: str
    vertical: Array
    gain: float
    strides: tuple[int, int]
    stride_time: float
    error: float


class _Table(NamedTuple):
    """Times (T,) s and forces (T, 2) N of a file, with the names of its columns."""

    time: Array
    forces: Array
    names: tuple[str, str]


def read_insoles(
    path: Path,
    *,
    mass: float,
    stride_time: float,
    error: float,
    columns: tuple[str, str],
    samples: int = 100,
) -> InsoleForces:
    """The insoles' forces in the file `path`.

    Parameters
    ----------
    path : CSV with a header, MOT or STO.
    mass : of the person, kg.
    stride_time : of the person's walk by markers, s: the file's is to be the same walk.
    error : standard deviation that is stated for the insoles, body weights.
    columns : names of the vertical forces, N, of the right and the left foot.
    samples : n.

    Raises
    ------
    RecordError
        The file is no such table, a column is missing or in another unit, the insoles were not
        zeroed, there are too few whole strides, or it is another walk.
    """
    path = Path(path)
    found = _read(path, columns)
    rate = sample_rate(path, found.time)
    if rate < INSOLES.slowest_hz:
        raise RecordError(
            f"{path}: {rate:.0f} samples a second, but both feet are on the ground for 0.1 s only, "
            f"so {INSOLES.slowest_hz:.0f} are needed. Export the insoles at their own rate."
        )
    weights = found.forces / (mass * STANDARD_GRAVITY)
    _in_newton(path, found, weights)
    by_foot = [_cycles(path, weights[:, i], rate, name) for i, name in enumerate(found.names)]
    if np.array_equal(found.forces[:, 0], found.forces[:, 1], equal_nan=True):
        raise RecordError(
            f"{path}: {' and '.join(found.names)} are the same in all rows: one is a copy of the "
            "other. Give each foot's own."
        )
    time = float(np.mean([np.median([e - b for b, e in each]) for each in by_foot])) / rate
    if abs(time / stride_time - 1.0) > INSOLES.same_stride:
        raise RecordError(
            f"{path}: its strides last {time:.2f} s, those of the markers {stride_time:.2f} s: it "
            "is another walk, and forces change with speed. Give the insoles of the walk that was "
            "recorded, or of one as fast."
        )
    curves = np.array(
        [
            np.mean([_over(weights[:, i], *each, samples) for each in cycles], axis=0)
            for i, cycles in enumerate(by_foot)
        ]
    )
    gain = float(curves.mean(axis=1).sum())
    if abs(gain - 1.0) > INSOLES.largest_gain:
        raise RecordError(
            f"{path}: both feet carry {gain:.2f} of the weight ({mass:g} kg) in the mean of a "
            "stride, and people who walk steadily carry all of it. Look up the unit (N), the mass "
            "and whether both insoles work, and calibrate them."
        )
    strides = (len(by_foot[0]), len(by_foot[1]))
    return InsoleForces(path.name, curves / gain, gain, strides, time, error)


def _read(path: Path, columns: tuple[str, str]) -> _Table:
    if path.suffix.lower() in (".mot", ".sto"):
        table = read_storage(path)
        names, time, values = list(table.columns), table.time, table.values
    else:
        names, time, values = _comma_separated(path)
    # `Force_right (N)` is force_right, unless a column has just the name that was given.
    plain = [name if name in columns else _plain(name) for name in names]
    missing = [name for name in columns if name not in plain]
    if missing or columns[0] == columns[1]:
        what = f"no column {missing[0]!r}" if missing else f"{columns[0]!r} is named for both feet"
        raise RecordError(
            f"{path}: {what}; its columns are {', '.join(names[:12])}. The vertical forces of the "
            "right and the left foot are needed, N. Name them with --insole-columns RIGHT LEFT."
        )
    forces = values[:, [plain.index(name) for name in columns]]
    return _Table(time, np.where(np.isin(np.abs(forces), MISSING), np.nan, forces), columns)


def _plain(name: str) -> str:
    """A column's name without a unit in brackets, in small letters."""
    return re.sub(r"\s*[\[(].*[\])]$", "", name).strip().lower()


def _comma_separated(path: Path) -> tuple[list[str], Array, Array]:
    try:
        header, rows = text_table(text_lines(path))
    except csv.Error as error:
        raise RecordError(f"{path}: cannot be read as CSV ({error}). Export it again.") from None
    names = [each.strip() for each in header]
    rows = [(line, cells) for line, cells in rows if any(map(str.strip, cells))]
    at = next((i for i, name in enumerate(names) if _plain(name) in ("time", "time_s")), None)
    if at is None or not rows:
        why = "no rows" if at is not None else f"no column time; its columns are {names[:12]}"
        raise RecordError(
            f"{path}: {why}. Insoles are read from a CSV with a header, one of whose columns is "
            "time (s), or a MOT or STO file. Export the forces over time so."
        )
    lines = ["\t".join(cells) for _, cells in rows]
    table = numbers_of(path, lines, rows[0][0], len(names), "\t")
    return names[:at] + names[at + 1 :], table[:, at], np.delete(table, at, axis=1)


def _in_newton(path: Path, found: _Table, weights: Array) -> None:
    """Raise RecordError where forces cannot be those of a walk, in N."""
    for side, name, values, force in zip(
        SIDES, found.names, weights.T, found.forces.T, strict=True
    ):
        if not np.isfinite(values).any():
            raise RecordError(
                f"{path}: column {name}: no number. Give the force on the {side} foot, N."
            )
        most, least = float(np.nanpercentile(values, 99.0)), float(np.nanpercentile(values, 10.0))
        if not 0.6 < most < 2.0:
            raise RecordError(
                f"{path}: column {name}: its largest force is {np.nanmax(force):.4g}, which is "
                f"{most:.2g} of the weight in N; a foot that walks carries 0.9 to 1.5. Give forces "
                "in N: body weights times mass times 9.81, kilograms times 9.81; up is positive."
            )
        if abs(least) > INSOLES.unloaded:
            raise RecordError(
                f"{path}: column {name}: {100.0 * least:.0f} % of the weight with the {side} foot "
                "in the air: the insole was not zeroed, or the person stood. Zero it with the foot "
                "lifted and record again, or cut the file to where the person walks."
            )


def _cycles(path: Path, values: Array, rate: float, name: str) -> list[tuple[float, float]]:
    """The whole strides of a foot, by the samples (from 0) at which it lands."""
    known = np.isfinite(values)
    begins, _ = foot_contacts(np.where(known, values, 0.0) > INSOLES.loaded, rate=rate)
    strikes = []
    for at in (int(each) for each in begins if each > 0):
        before, after = values[at - 1], values[at]
        if np.isfinite(before):  # else a gap ends, in stance or where it landed
            strikes.append(at - 1.0 + (INSOLES.loaded - before) / (after - before))
    low, high = CYCLES.plausible_stride
    pairs = [
        (begin, end)
        for begin, end in pairwise(strikes)
        if low <= (end - begin) / rate <= high and known[int(begin) : int(end) + 1].all()
    ]
    usual = float(np.median([end - begin for begin, end in pairs])) if pairs else 0.0
    kept = [
        each for each in pairs if abs(each[1] - each[0] - usual) <= CYCLES.unusual_stride * usual
    ]
    if len(kept) < INSOLES.fewest:
        raise RecordError(
            f"{path}: column {name}: {len(kept)} whole strides from landing to landing, and "
            f"{INSOLES.fewest} are needed for a mean. Give a longer walk without gaps."
        )
    return kept


def _over(values: Array, begin: float, end: float, samples: int) -> Array:
    """(n,) of a stride; nothing where the foot is in the air."""
    at = begin + (end - begin) * np.arange(samples) / samples
    found = np.interp(at, np.arange(len(values)), values)
    return np.where(found > INSOLES.loaded, found, 0.0)
