"""What an import asks for at its end: faults of the measurement, estimated and said, and corrected
where the user asks for it.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Set
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import Side, split_side
from gaitval.findings.markers import SMOOTHED
from gaitval.findings.motion import WEIGHT
from gaitval.findings.plates import OUTSIDE_FOOT, SATURATED, UNLOADED
from gaitval.findings.stances import (
    BRAKING,
    EXCHANGED_AXES,
    FREE_MOMENT,
    INWARD,
)
from gaitval.gait.cycles import AverageCurve
from gaitval.gait.quality_flags import QualityFlag
from gaitval.session.measurement.balance import trials_of
from gaitval.session.measurement.bands import AXES, Bands, bands
from gaitval.session.measurement.correct import corrected, wanted
from gaitval.session.measurement.estimate import Examined, FoundFault, examined
from gaitval.session.measurement.fault_text import FaultRow, rows, unused, warnings
from gaitval.session.measurement.kinds import KINDS
from gaitval.session.measurement.misplaced import (
    KNOWN_BY,
    knee_forward,
    knee_warnings,
    moved_warnings,
    standing_warnings,
)
from gaitval.session.measurement.page import (
    SHOWN,
    TITLES,
    BandRow,
    band_rows,
    curves_with_bands,
    draw_bands,
)
from gaitval.session.measurement.standing import standing_of
from gaitval.session.request import Notify
from gaitval.session.session import Import
from gaitval.session.standing import standing_places

_OF_WEIGHT: Final = frozenset(("gain", "vertical gain", "offset", "mass"))
_OF_A_PLATE: Final = frozenset(name for name, kind in KINDS.items() if "plate" in kind.whose)
_OF_A_FOOT: Final = frozenset(("foot", "foot turned"))
TOLD: Final[Mapping[str, Set[str]]] = {
    # with a wrong mass or unit, a plate with the right forces looks wrong by as much
    WEIGHT.name: _OF_WEIGHT,
    SATURATED.name: _OF_WEIGHT,
    UNLOADED.name: _OF_WEIGHT | {"moment gain", "place"},
    BRAKING.name: {"fore-aft sign"},
    INWARD.name: {"sideways sign"},
    FREE_MOMENT.name: {"free moment sign"},
    # a horizontal force that is another's looks like each of these on every plate
    EXCHANGED_AXES.name: _OF_A_PLATE,
    OUTSIDE_FOOT.name: _OF_A_PLATE | _OF_A_FOOT,
    SMOOTHED.name: {"markers low-passed", "one-way filter of the markers"},
}
"""Checks whose warnings say better what looks like faults of these kinds, or like something else.
"""
UNSHOWN: Final = 15.0
"""Degrees; half of a band of 90 % of a sagittal angle is 3 to 8 in recordings that show it. Two
markers on a foot do not show its subtalar angle (16)."""


@dataclass(frozen=True)
class Measurement:
    """What forces and markers of a session say of each other.

    Attributes
    ----------
    faults : a line of the table for each fault that was looked for.
    seen : the estimate itself; None where no fault was looked for.
    uncorrected : mean moments (Nm/kg) and forces (body weights) as recorded, by name and side,
        where a correction was asked for; else empty.
    bands : of the mean curves.
    curves : what is drawn, of `page.curves_with_bands`.
    template : of this part of the page.
    """

    faults: tuple[FaultRow, ...]
    seen: Examined | None
    uncorrected: dict[str, AverageCurve | dict[Side, AverageCurve]]
    bands: Bands | None = None
    curves: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    template: str = "gaitval.session.measurement:measurement.html.j2"

    def columns(self) -> dict[str, Array]:
        """Half of the width of each band of 90 %, and moments and forces before a correction,
        (101,) by their columns of `curves.csv`.
        """
        half = {} if self.bands is None else self.bands.half
        columns = {f"{name}_band90": values for name, values in half.items()}
        for name, curve in self.uncorrected.items():
            if isinstance(curve, dict):
                for side, force in curve.items():
                    for axis, way in enumerate(AXES):
                        column = f"force_{way}_{side[0]}_uncorrected"
                        columns[column] = np.asarray(force.mean)[:, axis]
            else:
                columns[f"moment_{name}_uncorrected"] = np.asarray(curve.mean)
        return columns

    def corrected_rows(
        self, moments: Mapping[str, tuple[Array, Array]]
    ) -> list[tuple[str, float, float]]:
        """Of the sagittal `moments` (mean and deviation by name, Nm/kg), after a correction: the
        curve, and its largest value as recorded and corrected.
        """
        found = []
        for name, curve in self.uncorrected.items():
            if name[:-2] in SHOWN and name in moments and not isinstance(curve, dict):
                title = f"{TITLES[name[:-2]]}, {'right' if name[-1] == 'r' else 'left'}"
                before, after = (
                    float(max(each, key=abs)) for each in (curve.mean, moments[name][0])
                )
                found.append((title, before, after))
        return found

    def uncertainty(self) -> dict[str, float]:
        """Half of the median width of each band, and of those of lengths: the subject's file."""
        if self.bands is None:
            return {}
        half = {name: float(np.median(values)) for name, values in self.bands.half.items()}
        half |= {f"length_{name}": m for name, m in self.bands.lengths.items()}
        return {name: value for name, value in half.items() if np.isfinite(value)}

    def drawings(self, extensor_positive: bool = False) -> dict[str, Callable[[], str]]:
        """The figures of the page; moments the way round that clinical reports draw them, or as
        they are counted.
        """
        draw = partial(draw_bands, self.curves, extensor_positive=extensor_positive)
        return {"bands": draw} if self.curves else {}

    def band_rows(self) -> list[BandRow]:
        """Rows of the page's table of bands."""
        return [] if self.bands is None else band_rows(self.curves, self.bands)

    def at_once(self) -> float | None:
        """`Bands.at_once`; None without bands."""
        return None if self.bands is None else self.bands.at_once

    def band_records(self) -> dict[str, dict[str, object]]:
        """The bands by curve and length (m), with the sources of their variance: `import.json`."""
        if self.bands is None:
            return {}
        lengths = {f"length_{name}": np.array([m]) for name, m in self.bands.lengths.items()}
        again = self.bands.again
        return {
            name: {"half": values.tolist(), "sources": dict(self.bands.shares[name])}
            | ({"again": again[name].tolist()} if name in again else {})
            for name, values in (self.bands.half | lengths).items()
        }


