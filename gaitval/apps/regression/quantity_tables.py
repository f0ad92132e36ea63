"""Every quantity (`gaitval.quantities`) of many walks: tables of figures with a column a walk, and
all figures and curves as rows of CSV files.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

from gaitval._internal.text.number_text import number
from gaitval.apps.regression.versions import StoredWalk
from gaitval.coordinates import SIDES
from gaitval.metrics.walk_quantities import quantities_of_record, quantities_of_walk
from gaitval.quantities import QUANTITIES, Found, Quantity
from gaitval.quantities.quantity import FigureTable

FIGURE_COLUMNS: Final = (
    "walk", "subject", "quantity", "figure", "of", "side", "unit", "recorded", "simulated", "before"
)  # fmt: skip


class WalkQuantities(NamedTuple):
    """Quantities by name of a walk, of its record, and of the walk before; empty without one."""

    walk: StoredWalk
    label: str
    walked: Mapping[str, Found]
    recorded: Mapping[str, Found]
    before: Mapping[str, Found]


def quantities_of(
    walks: Sequence[StoredWalk], labels: Sequence[str], before: Mapping[int, StoredWalk]
) -> list[WalkQuantities]:
    """The quantities of each of the `walks`, by their `labels`; `before` as in the curves."""
    found = []
    for walk, label in zip(walks, labels, strict=True):
        earlier = before.get(id(walk))
        found.append(
            WalkQuantities(
                walk,
                label,
                quantities_of_walk(walk.metrics.walk),
                quantities_of_record(walk.metrics.record),
                {} if earlier is None else quantities_of_walk(earlier.metrics.walk),
            )
        )
    return found


def figure_tables(walks: Sequence[WalkQuantities], *, most: int) -> list[dict[str, Any]]:
    """For the template: a table for each that a quantity has and at most `most` walks. A cell is
    the walk's figure, with that of the walk before in brackets, or else of the record.
    """
    tables = []
    for first in range(0, len(walks), most):
        some = walks[first : first + most]
        for quantity in QUANTITIES:
            for table in quantity.tables:
                rows = [
                    {"name": label, "side": side, "values": values}
                    for label, kind, name in table.rows
                    for side in table.columns
                    for values in ([_cell(each, quantity, table, (kind, name, side))
                                    for each in some],)
                    if any(values)
                ]  # fmt: skip
                if rows:
                    labels = [each.label for each in some]
                    title = f"{table.title}, {table.unit}".removesuffix(", 1")
                    tables.append({"title": title, "labels": labels, "rows": rows})
    return tables


def _cell(
    walk: WalkQuantities, quantity: Quantity, table: FigureTable, place: tuple[str, str, str]
) -> str:
    """Of a kind, name and column; empty where neither is known."""
    both = (walk.walked, walk.before or walk.recorded)
    values = [
        table.figure(found[quantity.name].figures, *place) if quantity.name in found else None
        for found in both
    ]
    if values == [None, None]:
        return ""
    now, other = (number(value, table.digits) for value in values)
    return f"{now} ({other})"


def figure_rows(walks: Sequence[WalkQuantities]) -> Iterator[list[object]]:
    """Rows of `FIGURE_COLUMNS` with every figure of every quantity."""
    for each in walks:
        for quantity in QUANTITIES:
            parts = (each.recorded, each.walked, each.before)
            figures = [found[quantity.name].figures if quantity.name in found else {}
                       for found in parts]  # fmt: skip
            for kind, unit in quantity.figures.items():
                for key in dict.fromkeys(key for part in figures for key in part.get(kind, {})):
                    values = [part.get(kind, {}).get(key) for part in figures]
                    yield [
                        *(each.label, each.walk.subject, quantity.name, kind, key[:-2]),
                        *(_SIDE[key[-1]], unit, *map(_short, values)),
                    ]


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.6g}")


_SIDE: Final = {side[0]: side for side in SIDES}


def curve_rows(each: WalkQuantities) -> Iterator[list[object]]:
    """Rows of every curve of the quantities of a walk: label, quantity, side, percent of the cycle,
    unit, recorded, simulated, its SD, which is not known, and before.
    """
    for quantity in QUANTITIES:
        parts = [found[quantity.name].curves if quantity.name in found else {}
                 for found in (each.recorded, each.walked, each.before)]  # fmt: skip
        for key in parts[1]:
            recorded, walked, before = (part.get(key) for part in parts)
            for percent in range(101):
                yield [
                    *(each.label, f"{key[:-2]} {quantity.name}", _SIDE[key[-1]], percent),
                    quantity.unit,
                    None if recorded is None else float(recorded[percent]),
                    None if walked is None else float(walked[percent]),
                    None,
                    None if before is None else float(before[percent]),
                ]
