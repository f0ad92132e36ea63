"""Gait events, gait cycles and spatiotemporal parameters of a simulated walk."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import butter, sosfiltfilt

from gaitval.arrays import Array, Index, runs
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES, Side
from gaitval.gait.record import LowPass
from gaitval.simulation.rollout import Rollout

SAMPLES = 101
"""Points of a normalised gait cycle: 0, 1, ... 100 %."""

BOUNCE_SECONDS = 0.05
"""A foot off the ground for less than this has bounced; it has not begun a swing."""
SCUFF_SECONDS = 0.15
"""A foot on the ground for less than this has scuffed or dragged; no stance phase of walking is
this short (stance lasts 0.5 s or more at the speeds of the record)."""

_OTHER: Mapping[Side, Side] = {"right": "left", "left": "right"}


@dataclass(frozen=True)
class FootEvents:
    """Events of one foot, as sample indices.

    Attributes
    ----------
    on_ground : (T,) True in stance, bounces closed and scuffs dropped.
    heel_strikes : (n,) first sample on the ground of each stance. A walk that begins on the
        ground has no heel strike there, as it was not seen.
    toe_offs : (m,) first sample off the ground after each stance.
    scuffs : contacts shorter than `SCUFF_SECONDS`, which are not counted as stance.
    """

    on_ground: NDArray[np.bool_]
    heel_strikes: Index
    toe_offs: Index
    scuffs: int


@dataclass(frozen=True)
class GaitCycles:
    """Complete gait cycles of both feet after the settling ones.

    Attributes
    ----------
    starts, ends : by side, (n,) sample of the heel strike that begins and that ends each cycle.
    events : by side, all events of the walk.
    """

    starts: Mapping[Side, Index]
    ends: Mapping[Side, Index]
    events: Mapping[Side, FootEvents]

    def count(self, side: Side) -> int:
        """Number of complete cycles of one foot."""
        return len(self.starts[side])

    def first(self, count: int) -> "GaitCycles":
        """The first `count` cycles of each foot, fewer where there are fewer."""
        return replace(
            self,
            starts={side: starts[:count] for side, starts in self.starts.items()},
            ends={side: ends[:count] for side, ends in self.ends.items()},
        )


def low_pass(values: ArrayLike, *, step: float, frequency: float) -> Array:
    """Zero-lag fourth-order Butterworth low-pass along the first axis.

    A second-order filter runs forwards and backwards. Two passes would attenuate to 1/2 at the
    design frequency, so that one is raised by 1/(√2 − 1)^¼: the gain at `frequency` is then
    1/√2 (Winter 2009, Biomechanics and Motor Control of Human Movement, section 3.4.4.2).

    Parameters
    ----------
    values : (T, ...) uniformly sampled.
    step : s, time between samples.
    frequency : Hz, below about 0.8 of half the sample rate.
    """
    values = np.asarray(values, dtype=float)
    if len(values) < 2:
        return values
    single_pass = frequency / (np.sqrt(2.0) - 1.0) ** 0.25
    sections = butter(2, single_pass, fs=1.0 / step, output="sos")
    # the ends are extended over one period of the cut-off, in which the filter settles
    padding = min(len(values) - 1, round(1.0 / (frequency * step)))
    return np.asarray(sosfiltfilt(sections, values, axis=0, padlen=padding))


def foot_events(vertical_force: Array, *, step: float, threshold: float) -> FootEvents:
    """Heel strikes and toe-offs of one foot from its unfiltered vertical ground reaction.

    Gaps in contact shorter than `BOUNCE_SECONDS` are closed, then contacts shorter than
    `SCUFF_SECONDS` are dropped and counted.

    Parameters
    ----------
    vertical_force : (T,) N, upwards on the foot.
    step : s, time between samples.
    threshold : N, the foot is on the ground above it.
    """
    length = len(vertical_force)
    on = vertical_force > threshold
    begins, ends = runs(~on)
    for begin, end in zip(begins, ends, strict=True):
        if begin > 0 and end < length and (end - begin) * step < BOUNCE_SECONDS:
            on[begin:end] = True
    begins, ends = runs(on)
    # a contact cut by the beginning or the end of the walk may be a stance: it stays
    whole = (begins > 0) & (ends < length)
    scuffed = whole & ((ends - begins) * step < SCUFF_SECONDS)
    for begin, end in zip(begins[scuffed], ends[scuffed], strict=True):
        on[begin:end] = False
    begins, ends = begins[~scuffed], ends[~scuffed]
    return FootEvents(
        on_ground=on,
        heel_strikes=begins[begins > 0],
        toe_offs=ends[ends < length],
        scuffs=int(scuffed.sum()),
    )


def find_cycles(rollout: Rollout, configuration: Configuration) -> GaitCycles:
    """Complete gait cycles of both feet, without the settling ones.

    A cycle runs from a heel strike to the next one of the same foot. The first
    `validation.settling_cycles` right cycles are left out, and everything before them. A walk that
    fell or is too short has few, or none.
    """
    step = step_of(rollout)
    events: dict[Side, FootEvents] = {}
    for column, side in enumerate(SIDES):
        events[side] = foot_events(
            rollout.ground_reaction[:, column, 2],
            step=step,
            threshold=configuration.contact.event_threshold,
        )
    right = events["right"].heel_strikes[configuration.validation.settling_cycles :]
    first = right[0] if len(right) else len(rollout.time)
    starts: dict[Side, Index] = {}
    ends: dict[Side, Index] = {}
    for side in SIDES:
        strikes = events[side].heel_strikes
        strikes = strikes[strikes >= first]
        starts[side], ends[side] = strikes[:-1], strikes[1:]
    return GaitCycles(starts=starts, ends=ends, events=events)


def step_of(rollout: Rollout) -> float:
    """Time between samples, s; a walk of one sample has no cycles, whatever its step."""
    return float(rollout.time[1] - rollout.time[0]) if len(rollout.time) > 1 else 1.0


def cut(values: Array, starts: Index, ends: Index) -> Array:
    """Curves over the gait cycle: (n, 101, ...) from `values` (T, ...), linearly interpolated."""
    samples = starts[:, None] + (ends - starts)[:, None] * np.linspace(0.0, 1.0, SAMPLES)
    below = np.minimum(samples.astype(np.int64), len(values) - 2)
    weight = (samples - below).reshape(samples.shape + (1,) * (values.ndim - 1))
    return np.asarray(values[below] * (1.0 - weight) + values[below + 1] * weight)


def filtered(rollout: Rollout, filters: LowPass) -> tuple[Array, Array]:
    """Joint moments (T, 25) Nm and ground reaction (T, 2, 3) N after `low_pass`."""
    step = step_of(rollout)
    return (
        low_pass(rollout.moments, step=step, frequency=filters.moments_hz),
        low_pass(rollout.ground_reaction, step=step, frequency=filters.forces_hz),
    )


def walking_speed(rollout: Rollout, cycles: GaitCycles) -> float | None:
    """Forward displacement of the centre of mass over whole right cycles by their time, m/s."""
    if cycles.count("right") == 0:
        return None
    first, last = cycles.starts["right"][0], cycles.ends["right"][-1]
    travel = rollout.centre_of_mass[last, 0] - rollout.centre_of_mass[first, 0]
    return float(travel / (rollout.time[last] - rollout.time[first]))


def spatiotemporal(
    rollout: Rollout, cycles: GaitCycles, places: Mapping[Side, Array]
) -> dict[str, Array]:
    """Spatiotemporal parameters, one value a cycle or step; empty arrays without cycles.

    Parameters
    ----------
    places : by side, (n, 2) m, forward and left: where the foot stands in each of its cycles.

    Returns
    -------
    `stride_time_right`, `stride_time_left` : s.
    `cadence` : steps/min, 120 over the right stride time.
    `stance_fraction_right`, `stance_fraction_left` : of the foot's own cycle.
    `double_support_fraction` : share of the right cycle with both feet on the ground.
    `step_length_right`, `step_length_left` : m, forward, from where the other foot stood before to
        where this one stands; so a right and a left step add up to a stride.
    `step_width` : m, sideways between the same places, positive when the right foot stands right
        of the left one.
    """
    step = step_of(rollout)
    found: dict[str, Array] = {}
    for side in SIDES:
        cycle = list(zip(cycles.starts[side], cycles.ends[side], strict=True))
        on = cycles.events[side].on_ground
        found[f"stride_time_{side}"] = np.array([(end - start) * step for start, end in cycle])
        found[f"stance_fraction_{side}"] = np.array([on[start:end].mean() for start, end in cycle])
    found["cadence"] = 120.0 / found["stride_time_right"]
    both = cycles.events["right"].on_ground & cycles.events["left"].on_ground
    found["double_support_fraction"] = np.array(
        [
            both[start:end].mean()
            for start, end in zip(cycles.starts["right"], cycles.ends["right"], strict=True)
        ]
    )
    widths = []
    for side, other in _OTHER.items():
        # the other foot's last stance that began before this one
        before = np.searchsorted(cycles.starts[other], cycles.starts[side]) - 1
        known = before >= 0
        steps = places[side][known] - places[other][before[known]]
        found[f"step_length_{side}"] = steps[:, 0]
        widths.append(steps[:, 1] if side == "left" else -steps[:, 1])
    found["step_width"] = np.concatenate(widths)
    return found
