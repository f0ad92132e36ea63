"""Errors of a walk: from the measured curve, from the corrected one, about the walker's own hips.

A record is corrected before anything follows it: plates are moved, and the moments of the hip are
compared about the hip centres that the record's moments are about, which the reference finds. What
each of these changes stands beside the error. A change of a mean error by more than 3 % is named,
so that no error pays for another unseen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from gaitval._internal.text.number_text import number as number_text
from gaitval.coordinates import SIDES, split_side
from gaitval.metrics.acceptance import Baselines
from gaitval.metrics.comparison import mean_of_all, rms, rmse_of
from gaitval.metrics.curve_results import (
    CURVE_UNITS,
    HipCentres,
    Kind,
    MeasuredCurves,
    MeasuredErrors,
    RecordResult,
)
from gaitval.metrics.origin import curve_origin
from gaitval.metrics.results import ErrorRow, WalkResult
from gaitval.metrics.tolerances import UNITS, Measure, measured
from gaitval.metrics.typed import array, number

AS_MEASURED: Mapping[Kind, str] = {
    "moments": "moment_rmse_as_measured",
    "forces": "force_rmse_as_measured",
}
OWN_HIPS = "moment_rmse_own_hips"
"""Measures of the errors before the correction of the plates, and about the walker's own hips."""


def error_rows(walk: WalkResult, record: RecordResult, baselines: Baselines) -> list[ErrorRow]:
    """The errors of every recorded curve of a `walk` from its `record`, means over sides."""
    by_name: dict[tuple[Kind, str], list[str]] = {}
    for kind, curve, _ in walk.errors.items():
        if curve_origin(kind, curve, baselines.origins) == "recorded":
            by_name.setdefault((kind, split_side(curve)[1]), []).append(curve)
    return [_row(kind, name, curves, walk, record, baselines)
            for (kind, name), curves in by_name.items()]  # fmt: skip


def _row(
    kind: Kind,
    name: str,
    curves: Sequence[str],
    walk: WalkResult,
    record: RecordResult,
    baselines: Baselines,
) -> ErrorRow:
    corrected = [rmse_of(walk.errors.of(kind)[curve]) for curve in curves]
    before = _of_kind(walk.errors_as_measured, kind)
    own = _about_own_hips(walk.hip_centres) if kind == "moments" else {}
    best = [baselines.best(kind, curve) for curve in curves]
    return ErrorRow(
        kind=kind,
        curve=name,
        unit=CURVE_UNITS[kind],
        as_measured=mean_of_all([before.get(c, e) for c, e in zip(curves, corrected, strict=True)]),
        corrected=mean_of_all(corrected),
        own_hips=mean_of_all([own.get(c, e) for c, e in zip(curves, corrected, strict=True)]),
        correction=mean_of_all([_corrected_by(record, kind, curve) for curve in curves]),
        prediction=mean_of_all([None if each is None else each[1] for each in best]),
    )


def _of_kind(found: MeasuredErrors | None, kind: Kind) -> Mapping[str, float | None]:
    return {} if found is None or kind == "angles" else dict(getattr(found, kind))


def _about_own_hips(hips: HipCentres | None) -> dict[str, float | None]:
    """RMSE of the hips' moments about the walker's own hips, by curve; empty where they are."""
    if hips is None:
        return {}
    return {
        f"{name}_{side[0]}": error
        for side in SIDES
        for name, error in hips.of(side).rmse_about_model.items()
    }


def _corrected_by(record: RecordResult, kind: Kind, curve: str) -> float | None:
    """RMS difference that the correction of the plates makes to a measured curve."""
    measured_curves: MeasuredCurves | None = record.as_measured
    if measured_curves is None or kind == "angles":
        return 0.0
    before = getattr(measured_curves, kind)[curve]
    return number(rms(array(record.curves.of(kind)[curve]) - array(before)))


def uncorrected_measures(walk: WalkResult) -> list[Measure]:
    """The errors of moments and forces as measured, and of the hips' moments about the walker's own
    hips; equal to the others where nothing was corrected.
    """
    rows = []
    for kind, measure in AS_MEASURED.items():
        before = _of_kind(walk.errors_as_measured, kind)
        rows += [
            measured(measure, curve, before.get(curve, rmse_of(error)))
            for curve, error in walk.errors.of(kind).items()
        ]
    own = _about_own_hips(walk.hip_centres)
    rows += [
        measured(OWN_HIPS, curve, own.get(curve, rmse_of(walk.errors.moments[curve])))
        for curve in walk.errors.moments
        if curve.startswith("hip_")
    ]
    return rows


NAMED: Final = 0.03
"""A mean error that changed by more than this share of itself is named."""

_NAMES: Final[Mapping[str, str]] = {
    "angle_rmse": "{}",
    "moment_rmse": "{} moment",
    "force_rmse": "{} force",
    "moment_rmse_as_measured": "{} moment as measured",
    "force_rmse_as_measured": "{} force as measured",
    "moment_rmse_own_hips": "{} moment about own hips",
    "epsilon": "epsilon",
    "push_survival": "pushes lost",
}
"""Of the errors that are averaged, by measure."""


@dataclass(frozen=True)
class MeanError:
    """A mean error in words, and its unit."""

    name: str
    unit: str

    def changed(self, before: float, now: float) -> str:
        """The change in words: "hip rotation 2.60 -> 2.86 deg, +10 %"."""
        digits = 3 if self.unit in ("Nm/kg", "1") else 2
        first, last = number_text(before, digits), number_text(now, digits)
        unit = "" if self.unit == "1" else f" {self.unit}"
        share = f", {100.0 * (now / before - 1.0):+.0f} %" if before else ""
        return f"{self.name} {first} -> {last}{unit}{share}"


def error_name(measure: str, target: str) -> str:
    """What the error `measure` of a curve `target` is called, without its side."""
    curve = split_side(target)[1].replace("_", " ").replace("forward", "fore-aft")
    if measure.startswith("moment"):
        curve = curve.removesuffix(" flexion").removesuffix(" angle")
    return _NAMES[measure].format(curve)


def mean_errors(values: Mapping[tuple[str, str], float | None]) -> dict[MeanError, float]:
    """Every error of `values`, which are by measure and target: means over both sides, of
    pushes the share that is lost over all phases. What was not measured on a side is left out.
    """
    found: dict[MeanError, list[float | None]] = {}
    for (measure, target), value in values.items():
        if measure in _NAMES:
            error = MeanError(error_name(measure, target), UNITS[measure])
            lost = None if value is None else 100.0 - value
            found.setdefault(error, []).append(lost if measure == "push_survival" else value)
    means = {error: mean_of_all(each) for error, each in found.items()}
    return {error: mean for error, mean in means.items() if mean is not None}


def changed_errors(
    before: Mapping[MeanError, float], now: Mapping[MeanError, float]
) -> dict[MeanError, tuple[float, float]]:
    """What of the mean errors `before` is `now` larger or smaller by more than `NAMED`."""
    return {
        error: (then, now[error])
        for error, then in before.items()
        if error in now and abs(now[error] - then) > NAMED * then
    }
