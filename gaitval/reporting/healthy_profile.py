"""The report's section on how far record and walk are from healthy gait."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Final, NamedTuple

import numpy as np

from gaitval.coordinates import SIDES, Side, split_side
from gaitval.gait.healthy_controls import Controls, load_controls
from gaitval.metrics.curve_results import GaitProfiles
from gaitval.metrics.gait_profile import SMALLEST_DIFFERENCE
from gaitval.reporting.drawing import keys_of, legend_above, new_figure, svg
from gaitval.reporting.figures import BAND_COLOUR, COLOURS, RECORD_COLOUR

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
                    label=f"{'measured' if which == 'record' else which}, {side}",
                )
        axes.set_xticks(at, [_SHORT[name] for name in names], fontsize=7.5)
        axes.tick_params(axis="x", length=0)
        axes.set_ylim(bottom=0)
        axes.set_ylabel("RMS from their mean, °")
        legend_above(figure, keys_of(axes), columns=3)
        return svg(figure, "profile")


@dataclass(frozen=True)
class Healthy:
    """What the section says: `profiles` of record and walk, of a person who is one of the controls
    or not.
    """

    profiles: GaitProfiles
    is_control: bool

    smallest: ClassVar = SMALLEST_DIFFERENCE

    @property
    def controls(self) -> Controls:
        """The healthy adults of the profile."""
        return load_controls()

    @property
    def sides(self) -> list["ProfileSide"]:
        """The scores of both sides, the side that differs more first; none without a record."""
        record, walk = self.profiles.record, self.profiles.walk
        if record is None:
            return []
        rows = [ProfileSide(side, record.of(side), walk.of(side)) for side in SIDES]
        return sorted(rows, key=lambda row: -abs(row.difference))

    @property
    def furthest(self) -> "FurthestAngle | None":
        """The angle and side whose scores of walk and record differ most."""
        if self.profiles.record is None:
            return None
        record, walk = self.profiles.record.scores, self.profiles.walk.scores
        key = max(record, key=lambda each: abs(walk[each] - record[each]))
        side, name = split_side(key)
        return FurthestAngle(name, side, record[key], walk[key])


class FurthestAngle(NamedTuple):
    """An angle of a side, and its scores, deg."""

    name: str
    side: str
    record: float
    walk: float


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
