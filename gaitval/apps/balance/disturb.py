"""A walker on ground that is not as it expects: a slip, a trip, a step down.

Everything happens in the contact law (`walk.contact.disturbed`); here it is decided when. The
ground changes between two actions, at times of the undisturbed walk from the same start, so that
"early in swing" is early in the swing that would have been.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.coordinates import SIDES, Side
from gaitval.errors import ConfigurationError
from gaitval.model.tree import SEGMENT_COUNT, empty_frames, forward
from gaitval.policy.environment import WalkingEnvironment
from gaitval.walk.contact.disturbed import Disturbed
from gaitval.walk.simulation.walker import Engine, WalkingTask

LOADED: Final = 20.0
"""N, above which a foot stands on the ground."""
TOUCHING: Final = 0.001
"""m above the ground, below which a sphere touches it."""
BEFORE: Final = 0.001
"""m from the foremost point of a foot to the wall that stops it."""


@dataclass(frozen=True)
class Slip:
    """Friction falls to a `grip` (share of what it is) under a foot from its heel strike, until it
    has slid by `distance` m, or leaves the ground.
    """

    side: Side = "right"
    grip: float = 0.1
    distance: float = 0.3


@dataclass(frozen=True)
class Trip:
    """A wall of `height` m stops the swinging foot at a share `swing` of its swing for `hold` s."""

    side: Side = "right"
    swing: float = 0.5
    hold: float = 0.1
    height: float = 0.15


@dataclass(frozen=True)
class StepDown:
    """The ground is by `drop` m lower from before a step of a foot on."""

    side: Side = "right"
    drop: float = 0.05


Disturbance = Slip | Trip | StepDown
_LIMITS: Final = {
    "grip": (0.0, 1.0, "a share of the usual friction, 0 to 1"),
    "distance": (0.0, 5.0, "m, 0 to 5"),
    "swing": (0.05, 0.95, "a share of the swing, 0.05 to 0.95"),
    "hold": (0.0, 5.0, "s, 0 to 5"),
    "height": (0.0, 1.0, "m, 0 to 1"),
    "drop": (-0.3, 0.3, "m downwards, -0.3 to 0.3"),
}


def checked(ground: Disturbance) -> Disturbance:
    """The `ground`. Raises ConfigurationError if it cannot be walked on."""
    if ground.side not in SIDES:
        raise ConfigurationError(f"side is {ground.side!r}. Give right or left.")
    for name, (low, high, words) in _LIMITS.items():
        value = getattr(ground, name, low)
        if not low <= value <= high:
            raise ConfigurationError(f"{name} is {value:g}. Give {words}.")
    return ground


def usual_grounds(side: Side = "right") -> list[Disturbance]:
    """The slips, trips and steps down that are compared with people."""
    return [
        *(Slip(side, grip, distance) for grip in (0.2, 0.05) for distance in (0.1, 0.3)),
        *(Trip(side, swing) for swing in (0.2, 0.5, 0.75)),
        *(StepDown(side, drop) for drop in (0.03, 0.05, 0.1)),
    ]


@dataclass(frozen=True)
class Planned:
    """A disturbance with its time and place in one walk.

    Attributes
    ----------
    start : s, from which it acts.
    edge : m, x of a step down.
    """

    ground: Disturbance
    start: float
    edge: float = np.inf


class DisturbedEnvironment(WalkingEnvironment):
    """An environment whose ground is as `planned`; level ground while that is None.

    Attributes
    ----------
    planned : what happens in the next walk.
    began, ended : s, when it began to act and when it had ended; NaN if not.
    slid : m, how far the foot slid on slippery ground.
    """

    def __init__(self, task: WalkingTask, *, engine: Engine = "compiled") -> None:
        super().__init__(task, engine=engine)
        self.planned: Planned | None = None
        self.began = self.ended = np.nan
        self.slid = 0.0
        self._actions = 0
        self._last: tuple[Array, NDArray[np.bool_]] | None = None
        self._loaded = False
        self._frames = empty_frames()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """`WalkingEnvironment.reset`, on level ground but for a step down that is planned."""
        seen = super().reset(seed=seed, options=options)
        self._actions, self._last, self._loaded = 0, None, False
        self.began = self.ended = np.nan
        self.slid = 0.0
        law = Disturbed.around(self.walker.law)
        if self.planned is not None and isinstance(self.planned.ground, StepDown):
            law = law._replace(edge=self.planned.edge, drop=self.planned.ground.drop)
        self._stand_on(law)
        return seen

    @property
    def ground(self) -> Disturbed:
        """The contact law now."""
        law: Any = self.walker.body.law
        return law  # type: ignore[no-any-return]

    def _stand_on(self, law: Disturbed) -> None:
        self.walker.body = self.walker.body._replace(law=law)

    def push(self) -> None:
        """What acts in the next action: the push of the options, and the ground."""
        super().push()
        now = self._actions * self.walker.action_seconds
        self._actions += 1
        if self.planned is not None and now >= self.planned.start and np.isnan(self.ended):
            ground, column = self.planned.ground, SIDES.index(self.planned.ground.side)
            if isinstance(ground, Slip):
                self._slip(ground, column, now)
            elif isinstance(ground, Trip):
                self._trip(ground, column, now)
            else:
                self._step_down(ground, column, now)

    def _grip(self, column: int, share: float) -> None:
        law = self.ground
        self._stand_on(
            law._replace(grip_right=share) if column == 0 else law._replace(grip_left=share)
        )

    def _foot(self, column: int) -> tuple[Array, Array]:
        """Centres (6, 3) m of a foot's spheres, and their radii (6,) m."""
        walker, frames = self.walker, self._frames
        forward(walker.tree.joint_position, walker.state[0], frames, SEGMENT_COUNT)
        tree, count = walker.tree, len(walker.tree.sphere_radius) // 2
        own = slice(0, count) if column == 0 else slice(count, 2 * count)
        segments = tree.sphere_segment[own]
        arms = np.einsum("sij,sj->si", frames.rotation[segments], tree.sphere_position[own])
        return frames.origin[segments] + arms, tree.sphere_radius[own]

    def _slip(self, ground: Slip, column: int, now: float) -> None:
        loaded = self.walker.mean_ground_reaction[column, 2] > LOADED
        if np.isnan(self.began):
            self.began = now
            self._grip(column, ground.grip)
        centres, radii = self._foot(column)
        below = centres[:, 2] - radii < TOUCHING
        if self._last is not None:
            # A foot that rolls over does not slip: only what touches the ground counts.
            both = below & self._last[1]
            if both.any():
                moved = (centres - self._last[0])[both, :2].mean(axis=0)
                self.slid += float(np.hypot(*moved))
        self._last = centres, below
        self._loaded |= bool(loaded)
        if self.slid >= ground.distance or (self._loaded and not loaded):
            self.ended = now
            self._grip(column, 1.0)

    def _trip(self, ground: Trip, column: int, now: float) -> None:
        if np.isnan(self.began):
            self.began = now
            centres, radii = self._foot(column)
            wall = float((centres[:, 0] + radii).max()) + BEFORE
            self._stand_on(
                self.ground._replace(wall_side=column, wall=wall, wall_height=ground.height)
            )
        elif now - self.began >= ground.hold - 1e-9:
            self.ended = now
            self._stand_on(self.ground._replace(wall_side=-1))

    def _step_down(self, ground: StepDown, column: int, now: float) -> None:
        """The step is there from the start; here the walker notices under its foot that its ground
        is lower from now on, as people do.
        """
        loaded = self.walker.mean_ground_reaction[column, 2] > LOADED
        if loaded and self._foot(column)[0][:, 0].mean() > self.ground.edge:
            self.began = self.ended = now
            self.lift -= ground.drop
