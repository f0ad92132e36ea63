"""Make a trained walker walk as its reference asks, by iterative learning control.

A policy follows its reference with errors that repeat in every cycle. A foot that is 3 mm too high
lands 10 ms late, which shifts all curves of its leg by 1 % of the cycle, but no reward resolves 3
mm. Such errors respond smoothly to small changes of the motion that the walker is given, so they
are removed by iterative learning control (Bristow, Tharayil, Alleyne 2006, IEEE Control Systems
26(3):96-114): walk, compare the mean curves with the reference, change the motion, walk again. The
changes are of the height of the pelvis and the lowest harmonics of hip, knee, ankle and trunk
angles. How curves answer is known from other people's walks and learned from every walk of the
search (`slopes`); the steps are Gauss-Newton's.

The target is the reference, moved a part of the way (`CORRECTION.to_record`,
`CORRECTION.to_estimate`, `CORRECTION.to_prediction`) to the record that it was fitted to, if that
is given. A walk obeys the laws of motion anyway, so it can have part of what the fit gave up for
them. Data held out from the run stay held out. A Gaussian prior holds every change near zero, so
only changes that affect the walk are free; their effective number is reported.

Policy, body and physics are unchanged, and nothing supports the body: it is the same walker, given
a motion that differs from the reference by about a degree. Even so it can fall after a minute where
it did not before, so a correction is used only if it walks as far from every start phase.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import chain
from typing import Final

import numpy as np

from gaitval._internal.numba.lanes import WIDTH
from gaitval.arrays import Array
from gaitval.correction.slopes import Slopes, shared_slopes
from gaitval.correction.walked import (
    ACCURACY,
    Accuracies,
    Walked,
    accuracy_of,
    fitted,
)
from gaitval.gait.cycle_curves import recorded_curves
from gaitval.gait.record import GaitRecord
from gaitval.gait.sampling import SAMPLES
from gaitval.metrics.comparison import curves_of, rms
from gaitval.metrics.curve_results import Kind, by_kind
from gaitval.metrics.cycles import find_cycles
from gaitval.metrics.reference_curves import reference_curves
from gaitval.metrics.results import CorrectedCurve, CorrectionResult, Endurance
from gaitval.metrics.rollouts import walked_far
from gaitval.policy.environment import WalkingEnvironment
from gaitval.policy.observation import targets_of
from gaitval.policy.rollouts import RolloutPool, in_groups, record_together
from gaitval.policy.storage import Policy
from gaitval.policy.walking_group import WalkingGroup
from gaitval.walk.reference.adjustment import JOINTS, Adjustment, adjusted
from gaitval.walk.simulation.rollout import Rollout
from gaitval.walk.simulation.walker import WalkingTask


@dataclass(frozen=True)
class CorrectionSettings:
    """How a walk is corrected after its training."""

    independent: int = 12
    """Independent numbers in a curve over the cycle: the harmonics below the 10 Hz of the
    filter."""
    angle: float = np.deg2rad(0.4)
    height: float = 0.003
    """Standard deviation of the prior, rad and m: of a harmonic, and of the height."""
    flat: int = 4
    """Harmonics above this have a prior of the same angular acceleration: without, forces ring."""
    shares: tuple[float, float, float] = (1.0, 0.7, 0.4)
    """Shares of the change that was found. The largest one that does no harm is used."""
    to_record: float = 0.3
    to_estimate: float = 1.0
    to_prediction: float = 1.0
    """Of the way, with the person's own kinetics, which contradict one another, and with estimated
    and predicted ones, which do so less. Chosen by walks of people that no table contains
    (docs/what-we-tried.md); of predictions by walks of held-out trials (docs/what-we-tried.md)."""
    towards_prediction: float = 2.0
    """How many times as free a change is towards a prediction: there is more to make up for."""
    cycles: int = 8
    """Cycles of a walk that are averaged."""


CORRECTION: Final = CorrectionSettings()


@dataclass(frozen=True)
class Corrected:
    """A correction and its effect.

    Attributes
    ----------
    errors : `Walked.error` before and after each step; empty if the uncorrected walker fell.
    share : of the change that was found, the part that is used; see `CORRECTION.shares`.
    effective_number : of free numbers, of `Adjustment.harmonics` and height: trace of the matrix
        that takes a curve's deviations to the fitted ones.
    refused : why a correction that was found is not used; None if it is, or none was found.
    before, after : without and with it; None if the uncorrected walker fell.
    starts : how far the walker gets with it from each of `validation.start_phases`.
    """

    correction: Adjustment
    errors: tuple[float, ...]
    share: float
    effective_number: float
    refused: str | None
    before: Walked | None
    after: Walked | None
    starts: tuple[Endurance, ...]

    def result(self) -> CorrectionResult:
        """For `correction.json`; errors of curves are in the units of `CURVE_UNITS`."""
        before = self.before.rmse if self.before else {}
        after = self.after.rmse if self.after else {}
        return CorrectionResult(
            joints=list(JOINTS),
            harmonics=self.correction.harmonics.tolist(),
            height=self.correction.height,
            errors=list(self.errors),
            share=self.share,
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


def beside_reference(
    environment: WalkingEnvironment,
    cases: Sequence["CorrectedWalk"],
    to_record: float = 0.0,
    accuracies: Accuracies = ACCURACY,
) -> list["Walked | None"]:
    """Walk with at most eight changed references side by side (`cases`, of one policy and body),
    each beside the unchanged one of `environment`, or `to_record` of the way to the record, with
    errors over `accuracies`; None for a walker that fell.
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
        cycles=task.configuration.validation.settling_cycles + CORRECTION.cycles + 2,
    )
    wanted = target(task, to_record)
    return [_compared(task, rollout, wanted, accuracies) for rollout in rollouts]


