"""`gaitval/Walker-v0` for Gymnasium: learn to walk as a person walks, alone or eight side by side.

Gymnasium 1 finds no environments of other packages by itself. Import this module, which registers
it, or give the module in the name; both do the same:

    import gaitval.apps.export.environment
    gymnasium.make("gaitval/Walker-v0", walker="5")
    gymnasium.make("gaitval.apps.export.environment:gaitval/Walker-v0", walker="5")
    gymnasium.make_vec("gaitval.apps.export.environment:gaitval/Walker-v0", num_envs=8, walker="5")
"""

from collections.abc import Sequence
from functools import cache
from typing import Any, Final

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from gaitval._internal.numba.lanes import WIDTH
from gaitval.apps.export.observation_bounds import observation_bounds
from gaitval.apps.export.walked import ExportedWalk
from gaitval.arrays import Array
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.walking_group import WalkingGroup

NAME: Final = "gaitval/Walker-v0"

_Seen = NDArray[np.float32]
_Info = dict[str, Any]


@cache
def _walked(walker: str) -> ExportedWalk:
    """The reference of a person takes seconds, so environments of one process share it."""
    return ExportedWalk.of(walker)


def _defaults(walked: ExportedWalk, *, pushes: bool, vary_body: bool) -> _Info:
    """Options of a reset that the user did not give."""
    found: _Info = {} if pushes else {"push": None}
    return found if vary_body else found | {"mu": walked.mu}


def _bounded(
    environment: WalkingEnvironment, walked: ExportedWalk
) -> "gymnasium.spaces.Box[np.float32]":
    low, high = observation_bounds(environment, walked.mu)
    return gymnasium.spaces.Box(low, high, dtype=np.float32)


class WalkerEnvironment(WalkingEnvironment):
    """The task that a stored walker was validated on, with the identified body.

    Observation, action, reward and the options of `reset` are those of `WalkingEnvironment`, but
    observations are clipped at what a body can do (`observation_bounds`). An action of zeros
    follows the reference with the joints' servos alone, and falls within seconds.

    Parameters
    ----------
    walker : subject with a stored policy ("5", "S05"), run folder, or folder of `gaitval export
        --to gymnasium`.
    pushes : whether the pelvis is pushed at random.
    vary_body : whether every episode has another body, drawn as in gaitval's own training; else all
        have the identified one.
    render_mode : None; there is no other.

    Raises
    ------
    PolicyError, SubjectError : there is no such walker.
    """

    def __init__(
        self,
        walker: str = "5",
        *,
        pushes: bool = False,
        vary_body: bool = False,
        render_mode: str | None = None,
    ) -> None:
        found = _walked(walker)
        super().__init__(found.stored.corrected_task)
        self.render_mode = render_mode
        self._defaults = _defaults(found, pushes=pushes, vary_body=vary_body)
        self._bounds = self.observation_space = _bounded(self, found)

    def told(self) -> _Seen:
        """What the policy gets, within the space that is said."""
        return np.clip(super().told(), self._bounds.low, self._bounds.high)

    def reset(
        self, *, seed: int | None = None, options: _Info | None = None
    ) -> tuple[_Seen, _Info]:
        """As `WalkingEnvironment.reset`, without push and with the identified body by default."""
        return super().reset(seed=seed, options=self._defaults | (options or {}))


class WalkerVector(VectorEnv[_Seen, _Seen, NDArray[Any]]):
    """Walkers of `WalkerEnvironment` side by side: eight take the time of about two.

    Each does, bit for bit, what it does alone. One that falls, or whose episode is over, starts
    again within the same step (`AutoresetMode.SAME_STEP`): `info["final_obs"]` and
    `info["final_info"]` have how it ended.

    Parameters
    ----------
    num_envs : how many; computed in groups of eight, so that a multiple of eight wastes nothing.
    walker, pushes, vary_body, render_mode : as `WalkerEnvironment` takes them, the same for all.
    """

    metadata = WalkingEnvironment.metadata | {"autoreset_mode": AutoresetMode.SAME_STEP}

    def __init__(
        self,
        num_envs: int = WIDTH,
        walker: str = "5",
        *,
        pushes: bool = False,
        vary_body: bool = False,
        render_mode: str | None = None,
    ) -> None:
        found = _walked(walker)
        task = found.stored.corrected_task
        self.num_envs, self.render_mode = num_envs, render_mode
        self._groups = [
            WalkingGroup([task] * min(WIDTH, num_envs - first))
            for first in range(0, num_envs, WIDTH)
        ]
        self._environments = [each for group in self._groups for each in group.environments]
        one = self._environments[0]
        self.single_observation_space = self._bounds = _bounded(one, found)
        self.single_action_space = one.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._defaults = _defaults(found, pushes=pushes, vary_body=vary_body)
        self._observed = np.zeros((num_envs, *self._bounds.shape), dtype=np.float32)

    def _start(self, e: int, seed: int | None = None, options: _Info | None = None) -> None:
        """A new episode of the environment `e`."""
        self._observed[e] = self._groups[e // WIDTH].reset(
            e % WIDTH, seed=seed, options=self._defaults | (options or {})
        )

    def told(self) -> _Seen:
        """What the policies of all get, within the space that is said."""
        return np.clip(self._observed, self._bounds.low, self._bounds.high)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: _Info | None = None,
    ) -> tuple[_Seen, _Info]:
        """Start all; `seed` is of the first and counts on, or one for each; `options` for all."""
        if seed is None or isinstance(seed, int):
            seed = [None if seed is None else seed + e for e in range(self.num_envs)]
        for e, each in zip(range(self.num_envs), seed, strict=True):
            self._start(e, each, options)
        return self.told(), {}

    def step(
        self, actions: _Seen
    ) -> tuple[_Seen, Array, NDArray[np.bool_], NDArray[np.bool_], _Info]:
        """An action (num_envs, A) of each; what a step gives, and `info`, with a row each."""
        results = []
        for g, group in enumerate(self._groups):
            rows = slice(g * WIDTH, g * WIDTH + len(group.environments))
            reward, fell = group.step(actions[rows], self._observed[rows])
            start = [each.start_phase for each in group.environments]
            results.append((reward, fell, group.errors, group.terms, group.phases - start))
        # Copies: the groups' arrays are filled again by the next action.
        rewards, fell, errors, terms, cycles = map(np.concatenate, zip(*results, strict=True))
        over = np.array([each.counted() for each in self._environments])
        ended = fell | over
        info = {"errors": errors, "reward_terms": terms, "cycles": cycles}
        found: _Info = {f"_{name}": ~ended for name in info}
        last = self.told()
        for e in np.flatnonzero(ended):
            about = {name: values[e].copy() for name, values in info.items()}
            found = self._add_info(found, {"final_obs": last[e], "final_info": about}, int(e))
            self._start(int(e))
            for values in info.values():
                values[e] = 0.0
        return self.told(), rewards, fell, over, found | info


if NAME not in gymnasium.registry:
    gymnasium.register(
        NAME,
        entry_point=f"{__name__}:{WalkerEnvironment.__name__}",
        vector_entry_point=f"{__name__}:{WalkerVector.__name__}",
    )