def unshown(found: Bands) -> Iterator[QualityFlag]:
    """That the markers do not show a sagittal or subtalar angle, with how well it is known."""
    titles = {**TITLES, "subtalar_angle": "Subtalar"}
    half = {
        name.removeprefix("angle_"): float(np.degrees(np.median(each)))
        for name, each in found.half.items()
        if name.startswith("angle_") and name[6:-2] in titles
    }
    wide = {name: size for name, size in half.items() if size > UNSHOWN}
    if wide:
        sides = {name: split_side(name) for name in wide}
        few = ", ".join(
            f"{side} {titles[joint].lower()} ± {wide[name]:.0f}°"
            for name, (side, joint) in sides.items()
        )
        yield QualityFlag(
            "shown angles", "angles", max(wide.values()), UNSHOWN, "deg",
            f"the markers hardly show {few}: a segment beside it has too few that are seen in the "
            "walk. Look at what was left out, and label more of its markers",
        )  # fmt: skip


def bands_text(found: Bands) -> str:
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
                what = f"{TITLES[joint].lower()} {kind}"
                parts.append(f"{what} ± {half:.{digits}f}{unit} ({100 * share:.0f} % {source})")
    remedy, share = found.remedy
    return (
        f"bands of 90 %, medians over the cycle: {'; '.join(parts)}. What would narrow them most "
        f"({100 * share:.0f} % of their variance): {remedy}"
    )


