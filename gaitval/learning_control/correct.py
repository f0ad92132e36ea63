"""Make a trained walker walk as its reference asks, by iterative learning control.

A policy follows its reference with errors that repeat in every cycle. A foot that is 3 mm too high
lands 10 ms late, which shifts all curves of its leg by 1 % of the cycle, but no reward resolves 3
mm. Such errors respond smoothly to small changes of the motion that the walker is given, so they
are removed by iterative learning control (Bristow, Tharayil, Alleyne 2006, IEEE Control Systems
26(3):96-114): walk, compare the mean curves with the reference, change the motion, walk again. The
changes are of the height of the pelvis and the lowest harmonics of hip, knee, ankle and trunk
angles; finite differences give the effect of each change on every curve, and the steps are
Gauss-Newton's, with Broyden's update of the slopes after each.

The target is the reference, not the record: what a run is not told of a record, this is not told
either, and errors of the reference stay. A Gaussian prior holds every change near zero, so that
only those numbers are free that the walk answers to; how many that are is reported.

Policy, body and physics are unchanged, and nothing supports the body: it is the same walker, given
a motion that differs from the reference by about a degree.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Any, Final

import numpy as np

from gaitval.arrays import Array
from gaitval.journal import Journal
from gaitval.lanes import WIDTH
from gaitval.metrics.comparison import (
    JOINT_ANGLES,
    JOINT_MOMENTS,
    curves_of,
    rms,
)
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.habit import reference_curves
from gaitval.metrics.recorded import by_kind
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.rollouts import RolloutPool, in_groups, record_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.reference.adjustment import JOINTS, Adjustment, adjusted
from gaitval.simulation.rollout import Rollout
from gaitval.simulation.walker import WalkingTask

ACCURACY: Final[Mapping[str, Mapping[str, float]]] = {
    "angles": {
        **dict.fromkeys(JOINT_ANGLES, 2.0),
        "hip_rotation": 4.0,
        "subtalar_angle": 4.0,
    },
    "moments": dict.fromkeys(JOINT_MOMENTS, 0.06),
    "forces": {"vertical": 2.5, "forward": 0.8, "medial": 0.6},
}
"""Errors that weigh the same, in the units of `metrics.recorded.CURVE_UNITS`: moments and forces
half of what a prediction from other people misses by, angles what a laboratory repeats."""

_INDEPENDENT = 12
"""Numbers that a curve over the cycle is worth: the harmonics that 10 Hz leave it."""
_ANGLE, _HEIGHT = np.deg2rad(0.4), 0.003
"""Standard deviation of the prior, rad and m: of each harmonic, and of the height."""
_PROBE = 0.75
"""Change of an unknown that measures its effect, in its prior's SD: several times the scatter
between walks of the means over the cycles."""
_STEPS = 6
"""Largest number of steps with the same slopes, which cost ten times as many walks as a step."""
_SMALLEST_GAIN = 0.02
"""Relative decrease of the objective at which the steps end."""
_DAMPINGS = (0.0, 1.0, 10.0, 100.0, 1000.0)
"""Damping of a step, in units of the prior's weight. All of them are tried: the walk's answer is
not linear, so no rule says which is best."""
_LENGTHS = (1.0, 0.5, 0.25)
"""Fractions of each step that are tried."""
_CYCLES = 8
"""Cycles of a walk that are averaged."""


@dataclass(frozen=True)
class Walked:
    """A walk beside its reference.

    Attributes
    ----------
    deviations : (n,) of the mean fitted curves, over `ACCURACY`; their sum of squares counts
        `_INDEPENDENT` for a curve that is off by its accuracy throughout.
    rmse : by (kind, curve), in the units of `metrics.recorded.CURVE_UNITS`; also of curves that are
        not fitted, the pelvis's angles.
    scatter : degrees, RMS difference of one cycle's angles of the pelvis from their means.
    """

    deviations: Array
    rmse: Mapping[tuple[str, str], float]
    scatter: float

    def error(self) -> float:
        """Root mean square over the fitted curves of error / accuracy."""
        squares = [(self.rmse[key] / accuracy_of(*key)) ** 2 for key in self.rmse if fitted(*key)]
        return float(np.sqrt(np.mean(squares)))

    def left_out(self) -> float:
        """RMS error of the curves that are not fitted, degrees."""
        return float(np.sqrt(np.mean([v**2 for key, v in self.rmse.items() if not fitted(*key)])))

    def as_list(self) -> list[Any]:
        """For a `Journal`; `from_list` gives the same numbers bit for bit."""
        return [self.deviations.tolist(), [[*key, v] for key, v in self.rmse.items()], self.scatter]

    @classmethod
    def from_list(cls, values: Sequence[Any]) -> "Walked":
        """What `as_list` gave."""
        deviations, rmse, scatter = values
        return cls(np.array(deviations), {(kind, name): v for kind, name, v in rmse}, scatter)


Walk = Callable[[Sequence[Array]], Sequence[Walked | None]]
"""Walks at each of several points, (n,) in units of the prior's SD; None for one that fell."""


