"""Whether results can be those of a walk, and of one trial: times, soles, sides, signs, forces.

Every limit may be kept by a motion that nobody walked: an angle with the other sign, one leg half a
stride off, right and left exchanged, times in percent. Then a foot is not flat on the ground, both
feet strike together, or the plates' forces act beside the feet. What is changed back to make them
fit is named.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.apps.judge.angle_units import LEGS
from gaitval.apps.judge.gait import JudgedGait, find_gait, mean_curve, valid
from gaitval.apps.judge.loads import Loads
from gaitval.apps.judge.skeleton import Skeleton
from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.datasets.curve_causes import LOADED, explained, load_in_the_air
from gaitval.errors import RecordError
from gaitval.gait.sampling import SAMPLES
from gaitval.scaling.opensim.placing import Motion, place

SLOWEST_RATE: Final = 10.0
"""Hz. No motion capture is so slow."""
LEAST_ROWS: Final = 3
"""Of a table over time: accelerations need three."""
FASTEST: Final = 1500.0
"""deg/s, of which one sample in a hundred is more: a walker's knee swings at 400, a sprinter's at
1200."""
JITTER, FINE_RATE = 0.8, 90.0
"""deg from the mean of the neighbouring frames, at so many Hz and more: 0.15 in walking."""
NO_WALK: Final = np.deg2rad(5.0)
"""rad. In a walk every knee moves by more."""
FLAT: Final = slice(20, 41)
"""Rows, % of the cycle, in which the foot is flat on the ground."""
LEVEL: Final = (10.0, 5.0)
"""deg. Soles that are both more than the first off the level in mid-stance, but less than the
second with one thing changed, show that it is wrong."""
TOGETHER: Final = (0.2, 0.8)
"""Of the right cycle: between these the left foot strikes, even of a person who limps."""
HELD: Final = 0.75
"""Share of the plates' impulse that acts on the feet, under which something may be wrong with all
of it; and how many times more does so with it changed back."""
MORE: Final = 1.4
AWAY: Final = 0.5
"""Of forces and levers, correlation about zero: in a walk forces point to the centre of mass."""


def check_times(time: Array, source: str | Path) -> list[str]:
    """Raise RecordError if `time` (T,) s of a table from `source` cannot be a motion's; returns a
    sentence on instants that are there twice.
    """
    if len(time) < LEAST_ROWS:
        there = ("no rows", "one row", "two rows")[len(time)]
        raise RecordError(
            f"{source}: {there}, but a walk needs a whole cycle. Give the file of the trial, not "
            "one pose of it; if this is it, export it again."
        )
    steps = np.diff(time)
    if (steps < 0.0).any():
        row = int(np.argmax(steps < 0.0))
        raise RecordError(
            f"{source}: the time goes back from {time[row]:g} to {time[row + 1]:g} s. Give one "
            "motion, with its rows in the order of time."
        )
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    if usual > 1.0 / SLOWEST_RATE:
        raise RecordError(
            f"{source}: the times go in steps of {usual:g} s, {1 / usual:.3g} Hz: they look like "
            "milliseconds, percent or frame numbers. Write the time in seconds and export again."
        )
    twice = int((steps == 0.0).sum())
    # OpenSim's own tools write one or two.
    return [f"{source}: {twice} instants are there twice."] if twice > 0.01 * len(time) + 1 else []


def check_walk(known: Skeleton, motion: Motion, source: str | Path) -> list[str]:
    """Raise RecordError if the legs are not in the `motion`, or are faster than legs can be;
    returns a sentence if they stand still.
    """
    legs = {
        ours: motion.values[name]
        for ours, name in known.coordinates.items()
        if ours[:-2] in LEGS and name in motion.given
    }
    if not legs and any(ours[:-2] in LEGS for ours in known.coordinates):
        raise RecordError(
            f"{source}: has none of the angles of the legs (knee_angle_r, …). Give the motion of "
            "the whole body that inverse kinematics wrote."
        )
    knees = [values for ours, values in legs.items() if ours.startswith("knee_angle")]
    steps = np.diff(motion.time)
    for values in knees:
        speed = np.abs(np.diff(values)) / np.where(steps > 0.0, steps, np.inf)
        if (fast := float(np.degrees(np.percentile(speed, 99)))) > FASTEST:
            raise RecordError(
                f"{source}: a knee turns at {fast:.0f}°/s (99 of 100 samples are slower), but at "
                "400 in walking and 1200 in sprinting. The times are not in seconds (0 to 1 of "
                "the trial?), or the motion is noise: filter it, or export it again."
            )
    most = max((float(np.ptp(values)) for values in legs.values()), default=np.inf)
    if most >= NO_WALK:
        return []
    return [
        f"Motion: no joint of the legs moves by more than {np.degrees(most):.1f}°: the person "
        "stands still, or one pose was written into all rows. This is no walk."
    ]


def jitter(known: Skeleton, motion: Motion) -> list[str]:
    """A sentence if a knee jumps to and fro between frames, as nothing with a mass does."""
    rate = 1.0 / float(np.median(np.diff(motion.time)) or np.inf)
    found = []
    for ours, name in known.coordinates.items():
        if rate < FINE_RATE or not ours.startswith("knee_angle") or name not in motion.given:
            continue
        values = motion.values[name]
        off = values[1:-1] - 0.5 * (values[:-2] + values[2:])
        if (rms := float(np.degrees(np.sqrt(np.mean(off**2))))) > JITTER:
            found.append(f"{name} by {rms:.1f}°")
    if not found:
        return []
    return [
        f"Motion: {' and '.join(found)} (RMS) off the mean of the frames before and after: this is "
        "noise. Inverse dynamics takes its accelerations for forces: filter the markers."
    ]


def missing_legs(known: Skeleton, motion: Motion) -> list[str]:
    """A sentence if angles of the legs are not in the `motion`, and stay at their defaults."""
    coupled = {each.dependent for each in known.model.couplers}
    lacking = [
        name
        for ours, name in known.coordinates.items()
        if ours[:-2] in LEGS and name not in motion.given and name not in coupled
    ]
    locked = [name for name in lacking if known.model.coordinates[name].locked]
    lacking = [name for name in lacking if name not in locked]
    if not lacking:
        return []
    return [
        f"The motion lacks {', '.join(lacking)}, which stay at the model's default: what depends "
        "on them means nothing."
    ]


def find_doubts(
    known: Skeleton, motion: Motion, loads: Loads | None, belt: float | None
) -> list[str]:
    """Sentences on what shows that the `motion` is not that of a walker with this model, or not
    that of the `loads`; empty if it may be.
    """
    plain = find_gait(known, motion, None, belt=belt)
    found = [*_strike_together(plain), *_odd_soles(known, motion, plain, belt)]
    walks = all(any(one.kinematics_valid for one in plain.cycles[side]) for side in SIDES)
    if found or loads is None or not walks:
        return found
    held = _held(known, motion, loads, belt)
    if held >= HELD:
        return []
    stride = np.median([one.duration for side in SIDES for one in plain.cycles[side]] or [np.nan])
    tried = {
        words: _held(known, changed, loads, belt) for words, changed in _changes(known, motion)
    }
    for way, later in (("earlier", 0.5), ("later", -0.5)):
        if np.isfinite(stride):
            moved = replace(loads, start=loads.start + later * float(stride))
            tried[f"they are half a stride {way} than the motion"] = _held(
                known, _within(motion, moved), moved, belt
            )
    best = max(tried, key=lambda words: tried[words])
    if tried[best] <= max(HELD, MORE * held):
        return []
    beside, then = (100.0 * max(1.0 - share, 0.0) for share in (held, tried[best]))
    return [
        f"Motion: {beside:.0f} % of the forces act beside the feet, but {then:.0f} % if {best}. "
        "Look whether it is so, before the forces are blamed."
    ]


def _held(known: Skeleton, motion: Motion, loads: Loads, belt: float | None) -> float:
    """Share of the plates' vertical impulse that acts on a foot."""
    try:
        gait = find_gait(known, motion, loads, belt=belt)
    except RecordError:
        return 0.0
    if gait.forces is None:
        return 0.0
    time = loads.start + np.arange(len(loads.plates[0].force)) / loads.rate
    inside = (time >= motion.time[0]) & (time <= motion.time[-1])
    total = sum(float((plate.force[inside] @ known.model.up).sum()) for plate in loads.plates)
    on_feet = np.where(gait.forces.valid, gait.forces.force[:, :, 2], 0.0)
    return 0.0 if total <= 0.0 else float(np.nansum(on_feet)) / total


