"""Every limit and every goal of `tolerances.toml` can be missed: for each of its rows something is
done to a walk, or to a recording, that keeps all limits, and its verdict turns to failed, in
`metrics.json` or the import's verdicts as on the page that a reader sees.

The walk follows the record of subject 5 exactly and long enough; the recording is of a made-up
person who stands still on two plates. What is changed is what the simulation or the laboratory
gives, and everything after it is worked out as for any other.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from html import escape
from types import SimpleNamespace

import numpy as np
import pytest
from html_page import both_pages, without_figures
from recording_summary import sample
from standing_person import StandingPerson, standing_person
from synthetic_walk import MASS, MODEL, perfect_walk, sharp_filter, walks_of

from gaitval._internal.io.artefacts import write_json
from gaitval.constants import GRAVITY
from gaitval.coordinates import ACTUATED, COORDINATES, LEG, RANGES
from gaitval.datasets.subject_file import builtin_subjects, load_subject
from gaitval.importing.summary import limit_rows, verdicts
from gaitval.inverse.inverse_dynamics import inverse_dynamics
from gaitval.inverse.inverse_kinematics import inverse_kinematics
from gaitval.inverse.marked_body import marker_positions
from gaitval.inverse.marker_placement import place_markers
from gaitval.metrics.acceptance import Baselines
from gaitval.metrics.baselines import Prediction, predictions
from gaitval.metrics.push_recovery import Push, evenly_spaced, required_pushes
from gaitval.metrics.recording_limits import AFTER_REDUCTION
from gaitval.metrics.results import PushRecovery
from gaitval.metrics.tolerances import JUDGED_UNITS, WALK_UNITS, Tolerance, load_registry
from gaitval.metrics.unrecorded import STEP_WIDTH, TRUNK
from gaitval.metrics.validation import StageResults, validate
from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames
from gaitval.quantities.joint_power import BURSTS
from gaitval.quantities.tendon_force import moment_arm
from gaitval.reporting.recording_report import write_recording_report
from gaitval.reporting.report import write_report
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.simulation.rollout import Rollout

SUBJECT = load_subject("S05")
RECORD = SUBJECT.record()
PHASES = (0.0, 0.5)
CONFIGURATION = sharp_filter(cycles=6, start_phases=PHASES)
WEIGHT = MASS * GRAVITY

ELSEWHERE = {*JUDGED_UNITS, "step_width_error"}
"""Limits of OpenSim's models and results are in tests/judge; that of the own step width, which this
record does not have, in tests/metrics/test_unrecorded.py."""
REGISTRY = [row for row in load_registry().tolerance if row.measure not in ELSEWHERE]
OF_WALKS = {row.id: row for row in REGISTRY if row.measure in WALK_UNITS}
OF_RECORDINGS = {row.id: row for row in REGISTRY if row.measure not in WALK_UNITS}


# --- walks --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Simulated:
    """What the simulation gives: a walk from each of `PHASES`, and the pushes that felled."""

    walks: tuple[Rollout, ...]
    felled_by: frozenset[Push] = frozenset()


Change = Callable[[Simulated, float], Simulated]
"""Makes the measure of a row about as large as that, in its unit."""


@dataclass(frozen=True)
class Mutation:
    """What is done to miss a bound, and the ids of the rows whose limits that fails, and whose
    goals it misses, besides."""

    change: Callable
    drags: frozenset[str] = frozenset()
    goals: frozenset[str] = frozenset()


def _compared(simulated: Simulated, **arrays: np.ndarray) -> Simulated:
    first, *others = simulated.walks
    return replace(simulated, walks=(replace(first, **arrays), *others))


def shift_angles(**shares: float) -> Change:
    """Add a constant, in shares of the size in degrees, to angles."""

    def change(simulated: Simulated, size: float) -> Simulated:
        positions = simulated.walks[0].positions.copy()
        for name, share in shares.items():
            positions[:, COORDINATES.index(name)] += np.deg2rad(share * size)
        return _compared(simulated, positions=positions)

    return change


def shift_moment(name: str) -> Change:
    def change(simulated: Simulated, size: float) -> Simulated:
        moments = simulated.walks[0].moments.copy()
        moments[:, ACTUATED.index(name)] += size * MASS
        return _compared(simulated, moments=moments)

    return change


def shift_force(axis: int) -> Change:
    def change(simulated: Simulated, size: float) -> Simulated:
        ground = simulated.walks[0].ground_reaction.copy()
        ground[:, 0, axis] += size / 100.0 * WEIGHT
        return _compared(simulated, ground_reaction=ground)

    return change


def guess(kind: str) -> Change:
    """A curve is further from the record than a prediction without a model."""

    def change(simulated: Simulated, size: float) -> Simulated:
        prediction, *_ = unchanged_metrics()["predictions"]
        name = {"angles": "subtalar_angle_r", "moments": "knee_angle_l", "forces": "forward_r"}[
            kind
        ]
        error = (1.05 - size / BEYOND**2) * prediction["rmse"][kind][name]
        if kind == "angles":
            return shift_angles(subtalar_angle_r=1.0)(simulated, error)
        return (
            shift_moment("knee_angle_l")(simulated, error)
            if kind == "moments"
            else shift_force(0)(simulated, error)
        )

    return change


def ring(simulated: Simulated, size: float) -> Simulated:
    """The vertical force under the right foot rings at 18 Hz, unseen behind the filter."""
    walk = simulated.walks[0]
    ground = walk.ground_reaction.copy()
    wave = np.sqrt(2.0) * size / 100.0 * WEIGHT * np.sin(2 * np.pi * 18.0 * walk.time)
    ground[:, 0, 2] += np.where(walk.phase % 1.0 < 0.55, wave, 0.0) / np.sqrt(0.55)
    return _compared(simulated, ground_reaction=ground)


def hold_arm(simulated: Simulated, size: float) -> Simulated:
    """A moment at the right shoulder, which does no work."""
    moments = simulated.walks[0].moments.copy()
    moments[:, ACTUATED.index("arm_flex_r")] = size
    return _compared(simulated, moments=moments)


def jerk_arm(simulated: Simulated, size: float) -> Simulated:
    """The same for an instant in each cycle."""
    walk = simulated.walks[0]
    moments = walk.moments.copy()
    moments[:, ACTUATED.index("arm_flex_r")] = np.where(walk.phase % 1.0 < 0.02, size, 0.0)
    return _compared(simulated, moments=moments)


def swing_arm(simulated: Simulated, size: float) -> Simulated:
    """The right arm does work, with little moment and a great speed."""
    walk = simulated.walks[0]
    power = np.clip(walk.moments * walk.velocities[:, 6:], 0.0, None)
    legs = power[:, : ACTUATED.index("lumbar_extension")].sum(axis=1).mean()
    moments, velocities = walk.moments.copy(), walk.velocities.copy()
    moments[:, ACTUATED.index("arm_flex_r")] = 1.0
    velocities[:, COORDINATES.index("arm_flex_r")] = size / 100.0 * legs
    return _compared(simulated, moments=moments, velocities=velocities)


def tilt_trunk(simulated: Simulated, size: float) -> Simulated:
    """The trunk leans forward."""
    positions = simulated.walks[0].positions.copy()
    tilt = np.deg2rad(size * TRUNK["mean tilt"][1])
    positions[:, COORDINATES.index("lumbar_extension")] -= tilt
    return _compared(simulated, positions=positions)


def twist_trunk(simulated: Simulated, size: float) -> Simulated:
    moments = simulated.walks[0].moments.copy()
    moments[:, ACTUATED.index("lumbar_rotation")] = size * MASS
    return _compared(simulated, moments=moments)


def hold_toes(simulated: Simulated, size: float) -> Simulated:
    """The right toes, which do not turn, hold against their extension."""
    moments = simulated.walks[0].moments.copy()
    moments[:, ACTUATED.index("mtp_angle_r")] = -size * MASS
    return _compared(simulated, moments=moments)


def brake_with_toes(simulated: Simulated, size: float) -> Simulated:
    """The right toes take up work, with little moment and a great speed."""
    walk = simulated.walks[0]
    moments, velocities = walk.moments.copy(), walk.velocities.copy()
    moments[:, ACTUATED.index("mtp_angle_r")] = -0.02 * MASS
    velocities[:, COORDINATES.index("mtp_angle_r")] = size / (0.02 * RECORD.stride_time)
    return _compared(simulated, moments=moments, velocities=velocities)


def ring_in_the_trunk(simulated: Simulated, size: float) -> Simulated:
    walk = simulated.walks[0]
    moments = walk.moments.copy()
    wave = np.sqrt(2.0) * size * MASS * np.sin(2 * np.pi * 15.0 * walk.time)
    moments[:, ACTUATED.index("lumbar_rotation")] = wave
    return _compared(simulated, moments=moments)


def alternate(simulated: Simulated, size: float) -> Simulated:
    """A moment of the trunk that jumps back and forth in a tenth of the cycle."""
    walk = simulated.walks[0]
    moments = walk.moments.copy()
    sign = np.where(np.arange(len(walk.time)) % 2, 0.5, -0.5)
    step = walk.time[1] - walk.time[0]
    jumps = sign * (walk.phase % 1.0 < 0.1)
    moments[:, ACTUATED.index("lumbar_rotation")] = jumps * size * step * MASS
    return _compared(simulated, moments=moments)


def twist_foot(simulated: Simulated, size: float) -> Simulated:
    free = simulated.walks[0].free_moment.copy()
    free[:, 1] = size / 100.0 * WEIGHT * SUBJECT.height_m
    return _compared(simulated, free_moment=free)


def let_creep(simulated: Simulated, size: float) -> Simulated:
    """The body, pressed into the ground, is drawn over it on legs that do not turn under load."""
    walk = simulated.walks[0]
    positions, velocities = walk.positions.copy(), walk.velocities.copy()
    positions[:, COORDINATES.index("pelvis_tz")] -= 0.5
    velocities[:, :6] = 0.0
    velocities[:, COORDINATES.index("pelvis_tx")] = size / 100.0
    for side in range(2):
        loaded = walk.ground_reaction[:, side, 2] > 0.4 * WEIGHT
        leg = [COORDINATES.index(f"{name}_{'rl'[side]}") for name in LEG]
        velocities[np.ix_(loaded, leg)] = 0.0
    return _compared(simulated, positions=positions, velocities=velocities)


def overextend(simulated: Simulated, size: float) -> Simulated:
    """The right knee for an instant between two of the samples that are compared."""
    walk = simulated.walks[0]
    positions = walk.positions.copy()
    cycle = CONFIGURATION.validation.settling_cycles + 1
    begins = np.flatnonzero(np.diff(walk.phase % 1.0) < 0.0)[cycle] + 1
    row = begins + round(0.505 * RECORD.stride_time / (walk.time[1] - walk.time[0]))
    positions[row, COORDINATES.index("knee_angle_r")] = RANGES["knee_angle_r"][0] - 0.02
    return _compared(simulated, positions=positions)


def _narrowing(phase: np.ndarray) -> np.ndarray:
    """A sway of the pelvis towards the left foot when the right one is flat, and back."""
    return np.cos(2 * np.pi * (phase - 0.18))


def step_wide(simulated: Simulated, size: float) -> Simulated:
    walk = simulated.walks[0]
    rows = unchanged_metrics()["walks"]["nominal"]["spatiotemporal"]
    (now,) = (row["mean"] for row in rows if row["name"] == "step_width")
    mean, sd = STEP_WIDTH
    wider = SUBJECT.leg_length_m * (mean + size * sd) - now
    positions = walk.positions.copy()
    positions[:, 4] -= 0.5 * wider * _narrowing(walk.phase)
    return _compared(simulated, positions=positions)


def push_off(simulated: Simulated, size: float) -> Simulated:
    """The right ankle pushes harder for an instant at its peak of power."""
    walk = simulated.walks[0]
    recorded = np.array(unchanged_metrics()["record"]["joint_power"]["power"]["ankle_angle_r"])
    peak = recorded.argmax() / 100
    column = ACTUATED.index("ankle_angle_r")
    rate = walk.velocities[:, 6 + column]
    fastest = np.abs(rate[np.abs(walk.phase % 1.0 - peak) < 0.02]).mean()
    moments = walk.moments.copy()
    instant = np.exp(-(((walk.phase % 1.0 - peak) / 0.012) ** 2))
    moments[:, column] += size * BURSTS["A2"].spread * MASS / fastest * instant * np.sign(rate)
    return _compared(simulated, moments=moments)


def work_more(simulated: Simulated, size: float) -> Simulated:
    """The left knee adds more energy wherever it adds any."""
    walk = simulated.walks[0]
    column = ACTUATED.index("knee_angle_l")
    rate, moments = walk.velocities[:, 6 + column], walk.moments.copy()
    adds = moments[:, column] * rate > 0.0
    share = np.mean(np.where(adds, rate**2, 0.0)) * RECORD.stride_time
    moments[:, column] += np.where(adds, size * MASS / share * rate, 0.0)
    return _compared(simulated, moments=moments)


def pull_harder(simulated: Simulated, size: float) -> Simulated:
    """The right Achilles tendon pulls harder wherever it pulls."""
    walk = simulated.walks[0]
    column = ACTUATED.index("ankle_angle_r")
    pulls = walk.moments[:, column] < 0.0
    more = size * WEIGHT * moment_arm(walk.positions[:, 6 + column]) / np.sqrt(pulls.mean())
    moments = walk.moments.copy()
    moments[:, column] -= np.where(pulls, more, 0.0)
    return _compared(simulated, moments=moments)


def bob(simulated: Simulated, size: float) -> Simulated:
    """The centre of mass rises and falls further."""
    walk = simulated.walks[0]
    centre = walk.centre_of_mass.copy()
    centre[:, 2] += 1e-3 * size * np.sqrt(2.0) * np.sin(4 * np.pi * walk.phase)
    return _compared(simulated, centre_of_mass=centre)


def land_hard(simulated: Simulated, size: float) -> Simulated:
    """The left foot is loaded more around its first peak."""
    walk = simulated.walks[0]
    recorded = np.array(unchanged_metrics()["record"]["curves"]["forces"]["vertical_l"])
    peak = recorded[:31].argmax() / 100
    away = (walk.phase - RECORD.left_phase - peak + 0.5) % 1.0 - 0.5
    ground = walk.ground_reaction.copy()
    ground[:, 1, 2] += size / 100.0 * WEIGHT * np.exp(-((away / 0.05) ** 2))
    return _compared(simulated, ground_reaction=ground)


def roll_forward(simulated: Simulated, size: float) -> Simulated:
    """The ground pushes further ahead of the left ankle."""
    walk = simulated.walks[0]
    own = (walk.phase - RECORD.left_phase) % 1.0
    vertical = walk.ground_reaction[:, 1, 2]
    moments = walk.moments.copy()
    rolls = (own > 0.10) & (own < 0.55)
    moments[:, ACTUATED.index("ankle_angle_l")] -= np.where(rolls, 1e-3 * size * vertical, 0.0)
    return _compared(simulated, moments=moments)


def press_harder(simulated: Simulated, size: float) -> Simulated:
    """Scale the vertical force under the right foot, which leaves its swing empty."""
    ground = simulated.walks[0].ground_reaction.copy()
    share = np.sqrt((ground[:, 0, 2] ** 2).mean()) / WEIGHT
    ground[:, 0, 2] *= 1.0 + size / 100.0 / share
    return _compared(simulated, ground_reaction=ground)


def hurry(simulated: Simulated, size: float) -> Simulated:
    """The same steps in less time."""
    return _compared(simulated, time=simulated.walks[0].time / (1.0 + size / 100.0))


def leave_late(simulated: Simulated, size: float) -> Simulated:
    """The right foot stays on the ground, with little more than the threshold of an event."""
    walk = simulated.walks[0]
    ground = walk.ground_reaction.copy()
    stance = RECORD.stance_fraction["right"]
    late = (walk.phase % 1.0 > 0.5) & (walk.phase % 1.0 < stance + size / 100.0)
    threshold = CONFIGURATION.contact.event_threshold
    ground[late, 0, 2] = np.maximum(ground[late, 0, 2], 1.1 * threshold)
    return _compared(simulated, ground_reaction=ground)


def walk_on_for(cycles: int) -> Change:
    """The second walk ends, upright, after so many cycles in a row."""

    def change(simulated: Simulated, size: float) -> Simulated:
        first, second = simulated.walks
        last = CONFIGURATION.validation.settling_cycles + 1 + cycles
        return replace(simulated, walks=(first, _rows(second, second.phase < last + 0.2)))

    return change


def fall(simulated: Simulated, size: float) -> Simulated:
    first, second = simulated.walks
    return replace(simulated, walks=(first, replace(second, fell=np.array([1.0]))))


def fall_from_pushes(count: int) -> Change:
    """Some pushes fell that begin at the first phase."""
    first = [push for push in required_pushes(CONFIGURATION.pushes) if push.phase == 0.0]

    def change(simulated: Simulated, size: float) -> Simulated:
        return replace(simulated, felled_by=frozenset(first[:count]))

    return change


def _rows(walk: Rollout, chosen: np.ndarray, **further: np.ndarray) -> Rollout:
    """Some rows of a walk."""
    whole = ("mu", "start_phase", "fell", "hip_centre")
    rows = {name: array[chosen] for name, array in vars(walk).items() if name not in whole}
    return replace(walk, **rows, **further)


ONE_LEG = {"hip_flexion_r": 1.0, "hip_flexion_l": -1.0}
"""The right leg swings ahead and the left one behind: steps of two lengths."""
DEGREE_IN_CM = 3.0
"""Change of the step length for one degree of `ONE_LEG`, of legs of 0.85 m."""

CONCERN = frozenset({"angles-wilken-detectable"})
ANGLES, MOMENTS, FORCES = (frozenset({f"skill-{kind}"}) for kind in ("angles", "moments", "forces"))
"""What is this far off a guess comes nearer to."""

WORK = frozenset({"power-bursts", "joint-work"})
"""A moment that is off does other work."""
JUMPS = frozenset({"torque-rate"})
"""A moment that is off in a part of the cycle jumps at its ends."""
ANKLE = frozenset({"sagittal-moments", "pressure-arm"})
"""The limits of the tendon's force are those of the moment."""

