"""The walk itself, one action after the other: what is done to it has its place between two.

It knows no clock. The same person and the same doings at the same actions give, bit for bit, the
same walk on the same machine (`log`).
"""

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from gaitval.apps.balance.disturb import DisturbedEnvironment, Slip, Trip
from gaitval.apps.devices.of_subject import live_walker
from gaitval.apps.live.blending import Blend
from gaitval.apps.live.doing import (
    ChangeBody,
    Doing,
    PushPelvis,
    Restart,
    SetSpeed,
    SlipFoot,
    TripFoot,
    Wear,
)
from gaitval.apps.live.person import LivePerson
from gaitval.arrays import Array
from gaitval.coordinates import SIDES
from gaitval.model.body import BodyModel
from gaitval.model.parameters import PARAMETERS, nominal_parameters, parameter_bounds
from gaitval.model.tree import COORDINATE_COUNT
from gaitval.policy.environment import HABIT_PHASES, WalkingEnvironment
from gaitval.policy.storage import Policy
from gaitval.simulation.tables import read_row
from gaitval.simulation.walker import Trajectory, WalkingTask

PUSH_SECONDS: Final = 0.05
"""s that a push lasts, as everywhere in gaitval."""
HASTE: Final = 0.25
"""m/s², by which the speed of the reference follows the one that is asked for; a person who speeds
up takes about as long."""
STRETCH: Final = 1.0
"""s in which a body parameter goes from one of its bounds to the other. A leg that became longer at
once would kick the ground."""
LONGEST_DRIFT: Final = 0.4
"""m that the pelvis may be from its place on the reference's line; the line follows it from there
on. The policy learned where it never was more than 0.8 m away."""
LOADED: Final = 20.0
"""N, above which a foot is on the ground; of less, the centre of pressure is noise."""
SLIPPERY, SLIDES = 0.1, 0.3
"""Share of the friction that is left under a foot that slips, and the m that it slides."""
SWUNG: Final = 0.2
"""Gait cycles since a foot left the ground when it is stopped: about the middle of its swing."""
LIES: Final = 1.5
"""s for which a fall is shown, before the person stands again."""


class Seen(NamedTuple):
    """The walk after an action.

    Attributes
    ----------
    step : actions so far.
    time : s walked, without the time after falls.
    phase : of the right gait cycle, 0 to 1.
    speed : m/s, that the reference has or comes to.
    cycles : walked since the last start.
    down : whether it has fallen.
    positions : (31,) rad, m, world.
    force : (2, 3) N of the ground on the right and the left foot, mean of the last action.
    pressure : (2, 2) m, world, its centre; NaN without load.
    push : (2,) N, forward and left, mean of the last action.
    mu : (14,) body parameters.
    wanted : (14,) that they have or come to.
    """

    step: int
    time: float
    phase: float
    speed: float
    cycles: float
    down: bool
    positions: Array
    force: Array
    pressure: Array
    push: Array
    mu: Array
    wanted: Array


