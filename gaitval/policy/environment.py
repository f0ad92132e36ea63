"""The walking task as a Gymnasium environment.

State, action and reward follow the paper (sections III-A, equations 1 and 2) with the decisions of
docs/paper.md: bounded reward kernels (`reward`), an `extended` observation as well as the
paper's 71 numbers (`observation`), early termination on the pelvis' height, rotation and drift.
"""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.configuration import EnvironmentSettings
from gaitval.coordinates import ACTUATED, ARM
from gaitval.model.body import SEGMENTS
from gaitval.model.parameters import PARAMETERS, nominal_parameters, parameter_bounds
from gaitval.model.tree import ACTUATED_COUNT, COORDINATE_COUNT, ROOT_DOFS
from gaitval.policy.judgement import judge, take_action
from gaitval.policy.observation import (
    ACTION_COUNT,
    OBSERVATION_SIZES,
    EpisodeArrays,
    Yardstick,
    is_mirrored,
    measure_workspace,
    targets_of,
)
from gaitval.policy.reward import ERRORS, REWARD_TERMS, reward_numbers
from gaitval.policy.senses import Senses, observation_size
from gaitval.walk.simulation.tables import read_row
from gaitval.walk.simulation.walker import Engine, Trajectory, Walker, WalkerArrays, WalkingTask

Act = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""A policy: observation to action, or many in rows."""

HABIT_PHASES = 100
"""Phases of the cycle at which a policy's action bias is known, see `WalkingEnvironment.centre`; a
multiple of four, so that none is used on both sides of the mirror's seam."""

_TOLERANCES = "height", "rotation", "drift"


def action_size(constants: EnvironmentSettings) -> int:
    """Size of an action in an environment with these `constants`: one number per joint, and the
    pace, which the policy chooses unless `pace_scale` is 0.
    """
    return len(ACTUATED) + (constants.pace_scale > 0.0)


def episode_arrays(constants: EnvironmentSettings, *many: int) -> EpisodeArrays:
    """Arrays of one environment or of several, all zero: `constants` decide the size of the
    observation, `many` is the number of environments, as leading axes; none for a single one.
    """
    seen = OBSERVATION_SIZES[constants.observation]
    errors, terms = len(ERRORS), len(REWARD_TERMS)
    sizes = ACTION_COUNT, ACTION_COUNT, len(PARAMETERS), seen, errors, terms, ROOT_DOFS
    return EpisodeArrays(*(np.zeros((*many, size)) for size in sizes))


