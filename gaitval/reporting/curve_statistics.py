"""The report's section on whole curves: where the walk differs, how alike, how far from healthy."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from gaitval.coordinates import SIDES
from gaitval.metrics.comparison import FORCES, JOINT_ANGLES, JOINT_MOMENTS, PELVIS_ANGLES
from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE, load_controls
from gaitval.metrics.walk_statistics import BAND
from gaitval.reporting.drawing import Draw, new_figure, svg
from gaitval.reporting.figures import COLOURS, NAMES, PERCENT, RECORD_COLOUR

Json = Mapping[str, Any]

_ROWS: Final = (
    ("angles", ("hip_flexion", "knee_angle", "ankle_angle")),
    ("moments", ("hip_flexion", "knee_angle", "ankle_angle")),
    ("forces", FORCES),
)
_ALL: Final = (
    ("angles", (*JOINT_ANGLES, *PELVIS_ANGLES)),
    ("moments", JOINT_MOMENTS),
    ("forces", FORCES),
)
_SHORT: Final = {
    "pelvis_tilt": "pelvis\ntilt",
    "hip_flexion": "hip\nflexion",
    "knee_angle": "knee\nflexion",
    "ankle_angle": "ankle\nflexion",
    "pelvis_list": "pelvis\nlist",
    "hip_adduction": "hip\nadduct.",
    "pelvis_rotation": "pelvis\nrotation",
    "hip_rotation": "hip\nrotation",
    "foot_progression": "foot\nprogr.",
    "total": "GPS",
}


def drawings(metrics: Json) -> dict[str, Draw]:
    """The figures of the section by name, as SVG; none for metrics without it."""
    if metrics.get("curve_statistics") is None:
        return {}
    # no text from outside is in them
    return {
        "differences": partial(differences, metrics),
        "gait_profile": partial(profile, metrics["curve_statistics"]["profiles"]),
    }


def differences(metrics: Json) -> str:
    """Walk less record, mean ± SD over the cycles, and where the difference is more than the
    scatter of the cycles.
    """
    walk = metrics["walks"][metrics["final"]]["curves"]
    with new_figure(5.0) as figure:
        grid = figure.subplots(len(_ROWS), 3, sharex=True)
        for panels, (kind, names) in zip(grid, _ROWS, strict=True):
            unit = metrics["units"][kind].replace("deg", "°")
            for axes, name in zip(panels, names, strict=True):
                _difference(axes, metrics, walk[kind], kind, name)
                axes.set_title(f"{NAMES[name]}{' moment' if kind == 'moments' else ''}")
                axes.set_xlim(0, 100)
            panels[0].set_ylabel(f"walk − record, {unit}")
        for axes in grid[-1]:
            axes.set_xlabel("% of gait cycle")
        figure.legend(
            *grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=len(SIDES)
        )
        return svg(figure, "differences")


def _difference(axes: Axes, metrics: Json, walk: Json, kind: str, name: str) -> None:
    """Both sides of one curve; bars along the lower edge mark the regions."""
    axes.axhline(0.0, color="#b0b0b0", linewidth=0.5, zorder=0)
    for place, side in zip((0.02, 0.055), SIDES, strict=True):
        key = f"{name}_{side[0]}"
        recorded = _plain(metrics["record"]["curves"][kind][key])
        mean, spread = _plain(walk[key]["mean"]) - recorded, _plain(walk[key]["sd"])
        axes.plot(PERCENT, mean, color=COLOURS[side], label=side, linewidth=1.0, zorder=3)
        axes.fill_between(
            PERCENT, mean - spread, mean + spread, color=COLOURS[side], alpha=0.25, linewidth=0
        )
        for region in metrics["curve_statistics"]["curves"][kind][key]["regions"]:
            axes.plot(
                (region["first"], region["last"] or 0.5),
                (place, place),
                transform=axes.get_xaxis_transform(),
                color=COLOURS[side],
                linewidth=2.2,
                solid_capstyle="butt",
            )
    axes.margins(y=0.2)


def _plain(values: Sequence[float | None]) -> Any:
    return np.array([np.nan if value is None else value for value in values])


def profile(profiles: Json) -> str:
    """Movement Analysis Profile of record and walk beside healthy adults, and the total score."""
    controls = load_controls()
    names = [*profiles["variables"], "total"]
    healthy = {**controls.scores, "total": controls.total}
    at = np.arange(len(names), dtype=float)
    at[-1] += 0.5
    with new_figure(2.4) as figure:
        axes = figure.subplots()
        for x, name in zip(at, names, strict=True):
            mean, spread = healthy[name]
            axes.bar(x, 2 * spread, 0.8, bottom=mean - spread, color="#e2e2e2", zorder=0)
            axes.plot((x - 0.4, x + 0.4), (mean, mean), color="#909090", linewidth=0.8, zorder=1)
        axes.bar(0, 0, color="#e2e2e2", label=f"{controls.people} healthy adults, mean ± SD")
        for offset, side in zip((0.18, -0.18), SIDES, strict=True):
            for which, marker in (("record", "o"), ("walk", "D")):
                if profiles[which] is None:  # its angles were not recorded
                    continue
                scores = [profiles[which]["scores"][f"{n}_{side[0]}"] for n in names[:-1]]
                colour = RECORD_COLOUR if which == "record" else COLOURS[side]
                axes.plot(
                    at + offset,
                    [*scores, profiles[which][side]],
                    marker,
                    color=colour,
                    markerfacecolor=colour if which == "walk" else "white",
                    markersize=4.5,
                    label=f"{which}, {side}" if which == "walk" else f"record, {side}",
                )
        axes.set_xticks(at, [_SHORT[name] for name in names], fontsize=7.5)
        axes.tick_params(axis="x", length=0)
        axes.set_ylim(bottom=0)
        axes.set_ylabel("RMS from their mean, °")
        figure.legend(loc="outside upper center", ncols=3)
        return svg(figure, "profile")


def tables(metrics: Json) -> dict[str, Any] | None:
    """What the section's tables show; None for metrics without it."""
    found = metrics.get("curve_statistics")
    if found is None:
        return None
    return {
        "alpha": found["alpha"],
        "permutations": found["permutations"],
        "curves": [
            {
                "name": NAMES[name] + (" moment" if kind == "moments" else ""),
                "sides": [_side(found["curves"][kind][f"{name}_{side}"]) for side in "rl"],
            }
            for kind, names in _ALL
            for name in names
        ],
        "bands": [
            {
                "name": NAMES[name] + (" moment" if kind == "moments" else ""),
                "sides": [found["bands"][kind][f"{name}_{side}"] for side in "rl"],
            }
            for kind in found["bands"]
            for name in _ROWS[0][1]
        ],
        "band": BAND,
        "profiles": found["profiles"],
        "controls": load_controls(),
        "smallest": SMALLEST_DIFFERENCE,
    }


def _side(found: Json) -> dict[str, Any]:
    regions = found["regions"]
    width = sum(each["last"] - each["first"] + 1 for each in regions)
    tested = found["p"] is not None
    return {**found, "share": 100.0 * width / len(PERCENT) if tested else None}
