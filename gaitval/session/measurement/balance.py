"""What forces and markers of a session say of each other: the data of the estimate of its faults.

Newton's law over the whole body (six equations a frame), and the centre of pressure in the foot
that stands (two a frame), each averaged over the strides in bins of the phase. Beside every datum
stands what each possible fault of the session would do to it, by analytic derivatives: every fault
changes the wrench of a plate, or the path of the body, linearly where it is small.

Forces are over the body's weight (1), moments over the weight (m); lengths are in m. Axes: the
project's (REP-103, z up), the person walks along +x.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.ndimage import binary_erosion

from gaitval.arrays import Array, Flags, Index, runs
from gaitval.constants import STANDARD_GRAVITY
from gaitval.coordinates import SIDES
from gaitval.gait.filters import low_pass, octave
from gaitval.gait.sampling import bridged
from gaitval.kinetics.inverse.inverse_dynamics import InverseDynamics
from gaitval.mocap.recording import FootForces, Plate, Recording
from gaitval.model.body import SEGMENTS, BodyModel
from gaitval.model.tree import segment_frames
from gaitval.session.measurement.expected import LEGS
from gaitval.session.measurement.standing import StandingForces
from gaitval.session.trial import WalkingTrial

STRIDE_BINS: Final = 20
STANCE_BINS: Final = np.linspace(0.1, 0.9, 9)
"""Edges, shares of the stance: at its ends small forces make the centre of pressure uncertain."""
EDGE_SECONDS: Final = 0.1
"""s at the edges of what is known that are not used, as in `gait.agreement`."""
MOMENT_CUTOFF_HZ: Final = 8.0
"""Hz, of the wrenches of the plates; as `ProcessingSettings.moment_force_cutoff_hz`."""
SLOW_FORCES_HZ: Final = 5.0
SLOW_MARKERS_HZ: Final = 3.0
"""Hz, low-passes of the files themselves that would be a fault of size one."""
STEPPED_ON: Final = 0.05
"""Body weights, in the mean over a bin, of a plate that somebody walks on."""
LOADED_N: Final = 20.0
LONGEST_STRIDE: Final = 3.5
SHORTEST_STANCE: Final = 0.3
"""N, s and s: what counts as loaded, and as a stride and a stance of one."""
NEWTON: Final[tuple[str, ...]] = (
    "force x",
    "force y",
    "force z",
    "moment x",
    "moment y",
    "moment z",
)
PRESSURE: Final[tuple[str, ...]] = ("pressure along", "pressure across")
FALL: Final[tuple[str, ...]] = ("fall of force", "fall of markers")
"""Octaves by which the rate of the forces falls from 5 and 6 Hz to 10 and 12, and that of the
markers from 4 and 5 Hz to 8 and 10."""

LENGTH: Final = "length of the legs"
DRIFT: Final = "drift of the forces"
"""Share by which the forces come later from stride to stride: what is the same in all strides does
not show it."""
DRIFT_ALIKE: Final = 2.0
"""Times the scatter of single bins that a drift has: neighbouring bins of a stride differ alike."""
OWN_DRIFT: Final = 0.0005
"""Drift, SD, of a walk that slowly changes: .0001 and .0002 in two sound treadmill walks."""


@dataclass(frozen=True)
class Data:
    """N data of a session, and what F faults of size one do to them.

    Attributes
    ----------
    names : (F,) of the faults.
    kind : (N,) of `NEWTON`, `PRESSURE`, `FALL`, `standing.KINDS`, `LENGTH` or `DRIFT`.
    group : (N,) the foot and plate of a pressure, "" of Newton's law.
    phase : (N,) of the stride or of the stance, 0 to 1.
    value : (N,) what was seen.
    noise : (N,) standard error of its mean over strides.
    effect : (N, F) derivative of the value by each fault.
    middles : (3,) m of each plate.
    """

    names: tuple[str, ...]
    kind: tuple[str, ...]
    group: tuple[str, ...]
    phase: Array
    value: Array
    noise: Array
    effect: Array
    middles: Mapping[str, Array]


@dataclass(frozen=True)
class PlateTrial:
    """A walk as the data are made of it, whatever the delay of its forces.

    Attributes
    ----------
    ground, needed : wrenches (`ground_of`, `_needed`).
    ankles : (T, 2, 4, 4) frames of the feet, right first.
    middles : (3,) m of each plate.
    falls : of the rates of forces and markers.
    """

    walk: WalkingTrial
    ground: "GroundWrenches"
    needed: Array
    ankles: Array
    middles: tuple[Array, ...]
    falls: tuple["_Row", ...]


def trials_of(model: BodyModel, walks: Sequence[WalkingTrial]) -> tuple[PlateTrial, ...]:
    """Those of the `walks` of the `model` that have forces."""
    found = []
    for walk in walks:
        if walk.dynamics is None or walk.loads is None:
            continue
        ground = ground_of(walk.loads, walk.recording)
        frames = segment_frames(model, walk.positions)
        plates = walk.recording.plates
        found.append(
            PlateTrial(
                walk=walk,
                ground=ground,
                needed=_needed(ground, walk.dynamics, walk.positions[:, 3:6]),
                ankles=frames[:, [SEGMENTS.index("foot_r"), SEGMENTS.index("foot_l")]],
                middles=tuple(
                    plate_middle(plate, wrench)
                    for plate, wrench in zip(plates, ground.plates, strict=True)
                ),
                falls=tuple(_falls(walk.recording)),
            )
        )
    return tuple(found)


def data_of(
    trials: Sequence[PlateTrial],
    mass_kg: float,
    *,
    later: float = 0.0,
    stood: StandingForces | None = None,
    legs: float | None = None,
) -> Data | None:
    """The data of all `trials` of a person of `mass_kg`, of the forces when the person `stood`, and
    of the length of the `legs` over that expected of the stature; None if no frame shows the forces
    of both feet. Those of the trials are taken to come `later` (s) than they should.
    """
    parts = [part for trial in trials if (part := _of_trial(trial, mass_kg, later))]
    if not parts:
        return None
    names = sorted({name for part in parts for row in part for name in row.names})
    column = {name: i for i, name in enumerate(names)}
    pooled: dict[tuple[str, str, int], list[_Row]] = {}
    for part in parts:
        for row in part:
            pooled.setdefault((row.kind, row.group, row.bin), []).append(row)
    rows = []
    for key in sorted(pooled):
        of_bin = pooled[key]
        values = np.array([row.value for row in of_bin])
        effects = np.zeros(len(names))
        for row in of_bin:
            effects[[column[name] for name in row.names]] += row.effects
        rows.append((key, of_bin[0].phase, values, effects / len(of_bin)))
    # A bin of one stride has the scatter of all bins of its kind.
    usual = {
        kind: float(np.median(scatter))
        if (
            scatter := [
                values.std(ddof=1)
                for (k, *_), _, values, _ in rows
                if k == kind and len(values) > 2
            ]
        )
        else USUAL_SCATTER[kind]
        for kind in (*NEWTON, *PRESSURE, *FALL)
    }
    still = []
    if stood is not None:
        most = dict(zip(names, np.abs([of for *_, of in rows]).max(axis=0), strict=True))
        walked = [name for name in stood.force if most.get(f"gain {name}", 0.0) > STEPPED_ON]
        still = stood.rows(mass_kg * STANDARD_GRAVITY, names, walked)
    if legs is not None:
        expected, spread = LEGS
        of_legs = {"stature": -1.0, "scale": 1.0}
        effect = np.array([of_legs.get(name, 0.0) for name in names])
        still = [*still, (LENGTH, legs - expected, spread, effect)]
    drift = _drift(pooled, usual)
    if drift is not None:
        still = [*still, (DRIFT, *drift, np.array([float(name == "clock") for name in names]))]
    noises = [usual[key[0]] / np.sqrt(len(values)) for key, _, values, _ in rows]
    return Data(
        names=tuple(names),
        kind=(*(key[0] for key, *_ in rows), *(kind for kind, *_ in still)),
        group=(*(key[1] for key, *_ in rows), *("" for _ in still)),
        phase=np.array([*(phase for _, phase, _, _ in rows), *(0.0 for _ in still)]),
        value=np.array([*(values.mean() for _, _, values, _ in rows), *(v for _, v, *_ in still)]),
        noise=np.array([*noises, *(noise for _, _, noise, _ in still)]),
        effect=np.array([effect for *_, effect in (*rows, *still)]),
        middles={
            plate.name: middle
            for trial in trials
            for plate, middle in zip(trial.walk.recording.plates, trial.middles, strict=True)
        },
    )


def _drift(
    pooled: "Mapping[tuple[str, str, int], Sequence[_Row]]", usual: Mapping[str, float]
) -> tuple[float, float] | None:
    """By how much of the time that has passed the forces come later, and the standard error of
    that; None where no bin is in two strides.
    """
    square = towards = 0.0
    for (kind, *_), rows in pooled.items():
        if kind in FALL or len(rows) < 2:
            continue
        value = np.array([row.value for row in rows])
        later = np.array([row.effects[row.names.index("clock")] for row in rows])
        later = (later - later.mean()) / usual[kind]
        square += float(later @ later)
        towards += float(later @ (value - value.mean())) / usual[kind]
    if not square:
        return None
    return towards / square, float(np.hypot(DRIFT_ALIKE / np.sqrt(square), OWN_DRIFT))


USUAL_SCATTER: Final = dict(
    zip(
        (*NEWTON, *PRESSURE, *FALL),
        (0.007, 0.007, 0.012, 0.004, 0.005, 0.002, 0.005, 0.003, 0.2, 0.2),
        strict=True,
    )
)
"""Scatter from stride to stride, in units of the data, where a session has one stride only: half of
that of WBDS01 T01, because the spread of people in `expected` is that of single strides."""


@dataclass(frozen=True)
class _Row:
    """The mean of one bin in one stride."""

    kind: str
    group: str
    bin: int
    phase: float
    value: float
    names: tuple[str, ...]
    effects: Array


@dataclass(frozen=True)
class GroundWrenches:
    """Wrenches at the marker frames, of the ground on each foot and on each plate: force N and
    moment Nm about the origin.

    Attributes
    ----------
    feet : (T, 2, 6) right foot first.
    on : (T, 2) whether the foot is loaded.
    valid : (T, 2) of `FootForces`.
    plates : (P, T, 6).
    height : m, of the surface.
    rate : Hz.
    """

    feet: Array
    on: Flags
    valid: Flags
    plates: Array
    height: float
    rate: float

    def earlier(self, seconds: float) -> "GroundWrenches":
        """As if the forces had come this much earlier."""
        at = np.clip(np.arange(len(self.on)) + seconds * self.rate, 0, len(self.on) - 1)
        low = np.floor(at).astype(int)
        high = np.minimum(low + 1, len(self.on) - 1)
        share = at - low
        nearest = np.rint(at).astype(int)
        feet = (1 - share)[:, None, None] * self.feet[low] + share[:, None, None] * self.feet[high]
        plates = (1 - share)[:, None] * self.plates[:, low] + share[:, None] * self.plates[:, high]
        return replace(
            self, feet=feet, plates=plates, on=self.on[nearest], valid=self.valid[nearest]
        )

    @property
    def since(self) -> Array:
        """(T,) s since the middle of the trial: a clock that drifts is right there, because forces
        that are late all through are another fault.
        """
        frames = np.arange(len(self.on))
        return np.asarray((frames - frames.mean()) / self.rate)

    @property
    def point(self) -> Array:
        """(T, 2, 2) m, centres of pressure; NaN where a foot is in the air."""
        force, moment = self.feet[..., :3], self.feet[..., 3:]
        vertical = np.where(self.on & (force[..., 2] > 0.0), force[..., 2], np.nan)
        return np.stack(
            [
                (self.height * force[..., 0] - moment[..., 1]) / vertical,
                (self.height * force[..., 1] + moment[..., 0]) / vertical,
            ],
            axis=-1,
        )


def ground_of(loads: FootForces, recording: Recording) -> GroundWrenches:
    """What the ground does, of the `loads` on the feet and the plates of a `recording`."""
    point = np.nan_to_num(loads.centre_of_pressure)
    moment = np.cross(point, loads.force) + loads.free_moment
    on = np.isfinite(loads.centre_of_pressure[..., 0])
    known = loads.centre_of_pressure[..., 2][on]
    return GroundWrenches(
        feet=np.where(on[..., None], np.concatenate([loads.force, moment], axis=2), 0.0),
        on=on,
        valid=np.asarray(loads.valid),
        plates=np.stack(
            [_wrench(plate, recording, loads.rate, len(loads.force)) for plate in recording.plates]
        ),
        height=float(np.median(known)) if len(known) else 0.0,
        rate=loads.rate,
    )


def _wrench(plate: Plate, recording: Recording, rate: float, frames: int) -> Array:
    """(T, 6) force N and moment Nm about the origin of a plate, at the marker frames."""
    slow = low_pass(
        np.hstack([plate.force, moment_of(plate)]),
        rate=recording.force_rate,
        cutoff_hz=MOMENT_CUTOFF_HZ,
    )
    at = np.arange(frames) / rate * recording.force_rate
    samples = np.arange(len(slow))
    return np.column_stack([np.interp(at, samples, slow[:, i]) for i in range(6)])


def moment_of(plate: Plate) -> Array:
    """(T, 3) Nm about the origin; of a file with centres of pressure, from these."""
    if plate.moment is not None:
        return plate.moment
    known = np.asarray(np.isfinite(plate.centre_of_pressure).all(axis=1))
    point = bridged(plate.centre_of_pressure, known) if known.any() else 0.0 * plate.force
    return np.asarray(np.cross(point, plate.force) + plate.free_moment)


def _of_trial(trial: PlateTrial, mass_kg: float, later: float) -> list[_Row]:
    ground = trial.ground.earlier(later) if later else trial.ground
    known = binary_erosion(
        np.asarray(ground.valid.all(axis=1)),
        iterations=round(EDGE_SECONDS * ground.rate),
        border_value=0,
    )
    strides = _strides(trial.walk, later)
    weight = mass_kg * STANDARD_GRAVITY
    rows: list[_Row] = []
    if known.any() and strides is not None:
        rows += _newton_rows(trial, ground, weight, known, *strides)
    return [*rows, *_pressures(trial, ground, weight), *trial.falls]


def _newton_rows(
    trial: PlateTrial,
    ground: GroundWrenches,
    weight: float,
    known: Flags,
    phase: Array,
    number: Index,
) -> list[_Row]:
    """Newton's law, a row for each component and each bin of each stride."""
    assert trial.walk.dynamics is not None
    value, effects = newton(
        ground, trial.walk.dynamics.centre_of_mass, trial.needed, trial.walk.recording,
        trial.middles, weight,
    )  # fmt: skip
    names = tuple(effects)
    # (frames, values and effects, components), in the order of the bins
    stacked = np.stack([value, *effects.values()], axis=1)[known]
    which = np.floor(phase[known] * STRIDE_BINS).astype(int)
    place = number[known] * STRIDE_BINS + which
    order = np.argsort(place, kind="stable")
    bins, first, counts = np.unique(place[order], return_index=True, return_counts=True)
    means = np.add.reduceat(stacked[order], first, axis=0) / counts[:, None, None]
    rows = []
    for at, count, mean in zip(bins % STRIDE_BINS, counts, means, strict=True):
        if count < 2:
            continue
        b = int(at)
        rows += [
            _Row(
                kind, "", b, (b + 0.5) / STRIDE_BINS, float(mean[0, i]), names, mean[1:, i]
            )
            for i, kind in enumerate(NEWTON)
        ]  # fmt: skip
    return rows


