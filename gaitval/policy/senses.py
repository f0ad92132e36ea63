"""What a policy is told of its body: by nerves, late and with noise, and what it did meanwhile.

Three paths, each with its own delay: what is felt of joints, feet and ground, what the balance
organ tells of turning, and what is seen of the body's path. What the policy knows by itself, its
clock, its body and its last action, is of now. To bridge the delay it may be told its own past
actions, as means over windows of `WINDOW`: a body's forward model needs what was asked of it since.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array, Index
from gaitval.configuration import EnvironmentSettings
from gaitval.policy.observation import (
    ACTION_COUNT,
    ACTION_ORDER,
    ACTION_SIGNS,
    MIRROR_ORDER,
    MIRROR_SIGNS,
    OBSERVATION_SIZES,
    OBSERVED,
)

WINDOW: Final = 0.05
"""s, over which past actions are averaged."""
PATHS: Final = (
    ("joint_angles", "joint_velocities", "feet", "ground_reaction"),
    ("angular_velocity", "pelvis_rotation", "pelvis_angular_velocity"),
    ("centre_of_mass_velocity", "pelvis_position", "pelvis_velocity"),
)
"""Parts of an observation that come by proprioception and touch, by the balance organ, by vision,
in the order of `EnvironmentSettings.observation_delays`."""


def windows(constants: EnvironmentSettings) -> int:
    """Windows of past actions in an observation."""
    return round(constants.action_memory / WINDOW)


def observation_size(constants: EnvironmentSettings) -> int:
    """Numbers that a policy is told with these `constants`."""
    return int(OBSERVATION_SIZES[constants.observation]) + ACTION_COUNT * windows(constants)


def path_places(size: int) -> tuple[Index, ...]:
    """Of each of `PATHS`, its places in an observation of this `size`."""
    return tuple(
        np.array([i for name in path for i in range(*OBSERVED[name].indices(size))], dtype=int)
        for path in PATHS
    )


class Senses:
    """Of one walker.

    Parameters
    ----------
    constants : delays, noise and memory.
    action_seconds : s, of an action; delays are rounded to whole ones.

    Attributes
    ----------
    immediate : what is told is the body as it is now, and nothing else.
    delays : (3,) actions by which each path is late.
    """

    def __init__(self, constants: EnvironmentSettings, action_seconds: float) -> None:
        size, count = OBSERVATION_SIZES[constants.observation], windows(constants)
        self.delays = tuple(round(each / action_seconds) for each in constants.observation_delays)
        self._noise = constants.observation_noise
        self.immediate = not (any(self.delays) or self._noise or count)
        places = path_places(size)
        self._felt = np.concatenate(places)
        self._late = np.zeros(size, dtype=int)
        for path, late in zip(places, self.delays, strict=True):
            self._late[path] = late
        self._every = np.arange(size)
        # Before which action each window ends, counted back; the last is where the oldest begins.
        self._ends = np.array(
            [round(n * WINDOW / action_seconds) for n in range(count + 1)], dtype=int
        )
        self._length = max(*self.delays, int(self._ends[-1])) + 1
        self._seen = np.zeros((self._length, size))
        self._sums = np.zeros((self._length, ACTION_COUNT))
        self._spans = np.maximum(np.diff(self._ends), 1)[:, None]
        self._now = 0
        self._fresh = True
        self._order = np.concatenate(
            [MIRROR_ORDER] + [size + n * ACTION_COUNT + ACTION_ORDER for n in range(count)]
        )
        self._signs = np.concatenate([MIRROR_SIGNS] + [ACTION_SIGNS] * count)

    def forget(self) -> None:
        """Begin an episode: what is seen next was always so, and nothing was done before."""
        self._fresh, self._now = True, 0

    def told(
        self, seen: Array, action: Array, mirrored: bool, random: np.random.Generator
    ) -> NDArray[np.float32]:
        """What the policy is told, in the mirror image if `mirrored`, where the body is `seen`
        (size,) and the last `action` (26,) acts, neither of them mirrored; noise is drawn by
        `random`. To be called once an action.
        """
        if self.immediate:
            return (MIRROR_SIGNS * seen[MIRROR_ORDER] if mirrored else seen).astype(np.float32)
        self._now += 1
        row = self._now % self._length
        if self._fresh:
            self._seen[:], self._sums[:], self._fresh = seen, 0.0, False
        else:
            self._seen[row] = seen
            self._sums[row] = self._sums[row - 1] + action
        found = self._seen[(self._now - self._late) % self._length, self._every]
        if self._noise:
            found[self._felt] += self._noise * random.standard_normal(len(self._felt))
        if len(self._spans):
            sums = self._sums[(self._now - self._ends) % self._length]
            means = (sums[:-1] - sums[1:]) / self._spans
            found = np.concatenate([found, means.ravel()])
        if mirrored:
            found = self._signs * found[self._order]
        return np.asarray(found, dtype=np.float32)
