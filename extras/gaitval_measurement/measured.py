"""What an import asks for at its end: faults of the measurement, estimated and said, and corrected
where the user asks for it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side
from gaitval.gait.cycles import AverageCurve
from gaitval.session.request import Tell
from gaitval.session.session import Import
from gaitval_measurement.bands import Bands, bands
from gaitval_measurement.correct import corrected, wanted
from gaitval_measurement.estimate import Examined, examined
from gaitval_measurement.page import (
    SHOWN,
    BandRow,
    FitRow,
    band_rows,
    curves_with_bands,
    draw_bands,
    fits,
)
from gaitval_measurement.said import FaultRow, rows, unused, warnings
from gaitval_measurement.standing import standing_of


@dataclass(frozen=True)
class Measurement:
    """What forces and markers of a session say of each other.

    Attributes
    ----------
    faults : a line of the table for each fault that was looked for.
    seen : the estimate itself.
    uncorrected : mean moments (Nm/kg) and forces (body weights) as recorded, by name and side,
        where a correction was asked for; else empty.
    bands : of the mean curves.
    curves : what is drawn, of `page.curves_with_bands`.
    fits : how groups of data fit the noise model.
    template : of this part of the page.
    """

    faults: tuple[FaultRow, ...]
    seen: Examined
    uncorrected: dict[str, AverageCurve | dict[Side, AverageCurve]]
    bands: Bands | None = None
    curves: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    fits: Sequence[FitRow] = ()
    template: str = "gaitval_measurement:measurement.html.j2"

    def columns(self) -> dict[str, Array]:
        """Half of the width of each band of 90 %, (101,) by its column of `curves.csv`."""
        half = {} if self.bands is None else self.bands.half
        return {f"{name}_band90": values for name, values in half.items()}

    def uncertainty(self) -> dict[str, float]:
        """Half of the median width of each band, and of those of lengths: the subject's file."""
        if self.bands is None:
            return {}
        half = {name: float(np.median(values)) for name, values in self.bands.half.items()}
        half |= {f"length_{name}": m for name, m in self.bands.lengths.items()}
        return {name: value for name, value in half.items() if np.isfinite(value)}

    def drawings(self) -> dict[str, Callable[[], str]]:
        """The figures of the page."""
        return {"bands": partial(draw_bands, self.curves)} if self.curves else {}

    def band_rows(self) -> list[BandRow]:
        """Rows of the page's table of bands."""
        return [] if self.bands is None else band_rows(self.curves, self.bands)

    def band_records(self) -> dict[str, dict[str, object]]:
        """The bands by curve and length (m), with the sources of their variance: `import.json`."""
        if self.bands is None:
            return {}
        lengths = {f"length_{name}": np.array([m]) for name, m in self.bands.lengths.items()}
        return {
            name: {"half": values.tolist(), "sources": dict(self.bands.shares[name])}
            for name, values in (self.bands.half | lengths).items()
        }


def said_bands(found: Bands) -> str:
    """The widths of the sagittal bands, and what they come from, in a sentence."""
    parts = []
    for kind, factor, unit in (("angle", 180.0 / np.pi, "°"), ("moment", 1.0, " Nm/kg")):
        for joint in SHOWN:
            names = [f"{kind}_{joint}_{side}" for side in "rl"]
            there = [name for name in names if name in found.half]
            if there:
                half = factor * float(np.median([np.median(found.half[n]) for n in there]))
                source, share = found.shares[there[0]][0]
                digits = 1 if kind == "angle" else 2
                parts.append(
                    f"{joint} {kind} ± {half:.{digits}f}{unit} ({100 * share:.0f} % {source})"
                )
    remedy, share = found.remedy
    return (
        f"bands of 90 %, medians over the cycle: {'; '.join(parts)}. What would narrow them most "
        f"({100 * share:.0f} % of their variance): {remedy}"
    )


def measured(found: Import, tell: Tell) -> Import:
    """The import `found` with the estimate of its faults, and warnings of those that matter.

    Each is said with `tell`. With `--correct`, moments and forces are those of corrected plates,
    and the estimate is that before. Without forces of both feet, or with an aid that carries what
    no plate shows, nothing is looked for; there is a warning if none of the plates' forces is used.

    Raises
    ------
    ConfigurationError : `--correct` names a fault that cannot be corrected.
    """
    request = found.request
    kinds = wanted(request.correct)
    if request.aid is not None:
        return found
    if not found.forces:
        flag = unused(found.trials)
        tell("warnings", str(flag))
        decisions = (*found.decisions, ("warnings", str(flag)))
        return replace(found, of_means=(flag, *found.of_means), decisions=decisions)
    stood = standing_of(request, found.session)
    seen = examined(found.body.model, found.trials, request.mass_kg, request.height_m, stood)
    if seen is None:
        return found
    said: list[tuple[str, str]] = []
    around = bands(found, seen)

    def noted(step: str, text: str) -> None:
        said.append((step, text))
        tell(step, text)

    flags = warnings(seen)
    for flag in flags:
        noted("warnings", str(flag))
    curves = {} if around is None else curves_with_bands(found, around)
    measurement = Measurement(rows(seen), seen, {}, around, curves, fits(seen))
    if around is not None:
        noted("uncertainty", said_bands(around))
    result = found
    if kinds:
        result = corrected(found, seen, kinds, noted)
        before: dict[str, AverageCurve | dict[Side, AverageCurve]] = {**found.moments}
        before["forces"] = {**found.forces}
        measurement = replace(measurement, uncorrected=before)
    return replace(
        result,
        of_means=(*flags, *result.of_means),
        decisions=(*result.decisions, *said),
        measurement=measurement,
    )