def target(task: WalkingTask, to_record: float) -> dict[Kind, dict[str, Array]]:
    """Curves that a walk is to have, by kind and name, in the units of `CURVE_UNITS`: those of the
    reference of `task`, of which those that are fitted are moved `to_record`, that part of the way,
    towards those of its record. The others show whether a correction does harm.
    """
    curves = by_kind(reference_curves(task.reference, task.model.mass, task.record.left_phase))
    if to_record:
        for kind, recorded in by_kind(recorded_curves(task.record)).items():
            for name, curve in recorded.items():
                if fitted(kind, name):
                    curves[kind][name] += to_record * (curve - curves[kind][name])
    return curves


def _compared(
    task: WalkingTask,
    rollout: Rollout,
    wanted: Mapping[Kind, Mapping[str, Array]],
    accuracies: Accuracies,
) -> Walked | None:
    """A walk beside the curves that are wanted; None if it fell."""
    cycles = find_cycles(rollout, task.configuration).first(CORRECTION.cycles)
    if rollout.fell[0] or min(cycles.count("right"), cycles.count("left")) < CORRECTION.cycles:
        return None
    walked = by_kind(curves_of(task, rollout, cycles))
    parts = []
    errors: dict[tuple[Kind, str], float] = {}
    for kind, curves in wanted.items():
        for name, curve in curves.items():
            mean = walked[kind][name].mean(axis=0)
            errors[kind, name] = rms(mean - curve)
            if fitted(kind, name):
                # A curve has 101 samples but is worth 12 independent numbers: so weighted, its sum
                # of squares is 12 where it is off by its accuracy throughout.
                weight = float(np.sqrt(CORRECTION.independent / len(curve)))
                weight /= accuracy_of(kind, name, accuracies)
                parts.append(weight * (mean - curve))
    return Walked(np.concatenate(parts), errors, accuracies)


@dataclass(frozen=True)
class CorrectedWalk:
    """One walk: a policy, body parameters mu (14,), a correction of the reference, and the phase of
    the right gait cycle at its start (`start_phase`).
    """

    policy: Policy
    mu: Array
    correction: Adjustment
    start_phase: float


def _walks(
    pool: RolloutPool,
    to_record: float,
    cases: Sequence[CorrectedWalk],
    accuracies: Accuracies = ACCURACY,
) -> Iterator[Walked | None]:
    """`beside_reference` of any number of cases."""
    walk = partial(beside_reference, to_record=to_record, accuracies=accuracies)
    # What goes before and after the walks of a group takes as long as they: workers share it.
    return chain.from_iterable(pool.each(walk, in_groups(cases, pool.workers)))


def correction_of(numbers: Array) -> Adjustment:
    """The change that has these `numbers` (13 + 26 H + 1,), rad and m."""
    return Adjustment(numbers[:-1].reshape(len(JOINTS), -1), float(numbers[-1]))


def prior_sd(harmonics: int) -> Array:
    """Standard deviations (13 + 26 H + 1,), rad and m, of a change with H `harmonics`."""
    waves = np.minimum(1.0, (CORRECTION.flat / np.arange(1.0, harmonics + 1.0)) ** 2)
    return np.append(
        np.tile(CORRECTION.angle * np.concatenate([[1.0], waves, waves]), len(JOINTS)),
        CORRECTION.height,
    )


def _falls(starts: Sequence[Endurance]) -> int:
    return sum(each.fell for each in starts)


