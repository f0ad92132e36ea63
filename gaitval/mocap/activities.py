"""What somebody does who does not walk on level ground: named, before anything else is doubted.

Axes: the project's (z up), m.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from gaitval.arrays import Array, runs
from gaitval.errors import RecordError
from gaitval.mocap.recording import Recording

LIMITS: Final[Mapping[str, float]] = {
    # Feet that rest at heights further apart are on steps; the lowest stairs rise by 0.1 m a
    # step.
    "step_m": 0.08,
    # Degrees. Floors and treadmills that are called level, and cameras, are off by less than
    # half.
    "steepest": 4.0,
    # Degrees between two steps; ramps for walking are less steep, stairs have 20 to 40.
    "stairs": 17.0,
    # m/s. A foot on the ground, or on a belt relative to it, moves more slowly.
    "rests": 0.12,
    # A foot rests for longer in every stance of a walk.
    "shortest_rest_s": 0.15,
    # The pelvis of a walker rises and falls by 0.02 to 0.08 m.
    "rises_m": 0.15,
    # A foot that is held so much above the other one does not stand on the ground.
    "raised_m": 0.08,
    # Share of the time in which both heels are raised: a jump of 0.1 m in 10 s.
    "jumps": 0.02,
    # m. The lowest marker of the feet of walkers, also of children who turn, is within 0.034
    # m of where it is lowest in a stride; runners and jumpers raise it by 0.1 to 0.46 m.
    "off_ground_m": 0.06,
    # s, more than a stride, in which one of the feet is on the ground.
    "while_s": 1.4,
    # Share of the time for which each foot of somebody who steps on the spot is raised.
    "steps": 0.1,
}
"""What decides in this module: each in the unit and for the reason that is said before it."""

FEET: Final = ("Heel", "MT1", "MT2", "MT5", "Toe")


def resting_feet(recording: Recording, landmarks: Mapping[str, str]) -> Array:
    """Place, m, and velocity, m/s, (n, 2, 3) of the middle of a foot each time that it rests on the
    ground or on a belt, in order of time.
    """
    found: list[tuple[int, Array]] = []
    for side in "RL":
        names = [landmarks.get(f"{side}.{each}") for each in FEET]
        paths = [recording.marker(str(name)) for name in names if name in recording.names]
        if not paths:
            continue
        middle = np.mean(paths, axis=0)
        velocity = np.gradient(middle, 1.0 / recording.marker_rate, axis=0)
        known = np.isfinite(velocity).all(axis=1)
        if known.sum() < 2:
            continue
        # In stance all of the foot moves as the ground does, so each marker moves alike.
        each = np.stack([np.gradient(path, 1.0 / recording.marker_rate, axis=0) for path in paths])
        apart = np.linalg.norm(each - each.mean(axis=0), axis=2).max(axis=0)
        level = np.linalg.norm(velocity[:, :2], axis=1)
        still = known & (apart < LIMITS["rests"]) & (np.abs(velocity[:, 2]) < 3 * LIMITS["rests"])
        still &= level < np.nanpercentile(level, 60.0)
        for begin, end in zip(*runs(still), strict=True):
            if end - begin >= LIMITS["shortest_rest_s"] * recording.marker_rate:
                during = slice(begin, end)
                place = np.median(middle[during], axis=0), np.median(velocity[during], axis=0)
                found.append((int(begin), np.stack(place)))
    found.sort(key=lambda each: each[0])
    return np.array([each for _, each in found]).reshape(-1, 2, 3)


def check_level(recording: Recording, landmarks: Mapping[str, str], pelvis: Array) -> None:
    """Refuse stairs and slopes, by where the feet rest and by the path (T, 3) m of the `pelvis`."""
    feet = resting_feet(recording, landmarks)
    if len(feet) < 3:
        return
    places, velocities = feet[:, 0], feet[:, 1]
    seen = pelvis[np.isfinite(pelvis).all(axis=1)]
    climbed = float(seen[-1, 2] - seen[0, 2])
    heights = places[:, 2]
    way = np.linalg.norm(places[-1, :2] - places[0, :2])
    steps = np.abs(np.diff(heights))
    apart = np.linalg.norm(np.diff(places[:, :2], axis=0), axis=1)
    # Stairs are steeper than ramps; a foot beside the other one has no distance to it.
    steep = np.degrees(np.arctan2(steps, np.maximum(apart, 0.1))) > LIMITS["stairs"]
    # Two feet that land side by side on one step do not differ.
    if (
        np.ptp(heights) > 2 * LIMITS["step_m"]
        and (steep & (steps > LIMITS["step_m"])).sum() >= 2
        and abs(climbed) > LIMITS["step_m"]
    ):
        raise RecordError(
            f"{recording.source}: the feet rest at heights that differ by up to "
            f"{np.ptp(heights):.2f} m, {np.median(steps[steps > LIMITS['step_m']]):.2f} m from one "
            f"to the next, and the pelvis {'rises' if climbed > 0 else 'sinks'} by "
            f"{abs(climbed):.2f} m: these are stairs. Only walking on level ground can "
            "be analysed; give such a trial, or a part of this one on the level with --trial-time."
        )
    levels = np.sort(heights)
    above = int(np.argmax(np.diff(levels))) + 1
    between = float(levels[above] - levels[above - 1])
    what = "gets onto" if climbed > 0 else "steps or jumps down from"
    if (
        between > 2 * LIMITS["step_m"]
        and max(np.ptp(levels[:above]), np.ptp(levels[above:])) < LIMITS["step_m"]
    ):
        raise RecordError(
            f"{recording.source}: the feet rest on two levels that are {between:.2f} m apart, and "
            f"on each of them the ground is level: the person {what} a box or a step. Only "
            "walking on level ground can be analysed; give such a trial, or a part of this one on "
            "the level with --trial-time."
        )
    if way > 1.0:
        along = (places[:, :2] - places[0, :2]) @ (places[-1, :2] - places[0, :2]) / way
        slope = float(np.degrees(np.arctan(np.polyfit(along, heights, 1)[0])))
    else:
        level = np.linalg.norm(velocities[:, :2], axis=1)
        moved = level > 3 * LIMITS["rests"]
        if moved.sum() < 3:
            return
        # A belt takes the foot backwards, so it sinks on the way up.
        slope = float(np.degrees(np.arctan(np.median(-velocities[moved, 2] / level[moved]))))
    if abs(slope) > LIMITS["steepest"]:
        raise RecordError(
            f"{recording.source}: the ground under the feet goes {'up' if slope > 0 else 'down'} "
            f"by {abs(slope):.0f}°: this is a slope. Only walking on level ground can be analysed; "
            "give such a trial. If the floor was level, the laboratory's axes are tilted: "
            "calibrate the cameras to the floor."
        )


def check_on_ground(recording: Recording, landmarks: Mapping[str, str]) -> None:
    """Refuse who leaves the ground with both feet, at any speed; not where a heel or all of a
    forefoot has no marker, which does not show it.
    """
    low = []
    for side in "RL":
        names = [landmarks.get(f"{side}.{each}") for each in FEET]
        if names[0] not in recording.names or not {*names[1:]} & {*recording.names}:
            return
        heights = [recording.marker(str(each))[:, 2] for each in names if each in recording.names]
        low.append(np.min(heights, axis=0))  # NaN where one is not seen
    lowest = np.min(low, axis=0)
    known = np.asarray(np.isfinite(lowest))
    half = round(0.5 * LIMITS["while_s"] * recording.marker_rate)
    ground = np.where(known, lowest, np.inf)
    padded = np.pad(ground, half, constant_values=np.inf)
    ground = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1).min(axis=1)
    off = (lowest[known] - ground[known]) > LIMITS["off_ground_m"]
    if off.sum() > LIMITS["jumps"] * len(lowest):
        raise RecordError(
            f"{recording.source}: both feet are off the ground at once, {100 * off.mean():.0f} % "
            "of the time: the person runs, hops or jumps. Only walking can be analysed; give a "
            "walking trial, or the part of this one in which the person walks with --trial-time."
        )


def what_instead(recording: Recording, landmarks: Mapping[str, str], pelvis: Array) -> str:
    """What somebody does whose feet, and pelvis with the path (T, 3) m, go nowhere; empty where it
    is not known.
    """
    seen = pelvis[np.isfinite(pelvis).all(axis=1)]
    rise = float(np.ptp(np.percentile(seen[:, 2], [2, 98]))) if len(seen) else 0.0
    heels = {
        side: recording.marker(landmarks[f"{side}.Heel"])[:, 2]
        for side in "RL"
        if landmarks.get(f"{side}.Heel") in recording.names
    }
    if len(heels) == 2:
        up = np.stack(
            [each - np.nanpercentile(each, 20.0) > LIMITS["raised_m"] for each in heels.values()]
        )
        together, either = float(up.all(axis=0).mean()), float(up.any(axis=0).mean())
        # Who stands on the toes raises both heels, and the pelvis by less.
        if together > LIMITS["jumps"] and rise > LIMITS["rises_m"]:
            return "both feet leave the ground at once: the person jumps"
        if together < 0.1 * either and min(up.mean(axis=1)) > LIMITS["steps"]:
            return "the feet are raised in turn where they are: the person steps on the spot"
    if rise > LIMITS["rises_m"]:
        return (
            f"the pelvis rises and falls by {rise:.2f} m over feet that stay where they are: the "
            "person sits down, stands up or squats"
        )
    if len(heels) == 2:
        apart = heels["R"] - heels["L"]
        apart = apart[np.isfinite(apart)]
        shares = {
            side: float(np.mean(sign * apart > LIMITS["raised_m"])) if len(apart) else 0.0
            for side, sign in (("right", 1.0), ("left", -1.0))
        }
        raised, share = max(shares.items(), key=lambda each: each[1])
        # Who steps on the spot raises both.
        if share > 0.25 and min(shares.values()) < 0.1 * share:
            return f"the {raised} foot is held above the other one: the person stands on one leg"
    return ""
