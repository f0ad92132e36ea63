"""The error epsilon that ends Algorithm 1.

The paper sums ‖q − q̂‖ + ‖τ − τ̂‖ + ‖GRF − GRF̂‖ over the samples of a gait cycle, three quantities
of different units. Here each part is the mean over the 101 samples of a cycle (so it does not
depend on the sample rate), averaged over the cycles, and is divided by the root mean square norm of
the same recorded quantity. A part of 0 is a perfect match, and a part of 1 is an error as large as
the record itself; epsilon is the sum of the three parts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitval.arrays import Array
from gaitval.gait.cycle_curves import FORCES, JOINT_MOMENTS, Curves, recorded_curves
from gaitval.metrics.comparison import curves_of
from gaitval.metrics.curve_results import Epsilon
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.typed import array, number
from gaitval.policy.rollouts import record_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup

ANGLES = ("hip_flexion", "hip_adduction", "knee_angle", "ankle_angle", "subtalar_angle")
"""q: sagittal and frontal coordinates. Hip rotation is left out because transverse angles are the
least reliable ones in a record (McGinley 2009), and the pelvis because it is not a joint."""

NORMALISATION = (
    "Each part is the Euclidean norm over both legs of the difference from the record, averaged "
    "over the 101 samples of a gait cycle and over the cycles, divided by the root mean square of "
    "the same norm of the record: angles (hip flexion and adduction, knee, ankle, subtalar) in "
    "rad, moments (hip flexion and adduction, knee, ankle) in Nm/kg, ground reaction (three "
    "components) in body weights. Epsilon is the sum of the three parts; 0 is a perfect match, "
    "3 an error as large as the record."
)


def _part(
    simulated: dict[str, NDArray[np.float64]],
    recorded: dict[str, NDArray[np.float64]],
    names: tuple[str, ...],
) -> tuple[float, float]:
    """The part in its own unit, and normalised."""
    keys = [f"{name}_{side}" for name in names for side in ("r", "l")]
    # the feet may differ by a cycle: each right cycle is paired with the left one that follows
    count = min(len(simulated[key]) for key in keys)
    # one norm over all coordinates of both legs, as ‖q − q̂‖ in the paper
    difference = np.stack([simulated[key][:count] - recorded[key] for key in keys])
    reference = np.stack([recorded[key] for key in keys])
    value = float(np.linalg.norm(difference, axis=0).mean())
    # a mean of norms over the RMS of a norm, as `NORMALISATION` states
    scale = float(np.sqrt(np.mean(np.sum(reference**2, axis=0))))
    return value, value / scale


def epsilon(simulated: Curves, recorded: Curves) -> Epsilon | None:
    """Epsilon of the `simulated` curves (n, 101) against the `recorded` ones (101,), both as in
    `comparison`; None without a complete cycle of both feet.
    """
    if any(len(curve) == 0 for curve in simulated.angles.values()):
        return None
    angles_rad, angles = _part(simulated.angles, recorded.angles, ANGLES)
    moments_nm_per_kg, moments = _part(simulated.moments, recorded.moments, JOINT_MOMENTS)
    forces_body_weights, forces = _part(simulated.forces, recorded.forces, FORCES)
    return Epsilon(
        angles=number(angles),
        moments=number(moments),
        forces=number(forces),
        total=number(angles + moments + forces),
        angles_rad=number(angles_rad),
        moments_nm_per_kg=number(moments_nm_per_kg),
        forces_body_weights=number(forces_body_weights),
    )


def mean_of(walks: Sequence[Epsilon | None]) -> Epsilon | None:
    """Mean of the epsilons of several `walks`; None if one of them has no complete cycle."""
    found = [each for each in walks if each is not None]
    if len(found) < len(walks):
        return None
    parts = {name: array([getattr(each, name) for each in found]) for name in Epsilon.model_fields}
    return Epsilon(**{name: number(values.mean()) for name, values in parts.items()})


@dataclass(frozen=True)
class Walks:
    """At most eight walks: a policy, body parameters mu (14,), and the phase each starts at."""

    policy: Policy
    mu: Array
    start_phases: Sequence[float]


class ScoredWalk(NamedTuple):
    """Epsilon of a walk, None without a complete cycle of both feet; and whether it fell."""

    epsilon: Epsilon | None
    fell: bool


def epsilons(group: WalkingGroup, walks: Walks) -> list[Epsilon | None]:
    """Epsilon of each of the `walks`, as `walked` by `group`; None without a complete cycle."""
    return [each.epsilon for each in walked(group, walks)]


def walked(group: WalkingGroup, walks: Walks) -> list[ScoredWalk]:
    """Epsilon and falls of the `walks` of `group`, side by side, over `validation.cycles`."""
    task = group.environments[0].task
    validation, recorded = task.configuration.validation, recorded_curves(task.record)
    found = []
    for rollout in record_together(
        group,
        walks.policy,
        mu=walks.mu,
        start_phases=walks.start_phases,
        cycles=validation.settling_cycles + validation.cycles,
    ):
        cycles = find_cycles(rollout, task.configuration).first(validation.cycles)
        error = epsilon(curves_of(task, rollout, cycles), recorded)
        found.append(ScoredWalk(error, bool(rollout.fell[0])))
    return found
