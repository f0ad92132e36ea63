"""Eight walking environments that act at the same time, their walkers side by side.

An environment of a group does, bit for bit, what it does alone. Its arrays are rows of the group's,
so it resets and pushes itself; an action of all eight is one compiled call.
"""

import weakref
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitval._internal.numba.compiled import njit, njit_borrowing
from gaitval._internal.numba.lanes import WIDTH, in_lanes, with_lanes
from gaitval.arrays import Array, Index, aligned
from gaitval.model.tree import ACTUATED_COUNT
from gaitval.policy.environment import (
    HABIT_PHASES,
    Act,
    WalkingEnvironment,
    action_size,
    episode_arrays,
)
from gaitval.policy.judgement import judge, take_action
from gaitval.policy.observation import (
    MIRROR_ORDER,
    MIRROR_SIGNS,
    EpisodeArrays,
    MeasureWorkspace,
    Targets,
    Yardstick,
    is_mirrored,
    measure_workspace,
)
from gaitval.walk.simulation.physics_steps import Account, WalkerBody, Workspace
from gaitval.walk.simulation.side_by_side import LaneArrays, SideBySide, advance_lanes
from gaitval.walk.simulation.tables import LaneTables
from gaitval.walk.simulation.walker import WalkerArrays, WalkingTask, walker_arrays

Pairs = tuple[tuple[Array, Array], ...]


class GroupArrays(NamedTuple):
    """What an action of the group works with, one row an environment or one lane a walker.

    Attributes
    ----------
    walkers, episodes : the environments' own arrays.
    yardstick : of each; its numbers and arrays have a last axis of eight, its tables are
        `LaneTables`.
    judged, work : `EpisodeArrays` in lanes, and what they are computed in.
    outcome : (2, 8) what `judge` gives.
    shares : (8, 26) as in `take_action`.
    phase, pace, lift : (8, 1); lift in m, `lane_lift` (1, 8) its copy.
    next_offset : (8, 25) rad.
    biases : (8, 100, A) action bias of each hundredth of the cycle, which is subtracted.
    rewards, fell : (8,) of the action.
    """

    walkers: WalkerArrays
    episodes: EpisodeArrays
    yardstick: Yardstick
    judged: EpisodeArrays
    work: MeasureWorkspace
    outcome: Array
    shares: Array
    phase: Array
    pace: Array
    lift: Array
    lane_lift: Array
    next_offset: Array
    biases: Array
    rewards: Array
    fell: NDArray[np.bool_]