def _within(motion: Motion, loads: Loads) -> Motion:
    """The part of a motion in which there are loads."""
    end = loads.start + (len(loads.plates[0].force) - 1) / loads.rate
    inside = (motion.time >= loads.start) & (motion.time <= end)
    values = {name: each[inside] for name, each in motion.values.items()}
    return replace(motion, time=motion.time[inside], values=values)


def _changes(known: Skeleton, motion: Motion) -> Iterator[tuple[str, Motion]]:
    """What may be wrong with a motion, in words, and the motion with it changed back."""
    exchanged = {}
    for ours, name in known.coordinates.items():
        other = known.coordinates.get(ours[:-1] + {"r": "l", "l": "r"}[ours[-1]])
        if other is not None:
            exchanged[name] = motion.values[other]
    yield "right and left are exchanged in the names of its columns", _with(motion, exchanged)
    turns = _turns(known)
    in_degrees = {name: np.degrees(motion.values[name]) for name in turns}
    yield (
        f"{', '.join(turns)} are in radians, unlike the other angles",
        _with(motion, in_degrees),
    )
    yield from _signs_changed(known, motion, one_side=True)


def _signs_changed(
    known: Skeleton, motion: Motion, *, one_side: bool
) -> Iterator[tuple[str, Motion]]:
    """The motion with the sign of each angle of the pelvis or of both legs, or of `one_side` too,
    changed.
    """
    kinds: dict[str, list[str]] = {}
    for ours, name in known.coordinates.items():
        if name in motion.given and ours[:-2] in (*LEGS, "hip_adduction"):
            kinds.setdefault(ours[:-2], []).append(name)
    groups = [[name] for name in _turns(known)]
    groups += [names for names in kinds.values() if len(names) == 2]
    if one_side:
        groups += [[name] for names in kinds.values() for name in names]
    for names in groups:
        word = "has" if len(names) == 1 else "have"
        changed = {name: -motion.values[name] for name in names}
        yield f"{' and '.join(names)} {word} the other sign", _with(motion, changed)


