"""Whether results can be those of a walk, and of one trial: times, soles, sides, signs, forces.

Every limit may be kept by a motion that nobody walked: an angle with the other sign, one leg half a
stride off, right and left exchanged. Then a foot is not flat on the ground, both feet strike
together, or the plates' forces act beside the feet. What is changed back to make them fit is named.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from gaitval.apps.judge.gait import JudgedGait, find_gait, mean_curve, valid
from gaitval.apps.judge.limits import LIMITS
from gaitval.apps.judge.loads import Loads
from gaitval.apps.judge.motion_units import LEGS
from gaitval.apps.judge.skeleton import Skeleton
from gaitval.arrays import Array
from gaitval.consistency import WIDEST, Change, log_likelihood, weigh
from gaitval.coordinates import SIDES, Side, mirrored
from gaitval.errors import RecordError
from gaitval.kinetics.inverse.inverse_dynamics import ground_level
from gaitval.scaling.opensim.placing import Motion, place
from gaitval.subjects.curve_consistency import judge_curves

FINE_RATE: Final = 90.0
"""Hz. Frames that are farther apart say nothing of noise: people move in between."""
NOISY: Final = {"Motion": 0.05, "Moments": 0.5}
"""Off the mean of the frames beside, as a share of the standard deviation: of the knees' angles,
less than 0.01 in walking at 100 Hz, of the legs' moments 0.05."""
FLAT: Final = slice(20, 41)
"""Rows, % of the cycle, in which the foot is flat on the ground."""


def check_times(time: Array, source: str | Path) -> list[str]:
    """Raise RecordError if `time` (T,) s of a table from `source` cannot be a motion's; returns a
    sentence on instants that are there twice.
    """
    if len(time) < LIMITS.least_rows:
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
    if usual > 1.0 / LIMITS.slowest_rate:
        raise RecordError(
            f"{source}: the times go in steps of {usual:g} s, {1 / usual:.3g} Hz: they look like "
            "milliseconds, percent or frame numbers. Write the time in seconds and export again."
        )
    twice = int((steps == 0.0).sum())
    # OpenSim's own tools write one or two.
    return [f"{source}: {twice} instants are there twice."] if twice > 0.01 * len(time) + 1 else []


def stands_still(known: Skeleton, motion: Motion) -> list[str]:
    """A sentence if no joint of the legs moves as in a walk."""
    legs = [motion.values[name] for ours, name in known.coordinates.items() if ours[:-2] in LEGS]
    most = max((float(np.ptp(values)) for values in legs), default=np.inf)
    if most >= LIMITS.still_knee:
        return []
    return [
        f"Motion: no joint of the legs moves by more than {np.degrees(most):.1f}°: the person "
        "stands still, or one pose was written into all rows. This is no walk."
    ]


def noise(what: str, time: Array, columns: Mapping[str, Array]) -> list[str]:
    """A sentence if `columns` (T,) of "Motion" or "Moments" are noise: they jump to and fro from
    frame to frame, as nothing with a mass does.
    """
    rate = 1.0 / float(np.median(np.diff(time)) or np.inf)
    moving = [each for each in map(np.nan_to_num, columns.values()) if np.std(each) > 0.0]
    if not moving or rate < FINE_RATE:
        return []
    between = [each[1:-1] - 0.5 * (each[:-2] + each[2:]) for each in moving]
    shares = [
        np.sqrt(np.mean(off**2)) / np.std(each) for off, each in zip(between, moving, strict=True)
    ]
    if (share := float(np.median(shares))) < NOISY[what]:
        return []
    return [
        f"{what}: from frame to frame they jump by {100 * share:.0f} % of what they vary by: this "
        "is noise. The coordinates were not low-passed before inverse dynamics, which takes their "
        "accelerations for forces: filter them (6 Hz is usual), and run it again."
    ]


