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
from gaitval.apps.judge.limits import LIMITS
from gaitval.apps.judge.loads import Loads
from gaitval.apps.judge.skeleton import Skeleton
from gaitval.arrays import Array
from gaitval.consistency import WIDEST, Change, log_likelihood, weigh
from gaitval.coordinates import SIDES, Side, mirrored
from gaitval.datasets.curve_consistency import judge_curves
from gaitval.errors import RecordError
from gaitval.inverse.inverse_dynamics import ground_level
from gaitval.scaling.opensim.placing import Motion, place

JITTER, FINE_RATE = 0.8, 90.0
"""deg from the mean of the neighbouring frames, at so many Hz and more: 0.15 in walking."""
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
        if (fast := float(np.degrees(np.percentile(speed, 99)))) > LIMITS.fastest_knee:
            raise RecordError(
                f"{source}: a knee turns at {fast:.0f}°/s (99 of 100 samples are slower), but at "
                "400 in walking and 1200 in sprinting. The times are not in seconds (0 to 1 of "
                "the trial?), or the motion is noise: filter it, or export it again."
            )
    most = max((float(np.ptp(values)) for values in legs.values()), default=np.inf)
    if most >= LIMITS.still_knee:
        return []
    return [
        f"Motion: no joint of the legs moves by more than {np.degrees(most):.1f}°: the person "
        "stands still, or one pose was written into all rows. This is no walk."
    ]


def jitter(known: Skeleton, motion: Motion) -> list[str]:
    """A sentence if a knee jumps to and fro between frames, as nothing with a mass does."""
    found = [
        f"{name} by {np.degrees(rms):.1f}°"
        for ours, name in known.coordinates.items()
        if ours.startswith("knee_angle") and name in motion.given
        if (rms := _between(motion.time, motion.values[name])) > np.radians(JITTER)
    ]
    if not found:
        return []
    return [
        f"Motion: {' and '.join(found)} (RMS) off the mean of the frames before and after: this is "
        "noise. Inverse dynamics takes its accelerations for forces: filter the markers."
    ]


def noisy_moments(known: Skeleton, time: Array, forces: Mapping[str, Array]) -> list[str]:
    """A sentence if moments of the legs are mostly what noise of the angles makes of them."""
    legs = [np.nan_to_num(forces[name]) for ours, name in known.coordinates.items()
            if ours[:-2] in LEGS and name in forces]  # fmt: skip
    shares = [_between(time, each) / np.std(each) for each in legs if np.std(each) > 0.0]
    if not shares or (share := float(np.median(shares))) < LIMITS.noisy_moments:
        return []
    return [
        f"Moments: from frame to frame they jump by {100 * share:.0f} % of what they vary by: this "
        "is noise. The coordinates were not low-passed before inverse dynamics, which takes their "
        "accelerations for forces: filter them (6 Hz is usual), and run it again."
    ]