def _turns(known: Skeleton) -> list[str]:
    """Coordinates that turn the root."""
    root, coordinates = known.model.root(), known.model.coordinates
    names = root.coordinates if root else ()
    return [name for name in names if coordinates[name].motion == "rotational"]


def _with(motion: Motion, changed: Mapping[str, Array]) -> Motion:
    return replace(motion, values={**motion.values, **changed})


def _strike_together(gait: JudgedGait) -> Iterator[str]:
    """A sentence if the left foot does not strike in the middle of the right foot's cycle."""
    strikes = np.array([cycle.start for cycle in gait.cycles["left"]])
    phases = [
        (at - cycle.start) / cycle.duration
        for cycle in gait.cycles["right"]
        for at in strikes[(strikes >= cycle.start - 0.1) & (strikes < cycle.end - 0.1)]
    ]
    if phases and not TOGETHER[0] < float(np.median(phases)) < TOGETHER[1]:
        yield (
            f"Motion: the left foot strikes at {100 * float(np.median(phases)):.0f} % of the "
            "right foot's cycle, so both strike together: the columns of one leg are half a "
            "stride off, or a copy of the other's."
        )


def _odd_soles(
    known: Skeleton, motion: Motion, gait: JudgedGait, belt: float | None
) -> Iterator[str]:
    """A sentence if no sole is level in mid-stance, and what makes both level."""
    off = _soles(known, motion, gait)
    if len(off) < 2 or min(map(abs, off.values())) < LEVEL[0]:
        return
    levelled = {}
    for words, changed in _signs_changed(known, motion, one_side=False):
        again = _soles(known, changed, gait)
        if len(again) == 2 and max(map(abs, again.values())) < LEVEL[1]:
            levelled[words] = max(map(abs, again.values()))
    both = " and ".join(f"{value:.0f}" for value in off.values())
    if levelled:
        best = " or ".join(sorted(levelled, key=lambda words: levelled[words])[:2])
        yield (
            f"Motion: in mid-stance the soles are {both}° off the level (right and left); they are "
            f"level if {best}."
        )
    for side in SIDES:
        if not levelled and (cause := _cause(known, motion, gait, side)):
            yield (
                f"Motion: the soles are {both}° off the level in mid-stance; it seems that {cause}."
            )


def _soles(known: Skeleton, motion: Motion, gait: JudgedGait) -> dict[Side, float]:
    """deg, mean in mid-stance, by which each foot is pitched against its pose in standing."""
    model, found = known.model, dict[Side, float]()
    poses = place(model, motion.values)
    for side in SIDES:
        body = known.bodies.get(f"foot_{side[0]}")
        cycles = valid(gait, side, kinetics=False)
        if body is None or not cycles:
            continue
        level = known.standing[body][0][0]
        # The axis of the foot that lies forward in standing.
        ahead = level.T @ np.cross(_right(known), model.up)
        pitch = np.degrees(np.arcsin(np.clip((poses[body][0] @ ahead) @ model.up, -1.0, 1.0)))
        pitch -= np.degrees(np.arcsin(np.clip((level @ ahead) @ model.up, -1.0, 1.0)))
        curve = mean_curve(motion.time, pitch, cycles)
        if curve is not None:
            found[side] = float(curve[0][FLAT].mean())
    return found


