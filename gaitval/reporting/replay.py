"""The replay of a walk in three dimensions: what the page's script draws, frame by frame.

Everything that moves is computed here, by the functions that simulated and compared the walk; the
script (`replay.js`) only looks frames up. World axes are REP-103: x forward, y left, z up.
"""

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gaitval.arrays import Array, Index, runs
from gaitval.coordinates import COORDINATES, SIDES, Side, split_side
from gaitval.gait.filters import low_pass_simulated
from gaitval.gait.record import RECORDED_ANGLES
from gaitval.metrics.cycles import FootEvents, foot_events, step_of
from gaitval.metrics.results import Method, Metrics
from gaitval.metrics.typed import array
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.parameters import apply_parameters
from gaitval.model.rotations import pelvis_rotation
from gaitval.model.tree import segment_frames
from gaitval.reporting.run_files import RunFiles
from gaitval.reporting.stick_figures import RECORDED_POINTS, pose_strip, stick_figure
from gaitval.walk.reference.motion import ReferenceMotion
from gaitval.walk.simulation.rollout import Rollout

FRAMES: Final = 101
"""Frames of a stride, at 0, 1, … 100 % of the right gait cycle, as the curves on the page have."""
STRIDES: Final = 10
"""Strides shown, the first of those compared: more make the page larger, and are alike."""
ARROW: Final = 0.6
"""m in the picture that a force of one body weight is long; the walker's trunk stays visible."""
LENGTH_UNIT: Final = 1e-4
"""m, of the stored positions: 16 bits reach 3.2 m to every side, rounded by 0.05 mm."""
ROTATION_UNIT: Final = 1.0 / 32767.0
"""Of the stored quaternions; rounding turns a segment by less than 0.01 degrees."""

RECORDED_SEGMENTS: Final = tuple(
    name for name in SEGMENTS if split_side(name)[1] in ("pelvis", "thigh", "shank", "foot")
)
"""Segments whose orientation was recorded."""


@dataclass(frozen=True)
class ShownStrides:
    """The shown part of a rollout: S strides of the right foot, `FRAMES` each.

    Attributes
    ----------
    rows : (S, 101) samples of the rollout, the nearest to each percent of the right gait cycle.
    seconds : (S,) s, duration.
    cycle : (S, 101, 2) %, of the gait cycle of the right and of the left foot.
    stance : (S, 101, 2) %, of the stance of each foot; NaN in swing.
    """

    rows: Index
    seconds: Array
    cycle: Array
    stance: Array


def find_strides(rollout: Rollout, method: Method, *, earlier: int = 0) -> ShownStrides | None:
    """The first strides of `rollout` compared by `method`, and as many `earlier`; None without a
    whole one.
    """
    step = step_of(rollout)
    events: dict[Side, FootEvents] = {
        side: foot_events(
            rollout.ground_reaction[:, column, 2], step=step, threshold=method.event_threshold_n
        )
        for column, side in enumerate(SIDES)
    }
    count = min(STRIDES, method.cycles)
    strikes = events["right"].heel_strikes[max(method.settling_cycles - earlier, 0) :][: count + 1]
    if len(strikes) < 2:
        return None
    starts, lengths = strikes[:-1, None], np.diff(strikes)[:, None]
    rows = np.rint(starts + lengths * np.linspace(0.0, 1.0, FRAMES)).astype(np.int64)
    percent = np.broadcast_to(np.linspace(0.0, 100.0, FRAMES), rows.shape)
    left = _cycle(events["left"].heel_strikes, rows)
    return ShownStrides(
        rows=rows,
        seconds=step * np.diff(strikes),
        cycle=np.stack([percent, left], axis=-1),
        stance=np.stack([_stance(events[side].on_ground, rows) for side in SIDES], axis=-1),
    )


