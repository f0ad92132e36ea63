"""Eight walking environments that act at the same time, their walkers side by side.

An environment of a group does, bit for bit, what it does alone. Its arrays are rows of the group's,
so it resets and pushes itself; an action of all eight is one compiled call.
"""

import weakref
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array, Index
from gaitval.compiled import njit
from gaitval.lanes import WIDTH
from gaitval.model.tree import ACTUATED_COUNT, Tree
from gaitval.policy.environment import (
    HABIT_PHASES,
    Act,
    WalkingEnvironment,
    action_size,
    episode_arrays,
)
from gaitval.policy.judgement import EpisodeArrays, Yardstick, judge, take_action
from gaitval.policy.observation import MIRROR_ORDER, MIRROR_SIGNS, Targets, is_mirrored
from gaitval.simulation.physics_steps import Account, Workspace
from gaitval.simulation.side_by_side import LaneArrays, LaneBodies, SideBySide, advance_lanes
from gaitval.simulation.walker import WalkerArrays, WalkingTask, walker_arrays

Pairs = tuple[tuple[Array, Array], ...]


class GroupArrays(NamedTuple):
    """What an action of the group works with, one row an environment.

    Attributes
    ----------
    walkers, episodes : the environments' own arrays.
    trees : (8, …) the walkers' bodies; the spheres' segments are common.
    yardsticks : (tasks, …) of every task, and `which` (8,) an environment has.
    shares : (8, 26) as in `take_action`.
    phase, pace : (8, 1).
    next_offset : (8, 25) rad.
    lift : (8,) m.
    rewards, fell : (8,) of the action.
    """

    walkers: WalkerArrays
    episodes: EpisodeArrays
    trees: Tree
    yardsticks: Yardstick
    which: Index
    shares: Array
    phase: Array
    pace: Array
    next_offset: Array
    lift: Array
    rewards: Array
    fell: NDArray[np.bool_]


class GroupSettings(NamedTuple):
    """Numbers of `EnvironmentSettings` that an action needs (`action_limit`, `action_scale` in rad,
    `pace_scale`), and the training's `tolerance_share`.
    """

    action_limit: float
    action_scale: float
    pace_scale: float
    tolerance_share: float