def fitted(kind: str, curve: str) -> bool:
    """Whether the correction looks at a curve; the others tell whether it does harm."""
    return curve[:-2] in ACCURACY[kind]


def accuracy_of(kind: str, curve: str) -> float:
    """The error of a curve that weighs 1."""
    return ACCURACY[kind][curve[:-2]]


@dataclass(frozen=True)
class Result:
    """A correction and its effect.

    Attributes
    ----------
    errors : `Walked.error` before and after each step; empty if the uncorrected walker fell.
    effective_number : of free numbers, of `Adjustment.harmonics` and height: trace of the matrix
        that takes a curve's deviations to the fitted ones.
    refused : why a correction that was found is not used; None if it is, or none was found.
    before, after : without and with it; None if the uncorrected walker fell.
    """

    correction: Adjustment
    errors: tuple[float, ...]
    effective_number: float
    refused: str | None
    before: Walked | None
    after: Walked | None

    def as_dict(self) -> dict[str, Any]:
        """For `correction.json`; errors of curves are in the units of `CURVE_UNITS`."""
        before = self.before.rmse if self.before else {}
        after = self.after.rmse if self.after else {}
        return {
            **self.correction.as_dict(),
            "errors": list(self.errors),
            "numbers": self.correction.harmonics.size + 1,
            "effective_number": self.effective_number,
            "refused": self.refused,
            "curves": [
                {
                    "kind": key[0],
                    "curve": key[1],
                    "fitted": fitted(*key),
                    "before": value,
                    "after": after[key],
                }
                for key, value in before.items()
            ],
        }


@dataclass(frozen=True)
class Found:
    """What a search found: the best point (n,), errors, and the number of free numbers."""

    point: Array
    errors: tuple[float, ...]
    effective_number: float