LIMITS = {
    "sagittal-angles": Mutation(shift_angles(ankle_angle_r=1.0)),
    "other-angles": Mutation(shift_angles(hip_rotation_r=1.0), CONCERN | ANGLES),
    "angles-opensim-tracking": Mutation(
        shift_angles(ankle_angle_l=1.0), CONCERN | ANGLES | {"sagittal-angles"}
    ),
    "angles-wilken-detectable": Mutation(shift_angles(subtalar_angle_l=1.0), ANGLES),
    "sagittal-moments": Mutation(shift_moment("knee_angle_l"), MOMENTS | WORK),
    "frontal-moments": Mutation(shift_moment("hip_adduction_l"), MOMENTS),
    "force-forward": Mutation(shift_force(0), FORCES),
    "force-medial": Mutation(shift_force(1), FORCES),
    "force-vertical": Mutation(press_harder, FORCES | {"loading-peak"}),
    "skill-angles": Mutation(guess("angles")),
    "skill-moments": Mutation(guess("moments"), WORK),
    "skill-forces": Mutation(guess("forces")),
    "force-ringing": Mutation(ring),
    "shoulder-moment-rms": Mutation(hold_arm),
    "shoulder-moment-peak": Mutation(jerk_arm),
    "arm-work": Mutation(swing_arm),
    "trunk-motion": Mutation(tilt_trunk),
    "lumbar-moment": Mutation(twist_trunk),
    "toe-moment": Mutation(hold_toes),
    "toe-work": Mutation(brake_with_toes),
    "moment-ringing": Mutation(ring_in_the_trunk),
    "torque-rate": Mutation(alternate),
    "free-moment": Mutation(twist_foot),
    "foot-creep": Mutation(let_creep),
    "knee-range": Mutation(overextend),
    "step-width": Mutation(step_wide),
    "power-bursts": Mutation(push_off),
    "joint-work": Mutation(work_more, JUMPS),
    "tendon-force": Mutation(pull_harder, MOMENTS | WORK | ANKLE | JUMPS | {"moment-ringing"}),
    "centre-of-mass": Mutation(bob),
    "loading-peak": Mutation(land_hard),
    "pressure-arm": Mutation(roll_forward, MOMENTS | {"joint-work"} | JUMPS),
    "walking-speed": Mutation(hurry),
    "stance-fraction": Mutation(leave_late),
    "step-length": Mutation(
        shift_angles(**{name: share / DEGREE_IN_CM for name, share in ONE_LEG.items()})
    ),
    "consecutive-cycles": Mutation(walk_on_for(49)),
    "falls": Mutation(fall),
    "push-survival": Mutation(fall_from_pushes(6)),
}
GOALS = {name: replace(each, drags=frozenset()) for name, each in LIMITS.items()} | {
    "consecutive-cycles": Mutation(walk_on_for(99)),
    "push-survival": Mutation(fall_from_pushes(1)),
    "other-angles": Mutation(shift_angles(hip_rotation_r=1.0), ANGLES, ANGLES),
    "sagittal-moments": Mutation(shift_moment("knee_angle_l"), MOMENTS | WORK, MOMENTS | WORK),
    "frontal-moments": Mutation(shift_moment("hip_adduction_l"), MOMENTS, MOMENTS),
    "force-forward": Mutation(shift_force(0), FORCES, FORCES),
    "force-medial": Mutation(shift_force(1), FORCES, FORCES),
    "force-vertical": Mutation(press_harder, FORCES, FORCES | {"loading-peak"}),
    "skill-moments": Mutation(guess("moments"), goals=WORK),
    "loading-peak": Mutation(land_hard, goals=FORCES),
    "power-bursts": Mutation(push_off, goals=JUMPS),
    "joint-work": Mutation(work_more, JUMPS, JUMPS),
    "pressure-arm": Mutation(roll_forward, JUMPS, MOMENTS | {"joint-work"} | JUMPS),
    "tendon-force": Mutation(
        pull_harder,
        MOMENTS | {"joint-work"} | JUMPS,
        MOMENTS | {"joint-work"} | ANKLE | JUMPS,
    ),
}
"""The same done by less, where not said otherwise; `drags` are limits that are stricter."""