def _between(time: Array, values: Array) -> float:
    """RMS by which `values` are off the mean of those before and after; 0 of frames that are so far
    apart that people move in between.
    """
    rate = 1.0 / float(np.median(np.diff(time)) or np.inf)
    off = values[1:-1] - 0.5 * (values[:-2] + values[2:])
    return 0.0 if rate < FINE_RATE else float(np.sqrt(np.mean(off**2)))


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
    """A sentence on what shows that the `motion` is not that of a walker with this model, or not
    that of the `loads`, with what explains it; none if it may be.
    """
    off = _off(known, motion, loads, belt)
    if not off or max(abs(value) for value in off.values()) < LIMITS.said:
        return []
    changed = [(Change(words, words, prior / len(each)), one, force)
               for prior, each in _changes(known, motion, loads, belt)
               for words, one, force in each]  # fmt: skip

    def log(values: Mapping[str, float], widest: float = LIMITS.patients_beyond) -> float:
        # What is not known any more of a changed motion speaks against it.
        return sum(
            log_likelihood(values.get(name, LIMITS.said * LIMITS.patients_beyond) ** 2, 1.0, widest)
            for name in off
        )

    verdict = weigh(
        [(change, log(_off(known, one, force, belt))) for change, one, force in changed],
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


def _within(motion: Motion, loads: Loads) -> Motion:
    """The part of a motion in which there are loads."""
    end = loads.start + (len(loads.plates[0].force) - 1) / loads.rate
    inside = (motion.time >= loads.start) & (motion.time <= end)
    values = {name: each[inside] for name, each in motion.values.items()}
    return replace(motion, time=motion.time[inside], values=values)


def _changes(
    known: Skeleton, motion: Motion, loads: Loads | None, belt: float | None
) -> Iterator[tuple[float, list[tuple[str, Motion, Loads | None]]]]:
    """Families of what may be wrong: their probability before the data, and of each member its
    words, and motion and loads with it changed back.
    """
    opposite = {"r": "l", "l": "r"}
    exchanged = {
        name: motion.values[known.coordinates[other]]
        for ours, name in known.coordinates.items()
        if (other := ours[:-1] + opposite[ours[-1]]) in known.coordinates
    }
    turns = _turns(known)
    in_degrees = {name: np.degrees(motion.values[name]) for name in turns}
    yield (
        0.05,
        [
            (
                "right and left are exchanged in the names of its columns",
                _with(motion, exchanged),
                loads,
            ),
            (
                f"{', '.join(turns)} are in radians, unlike the other angles",
                _with(motion, in_degrees),
                loads,
            ),
        ],
    )
    kinds: dict[str, list[str]] = {}
    for ours, name in known.coordinates.items():
        if name in motion.given and ours[:-2] in (*LEGS, "hip_adduction"):
            kinds.setdefault(ours[:-2], []).append(name)
    both = [[name] for name in turns] + [names for names in kinds.values() if len(names) == 2]
    for prior, groups in ((0.05, both), (0.02, [[n] for own in kinds.values() for n in own])):
        yield (
            prior,
            [
                (
                    f"{' and '.join(names)} {'has' if len(names) == 1 else 'have'} the other sign",
                    _with(motion, {name: -motion.values[name] for name in names}),
                    loads,
                )
                for names in groups
            ],
        )
    stride = _stride(find_gait(known, motion, None, belt=belt))
    if not np.isfinite(stride):
        return
    rows = round(0.5 * stride / float(np.median(np.diff(motion.time))))
    yield (
        0.03,
        [
            (
                f"the columns of the {side} leg are half a stride off, or a copy of the other's",
                _with(
                    motion,
                    {
                        name: np.roll(motion.values[name], rows)
                        for ours, name in known.coordinates.items()
                        if ours.endswith(f"_{side[0]}")
                    },
                ),
                loads,
            )
            for side in SIDES
        ],
    )
    if loads is not None:
        off = [
            high - LIMITS.sole
            for _, high in _floors(known, motion, _with_forces(known, motion, loads, belt))
        ]
        if off:
            raised = {name: motion.values[name] - np.mean(off) for name in _upward(known)}
            words = "the legs of the model are of another person, or were scaled otherwise"
            yield 0.03, [(words, _with(motion, raised), loads)]
        moved = [
            (way, replace(loads, start=loads.start + later * stride))
            for way, later in (("earlier", 0.5), ("later", -0.5))
        ]
        yield (
            0.03,
            [
                (f"the forces are half a stride {way} than the motion", _within(motion, one), one)
                for way, one in moved
            ],
        )


def _stride(gait: JudgedGait) -> float:
    """s, median of both sides; NaN without a cycle."""
    found = [cycle.duration for side in SIDES for cycle in gait.cycles[side]]
    return float(np.median(found)) if found else float("nan")


def _upward(known: Skeleton) -> list[str]:
    """The coordinate that lifts the root."""
    still = {name: np.zeros(1) for name in known.model.coordinates}
    root = known.model.root()
    names = root.coordinates if root else ()
    body = root.child.body if root else ""
    rests = place(known.model, still)[body][1][0] if root else np.zeros(3)
    lifted = {
        name: float((place(known.model, {**still, name: np.ones(1)})[body][1][0] - rests)
                    @ known.model.up)
        for name in names
        if known.model.coordinates[name].motion == "translational"
    }  # fmt: skip
    return [name for name, way in lifted.items() if way > 0.9]


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


def odd_curves(angles: Mapping[str, Array], moments: Mapping[str, Array], mass: float) -> list[str]:
    """A sentence if mean `angles` (101,) rad and `moments` Nm/kg by our names cannot be of one
    walker of this `mass`, kg, with the mistake that explains them.
    """
    curves = {f"angle_{name}": np.degrees(values) for name, values in angles.items()}
    # Those across the midline hang on step width and model.
    curves |= {f"moment_{name}": m for name, m in moments.items() if name[:-2] in LEGS}
    judged = judge_curves({n: c for n, c in curves.items() if mirrored(n) in curves}, mass=mass)
    return [f"Curves: {judged.words}"] if judged.words else []


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
        if size > 0.0 and level @ lever < -LIMITS.points_away * size:
            found.append(
                f"Forces: {words} they point away from the body's centre of mass, not to it: their "
                "sign is changed, or these are forces on the ground."
            )
    return found
