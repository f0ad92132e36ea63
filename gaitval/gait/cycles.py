"""Gait cycles of a recorded trial: their times, curves over them, and spatiotemporal parameters.

A cycle runs from one heel strike to the next of the same foot. No cycle is dropped silently: one
that is not used states why. It is long because cycles, places and speeds share the same stances.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.errors import RecordError
from gaitval.gait.sampling import SAMPLES, interpolated
from gaitval.mocap.foot_markers import facing, foot_markers
from gaitval.mocap.recording import Event, EventKind, FootForces, Recording


@dataclass(frozen=True)
class CycleLimits:
    """Which gait cycles count."""

    plausible_stride: tuple[float, float] = (0.5, 3.5)
    """s. Fast walking has strides of 0.8 s; a patient at 0.2 m/s has strides of 3 s."""
    unusual_stride: float = 0.2
    """A stride that differs from the median by more than this fraction is a stumble, a stop or a
    wrong event: in the slowest walk of WBDS01, where strides vary most, the standard deviation is 3
    to 4 %."""
    slowest_belt: float = 0.1
    """m/s. Feet on the ground still roll at 0.01 to 0.03 m/s during `flat_foot`; no belt runs that
    slowly."""
    edge_seconds: float = 0.02
    """s. If found from markers, the strike that ends a cycle may be this late: within this time
    before it, forces on the plates may belong to the next stance."""
    flat_foot: tuple[float, float] = (0.2, 0.5)
    """Fraction of stance in which heel and forefoot are both on the ground."""


CYCLES: Final = CycleLimits()


@dataclass(frozen=True)
class GaitCycle:
    """One gait cycle of one foot; times in s on the recording's clock.

    Attributes
    ----------
    start, end : heel strikes of the foot.
    toe_off : of the foot; NaN if it was not found.
    opposite_toe_off, opposite_strike : of the other foot, within the cycle; NaN if not found.
    kinematics_valid : the events are complete and in order, and the duration is usual.
    kinetics_valid : likewise, and the plates show this foot's force throughout.
    reasons : why it is not valid; empty if it is.
    """

    side: Side
    start: float
    toe_off: float
    end: float
    opposite_toe_off: float
    opposite_strike: float
    kinematics_valid: bool
    kinetics_valid: bool
    reasons: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Stride time, s."""
        return self.end - self.start

    def __str__(self) -> str:
        state = "; ".join(self.reasons) if self.reasons else "used"
        return f"{self.side} cycle {self.start:.3f}-{self.end:.3f} s: {state}"


@dataclass(frozen=True)
class AverageCurve:
    """A quantity over the gait cycle.

    Attributes
    ----------
    mean, deviation : (101, ...) mean and sample standard deviation (n − 1) over the cycles, 0 to
        100 %; the deviation of a single cycle is NaN.
    curves : (n, 101, ...) the cycles themselves.
    """

    mean: Array
    deviation: Array
    curves: Array


@dataclass(frozen=True)
class SpatioTemporal:
    """Spatiotemporal parameters of one foot, one value per cycle (n,), NaN if not measurable.

    Attributes
    ----------
    stride_time : s.
    step_time : s, from the other foot's strike to this foot's that ends the cycle.
    cadence : steps/min, 120 / `stride_time`.
    stride_length : m, between this foot's successive places on the ground or belt.
    step_length : m, forward from the other foot's place to this foot's next one; a right and a
        left step make a stride.
    step_width : m, sideways between the same two places, positive when the right foot stands
        right of the left one.
    stance_fraction : of the stride, from strike to toe-off.
    double_support_fraction : of the stride, both periods together.
    speed : m/s, `stride_length` / `stride_time`: relative to the belt on a treadmill.
    walk_ratio : m/(steps/min), `step_length` / `cadence` (Sekiya and Nagasaki 1998).
    """

    side: Side
    stride_time: Array
    step_time: Array
    cadence: Array
    stride_length: Array
    step_length: Array
    step_width: Array
    stance_fraction: Array
    double_support_fraction: Array
    speed: Array
    walk_ratio: Array

    def summary(self) -> dict[str, tuple[float, float]]:
        """`mean_and_deviation` of each parameter over the cycles that have it."""
        return {
            each.name: mean_and_deviation(getattr(self, each.name)) for each in fields(self)[1:]
        }


def mean_and_deviation(values: Array) -> tuple[float, float]:
    """Mean and SD (n − 1) of the finite ones of `values` (n,); NaN where they are too few."""
    values = values[np.isfinite(values)]
    return (
        float(values.mean()) if len(values) else np.nan,
        float(values.std(ddof=1)) if len(values) > 1 else np.nan,
    )