@njit
def act_together(
    asked: NDArray[np.float32],
    settings: GroupSettings,
    group: GroupArrays,
    inward: Pairs,
    outward: Pairs,
    bodies: LaneBodies,
    lanes: LaneArrays,
    account: Account,
    work: Workspace,
    seen: NDArray[np.float32],
) -> None:
    """One action of the first environments of the group; see `WalkingEnvironment.step`.

    It is long because the eight rows and the eight lanes are views of what single environments work
    in, and are made here.

    Parameters
    ----------
    asked : (environments, 25 or 26) of the policy.
    settings : limits and scales of an action.
    group : what the environments work with; rewards, falls and episodes are filled.
    inward, outward : pairs of rows (8, n) and lanes (n, 8) that hold the same before and after the
        physics steps.
    bodies, lanes : the walkers' bodies and what changes in them, as `advance_lanes` takes them.
    account : what the physics steps of this action record, see `physics_steps.Account`.
    work : arrays to work in.
    seen : (environments, size) out, the observations as the policy gets them.
    """
    episodes, walkers, trees = group.episodes, group.walkers, group.trees
    yards: Any = group.yardsticks  # its numbers are arrays here
    targets, mirrors = yards.targets, yards.mirrors
    count = asked.shape[0]
    for e in range(count):
        action = episodes.action[e]
        # An action is mirrored if the observation that led to it was: this phase is still that of
        # before.
        mirrored = mirrors and is_mirrored(group.phase[e, 0])
        take_action(
            asked[e], settings.action_limit, group.shares[e], mirrored, action, episodes.before[e]
        )
        group.pace[e, 0] = 1.0 + settings.pace_scale * action[ACTUATED_COUNT]
        for i in range(ACTUATED_COUNT):
            group.next_offset[e, i] = settings.action_scale * action[i]
    for k in range(len(inward)):
        # Environments have rows, for which their own code works; lanes are columns, where eight
        # numbers of one kind are neighbours in memory. Both are copies of the same numbers.
        rows, columns = inward[k]
        for i in range(rows.shape[1]):
            for e in range(count):
                columns[i, e] = rows[e, i]
    advance_lanes(bodies, lanes, account, work)
    for k in range(len(outward)):
        rows, columns = outward[k]
        for e in range(count):
            for i in range(rows.shape[1]):
                rows[e, i] = columns[i, e]
    for e in range(count):
        task = group.which[e]
        # numba cannot index all members of a named tuple at once, so each array's row is taken by
        # hand.
        tree = Tree(
            trees.joint_position[e], trees.mass[e], trees.centre_of_mass[e], trees.inertia[e],
            trees.sphere_segment, trees.sphere_position[e], trees.sphere_radius[e],
        )  # fmt: skip
        yardstick = Yardstick(
            Targets(
                targets.positions[task], targets.velocities[task], targets.centre_of_mass[task],
                targets.end_effectors[task], targets.ground_reaction[task], targets.moments[task],
                targets.has_moment[task], targets.stride_length[task], targets.speed[task],
            ),
            yards.weights[task], yards.sharpness[task], yards.tolerances[task],
            yards.half_action[task], yards.mass[task], yards.weight[task],
            yards.extended, yards.mirrors,
        )  # fmt: skip
        episode = EpisodeArrays(
            episodes.action[e], episodes.before[e], episodes.parameters[e], episodes.observation[e],
            episodes.errors[e], episodes.terms[e], episodes.root_force[e],
        )  # fmt: skip
        phase = group.phase[e, 0]
        group.rewards[e], group.fell[e] = judge(
            tree, yardstick, walkers.state[e], phase, group.pace[e, 0], group.lift[e],
            settings.tolerance_share, walkers.ground[e], walkers.moments[e], walkers.squares[e],
            episode,
        )  # fmt: skip
        observation = episode.observation
        mirrored = mirrors and is_mirrored(phase)
        for i in range(seen.shape[1]):
            if mirrored:
                seen[e, i] = MIRROR_SIGNS[i] * observation[MIRROR_ORDER[i]]
            else:
                seen[e, i] = observation[i]


@njit
def _actions(
    asked: NDArray[np.float32], settings: Array, group: GroupArrays, inward: Pairs, outward: Pairs,
    bodies: LaneBodies, lanes: LaneArrays, account: Account, work: Workspace,
    seen: NDArray[np.float32],
) -> Iterator[int]:  # fmt: skip
    """`act_together` each time it is asked for the next, until the tolerance share in `settings`
    (4,) is 0. A generator is handed its many arrays once, which took half as long as the physics.
    """
    while settings[3] > 0.0:
        act_together(
            asked, GroupSettings(settings[0], settings[1], settings[2], settings[3]), group,
            inward, outward, bodies, lanes, account, work, seen,
        )  # fmt: skip
        yield 0


def _end(actions: Iterator[int], settings: Array) -> None:
    """End `_actions`: one that has not ended keeps its arrays for ever."""
    settings[3] = 0.0
    next(actions, None)