@njit_borrowing
def act_together(
    requested: NDArray[np.float32],
    settings: Array,
    group: GroupArrays,
    inward: Pairs,
    outward: Pairs,
    bodies: WalkerBody,
    lanes: LaneArrays,
    account: Account,
    work: Workspace,
    seen: NDArray[np.float32],
) -> None:
    """One action of the first environments of the group; see `WalkingEnvironment.step`.

    It is long because rows and lanes are views of what single environments work in, and are made
    here.

    Parameters
    ----------
    requested : (environments, 25 or 26) of the policy; the biases are subtracted.
    settings : (5,) `action_limit`, `action_scale` in rad and `pace_scale` of `EnvironmentSettings`,
        the training's `tolerance_share`, and `entering` as in `take_action`.
    group : what the environments work with; rewards, falls and episodes are filled.
    inward, outward : pairs of rows (8, n) and lanes (n, 8) that hold the same before and after the
        physics steps.
    bodies, lanes : the walkers' bodies and what changes in them, as `advance_lanes` takes them.
    account : what the physics steps of this action record, see `physics_steps.Account`.
    work : arrays to work in.
    seen : (environments, size) out, the observations as the policy gets them.
    """
    episodes, yards = group.episodes, group.yardstick
    limit, scale, pace_scale, tolerance_share = settings[0], settings[1], settings[2], settings[3]
    entering = settings[4]
    count = requested.shape[0]
    for e in range(count):
        # This phase is still that of the observation that led to the action, which is mirrored if
        # that was.
        action, phase = episodes.action[e], group.phase[e, 0]
        mirrored = yards.mirrors and is_mirrored(phase)
        bias = group.biases[e, int(phase % 1.0 * group.biases.shape[1])]
        for i in range(requested.shape[1]):
            requested[e, i] -= bias[i]
        take_action(
            requested[e], limit, entering, group.shares[e], mirrored, action, episodes.before[e]
        )
        group.pace[e, 0] = 1.0 + pace_scale * action[ACTUATED_COUNT]
        for i in range(ACTUATED_COUNT):
            group.next_offset[e, i] = scale * action[i]
    for k in range(len(inward)):
        # Environments have rows, for which their own code works; lanes are columns, where eight
        # numbers of one kind are neighbours in memory. Both are copies of the same numbers.
        rows, columns = inward[k]
        for i in range(rows.shape[1]):
            for e in range(count):
                columns[i, e] = rows[e, i]
    advance_lanes(bodies, lanes, account, work)
    targets, outcome = yards.targets, in_lanes(group.outcome)
    outcome[0], outcome[1] = judge(
        in_lanes(bodies.tree),
        Yardstick(
            Targets(
                targets.positions, targets.velocities, targets.centre_of_mass,
                targets.end_effectors, targets.ground_reaction, targets.moments,
                in_lanes(targets.has_moment), in_lanes(targets.stride_length)[0],
                in_lanes(targets.speed)[0],
            ),
            in_lanes(yards.weights), in_lanes(yards.sharpness), in_lanes(yards.tolerances),
            in_lanes(yards.half_action)[0], in_lanes(yards.mass)[0], in_lanes(yards.weight)[0],
            yards.extended, yards.mirrors,
        ),
        in_lanes(lanes.walkers.state), in_lanes(lanes.phase)[0], in_lanes(lanes.pace)[0],
        in_lanes(group.lane_lift)[0],
        tolerance_share, in_lanes(lanes.walkers.ground), in_lanes(lanes.walkers.moments),
        in_lanes(lanes.walkers.squares), in_lanes(group.judged), in_lanes(group.work),
    )  # fmt: skip
    for k in range(len(outward)):
        rows, columns = outward[k]
        for e in range(count):
            for i in range(rows.shape[1]):
                rows[e, i] = columns[i, e]
    for e in range(count):
        lost = group.outcome[1, e] > 1.0
        group.rewards[e] = 0.0 if lost else group.outcome[0, e]
        group.fell[e] = group.outcome[1, e] > 0.0
        for i in range(episodes.terms.shape[1]):
            episodes.terms[e, i] = 0.0 if lost else group.judged.terms[i, e]
        observation = episodes.observation[e]
        if not lost:
            for i in range(observation.shape[0]):
                observation[i] = group.judged.observation[i, e]
        mirrored = yards.mirrors and is_mirrored(group.phase[e, 0])
        for i in range(seen.shape[1]):
            if mirrored:
                seen[e, i] = MIRROR_SIGNS[i] * observation[MIRROR_ORDER[i]]
            else:
                seen[e, i] = observation[i]


@njit
def _actions(
    action: NDArray[np.float32], settings: Array, group: GroupArrays, inward: Pairs, outward: Pairs,
    bodies: WalkerBody, lanes: LaneArrays, account: Account, work: Workspace,
    seen: NDArray[np.float32],
) -> Iterator[int]:  # fmt: skip
    """`act_together` each time it is asked for the next, until the tolerance share in `settings`
    (5,) is 0. A generator is handed its many arrays once, which took half as long as the physics.
    """
    while settings[3] > 0.0:
        act_together(action, settings, group, inward, outward, bodies, lanes, account, work, seen)
        yield 0