def _needed(ground: GroundWrenches, dynamics: InverseDynamics, pelvis: Array) -> Array:
    """(T, 6) N and Nm about the centre of mass that the motion needs of the ground."""
    centre = dynamics.centre_of_mass
    total = ground.feet.sum(axis=1)
    force = total[:, :3] + dynamics.residual_force
    about = total[:, 3:] - np.cross(centre, total[:, :3])
    left = dynamics.residual_moment + np.cross(pelvis - centre, dynamics.residual_force)
    return np.hstack([force, about + left])


def newton(
    ground: GroundWrenches,
    centre: Array,
    needed: Array,
    recording: Recording,
    middles: Sequence[Array],
    weight: float,
) -> tuple[Array, dict[str, Array]]:
    """(T, 6) force and moment about the `centre` of mass that the ground gives too much, over the
    `weight`, and what each fault adds to them.
    """
    total = ground.feet.sum(axis=1)
    measured, about_origin = total[:, :3], total[:, 3:]
    turning = about_origin - np.cross(centre, measured)
    need_force, need_turn = needed[:, :3], needed[:, 3:]
    inertial = need_force - np.array([0.0, 0.0, weight])
    none = np.zeros_like(measured)

    def about(force: Array, moment: Array) -> Array:
        return np.hstack([force, moment - np.cross(centre, force)])

    # Strides and stances are those of the forces, so in a bin it is the body that has moved on.
    step = 1.0 / ground.rate
    later = -np.gradient(needed, step, axis=0)
    later[:, 3:] -= np.cross(np.gradient(centre, step, axis=0), measured)
    blurred = low_pass(total, rate=ground.rate, cutoff_hz=SLOW_FORCES_HZ) - total
    moved = np.hstack([inertial, need_turn])
    effects: dict[str, Array] = {
        "delay": later,
        "blur of forces": about(blurred[:, :3], blurred[:, 3:]),
        "blur of markers": moved - low_pass(moved, rate=ground.rate, cutoff_hz=SLOW_MARKERS_HZ),
        "clock": later * ground.since[:, None],
        "mass": np.hstack([-need_force, -need_turn]),
        "scale": np.hstack([-inertial, -np.cross(centre, measured) - 2 * need_turn]),
        "rate": np.hstack([-2 * inertial, -2 * need_turn]),
        "tilt forward": np.hstack([none + weight * np.array([1.0, 0, 0]), none]),
        "tilt left": np.hstack([none + weight * np.array([0, 1.0, 0]), none]),
    }
    # Of cameras that lean aside where the plates do not, the body leans over its feet. Forward it
    # may do so by 12 mm, which masses and hips leave; there the floor under the feet shows it.
    leant = centre[:, 2:] * np.array([0.0, 1.0, 0.0])
    effects["camera tilt left"] = np.hstack([none, -np.cross(leant, measured)])
    for axis, name in enumerate("xyz"):
        only = np.arange(3) == axis
        effects[f"acceleration {name}"] = np.hstack([-inertial * only, none])
        effects[f"turning {name}"] = np.hstack([none, -need_turn * only])
        effects[f"centre of mass {name}"] = np.hstack([none, -np.cross(1.0 * only, measured)])
    for plate, wrench, middle in zip(recording.plates, ground.plates, middles, strict=True):
        for name, (df, dm) in _plate_effects(wrench, middle, weight).items():
            effects[f"{name} {plate.name}"] = about(df, dm)
        late = -np.gradient(wrench, step, axis=0)
        effects[f"plate delay {plate.name}"] = about(late[:, :3], late[:, 3:])
    found = np.hstack([measured - need_force, turning - need_turn])
    return found / weight, {name: effect / weight for name, effect in effects.items()}