def find_doubts(
    known: Skeleton, motion: Motion, loads: Loads | None, belt: float | None
) -> list[str]:
    """A sentence on what shows that the `motion` is not that of a walker with this model, or not
    that of the `loads`, with what explains it; none if it may be.
    """
    off = _off(known, motion, loads, belt)
    if not off or max(abs(value) for value in off.values()) < LIMITS.said:
        return []
    changes = [*_changes(known, motion, belt)]

    def log(values: Mapping[str, float], widest: float = LIMITS.patients_beyond) -> float:
        # What is not known any more of a changed motion speaks against it.
        return sum(
            log_likelihood(values.get(name, LIMITS.said * LIMITS.patients_beyond) ** 2, 1.0, widest)
            for name in off
        )

    verdict = weigh(
        [(Change(words, words, prior), log(_off(known, one, loads, belt)))
         for words, prior, one in changes],
        log(off), 0.0, square=0.0, other=log(off, WIDEST),
    )  # fmt: skip
    seen = "; ".join(
        _SEEN[name.partition(" ")[0]].format(side=name.partition(" ")[2], value=value * scale)
        for name, value in off.items()
        for scale in (SPREAD[name.partition(" ")[0]],)
        if abs(value) >= LIMITS.said
    )
    return [
        f"Motion: {seen}. "
        + (f"It seems that {verdict}" if verdict.named else "Nothing explains it")
        + ". Look whether it is so, before anything else is blamed."
    ]


SPREAD: Final = {"strike": 0.06, "sole": 3.0, "held": 0.08, "floor": 0.012}
"""Of the right cycle, deg, of the plates' impulse: standard deviation of the left foot's
strike from the middle, of a sole from the level, of what acts beside the feet; and m, of a loaded
foot from the floor."""
_SEEN: Final = {
    "strike": "the left foot strikes {value:+.2f} of a cycle off the middle of the right one's",
    "sole": "the {side} sole is {value:.0f}° off the level in mid-stance",
    "held": "{value:.0%} of the forces act beside the feet",
    "floor": "the {side} foot is {value:+.3f} m off the floor of the plates in mid-stance",
}


def _off(
    known: Skeleton, motion: Motion, loads: Loads | None, belt: float | None
) -> dict[str, float]:
    """Standard deviations by which a motion is off what every walk is like."""
    plain = find_gait(known, motion, None, belt=belt)
    found = {f"sole {side}": pitch for side, pitch in _soles(known, motion, plain).items()}
    if (phase := _left_strike(plain)) is not None:
        found["strike"] = phase - 0.5
    if loads is not None and all(valid(plain, side, kinetics=False) for side in SIDES):
        gait = _with_forces(known, motion, loads, belt)
        found["held"] = max(1.0 - _held(known, motion, loads, gait), 0.0)
        found |= {
            f"floor {side}": high - LIMITS.sole for side, high in _floors(known, motion, gait)
        }
    return {name: value / SPREAD[name.partition(" ")[0]] for name, value in found.items()}


def _left_strike(gait: JudgedGait) -> float | None:
    """Where in the right foot's cycle the left one strikes, median; None if nothing shows it."""
    strikes = np.array([cycle.start for cycle in gait.cycles["left"]])
    phases = [
        (at - cycle.start) / cycle.duration
        for cycle in gait.cycles["right"]
        for at in strikes[(strikes >= cycle.start - 0.1) & (strikes < cycle.end - 0.1)]
    ]
    return float(np.median(phases)) if phases else None


def _with_forces(
    known: Skeleton, motion: Motion, loads: Loads, belt: float | None
) -> JudgedGait | None:
    """The gait with the forces on its feet; None if these do not belong to the motion."""
    try:
        return find_gait(known, motion, loads, belt=belt)
    except RecordError:
        return None


def _held(known: Skeleton, motion: Motion, loads: Loads, gait: JudgedGait | None) -> float:
    """Share of the plates' vertical impulse that acts on a foot."""
    if gait is None or gait.forces is None:
        return 0.0
    time = loads.start + np.arange(len(loads.plates[0].force)) / loads.rate
    inside = (time >= motion.time[0]) & (time <= motion.time[-1])
    total = sum(float((plate.force[inside] @ known.model.up).sum()) for plate in loads.plates)
    on_feet = np.where(gait.forces.valid, gait.forces.force[:, :, 2], 0.0)
    return 0.0 if total <= 0.0 else float(np.nansum(on_feet)) / total


