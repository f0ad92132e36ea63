"""Correct the reference: the motion that a trained walker must be given to walk as recorded.

A policy follows its reference with errors that repeat in every cycle. A foot that is 3 mm too high
lands 10 ms late, which shifts all curves of its leg by 1 % of the cycle, but no reward resolves 3
mm. Such errors respond smoothly to small changes of the reference, so they are removed by iterative
learning control (Bristow, Tharayil, Alleyne 2006, IEEE Control Systems 26(3):96-114): walk, compare
the mean curves with the record, change the reference, walk again. The changes are of the height of
the pelvis and the lowest harmonics of hip, knee, ankle and trunk angles; finite differences give
the effect of each change on every curve, and the step is a Gauss-Newton step.

Policy, body and physics are unchanged, and nothing supports the body: it is the same walker, given
a motion that differs from the reference by about a degree.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gaitval.arrays import Array
from gaitval.metrics.tolerances import aim
from gaitval.metrics.validation import deviations
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import RolloutPool, record_rollout
from gaitval.policy.storage import Policy
from gaitval.reference.adjustment import JOINTS, Adjustment, adjusted
from gaitval.simulation.walker import WalkingTask

Deviations = Mapping[tuple[str, str], Array]
Simulate = Callable[[Sequence[Array]], Sequence[Deviations | None]]

_ANGLE, _HEIGHT = np.deg2rad(1.0), 0.005
"""Units of the unknowns, rad and m, which give them similar weight."""
_PROBE = 0.4
"""Change of an unknown that measures its effect: several times the scatter between rollouts of the
means over 24 cycles."""
_POWER = 8
"""Power of the norms in the mean that is minimised: norms above their goals count most, and those
far below hardly at all."""
_STEPS = 3
"""Largest number of steps with the same slopes, which cost ten times as many rollouts as a step."""
_DAMPINGS = 10.0 ** np.arange(-3.0, 1.5, 0.5)
"""Damping of a step / mean square of the slopes. All of them are tried: the response is not linear,
so no rule says which is best."""


@dataclass(frozen=True)
class Result:
    """A correction and its effect.

    Attributes
    ----------
    errors : `error` before and after each step; empty if the uncorrected walker fell.
    before, after : deviations of the rollouts without and with it.
    """

    correction: Adjustment
    errors: tuple[float, ...]
    before: Deviations
    after: Deviations

    def as_dict(self) -> dict[str, Any]:
        """For `correction.json`; measures are in their own units."""
        return {
            **self.correction.as_dict(),
            "errors": list(self.errors),
            "measures": [
                {
                    "measure": measure,
                    "target": target,
                    "aim": bound,
                    "before": bound * float(np.linalg.norm(before)),
                    "after": bound * float(np.linalg.norm(self.after[measure, target])),
                }
                for (measure, target), before in self.before.items()
                if (bound := aim(measure, target)) is not None
            ],
        }


def error(found: Deviations) -> float:
    """One number for all deviations: the power mean of their norms; 1 if all are at their goals."""
    sizes = np.array([np.linalg.norm(each) for each in found.values()])
    return float(np.mean(sizes**_POWER) ** (1.0 / _POWER))


def search(
    walk: Simulate,
    unknowns: int,
    *,
    rounds: int,
    allowed: Callable[[Array], bool],
    on_round: Callable[[int, float], None] | None = None,
) -> tuple[Array, list[float]]:
    """Minimise `error` by Gauss-Newton steps, starting from zero.

    Parameters
    ----------
    walk : deviations of each of several points (n,); None for a rollout that ended in a fall.
    unknowns : n.
    allowed : whether a point may be tried.
    on_round : called with the finished round and the error.

    Returns
    -------
    The best point, and the errors at the start and after each round; none if the start fell.
    """
    point = np.zeros(unknowns)
    found = walk([point])[0]
    if found is None:
        return point, []
    errors = [error(found)]
    for number in range(rounds):
        probes = walk([point + _PROBE * each for each in np.eye(unknowns)])
        # A rollout with a fall says nothing about its unknown, which is then left unchanged.
        answers = [
            0.0 * _stacked(found) if each is None else (_stacked(each) - _stacked(found)) / _PROBE
            for each in probes
        ]
        slopes = np.column_stack(answers)
        before = errors[-1]
        for _ in range(_STEPS):
            points = [point + step for step in _steps(slopes, found)]
            points = [each for each in points if allowed(each)]
            walked = [
                (error(each), candidate, each)
                for candidate, each in zip(points, walk(points), strict=True)
                if each is not None
            ]
            best = min(walked, key=lambda each: each[0], default=None)
            if best is None or best[0] >= error(found):
                break
            _, point, found = best
        errors.append(error(found))
        if on_round is not None:
            on_round(number + 1, errors[-1])
        if errors[-1] == before:
            break
    return point, errors


def _stacked(found: Deviations) -> Array:
    return np.concatenate(list(found.values()))


def _steps(slopes: Array, found: Deviations) -> list[Array]:
    """Gauss-Newton steps with each of `_DAMPINGS`.

    Deviations are weighted with a power of the norm that they are part of, so that their sum of
    squares is the norm to the power `_POWER`.
    """
    norms = {key: np.linalg.norm(each) for key, each in found.items()}
    power = 0.5 * _POWER - 1.0
    weight = np.concatenate([np.full(len(v), norms[key] ** power) for key, v in found.items()])
    weighted = weight[:, None] * slopes
    normal, right = weighted.T @ weighted, weighted.T @ (weight * _stacked(found))
    scale = np.trace(normal) / len(normal)
    if scale == 0.0:
        return []
    return [
        -np.linalg.solve(normal + scale * damping * np.eye(len(normal)), right)
        for damping in _DAMPINGS
    ]


@dataclass(frozen=True)
class _Case:
    policy: Policy
    mu: Array
    unknowns: Array
    start_phase: float


def _correction(unknowns: Array) -> Adjustment:
    """The correction given by the unknowns (13 + 26 H + 1,)."""
    harmonics = _ANGLE * unknowns[:-1].reshape(len(JOINTS), -1)
    return Adjustment(harmonics, float(_HEIGHT * unknowns[-1]))


def _walked(environment: WalkingEnvironment, trial: _Case) -> Deviations | None:
    task = environment.task
    reference = adjusted(task.reference, task.model, _correction(trial.unknowns))
    task = replace(task, reference=reference)
    validation = task.configuration.validation
    rollout = record_rollout(
        WalkingEnvironment(task),
        trial.policy,
        mu=trial.mu,
        start_phase=trial.start_phase,
        # The first and last strikes may be outside, and half a cycle of the other foot.
        cycles=validation.settling_cycles + validation.cycles + 2,
    )
    return deviations(rollout, task.record, task.model, task.configuration)


def correct(
    task: WalkingTask,
    policy: Policy,
    mu: Array,
    *,
    on_progress: Callable[[dict[str, float]], None] | None = None,
) -> Result:
    """Find the change of the reference that makes the walk of a policy most like the record.

    The rollouts are deterministic, without pushes, from the first of `validation.start_phases`. The
    correction is accepted only if it also improves a rollout from half a cycle later, which the
    search has not used.

    Parameters
    ----------
    mu : (14,) body parameters.
    on_progress : called after each round with `rounds`, `total` and `error`.
    """
    settings = task.configuration.correction
    start = task.configuration.validation.start_phases[0]
    unknowns = len(JOINTS) * (1 + 2 * settings.harmonics) + 1

    def progress(number: int, found: float) -> None:
        if on_progress is not None:
            on_progress({"rounds": number, "total": settings.rounds, "error": found})

    def allowed(point: Array) -> bool:
        return _correction(point).largest() <= settings.largest

    with RolloutPool(task, workers=task.configuration.training.workers) as pool:

        def walk_from(phase: float, points: Sequence[Array]) -> list[Deviations | None]:
            return pool.map(_walked, [_Case(policy, mu, each, phase) for each in points])

        none = np.zeros(unknowns)
        point, errors = search(
            lambda points: walk_from(start, points),
            unknowns,
            rounds=settings.rounds,
            allowed=allowed,
            on_round=progress,
        )
        without, with_it = walk_from((start + 0.5) % 1.0, [none, point])
        if without is None or with_it is None or error(with_it) >= error(without):
            point, errors = none, errors[:1]
        before, after = walk_from(start, [none, point])
    return Result(_correction(point), tuple(errors), before or {}, after or {})
