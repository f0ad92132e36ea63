"""Quantities (`gaitval.quantities`) of a walk and of its record: found, stored, shown and measured.

Joint power has a place of its own in `metrics.json` and `import.json`, from before there were
others. A file that an earlier gaitval wrote does not have a newer quantity; its curves have.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.gait.cycle_curves import Curves
from gaitval.kinetics.musculature.gait import MuscleGait
from gaitval.metrics.curve_results import (
    JointPower,
    Kinds,
    MeanCurve,
    QuantityResult,
    RecordResult,
    from_kinds,
)
from gaitval.metrics.tolerances import Measure, measured
from gaitval.metrics.typed import array, number, numbers
from gaitval.quantities import QUANTITIES, Found, Quantity
from gaitval.quantities.joint_power import JOINT_POWER
from gaitval.quantities.quantity import StrideTimes
from gaitval.walk.reference.hip_moments import about_model


class WithQuantities(Protocol):
    """A part of `metrics.json` that has quantities: that of the record, or of a walk."""

    @property
    def joint_power(self) -> JointPower | None:
        """That of hip, knee and ankle."""

    @property
    def quantities(self) -> dict[str, QuantityResult]:
        """The others, by name."""


def found_quantities(
    curves: Curves,
    stride_time: StrideTimes,
    muscles: MuscleGait | None = None,
    speed: float | None = None,
    laden: float = 1.0,
    hip_centre: Array | None = None,
) -> dict[str, Found]:
    """Every quantity of the `curves` of a walk (n, 101) or a record (101,) that can be had, by
    name; `stride_time` as in `Quantity.of_curves`. Of its `muscles`, too, and over its `speed`,
    m/s, where they are known. `laden` is the mass that moments are divided by over the person's,
    `hip_centre` (2, 2) m where the hips are that they are about, if these are not the model's own.
    """
    own = curves if hip_centre is None else about_model(curves, hip_centre)
    own = replace(own, moments={name: laden * each for name, each in own.moments.items()})
    found = {
        each.name: each.of_curves(own if each.of_person else curves, stride_time)
        for each in QUANTITIES
    }
    for each in QUANTITIES:
        if each.of_muscles is not None and muscles is not None:
            found[each.name] = each.of_muscles(muscles)
    return {
        each.name: each.at_speed(known, speed)
        for each in QUANTITIES
        if (known := found[each.name]) is not None
    }


def power_result(found: Mapping[str, Found]) -> JointPower | None:
    """The joint power among what was `found`; None without."""
    power = found.get(JOINT_POWER.name)
    if power is None:
        return None
    return JointPower.model_validate(
        {
            "power": {name: numbers(curve) for name, curve in power.curves.items()},
            **{kind: dict(values) for kind, values in power.figures.items()},
        }
    )


def quantity_results(found: Mapping[str, Found]) -> dict[str, QuantityResult]:
    """The quantities that were `found`, but for joint power (`power_result`)."""
    return {
        each.name: quantity_result(each, found[each.name])
        for each in QUANTITIES
        if each.name in found and each is not JOINT_POWER
    }


def quantity_result(quantity: Quantity, found: Found) -> QuantityResult:
    """A `quantity` that was `found`, as files have it."""
    return QuantityResult(
        curves={name: numbers(curve) for name, curve in found.curves.items()},
        unit=quantity.unit,
        figures={
            kind: {name: number(value) for name, value in values.items()}
            for kind, values in found.figures.items()
        },
        figure_units=dict(quantity.figures),
    )


def stored_quantity(part: WithQuantities, quantity: Quantity) -> Found | None:
    """A `quantity` in a `part` of `metrics.json`; None where the file does not have it."""
    if quantity is JOINT_POWER:
        power = part.joint_power
        if power is None:
            return None
        figures = {kind: getattr(power, kind) for kind in quantity.figures}
        return Found({name: array(curve) for name, curve in power.power.items()}, figures)
    kept = part.quantities.get(quantity.name)
    if kept is None:
        return None
    return Found({name: array(curve) for name, curve in kept.curves.items()}, kept.figures)


def quantity_measures(
    walked: Mapping[str, Found], recorded: Mapping[str, Found]
) -> Iterable[Measure]:
    """Every measure of every quantity that was `recorded`, in the order of their table."""
    for quantity in QUANTITIES:
        if quantity.name in recorded:
            for measure in quantity.measures:
                for target, value in measure.values(
                    walked.get(quantity.name), recorded[quantity.name]
                ):
                    yield measured(measure.name, target, value)


def stored_quantities(part: WithQuantities) -> dict[str, Found]:
    """Every quantity in a `part` of `metrics.json`, by name."""
    found = {each.name: stored_quantity(part, each) for each in QUANTITIES}
    return {name: each for name, each in found.items() if each is not None}


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
