"""Every limit of a recording can be missed: something is done to a recording that keeps all limits,
of a made-up person who stands still on two plates, and the verdict on it turns to failed. What is
changed is what the laboratory gives, and everything after it is worked out as for any other. Limits
of walks: `tests/metrics/test_tolerances.py`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from standing_person import StandingPerson, standing_person

from gaitval.constants import GRAVITY
from gaitval.kinetics.inverse.inverse_dynamics import inverse_dynamics
from gaitval.kinetics.inverse.inverse_kinematics import inverse_kinematics
from gaitval.kinetics.inverse.marked_body import marker_positions
from gaitval.kinetics.inverse.marker_placement import place_markers
from gaitval.metrics.tolerances import RECORDING_UNITS, load_registry
from gaitval.model.body import SEGMENTS
from gaitval.model.markers import ModelMarker
from gaitval.model.tree import segment_frames
from gaitval.scaling.marker_sets import load_marker_set
from gaitval.session.importing.summary import verdicts

OF_RECORDINGS = {row.id: row for row in load_registry().tolerance if row.measure in RECORDING_UNITS}
BEYOND = 1.15
"""How far beyond its bound a changed value is aimed."""


class Mutation(NamedTuple):
    """What is done to miss a limit, and the ids of those that it fails besides."""

    change: "Callable[[Recorded, float], Recorded]"
    drags: frozenset[str] = frozenset()


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


def test_the_unchanged_recording_keeps_every_limit():
    found = verdicts(import_of(unchanged_recording()))
    assert {verdict.id for verdict in found} == set(OF_RECORDINGS) == set(RECORDING_LIMITS)
    assert all(verdict.passed for verdict in found)


@pytest.mark.parametrize("name", OF_RECORDINGS)
def test_a_recording_that_misses_a_limit_fails_it_and_no_other(name):
    found = verdicts(changed_import(name))
    missed = {verdict.id for verdict in found if not verdict.passed}
    assert missed == {name} | RECORDING_LIMITS[name].drags