@cache
def unchanged_walk() -> Simulated:
    """From phase 0, and the same walk from where it is in phase 0.5."""
    walk = perfect_walk(RECORD, cycles=103)
    later = _rows(walk, walk.phase >= 0.5, start_phase=np.array([0.5]))
    return Simulated((walk, replace(later, time=later.time - later.time[0])))


def metrics_of(simulated: Simulated) -> dict:
    """`metrics.json` of what was simulated."""
    settings = CONFIGURATION.pushes
    required = required_pushes(settings)
    stood = [push not in simulated.felled_by for push in required]
    ahead = dict.fromkeys(round(math.degrees(push.direction), 6) for push in required)
    directions = evenly_spaced(settings.directions)
    recovery = PushRecovery(
        seconds=CONFIGURATION.environment.push_seconds,
        cycles=settings.cycles,
        resolution=settings.resolution,
        ceiling=settings.largest,
        phases=list(settings.phases),
        directions=[round(math.degrees(each), 6) for each in directions],
        largest=[[settings.force] * len(directions) for _ in settings.phases],
        force=settings.force,
        criterion_directions=list(ahead),
        survived=np.reshape(stood, (len(settings.phases), -1)).tolist(),
    )
    walks = walks_of(simulated.walks, CONFIGURATION)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gaitval.metrics.baselines.predictions", lambda *_: guesses())
        # a guess that is nearer fails it too (tests/metrics/test_acceptance.py); here limits alone
        patch.setattr(Baselines, "best", lambda *_: None)
        return validate(
            SUBJECT,
            RECORD,
            MODEL,
            walks,
            None,
            CONFIGURATION,
            StageResults(pushes=recovery),
            others=builtin_subjects(),
        ).as_dict()


