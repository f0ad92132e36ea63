"""The quantities of a walk and of its record, as pages, comparisons and tables show them.

A file that an earlier gaitval wrote does not have a newer quantity; the curves in it have.
"""

from collections.abc import Sequence
from typing import Protocol

from gaitval.coordinates import SIDES
from gaitval.metrics.quantity_results import WithQuantities, stored_quantity
from gaitval.metrics.record_results import Kinds, RecordResult
from gaitval.metrics.recorded import from_kinds
from gaitval.metrics.walk_results import MeanCurve
from gaitval.quantities import QUANTITIES, Found, Quantity


class NamedMean(Protocol):
    """A parameter of gait, by its name."""

    @property
    def name(self) -> str:
        """Such as `stride_time_right`."""

    @property
    def mean(self) -> float | None:
        """Over the cycles."""


class WalkPart(WithQuantities, Protocol):
    """The part of `metrics.json` that is of a walk (`results.WalkResult`)."""

    @property
    def curves(self) -> Kinds[MeanCurve]:
        """In the units of the file."""

    @property
    def spatiotemporal(self) -> Sequence[NamedMean]:
        """Stride times among them, s."""


def of_record(record: RecordResult, quantity: Quantity) -> Found | None:
    """A `quantity` of the `record`; None where it does not follow from it."""
    times = {side[0]: getattr(record.spatiotemporal, f"stride_time_{side}") for side in SIDES}
    found = stored_quantity(record, quantity) or quantity.of_curves(
        from_kinds(record.curves.items()), times
    )
    if found is None:
        return None
    return quantity.at_speed(quantity.again(found), record.spatiotemporal.walking_speed)


def of_walk(walk: WalkPart, quantity: Quantity) -> Found | None:
    """A `quantity` of the `walk`; None without a whole cycle of both sides."""
    rows = {row.name: row.mean for row in walk.spatiotemporal}
    times = {side[0]: rows.get(f"stride_time_{side}") for side in SIDES}
    means = ((kind, name, each.mean) for kind, name, each in walk.curves.items())
    found = stored_quantity(walk, quantity) or quantity.of_curves(
        from_kinds((kind, name, mean) for kind, name, mean in means if mean is not None), times
    )
    if found is None:
        return None
    return quantity.at_speed(quantity.again(found), rows.get("walking_speed"))


def quantities_of_record(record: RecordResult) -> dict[str, Found]:
    """Every quantity of the `record` that it has, by name."""
    found = {each.name: of_record(record, each) for each in QUANTITIES}
    return {name: each for name, each in found.items() if each is not None}


def quantities_of_walk(walk: WalkPart) -> dict[str, Found]:
    """Every quantity of the `walk` that it has, by name."""
    found = {each.name: of_walk(walk, each) for each in QUANTITIES}
    return {name: each for name, each in found.items() if each is not None}
