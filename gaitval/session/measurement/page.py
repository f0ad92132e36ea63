"""What a measurement is worth, for the page: the figure of the bands, and rows of its tables."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.session.measurement.bands import Bands
from gaitval.session.session import Import

SHOWN: Final = ("hip_flexion", "knee_angle", "ankle_angle")
"""Joints whose bands are drawn and said."""
UNITS: Final = {"angle": (180.0 / np.pi, "°", 1), "moment": (1.0, "Nm/kg", 2)}
"""Factor, unit and digits."""
TITLES: Final = {"hip_flexion": "Hip flexion", "knee_angle": "Knee", "ankle_angle": "Ankle"}

_DrawnCurves = Mapping[str, tuple[Array, Array]]


@dataclass(frozen=True)
class BandRow:
    """The band of a curve: half of its median width in `unit`, and its sources in words."""

    curve: str
    half: float
    unit: str
    digits: int
    sources: str


def curves_with_bands(found: Import, bands: Bands) -> dict[str, tuple[Array, Array]]:
    """Mean and half of the band of the curves that are drawn, (101,) each, in drawn units."""
    drawn = {}
    for kind, of in (("angle", found.angles), ("moment", found.moments)):
        for name, curve in of.items():
            half = bands.half.get(f"{kind}_{name}")
            if name[:-2] in SHOWN and half is not None and np.isfinite(curve.mean).any():
                factor = UNITS[kind][0]
                drawn[f"{kind}_{name}"] = factor * np.asarray(curve.mean), factor * half
    return drawn


def band_rows(curves: _DrawnCurves, bands: Bands) -> list[BandRow]:
    """A row for each of the drawn `curves`, and for the lengths of the legs."""
    rows = []
    for name, (_, half) in curves.items():
        kind, _, joint = name.partition("_")
        _, unit, digits = UNITS[kind]
        side = "right" if joint.endswith("_r") else "left"
        title = f"{TITLES[joint[:-2]]}, {kind}, {side}"
        rows.append(BandRow(title, float(np.median(half)), unit, digits, _sources(bands, name)))
    for name, half_m in bands.lengths.items():
        segment, _, side = name.rpartition("_")
        if segment in ("thigh", "shank") and half_m > 0.0:
            title = f"{segment.capitalize()}, length, {side}"
            rows.append(BandRow(title, 1000 * half_m, "mm", 0, _sources(bands, f"length_{name}")))
    return rows


def _sources(bands: Bands, name: str) -> str:
    """The largest sources of a curve's variance, in words."""
    return "; ".join(f"{100 * share:.0f} % {of}" for of, share in bands.shares[name][:3])


def draw_bands(curves: _DrawnCurves, *, extensor_positive: bool = False) -> str:
    """The `curves` with their bands, angles above moments, as SVG."""
    # matplotlib is loaded only where a page is written
    from gaitval.reporting.grids import DrawnCurve, Panel, grid

    def panel(kind: str, joint: str) -> Panel:
        names = {side: f"{kind}_{joint}_{side[0]}" for side in SIDES}
        drawn = [DrawnCurve(s, *curves[name]) for s, name in names.items() if name in curves]
        return Panel(f"{kind}s/{joint}", tuple(drawn))

    return grid(
        [
            [panel(kind, joint) for joint in SHOWN]
            for kind in UNITS
            if any(name.startswith(kind) for name in curves)
        ],
        height=1.6,
        figure_name="bands",
        words=("", "measured"),
        spread="band of 90 %",
        linked=False,
        extensor_positive=extensor_positive,
    )
