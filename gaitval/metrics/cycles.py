"""Gait events, gait cycles and spatiotemporal parameters of a rollout."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array, Index, runs
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES, Side, opposite
from gaitval.gait.cycles import length_and_width
from gaitval.gait.events import on_ground
from gaitval.gait.filters import low_pass_simulated
from gaitval.gait.record import LowPass
from gaitval.gait.sampling import SAMPLES, interpolated
from gaitval.walk.simulation.rollout import Rollout, Travel

SCUFF_SECONDS = 0.15
"""A foot on the ground for less than this has scuffed or dragged; no stance phase of walking is
this short (stance lasts 0.5 s or more at the speeds of the record)."""


@dataclass(frozen=True)
class FootEvents:
    """Events of one foot, as sample indices.

    Attributes
    ----------
    on_ground : (T,) True in stance, with bounces closed and scuffs dropped.
    heel_strikes : (n,) first sample on the ground of each stance. A foot that begins on the ground
        has no heel strike there, as it was not seen.
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
    starts, ends : by side, (n,) samples of the heel strikes that begin and end each cycle.
    events : by side, all events of the rollout.
    """

    starts: Mapping[Side, Index]
    ends: Mapping[Side, Index]
    events: Mapping[Side, FootEvents]

    def count(self, side: Side) -> int:
        """Number of complete cycles of one foot."""
        return len(self.starts[side])

    def rows(self) -> slice:
        """Samples of all right cycles, without the end of the last; there must be one."""
        return slice(int(self.starts["right"][0]), int(self.ends["right"][-1]))

    def first(self, count: int) -> "GaitCycles":
        """The first `count` cycles of each foot, or all if there are fewer."""
        return replace(
            self,
            starts={side: starts[:count] for side, starts in self.starts.items()},
            ends={side: ends[:count] for side, ends in self.ends.items()},
        )


def foot_events(vertical_force: Array, *, step: float, threshold: float) -> FootEvents:
    """Heel strikes and toe-offs of one foot from its unfiltered `vertical_force` (T,) N, upwards on
    the foot, every `step` seconds. The foot is on the ground above the `threshold`, N.

    Bounces are closed, then contacts shorter than `SCUFF_SECONDS` are dropped and counted
    (`gait.events.on_ground`).
    """
    on, scuffs = on_ground(vertical_force > threshold, rate=1.0 / step, scuff_s=SCUFF_SECONDS)
    begins, ends = runs(on)
    return FootEvents(
        on_ground=on, heel_strikes=begins[begins > 0], toe_offs=ends[ends < len(on)], scuffs=scuffs
    )


def find_cycles(rollout: Travel, configuration: Configuration) -> GaitCycles:
    """Complete gait cycles of both feet of `rollout`, without the settling ones.

    A cycle runs from a heel strike to the next one of the same foot. The first
    `validation.settling_cycles` right cycles of `configuration` are left out, and everything before
    them. A rollout that ended in a fall or is too short has few cycles, or none.
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
    # without a right cycle no left one is counted either
    first = right[0] if len(right) else len(rollout.time)
    starts: dict[Side, Index] = {}
    ends: dict[Side, Index] = {}
    for side in SIDES:
        strikes = events[side].heel_strikes
        strikes = strikes[strikes >= first]
        starts[side], ends[side] = strikes[:-1], strikes[1:]
    return GaitCycles(starts=starts, ends=ends, events=events)


def step_of(rollout: Travel) -> float:
    """Time between samples of `rollout`, s; 1 for a single sample, which has no cycles anyway."""
    return float(rollout.time[1] - rollout.time[0]) if len(rollout.time) > 1 else 1.0


def cut(values: Array, starts: Index, ends: Index) -> Array:
    """Curves (n, 101, ...) of `values` (T, ...) between the samples `starts` and `ends`, (n,) each,
    interpolated linearly.
    """
    samples = starts[:, None] + (ends - starts)[:, None] * np.linspace(0.0, 1.0, SAMPLES)
    return interpolated(values, samples)


def filtered(
    rollout: Rollout, filters: LowPass, columns: Sequence[int] | None = None
) -> tuple[Array, Array]:
    """Moments (T, 25) Nm, or some `columns`, and forces (T, 2, 3) N of `rollout`, by `filters`."""
    moments = rollout.moments if columns is None else rollout.moments[:, columns]
    step = step_of(rollout)
    return (
        low_pass_simulated(moments, step=step, frequency=filters.moments_hz),
        low_pass_simulated(rollout.ground_reaction, step=step, frequency=filters.forces_hz),
    )


def walking_speed(rollout: Travel, cycles: GaitCycles) -> float | None:
    """Mean forward speed of the centre of mass of `rollout` over right `cycles`, m/s, or None."""
    if cycles.count("right") == 0:
        return None
    first, last = cycles.rows().start, cycles.rows().stop
    travel = rollout.centre_of_mass[last, 0] - rollout.centre_of_mass[first, 0]
    return float(travel / (rollout.time[last] - rollout.time[first]))


def spatiotemporal(
    rollout: Rollout, cycles: GaitCycles, places: Mapping[Side, Array]
) -> dict[str, Array]:
    """Spatiotemporal parameters of `rollout`, a value per cycle or step; empty without `cycles`.

    Parameters
    ----------
    places : by side, (n, 2) m, forward and left: where the foot stands in each of its cycles.

    Returns
    -------
    `stride_time_right`, `stride_time_left` : s.
    `cadence` : steps/min, 120 / right stride time.
    `stance_fraction_right`, `stance_fraction_left` : of the foot's own cycle.
    `double_support_fraction` : fraction of the right cycle with both feet on the ground.
    `step_length_right`, `step_length_left` : m, forward, from where the other foot stood before to
        where this one stands; so a right and a left step add up to a stride.
    `step_width` : m, sideways between the same places, positive when the right foot stands right
        of the left one.
    """
    step = step_of(rollout)
    found: dict[str, Array] = {}
    for side in SIDES:
        # all of a foot's parameters are over its own cycle, from its heel strike to the next
        cycle = list(zip(cycles.starts[side], cycles.ends[side], strict=True))
        on = cycles.events[side].on_ground
        found[f"stride_time_{side}"] = np.array([(end - start) * step for start, end in cycle])
        found[f"stance_fraction_{side}"] = np.array([on[start:end].mean() for start, end in cycle])
    # two steps in a stride, 60 s in a minute
    found["cadence"] = 120.0 / found["stride_time_right"]
    both = cycles.events["right"].on_ground & cycles.events["left"].on_ground
    found["double_support_fraction"] = np.array(
        [
            both[start:end].mean()
            for start, end in zip(cycles.starts["right"], cycles.ends["right"], strict=True)
        ]
    )
    widths = []
    for side in SIDES:
        other = opposite(side)
        # the other foot's last stance that began before this one
        before = np.searchsorted(cycles.starts[other], cycles.starts[side]) - 1
        known = before >= 0
        length, width = length_and_width(side, places[side][known], places[other][before[known]])
        found[f"step_length_{side}"] = length
        widths.append(width)
    found["step_width"] = np.concatenate(widths)
    return found