def correct(
    task: WalkingTask,
    policy: Policy,
    mu: Array,
    *,
    target_record: GaitRecord | None = None,
    to_record: float = CORRECTION.to_record,
    accuracies: Accuracies = ACCURACY,
    freedom: float = 1.0,
    slopes: Slopes | None = None,
    on_progress: Callable[[dict[str, float]], None] | None = None,
) -> Corrected:
    """Find the change of the reference with which a policy walks most like its target.

    The walks are deterministic, without pushes, from the first of `validation.start_phases`. The
    correction is used only if `search.harm` finds none in a walk from half a cycle later, which the
    search has not seen, and if of long walks (`rollouts.walked_far`) no more fall than without it.
    Otherwise smaller shares of it are tried, after a fall from twice as many starts.

    `task` has body, reference and constants; the trained `policy` is not changed; `mu` (14,) are
    body parameters. `target_record` is the record that the reference was fitted to, with the
    person's own or estimated kinetics, to which the target goes a part of the way, `to_record`;
    without it the target is the reference alone. Errors weigh by `accuracies`; `freedom` is how
    many times as large a change the prior expects. `slopes`, of errors over `ACCURACY` by rad and
    m, are what is known of them beforehand, by default what other people's walks say. `on_progress`
    is called after each step with `steps`, `total` and `error`.
    """
    settings = task.configuration.correction
    if target_record is None:
        to_record = 0.0
    else:
        task = replace(task, record=target_record)
    phases = tuple(task.configuration.validation.start_phases)
    start = phases[0]
    sd = freedom * prior_sd(settings.harmonics)

    def progress(number: int, found: float) -> None:
        if on_progress is not None:
            on_progress({"steps": number, "total": settings.steps, "error": found})

    with RolloutPool(task, workers=task.configuration.training.workers) as pool:

        def walk(points: Sequence[Array], *phases: float) -> list[Walked | None]:
            """At every point from each phase."""
            cases = [
                CorrectedWalk(policy, mu, correction_of(sd * point), phase)
                for phase in phases
                for point in points
            ]
            return list(_walks(pool, to_record, cases, accuracies))

        @cache
        def far(used: int, start: tuple[float, ...]) -> tuple[Endurance, ...]:
            change = correction_of(sd * points[used])
            changed = adjusted(task.reference, task.reference_body, change)
            return walked_far(pool.with_task(replace(task, reference=changed)), policy, mu, start)

        from gaitval.correction.search import search

        none = np.zeros_like(sd)
        speed = targets_of(task.reference, task.model).speed
        known = slopes or shared_slopes(speed, settings.harmonics, len(JOINTS), SAMPLES)
        if accuracies is not ACCURACY:
            known = known.reweighted(_by_accuracy(task, accuracies))
        found = search(
            lambda points: walk(points, start),
            known.scaled(sd),
            steps=settings.steps,
            allowed=lambda point: correction_of(sd * point).largest() <= settings.largest,
            on_step=progress,
        )
        # Without it and with each share of it, from the start phase and from half a cycle later:
        # eight walks, which take no longer than one.
        points = [none, *(share * found.point for share in CORRECTION.shares)]
        walks = walk(points, start, (start + 0.5) % 1.0)
        used, starts, refused = _usable(walks, points, far, phases)
    return Corrected(
        correction=correction_of(sd * points[used]),
        errors=found.errors,
        share=(0.0, *CORRECTION.shares)[used],
        effective_number=found.effective_number if settings.steps else 0.0,
        refused=refused,
        before=walks[0],
        after=walks[used],
        starts=starts[: len(phases)],
    )


def _by_accuracy(task: WalkingTask, accuracies: Accuracies) -> Array:
    """By how much every deviation is larger than over `ACCURACY`."""
    factors = [
        np.full(len(curve), accuracy_of(kind, name) / accuracy_of(kind, name, accuracies))
        for kind, curves in target(task, 0.0).items()
        for name, curve in curves.items()
        if fitted(kind, name)
    ]
    return np.concatenate(factors)


def _usable(
    walks: Sequence[Walked | None],
    points: Sequence[Array],
    far: Callable[[int, tuple[float, ...]], tuple[Endurance, ...]],
    phases: tuple[float, ...],
) -> tuple[int, tuple[Endurance, ...], str | None]:
    """The first of `points` that does no harm, its long walks, and why all are refused if they are.

    Point 0 is no change, which is used if all others do harm. `walks` are at every point from the
    start phase, and then from half a cycle later; `far` walks far at a point's number from given
    phases, at first `phases`.
    """
    from gaitval.correction.search import harm

    here, other = walks[: len(points)], walks[len(points) :]
    starting, refused = phases, None
    for used in range(1, len(points)):
        refused = None
        if points[used].any():
            refused = harm(here[0], here[used], other[0], other[used])
        if refused is None:
            starts = far(used, starting)
            falls = _falls(starts)
            before = _falls(far(0, starting)) if falls else 0
            if falls <= before:
                return used, starts, None
            refused = f"{falls} of {len(starts)} long walks fall with it, {before} without"
            # Near a fall it is luck from which it falls: as many that no validation walks from.
            starting = (*phases, *((phase + 0.5 / len(phases)) % 1.0 for phase in phases))
    return 0, far(0, phases), refused