@cache
def guesses() -> list[Prediction]:
    """What every walk here is compared with, worked out once: no change of a walk changes it."""
    return predictions(SUBJECT, builtin_subjects())


@cache
def unchanged_metrics() -> dict:
    return metrics_of(unchanged_walk())


BEYOND = 1.15
"""How far beyond its bound a changed value is aimed."""


@cache
def changed_metrics(name: str, of: str) -> dict:
    """`metrics.json` of a walk that misses the limit or the goal of a row."""
    row, mutation = OF_WALKS[name], {"limit": LIMITS, "goal": GOALS}[of][name]
    bound = row.value if of == "limit" else row.goal
    return metrics_of(mutation.change(unchanged_walk(), BEYOND * bound))


def failed(metrics: dict) -> set[str]:
    return {row["id"] for row in metrics["tolerances"] if not row["passed"]}


def missed(metrics: dict) -> set[str]:
    return {row["id"] for row in metrics["tolerances"] if row["reached"] is False}


# --- recordings ---------------------------------------------------------------------------

FRAMES = 60
RATE = 100.0


@dataclass(frozen=True)
class Recorded:
    """What the laboratory gives of a person who stands still: places of the markers in standing,
    (FRAMES, M, 3) m of those worn after, and (FRAMES, 2, 3) what the plates show."""

    places: Mapping[str, np.ndarray]
    markers: np.ndarray
    force: np.ndarray
    free_moment: np.ndarray