def cut_cycles(
    events: Iterable[Event], side: Side, *, forces: FootForces | None = None
) -> tuple[GaitCycle, ...]:
    """All cycles of the foot of a `side`, whose heel strikes begin and end them, in order of time,
    including those that are not valid. `events` are of both feet, in any order; without the
    `forces` of `assign_forces` no cycle is valid for kinetics.
    """
    events = sorted(events, key=lambda event: event.time)
    other = opposite(side)

    def times(of: Side, kind: EventKind) -> Array:
        return np.array([e.time for e in events if e.side == of and e.kind == kind])

    strikes = times(side, "heel_strike")
    inner = [times(side, "toe_off"), times(other, "toe_off"), times(other, "heel_strike")]
    durations = np.diff(strikes)
    usual = float(np.median(durations)) if len(durations) else np.nan
    cycles = []
    # A missed strike makes one cycle of two strides; `_faults` rejects it by its duration and by
    # its doubled events.
    for start, end in pairwise(map(float, strikes)):
        between = [found[(found > start) & (found < end)] for found in inner]
        # If there are several, the first is stored, but `_faults` makes such a cycle not valid.
        toe_off, opposite_toe_off, opposite_strike = (
            float(found[0]) if len(found) else np.nan for found in between
        )
        reasons = _faults(side, start, end, usual, between)
        kinematics = not reasons
        unshown = _unshown(forces, side, start, end)
        reasons += [unshown] if unshown else []
        cycles.append(
            GaitCycle(
                side=side,
                start=start,
                toe_off=toe_off,
                end=end,
                opposite_toe_off=opposite_toe_off,
                opposite_strike=opposite_strike,
                kinematics_valid=kinematics,
                kinetics_valid=kinematics and not unshown,
                reasons=tuple(reasons),
            )
        )
    return tuple(cycles)


def _faults(side: Side, start: float, end: float, usual: float, between: list[Array]) -> list[str]:
    """What is wrong with the events of a cycle."""
    reasons = []
    duration = end - start
    low, high = CYCLES.plausible_stride
    if not low <= duration <= high:
        reasons.append(f"it lasts {duration:.2f} s, but strides last {low} to {high} s")
    elif abs(duration / usual - 1.0) > CYCLES.unusual_stride:
        reasons.append(
            f"it lasts {duration:.2f} s, which differs by more than "
            f"{100 * CYCLES.unusual_stride:.0f} % "
            f"from the trial's median of {usual:.2f} s"
        )
    other = opposite(side)
    named = (f"{side} toe-off", f"{other} toe-off", f"{other} heel strike")
    for name, found in zip(named, between, strict=True):
        if len(found) != 1:
            reasons.append(f"{'no' if not len(found) else len(found)} {name} in it")
    if not reasons:
        toe_off, opposite_toe_off, opposite_strike = (float(found[0]) for found in between)
        # In walking the other foot leaves the ground and lands again before this foot leaves it. In
        # running it lands after this foot's toe-off: there is no double support.
        if not opposite_toe_off < opposite_strike < toe_off:
            reasons.append("its events are not in the order of walking (is it running?)")
    return reasons


def _unshown(forces: FootForces | None, side: Side, start: float, end: float) -> str:
    """Why the plates do not show a foot's force in a cycle; empty if they do."""
    if forces is None:
        return "no force plates: no kinetics"
    samples = forces.time
    spacing = 1.0 / forces.rate
    # An event may lie one sample beyond the ends, because it is found between samples.
    if start < samples[0] - spacing or end > samples[-1] + spacing:
        return "it is outside the time of the forces: no kinetics"
    inside = (samples >= start) & (samples <= end - CYCLES.edge_seconds)
    uncertain = ~forces.valid[inside, SIDES.index(side)]
    if not uncertain.any():
        return ""
    when = samples[inside][uncertain]
    return (
        f"the plates do not show the {side} foot alone at {when[0]:.3f}-{when[-1]:.3f} s: no "
        "kinetics"
    )