class LiveEnvironment(DisturbedEnvironment):
    """An environment whose reference and body change while it walks, and that is pushed by hand.
    The tables of the reference of its `task` are overwritten.
    """

    def __init__(self, task: WalkingTask) -> None:
        super().__init__(task)
        self._pushes: list[list[float]] = []  # seconds left, N forward, N left
        self._asked: SlipFoot | TripFoot | None = None
        self._swung = np.zeros(2)  # s since each foot left the ground
        self.level()
        self.stride_time = task.reference.stride_time

    def push(self) -> None:
        """Set the force of all pushes that act, for the next action; force x time is exact."""
        self.episode.root_force[:] = 0.0
        whole = self.walker.action_seconds
        for each in self._pushes:
            share = min(1.0, each[0] / whole)
            self.episode.root_force[3] += share * each[1]
            self.episode.root_force[4] += share * each[2]
            each[0] -= share * whole
        self._pushes = [each for each in self._pushes if each[0] > 1e-12]
        self._disturb(whole)
        self.act_on_ground()

    def _disturb(self, seconds: float) -> None:
        """Begin what was asked for, if the foot has swung for long enough; an action takes so many
        `seconds`.
        """
        loaded = self.walker.mean_ground_reaction[:, 2] > LOADED
        self._swung = np.where(loaded, 0.0, self._swung + seconds)
        if self.planned is not None and np.isfinite(self.ended):
            self.planned = None
        if self._asked is None or self.planned is not None:
            return
        side, slips = self._asked.side, isinstance(self._asked, SlipFoot)
        least = 0.0 if slips else SWUNG * self.stride_time
        # A foot that was asked for late in its swing is stopped in the next one.
        if least < self._swung[SIDES.index(side)] <= least + (np.inf if slips else 0.1):
            self.begin(Slip(side, SLIPPERY, SLIDES) if slips else Trip(side))
            self._asked = None

    def disturbed(self, doing: SlipFoot | TripFoot) -> None:
        """A foot will slip when it lands next, or be stopped in its next swing."""
        self._asked = doing

    @property
    def undermined(self) -> bool:
        """Whether a foot slips or is stopped, or will."""
        return self._asked is not None or self.planned is not None

    def pushed(self, forward: float, left: float) -> None:
        """Begin a push with the next action, N."""
        self._pushes.append([PUSH_SECONDS, forward, left])

    def stand(self) -> None:
        """No push acts any longer, and the ground is level."""
        self._pushes, self._asked, self._swung = [], None, np.zeros(2)
        self.level()

    def with_speed(self, blend: Blend, speed: float) -> float:
        """Follow the reference at another speed, m/s. The walker keeps its place relative to it, so
        it is moved forward by the m that this gives: another stride length is another place.
        """
        walker, targets = self.walker, self.yardstick.targets
        before = self._place()
        targets = blend.at(speed, targets, walker.tables)
        self.stride_time = blend.now.stride_time
        self.yardstick = self.yardstick._replace(
            targets=targets, half_action=0.5 * walker.action_seconds / self.stride_time
        )
        self._step_phase()
        moved = float(self._place()[0] - before[0])
        self.moved(np.array([moved, 0.0]))
        return moved

    def moved(self, way: Array) -> None:
        """Move the walker by a `way` (2,) m, forward and left, and what stops it with it."""
        self.walker.state[0, 3:5] += way
        self._last = None  # that it was moved is no slide
        if self.ground.wall_side >= 0:
            self._stand_on(self.ground._replace(wall=self.ground.wall + float(way[0])))

    def _place(self) -> Array:
        """(2,) m, of the reference's pelvis now, forward and left."""
        row = np.empty(COORDINATE_COUNT)
        read_row(self.yardstick.targets.positions, self.walker.phase, row)
        row[3] += self.yardstick.targets.stride_length * self.walker.phase
        return row[3:5]

    def away(self) -> Array:
        """(2,) m, how far the pelvis is from its reference, forward and left."""
        return np.asarray(self.walker.state[0, 3:5] - self._place())

    def _step_phase(self) -> None:
        walker = self.walker
        walker.body = walker.body._replace(phase_step=walker.physics_step / self.stride_time)

    def with_body(self, mu: Array) -> None:
        """Give the walker, where it is, the parameters mu (14,)."""
        ground = self.ground
        self.walker.set_parameters(mu)
        self.walk_on(ground)
        self._step_phase()
        seen = mu - self._shift
        self.episode.parameters[:] = (
            (seen - self._middle) / self._half_range if self._extended else seen
        )
        higher = self._leg_extension() - self.lift
        self.lift += higher
        self.walker.state[0, 5] += higher


class LiveDeviceEnvironment(LiveEnvironment):
    """A person with devices, by their whole tables."""

    def __init__(self, task: WalkingTask, devices: Sequence[Mapping[str, Any]]) -> None:
        fitted, walker = live_walker(task, devices)
        super().__init__(fitted)
        self.walker = walker
        self.level()

    def with_speed(self, blend: Blend, speed: float) -> float:
        """`LiveEnvironment.with_speed`; a joint without muscles does not follow the reference."""
        moved, ground = super().with_speed(blend, speed), self.ground
        self.walker.set_parameters(self.walker.mu)
        self.walk_on(ground)
        self._step_phase()
        return moved


