"""Walks that are alike until they are pushed: where one was then, the next one begins."""

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.policy.environment import WalkingEnvironment
from gaitval.simulation.walker import Steps, Trajectory


class _Place(NamedTuple):
    """Where a walk was: what its next action begins with, and how it came there."""

    actions: int
    phase: float
    arrays: list[Array]
    seen: NDArray[np.float32]
    steps: Steps


class SettledWalks:
    """Places of the walks of one environment that begin alike, by the phase of a push to come.

    A walk that begins at one of them goes on bit for bit as if it had walked there.
    """

    def __init__(self) -> None:
        self._places: dict[float, _Place] = {}

    def resume(
        self, environment: WalkingEnvironment, push: float, recording: Trajectory
    ) -> tuple[int, NDArray[np.float32]] | None:
        """Put an `environment` that was reset, and an empty `recording`, to the last place that is
        known before the phase of its `push`: how many actions it took, and what is seen there. None
        if there is none.
        """
        known = [phase for phase in self._places if phase <= push]
        if not known:
            return None
        place = self._places[max(known)]
        for array, value in zip(_arrays(environment), place.arrays, strict=True):
            array[:] = value
        environment.walker.move_to(place.phase)
        recording.extend(place.steps)
        return place.actions, place.seen.copy()

    def keep(
        self,
        environment: WalkingEnvironment,
        push: float,
        recording: Trajectory,
        actions: int,
        seen: NDArray[np.float32],
    ) -> None:
        """Remember where `environment` is after so many `actions`, as the one with the `push` at
        this phase begins, and what is `seen` there; unless it is known.
        """
        if push not in self._places:
            self._places[push] = _Place(
                actions, environment.walker.phase, [each.copy() for each in _arrays(environment)],
                seen.copy(), Steps(*(each.copy() for each in recording.steps())),
            )  # fmt: skip


def _arrays(environment: WalkingEnvironment) -> list[Array]:
    """All that an action begins with, beside what a reset sets."""
    return [*environment.walker.arrays, *environment.episode]


_known: WeakKeyDictionary[WalkingEnvironment, dict[object, SettledWalks]] = WeakKeyDictionary()


def settled_walks(environment: WalkingEnvironment, *about: object) -> SettledWalks | None:
    """Those of an `environment` and of all else that they begin with; None if what is seen late is
    not kept with them, and in MuJoCo, whose own coordinates round when they are set.
    """
    if not environment.senses.immediate or environment.walker.engine == "mujoco":
        return None
    return _known.setdefault(environment, {}).setdefault(about, SettledWalks())