def normalise(time: Array, values: ArrayLike, cycle: GaitCycle) -> Array:
    """`values` (T, ...) at `time` (T,) s, uniformly spaced, over one `cycle`, from heel strike to
    the next: (101, ...) at 0 to 100 %, linearly interpolated. Raises RecordError if values and
    times differ in length, or the cycle is outside them.
    """
    values = np.asarray(values, dtype=float)
    if len(values) != len(time):
        raise RecordError(
            f"Values at {len(values)} times cannot be cut with {len(time)} times: they are from "
            "another trial or have another rate. Resample them first."
        )
    spacing = float(time[1] - time[0]) if len(time) > 1 else 0.0
    if len(time) < 2 or cycle.start < time[0] - spacing or cycle.end > time[-1] + spacing:
        raise RecordError(
            f"The {cycle.side} cycle of {cycle.start:.3f}-{cycle.end:.3f} s is outside the "
            f"values, which are {len(time)} samples"
            + (f" from {time[0]:.3f} to {time[-1]:.3f} s." if len(time) else ".")
            + " They are from another trial, or were cut. Give the values of the whole trial."
        )
    wanted = np.linspace(cycle.start, cycle.end, SAMPLES)
    # `lone`: a strike exactly at a frame does not need the frame beyond it, which may be in a gap.
    return interpolated(values, (wanted - time[0]) / spacing, lone=True)


WalkedPart = tuple[Array, Array, Sequence[GaitCycle]]
"""Times (T,) s, values (T, ...) and the cycles that count, of one trial."""


def average(parts: Iterable[WalkedPart]) -> AverageCurve | None:
    """Mean and standard deviation of a quantity over the cycles of one or several trials, whose
    `parts` are (times, values, cycles), see `WalkedPart`; every cycle counts the same, whatever its
    trial. None if there is no cycle. Raises RecordError as `normalise`.
    """
    curves = [normalise(time, values, cycle) for time, values, cycles in parts for cycle in cycles]
    if not curves:
        return None
    stacked = np.stack(curves)
    deviation = (
        stacked.std(axis=0, ddof=1) if len(curves) > 1 else np.full(stacked.shape[1:], np.nan)
    )
    return AverageCurve(mean=stacked.mean(axis=0), deviation=deviation, curves=stacked)


def belt_speed(
    recording: Recording, events: Iterable[Event], *, landmarks: Mapping[str, str]
) -> float:
    """Speed of the belt under the feet, m/s: positive when it carries them backwards, 0 over
    ground.

    The median over all stances of the backward velocity of heel and forefoot while the foot is flat
    (20 to 50 % of the stance), each from a line through the markers; 0 if it is below
    `CYCLES.slowest_belt`. `recording` is cleaned, z up; `events` are of both feet; `landmarks`: see
    `foot_markers`. Raises RecordError if the feet are seen in no stance from heel strike to
    toe-off.
    """
    forward = travel(recording, events, landmarks=landmarks)
    # Negated because a belt carries the foot backwards.
    speeds = [
        -velocity @ forward[:2] for _, _, _, velocity in _flat_feet(recording, events, landmarks)
    ]
    if not speeds:
        raise RecordError(
            f"{recording.source}: no stance from heel strike to toe-off in which heel and "
            "forefoot are seen, so the speed of the belt is unknown. Give a longer trial, or "
            "fill the gaps."
        )
    speed = float(np.median(speeds))
    return speed if abs(speed) > CYCLES.slowest_belt else 0.0


def _flat_feet(
    recording: Recording, events: Iterable[Event], landmarks: Mapping[str, str]
) -> list[tuple[Side, float, Array, Array]]:
    """Side, time (s), place (2,) m and velocity (2,) m/s of the foot in each stance in which heel
    and forefoot are seen while it is flat.
    """
    feet = foot_markers(recording, landmarks)
    found = []
    for side, start, stop in stances(events):
        begin, end = (start + share * (stop - start) for share in CYCLES.flat_foot)
        inside = (recording.time >= begin) & (recording.time <= end)
        middle = (0.5 * (feet[side].heel + feet[side].front))[inside, :2]
        if len(middle) > 2 and np.isfinite(middle).all():
            # The slope of a line through the whole flat-foot phase averages the markers' noise.
            velocity, place = np.polyfit(recording.time[inside] - begin, middle, 1)
            found.append((side, float(begin), place, velocity))
    return found


def travel(recording: Recording, events: Iterable[Event], *, landmarks: Mapping[str, str]) -> Array:
    """Horizontal direction (3,) in which the person goes: that of the strides of both feet, on a
    belt seen from the belt. The pelvis need not point there (`facing`, where no stride is whole).
    `recording`, `events` and `landmarks` are as `belt_speed` takes them.
    """
    flat = _flat_feet(recording, events, landmarks)
    total = np.zeros(2)
    for side in SIDES:
        for (_, begin, first, slow), (_, end, second, fast) in pairwise(
            each for each in flat if each[0] == side
        ):
            if end - begin < CYCLES.plausible_stride[1]:  # none was missed between
                total += second - first - 0.5 * (slow + fast) * (end - begin)
    length = float(np.linalg.norm(total))
    return np.append(total / length, 0.0) if length > 0.0 else facing(recording, landmarks)