def _plate_effects(wrench: Array, middle: Array, weight: float) -> dict[str, tuple[Array, Array]]:
    """What each fault of a plate adds to its force and moment about the origin."""
    f, m = wrench[:, :3], wrench[:, 3:]
    x, y, up = np.eye(3)
    turned = np.cross(up, f)
    along, across = f[:, 2:] * x, f[:, 2:] * y
    on = (f[:, 2:] > LOADED_N) * weight
    level = (m - np.cross(middle, f)) * (x + y)
    safe = np.where(on > 0.0, f[:, 2:], np.inf)
    free = m[:, 2:] + (m[:, :1] * f[:, :1] + m[:, 1:2] * f[:, 1:2]) / safe
    return {
        "place x": (0 * f, np.cross(x, f)),
        "place y": (0 * f, np.cross(y, f)),
        "rotation": (turned, np.cross(middle, turned) + np.cross(up, m - np.cross(middle, f))),
        "gain": (f, m),
        "fore-aft gain": (f * x, np.cross(middle, f * x)),
        "cross-talk x": (along, np.cross(middle, along)),
        "cross-talk y": (across, np.cross(middle, across)),
        "offset x": (on * x, np.cross(middle, on * x)),
        "offset y": (on * y, np.cross(middle, on * y)),
        "offset z": (on * up, np.cross(middle, on * up)),
        "vertical gain": (f * up, np.cross(middle, f * up)),
        "moment gain": (0 * f, level),
        "mirrored moment": (0 * f, 2.0 * level * x),
        "free moment sign": (0 * f, 2.0 * free * up),
        "fore-aft sign": (2.0 * f * x, 2.0 * np.cross(middle, f * x)),
        "sideways sign": (2.0 * f * y, 2.0 * np.cross(middle, f * y)),
    }


