"""Long walks, of which only forces and the centre of mass are kept."""

from collections.abc import Sequence

import numpy as np

from gaitval._internal.numba.lanes import WIDTH
from gaitval.arrays import Array
from gaitval.model.tree import COORDINATE_COUNT, centres_of_mass
from gaitval.policy.rollouts import times_of, walks_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.simulation.physics_steps import Account
from gaitval.walk.simulation.rollout import Travel
from gaitval.walk.simulation.walker import Walker, put_rows

_PART = 200
"""Actions of `travel_together` after which what is not needed of them is forgotten."""

_Kept = tuple[Array, Array, Array]


def travel_together(
    group: WalkingGroup, policy: Policy, *, mu: Array, start_phases: Sequence[float], cycles: float
) -> list[Travel]:
    """`record_together` of long walks, of which little is kept: 128 bytes per step instead of 880.
    `group`, `policy`, `mu`, `start_phases` and `cycles` are as there.
    """
    walks = len(start_phases)
    walkers = [environment.walker for environment in group.environments[:walks]]
    steps = walkers[0].steps_per_action
    recording = _Path(_PART * steps)
    parts: list[list[_Kept]] = [[] for _ in walkers]
    rows, fell = np.zeros(walks, dtype=int), np.zeros(walks, dtype=bool)

    def keep() -> None:
        for part, (e, walker) in zip(parts, enumerate(walkers), strict=True):
            part.append(recording.kept(e, walker))
        recording.rows = 0

    starts = [{"phase": phase} for phase in start_phases]
    for walking, fallen in walks_together(group, policy, mu, starts, cycles):
        if recording.rows == _PART * steps:
            keep()
        recording.append(group.beside.account, group.beside.arrays.root_force)
        rows[walking] += steps
        if np.count_nonzero(fallen):
            fell |= walking & fallen
    keep()
    return [
        Travel(
            # of each row what acts at its state: in the step that follows it
            time=times_of(walker, last - 1),
            ground_reaction=np.concatenate([each[0] for each in part])[1:last],
            centre_of_mass=np.concatenate([each[1] for each in part])[: last - 1],
            root_force=np.concatenate([each[2] for each in part])[1:last],
            start_phase=np.array([start_phase]),
            fell=np.array([float(down)]),
        )
        for walker, part, last, start_phase, down in zip(
            walkers, parts, rows.tolist(), start_phases, fell, strict=True
        )
    ]


class _Path:
    """As `Trajectory`, of what is kept of long walks side by side: places, and what acts."""

    def __init__(self, steps: int) -> None:
        self.rows = 0
        shapes = (COORDINATE_COUNT,), (2, 6), (6,)
        self._arrays = [np.zeros((steps, *shape, WIDTH)) for shape in shapes]

    def append(self, account: Account, root_force: Array) -> None:
        """Add an action's steps and the external force (6, walkers) on the pelvis during it."""
        new = account.positions, account.feet, root_force
        self.rows = put_rows(self._arrays, self.rows, new)

    def kept(self, walker: int, of: Walker) -> _Kept:
        """Ground reaction (T, 2, 3), centre of mass (T, 3) and external force (T, 6) of the
        `walker` of this number, which is `of` this body.
        """
        positions, feet, force = (each[: self.rows, ..., walker] for each in self._arrays)
        centre = centres_of_mass(of.tree, np.ascontiguousarray(positions))
        # without the moments
        return feet[:, :, :3].copy(), np.asarray(centre, dtype=float), force.copy()