def _stacked(values: Sequence[Any]) -> Any:
    """Named tuples of arrays and numbers as one, with a leading axis; truth values are common."""
    first = values[0]
    if isinstance(first, tuple):
        return type(first)(*(_stacked(members) for members in zip(*values, strict=True)))
    # Truth values say of which kind observations are, which is common to the group.
    return first if isinstance(first, bool) else np.array(values, dtype=float)


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
        trees = _stacked([each.walker.tree for each in every])
        self.beside = SideBySide([each.walker for each in every])
        self._arrays = GroupArrays(
            walkers,
            episodes,
            trees._replace(sphere_segment=every[0].walker.tree.sphere_segment),
            _stacked([yardstick for _, yardstick in kinds]),
            np.array([order.index(id(each.task)) for each in every]),
            np.array([each.shares for each in every]),
            np.zeros((WIDTH, 1)), np.ones((WIDTH, 1)), np.zeros((WIDTH, ACTUATED_COUNT)),
            np.zeros(WIDTH), np.zeros(WIDTH), np.zeros(WIDTH, dtype=bool),
        )  # fmt: skip
        self._habits = np.zeros((len(tasks), HABIT_PHASES, action_size(constants)))
        self._lanes = np.arange(len(tasks))
        self._mu = [each.walker.mu for each in every]
        self._settings, self._asked, self._seen = (
            np.array([constants.action_limit, constants.action_scale, constants.pace_scale, 1.0]),
            np.zeros((len(tasks), action_size(constants)), dtype=np.float32),
            np.zeros((len(tasks), len(every[0].episode.observation)), dtype=np.float32),
        )
        self._actions = _actions(
            self._asked, self._settings, self._arrays, *self._pairs(),
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
        asked = (
            pair(rows.walkers.offset, lanes.walkers.offset),
            pair(rows.next_offset, lanes.next_offset),
            pair(rows.episodes.root_force, lanes.root_force),
            pair(rows.pace, lanes.pace),
        )
        after = (
            pair(rows.walkers.offset, lanes.next_offset),
            pair(rows.walkers.ground, lanes.walkers.ground),
            pair(rows.walkers.moments, lanes.walkers.moments),
            pair(rows.walkers.squares, lanes.walkers.squares),
        )
        return moving + asked, moving + after

    def reset(
        self, e: int, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Start an episode of environment `e`, with `seed` and `options` as its own `reset` takes
        them; gives its observation.
        """
        environment, arrays = self.environments[e], self._arrays
        observation, _ = environment.reset(seed=seed, options=options)
        walker = environment.walker
        # By identity, which is enough: a walker keeps its array of parameters until they change.
        if walker.mu is not self._mu[e]:
            self._mu[e] = walker.mu
            self.beside.enter_body(e, walker)
            for rows, values in zip(arrays.trees, walker.tree, strict=True):
                if rows.dtype == float:
                    rows[e] = values
        arrays.phase[e, 0], arrays.lift[e] = walker.phase, environment.lift
        return observation

    def centre(self, policy: Act, mu: Array, *, key: str | None = None) -> None:
        """`WalkingEnvironment.centre` of all, with `policy`, `mu` and `key` as there; environments
        of one task have the same action bias.

        `step` takes the actions as they are; `habit` is what a walk subtracts from them.
        """
        found: dict[int, Array] = {}
        for environment in self.environments:
            if id(environment.task) not in found:
                environment.centre(policy, mu, key=key)
                found[id(environment.task)] = environment.habits()
        self._habits[:] = [found[id(environment.task)] for environment in self.environments]

    def habit(self) -> Array:
        """The action bias at the phases that the walkers have now, (environments, A)."""
        rows = (self.phases % 1.0 * HABIT_PHASES).astype(int)
        return np.asarray(self._habits[self._lanes, rows])

    def step(
        self, asked: NDArray[np.float32], seen: NDArray[np.float32]
    ) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
        """An action of every environment.

        Parameters
        ----------
        asked : (environments, A).
        seen : (environments, size) out.

        Returns
        -------
        Reward, whether it fell, and whether the episode has its full length: (environments,) each.
        """
        group, count = self._arrays, len(self.environments)
        for environment in self.environments:
            environment.push()
        self._asked[:], self._settings[3] = asked, self.environments[0].tolerance_share
        next(self._actions)
        seen[:] = self._seen
        over = np.zeros(count, dtype=bool)
        for e, (environment, phase) in enumerate(
            zip(self.environments, group.phase[:, 0].tolist(), strict=False)
        ):
            environment.walker.phase = phase
            over[e] = environment.counted()
        return group.rewards[:count], group.fell[:count], over

    @property
    def phases(self) -> Array:
        """(environments,) of the right gait cycle."""
        return self._arrays.phase[: len(self.environments), 0]

    @property
    def terms(self) -> Array:
        """Reward terms (environments, 10) of the last action."""
        return self._arrays.episodes.terms[: len(self.environments)]