def plate_middle(plate: Plate, wrench: Array) -> Array:
    """(3,) m, about which a plate is turned: its middle, or where its corners are not known the
    mean place of its force.
    """
    if np.isfinite(plate.corners).all():
        return np.asarray(plate.corners.mean(axis=0))
    f, m = wrench[:, :3], wrench[:, 3:]
    total = max(float(f[:, 2].sum()), 1.0)
    return np.array([-m[:, 1].sum() / total, m[:, 0].sum() / total, 0.0])


def _strides(walk: WalkingTrial, later: float) -> tuple[Array, Index] | None:
    """Phase of each frame in the right foot's stride, and the number of the stride."""
    time = walk.recording.time
    right, left = (
        np.sort([e.time for e in walk.events if (e.side, e.kind) == (side, "heel_strike")]) - later
        for side in SIDES
    )
    usual = [b - a for each in (right, left) for a, b in pairwise(each) if b - a < LONGEST_STRIDE]
    if usual:
        stride = float(np.median(usual))
    elif len(right) and len(left):
        stride = 2.0 * float(np.abs(right[:, None] - left).min())
    else:
        return None
    # Where a foot's strike is not seen, the other's is half a stride away.
    anchors = right if len(right) else left + 0.5 * stride
    before = np.searchsorted(anchors, time, side="right") - 1
    known = np.clip(before, 0, len(anchors) - 1)
    lengths = np.append(np.diff(anchors), stride)
    lengths[np.abs(lengths / stride - 1.0) > 0.3] = stride
    count = (time - anchors[known]) / lengths[known]
    return np.asarray(count % 1.0), before + np.floor(np.maximum(count, 0.0)).astype(int)