def _end(actions: Iterator[int], settings: Array) -> None:
    """End `_actions`: one that has not ended keeps its arrays for ever."""
    settings[3] = 0.0
    next(actions, None)


def _lane_yardstick(kinds: Sequence[Yardstick], which: Index) -> Yardstick:
    """The yardsticks `kinds[which[0]]`, … of eight walkers; see `GroupArrays`."""
    targets = [each.targets for each in kinds]

    def numbers(values: Sequence[Any]) -> Array:
        """Of every kind, as (…, 8)."""
        columns = np.array([np.atleast_1d(values[k]) for k in which], dtype=float).T
        found = aligned(columns.shape)
        found[:] = columns
        return found

    tables = [
        LaneTables(np.array([getattr(each, name) for each in targets]), which)
        for name in Targets._fields[:6]
    ]
    others = [numbers([getattr(each, name) for each in targets]) for name in Targets._fields[6:]]
    members = [numbers([getattr(each, name) for each in kinds]) for name in Yardstick._fields[1:7]]
    # What is seen is common to the group.
    return Yardstick._make([Targets._make([*tables, *others]), *members, *kinds[0][7:]])


def _rows(arrays: Any, row: int) -> Any:
    return type(arrays)(*(member[row] for member in arrays))


class WalkingGroup:
    """At most eight environments.

    Parameters
    ----------
    tasks : of the environments; they differ only in body, reference and contact.

    Attributes
    ----------
    environments : with all that an environment has.
    beside : their walkers, with an account of the last action.
    """

    def __init__(self, tasks: Sequence[WalkingTask]) -> None:
        constants, spheres = tasks[0].configuration.environment, len(tasks[0].model.spheres)
        walkers = walker_arrays(spheres, WIDTH)
        episodes = episode_arrays(constants, WIDTH)
        self.environments = [
            WalkingEnvironment(task, arrays=(_rows(walkers, e), _rows(episodes, e)))
            for e, task in enumerate(tasks)
        ]
        # A group of fewer is filled with copies of its first environment: the lanes are computed
        # anyway.
        every = self.environments + self.environments[:1] * (WIDTH - len(tasks))
        kinds = list({id(each.task): each.yardstick for each in every}.items())
        order = [key for key, _ in kinds]
        self.beside = SideBySide([each.walker for each in every])
        self._arrays = GroupArrays(
            walkers,
            episodes,
            _lane_yardstick(
                [yardstick for _, yardstick in kinds],
                np.array([order.index(id(each.task)) for each in every]),
            ),
            with_lanes(episode_arrays(constants)),
            with_lanes(measure_workspace()),
            aligned((2, WIDTH)),
            np.array([each.shares for each in every]),
            np.zeros((WIDTH, 1)), np.ones((WIDTH, 1)), np.zeros((WIDTH, 1)), aligned((1, WIDTH)),
            np.zeros((WIDTH, ACTUATED_COUNT)),
            np.zeros((WIDTH, HABIT_PHASES, action_size(constants))),
            np.zeros(WIDTH), np.zeros(WIDTH, dtype=bool),
        )  # fmt: skip
        self._walkers = [each.walker for each in self.environments]
        self._immediate = self.environments[0].senses.immediate
        self._pushed: list[WalkingEnvironment] = []
        self._mu = [each.walker.mu for each in every]
        self._settings, self._requested, self._seen = (
            np.array(
                [
                    *(constants.action_limit, constants.action_scale, constants.pace_scale, 1.0),
                    self.environments[0].entering,
                ]
            ),
            np.zeros((len(tasks), action_size(constants)), dtype=np.float32),
            np.zeros((len(tasks), len(every[0].episode.observation)), dtype=np.float32),
        )
        self._actions = _actions(
            self._requested, self._settings, self._arrays, *self._pairs(),
            self.beside.bodies, self.beside.arrays, self.beside.account, self.beside.work,
            self._seen,
        )  # fmt: skip
        weakref.finalize(self, _end, self._actions, self._settings)

    def _pairs(self) -> tuple[Pairs, Pairs]:
        rows, lanes = self._arrays, self.beside.arrays

        def pair(row: Array, columns: Array) -> tuple[Array, Array]:
            return row.reshape(WIDTH, -1), columns.reshape(-1, WIDTH)

        moving = (
            pair(rows.walkers.state, lanes.walkers.state),
            pair(rows.walkers.memory, lanes.walkers.memory),
            pair(rows.phase, lanes.phase),
        )
        action = (
            pair(rows.walkers.offset, lanes.walkers.offset),
            pair(rows.next_offset, lanes.next_offset),
            pair(rows.episodes.root_force, lanes.root_force),
            pair(rows.pace, lanes.pace),
            pair(rows.lift, rows.lane_lift),
            pair(rows.episodes.action, rows.judged.action),
            pair(rows.episodes.before, rows.judged.before),
            pair(rows.episodes.parameters, rows.judged.parameters),
        )
        after = (
            pair(rows.walkers.offset, lanes.next_offset),
            pair(rows.walkers.ground, lanes.walkers.ground),
            pair(rows.walkers.moments, lanes.walkers.moments),
            pair(rows.walkers.squares, lanes.walkers.squares),
            pair(rows.episodes.errors, rows.judged.errors),
        )
        return moving + action, moving + after

    def reset(
        self, e: int, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Start an episode of environment `e`, with `seed` and `options` as its own `reset` takes
        them; gives its observation.
        """
        environment, arrays = self.environments[e], self._arrays
        observation, _ = environment.reset(seed=seed, options=options)
        self._pushed = [each for each in self.environments if each.is_pushed]
        walker = environment.walker
        # By identity, which is enough: a walker keeps its array of parameters until they change.
        if walker.mu is not self._mu[e]:
            self._mu[e] = walker.mu
            self.beside.enter_body(e, walker)
        arrays.phase[e, 0], arrays.lift[e, 0] = walker.phase, environment.lift
        return observation

    def centre(self, policy: Act, mu: Array, *, key: str | None = None) -> None:
        """`WalkingEnvironment.centre` of all, with `policy`, `mu` and `key` as there; environments
        of one task have the same action bias.
        """
        found: dict[int, Array] = {}
        for e, environment in enumerate(self.environments):
            if id(environment.task) not in found:
                environment.centre(policy, mu, key=key)
                found[id(environment.task)] = environment.habits()
            self._arrays.biases[e] = found[id(environment.task)]

    def step(
        self, action: NDArray[np.float32], seen: NDArray[np.float32]
    ) -> tuple[Array, NDArray[np.bool_]]:
        """An action of every environment, as `action` (environments, A) by the policy; what
        `centre` found is subtracted, and `seen` (environments, size) is out. Returns reward, and
        whether it fell: (environments,) each.
        """
        group, count = self._arrays, len(self.environments)
        for environment in self._pushed:
            environment.push()
        self._requested[:], self._settings[3] = action, self.environments[0].tolerance_share
        next(self._actions)
        for walker, phase in zip(self._walkers, group.phase[:count, 0].tolist(), strict=True):
            walker.phase = phase
        if self._immediate:
            seen[:] = self._seen
        else:
            for e, environment in enumerate(self.environments):
                seen[e] = environment.told()
        return group.rewards[:count], group.fell[:count]

    @property
    def phases(self) -> Array:
        """(environments,) of the right gait cycle."""
        return self._arrays.phase[: len(self.environments), 0]

    @property
    def errors(self) -> Array:
        """Errors (environments, 12) after the last action, see `reward.ERRORS`."""
        return self._arrays.episodes.errors[: len(self.environments)]

    @property
    def terms(self) -> Array:
        """Reward terms (environments, 10) of the last action."""
        return self._arrays.episodes.terms[: len(self.environments)]