def _of_places(found: Import) -> Iterator[QualityFlag]:
    """What the walk says of the places of the markers: of the knees', else of all that are in
    standing, too; and of a standing trial in which the person did not stand as people walk.
    """
    marker_set, body = found.session.marker_set, found.body
    landmarks, stood = marker_set.landmarks, standing_places(found.session.standing)
    points = marker_set.on_landmarks({name: at.tolist() for name, at in stood.items()})
    of_knees = [*knee_warnings(knee_forward(body, found.trials, landmarks, points), landmarks)]
    yield from of_knees
    if found.request.stands_in_walk:
        return
    if not of_knees and not any(warning.check in KNOWN_BY for _, warning in found.warnings):
        yield from moved_warnings(body.model, body.markers, found.trials, landmarks)
    yield from standing_warnings(body.model, body.placement.standing, found.trials)


def untold(found: Iterable[FoundFault], checks: Set[str]) -> tuple[FoundFault, ...]:
    """Those of the faults `found` that no warning of the `checks` says better."""
    told = frozenset[str]().union(*(TOLD.get(check, ()) for check in checks))
    other = bool(checks & (TOLD.keys() - {FREE_MOMENT.name}))
    return tuple(
        each for each in found if not (other if each.fault is None else each.fault.kind in told)
    )


def _of_a_sign(found: FoundFault) -> bool:
    return found.fault is not None and found.fault.kind.endswith("sign")


def _legs(found: Import) -> float | None:
    """Length of thighs and shanks over that expected of the stature."""
    factors = [row.factor for row in found.body.scaled.table if row.segment in ("thigh", "shank")]
    return float(np.mean(factors)) if factors else None


def measured(found: Import, notify: Notify) -> Import:
    """The import `found` with the estimate of its faults, and warnings of those that matter.

    Each is said with `notify`. With `--correct`, moments and forces are those of corrected plates,
    as are the bands, and the estimate is that before; ConfigurationError if it names a fault that
    cannot be corrected. Without forces of both feet, or with an aid that carries what no plate
    shows, no fault is looked for; there is a warning if none of the plates' forces is used.
    """
    request = found.request
    kinds = wanted(request.correct)
    few: list[tuple[str, str]] = []

    def noted(step: str, text: str) -> None:
        few.append((step, text))
        notify(step, text)

    def look(at: Import) -> Examined | None:
        if request.aid is not None or not at.forces:
            return None
        stood = standing_of(request, at.session)
        trials = trials_of(at.body.model, at.trials)
        return examined(trials, request.mass_kg, request.height_m, stood, _legs(at))

    seen = left = look(found)
    checks = {warning.check for _, warning in found.warnings}
    flags = [] if seen is None else [*warnings(untold(seen.found, checks), kinds)]
    if request.aid is None and not found.forces and any(walk.forces for walk in found.trials):
        flags = [unused(found.trials)]
    flags += [*_of_places(found)]
    for flag in flags:
        noted("warnings", str(flag))
    result, uncorrected = found, dict[str, AverageCurve | dict[Side, AverageCurve]]()
    reversed_ = [] if seen is None else [each for each in seen.found if _of_a_sign(each)]
    if kinds and reversed_:
        noted("correct", f"nothing is corrected before this: {reversed_[0].verdict}")
    elif kinds and seen is not None:
        result = corrected(found, seen, kinds, noted)
        uncorrected = {**found.moments, "forces": {**found.forces}}
        left = look(result)
    around = bands(result, left)
    measurement = None
    if around is not None:
        noted("uncertainty", bands_text(around))
        for flag in unshown(around):
            noted("warnings", str(flag))
            flags.append(flag)
        measurement = Measurement(
            () if seen is None else rows(seen),
            seen,
            uncorrected,
            around,
            curves_with_bands(result, around),
        )
    return replace(
        result,
        of_means=(*flags, *result.of_means),
        decisions=(*result.decisions, *few),
        measurement=measurement,
    )
