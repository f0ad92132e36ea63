"""Whether results can be those of a walk, and of one trial: times, noise, soles, sides, forces.

Every limit may be kept by a motion that nobody walked: an angle with the other sign, right and left
exchanged. Then a foot is not flat on the ground, or the plates' forces act beside the feet.
`FINDINGS` is what is looked for; which curve has another sign, unit or side is told of the mean
curves (`odd_curves`), and where both feet strike together there is no cycle.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.apps.judge.gait import JudgedGait, find_gait, mean_curve, project_axes, valid
from gaitval.apps.judge.limits import LIMITS
from gaitval.apps.judge.loads import Loads
from gaitval.apps.judge.motion_units import LEGS
from gaitval.apps.judge.skeleton import Skeleton, body_axes
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, mirrored
from gaitval.errors import RecordError
from gaitval.findings.finding import Finding, Seen, look_for
from gaitval.kinetics.inverse.inverse_dynamics import ground_level
from gaitval.scaling.opensim.placing import Motion, centre_of_mass, place
from gaitval.subjects.curve_consistency import FLAT, judge_curves


@dataclass(frozen=True)
class Moments:
    """Moments (T,) of the legs at `time` (T,), Nm and s."""

    time: Array
    columns: Mapping[str, Array]


@dataclass(frozen=True)
class Walk:
    """A motion and the forces that are said to belong to it.

    Attributes
    ----------
    plain : the gait as the motion alone shows it.
    belt : speed of the belt, m/s, if it was given.
    """

    known: Skeleton
    motion: Motion
    loads: Loads | None
    plain: JudgedGait
    belt: float | None

    @cached_property
    def gait(self) -> JudgedGait | RecordError:
        """With the forces on its feet; or why these do not belong to the motion."""
        if self.loads is None:
            return self.plain
        try:
            return find_gait(self.known, self.motion, self.loads, belt=self.belt)
        except RecordError as error:
            return error

    @cached_property
    def poses(self) -> Mapping[str, tuple[Array, Array]]:
        """Of all bodies, by name."""
        return place(self.known.model, self.motion.values)


def _noise(of: Moments, finest: float) -> Iterator[Seen]:
    """RMS off the mean of the frames beside, over the standard deviation; median of the columns."""
    rate = 1.0 / float(np.median(np.diff(of.time)) or np.inf)
    moving = [each for each in map(np.nan_to_num, of.columns.values()) if np.std(each) > 0.0]
    if moving and rate >= finest:
        shares = [
            np.sqrt(np.mean((each[1:-1] - 0.5 * (each[:-2] + each[2:])) ** 2)) / np.std(each)
            for each in moving
        ]
        yield Seen(float(np.median(shares)), "Moments")


def _soles(of: Walk) -> Iterator[Seen]:
    """deg, mean in mid-stance, by which each foot is pitched against its pose in standing."""
    model, axes = of.known.model, body_axes(of.known.model, of.known.bodies)
    for side in SIDES:
        foot = of.known.bodies.get(f"foot_{side[0]}")
        if foot is None or axes is None:
            continue
        ahead = of.known.standing[foot][0][0].T @ axes[0]
        pitch = np.degrees(np.arcsin(np.clip(of.poses[foot][0] @ ahead @ model.up, -1.0, 1.0)))
        curve = mean_curve(of.motion.time, pitch, valid(of.plain, side, kinetics=False))
        if curve is not None:
            yield Seen(float(curve[0][FLAT].mean()), "Motion", {"side": side})


def _beside(of: Walk) -> Iterator[Seen]:
    """Share of the plates' vertical impulse that acts on no foot."""
    if of.loads is None or not all(valid(of.plain, side, kinetics=False) for side in SIDES):
        return
    on_feet, up = 0.0, of.known.model.up
    if isinstance(of.gait, JudgedGait) and of.gait.forces is not None:
        forces = of.gait.forces
        on_feet = float(np.nansum(np.where(forces.valid, forces.force[:, :, 2], 0.0)))
    time = of.loads.start + np.arange(len(of.loads.plates[0].force)) / of.loads.rate
    inside = (time >= of.motion.time[0]) & (time <= of.motion.time[-1])
    total = sum(float((plate.force[inside] @ up).sum()) for plate in of.loads.plates)
    yield Seen(1.0 - on_feet / total if total > 0.0 else 1.0, "Motion")


def _floors(of: Walk) -> Iterator[Seen]:
    """m, mean in mid-stance, of the lower of the origins of heel and toes above the plates."""
    if not isinstance(of.gait, JudgedGait) or of.gait.forces is None:
        return
    ground = ground_level(of.gait.forces.centre_of_pressure)
    for side in SIDES:
        bodies = [of.known.bodies.get(f"{part}_{side[0]}") for part in ("foot", "toes")]
        heights = [of.poses[body][1] @ of.known.model.up for body in bodies if body is not None]
        cycles = valid(of.gait, side, kinetics=True)
        curve = mean_curve(of.motion.time, np.min(heights, axis=0), cycles) if heights else None
        if curve is not None:
            yield Seen(float(curve[0][FLAT].mean()) - ground, "Motion", {"side": side})


