"""What a measurement is worth, for the page: the figure of the bands, and rows of its tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.measurement.bands import Bands, remedy_of
from gaitval.scaling.hip_regressions import TITLES as HIP_TITLES
from gaitval.session.session import Import

SHOWN: Final = ("hip_flexion", "knee_angle", "ankle_angle")
"""Joints whose bands are drawn and said."""
UNITS: Final = {"angle": (180.0 / np.pi, "°", 1), "moment": (1.0, "Nm/kg", 2)}
"""Factor, unit and digits."""
TITLES: Final = {"hip_flexion": "Hip flexion", "knee_angle": "Knee", "ankle_angle": "Ankle"}

_DrawnCurves = Mapping[str, tuple[Array, Array]]


@dataclass(frozen=True)
class BandRow:
    """The band of a curve: half of its median width in `unit`, its sources in words, the largest
    of them, and what would make that one smaller.
    """

    curve: str
    half: float
    unit: str
    digits: int
    sources: str
    cause: str
    remedy: str


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
        rows.append(BandRow(title, float(np.median(half)), unit, digits, *_causes(bands, name)))
    for name, half_m in bands.lengths.items():
        segment, _, side = name.rpartition("_")
        if segment in ("thigh", "shank") and half_m > 0.0:
            title = f"{segment.capitalize()}, length, {side}"
            rows.append(BandRow(title, 1000 * half_m, "mm", 0, *_causes(bands, f"length_{name}")))
    return rows


def remedies(rows: Sequence[BandRow]) -> list[tuple[str, str]]:
    """What would narrow the bands of `rows`, that of most of them last, and of which, in words."""
    curves: dict[str, list[str]] = {}
    for row in rows:
        curves.setdefault(row.remedy, []).append(row.curve)
    *few, most = sorted(curves, key=lambda remedy: len(curves[remedy])) if curves else [""]
    of = {
        remedy: "; ".join(each[0].lower() + each[1:] for each in curves[remedy]) for remedy in few
    }
    return [*of.items(), (most, "all others" if few else "all curves")]


def _causes(bands: Bands, name: str) -> tuple[str, str, str]:
    """The largest sources of a curve's variance, in words, the largest of all, and its remedy."""
    few = [f"{100 * share:.0f} % {of}" for of, share in bands.shares[name][:3]]
    return "; ".join(few), few[0], remedy_of(bands.shares[name][0][0])


def draw_bands(curves: _DrawnCurves) -> str:
    """The `curves` with their bands, angles above moments, as SVG."""
    # matplotlib is loaded only where a page is written
    from gaitval.reporting.drawing import new_figure, svg
    from gaitval.reporting.figures import COLOURS, PERCENT, STYLES, WALK_WIDTH

    kinds = [kind for kind in UNITS if any(name.startswith(kind) for name in curves)]
    with new_figure(1.75 * len(kinds)) as figure:
        panels = figure.subplots(len(kinds), len(SHOWN), sharex=True, squeeze=False)
        for row, kind in enumerate(kinds):
            panels[row, 0].set_ylabel(f"{kind}, {UNITS[kind][1]}")
            for axes, joint in zip(panels[row], SHOWN, strict=True):
                if row == 0:
                    axes.set_title(TITLES[joint])
                for side in SIDES:
                    if f"{kind}_{joint}_{side[0]}" not in curves:
                        continue
                    mean, half = curves[f"{kind}_{joint}_{side[0]}"]
                    axes.fill_between(
                        PERCENT, mean - half, mean + half, color=COLOURS[side], alpha=0.22,
                        linewidth=0,
                    )  # fmt: skip
                    axes.plot(
                        PERCENT, mean, color=COLOURS[side], linestyle=STYLES[side],
                        linewidth=WALK_WIDTH,
                    )  # fmt: skip
        for axes in panels[-1]:
            axes.set_xlim(0, 100)
            axes.set_xlabel("% of gait cycle")
        return svg(figure, "bands")


def hip_curves(found: Import, bands: Bands) -> dict[str, tuple[str, Array, Array | None]]:
    """Hip flexion moments, Nm/kg, (101,): by "chosen_r" the title, the mean and half of its band,
    and by "bell_r" and others what the other regressions would make of it.
    """
    curves: dict[str, tuple[str, Array, Array | None]] = {}
    of_trial = found.request.joint_centres == "functional"
    title = "functional" if of_trial else HIP_TITLES[found.request.hip_regression]
    for side in "rl":
        name = f"hip_flexion_{side}"
        moment, half = found.moments.get(name), bands.half.get(f"moment_{name}")
        if moment is None or half is None:
            continue
        curves[f"chosen_{side}"] = (found.given_hips or title, np.asarray(moment.mean), half)
        for other, moved in bands.by_hip.items():
            more = moved.get(f"moment_{name}")
            if more is not None:
                curves[f"{other}_{side}"] = (HIP_TITLES[other], moment.mean + more, None)
    return curves


def hip_rows(
    curves: Mapping[str, tuple[str, Array, Array | None]], bands: Bands
) -> list[tuple[str, float, float, float]]:
    """Of each other regression: its title, the largest difference of the hip flexion moment
    (Nm/kg), and the mean one of the angles of hip and knee, degrees.
    """
    rows = []
    for name, moved in bands.by_hip.items():
        of = [v for n, v in moved.items() if n.startswith("moment_hip_flexion")]
        if (of and f"{name}_r" in curves) or f"{name}_l" in curves:
            largest = max((float(v[np.abs(v).argmax()]) for v in of), key=abs)
            angles = [
                float(np.degrees(np.mean([v.mean() for n, v in moved.items() if n[:-2] == joint])))
                for joint in ("angle_hip_flexion", "angle_knee_angle")
            ]
            rows.append((HIP_TITLES[name], largest, angles[0], angles[1]))
    return rows


def draw_hips(curves: Mapping[str, tuple[str, Array, Array | None]]) -> str:
    """The hip flexion moments by each regression, with the band of the chosen one, as SVG."""
    # matplotlib is loaded only where a page is written
    from gaitval.reporting.drawing import new_figure, svg
    from gaitval.reporting.figures import COLOURS, PERCENT, WALK_WIDTH

    with new_figure(2.2) as figure:
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for side, axes in zip(SIDES, panels, strict=True):
            axes.set_title(f"Hip flexion moment, {side}")
            styles = iter(("--", ":", "-.", (0, (5, 1)), (0, (1, 1)), (0, (3, 1, 1, 1))))
            for name, (title, mean, half) in curves.items():
                if not name.endswith(f"_{side[0]}"):
                    continue
                if half is not None:
                    axes.fill_between(
                        PERCENT, mean - half, mean + half, color=COLOURS[side], alpha=0.22,
                        linewidth=0,
                    )  # fmt: skip
                    axes.plot(PERCENT, mean, color=COLOURS[side], linewidth=WALK_WIDTH, label=title)
                else:
                    axes.plot(
                        PERCENT, mean, color="#404040", linewidth=0.8, linestyle=next(styles),
                        label=title,
                    )  # fmt: skip
            axes.set_xlim(0, 100)
            axes.set_xlabel("% of gait cycle")
        panels[0].set_ylabel("moment, Nm/kg")
        # the first side may have no moments
        shown = next((each for each in panels if each.lines), None)
        if shown is not None:
            shown.legend(fontsize=7.0)
        return svg(figure, "hips")
