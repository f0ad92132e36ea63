"""Tables over one gait cycle, read at the phase of one walker or of eight."""

from typing import Any, NamedTuple

import numpy as np
from numba.core import types
from numba.extending import overload

from gaitval._internal.numba.compiled import njit_borrowing
from gaitval._internal.numba.lanes import WIDTH, in_numbers, lane
from gaitval.arrays import Array, Index


class LaneTables(NamedTuple):
    """A table for each lane.

    Attributes
    ----------
    values : (tables, N + 1, K).
    which : (8,) the table of each lane.
    """

    values: Array
    which: Index


@njit_borrowing
def read_row(table: Array, phase: float, out: Array) -> None:
    """Row of a table (N + 1, K) over one cycle at a phase, linearly interpolated, into `out`."""
    # The last row repeats the first, so row + 1 exists for every phase.
    count = table.shape[0] - 1
    place = (phase - np.floor(phase)) * count
    row = int(place)
    part = place - row
    for i in range(table.shape[1]):
        out[i] = (1.0 - part) * table[row, i] + part * table[row + 1, i]


@njit_borrowing
def _read_rows(tables: LaneTables, phase: Any, out: Array) -> None:
    values, numbers = tables.values, in_numbers(out)
    count = values.shape[1] - 1
    # Each lane reads at a place of its own: numbers again, lane by lane.
    for k in range(WIDTH):
        table, at = values[tables.which[k]], lane(phase, k)
        place = (at - np.floor(at)) * count
        row = int(place)
        part = place - row
        for i in range(table.shape[1]):
            numbers[i, k] = (1.0 - part) * table[row, i] + part * table[row + 1, i]


def _read_table(table: Any, phase: Any, out: Any) -> None:
    """`read_row`, or of `LaneTables` the row of each lane's table at its phase, in compiled
    functions.
    """


read_table: Any = _read_table


@overload(read_table)
def _reader(table, phase, out):  # type: ignore[no-untyped-def]  # numba compares signatures
    # Chosen when it is compiled, by the type of the table.
    def one(table, phase, out):  # type: ignore[no-untyped-def]
        read_row(table, phase, out)

    def eight(table, phase, out):  # type: ignore[no-untyped-def]
        _read_rows(table, phase, out)

    return one if isinstance(table, types.Array) else eight