def _cycle(strikes: Index, rows: Index) -> Array:
    """% of a foot's gait cycle at samples of any shape; the first and the last cycle are continued
    beyond the heel strikes that were seen, NaN without two of them.
    """
    if len(strikes) < 2:
        return np.full(rows.shape, np.nan)
    first, last = strikes[1] - strikes[0], strikes[-1] - strikes[-2]
    # one more strike on both sides, a cycle away: strike k is k cycles, linearly in between
    known = np.concatenate([[strikes[0] - first], strikes, [strikes[-1] + last]])
    return np.asarray(100.0 * (np.interp(rows, known, np.arange(len(known))) % 1.0))


def _stance(on_ground: NDArray[np.bool_], rows: Index) -> Array:
    """% of the stance of a foot at samples of any shape; NaN in swing."""
    percent = np.full(len(on_ground), np.nan)
    for begin, end in zip(*runs(on_ground), strict=True):
        percent[begin:end] = np.linspace(0.0, 100.0, end - begin, endpoint=False)
    return np.asarray(percent[rows])


def recorded_motion(metrics: Metrics, reference: ReferenceMotion) -> Array:
    """Positions (101, 31) over a right gait cycle with the recorded angles of `metrics`.

    The path of the pelvis was not recorded. It is that of the `reference`, which follows from the
    recorded forces: without steady travel, and forward and sideways with mean zero. Trunk, arms and
    toes were not recorded either, and are the reference's.
    """
    angles = metrics.record.curves.angles
    percent = np.linspace(0.0, 100.0, FRAMES)
    own = {"r": percent, "l": (percent - 100.0 * metrics.record.left_phase) % 100.0}

    def recorded(name: str, side: str) -> Array:
        return np.asarray(
            np.deg2rad(np.interp(own[side], percent, array(angles[f"{name}_{side}"])))
        )

    positions = np.stack(
        [
            np.interp(percent / 100.0, reference.phase, values, period=1.0)
            for values in reference.positions.T
        ],
        axis=-1,
    )
    for side in own:
        for name in RECORDED_ANGLES:
            positions[:, COORDINATES.index(f"{name}_{side}")] = recorded(name, side)
    # each side's view of the one pelvis: up and forward on its own side are positive
    tilt, up, forward = (
        0.5 * (recorded(name, "r") + sign * recorded(name, "l"))
        for name, sign in (("pelvis_tilt", 1), ("pelvis_list", -1), ("pelvis_rotation", -1))
    )
    rotation = pelvis_rotation(tilt, up, forward)
    positions[:, :3] = Rotation.from_matrix(rotation).as_rotvec()
    place = reference.positions[:, 3:6].copy()
    place[:, 0] -= reference.speed * reference.stride_time * reference.phase
    place[:, :2] -= place[:, :2].mean(axis=0)
    for axis in range(3):
        positions[:, 3 + axis] = np.interp(
            percent / 100.0, reference.phase, place[:, axis], period=1.0
        )
    return positions


@dataclass(frozen=True)
class ShownWalk:
    """A walk as it is shown: on the spot, over S strides of `FRAMES` frames.

    Attributes
    ----------
    body : the body that was simulated. recorded_body : before mu, of the motion beside it.
    strides : which samples are shown.
    travel : (S, 101, 2) m, forward and to the left, that the ground moves backwards and to the
        right: steady within a stride, from one right heel strike to the next.
    positions : (S, 101, 31) of the rollout, without the travel.
    recorded : (101, 31), about the middle of the simulated pelvis' path. known : what of it is.
    force : (S, 101, 2, 3) body weights, of the ground on the right and the left foot, filtered as
        the curves on the page are; zero in swing.
    pressure : (S, 101, 2, 2) m, its centre, without the travel; NaN in swing.
    push : (S, 101, 3) body weights, of a push on the pelvis.
    """

    body: BodyModel
    recorded_body: BodyModel
    strides: ShownStrides
    travel: Array
    positions: Array
    recorded: Array
    force: Array
    pressure: Array
    push: Array
    known: tuple[str, ...] = RECORDED_SEGMENTS