def _pressures(trial: PlateTrial, ground: GroundWrenches, weight: float) -> list[_Row]:
    """Centre of pressure in the axes of the standing foot, from its ankle, by shares of stance; an
    offset is one of a share of the body's `weight`, N.
    """
    plates = trial.walk.recording.plates
    points = ground.point
    rows: list[_Row] = []
    for column, side in enumerate(SIDES):
        ankle = trial.ankles[:, column]
        along = ankle[:, :2, 0] / np.linalg.norm(ankle[:, :2, 0], axis=1)[:, None]
        # across is towards the middle line of the body
        inwards = 1.0 if side == "right" else -1.0
        across = inwards * np.stack([-along[:, 1], along[:, 0]], axis=1)
        axes = np.stack([along, across], axis=1)
        point = points[:, column]
        later = -np.gradient(ankle[:, :2, 3], 1.0 / ground.rate, axis=0)
        for begin, end in zip(*runs(np.isfinite(point[:, 0])), strict=True):
            whole = begin > 0 and end < len(point) and ground.valid[begin:end, column].mean() > 0.9
            if not whole or end - begin < SHORTEST_STANCE * ground.rate:
                continue
            share = (np.arange(begin, end) - begin) / (end - begin)
            whose = _plate_under(ground, column, begin, end)
            for b, (low, high) in enumerate(pairwise(STANCE_BINS)):
                inside = np.flatnonzero((share >= low) & (share < high)) + begin
                under = set(whose[inside - begin])
                if len(under) != 1 or -1 in under:
                    continue
                plate = plates[number := under.pop()]
                seen = point[inside] - ankle[inside, :2, 3]
                lever = point[inside] - trial.middles[number][:2]
                one, none = np.ones(len(inside)), np.zeros(len(inside))
                carried = np.maximum(ground.feet[inside, column, 2], LOADED_N)
                ahead, inwards_ = axes[inside][:, 0], axes[inside][:, 1]
                since = ground.since[inside, None]
                changes = {
                    "delay": later[inside],
                    "clock": later[inside] * since,
                    "stature": -seen,
                    f"foot along {side}": -ahead,
                    f"foot across {side}": -inwards_,
                    f"foot turned {side}": np.stack([-seen[:, 1], seen[:, 0]], axis=1),
                    f"vertical gain {plate.name}": -lever,
                    f"moment gain {plate.name}": lever,
                    f"offset z {plate.name}": -lever * (weight / carried)[:, None],
                    f"plate delay {plate.name}": later[inside],
                    "scale": -ankle[inside, :2, 3],
                    f"place x {plate.name}": np.stack([one, none], axis=1),
                    f"place y {plate.name}": np.stack([none, one], axis=1),
                    f"rotation {plate.name}": np.stack([-lever[:, 1], lever[:, 0]], axis=1),
                    f"mirrored moment {plate.name}": np.stack([none, 2.0 * lever[:, 1]], axis=1),
                }
                value, *of = (
                    np.einsum("tij,tj->ti", axes[inside], each).mean(axis=0)
                    for each in (seen, *changes.values())
                )
                rows += [
                    _Row(
                        kind, f"{side} {plate.name}", b, 0.5 * (low + high), float(value[i]),
                        tuple(changes), np.array([each[i] for each in of]),
                    )
                    for i, kind in enumerate(PRESSURE)
                ]  # fmt: skip
    return rows