@cache
def standing() -> StandingPerson:
    return standing_person(toe_out={"r": 0.0, "l": 0.0})


@cache
def fitted() -> tuple[ModelMarker, ...]:
    marker_set = load_marker_set("wbds")
    return tuple(
        ModelMarker(name, marker_set.markers[name].segment, place)
        for name, place in standing().markers(marker_set)[1].items()
        if not marker_set.markers[name].static_only
    )


@cache
def unchanged_recording() -> Recorded:
    person = standing()
    still = np.tile(person.pose, (FRAMES, 1))
    weight = sum(segment.mass for segment in person.model.segments) * GRAVITY
    force = np.zeros((FRAMES, 2, 3))
    force[..., 2] = 0.5 * weight
    return Recorded(
        person.markers(load_marker_set("wbds"))[0],
        marker_positions(person.model, fitted(), still),
        force,
        np.zeros((FRAMES, 2, 3)),
    )


@cache
def centre_of_mass() -> np.ndarray:
    model, pose = standing().model, standing().pose
    mass = np.array([segment.mass for segment in model.segments])
    places = [
        frame[:3, :3] @ segment.centre_of_mass + frame[:3, 3]
        for segment, frame in zip(model.segments, segment_frames(model, pose[None])[0], strict=True)
    ]
    return mass @ places / mass.sum()