class WalkingEnvironment(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Walk like the reference.

    Action: 25 numbers; times `action_scale` they are the offsets (rad) of the joint targets from
    the reference. Unless `pace_scale` is 0 there is a 26th; times `pace_scale` it is added to the
    pace of 1 at which the walker moves through the recorded cycle. Observation: see
    `EnvironmentSettings.observation`. `info` of every step contains `errors` (12,), `reward_terms`
    (10,) and `cycles`, the gait cycles walked since the start.

    Reset options: `phase` (else uniform over the cycle: reference-state initialisation), `mu` (14,)
    (else random within the bounds), `push` = (phase after which it starts, force N, direction rad
    from straight ahead, left positive) or None for no push, `noise` (standard deviation of the
    initial joint angles, rad).

    Parameters
    ----------
    task : body, reference and constants.
    engine : physics engine, see `Walker`.
    arrays : to work in, all zero; new ones if None.

    Attributes
    ----------
    difficulty : 0 to 1, the fraction of the ranges of mu and pushes that values are drawn from; the
        training raises it.
    tolerance_share : fraction of the tolerances of height, rotation and drift at which an episode
        ends; the training starts with less than 1.
    walker : the simulated body.
    yardstick, shares, entering, lift : as `judgement` takes them.
    senses : what the policy is told.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 (Gymnasium's own form)

    def __init__(
        self,
        task: WalkingTask,
        *,
        engine: Engine = "compiled",
        arrays: tuple[WalkerArrays, EpisodeArrays] | None = None,
    ) -> None:
        configuration = task.configuration
        self.task = task
        self.constants = configuration.environment
        self.walker = Walker(task, engine=engine, arrays=None if arrays is None else arrays[0])
        self.episode = episode_arrays(self.constants) if arrays is None else arrays[1]
        self.difficulty = 1.0
        self.tolerance_share = 1.0
        self._work = measure_workspace()
        self._extended = self.constants.observation == "extended"
        self._mirrors = self._extended and self.constants.mirror
        size = observation_size(self.constants)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (size,), np.float32)
        limit = self.constants.action_limit
        self._requested = np.zeros(action_size(self.constants), dtype=np.float32)
        self.action_space = gymnasium.spaces.Box(-limit, limit, self._requested.shape, np.float32)
        self._made_for = task.reference_body
        tolerances = [getattr(self.constants, f"{name}_tolerance") for name in _TOLERANCES]
        self.yardstick = Yardstick(
            targets_of(task.reference, task.model), *reward_numbers(configuration.reward),
            np.array(tolerances, dtype=float),
            0.5 * self.walker.action_seconds / task.reference.stride_time,
            task.model.mass, self.walker.weight, self._extended, self._mirrors,
        )  # fmt: skip
        self._lower, self._upper = parameter_bounds(configuration.randomisation)
        self._nominal = nominal_parameters()
        self._middle = 0.5 * (self._lower + self._upper)
        # The floor keeps a parameter that is not varied, with equal bounds, from dividing by zero.
        self._half_range = np.maximum(0.5 * (self._upper - self._lower), 1e-9)
        self._shift = _shift_of(task)
        self.episode.parameters[:] = self._nominal
        # The last share is the pace's.
        self.shares = np.array([self._share_of(name) for name in ACTUATED] + [1.0])
        self.entering = self.constants.entering(self.walker.action_seconds)
        self._steps = 0
        self.senses = Senses(self.constants, self.walker.action_seconds)
        self._longest = round(self.constants.episode_seconds / self.walker.action_seconds)
        self._push: tuple[float, float, float] | None = None
        self._pushed_again = False
        self._push_left = 0.0
        self._pushing = False
        """Whether the last action was in a push."""
        self.start_phase = 0.0
        self.lift = 0.0
        self._habit: Array | None = None
        self._habit_of: tuple[str, bytes] | None = None

    def _share_of(self, name: str) -> float:
        """Fraction of an action's offset that reaches a joint."""
        # Lumbar names have no side, and lose their last word here; none is then taken for an arm.
        joint, _ = name.rsplit("_", 1)
        return self.constants.arm_share if joint in ARM else 1.0

    def _random_parameters(self) -> Array:
        drawn = self.np_random.uniform(self._lower, self._upper)
        around = self._nominal + self.difficulty * (drawn - self._nominal)
        return np.asarray(around + self._shift, dtype=float)

    def _random_push(self, earliest: float, latest: float) -> tuple[float, float, float]:
        from gaitval.policy.random_pushes import random_push

        return random_push(self.np_random, self.constants, self.difficulty, earliest, latest)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start in a state of the reference; see the class for `options`. `seed` is of the
        environment's random numbers; None continues with them. Returns the observation, and an
        empty dictionary.
        """
        super().reset(seed=seed)
        options = options or {}
        phase = options["phase"] if "phase" in options else self.np_random.uniform()
        mu = options["mu"] if "mu" in options else self._random_parameters()
        if "push" in options:
            self._push, self._pushed_again = options["push"], False
        else:
            self._pushed_again = self.np_random.uniform() < self.constants.push_probability
            first, interval = phase + 0.5, self.constants.push_interval[1]
            self._push = self._random_push(first, first + interval) if self._pushed_again else None
        noise = options.get("noise", self.constants.initial_noise)
        mu = np.asarray(mu, dtype=float)
        if not np.array_equal(mu, self.walker.mu):
            self.walker.set_parameters(mu)
        self.episode.parameters[:] = self.observed_parameters(mu)
        self.lift = self._leg_extension()
        positions, rates = np.empty(COORDINATE_COUNT), np.empty(COORDINATE_COUNT)
        read_row(self.yardstick.targets.positions, phase, positions)
        read_row(self.yardstick.targets.velocities, phase, rates)
        # The tables hold one cycle without the forward travel, and heights of the reference's body.
        positions[3] += self.yardstick.targets.stride_length * phase
        positions[5] += self.lift
        positions[ROOT_DOFS:] += noise * self.np_random.standard_normal(ACTUATED_COUNT)
        self.walker.reset(positions, rates, phase)
        self.start_phase = phase
        self._steps = 0
        self.senses.forget()
        self._push_left = 0.0
        self.episode.root_force[:], self._pushing = 0.0, False
        # No action has been simulated yet, so the observation has the reference's ground reaction.
        ground = self.walker.mean_ground_reaction.reshape(6)
        read_row(self.yardstick.targets.ground_reaction, phase, ground)
        ground *= self.walker.weight
        self.episode.action[:] = 0.0
        self.episode.before[:] = 0.0
        self._judge()
        return self.told(), {}

    def observed_parameters(self, mu: Array) -> Array:
        """The parameters `mu` (14,) as they are observed: how the body differs from the one that
        its reference was made for; in the extended observation scaled, so that those which are
        drawn at random are -1 to 1.
        """
        seen = mu - self._shift
        return (seen - self._middle) / self._half_range if self._extended else seen

    def centre(self, policy: Act, mu: Array, *, key: str | None = None) -> None:
        """Subtract `centring` times the action bias of a `policy`, from observations (100, size) to
        actions (100, A), from its actions from now on.

        The action bias is the policy's action at each phase when a body with the parameters `mu`
        (14,) is exactly on the reference. It is not used in training. That of a `key`
        (`Policy.key`) which is known already is not computed again.
        """
        share = self.constants.centring
        known = None if key is None else (key, np.asarray(mu, dtype=float).tobytes())
        if known is not None and known == self._habit_of:
            return
        self._habit, self._habit_of = None, known
        if share == 0.0:
            return
        options = {"mu": mu, "push": None, "noise": 0.0}
        phases = (np.arange(HABIT_PHASES) + 0.5) / HABIT_PHASES
        seen = [
            # Seeded once, so that the result does not depend on what the environment drew before.
            self.reset(seed=None if i else 0, options={"phase": phase, **options})[0]
            for i, phase in enumerate(phases.tolist())
        ]
        self._habit = np.asarray(share * policy(np.array(seen)), dtype=float)

    def habits(self) -> Array:
        """Action bias in each hundredth of the cycle, (100, A), times `centring`; zero if not
        centred.
        """
        if self._habit is None:
            return np.zeros((HABIT_PHASES, len(self._requested)))
        return self._habit

    def _pace(self) -> float:
        """Pace of the last action."""
        return float(1.0 + self.constants.pace_scale * self.episode.action[-1])

    def _is_mirrored(self) -> bool:
        """Whether observations and actions are mirrored now."""
        return self._mirrors and is_mirrored(self.walker.phase)

    def told(self) -> NDArray[np.float32]:
        """The observation as the policy gets it. To be called once an action."""
        episode = self.episode
        return self.senses.told(
            episode.observation, episode.action, self._is_mirrored(), self.np_random
        )

    def _leg_extension(self) -> float:
        """How much higher the pelvis is above the ankles than in the reference's body, m; of legs
        that differ, the mean.
        """
        higher = 0.0
        for side in "rl":
            leg = [SEGMENTS.index(f"{name}_{side}") for name in ("thigh", "shank", "foot")]
            made_for = sum(self._made_for.segments[i].joint_position[2] for i in leg)
            higher += float(made_for - self.walker.tree.joint_position[leg, 2].sum())
        return higher / 2

    def _judge(self) -> tuple[float, bool]:
        walker, episode = self.walker, self.episode
        before = episode.observation.copy()
        reward, fell = judge(
            walker.tree, self.yardstick, walker.state, walker.phase, self._pace(), self.lift,
            self.tolerance_share, walker.mean_ground_reaction, walker.mean_moments,
            walker.mean_square_moments, episode, self._work,
        )  # fmt: skip
        if fell > 1.0:
            episode.observation[:], episode.terms[:] = before, 0.0
            return 0.0, True
        return float(reward), bool(fell)

    @property
    def is_pushed(self) -> bool:
        """Whether a push is still to come, or has just been."""
        return self._push is not None or self._pushing

    def push(self) -> None:
        """Set the force of a push on the pelvis, N in world axes, for the next action; 0 outside a
        push.
        """
        if self._pushing:
            self.episode.root_force[:], self._pushing = 0.0, False
        if self._push is None:
            return
        start, force, direction = self._push
        if self._push_left == 0.0 and self.walker.phase >= start:
            self._push_left = self.constants.push_seconds
        if self._push_left > 0.0:
            self._pushing = True
            # Force x time is exact whatever the duration of an action.
            share = min(1.0, self._push_left / self.walker.action_seconds)
            # Elements 0 to 2 are the moment; x is forward and y left, so the direction counts
            # towards the left.
            self.episode.root_force[3] = share * force * np.cos(direction)
            self.episode.root_force[4] = share * force * np.sin(direction)
            self._push_left -= share * self.walker.action_seconds
            # Not `== 0`: the durations of several actions add up to a push only to rounding.
            if self._push_left <= 1e-12:
                self._push_left = 0.0
                shortest, longest = (start + cycles for cycles in self.constants.push_interval)
                self._push = self._random_push(shortest, longest) if self._pushed_again else None

    def step(
        self, action: NDArray[np.float32], recording: Trajectory | None = None
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Advance by one `action`, whose physics steps `recording` receives, if given. Returns
        observation, reward, whether the walker fell, whether the episode has its full length, and
        `info`; see the class for `action` and `info`.
        """
        if self._habit is not None:
            # The phase keeps counting over cycles; only its fraction is the place in the cycle.
            action = action - self._habit[int(self.walker.phase % 1.0 * HABIT_PHASES)]
        episode, limit = self.episode, self.constants.action_limit
        self._requested[:] = action
        take_action(
            self._requested, limit, self.entering, self.shares, self._is_mirrored(),
            episode.action, episode.before,
        )  # fmt: skip
        self.push()
        offset = self.constants.action_scale * episode.action[:-1]
        self.walker.step(offset, episode.root_force, recording, pace=self._pace())
        reward, fell = self._judge()
        info = {
            "errors": episode.errors.copy(),
            "reward_terms": episode.terms.copy(),
            "cycles": self.walker.phase - self.start_phase,
        }
        return self.told(), reward, fell, self.counted(), info

    def counted(self) -> bool:
        """Count an action; whether the episode has its full length."""
        self._steps += 1
        return self._steps >= self._longest


def _shift_of(task: WalkingTask) -> Array:
    """By how much mu (14,) of the body that the reference was made for differs from the nominal;
    0 for damping and friction, which a reference does not depend on.
    """
    if task.reference_mu is None:
        return np.zeros(len(PARAMETERS))
    shift = np.asarray(task.reference_mu - nominal_parameters(), dtype=float)
    for name in ("damping", "friction"):
        # So the policy sees their full value, not a difference.
        shift[PARAMETERS.index(name)] = 0.0
    return shift
