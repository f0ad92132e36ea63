"""The report's section on whole curves: where the walk differs from the record, how similar they
are, and how far both are from healthy gait.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from gaitval.coordinates import SIDES, Side, split_side
from gaitval.datasets.subject import Subject
from gaitval.gait.healthy_controls import load_controls
from gaitval.metrics.curve_results import GaitProfiles, WalkStatistics
from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE, is_control
from gaitval.metrics.norms import BAND
from gaitval.metrics.typed import sided
from gaitval.quantities.joint_power import JOINTS
from gaitval.reporting.drawing import keys_of, legend_above, new_figure, svg
from gaitval.reporting.figures import BAND_COLOUR, COLOURS, NAMES, RECORD_COLOUR
from gaitval.reporting.tables import CURVES

_SHORT: Final = {
    "pelvis_tilt": "pelvis\ntilt",
    "hip_flexion": "hip\nflexion",
    "knee_angle": "knee\nflexion",
    "ankle_angle": "ankle\nflexion",
    "pelvis_list": "pelvis\nobliq.",
    "hip_adduction": "hip\nadduct.",
    "pelvis_rotation": "pelvis\nrotation",
    "hip_rotation": "hip\nrotation",
    "foot_progression": "foot\nprogr.",
    "total": "GPS",
}
_MARKERS: Final[Mapping[Side, str]] = {"right": ">", "left": "<"}
"""Symbols that point to their side; those of the record are hollow."""


def profile(profiles: GaitProfiles) -> str:
    """Movement Analysis Profile and score of record and walk in `profiles`, and of adults."""
    controls = load_controls()
    names = [*profiles.variables, "total"]
    healthy = {**controls.scores, "total": controls.side}
    at = np.arange(len(names), dtype=float)
    # a gap before the total, which is no angle
    at[-1] += 0.5
    label: str | None = "healthy adults, mean ± SD"
    with new_figure(2.8) as figure:
        axes = figure.subplots()
        for x, name in zip(at, names, strict=True):
            mean, spread = healthy[name]
            axes.bar(x, 2 * spread, 0.8, mean - spread, color=BAND_COLOUR, zorder=0, label=label)
            label = None
            axes.plot((x - 0.4, x + 0.4), (mean, mean), color="#808080", linewidth=0.8, zorder=1)
        for offset, side in zip((0.18, -0.18), SIDES, strict=True):
            for which, found in (("record", profiles.record), ("walk", profiles.walk)):
                if found is None:  # its angles were not recorded
                    continue
                scores = [found.scores[f"{n}_{side[0]}"] for n in names[:-1]]
                colour = RECORD_COLOUR if which == "record" else COLOURS[side]
                axes.plot(
                    at + offset,
                    [*scores, found.of(side)],
                    marker=_MARKERS[side],
                    linestyle="none",
                    color=colour,
                    # hollow, so that they look alike on a band and in the legend, in both modes
                    markerfacecolor=colour if which == "walk" else "none",
                    markersize=5.0,
                    label=f"{which}, {side}",
                )
        axes.set_xticks(at, [_SHORT[name] for name in names], fontsize=7.5)
        axes.tick_params(axis="x", length=0)
        axes.set_ylim(bottom=0)
        axes.set_ylabel("RMS from their mean, °")
        legend_above(figure, keys_of(axes), columns=3)
        return svg(figure, "profile")


def tables(found: WalkStatistics, subject: Subject) -> dict[str, object]:
    """What the section's tables show of the statistics `found` of the walk of `subject`."""
    return {
        "alpha": found.alpha,
        "permutations": found.permutations,
        "curves": [
            {
                "name": _title(kind, name),
                "sides": [found.curves.of(kind)[key] for key in sided([name])],
            }
            for kind, names, _ in CURVES
            for name in names
        ],
        "bands": [
            {
                "name": _title(kind, name),
                "kind": kind,
                "people": getattr(found.band_people, kind),
                "sides": [found.bands[kind][key] for key in sided([name])],
            }
            for kind in found.bands
            for name in JOINTS
        ],
        "band": BAND,
        "profiles": found.profiles,
        "sides": _profile_sides(found.profiles),
        "furthest": _furthest(found.profiles),
        "controls": load_controls(),
        "is_control": is_control(subject),
        "smallest": SMALLEST_DIFFERENCE,
    }


def _title(kind: str, name: str) -> str:
    return NAMES[name] + (" moment" if kind == "moments" else "")


class ProfileSide(NamedTuple):
    """The Gait Profile Score of a side of record and walk, deg."""

    side: Side
    record: float
    walk: float

    @property
    def difference(self) -> float:
        """Walk less record."""
        return self.walk - self.record

    @property
    def matters(self) -> bool:
        """Whether the difference is one that matters clinically."""
        return abs(self.difference) >= SMALLEST_DIFFERENCE


def _profile_sides(profiles: GaitProfiles) -> list[ProfileSide]:
    """The scores of both sides, the side that differs more first; none without a record."""
    if profiles.record is None:
        return []
    rows = [ProfileSide(side, profiles.record.of(side), profiles.walk.of(side)) for side in SIDES]
    return sorted(rows, key=lambda row: -abs(row.difference))


def _furthest(profiles: GaitProfiles) -> dict[str, object] | None:
    """The angle and side whose scores of walk and record differ most."""
    if profiles.record is None:
        return None
    record, walk = profiles.record.scores, profiles.walk.scores
    key = max(record, key=lambda each: abs(walk[each] - record[each]))
    side, name = split_side(key)
    return {"name": name, "side": side, "record": record[key], "walk": walk[key]}