def shown_walk(
    model: BodyModel, rollout: Rollout, method: Method, recorded: Array
) -> ShownWalk | None:
    """The part of `rollout` that is shown, by a `method` of finding strides, with the motion
    `recorded` (101, 31) beside it; None without a whole stride. `model` is the body before mu.
    """
    # a push comes in the first stride after those that settle, and what it changes is seen beside
    # the stride before
    strides = find_strides(rollout, method, earlier=2 if rollout.root_force.any() else 0)
    if strides is None:
        return None
    positions = rollout.positions[strides.rows]
    start = positions[:, :1, 3:5]
    travel = start + (positions[:, -1:, 3:5] - start) * np.linspace(0.0, 1.0, FRAMES)[:, None]
    positions[..., 3:5] -= travel
    recorded = recorded.copy()
    # without the last frame, which repeats the first of the next stride
    recorded[:, 3:5] += positions[:, :-1, 3:5].mean(axis=(0, 1))
    low_pass = method.record_low_pass
    frequency = method.filter_frequency_hz if low_pass is None else low_pass.forces_hz
    force = low_pass_simulated(rollout.ground_reaction, step=step_of(rollout), frequency=frequency)[
        strides.rows
    ]
    swing = np.isnan(strides.stance)
    pressure = rollout.centre_of_pressure[strides.rows][..., :2] - travel[:, :, None]
    return ShownWalk(
        body=apply_parameters(model, rollout.mu),
        recorded_body=model,
        strides=strides,
        travel=travel,
        positions=positions,
        recorded=recorded,
        force=np.where(swing[..., None], 0.0, force / method.body_weight_n),
        pressure=np.where(swing[..., None], np.nan, pressure),
        push=rollout.root_force[strides.rows][..., 3:] / method.body_weight_n,
    )


def _packed(values: Array, kind: str, unit: float = 1.0) -> dict[str, object]:
    """An array for the page: little-endian numbers in base64, in multiples of `unit`."""
    numbers = np.rint(values / unit) if kind == "int16" else values
    if kind == "int16" and np.abs(numbers).max() > np.iinfo(np.int16).max:
        raise ValueError(f"{np.abs(values).max():g} is beyond 16 bits of {unit:g}")
    data = np.ascontiguousarray(numbers, dtype=np.dtype(kind).newbyteorder("<")).tobytes()
    text = base64.b64encode(data).decode("ascii")
    return {"type": kind, "unit": unit, "shape": list(values.shape), "data": text}


def _poses(model: BodyModel, positions: Array, segments: tuple[str, ...]) -> dict[str, object]:
    """Origin and quaternion (x, y, z, w) of segments, of positions (…, 31)."""
    frames = segment_frames(model, positions.reshape(-1, positions.shape[-1]))
    frames = frames[:, [SEGMENTS.index(name) for name in segments]]
    rotation = Rotation.from_matrix(frames[..., :3, :3].reshape(-1, 3, 3))
    shape = (*positions.shape[:-1], len(segments))
    # q and -q are the same rotation: canonical, so that equal poses give equal bytes
    quaternion = rotation.as_quat(canonical=True).reshape(*shape, 4)
    return {
        "segments": list(segments),
        "origin": _packed(frames[..., :3, 3].reshape(*shape, 3), "int16", LENGTH_UNIT),
        "quaternion": _packed(quaternion, "int16", ROTATION_UNIT),
    }


def body_of(model: BodyModel) -> dict[str, object]:
    """What `replay_body.js` draws of `model`: mass, joints in the segment before, contact spheres;
    on a slope also the rotation (quaternion, x y z w) from the ground's axes to those of a room
    whose z is up.
    """
    spheres = [
        {"segment": sphere.segment, "position": sphere.position.tolist(), "radius": sphere.radius}
        for sphere in model.spheres
    ]
    joints = {each.name: each.joint_position.tolist() for each in model.segments}
    found: dict[str, object] = {"mass": model.mass, "joints": joints, "spheres": spheres}
    if not model.ground.level:
        found["room"] = Rotation.from_matrix(model.ground.from_level.T).as_quat().tolist()
    return found


