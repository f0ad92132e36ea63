"""Make a trained walker walk as its reference asks, by iterative learning control.

A policy follows its reference with errors that repeat in every cycle. A foot that is 3 mm too high
lands 10 ms late, which shifts all curves of its leg by 1 % of the cycle, but no reward resolves 3
mm. Such errors respond smoothly to small changes of the motion that the walker is given, so they
are removed by iterative learning control (Bristow, Tharayil, Alleyne 2006, IEEE Control Systems
26(3):96-114): walk, compare the mean curves with the reference, change the motion, walk again. The
changes are of the height of the pelvis and the lowest harmonics of hip, knee, ankle and trunk
angles; finite differences give the effect of each change on every curve, and the steps are
Gauss-Newton's, with Broyden's update of the slopes after each.

The target is the reference, not the record: data held out from the run stay held out, and errors of
the reference remain. A Gaussian prior holds every change near zero, so only changes that affect the
walk are free; their effective number is reported.

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
from gaitval.gait.cycle_curves import JOINT_ANGLES, JOINT_MOMENTS
from gaitval.journal import Journal
from gaitval.lanes import WIDTH
from gaitval.metrics.action_bias import reference_curves
from gaitval.metrics.comparison import curves_of, rms
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.record_results import Kind
from gaitval.metrics.recorded import by_kind
from gaitval.metrics.results import CorrectedCurve, CorrectionResult
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
"""Errors that weigh the same, in the units of `metrics.recorded.CURVE_UNITS`: of moments and forces
half the error of a prediction from other people, of angles the repeatability of a laboratory."""

_INDEPENDENT = 12
"""Independent numbers in a curve over the cycle: the harmonics below the 10 Hz of the filter."""
_ANGLE, _HEIGHT = np.deg2rad(0.4), 0.003
"""Standard deviation of the prior, rad and m: of each harmonic, and of the height."""
_PROBE = 0.75
"""Change of an unknown by which its effect is measured, in prior SDs: the effect is then several
times the scatter of mean curves between walks."""
_STEPS = 6
"""Largest number of steps with the same slopes, which cost ten times as many walks as a step."""
_SMALLEST_GAIN = 0.02
"""Relative decrease of the objective at which the steps end."""
_DAMPINGS = (0.0, 1.0, 10.0, 100.0, 1000.0)
"""Damping of a step, in units of the prior's weight. All of them are tried: a walk does not respond
linearly, so no rule gives the best one beforehand."""
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
    rmse: Mapping[tuple[Kind, str], float]
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
        """The walk from the `values` that `as_list` gave."""
        deviations, rmse, scatter = values
        return cls(np.array(deviations), {(kind, name): v for kind, name, v in rmse}, scatter)


Walk = Callable[[Sequence[Array]], Sequence[Walked | None]]
"""Walks at each of several points, (n,) in units of the prior's SD; None for one that fell."""


def fitted(kind: str, curve: str) -> bool:
    """Whether the correction fits a `curve` (with its side, such as `knee_angle_r`) of a `kind`
    (`angles`, `moments` or `forces`); the others only show whether it does harm.
    """
    return curve[:-2] in ACCURACY[kind]


def accuracy_of(kind: str, curve: str) -> float:
    """Error of weight 1 of a `fitted` curve (`kind`, `curve`), in the units of `CURVE_UNITS`."""
    return ACCURACY[kind][curve[:-2]]


@dataclass(frozen=True)
class Corrected:
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

    def result(self) -> CorrectionResult:
        """For `correction.json`; errors of curves are in the units of `CURVE_UNITS`."""
        before = self.before.rmse if self.before else {}
        after = self.after.rmse if self.after else {}
        return CorrectionResult(
            joints=list(JOINTS),
            harmonics=self.correction.harmonics.tolist(),
            height=self.correction.height,
            errors=list(self.errors),
            numbers=self.correction.harmonics.size + 1,
            effective_number=self.effective_number,
            refused=self.refused,
            curves=[
                CorrectedCurve(
                    kind=kind,
                    curve=name,
                    fitted=fitted(kind, name),
                    before=value,
                    after=after[kind, name],
                )
                for (kind, name), value in before.items()
            ],
        )


@dataclass(frozen=True)
class Optimum:
    """What a search found: the best point (n,), the error before and after each step, and the
    effective number of free unknowns (`effective_number`).
    """

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
) -> Optimum:
    """Minimise the deviations' sum of squares plus the prior's, starting from zero.

    Parameters
    ----------
    walk : walks at several points at once.
    unknowns : n.
    rounds : how often the slopes are measured.
    allowed : whether a point may be tried.
    on_round : called with the finished round and the error.
    """
    point = np.zeros(unknowns)

    def probing() -> list[Array]:
        return [point + _PROBE * each for each in np.eye(unknowns)]

    # In one call, so that all of these walks share the workers.
    found, *probes = walk([point, *(probing() if rounds else [])])
    if found is None:
        return Optimum(point, (), 0.0)
    errors, free = [found.error()], 0.0
    for number in range(rounds):
        if number > 0:
            probes = list(walk(probing()))
        # A walk that falls gives no slope. With a slope of zero the unknown is left where it is.
        answers = [
            0.0 * found.deviations
            if each is None
            else (each.deviations - found.deviations) / _PROBE
            for each in probes
        ]
        # (m, n): a column for each unknown, in prior SDs.
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
            # By objective, then by index: of equal steps the first is taken, and arrays are never
            # compared.
            best = min(walked, default=None, key=lambda each: each[:2])
            if best is None or best[0] >= least:
                break
            _, _, step, after = best
            change = after.deviations - found.deviations
            # Broyden's update: the smallest change of the slopes with which they would have
            # predicted what this step did. It saves measuring them again, n walks.
            slopes = slopes + np.outer(change - slopes @ step, step) / float(step @ step)
            point, found = point + step, after
            errors.append(found.error())
            if best[0] > (1.0 - _SMALLEST_GAIN) * least:
                break
        if on_round is not None:
            on_round(number + 1, errors[-1])
    return Optimum(point, tuple(errors), free)