@cache
def feet() -> np.ndarray:
    """(2, 3) m: where the feet press so that the weight is over them."""
    frames = segment_frames(standing().model, standing().pose[None])[0]
    ankles = np.array([frames[SEGMENTS.index(f"foot_{side}"), :3, 3] for side in "rl"])
    return (ankles + centre_of_mass() - ankles.mean(axis=0)) * [1.0, 1.0, 0.0]


def import_of(recorded: Recorded) -> SimpleNamespace:
    """As much of an import as its limits are about."""
    person, known = standing(), np.ones((FRAMES, 2), dtype=bool)
    still = np.tile(person.pose, (FRAMES, 1))
    point = np.tile(feet(), (FRAMES, 1, 1))
    time = np.arange(FRAMES) / RATE
    dynamics = inverse_dynamics(
        person.model, time, still, recorded.force, point, recorded.free_moment
    )
    walk = SimpleNamespace(
        name="still",
        kinematics=inverse_kinematics(person.model, fitted(), recorded.markers),
        loads=SimpleNamespace(valid=known, rate=RATE, centre_of_pressure=point),
        dynamics=dynamics,
        consistent=SimpleNamespace(dynamics=dynamics),
    )
    placement = place_markers(
        person.model, person.measured, recorded.places, load_marker_set("wbds")
    )
    body = SimpleNamespace(placement=placement)
    request = SimpleNamespace(aid=None, consistent=False)
    return SimpleNamespace(request=request, body=body, trials=[walk], weight_ratio=None)


def misplace_one(recorded: Recorded, size: float) -> Recorded:
    """One landmark was pointed at wrongly; the pose takes up the rest of its distance."""
    return _misplaced(recorded, {"R.MT5": [0.0, size / 0.55, 0.0]})


def misplace_many(recorded: Recorded, size: float) -> Recorded:
    """Landmarks were pointed at too high and too low in turn; the pose takes up much of it."""
    feet = [f"{side}.{name}" for side in "RL" for name in ("MT1", "MT5", "Heel")]
    names = ["R.ASIS", "L.ASIS", *feet, "R.Knee", "L.Knee"]
    away = {name: [0.0, 0.0, (-1) ** i * size / 0.45] for i, name in enumerate(names)}
    return _misplaced(recorded, away)


def _misplaced(recorded: Recorded, away: Mapping[str, Sequence[float]]) -> Recorded:
    """Landmarks in standing moved by (3,) cm."""
    moved = {name: recorded.places[name] + 0.01 * np.array(by) for name, by in away.items()}
    return replace(recorded, places={**recorded.places, **moved})


def shake(recorded: Recorded, size: float) -> Recorded:
    """Every marker is off by as much, each in a direction of its own; the pose takes up some."""
    away = np.random.default_rng(0).standard_normal(recorded.markers.shape)
    away *= 0.01 * size / 0.92 / np.linalg.norm(away, axis=2, keepdims=True)
    return replace(recorded, markers=recorded.markers + away)


def jump(recorded: Recorded, size: float) -> Recorded:
    """One marker is off in one frame; the pose takes up some."""
    markers = recorded.markers.copy()
    markers[30, 5, 1] += 0.01 * size / 0.8
    return replace(recorded, markers=markers)