def _plate_under(ground: GroundWrenches, column: int, begin: int, end: int) -> Index:
    """(n,) number of the plate that alone carries a foot's force; -1 where none does."""
    vertical = ground.feet[begin:end, column, 2]
    off = np.abs(ground.plates[:, begin:end, 2] - vertical)
    best = np.argmin(off, axis=0)
    alone: Flags = off[best, np.arange(len(best))] < 0.15 * np.abs(vertical) + LOADED_N
    return np.where(alone, best, -1)


def _falls(recording: Recording) -> list[_Row]:
    """How the rates of forces and markers fall with the frequency."""
    vertical = np.stack([plate.force[:, 2] for plate in recording.plates], axis=1)
    seen = np.isfinite(recording.markers).all(axis=(0, 2))
    rows = []
    for kind, values, rate, low in (
        (FALL[0], vertical, recording.force_rate, (5.0, 6.0)),
        (FALL[1], recording.markers[:, seen, 2], recording.marker_rate, (4.0, 5.0)),
    ):
        if values.shape[1] and len(values) > 0.5 * rate and rate > 50.0:
            fall = float(np.mean([octave(values, rate, hertz) for hertz in low]))
            names, effects = zip(*FALL_EFFECT[kind].items(), strict=True)
            rows.append(_Row(kind, kind, 0, 0.0, fall, names, np.array(effects)))
    return rows


FALL_EFFECT: Final = {
    FALL[0]: {"forces low-passed": -2.5, "one-way filter of the forces": -1.6},
    FALL[1]: {"markers low-passed": -3.0, "one-way filter of the markers": -1.2},
}
"""Octaves more, after a zero-lag low-pass at `SLOW_FORCES_HZ`, `SLOW_MARKERS_HZ`, and after a
filter of second to fourth order that makes them some 35 ms late."""