def _right(known: Skeleton) -> Array:
    """(3,), to the right of the person who stands."""
    across = np.asarray(known.origin("thigh_r")) - np.asarray(known.origin("thigh_l"))
    across = across - (across @ known.model.up) * known.model.up
    return np.asarray(across / np.linalg.norm(across))


def _cause(known: Skeleton, motion: Motion, gait: JudgedGait, side: Side) -> str:
    angles = sided_curves(known, gait, motion.time, motion.values, side, kinetics=False)
    degrees = {name: np.degrees(values) for name, values in angles.items()}
    if not all(f"{name}_{side[0]}" in degrees for name in LEGS):
        return ""
    return explained("angle", side[0], degrees).replace("angle_", "", 1)


def sided_curves(
    known: Skeleton,
    gait: JudgedGait,
    time: Array,
    values: Mapping[str, Array],
    side: Side,
    *,
    kinetics: bool,
) -> dict[str, Array]:
    """Mean curves (101,) of our coordinates of a side, in our signs."""
    found = {}
    for ours, name in known.coordinates.items():
        sense = known.senses.get(ours, 0)
        if sense and ours.endswith(f"_{side[0]}") and name in values:
            curve = mean_curve(time, sense * values[name], valid(gait, side, kinetics=kinetics))
            if curve is not None:
                found[ours] = curve[0]
    return found


def odd_moments(curves: Mapping[str, Array], gait: JudgedGait) -> list[str]:
    """Sentences on moments (Nm/kg, mean `curves` (101,) by our names) that are of another side,
    time or sign than the motion.
    """
    causes: dict[Side, str] = {}
    for side in SIDES:
        if all(f"{name}_{side[0]}" in curves for name in (*LEGS, "hip_adduction")):
            causes[side] = explained("moment", side[0], curves)
    if len(causes) == 2 and all("half a stride" in each for each in causes.values()):
        return [
            "Moments: of both sides they are half a stride off the motion: right and left are "
            "exchanged in the names of the columns, or the times are of another stride."
        ]
    found = [
        f"Moments of the {side} side: it seems that {cause}."
        for side, cause in causes.items()
        if cause
    ]
    for side in SIDES if not found else ():
        ankle, stance = curves.get(f"ankle_angle_{side[0]}"), gait.stance_fraction[side]
        if ankle is None or not np.isfinite(stance):
            continue
        after = int(np.ceil((SAMPLES - 1) * stance)) + 4
        if (late := load_in_the_air(ankle, after)) > LOADED:
            found.append(
                f"Moments: the {side} ankle is loaded by {late:.2g} Nm/kg after its foot has left "
                f"the ground (from {after} % of the cycle): they are later than the motion."
            )
    return found


def odd_columns(
    known: Skeleton, forces: Mapping[str, Array], lacking: list[str], source: str | Path
) -> list[str]:
    """Sentences on moments of the legs that inverse dynamics' results lack, or that say nothing.
    Raises RecordError if all are 0.
    """
    if all(not np.nan_to_num(values).any() for values in forces.values()):
        raise RecordError(f"{source}: all moments and forces are 0. Run inverse dynamics again.")
    legs = [name for ours, name in known.coordinates.items() if ours[:-2] in LEGS]
    names = {"are not in it": [], "are not a number at any time": lacking, "are 0 throughout": []}
    for name in legs:
        if name in forces and not np.nan_to_num(forces[name]).any():
            names["are 0 throughout"].append(name)
        elif name not in forces and name not in lacking:
            names["are not in it"].append(name)
    return [
        f"{source}: the moments of {', '.join(some)} {why}: they are not judged."
        for why, some in names.items()
        if some
    ]


def odd_forces(gait: JudgedGait, mass_centre: Array, time: Array) -> list[str]:
    """A sentence on each horizontal direction in which the forces on the feet point away from the
    centre of mass (T, 3) m at `time` (T,), not to it; in the project's axes.
    """
    if gait.forces is None:
        return []
    of, found = gait.forces, []
    centre = np.column_stack([np.interp(of.time, time, column) for column in mass_centre.T])
    up = of.force[:, :, 2]
    shown = of.valid & (up > 0.3 * up.max())
    for axis, words in ((0, "forward and back"), (1, "to the sides")):
        lever = centre[:, None, axis] - of.centre_of_pressure[:, :, axis]
        level, lever = of.force[:, :, axis][shown], lever[shown]
        size = float(np.linalg.norm(level) * np.linalg.norm(lever))
        if size > 0.0 and level @ lever < -AWAY * size:
            found.append(
                f"Forces: {words} they point away from the body's centre of mass, not to it: their "
                "sign is changed, or these are forces on the ground."
            )
    return found
