"""Rollouts without pushes, which are compared with the record.

A rollout is long, to show that the walker keeps walking, but only its first cycles are compared
with the record. Of the rest only the distance is reported; the trajectory is not kept.

The compared walk is made in DART. Those from the other start phases only show that the walker keeps
walking; they run side by side in the compiled engine, which solves the same equations.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.artefacts import write_arrays
from gaitval.configuration import Configuration
from gaitval.coordinates import SIDES
from gaitval.errors import ArtefactError
from gaitval.journal import Journal
from gaitval.metrics.cycles import find_cycles, walking_speed
from gaitval.metrics.typed import number
from gaitval.metrics.walk_results import CountBySide, Endurance
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import RolloutPool, in_groups, record_rollout
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.simulation.rollout import SHAPES, Rollout, Travel
from gaitval.simulation.walker import Engine


@dataclass(frozen=True)
class Rollouts:
    """Rollouts with one set of body parameters.

    Attributes
    ----------
    compared : the rollout from the first start phase, as far as its cycles are compared with the
        record.
    starts : how far each start phase's rollout walked, the compared one first.
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


def compared_part(rollout: Rollout, configuration: Configuration) -> Rollout:
    """The start of `rollout`, as long as the compared cycles of `configuration` require.

    It has two more cycles: one for a left cycle that begins and ends later, and one in which the
    zero-lag filter settles.
    """
    settings = configuration.validation
    cycles = settings.settling_cycles + settings.cycles + 2
    # the phase is not wrapped and never decreases, so it can be searched
    rows = int(np.searchsorted(rollout.phase, rollout.start_phase[0] + cycles, side="right"))
    return replace(
        rollout,
        **{name: getattr(rollout, name)[:rows] for name, shape in SHAPES.items() if shape[0] == 0},
    )


@dataclass(frozen=True)
class _Start:
    policy: Policy
    mu: Array
    phase: float
    cycles: int
    compared: bool


_Walk = tuple[Endurance, Rollout | None]


def _walk(environment: WalkingEnvironment, start: _Start) -> _Walk:
    configuration = environment.task.configuration
    rollout = record_rollout(
        environment, start.policy, mu=start.mu, start_phase=start.phase, cycles=start.cycles
    )
    kept = compared_part(rollout, configuration) if start.compared else None
    return endurance(rollout, configuration, engine=environment.walker.engine), kept


def _walk_together(group: WalkingGroup, starts: Sequence[_Start]) -> list[_Walk]:
    """At most eight walks that are not compared, of one policy, body and length."""
    from gaitval.policy.travel import travel_together

    first = starts[0]
    phases = [start.phase for start in starts]
    travels = travel_together(
        group, first.policy, mu=first.mu, start_phases=phases, cycles=first.cycles
    )
    settings = group.environments[0].task.configuration
    return [(endurance(travel, settings, engine="compiled"), None) for travel in travels]


def _walks(pool: RolloutPool, starts: Sequence[_Start]) -> Iterable[_Walk]:
    """The compared walk, if it is still to be walked, and then the others."""
    compared = [start for start in starts if start.compared]
    others = [start for start in starts if not start.compared]
    alone = pool.each(_walk, compared)
    beside = pool.each_together(_walk_together, in_groups(others))
    return chain(alone, chain.from_iterable(beside))


def begun_walk(
    pool: RolloutPool, policy: Policy, mu: Array, phase: float, *, cycles: int, engine: Engine
) -> Callable[[], tuple[Endurance, Rollout]]:
    """Start a walk in another `engine` beside the next ones of `pool`: `policy` with the body `mu`
    (14,) from `phase`, for `cycles`. The returned function waits for it and returns how far it
    walked and its compared part.
    """
    start = _Start(policy, mu, phase, cycles, compared=True)
    # the pool starts the work now; the iterator blocks only where its result is read
    walks = iter(pool.each(_walk, [start], engine=engine))

    def ended() -> tuple[Endurance, Rollout]:
        went, rollout = next(walks)
        assert rollout is not None
        return went, rollout

    return ended


def roll_out_from(
    pool: RolloutPool,
    policy: Policy,
    mu: Array,
    phases: Sequence[float],
    *,
    cycles: int,
    workspace: Path | None = None,
) -> Rollouts:
    """Rollouts of the deterministic policy from each start phase. The first is compared and runs in
    the engine of `pool`, the others in the compiled one.

    Parameters
    ----------
    mu : (14,) body parameters.
    phases : of the right gait cycle.
    cycles : planned length of each rollout in gait cycles of the reference.
    workspace : a folder for finished rollouts; an interrupted call continues from those left there,
        to the same result.
    """
    kept = Path(workspace) / "compared.npz" if workspace else None

    def write(walk: _Walk) -> dict[str, Any]:
        went, compared = walk
        if compared is not None and kept is not None:
            write_arrays(kept, asdict(compared))
        return went.as_dict()

    def read(values: Mapping[str, Any]) -> _Walk:
        went = Endurance.model_validate(values)
        # only the compared walk, from the first phase, has a stored trajectory
        first = went.start_phase == phases[0] and kept is not None
        return went, Rollout.load(kept) if first and kept is not None else None

    walks = Journal(workspace / "walks.jsonl" if workspace else None).results(
        partial(_walks, pool),
        [
            _Start(policy, mu, phase, cycles, compared=number == 0)
            for number, phase in enumerate(phases)
        ],
        write=write,
        read=read,
    )
    compared = walks[0][1]
    assert compared is not None
    return Rollouts(compared, tuple(went for went, _ in walks))
