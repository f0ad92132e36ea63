"""Rollouts without pushes, which are compared with the record.

A rollout is long, to show that the walker keeps walking, but only its first cycles are compared
with the record: for the rest only the distance is reported, and the trajectory is not kept.

The one that is compared walks in DART. Those from the other start phases, which only show that the
walker keeps walking, walk side by side in the compiled engine, which solves the same equations.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
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
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import RolloutPool, in_groups, record_rollout, travel_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.simulation.rollout import Rollout, Travel
from gaitval.simulation.walker import Engine

_WHOLE = ("mu", "start_phase", "fell")
"""Fields that describe the whole rollout; all others have one row per sample."""


@dataclass(frozen=True)
class Endurance:
    """How far one rollout went.

    Attributes
    ----------
    start_phase : of the right gait cycle.
    fell : the rollout ended early.
    seconds : its duration.
    cycles : by side, complete gait cycles in a row after the settling ones.
    scuffs : by side, contacts too short for a stance.
    walking_speed : m/s over whole right cycles; None without any.
    engine : that it walked in.
    """

    start_phase: float
    fell: bool
    seconds: float
    cycles: Mapping[str, int]
    scuffs: Mapping[str, int]
    walking_speed: float | None
    engine: Engine

    def as_dict(self) -> dict[str, Any]:
        """The fields by name, to be written as JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "Endurance":
        """What `as_dict` gave. Without an engine it is from when all of them walked in DART."""
        known = {"engine": "dart", **values}
        return cls(**{field.name: known[field.name] for field in fields(cls)})


@dataclass(frozen=True)
class Rollouts:
    """Rollouts with one set of body parameters.

    Attributes
    ----------
    compared : the rollout from the first start phase, as far as its cycles are compared with the
        record.
    starts : how far the rollout from each start phase went, the compared one first.
    """

    compared: Rollout
    starts: tuple[Endurance, ...]


def endurance(rollout: Travel, configuration: Configuration, *, engine: Engine) -> Endurance:
    """How far a rollout without pushes went.

    Parameters
    ----------
    engine : that it walked in.

    Raises
    ------
    ArtefactError : the rollout has a push.
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
        cycles={side: cycles.count(side) for side in SIDES},
        scuffs={side: cycles.events[side].scuffs for side in SIDES},
        walking_speed=walking_speed(rollout, cycles),
        engine=engine,
    )


def compared_part(rollout: Rollout, configuration: Configuration) -> Rollout:
    """The beginning of a rollout, as long as its compared cycles require.

    It has two cycles more than are compared: one for a left cycle that begins and ends later, and
    one in which the zero-lag filter settles.
    """
    settings = configuration.validation
    cycles = settings.settling_cycles + settings.cycles + 2
    rows = int(np.searchsorted(rollout.phase, rollout.start_phase[0] + cycles, side="right"))
    return replace(
        rollout,
        **{
            field.name: getattr(rollout, field.name)[:rows]
            for field in fields(rollout)
            if field.name not in _WHOLE
        },
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
    """Begin a walk in another engine beside those that the pool is given next; the function that is
    returned waits for it.

    Returns
    -------
    How far it went, and its part that is compared.
    """
    start = _Start(policy, mu, phase, cycles, compared=True)
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
    """Rollouts of the deterministic policy from each start phase; the first one is compared, and
    walks in the pool's engine, the others in the compiled one.

    Parameters
    ----------
    mu : (14,) body parameters.
    phases : of the right gait cycle.
    cycles : planned length of each rollout in gait cycles of the reference.
    workspace : a folder for finished rollouts; those that an interrupted call has left there are
        taken over, to the same result.
    """
    kept = Path(workspace) / "compared.npz" if workspace else None

    def write(walk: _Walk) -> dict[str, Any]:
        went, compared = walk
        if compared is not None and kept is not None:
            write_arrays(kept, asdict(compared))
        return went.as_dict()

    def read(values: Mapping[str, Any]) -> _Walk:
        went = Endurance.from_dict(values)
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