def _towards_the_body(of: Walk) -> Iterator[Seen]:
    """Correlation, about zero, of the level forces on the feet with the way to the centre of
    mass.
    """
    if not isinstance(of.gait, JudgedGait) or of.gait.forces is None:
        return
    forces, model = of.gait.forces, of.known.model
    mass_centre = centre_of_mass(model, of.poses) @ project_axes(model.up).T
    up = forces.force[:, :, 2]
    shown = forces.valid & (up > 0.3 * up.max())
    for axis, words in ((0, "forward and back"), (1, "to the sides")):
        centre = np.interp(forces.time, of.motion.time, mass_centre[:, axis])
        lever = (centre[:, None] - forces.centre_of_pressure[:, :, axis])[shown]
        level = forces.force[:, :, axis][shown]
        size = float(np.linalg.norm(level) * np.linalg.norm(lever))
        if size > 0.0:
            yield Seen(float(level @ lever) / size, "Forces", {"axis": words})


FINDINGS: Final = (
    Finding(
        name="noise", needs=Moments, values=_noise, limits=0.5, unit="1",
        sentence="from frame to frame they jump by {value:.0f %} of what they vary by: this is "
        "noise. The coordinates were not low-passed before inverse dynamics, which takes their "
        "accelerations for forces",
        remedy="Filter them (6 Hz is usual), and run it again",
        numbers={"finest": 90.0},  # Hz: between frames farther apart people move
        source="0.05 of the legs' moments in walking",
    ),
    Finding(
        name="sole", needs=Walk, values=_soles, limits=(-9.0, 9.0), unit="deg",
        sentence="the {side} sole is {value:.0f}° off the level in mid-stance: an angle of the leg "
        "or of the pelvis has another sign, unit, zero or side",
        source="three standard deviations of 3°",
    ),
    Finding(
        name="forces beside the feet", needs=Walk, values=_beside, limits=0.24, unit="1",
        sentence="{value:.0f %} of the forces act beside the feet: right and left are exchanged, "
        "or the forces are of another step, trial or place",
        source="three standard deviations of 0.08",
    ),
    Finding(
        name="floor", needs=Walk, values=_floors, limits=(-0.021, 0.051), unit="m",
        sentence="the {side} foot is {value:+.0f mm} off the floor of the plates in mid-stance",
        source="origins of heel and toes are 15 mm above the sole; three standard deviations of 12",
    ),
    Finding(
        name="forces from the body", needs=Walk, values=_towards_the_body, limits=(-0.5, np.inf),
        unit="1",
        sentence="{axis} they point away from the body's centre of mass, not to it: their sign is "
        "changed, or these are forces on the ground",
    ),
)  # fmt: skip


def found_in(part: Moments | Walk) -> list[str]:
    """A sentence on each thing that shows that a `part` is not of a walk."""
    return [f"{flag}." for flag in look_for(FINDINGS, [part]).flags]


def check_times(time: Array, source: str | Path) -> None:
    """Raise RecordError if `time` (T,) s of a table from `source` cannot be a motion's."""
    if len(time) < LIMITS.least_rows:
        there = ("no rows", "one row", "two rows")[len(time)]
        raise RecordError(
            f"{source}: {there}, but a walk needs a whole cycle. Give the file of the trial, not "
            "one pose of it; if this is it, export it again."
        )
    steps = np.diff(time)
    if steps.min() < 0.0 or np.median(steps) > 1.0 / LIMITS.slowest_rate:
        raise RecordError(
            f"{source}: the time goes on in steps of {steps.min():g} to {steps.max():g} s, so it "
            "goes back, or is in milliseconds, percent or frame numbers. Give one motion, with its "
            "rows in the order of time in seconds, and export again."
        )


def odd_curves(angles: Mapping[str, Array], moments: Mapping[str, Array]) -> list[str]:
    """A sentence if mean `angles` (101,) rad and `moments` Nm/kg by our names cannot be of one
    walker, with the mistake that explains them.
    """
    curves = {f"angle_{name}": np.degrees(values) for name, values in angles.items()}
    # Those across the midline hang on step width and model.
    curves |= {f"moment_{name}": m for name, m in moments.items() if name[:-2] in LEGS}
    judged = judge_curves({n: c for n, c in curves.items() if mirrored(n) in curves})
    return [f"Curves: {judged.words}"] if judged.words else []


def odd_columns(known: Skeleton, forces: Mapping[str, Array], source: str | Path) -> list[str]:
    """A sentence on moments of the legs that inverse dynamics' results lack, or that are 0."""
    told = {name for name, values in forces.items() if np.nan_to_num(values).any()}
    lacking = [name for ours, name in known.coordinates.items()
               if ours[:-2] in LEGS and name not in told]  # fmt: skip
    if not lacking:
        return []
    return [
        f"{source}: the moments of {', '.join(lacking)} are not in it, are 0 or no number "
        "throughout: they are not judged."
    ]