def _body(model: BodyModel, positions: Array) -> dict[str, object]:
    """What is drawn of `model`, and its poses."""
    return body_of(model) | _poses(model, positions, SEGMENTS)


_NUMBERS: Final = ("travel", "force", "pressure", "push", "cycle", "stance")


def _push_of(walk: ShownWalk) -> dict[str, float]:
    """Force in body weights, and degrees from straight ahead to the left, of the push on `walk`."""
    across = walk.push[..., :2].reshape(-1, 2)
    ahead, left = across[np.argmax(np.linalg.norm(across, axis=1))].tolist()
    degrees = round(math.degrees(math.atan2(left, ahead)))
    return {"force": math.hypot(ahead, left), "degrees": degrees}


def scene(walk: ShownWalk, pushed: Sequence[ShownWalk] = ()) -> dict[str, object]:
    """What `replay.js` reads of `walk` and of the walks that were `pushed`, as JSON values: poses,
    forces and the place in the cycle. `replay_body.js` draws the body from its joints.

    Poses are those of the positions of `walk` in `gaitval.model.tree`; arrays are as in
    `ShownStrides` and `ShownWalk`, with the strides of the pushed walks behind those of the walk.
    """
    walks = [walk, *pushed]
    ends = np.cumsum([len(each.strides.seconds) for each in walks]).tolist()

    def joined(name: str) -> Array:
        """Of the walks or of their strides."""
        owners = [each if hasattr(each, name) else each.strides for each in walks]
        return np.concatenate([getattr(each, name) for each in owners])

    return {
        "frames": FRAMES,
        "seconds": joined("seconds").tolist(),
        "walked": ends[0],
        "pushes": [
            {"first": first, "end": end, **_push_of(each)}
            for first, end, each in zip(ends, ends[1:], pushed, strict=False)
        ],
        "arrow": ARROW,
        "body": _body(walk.body, joined("positions")),
        "recorded": {"known": walk.known, **_body(walk.recorded_body, walk.recorded)},
        **{name: _packed(joined(name), "float32") for name in _NUMBERS},
    }


STRIP: Final = (0, 20, 40, 60, 80, 100)
"""% of the right gait cycle of the six poses that stand for the replay on paper."""

SCRIPTS: Final = ("vendor/three.min.js", "replay_body.js", "replay.js")
"""Scripts of the page, in the order in which they run."""


class Picture(NamedTuple):
    """The strip of poses as SVG, and what `replay.js` reads; None without a whole stride."""

    strip: str
    scene: dict[str, object] | None


def walk_pictures(run: RunFiles) -> Picture | None:
    """The walk of a `run` in pictures; None without a model or a reference motion. Without a whole
    simulated stride there is no replay, and the strip shows the record alone.
    """
    if (model := run.walk.found) is None or run.walk.reference is None:
        return None
    method = run.metrics.method
    recorded = recorded_motion(run.metrics, run.walk.reference)
    rollout = run.walk.rollout
    walk = None if rollout is None else shown_walk(model, rollout, method, recorded)
    pushed = (shown_walk(model, each, method, recorded) for each in run.walk.pushed)
    poses = list(STRIP)
    legs = stick_figure(model, (recorded if walk is None else walk.recorded)[poses])
    # the record knows nothing of trunk, arms and toes
    sticks: dict[str, dict[str, Array]] = {
        "record": {side: legs[side][:, :RECORDED_POINTS] for side in SIDES}
    }
    if walk is not None:
        sticks["simulation"] = stick_figure(walk.body, walk.positions[0, poses])
    return Picture(
        pose_strip(sticks, np.array(STRIP)),
        None if walk is None else scene(walk, [w for w in pushed if w]),
    )