def _objective(found: Walked, point: Array) -> float:
    return float(found.deviations @ found.deviations + point @ point)


def effective_number(slopes: Array) -> float:
    """Numbers that a linear answer leaves free under a prior of SD 1 of each, 0 to n: the trace of
    the matrix from the deviations to the fitted ones (Hastie, Tibshirani, Friedman 2009, 3.50).
    `slopes` (m, n) are derivatives of the deviations by the unknowns in prior SDs.
    """
    # Σ d² / (d² + 1) over the singular values d: a direction that the walk determines better than
    # the prior counts almost 1, one that it does not almost 0.
    squares = np.linalg.svd(slopes, compute_uv=False) ** 2
    return float(np.sum(squares / (squares + 1.0)))


def _steps(slopes: Array, found: Walked, point: Array) -> list[Array]:
    """Gauss-Newton steps with each of `_DAMPINGS` and `_LENGTHS`, from the longest on."""
    # Gradient of half the objective: slopesᵀ deviations + point, the second from the prior, whose
    # weight of 1 is also the 1.0 on the diagonal.
    normal, right = slopes.T @ slopes, slopes.T @ found.deviations + point
    steps = [
        np.asarray(-np.linalg.solve(normal + (1.0 + damping) * np.eye(len(point)), right), float)
        for damping in _DAMPINGS
    ]
    return [length * step for step in steps for length in _LENGTHS]


def beside_reference(
    environment: WalkingEnvironment, cases: Sequence["Case"]
) -> list["Walked | None"]:
    """Walk with at most eight changed references side by side (`cases`, of one policy and body),
    each beside the unchanged one of `environment`; None for a walker that fell.
    """
    task, first = environment.task, cases[0]
    tasks = [
        replace(task, reference=adjusted(task.reference, task.reference_body, case.correction))
        for case in cases
    ]
    rollouts = record_together(
        # A group always has eight, so that its rounding is the same.
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
    parts, scatters = [], []
    errors: dict[tuple[Kind, str], float] = {}
    for kind, curves in wanted.items():
        for name, curve in curves.items():
            mean = walked[kind][name].mean(axis=0)
            errors[kind, name] = rms(mean - curve)
            if fitted(kind, name):
                # A curve has 101 samples but is worth 12 independent numbers: so weighted, its sum
                # of squares is 12 where it is off by its accuracy throughout.
                weight = float(np.sqrt(_INDEPENDENT / len(curve))) / accuracy_of(kind, name)
                parts.append(weight * (mean - curve))
            else:
                scatters.append(rms(walked[kind][name] - mean))
    return Walked(np.concatenate(parts), errors, rms(np.array(scatters)))


@dataclass(frozen=True)
class Case:
    """One walk: a policy, body parameters mu (14,), a correction of the reference, and the phase of
    the right gait cycle at its start (`start_phase`).
    """

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
) -> Corrected:
    """Find the change of the reference with which a policy walks most like the reference.

    The walks are deterministic, without pushes, from the first of `validation.start_phases`. The
    correction is used only if a walk from half a cycle later, which the search has not seen, gets
    better too, and if the pelvis's angles, which it does not look at, get no worse in either walk
    by more than its cycles differ.

    Parameters
    ----------
    task : body, reference and constants.
    policy : the trained policy; it is not changed.
    mu : (14,) body parameters.
    rounds : how often slopes are measured, instead of `correction.rounds`.
    journal : keeps every walk; an interrupted call is continued from it, with the same result.
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
    # Order of `walked`: uncorrected and corrected from the start phase, then the same from half a
    # cycle later.
    if point.any() and (refused := harm(*walked)):
        point = none
    before = walked[0]
    after = walked[1] if refused is None else before
    number = found.effective_number
    return Corrected(_correction(point), found.errors, number, refused, before, after)


def harm(
    before: Walked | None,
    after: Walked | None,
    before_other: Walked | None,
    after_other: Walked | None,
) -> str | None:
    """Why a correction is not to be used; None if it may be. `before` and `after` are walks without
    and with it from the phase that the search used, None if one fell; `before_other` and
    `after_other` are the same from another start phase.
    """
    if before is None or after is None or before_other is None or after_other is None:
        return "a walk from another start phase fell"
    if after_other.error() >= before_other.error():
        return "a walk from another start phase gets no better"
    # A difference smaller than between the cycles of one walk is no harm.
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