def _floors(
    known: Skeleton, motion: Motion, gait: JudgedGait | None
) -> Iterator[tuple[Side, float]]:
    """m, mean in mid-stance, of the lower of the origins of heel and toes above the plates."""
    if gait is None or gait.forces is None:
        return
    poses = place(known.model, motion.values)
    ground = ground_level(gait.forces.centre_of_pressure)
    for side in SIDES:
        bodies = [known.bodies.get(f"{part}_{side[0]}") for part in ("foot", "toes")]
        heights = [poses[body][1] @ known.model.up for body in bodies if body is not None]
        cycles = valid(gait, side, kinetics=True)
        curve = mean_curve(motion.time, np.min(heights, axis=0), cycles) if heights else None
        if curve is not None and np.isfinite(ground):
            yield side, float(curve[0][FLAT].mean()) - ground


def _changes(
    known: Skeleton, motion: Motion, belt: float | None
) -> Iterator[tuple[str, float, Motion]]:
    """What may be wrong, its probability before the data, and the motion with it changed back."""
    opposite = {"r": "l", "l": "r"}
    exchanged = {
        name: motion.values[known.coordinates[other]]
        for ours, name in known.coordinates.items()
        if (other := ours[:-1] + opposite[ours[-1]]) in known.coordinates
    }
    yield "right and left are exchanged in the names of its columns", 0.05, _with(motion, exchanged)
    pairs: dict[str, list[str]] = {}
    for ours, name in known.coordinates.items():
        if name in motion.given and ours[:-2] in (*LEGS, "hip_adduction"):
            pairs.setdefault(ours[:-2], []).append(name)
    single = [[name] for names in pairs.values() for name in names]
    both = [[name] for name in _turns(known)] + [each for each in pairs.values() if len(each) == 2]
    for prior, groups in ((0.05, both), (0.02, single)):
        for names in groups:
            back = _with(motion, {name: -motion.values[name] for name in names})
            has = "has" if len(names) == 1 else "have"
            yield f"{' and '.join(names)} {has} the other sign", prior / len(groups), back
    for (name,) in single:
        back = _with(motion, {name: np.degrees(motion.values[name])})
        yield f"{name} is in radians, unlike the other angles", 0.05 / len(single), back
    stride = _stride(find_gait(known, motion, None, belt=belt))
    if not np.isfinite(stride):
        return
    rows = round(0.5 * stride / float(np.median(np.diff(motion.time))))
    for side in SIDES:
        rolled = {
            name: np.roll(motion.values[name], rows)
            for ours, name in known.coordinates.items()
            if ours.endswith(f"_{side[0]}")
        }
        words = f"the columns of the {side} leg are half a stride off, or a copy of the other's"
        yield words, 0.015, _with(motion, rolled)


def _stride(gait: JudgedGait) -> float:
    """s, median of both sides; NaN without a cycle."""
    found = [cycle.duration for side in SIDES for cycle in gait.cycles[side]]
    return float(np.median(found)) if found else float("nan")


def _turns(known: Skeleton) -> list[str]:
    """Coordinates that turn the root."""
    root, coordinates = known.model.root(), known.model.coordinates
    names = root.coordinates if root else ()
    return [name for name in names if coordinates[name].motion == "rotational"]


def _with(motion: Motion, changed: Mapping[str, Array]) -> Motion:
    return replace(motion, values={**motion.values, **changed})


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
    """A sentence on moments of the legs that inverse dynamics' results lack, or that say nothing.
    Raises RecordError if all are 0.
    """
    told = {name for name, values in forces.items() if np.nan_to_num(values).any()}
    if not told:
        raise RecordError(f"{source}: all moments and forces are 0. Run inverse dynamics again.")
    lacking = [name for ours, name in known.coordinates.items()
               if ours[:-2] in LEGS and name not in told]  # fmt: skip
    if not lacking:
        return []
    return [
        f"{source}: the moments of {', '.join(lacking)} are not in it, are 0 or no number "
        "throughout: they are not judged."
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
        if size > 0.0 and level @ lever < -LIMITS.points_away * size:
            found.append(
                f"Forces: {words} they point away from the body's centre of mass, not to it: their "
                "sign is changed, or these are forces on the ground."
            )
    return found