def search(
    walk: Walk,
    unknowns: int,
    *,
    rounds: int,
    allowed: Callable[[Array], bool],
    on_round: Callable[[int, float], None] | None = None,
) -> Found:
    """Minimise the deviations' sum of squares plus the prior's, starting from zero.

    Parameters
    ----------
    unknowns : n.
    rounds : how often the slopes are measured.
    allowed : whether a point may be tried.
    on_round : called with the finished round and the error.
    """
    point = np.zeros(unknowns)

    def probing() -> list[Array]:
        return [point + _PROBE * each for each in np.eye(unknowns)]

    found, *probes = walk([point, *(probing() if rounds else [])])
    if found is None:
        return Found(point, (), 0.0)
    errors, free = [found.error()], 0.0
    for number in range(rounds):
        if number > 0:
            probes = list(walk(probing()))
        # A walk with a fall says nothing about its unknown, which is then left unchanged.
        answers = [
            0.0 * found.deviations
            if each is None
            else (each.deviations - found.deviations) / _PROBE
            for each in probes
        ]
        slopes = np.column_stack(answers)
        free = effective_number(slopes)
        for _ in range(_STEPS):
            steps = [each for each in _steps(slopes, found, point) if allowed(point + each)]
            walked = [
                (_objective(each, point + step), index, step, each)
                for index, (step, each) in enumerate(
                    zip(steps, walk([point + step for step in steps]), strict=True)
                )
                if each is not None
            ]
            least = _objective(found, point)
            best = min(walked, default=None, key=lambda each: each[:2])
            if best is None or best[0] >= least:
                break
            _, _, step, after = best
            change = after.deviations - found.deviations
            slopes = slopes + np.outer(change - slopes @ step, step) / float(step @ step)
            point, found = point + step, after
            errors.append(found.error())
            if best[0] > (1.0 - _SMALLEST_GAIN) * least:
                break
        if on_round is not None:
            on_round(number + 1, errors[-1])
    return Found(point, tuple(errors), free)


def _objective(found: Walked, point: Array) -> float:
    return float(found.deviations @ found.deviations + point @ point)


def effective_number(slopes: Array) -> float:
    """Numbers that a linear answer (m, n) leaves free under a prior of SD 1 of each: the trace of
    the matrix from the deviations to the fitted ones (Hastie, Tibshirani, Friedman 2009, 3.50).
    """
    squares = np.linalg.svd(slopes, compute_uv=False) ** 2
    return float(np.sum(squares / (squares + 1.0)))


def _steps(slopes: Array, found: Walked, point: Array) -> list[Array]:
    """Gauss-Newton steps with each of `_DAMPINGS` and `_LENGTHS`, from the longest on."""
    normal, right = slopes.T @ slopes, slopes.T @ found.deviations + point
    steps = [
        np.asarray(-np.linalg.solve(normal + (1.0 + damping) * np.eye(len(point)), right), float)
        for damping in _DAMPINGS
    ]
    return [length * step for step in steps for length in _LENGTHS]


def beside_reference(
    environment: WalkingEnvironment, cases: Sequence["Case"]
) -> list["Walked | None"]:
    """Walk with at most eight changed references side by side, each beside the unchanged one; None
    for a walker that fell.

    Parameters
    ----------
    environment : with the unchanged reference.
    cases : of one policy and body.
    """
    task, first = environment.task, cases[0]
    tasks = [
        replace(task, reference=adjusted(task.reference, task.reference_body, case.correction))
        for case in cases
    ]
    rollouts = record_together(
        WalkingGroup(tasks + tasks[-1:] * (WIDTH - len(tasks))),
        first.policy,
        mu=first.mu,
        start_phases=[case.start_phase for case in cases],
        # The first and last strikes may be outside, and half a cycle of the other foot.
        cycles=task.configuration.validation.settling_cycles + _CYCLES + 2,
    )
    return [_compared(task, rollout) for rollout in rollouts]


def _compared(task: WalkingTask, rollout: Rollout) -> Walked | None:
    """A walk beside the task's reference; None if it fell."""
    cycles = find_cycles(rollout, task.configuration).first(_CYCLES)
    if rollout.fell[0] or min(cycles.count("right"), cycles.count("left")) < _CYCLES:
        return None
    walked = by_kind(curves_of(task, rollout, cycles))
    wanted = by_kind(reference_curves(task.reference, task.model.mass, task.record.left_phase))
    parts, errors, scatters = [], {}, []
    for kind, curves in wanted.items():
        for name, curve in curves.items():
            mean = walked[kind][name].mean(axis=0)
            errors[kind, name] = rms(mean - curve)
            if fitted(kind, name):
                weight = float(np.sqrt(_INDEPENDENT / len(curve))) / accuracy_of(kind, name)
                parts.append(weight * (mean - curve))
            else:
                scatters.append(rms(walked[kind][name] - mean))
    return Walked(np.concatenate(parts), errors, rms(np.array(scatters)))


