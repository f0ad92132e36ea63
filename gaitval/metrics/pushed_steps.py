"""Where a walker places its feet after pushes to the side: what its report shows beside people.

Fewer pushes than `gaitval perturb` tries, and only what one figure needs: at `PHASES` phases of the
cycle to the left and to the right, of the `FORCES` in turn.
"""

import math
from collections.abc import Sequence
from typing import Final

from gaitval._internal.numba.lanes import WIDTH
from gaitval.arrays import Array
from gaitval.configuration import PushSettings
from gaitval.coordinates import SIDES
from gaitval.metrics.balance_walk import BalanceWalk, walked
from gaitval.metrics.foot_placement import TIME_FOR_A_STEP, answered, placements
from gaitval.metrics.push_recovery import Push, without_drift
from gaitval.metrics.results import PlacedFoot
from gaitval.model.parameters import apply_parameters
from gaitval.policy.rollouts import in_groups, record_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.simulation.walker import WalkingTask

FORCES: Final = (200.0, 100.0)
"""N, of who weighs as much as an adult (`PushSettings.of_mass`)."""
PHASES: Final = WIDTH - 1
"""Twice as many pushes and the walk without one fill two groups of eight."""
AFTER: Final = 2.5
"""Gait cycles: enough for the first step that there is time for."""


def forces_of(settings: PushSettings, mass: float, adults: Sequence[float] = FORCES) -> list[float]:
    """For a person of so many kg the forces, N, that are `adults` for an adult."""
    share = settings.of_mass(mass).force / settings.force
    return [share * each for each in adults]


def pushes_aside(forces: list[float]) -> list[Push]:
    """The pushes; at each phase the two sides have different `forces`, N."""
    return [
        Push(phase / PHASES, side * 0.5 * math.pi, forces[(phase + (side > 0)) % len(forces)])
        for phase in range(PHASES)
        for side in (1, -1)
    ]


def placed_feet(task: WalkingTask, policy: Policy, mu: Array) -> list[PlacedFoot]:
    """Where the walker of `task` and `policy`, with the body `mu` (14,), places its feet."""
    task = without_drift(task)
    configuration = task.configuration
    tried: list[Push | None] = [None]
    tried += pushes_aside(forces_of(configuration.pushes, task.model.mass))
    settling, model = configuration.validation.settling_cycles, apply_parameters(task.model, mu)
    group, walks = WalkingGroup([task] * WIDTH), list[BalanceWalk]()
    for some in in_groups(tried):
        for rollout in record_together(
            group,
            policy,
            mu=mu,
            start_phases=[0.0] * len(some),
            cycles=settling + 1.0 + AFTER,
            pushes=[_started(each, settling) for each in some],
        ):
            threshold = configuration.contact.event_threshold
            walks.append(walked(rollout, model, threshold=threshold))
    plain, seconds = walks[0], configuration.environment.push_seconds
    return [
        _placed(push, walk, plain, seconds)
        for push, walk in zip(tried[1:], walks[1:], strict=True)
        if push is not None
    ]


def _started(push: Push | None, settling: float) -> tuple[float, float, float] | None:
    return None if push is None else (settling + push.phase, push.force, push.direction)


def _placed(push: Push, walk: BalanceWalk, plain: BalanceWalk, seconds: float) -> PlacedFoot:
    step = None
    if not walk.fell and not plain.fell:
        step = answered(placements(walk, plain, ends=seconds), TIME_FOR_A_STEP)
    return PlacedFoot(
        phase=push.phase,
        direction=round(math.degrees(push.direction), 6),
        force=push.force,
        fell=walk.fell,
        side=None if step is None else SIDES[step.column],
        lead=None if step is None else step.lead,
        foot=None if step is None else float(step.foot[1]),
        extrapolated=None if step is None else float(step.extrapolated[1]),
        pendulum=None if step is None or not math.isfinite(step.guess[1]) else step.guess[1],
    )