def push(frames: slice) -> Callable[[Recorded, float], Recorded]:
    """The right plate shows a force more, N, with a free moment that leaves none about the
    pelvis."""

    def change(recorded: Recorded, size: float) -> Recorded:
        force, free_moment = recorded.force.copy(), recorded.free_moment.copy()
        more = np.array([size, 0.0, 0.0])
        force[frames, 0] += more
        free_moment[frames, 0] -= np.cross(feet()[0] - standing().pose[3:6], more)
        return replace(recorded, force=force, free_moment=free_moment)

    return change


def twist(frames: slice) -> Callable[[Recorded, float], Recorded]:
    """The right plate shows a moment more, Nm."""

    def change(recorded: Recorded, size: float) -> Recorded:
        free_moment = recorded.free_moment.copy()
        free_moment[frames, 0, 1] += size
        return replace(recorded, free_moment=free_moment)

    return change


def push_share(recorded: Recorded, size: float) -> Recorded:
    """`push` in % of what is under one foot."""
    return push(ONCE)(recorded, size / 100.0 * recorded.force[0, 0, 2])


def twist_share(recorded: Recorded, size: float) -> Recorded:
    """`twist` in % of what is under one foot times the height of the centre of mass."""
    return twist(ONCE)(recorded, size / 100.0 * recorded.force[0, 0, 2] * centre_of_mass()[2])


ONCE, ALWAYS = slice(30, 31), slice(None)

RECORDING_LIMITS = {
    "scaling-marker-rms": Mutation(misplace_many),
    "scaling-marker-largest": Mutation(misplace_one),
    "ik-marker-rms": Mutation(shake),
    "ik-marker-largest": Mutation(jump),
    "residual-force-peak": Mutation(push(ONCE), frozenset({"residual-force-share"})),
    "residual-force-rms": Mutation(push(ALWAYS), frozenset({"residual-force-share"})),
    "residual-moment-peak": Mutation(twist(ONCE), frozenset({"residual-moment-share"})),
    "residual-moment-rms": Mutation(twist(ALWAYS), frozenset({"residual-moment-share"})),
    "residual-force-share": Mutation(push_share),
    "residual-moment-share": Mutation(twist_share),
}


@cache
def changed_import(name: str) -> SimpleNamespace:
    """The import of a recording that misses the limit of a row."""
    bound = OF_RECORDINGS[name].value
    return import_of(RECORDING_LIMITS[name].change(unchanged_recording(), BEYOND * bound))


# --- the tests ----------------------------------------------------------------------------


def rows_with_mutation() -> tuple[int, int]:
    """How many rows of the registry have a mutation of their limit, and of their goal where they
    have one; and how many rows there are."""
    shown = [
        row
        for row in REGISTRY
        if row.id in LIMITS | RECORDING_LIMITS and (row.goal is None or row.id in GOALS)
    ]
    return len(shown), len(REGISTRY)


def test_every_row_has_a_mutation():
    assert set(LIMITS) == set(OF_WALKS)
    assert set(RECORDING_LIMITS) == set(OF_RECORDINGS)
    found, rows = rows_with_mutation()
    assert found == rows == len(OF_WALKS) + len(OF_RECORDINGS)


def test_the_unchanged_walk_keeps_every_limit_and_reaches_every_goal():
    metrics = unchanged_metrics()
    assert {row["id"] for row in metrics["tolerances"]} == set(OF_WALKS)
    assert failed(metrics) == missed(metrics) == set()
    assert metrics["summary"]["refused"] == 0
    assert metrics["summary"]["goals_reached"] == metrics["summary"]["goals"]


@pytest.mark.parametrize("name", OF_WALKS)
def test_a_walk_that_misses_a_limit_fails_it_and_no_other(name):
    metrics, mutation = changed_metrics(name, "limit"), LIMITS[name]
    assert failed(metrics) == {name} | mutation.drags
    accepted = [row["passed"] for row in metrics["tolerances"] if row["role"] == "acceptance"]
    assert metrics["summary"]["refused"] == accepted.count(False)


@pytest.mark.parametrize("name", [name for name, row in OF_WALKS.items() if row.goal is not None])
@pytest.mark.slow  # that each limit can be missed is tested always
def test_a_walk_that_misses_a_goal_only_still_passes(name):
    metrics = changed_metrics(name, "goal")
    assert missed(metrics) == {name} | GOALS[name].goals
    assert failed(metrics) == GOALS[name].drags
    counted = metrics["summary"]["goals_reached"] < metrics["summary"]["goals"]
    assert counted == any(OF_WALKS[each].role == "acceptance" for each in missed(metrics))


@pytest.fixture
def no_drawings(monkeypatch):
    """Pages without figures and without a PDF, which take seconds and show no verdict."""
    monkeypatch.setattr("gaitval.reporting.page.print_page", lambda *_: None)
    without_figures(monkeypatch)


def message(html: str, title: str) -> list[tuple[bool, str]]:
    """Of every line of a table about a limit: whether it is marked as failed, and its verdict. The
    sheet's list of what failed has no verdicts."""
    title = title.replace(" deg", "°")  # as pages have it
    start = rf'<tr class="(\w*)"><td>(?:<span>)?{re.escape(escape(title))}<'
    lines = re.findall(rf"{start}(.*?)</tr>", html, re.S)
    return [
        (
            mark == "failed",
            *re.findall(r">(?:\d+ of \d+ )?(FAILED|passed|goal reached)</span>", line),
        )
        for mark, line in lines
    ]