def stances(events: Iterable[Event]) -> list[tuple[Side, float, float]]:
    """Side, heel strike and toe-off, s, of each complete stance of `events`, in any order."""
    events = sorted(events, key=lambda event: event.time)
    found = []
    for side in SIDES:
        for first, second in pairwise(event for event in events if event.side == side):
            if (first.kind, second.kind) == ("heel_strike", "toe_off"):
                found.append((side, first.time, second.time))
    return found


def spatiotemporal(
    recording: Recording,
    events: Iterable[Event],
    cycles: Sequence[GaitCycle],
    side: Side,
    *,
    landmarks: Mapping[str, str],
    belt: float,
) -> SpatioTemporal:
    """Spatiotemporal parameters of the `cycles` of the foot of a `side` that are valid for
    kinematics; of none they have no values.

    The position of a foot is the median of its heel marker while the foot is flat, along and across
    the direction of `travel`, in axes that move with the `belt` (its speed, m/s; over ground they
    are fixed). So one formula serves treadmill and ground. `recording`, `events`, of which the
    cycles were cut, and `landmarks` are as `belt_speed` takes them.
    """
    events = tuple(events)
    cycles = [cycle for cycle in cycles if cycle.kinematics_valid]
    if not cycles:
        none = np.zeros(0)
        return SpatioTemporal(side, *(none for _ in fields(SpatioTemporal)[1:]))
    other = opposite(side)
    places = _Places(recording, events, landmarks, belt)
    start, end, toe_off, opposite_toe_off, opposite_strike = np.array(
        [[c.start, c.end, c.toe_off, c.opposite_toe_off, c.opposite_strike] for c in cycles]
    ).T
    first, second = places.of(side, start), places.of(side, end)
    between = places.of(other, opposite_strike)
    stride_time = end - start
    # Two steps in a stride, 60 s in a minute.
    cadence = 120.0 / stride_time
    stride_length = (second - first)[:, 0]
    # The step of this foot that ends the cycle: the other foot has landed within the cycle, this
    # one lands at its end.
    step_length, step_width = length_and_width(side, second, between)
    return SpatioTemporal(
        side=side,
        stride_time=stride_time,
        step_time=end - opposite_strike,
        cadence=cadence,
        stride_length=stride_length,
        step_length=step_length,
        step_width=step_width,
        stance_fraction=(toe_off - start) / stride_time,
        # The first period ends with the other foot's toe-off, the second begins with its strike.
        double_support_fraction=((opposite_toe_off - start) + (toe_off - opposite_strike))
        / stride_time,
        speed=stride_length / stride_time,
        walk_ratio=step_length / cadence,
    )


def length_and_width(side: Side, places: Array, others: Array) -> tuple[Array, Array]:
    """Length and width of steps, (n,) m each, in a recording or a simulation: from `others`, where
    the other foot stands before, to `places`, where the foot of a `side` lands, both (n, 2) m,
    forward and left. The width is positive when the right foot is to the right of the left one.
    """
    steps = places - others
    return steps[:, 0], steps[:, 1] if side == "left" else -steps[:, 1]


class _Places:
    """Where the feet stand on the belt or the ground, forward and to the left, m."""

    def __init__(
        self,
        recording: Recording,
        events: Sequence[Event],
        landmarks: Mapping[str, str],
        belt: float,
    ) -> None:
        forward = travel(recording, events, landmarks=landmarks)
        leftward = np.array([-forward[1], forward[0], 0.0])
        self.time = recording.time
        self.heels: dict[Side, Array] = {
            # A foot at rest on the belt moves backwards at the belt's speed v. Adding v t makes it
            # stand still, so places of successive strikes compare as they do over ground.
            side: np.stack([foot.heel @ forward + belt * self.time, foot.heel @ leftward], axis=1)
            for side, foot in foot_markers(recording, landmarks).items()
        }
        self.usual = float(np.median([stop - start for _, start, stop in stances(events)]))

    def of(self, side: Side, strikes: Array) -> Array:
        """(n, 2) place of the foot after each of these strikes; NaN where it is not seen."""
        found = np.full((len(strikes), 2), np.nan)
        for row, strike in enumerate(strikes):
            # The trial's median stance, because the last stance may not end within the recording.
            begin, end = (strike + share * self.usual for share in CYCLES.flat_foot)
            flat = self.heels[side][(self.time >= begin) & (self.time <= end)]
            if len(flat) > 2:
                found[row] = np.median(flat, axis=0)
        return found