@dataclass(frozen=True)
class Case:
    """A walk: a policy, body parameters mu (14,), a change of the reference, a start phase."""

    policy: Policy
    mu: Array
    correction: Adjustment
    start_phase: float


def _walks(pool: RolloutPool, cases: Sequence[Case]) -> Iterator[Walked | None]:
    """`beside_reference` of any number of cases."""
    return chain.from_iterable(pool.each(beside_reference, in_groups(cases)))


def _correction(point: Array) -> Adjustment:
    """The change at a point, (13 + 26 H + 1,) in units of the prior's SD."""
    harmonics = _ANGLE * point[:-1].reshape(len(JOINTS), -1)
    return Adjustment(harmonics, float(_HEIGHT * point[-1]))


def correct(
    task: WalkingTask,
    policy: Policy,
    mu: Array,
    *,
    rounds: int | None = None,
    journal: Journal | None = None,
    on_progress: Callable[[dict[str, float]], None] | None = None,
) -> Result:
    """Find the change of the reference with which a policy walks most like the reference.

    The walks are deterministic, without pushes, from the first of `validation.start_phases`. The
    correction is used only if a walk from half a cycle later, which the search has not seen, gets
    better too, and if the pelvis's angles, which it does not look at, get no worse in either walk
    by more than its cycles differ.

    Parameters
    ----------
    mu : (14,) body parameters.
    rounds : how often slopes are measured, instead of `correction.rounds`.
    journal : keeps every walk; one that an interrupted call has left is gone on with, to the same
        result.
    on_progress : called after each round with `rounds`, `total` and `error`.
    """
    settings = task.configuration.correction
    wanted = settings.rounds if rounds is None else rounds
    start = task.configuration.validation.start_phases[0]
    unknowns = len(JOINTS) * (1 + 2 * settings.harmonics) + 1

    def progress(number: int, found: float) -> None:
        if on_progress is not None:
            on_progress({"rounds": number, "total": wanted, "error": found})

    def allowed(point: Array) -> bool:
        return _correction(point).largest() <= settings.largest

    journal = journal or Journal()
    with RolloutPool(task, workers=task.configuration.training.workers) as pool:

        def walk(points: Sequence[Array], *phases: float) -> list[Walked | None]:
            """At every point from each phase."""
            return journal.results(
                partial(_walks, pool),
                [
                    Case(policy, mu, _correction(point), phase)
                    for phase in phases
                    for point in points
                ],
                write=lambda walked: None if walked is None else walked.as_list(),
                read=lambda values: None if values is None else Walked.from_list(values),
            )

        found = search(
            lambda points: walk(points, start),
            unknowns,
            rounds=wanted,
            allowed=allowed,
            on_round=progress,
        )
        none = np.zeros(unknowns)
        walked = walk([none, found.point], start, (start + 0.5) % 1.0)
    point, refused = found.point, None
    if point.any() and (refused := harm(*walked)):
        point = none
    before = walked[0]
    after = walked[1] if refused is None else before
    number = found.effective_number
    return Result(_correction(point), found.errors, number, refused, before, after)


def harm(
    before: Walked | None,
    after: Walked | None,
    before_other: Walked | None,
    after_other: Walked | None,
) -> str | None:
    """Why a correction is not to be used, from walks without and with it from two start phases;
    None if it may be.
    """
    if before is None or after is None or before_other is None or after_other is None:
        return "a walk from another start phase fell"
    if after_other.error() >= before_other.error():
        return "a walk from another start phase gets no better"
    scatter = max(before.scatter, before_other.scatter)
    worse = max(
        after.left_out() - before.left_out(), after_other.left_out() - before_other.left_out()
    )
    if worse > scatter:
        return (
            f"the pelvis's angles, which are not fitted, get {worse:.2f} degrees worse; cycles "
            f"differ by {scatter:.2f}"
        )
    return None