def page_of_walk(folder, metrics: dict) -> str:
    (folder / "subject.toml").write_text(SUBJECT.to_toml(), encoding="utf-8")
    write_json(folder / "metrics.json", metrics)
    write_report(folder)
    return both_pages(folder)


@pytest.fixture
def unchanged_page(tmp_path_factory, no_drawings) -> str:
    return page_of_walk(tmp_path_factory.mktemp("unchanged"), unchanged_metrics())


def test_the_page_of_the_unchanged_walk_tells_no_failure(unchanged_page):
    for row in OF_WALKS.values():
        word = "passed" if row.goal is None else "goal reached"
        assert message(unchanged_page, row.title) == [(False, word)] * _lines(row)
    assert "FAILED" not in unchanged_page


@pytest.mark.parametrize("name", OF_WALKS)
@pytest.mark.slow  # the pages of recordings, and its metrics, are tested always
def test_the_page_of_a_walk_tells_the_limit_that_is_missed(name, tmp_path, no_drawings):
    page, drags = page_of_walk(tmp_path, changed_metrics(name, "limit")), LIMITS[name].drags
    for row in OF_WALKS.values():
        marks = [mark for mark, _ in message(page, row.title)]
        assert marks == [row.id in {name} | drags] * _lines(row)
    row = OF_WALKS[name]
    assert message(page, row.title) == [(True, "FAILED")] * _lines(row)
    listed = what_failed(page)
    # what nobody read in full is not on the first page
    read = {each for each in {name} | drags if OF_WALKS[each].status != "unread"}
    more = re.search(r"and (\d+) more", re.sub("<[^>]*>", "", page))
    assert set(listed) <= read
    assert len(listed) + (int(more[1]) if more else 0) == len(read)
    decisive = {each for each in read if OF_WALKS[each].role == "acceptance"}
    assert {each for each, decides in listed.items() if decides} == decisive
    headline = re.search(r'class="headline">.*?</p>', page, re.S)[0]
    assert ("acceptance criteria failed" in headline) == bool(decisive)


def what_failed(page: str) -> dict[str, bool]:
    """Limits in the sheet's list of what failed, and whether the list says that they decide."""
    lines = re.search(r"<tbody>(.*?)</tbody>", page.split("<th>What failed</th>")[1], re.S)[1]
    return {
        name: "decides" in line
        for name, row in OF_WALKS.items()
        for line in re.findall(r"<tr.*?</tr>", lines, re.S)
        if re.search(rf"<td>{re.escape(escape(row.title.replace(' deg', '°')))}[<,]", line)
    }


@pytest.mark.parametrize(
    "name", [name for name, row in OF_WALKS.items() if row.goal is not None][::5]
)
@pytest.mark.slow  # that each limit is shown is tested, and a goal is shown in the same words
def test_the_page_of_a_walk_tells_the_goal_that_is_missed(name, tmp_path, no_drawings):
    page = page_of_walk(tmp_path, changed_metrics(name, "goal"))
    row = OF_WALKS[name]
    assert message(page, row.title) == [(False, "passed")] * _lines(row)


def _lines(row: Tolerance) -> int:
    """Acceptance criteria are stated twice: at the top, and with their sources."""
    return 2 if row.role == "acceptance" else 1


def test_the_unchanged_recording_keeps_every_limit():
    found = verdicts(import_of(unchanged_recording()))
    assert {verdict.id for verdict in found} == set(OF_RECORDINGS)
    assert all(verdict.passed for verdict in found)


@pytest.mark.parametrize("name", OF_RECORDINGS)
def test_a_recording_that_misses_a_limit_fails_it_and_no_other(name):
    found = verdicts(changed_import(name))
    missed = {verdict.id for verdict in found if not verdict.passed}
    assert missed == {name} | RECORDING_LIMITS[name].drags


@pytest.mark.parametrize("name", [None, *OF_RECORDINGS])
def test_the_page_of_a_recording_tells_the_limit_that_is_missed(name, tmp_path, no_drawings):
    found = import_of(unchanged_recording()) if name is None else changed_import(name)
    write_recording_report(tmp_path, sample(gates=limit_rows(found)))
    page = (tmp_path / "recording.html").read_text(encoding="utf-8")
    expected = set() if name is None else {name} | RECORDING_LIMITS[name].drags
    for row in OF_RECORDINGS.values():
        target = "standing" if row.id.startswith("scaling") else "still"
        word = (True, "FAILED") if row.id in expected else (False, "passed")
        if row.id.startswith("residual"):
            # as recorded it is shown, but limits in N and Nm are for motions after reduction
            recorded = (False,) if row.id in AFTER_REDUCTION else word
            assert message(page, f"{row.title} ({target})") == [recorded]
            target = "still, made consistent"
        assert message(page, f"{row.title} ({target})") == [word]
