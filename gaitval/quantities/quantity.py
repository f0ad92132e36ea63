"""What a quantity is: all that pages, files, limits, comparisons and exports need to know of it."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from gaitval.arrays import Array
from gaitval.coordinates import ACTUATED, SIDES
from gaitval.gait.cycle_curves import Curves
from gaitval.kinetics.musculature.gait import MuscleGait
from gaitval.subjects.prediction.known import RecordedQuantity

StrideTimes = Mapping[str, float | None]
"""s, mean of the right and of the left side, `r` and `l`; None where not measured."""

Figures = Mapping[str, Mapping[str, float | None]]
"""Single values by kind ("peak") and name with `_r` or `_l`; None where there is none."""

Compared = Iterable[tuple[str, float | None]]
"""Target and value of a measure; None where the walk has none."""


@dataclass(frozen=True)
class Found:
    """A quantity of a walk, a record or the mean of a trial.

    Attributes
    ----------
    curves : (101,) mean over the cycles, by name with `_r` or `_l`, in `Quantity.unit`.
    figures : in the units of `Quantity.figures`.
    """

    curves: Mapping[str, Array]
    figures: Figures = field(default_factory=dict)


class OverTime(NamedTuple):
    """A motion with its moments, of a recorded trial or of a walk that is exported.

    Attributes
    ----------
    angles : (T, 25) rad, in the order of `coordinates.ACTUATED`.
    moments : (T, 25) Nm, positive where they would increase their angle.
    powers : (T, 25) W.
    """

    angles: Array
    moments: Array
    powers: Array

    def angle(self, name: str) -> Array:
        """(T,) rad, of a coordinate."""
        return self._column(self.angles, name)

    def moment(self, name: str) -> Array:
        """(T,) Nm, of a coordinate."""
        return self._column(self.moments, name)

    def power(self, name: str) -> Array:
        """(T,) W, of a coordinate."""
        return self._column(self.powers, name)

    @staticmethod
    def _column(values: Array, name: str) -> Array:
        column: Array = values[:, ACTUATED.index(name)]
        return column


class QuantityMeasure(NamedTuple):
    """A difference of a walk from its record, which `tolerances.toml` may limit.

    Attributes
    ----------
    name, unit : as in `tolerances.toml`.
    values : of the quantity of the walk, None without a whole cycle, and of the record.
    """

    name: str
    unit: str
    values: Callable[[Found | None, Found], Compared]


class FigureTable(NamedTuple):
    """A table of figures on a page.

    Attributes
    ----------
    rows : label, and kind and name (without side) of the figure.
    missing : what stands where a curve does not have the figure.
    of_body : whether the figures of a side are the whole body's, if both legs were like that one:
        the mean of both is shown, because two numbers would be added up.
    """

    title: str
    unit: str
    digits: int
    rows: tuple[tuple[str, str, str], ...]
    missing: str = ""
    of_body: bool = False

    @property
    def columns(self) -> tuple[str, ...]:
        """What there is a figure of: both sides, or the body."""
        return ("body",) if self.of_body else SIDES

    def figure(self, figures: Figures, kind: str, name: str, column: str) -> float | None:
        """That of a row in one of the `columns`; None where it is not known."""
        sides = SIDES if self.of_body else (column,)
        values = [figures.get(kind, {}).get(f"{name}_{side[0]}") for side in sides]
        known = [value for value in values if value is not None]
        return sum(known) / len(known) if known else None


@dataclass(frozen=True)
class Quantity:
    """A quantity that follows from angles, moments and forces.

    Attributes
    ----------
    name : in files and the names of panels ("power/hip_flexion").
    title : on pages.
    axis : what its curves are called beside their axis, without the unit.
    unit : of its curves.
    note : signs, method and source, in sentences, below its figure.
    needs : of a record; a comparison with what is not recorded of these is not judged.
    curves : title of each, by name without side.
    of_curves : from the curves of a walk (n, 101) or a record (101,); None without a whole cycle
        or where a curve is missing.
    of_muscles : from the muscles of a gait, for what curves do not tell: it is then only in files
        that were written with the motion and its loads at hand.
    figures : unit of each kind of figure.
    figures_of : figures from its curves (101,), by name with side; those that only `of_curves`
        knows are not among them.
    per_metre : kinds of figures, a rate each, and what they are called over the walking speed.
    tables : of its figures.
    measures : what a walk is judged by.
    of_time : from a motion (T,), by name with side, in `time_unit`; None if that is not defined.
    shown : what pages on one gait show of it, its curves and figures, its figures, or nothing:
        then it is in files, exports and comparisons only.
    of_person : whether it is the person's own, where curves are of what is compared: a kg is one of
        the person, not of person and load, and hip moments are about the model's own hips, not
        about the record's.
    """

    name: str
    title: str
    axis: str
    unit: str
    note: str
    needs: tuple[RecordedQuantity, ...]
    curves: Mapping[str, str]
    of_curves: Callable[[Curves, StrideTimes], Found | None] = lambda curves, times: None
    of_muscles: Callable[[MuscleGait], Found | None] | None = None
    figures: Mapping[str, str] = field(default_factory=dict)
    figures_of: Callable[[Mapping[str, Array]], Figures] = lambda curves: {}
    per_metre: Mapping[str, str] = field(default_factory=dict)
    tables: tuple[FigureTable, ...] = ()
    measures: tuple[QuantityMeasure, ...] = ()
    of_time: Callable[[OverTime], Mapping[str, Array]] | None = None
    time_unit: str = ""
    shown: Literal["curves", "figures", "nothing"] = "curves"
    of_person: bool = False

    @property
    def axis_label(self) -> str:
        """What stands beside the axis of its curves: "force, BW"."""
        return self.axis if self.unit == "1" else f"{self.axis}, {self.unit}"

    def panels(self) -> list[str]:
        """The names of its panels, "name/curve"."""
        return [f"{self.name}/{curve}" for curve in self.curves]

    def again(self, found: Found) -> Found:
        """The same curves with the figures that follow from them as they are defined now."""
        return Found(found.curves, {**found.figures, **self.figures_of(found.curves)})

    def at_speed(self, found: Found, speed: float | None) -> Found:
        """The same with its figures over the walking `speed`, m/s, where that is known."""
        if not self.per_metre or speed is None or not speed > 0.0:
            return found
        over = {
            name: {
                each: None if value is None else value / speed
                for each, value in found.figures.get(kind, {}).items()
            }
            for kind, name in self.per_metre.items()
        }
        return Found(found.curves, {**found.figures, **over})
