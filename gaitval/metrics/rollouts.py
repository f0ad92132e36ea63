"""Rollouts without pushes, which are compared with the record.

A rollout is long, to show that the walker keeps walking, but only its first cycles are compared
with the record. Of the rest only the distance is reported; the trajectory is not kept.

The compared cycles of the first walk are made in DART. How far the walker gets from each start
phase is walked side by side in the compiled engine, which solves the same equations. A first walk
that falls in one engine only has fallen.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from gaitval.arrays import Array
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.errors import ArtefactError
from gaitval.metrics.cycles import find_cycles, walking_speed
from gaitval.metrics.results import CountBySide, Endurance
from gaitval.metrics.typed import number
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import RolloutPool, in_groups, record_rollout
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.simulation.rollout import SHAPES, Rollout, Travel
from gaitval.walk.simulation.walker import Engine


@dataclass(frozen=True)
class Rollouts:
    """Rollouts with one set of body parameters.

    Attributes
    ----------
    compared : the rollout from the first start phase, as far as its cycles are compared with the
        record.
    starts : how far each start phase's rollout walked.
    """

    compared: Rollout
    starts: tuple[Endurance, ...]


def endurance(rollout: Travel, configuration: Configuration, *, engine: Engine) -> Endurance:
    """How far the walker of `rollout` walked in `engine`, by the events of `configuration`. Raises
    ArtefactError if the rollout has a push.
    """
    if rollout.root_force.any():
        row = int(rollout.root_force.any(axis=1).argmax())
        raise ArtefactError(
            f"in the rollout from phase {rollout.start_phase[0]:g} the pelvis is pushed at "
            f"{rollout.time[row]:g} s, but in a rollout that is compared with the record only the "
            "ground may act on the walker. Give a rollout without pushes."
        )
    cycles = find_cycles(rollout, configuration)
    return Endurance(
        start_phase=float(rollout.start_phase[0]),
        fell=bool(rollout.fell[0]),
        seconds=float(rollout.time[-1] - rollout.time[0]),
        cycles=CountBySide(**{side: cycles.count(side) for side in SIDES}),
        scuffs=CountBySide(**{side: cycles.events[side].scuffs for side in SIDES}),
        walking_speed=number(walking_speed(rollout, cycles)),
        engine=engine,
    )


def compared_cycles(configuration: Configuration) -> int:
    """Length of a walk that is compared in a `configuration`, in gait cycles of the reference.

    It has two more cycles than are compared: one for a left cycle that begins and ends later, and
    one in which the zero-lag filter settles.
    """
    settings = configuration.validation
    return settings.settling_cycles + settings.cycles + 2


def compared_part(rollout: Rollout, configuration: Configuration) -> Rollout:
    """The start of `rollout`, as long as the compared cycles of `configuration` require."""
    end = rollout.start_phase[0] + compared_cycles(configuration)
    # the phase is not wrapped and never decreases, so it can be searched
    rows = int(np.searchsorted(rollout.phase, end, side="right"))
    return replace(
        rollout,
        **{name: getattr(rollout, name)[:rows] for name, shape in SHAPES.items() if shape[0] == 0},
    )


@dataclass(frozen=True)
class _Start:
    policy: Policy
    mu: Array
    phase: float


def _walk(environment: WalkingEnvironment, start: _Start) -> tuple[Endurance, Rollout]:
    """A walk that is compared."""
    settings = environment.task.configuration
    rollout = record_rollout(
        environment,
        start.policy,
        mu=start.mu,
        start_phase=start.phase,
        cycles=compared_cycles(settings),
    )
    went = endurance(rollout, settings, engine=environment.walker.engine)
    return went, compared_part(rollout, settings)


def _walk_together(group: WalkingGroup, starts: Sequence[_Start]) -> list[Endurance]:
    """At most eight walks that are not compared, of one policy and body."""
    from gaitval.policy.travel import travel_together

    first, settings = starts[0], group.environments[0].task.configuration
    travels = travel_together(
        group,
        first.policy,
        mu=first.mu,
        start_phases=[start.phase for start in starts],
        cycles=settings.validation.settling_cycles + settings.validation.consecutive_cycles,
    )
    return [endurance(travel, settings, engine="compiled") for travel in travels]


def walked_far(
    pool: RolloutPool, policy: Policy, mu: Array, phases: Sequence[float]
) -> tuple[Endurance, ...]:
    """How far the deterministic `policy` with the body `mu` (14,) gets from each of the `phases` of
    the right gait cycle, in the compiled engine by the workers of `pool`.
    """
    groups = in_groups([_Start(policy, mu, phase) for phase in phases])
    return tuple(chain.from_iterable(pool.each_together(_walk_together, groups)))


def started_walk(
    pool: RolloutPool, policy: Policy, mu: Array, phase: float, *, engine: Engine
) -> Callable[[], tuple[Endurance, Rollout]]:
    """Start a walk of the compared length in an `engine` beside the next ones of `pool`: `policy`
    with the body `mu` (14,) from `phase`. The returned function waits for it and returns how far it
    walked and its compared part.
    """
    # the pool starts the work now; the iterator blocks only where its result is read
    walks = iter(pool.each(_walk, [_Start(policy, mu, phase)], engine=engine))
    return lambda: next(walks)


def roll_out_from(
    pool: RolloutPool, policy: Policy, mu: Array, starts: Sequence[Endurance]
) -> Rollouts:
    """The rollout of `policy` with the body `mu` (14,) that is compared: from the first of the
    `starts` (`walked_far`), in DART, by a worker of `pool`. A fall there counts, too.
    """
    went, compared = started_walk(pool, policy, mu, starts[0].start_phase, engine="dart")()
    return Rollouts(compared, (went if went.fell else starts[0], *starts[1:]))