class LiveWalk:
    """A person who walks, falls and stands up again.

    Parameters
    ----------
    person : who walks.
    speed : m/s to begin with; that of the person's own trial if None.
    devices : whole tables of what can be worn; it is on at the beginning.

    Attributes
    ----------
    step : actions so far, those after falls included.
    lower, upper : (14,) bounds of the body parameters.
    """

    def __init__(
        self,
        person: LivePerson,
        speed: float | None = None,
        devices: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        self.devices = tuple(devices)
        self._policy: Policy = person.policy
        # Displacement alone is not a fall here: the line follows (`_follow`).
        tasks = [each.with_environment(drift_tolerance=1e3) for each in person.tasks]
        known = [WalkingEnvironment(task) for task in tasks]
        nominal = nominal_parameters()
        for each in known:
            each.centre(self._policy.act, nominal)
        self.blend = Blend(known)
        # Of its own: the tables of the first reference would be overwritten with blends.
        self._bare = self._environment = LiveEnvironment(tasks[0])
        if devices:
            self._environment = LiveDeviceEnvironment(tasks[0], devices)
        self._with_devices = self._environment
        self.lower, self.upper = parameter_bounds(tasks[0].configuration.randomisation)
        self.mu, self._wanted_mu = nominal.copy(), nominal.copy()
        own = person.subject.walking_speed_m_s if speed is None else speed
        self.speed = self._wanted = self._within(own)
        self.step = 0
        self._walked = 0
        self._down_until = 0
        self._shift = np.zeros(2)
        self._recording = Trajectory(self._environment.walker.steps_per_action)
        self._digest = hashlib.blake2b(digest_size=16)
        self._start()

    @property
    def seconds(self) -> float:
        """s that an action takes."""
        return self._environment.walker.action_seconds

    @property
    def body(self) -> BodyModel:
        """As scaled."""
        return self._environment.task.model

    @property
    def weight(self) -> float:
        """N, of the body."""
        return self._environment.walker.weight

    @property
    def digest(self) -> str:
        """Hash of all states so far: equal for equal walks alone."""
        return self._digest.hexdigest()

    @property
    def down(self) -> bool:
        """Whether it has fallen, and does not stand yet."""
        return self.step < self._down_until

    @property
    def device_on(self) -> bool:
        """Whether the devices are on."""
        return self._environment is not self._bare

    def _within(self, speed: float) -> float:
        return min(max(speed, self.blend.slowest), self.blend.fastest)

    def _start(self) -> None:
        """Stand on the reference at phase 0, where the walk is in the world."""
        environment = self._environment
        here = environment.walker.state[0, 3:5] - self._shift  # a copy
        self.speed, self.mu = self._wanted, self._wanted_mu.copy()
        environment.walker.phase = 0.0
        environment.with_speed(self.blend, self.speed)
        options = {"phase": 0.0, "mu": self.mu, "push": None, "noise": 0.0}
        self._observation, _ = environment.reset(seed=0, options=options)
        environment.with_body(self.mu)  # `reset` may have given the body another pace
        environment.stand()
        self._shift = environment.walker.state[0, 3:5] - here
        self._walked = 0
        self._down_until = 0

    def do(self, doing: Doing) -> None:
        """Let something happen before the next action."""
        match doing:
            case PushPelvis(forward, left):
                if not self.down:
                    self._environment.pushed(forward, left)
            case SlipFoot() | TripFoot():
                if not self.down:
                    self._environment.disturbed(doing)
            case SetSpeed(value):
                self._wanted = self._within(value)
            case ChangeBody(name, value):
                index = PARAMETERS.index(name)
                within = min(max(value, float(self.lower[index])), float(self.upper[index]))
                self._wanted_mu[index] = within
            case Restart():
                self._start()
            case Wear(on):
                if self.devices and on != self.device_on:
                    self._wear(on)

    def _wear(self, on: bool) -> None:
        place = self._environment.walker.state[0, 3:5].copy()
        self._environment = self._with_devices if on else self._bare
        self._environment.walker.state[0, 3:5] = place
        self._start()

    def act(self) -> None:
        """One action: 6 ms of walking, or of lying on the ground."""
        if self.down:
            self.step += 1
            if not self.down:
                self._start()
            self._digest.update(b"down")
            return
        environment = self._environment
        self._towards_wanted()
        self._follow()
        action = self._policy.act(self._observation)
        row = int(environment.walker.phase % 1.0 * HABIT_PHASES)
        self._recording.rows = 0
        self._observation, _, fell, _, _ = environment.step(
            action - self.blend.habits[row], self._recording
        )
        self.step += 1
        self._walked += 1
        self._digest.update(environment.walker.state.tobytes())
        self._digest.update(np.float64(environment.walker.phase).tobytes())
        if fell:
            environment.stand()
            self._down_until = self.step + round(LIES / self.seconds)

    def _towards_wanted(self) -> None:
        environment = self._environment
        if self.speed != self._wanted:
            most = HASTE * self.seconds
            change = min(max(self._wanted - self.speed, -most), most)
            self.speed = self._wanted if abs(change) < most else self.speed + change
            self._shift[0] += environment.with_speed(self.blend, self.speed)
        if not np.array_equal(self.mu, self._wanted_mu):
            most_of_each = (self.upper - self.lower) * self.seconds / STRETCH
            off = self._wanted_mu - self.mu
            near = np.abs(off) <= most_of_each
            self.mu = np.where(
                near, self._wanted_mu, self.mu + np.clip(off, -most_of_each, most_of_each)
            )
            environment.with_body(self.mu)

    def _follow(self) -> None:
        """Move the reference's line to a walker that was pushed far from it."""
        away = self._environment.away()
        over = away - np.clip(away, -LONGEST_DRIFT, LONGEST_DRIFT)
        if over.any():
            self._environment.moved(-over)
            self._shift -= over

    def see(self) -> Seen:
        """The walk as it is now."""
        environment = self._environment
        walker = environment.walker
        positions = walker.state[0].copy()
        positions[3:5] -= self._shift
        feet = self._recording.feet.mean(axis=0)
        loaded = np.where(feet[:, 2] > LOADED, feet[:, 2], np.nan)
        # About the origin, a force at (x, y, 0) has the moments y Fz and -x Fz.
        pressure = np.stack([-feet[:, 4] / loaded, feet[:, 3] / loaded], axis=-1) - self._shift
        return Seen(
            step=self.step,
            time=self._walked * self.seconds,
            phase=walker.phase % 1.0,
            speed=self._wanted,
            cycles=walker.phase - environment.start_phase,
            down=self.down,
            positions=positions,
            force=feet[:, :3],
            pressure=pressure,
            push=environment.episode.root_force[3:5].copy(),
            mu=self.mu,
            wanted=self._wanted_mu.copy(),
        )
